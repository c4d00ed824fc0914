# The environment: creates and destroys it, describes and seeds it.

const CLOSED = typemin(Int) ÷ 2

"""
    Env(id; rows = 1, engine = nothing, options...)
    Env(f, id; rows = 1, engine = nothing, options...)

Builds the environment `id`, one of `MJEnv.ids()`, with `rows` rows. Each row is an episode; rows do not influence each
other. If you pass a function `f`, it is called with the environment, which is closed when `f` returns or throws.

`options` are the arguments of Gymnasium's constructor by Gymnasium's names, and some more (`max_episode_steps`,
`strict`, `norm`, `xml_string`, `num_threads`, `lanes`, `cpu_affinity`, `autoreset_mode`, `on_divergence`, `arrays`, `max_contacts`).
`MJEnv.schema(id)` describes them. A flag takes a `Bool`, a number any `Real`, a range a tuple or a vector, a text a
string or a symbol. An unknown option, a value of the wrong type or out of bounds, and a model that does not fit the
task throw an [`MJEnvError`](@ref).

`engine` is the version of MuJoCo, `"2.2.2"` or `"4.0"`: see [`MJEnv.engines`](@ref). Their bits differ. By default it
is what `ENV["MJENV_ENGINE"]` names, without that variable `"2.2.2"`. A process may use both at the same time.

You may read these fields: `id`, `engine`, `rows`, `frame_skip` (how many simulation steps of MuJoCo one step takes), `dt`
(how many seconds of simulation one step takes) and `threads` (how many threads step rows).

An environment takes a few megabytes outside Julia's heap. `close(env)` frees them at once; without it the garbage
collector frees them at some time. Every use of a closed environment throws an `ArgumentError`.

Threads may use different environments at the same time. If two threads use the same environment, the later call throws
an `MJEnvError` of status `MJENV_E_BUSY`.
"""
mutable struct Env
    handle::Handle{mjenv_env}
    callers::Threads.Atomic{Int}  # how many calls are inside the library; negative once closed
    id::String
    engine::String
    rows::Int
    frame_skip::Int
    threads::Int
    dt::Float64
    obs_count::Int
    action_count::Int
    qpos_count::Int
    qvel_count::Int
    fields::Outputs
    same_step::Bool
    arrays::Dict{String,Field}  # the arrays that read knows; filled by its first call
    sent_type::DataType  # of the actions that send! took last
    latest::Any  # the Batch that MJEnv.info(env) reads, or nothing

    function Env(id::AbstractString; rows::Integer = 1, engine::Union{Nothing,AbstractString} = nothing, options...)
        chosen = Engine(engine)
        pointer = with_options(chosen, id) do handle
            for (name, value) in pairs(options)
                set_option!(handle, id, name, value)
            end
            return answer(mjenv_create, handle, Ptr{mjenv_env}(C_NULL), rows)
        end
        handle = Handle(chosen, pointer)
        env = finalizer(destroy, new(handle, Threads.Atomic{Int}(0), id, library_of(chosen).engine, rows))
        describe!(env)
        return env
    end
end

Env(f::Function, id::AbstractString; options...) = let env = Env(id; options...)
    try
        f(env)
    finally
        close(env)
    end
end

function describe!(env::Env)
    info = info_of(env.handle)
    env.frame_skip, env.threads = info.frame_skip, info.threads
    env.obs_count, env.action_count = (space_of(env.handle, r).count for r in (MJENV_ROLE_OBSERVATION, MJENV_ROLE_ACTION))
    env.fields = Outputs((fields_of(env.handle, role_of(role)) for role in fieldnames(Outputs))...)
    env.same_step = options(env).autoreset_mode == "same_step"
    env.arrays, env.sent_type, env.latest = Dict{String,Field}(), Float64, nothing
    env.dt = read(env, "opt.timestep") * env.frame_skip
    env.qpos_count, env.qvel_count = read(env, "nq"), read(env, "nv")
    return env
end

"""
    lanes(env)

Returns `(count, reason)`: how many rows each thread steps together in the lanes of the CPU's vector unit, and why rows are
stepped one by one. `count` is 0 if all are stepped one by one; `reason` is `""` if none is.
"""
lanes(env::Env) = inside(env) do handle
    info = info_of(handle)
    return (count = Int(info.lanes), reason = unsafe_string(info.lanes_reason))
end

