# Finds and loads libmjenv.so, and turns its errors into exceptions.

using Libdl: Libdl, dlopen, dlpath, dlsym

const REPOSITORY = normpath(@__DIR__, "..", "..", "..")
const BUILD = "cmake -G Ninja -B build && cmake --build build"

# Without RTLD_DEEPBIND, which is in Julia's default: with it the library would bind to another copy of the unwinder
# than the process uses, and C++ exceptions would crash.
const DLOPEN_FLAGS = Libdl.RTLD_NOW | Libdl.RTLD_LOCAL

const library = Ref{Ptr{Cvoid}}(C_NULL)
const addresses = fill(C_NULL, length(FUNCTIONS))

# A system image may have kept the addresses of the process that built it.
function __init__()
    library[] = C_NULL
    fill!(addresses, C_NULL)
    isdefined(Base, :get_extension) || watch_packages()
    return
end

# Returns the address of FUNCTIONS[index]. The first call looks it up.
@inline function address(index)
    found = addresses[index]
    return found == C_NULL ? resolve(index) : found
end

@noinline function resolve(index)
    library[] == C_NULL && (library[] = load())
    found = dlsym(library[], FUNCTIONS[index]; throw_error = false)
    if found === nothing
        error("$(dlpath(library[])) lacks $(FUNCTIONS[index]): it is older than this package. Rebuild it: $BUILD")
    end
    return addresses[index] = found
end

function load()
    given = get(ENV, "MJENV_LIBRARY", "")
    built = joinpath(REPOSITORY, "build", "libmjenv.so")
    # The package of a release contains the library.
    carried = normpath(@__DIR__, "..", "lib", "libmjenv.so")
    paths = !isempty(given) ? [given] : isfile(carried) ? [carried] : [built, "libmjenv.so.$MJENV_ABI_VERSION"]
    reasons = String[]
    for path in paths
        handle = try
            dlopen(path, DLOPEN_FLAGS)
        catch reason
            push!(reasons, "  $path: $(sprint(showerror, reason))")
            continue
        end
        abi = ccall(dlsym(handle, :mjenv_abi_version), UInt32, ())
        abi == MJENV_ABI_VERSION && return handle
        push!(reasons, "  $path: it has ABI version $abi, this package needs $MJENV_ABI_VERSION")
    end
    error(
        "the mjenv library was not found:\n", join(reasons, '\n'),
        "\nBuild it in the repository ($BUILD), or set ENV[\"MJENV_LIBRARY\"] to the path of libmjenv.so.",
    )
end

"The result of a call of the C library, or of one row in it: `MJEnv.MJENV_OK`, `MJEnv.MJENV_E_VALUE` and so on."
const Status = mjenv_status

"""
    MJEnvError

The C library refused a call, or failed. The field `status` is an `MJEnv.Status` such as `MJEnv.MJENV_E_VALUE`; programs
should decide by it. The field `message` is for people: it names the wrong argument and, where there are some, the valid
choices. The message counts rows and elements from 0.
"""
struct MJEnvError <: Exception
    status::Status
    message::String
end

Base.showerror(io::IO, e::MJEnvError) = print(io, "MJEnvError (", e.status, "): ", e.message)

# Call it directly after the library: each thread has a last message of its own, which its next failing call replaces.
@inline check(status::Status) = status == MJENV_OK ? nothing : fail(status)
@noinline fail(status::Status) = throw(MJEnvError(status, unsafe_string(mjenv_last_error())))

# A text for C, which ends texts at a NUL character.
function text(name::Union{AbstractString,Symbol})
    '\0' in String(name) && throw(ArgumentError("$(repr(String(name))) contains a NUL character"))
    return String(name)
end

borrowed(name::Cstring) = name == C_NULL ? "" : unsafe_string(name)

"""
    MJEnv.version()

Returns the versions of the library and of MuJoCo as text: `"major.minor.patch (MuJoCo x.y.z)"`.
"""
version() = unsafe_string(mjenv_version())

"""
    MJEnv.ids()

Returns the ids of all environments as texts, sorted.
"""
ids() = [unsafe_string(mjenv_id_at(i)) for i in 0:(mjenv_id_count() - 1)]
