# Finds and loads the libraries, one for each version of MuJoCo, and turns their errors into exceptions.

using Libdl: Libdl, dlopen, dlpath, dlsym

const REPOSITORY = normpath(@__DIR__, "..", "..", "..")

# Without RTLD_DEEPBIND, which is in Julia's default: with it the library would bind to another copy of the unwinder
# than the process uses, and C++ exceptions would crash.
const DLOPEN_FLAGS = Libdl.RTLD_NOW | Libdl.RTLD_LOCAL

mutable struct Library
    engine::String  # the version of MuJoCo
    file::String
    built::String  # where the commands of `build` put it in this repository
    build::String
    addresses::Vector{Ptr{Cvoid}}  # of FUNCTIONS; null until the library is loaded
end

Library(engine, file, built, build) = Library(engine, file, built, build, fill(C_NULL, length(FUNCTIONS)))

const LIBRARIES = (
    Library("2.2.2", "libmjenv." * Libdl.dlext, "build", "cmake -G Ninja -B build && cmake --build build"),
    Library(
        "4.0",
        "libmjenv-mujoco4." * Libdl.dlext,
        joinpath("build", "mujoco4"),
        "cmake -G Ninja -B build/mujoco4 -DMJENV_ENGINE=FOLDER_OF_MUJOCO_4 && cmake --build build/mujoco4",
    ),
)
const LOADING = ReentrantLock()

# An index of LIBRARIES, which is passed on without allocating.
struct Engine
    index::Int
end

library_of(engine::Engine) = LIBRARIES[engine.index]

# A pointer that a library has given. It carries the library's addresses, because Julia inlines only cheap calls, and
# only then keeps the structs that are passed to them on the stack.
struct Handle{T}
    engine::Engine
    addresses::Ptr{Ptr{Cvoid}}
    pointer::Ptr{T}
end

Handle(engine::Engine, pointer::Ptr{T}) where {T} =
    Handle{T}(engine, Base.pointer(library_of(engine).addresses), pointer)
Base.unsafe_convert(::Type{Ptr{T}}, handle::Handle{T}) where {T} = handle.pointer

# Addresses of functions, also those of programs beside the library.
const ADDRESSES = [library.addresses for library in LIBRARIES]

# A system image may have kept the addresses of the process that built it.
function __init__()
    foreach(addresses -> fill!(addresses, C_NULL), ADDRESSES)
    isdefined(Base, :get_extension) || watch_packages()
    return
end

is_loaded(library::Library) = library.addresses[end] != C_NULL

# Returns the address of FUNCTIONS[index]. The first call loads the library.
@inline function address(library::Library, index)
    found = library.addresses[index]
    return found == C_NULL ? load!(library).addresses[index] : found
end
@inline address(engine::Engine, index) = address(library_of(engine), index)
@inline address(handle::Handle, index) = unsafe_load(handle.addresses, index)

# Other threads must not see the library before it knows all tasks.
@noinline function load!(library::Library)
    lock(LOADING) do
        is_loaded(library) && return
        handle = find(library)
        found = Library(library.engine, library.file, library.built, library.build)
        for (index, name) in enumerate(FUNCTIONS)
            pointer = dlsym(handle, name; throw_error = false)
            if pointer === nothing
                error("$(dlpath(handle)) lacks $name: it is older than this package. Rebuild it: $(library.build)")
            end
            found.addresses[index] = pointer
        end
        foreach(registration -> register(found, registration), REGISTRATIONS)
        foreach(path -> load_tasks(found, path), PLUGINS)
        copyto!(library.addresses, found.addresses)
    end
    return library
end

# The engine of a library that is open.
function engine_of(handle)
    version = unsafe_string(ccall(dlsym(handle, :mjenv_version), Cstring, ()))
    index = findfirst(library -> occursin("(MuJoCo $(library.engine)", version), LIBRARIES)
    index === nothing && error("$(dlpath(handle)) is mjenv $version, which this package does not know")
    return Engine(index)
end

function paths(library::Library)
    given = get(ENV, "MJENV_LIBRARY", "")
    isempty(given) || return unique([given, joinpath(dirname(given), library.file)])
    # The package of a release contains the libraries.
    carried = normpath(@__DIR__, "..", "lib", library.file)
    isfile(carried) && return [carried]
    return [joinpath(REPOSITORY, library.built, library.file), "$(library.file).$MJENV_ABI_VERSION"]
end

