# Finding and loading libmjenv.so, and its errors.

using Libdl: Libdl, dlopen, dlpath, dlsym

const REPOSITORY = normpath(@__DIR__, "..", "..", "..")
const BUILD = "cmake -G Ninja -B build && cmake --build build"

# Not Julia's default, RTLD_DEEPBIND: in a process with an unwinder of its own, C++ exceptions would meet two of them.
const DLOPEN_FLAGS = Libdl.RTLD_NOW | Libdl.RTLD_LOCAL

const library = Ref{Ptr{Cvoid}}(C_NULL)
const addresses = fill(C_NULL, length(FUNCTIONS))

# A system image may have kept another process's addresses.
function __init__()
    library[] = C_NULL
    fill!(addresses, C_NULL)
    isdefined(Base, :get_extension) || watch_packages()
    return
end

# The address of FUNCTIONS[index], looked up when it is first needed.
@inline function address(index)
    found = addresses[index]
    return found == C_NULL ? resolve(index) : found
end

@noinline function resolve(index)
    library[] == C_NULL && (library[] = load())
    found = dlsym(library[], FUNCTIONS[index]; throw_error = false)
    if found === nothing
        error("$(dlpath(library[])) has no $(FUNCTIONS[index]): it is older than this package. Rebuild it: $BUILD")
    end
    return addresses[index] = found
end

function load()
    given = get(ENV, "MJENV_LIBRARY", "")
    built = joinpath(REPOSITORY, "build", "libmjenv.so")
    # A release's package carries the library.
    carried = normpath(@__DIR__, "..", "lib", "libmjenv.so")
    paths = !isempty(given) ? [given] : isfile(carried) ? [carried] : [built, "libmjenv.so.0"]
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

"What a call of the C library, or a row of it, came to: `MJEnv.MJENV_OK`, `MJEnv.MJENV_E_VALUE` and so on."
const Status = mjenv_status

"""
    MJEnvError

What the C library refused or failed at. `status` is an `MJEnv.Status` such as `MJEnv.MJENV_E_VALUE`; `message` names
the culprit and, where there are choices, the valid ones. In it, rows and elements count from 0.
"""
struct MJEnvError <: Exception
    status::Status
    message::String
end

Base.showerror(io::IO, e::MJEnvError) = print(io, "MJEnvError (", e.status, "): ", e.message)

# Must follow the call directly: the message belongs to the thread.
@inline check(status::Status) = status == MJENV_OK ? nothing : fail(status)
@noinline fail(status::Status) = throw(MJEnvError(status, unsafe_string(mjenv_last_error())))

# A name on its way to C.
function text(name::Union{AbstractString,Symbol})
    '\0' in String(name) && throw(ArgumentError("$(repr(String(name))) contains a NUL character"))
    return String(name)
end

borrowed(name::Cstring) = name == C_NULL ? "" : unsafe_string(name)

"""
    MJEnv.version()

The versions of the library and of its MuJoCo, as text.
"""
version() = unsafe_string(mjenv_version())

"""
    MJEnv.ids()

The ids of all environments, sorted.
"""
ids() = [unsafe_string(mjenv_id_at(i)) for i in 0:(mjenv_id_count() - 1)]