"""
    lane_stages(env)

Returns how lanes compute each stage of a step: pairs of its name and `"lanes"`, `"row by row: WHY"`,
`"lanes; row by row: WHAT"` or `"absent"`. There are none if the library has no lanes.
"""
lane_stages(env::Env) = inside(env) do handle
    found = mjenv_lane_stages_of(handle)
    found == C_NULL && check(handle, MJENV_E_BUSY)
    return [Pair(String.(split(line, ": "; limit = 2))...) for line in eachline(IOBuffer(unsafe_string(found)))]
end

info_of(handle) = answer(mjenv_info_of, handle, mjenv_info())
space_of(handle, role) = answer(mjenv_space_of, handle, mjenv_space(), role)

# Passes the handle to f. While f runs, the environment is neither collected nor closed by another thread.
@inline function inside(f, env::Env)
    GC.@preserve env begin
        if Threads.atomic_add!(env.callers, 1) < 0
            Threads.atomic_sub!(env.callers, 1)
            refuse_closed(env)
        end
        try
            return f(env.handle)
        finally
            Threads.atomic_sub!(env.callers, 1)
        end
    end
end

# Calls a function of the library for the environment, throws if it fails, and returns the environment.
@inline function call(f::F, env::Env, arguments::Vararg{Any,N}) where {F,N}
    check(env.handle, inside(handle -> f(handle, arguments...), env))
    return env
end

@noinline refuse_closed(env) = throw(ArgumentError("this Env(\"$(env.id)\") is closed"))

# Frees the handle if no call is inside the library, and returns whether the environment is closed. This is a finalizer,
# which must neither throw nor print.
function destroy(env::Env)
    callers = Threads.atomic_cas!(env.callers, 0, CLOSED)
    callers == 0 && mjenv_destroy(env.handle)
    return callers <= 0
end

"""
    close(env::Env)

Frees the environment. Closing it again does nothing; any other use of it throws an `ArgumentError`. While another
thread is using the environment, `close` throws an `MJEnvError` of status `MJENV_E_BUSY`.
"""
function Base.close(env::Env)
    destroy(env) || throw(MJEnvError(MJENV_E_BUSY, "another thread is using this environment, so it stays open"))
    return nothing
end

Base.isopen(env::Env) = env.callers[] >= 0

Base.deepcopy_internal(env::Env, ::IdDict) = throw(
    ArgumentError("an Env cannot be copied: build a second one with the same options and restore! a snapshot into it"),
)

function Base.show(io::IO, env::Env)
    print(io, "Env(", repr(env.id))
    env.rows == 1 || print(io, "; rows = ", env.rows)
    print(io, ")", isopen(env) ? "" : " (closed)")
end

options(env::Env) = inside(handle -> values_of(Handle(handle.engine, mjenv_options_of(handle))), env)

"""
    MJEnv.fields(env, role)

Returns the [`MJEnv.Field`](@ref)s of a role as a vector, in Gymnasium's order. The roles are:

- `:observation`: the terms of an observation
- `:action`: the actuators
- `:reward`: the reward, one field
- `:info`, `:reset_info`: the infos of a step and of a reset
- `:structure`: Gymnasium's `observation_structure`; empty where Gymnasium has none
- `:data`, `:model`: the arrays of mjData and mjModel that `read` takes
- `:parameters`: the live parameters of a task, which `read` and `write!` take
- `:groups`: the keys of an observation that is a Gymnasium Dict, see [`MJEnv.groups`](@ref); empty if it is a Box
- `:arrays`: the arrays of mjData that the option `arrays` names, see [`MJEnv.arrays`](@ref)
"""
fields(env::Env, role::Symbol) = inside(handle -> fields_of(handle, role_of(role)), env)

"""
    MJEnv.spec(id; engine = nothing)
    MJEnv.spec(env)

Returns what Gymnasium registers for an id, as a NamedTuple: `id`, `robot` (the id without its version), `version`,
`max_episode_steps`, and `reward_threshold`, which is `nothing` where Gymnasium states none. For an environment,
`max_episode_steps` is the value that it was built with; `nothing` means that it has no limit.
"""
function spec(id::AbstractString; engine::Union{Nothing,AbstractString} = nothing)
    s = answer(mjenv_spec_of, Engine(engine), mjenv_spec(), text(id))
    max_episode_steps = s.max_episode_steps > 0 ? s.max_episode_steps : nothing
    reward_threshold = isnan(s.reward_threshold) ? nothing : s.reward_threshold
    names = (id = unsafe_string(s.id), robot = unsafe_string(s.robot), version = Int(s.version))
    return (; names..., max_episode_steps, reward_threshold)