# Opens the first library that can be opened and for which refusal(handle, path) is nothing. If there is none, returns
# nothing, and `reasons` has a line for each path.
function open_first(refusal, paths, reasons)
    for path in paths
        handle = try
            dlopen(path, DLOPEN_FLAGS)
        catch reason
            push!(reasons, "  $path: $(sprint(showerror, reason))")
            continue
        end
        reason = refusal(handle, path)
        reason === nothing && return handle
        push!(reasons, "  $path: $reason")
    end
    return nothing
end

function find(library::Library)
    reasons = String[]
    handle = open_first(paths(library), reasons) do handle, _
        abi = ccall(dlsym(handle, :mjenv_abi_version), UInt32, ())
        abi == MJENV_ABI_VERSION || return "it has ABI version $abi, this package needs $MJENV_ABI_VERSION"
        other = library_of(engine_of(handle))
        return other === library ? nothing : "it works with MuJoCo $(other.engine)"
    end
    handle === nothing || return handle
    error(
        "the mjenv library on MuJoCo $(library.engine) was not found:\n", join(reasons, '\n'),
        "\nBuild it in the repository ($(library.build)), or set ENV[\"MJENV_LIBRARY\"] to the path of ",
        "$(library.file), or of a library in the same folder.",
    )
end

function Engine(name::AbstractString, origin = "")
    index = findfirst(library -> library.engine == name, LIBRARIES)
    index === nothing || return Engine(index)
    known = join((repr(library.engine) for library in LIBRARIES), " and ")
    throw(ArgumentError("$(origin)there is no engine $(repr(name)); the engines are $known, versions of MuJoCo"))
end

# The default: the engine that MJENV_ENGINE names, else that of the library that MJENV_LIBRARY names, else the first.
function Engine(::Nothing)
    name = get(ENV, "MJENV_ENGINE", "")
    isempty(name) || return Engine(name, "the environment variable MJENV_ENGINE: ")
    given = get(ENV, "MJENV_LIBRARY", "")
    handle = isempty(given) ? nothing : dlopen(given, DLOPEN_FLAGS; throw_error = false)
    return handle === nothing ? Engine(1) : engine_of(handle)
end

"""
    MJEnv.engines()

Returns the versions of MuJoCo that [`Env`](@ref) takes as `engine`, those whose library is installed: `"2.2.2"` and
`"4.0"`. The library on 4.0 opens MuJoCo's own library when it first builds an environment.
"""
engines() = [library.engine for library in LIBRARIES if is_loaded(library) || is_there(library)]

is_there(library::Library) = try
    find(library) !== nothing
catch
    false
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

# Must be called directly after the library, because the thread's next failing call replaces the message. `origin` is a
# handle or an engine of the library.
@inline check(origin, status::Status) = status == MJENV_OK ? nothing : fail(origin, status)
@noinline fail(origin, status::Status) = throw(MJEnvError(status, unsafe_string(mjenv_last_error(origin))))

# What a function writes in place of `empty`, its last argument.
function answer(f, origin, empty, arguments...)
    given = Ref(empty)
    check(origin, f(origin, arguments..., given))
    return given[]
end

# What a function writes that is asked for the number of elements first.
function sized(f, handle, T::Type, arguments...)
    values = Vector{T}(undef, answer(f, handle, Int64(0), arguments..., C_NULL, 0))
    answer(f, handle, Int64(0), arguments..., values, length(values))
    return values
end

# A text for C, which ends texts at a NUL character.
function text(name::Union{AbstractString,Symbol})
    '\0' in String(name) && throw(ArgumentError("$(repr(String(name))) contains a NUL character"))
    return String(name)
end

borrowed(name::Cstring) = name == C_NULL ? "" : unsafe_string(name)

"""
    MJEnv.version(; engine = nothing)

Returns the versions of the library and of MuJoCo as text: `"major.minor.patch (MuJoCo x.y.z)"`. For `engine` see
[`Env`](@ref).
"""
version(; engine::Union{Nothing,AbstractString} = nothing) = unsafe_string(mjenv_version(Engine(engine)))

"`MJEnv.ids(; engine = nothing)`: returns the ids of all environments as texts, sorted."
function ids(; engine::Union{Nothing,AbstractString} = nothing)
    chosen = Engine(engine)
    return [unsafe_string(mjenv_id_at(chosen, i)) for i in 0:(mjenv_id_count(chosen) - 1)]
end