end

function spec(env::Env)
    limit = options(env).max_episode_steps
    return merge(spec(env.id; engine = env.engine), (max_episode_steps = limit > 0 ? limit : nothing,))
end

function box_of(env::Env, role::mjenv_role)
    return inside(env) do handle
        space = space_of(handle, role)
        T = mjenv_dtype(space.dtype) == MJENV_DTYPE_FLOAT32 ? Float32 : Float64
        copied(pointer) = Vector{T}(unsafe_wrap(Array, pointer, space.count))
        Box(copied(space.low), copied(space.high))
    end
end

"""
    observation_space(env)

Returns the space of one row's observation, an [`MJEnv.Box`](@ref) of `Float64`, as Gymnasium's.
"""
observation_space(env::Env) = box_of(env, MJENV_ROLE_OBSERVATION)

"`action_space(env)`: returns the space of one row's action, an [`MJEnv.Box`](@ref) of `Float32`, as Gymnasium's."
action_space(env::Env) = box_of(env, MJENV_ROLE_ACTION)

function check_seed(seed)
    seed >= 0 || throw(ArgumentError("a seed is a non-negative integer, not $seed"))
end

"""
    seed!(env, seed; rows = :)
    seed!(env, seeds; rows = :)

Gives the [`MJEnv.Rows`](@ref) `rows` new random streams: a row with the seed `s` draws what NumPy's `default_rng(s)`
draws. A vector holds a seed for each row. With one number, the first of the rows is seeded with `seed`, the next with
`seed + 1` and so on, as in Gymnasium's vector environments. Seeds are non-negative integers of any size. A row that is
never seeded gets its seed from the system's entropy at its first reset. Returns `env`.
"""
function seed!(env::Env, seeds::AbstractVector{<:Integer}; rows::Rows = (:))
    if length(seeds) != row_count(env, rows)
        throw(DimensionMismatch("$(length(seeds)) seeds for $(row_count(env, rows)) rows"))
    end
    foreach(check_seed, seeds)
    if rows isa Integer
        seed = digits(UInt64, BigInt(only(seeds)); base = big(2)^64)
        return call(mjenv_seed_row, env, row_index(env, rows), seed, length(seed))
    end
    words = mapreduce(word_count, max, seeds; init = 1)
    table = zeros(UInt64, words, env.rows)
    for (row, seed) in zip(rows isa Union{Colon,AbstractVector{Bool}} ? (1:env.rows) : rows, seeds)
        digits!(view(table, :, row_index(env, row) + 1), BigInt(seed); base = big(2)^64)
    end
    return call(mjenv_seed, env, mask_of(env, rows), table, length(table))
end

# How many 64-bit words a seed has.
word_count(seed::Integer) = cld(ndigits(seed; base = 2), 64)

function seed!(env::Env, seed::Integer; rows::Rows = (:))
    check_seed(seed)
    rows isa Integer && return seed!(env, [seed]; rows)
    numbers = numbers_of(env, rows)
    return seed!(env, BigInt(seed) .+ (0:(length(numbers) - 1)); rows = numbers)
end

"""
    seed_actions!(env, seed)

Seeds the random stream of [`sample_actions`](@ref), as Gymnasium's `action_space.seed(seed)` does; `seed` lies in
0..2^64-1. Returns `env`.
"""
function seed_actions!(env::Env, seed::Integer)
    0 <= seed <= typemax(UInt64) || throw(ArgumentError("the seed of actions is $seed, outside 0..2^64-1"))
    return call(mjenv_seed_actions, env, seed)
end

"""
    sample_actions!(action, env)

Draws an action for each row, as Gymnasium's `action_space.sample()` does, and writes it into `action`: a
`Vector{Float32}` for one row, a `Matrix{Float32}` with a column for each row. Throws an `MJEnvError` if an actuator has
no bounds. Returns `action`.
"""
function sample_actions!(action::Union{Vector{Float32},Matrix{Float32}}, env::Env)
    check_columns(env, action, env.rows)
    call(mjenv_sample_actions, env, action, length(action))
    return action
end

"`sample_actions(env)`: draws an action for each row into a new array: see [`sample_actions!`](@ref)."
sample_actions(env::Env) =
    sample_actions!(zeros(Float32, env.rows == 1 ? (env.action_count,) : (env.action_count, env.rows)), env)
