# An environment: its handle, and what is known of it.

const CLOSED = typemin(Int) ÷ 2

"""
    Env(id; rows = 1, options...)
    Env(f, id; rows = 1, options...)

The environment `id`, one of `MJEnv.ids()`, with `rows` independent episodes. `options` are Gymnasium's constructor
arguments by Gymnasium's names, and some of our own (`max_episode_steps`, `strict`, `norm`, `xml_string`,
`num_threads`, `cpu_affinity`, `autoreset_mode`, `on_divergence`, `arrays`): `MJEnv.schema(id)` describes them. A flag is a `Bool`, a number any `Real`, a range a tuple or a vector, a text a string
or a symbol. An unknown option, a wrong type or a value out of bounds throws an [`MJEnvError`](@ref).

With a function `f`, the environment is passed to it and closed at its end.

Fields to read: `id`, `rows`, `frame_skip` (mj_steps in a step) and `dt` (seconds of simulation in a step).

An environment holds some megabytes outside Julia's heap. `close(env)` frees them now; else the garbage collector will
some day. Using a closed environment throws. Distinct environments may be used from different threads at once; of two
threads in the same one, the later gets an `MJEnvError` of status `MJENV_E_BUSY`.
"""
mutable struct Env
    handle::Ptr{mjenv_env}
    callers::Threads.Atomic{Int}  # calls that are inside the library now; negative once closed
    halves::Threads.Atomic{Int}  # calls that change what is under way: one at a time
    id::String
    rows::Int
    frame_skip::Int
    dt::Float64
    obs_count::Int
    action_count::Int
    qpos_count::Int
    qvel_count::Int
    info_fields::Vector{Field}
    reset_info_fields::Vector{Field}
    array_fields::Vector{Field}
    same_step::Bool
    arrays::Dict{String,Field}  # for read; filled by the first
    latest::Any  # the Batch behind MJEnv.info(env), or nothing
    under_way::Int  # rows sent and not yet received
    written::Any  # the arrays that these write, kept from being collected

    function Env(id::AbstractString; rows::Integer = 1, options...)
        created = Ref{Ptr{mjenv_env}}(C_NULL)
        with_options(id) do handle
            for (name, value) in pairs(options)
                set_option!(handle, id, name, value)
            end
            check(mjenv_create(handle, rows, created))
        end
        env = finalizer(destroy, new(created[], Threads.Atomic{Int}(0), Threads.Atomic{Int}(0), id, rows))
        describe!(env)
        return env
    end
end

function Env(f::Function, id::AbstractString; options...)
    env = Env(id; options...)
    try
        return f(env)
    finally
        close(env)
    end
end

function describe!(env::Env)
    env.frame_skip = mjenv_frame_skip(env.handle)
    env.obs_count = space_of(env.handle, MJENV_OBSERVATION).count
    env.action_count = space_of(env.handle, MJENV_ACTION).count
    env.info_fields = fields_of(env.handle, MJENV_INFO)
    env.reset_info_fields = fields_of(env.handle, MJENV_RESET_INFO)
    env.array_fields = fields_of(env.handle, MJENV_ARRAYS)
    env.same_step = options(env).autoreset_mode == "same_step"
    env.arrays = Dict{String,Field}()
    env.latest = nothing
    env.under_way = 0
    env.written = nothing
    env.dt = read(env, "opt.timestep") * env.frame_skip
    env.qpos_count = read(env, "nq")
    env.qvel_count = read(env, "nv")
    return env
end

# Passes the handle to f. Keeps the environment from being collected, or closed by another thread, meanwhile.
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

@noinline refuse_closed(env) = throw(ArgumentError("this Env(\"$(env.id)\") is closed"))

# Frees the handle if no call is inside the library; a finalizer, so it neither throws nor prints.
function destroy(env::Env)
    callers = Threads.atomic_cas!(env.callers, 0, CLOSED)
    callers == 0 && mjenv_destroy(env.handle)
    return callers <= 0
end

"""
    close(env::Env)

Frees the environment. Closing it again does nothing; any other use of it throws an `ArgumentError`. Throws an
`MJEnvError` while another thread is inside the environment.
"""
function Base.close(env::Env)
    destroy(env) || throw(MJEnvError(MJENV_E_BUSY, "another thread is inside this environment: it stays open"))
    env.written = nothing
    return nothing
end

Base.isopen(env::Env) = env.callers[] >= 0

Base.deepcopy_internal(env::Env, ::IdDict) = throw(
    ArgumentError("an Env cannot be copied: build a second one with the same options and restore! a snapshot in it"),
)

function Base.show(io::IO, env::Env)
    print(io, "Env(", repr(env.id))
    env.rows == 1 || print(io, "; rows = ", env.rows)
    print(io, ")", isopen(env) ? "" : " (closed)")
end

options(env::Env) = inside(handle -> values_of(mjenv_options_of(handle)), env)

"""
    MJEnv.fields(env, role)

The [`MJEnv.Field`](@ref)s of a role, in order:

- `:observation`: the terms of an observation; `:action`: the actuators; `:reward`
- `:info`, `:reset_info`: what a step and a reset report
- `:structure`: Gymnasium's `observation_structure`, empty where Gymnasium has none
- `:data`, `:model`: the arrays of mjData and mjModel for `read`
- `:arrays`: those of mjData that the option `arrays` names, for [`MJEnv.arrays`](@ref)
"""
fields(env::Env, role::Symbol) = inside(handle -> fields_of(handle, role_of(role)), env)

"""
    MJEnv.spec(id)
    MJEnv.spec(env)

What Gymnasium registers for an id, as a NamedTuple: `id`, `robot` (the id without its version), `version`,
`max_episode_steps` and `reward_threshold`, `nothing` where there is none. Of an environment, `max_episode_steps` is its
own.
"""
function spec(id::AbstractString)
    found = Ref(mjenv_spec())
    check(mjenv_spec_of(text(id), found))
    s = found[]
    return (
        id = unsafe_string(s.id),
        robot = unsafe_string(s.robot),
        version = Int(s.version),
        max_episode_steps = s.max_episode_steps > 0 ? s.max_episode_steps : nothing,
        reward_threshold = isnan(s.reward_threshold) ? nothing : s.reward_threshold,
    )
end

function spec(env::Env)
    limit = options(env).max_episode_steps
    return merge(spec(env.id), (max_episode_steps = limit > 0 ? limit : nothing,))
end

function space_of(handle::Ptr{mjenv_env}, role::mjenv_role)
    space = Ref(mjenv_space())
    check(mjenv_space_of(handle, role, space))
    return space[]
end

function bounds(env::Env, role::mjenv_role)
    return inside(env) do handle
        space = space_of(handle, role)
        T = mjenv_dtype(space.dtype) == MJENV_FLOAT32 ? Float32 : Float64
        copied(pointer) = Vector{T}(unsafe_wrap(Array, pointer, space.count))
        (low = copied(space.low), high = copied(space.high))
    end
end

"""
    observation_space(env)

The Box space of one row's observation: `low` and `high`, two `Float64` vectors.
"""
observation_space(env::Env) = bounds(env, MJENV_OBSERVATION)

"""
    action_space(env)

The Box space of one row's action: `low` and `high`, two `Float32` vectors.
"""
action_space(env::Env) = bounds(env, MJENV_ACTION)

digits_of(seed::Integer) = digits(UInt32, BigInt(seed); base = big(2)^32)

function refuse_seed(seed)
    isnothing(seed) || seed >= 0 || throw(ArgumentError("a seed is a non-negative integer, not $seed"))
end

"""
    seed!(env, seed)
    seed!(env, seeds)

Gives rows new random streams, NumPy's `default_rng(seed)`: of a vector each row its own (`nothing` leaves a row's
stream as it is), of one number row `i` gets `seed + i - 1`, as in Gymnasium's vector environments. Seeds are
non-negative integers of any size. A row that is never seeded takes entropy from the system. Returns `env`.
"""
function seed!(env::Env, seeds::AbstractVector{<:Union{Integer,Nothing}})
    if length(seeds) != env.rows
        throw(DimensionMismatch("$(length(seeds)) seeds for an environment of $(env.rows) rows"))
    end
    foreach(refuse_seed, seeds)
    inside(env) do handle
        for (index, seed) in enumerate(seeds)
            seed === nothing && continue
            number = digits_of(seed)
            check(mjenv_seed_digits(handle, index - 1, number, length(number)))
        end
    end
    return env
end

function seed!(env::Env, seed::Integer)
    refuse_seed(seed)
    return seed!(env, BigInt(seed) .+ (0:(env.rows - 1)))
end

"""
    seed_actions!(env, seed)

Seeds the stream of [`sample_actions`](@ref), as Gymnasium's `action_space.seed(seed)`; `seed` fits into 64 bits.
Returns `env`.
"""
function seed_actions!(env::Env, seed::Integer)
    0 <= seed <= typemax(UInt64) || throw(ArgumentError("a seed of actions lies in 0..2^64-1, not at $seed"))
    check(inside(handle -> mjenv_seed_actions(handle, seed), env))
    return env
end

"""
    sample_actions!(action, env)

Draws an action for each row, as Gymnasium's `action_space.sample()`, into `action`: a `Vector{Float32}` for one row, a
`Matrix{Float32}` with a column for each row. Throws an `MJEnvError` where an actuator is unbounded. Returns `action`.
"""
function sample_actions!(action::Union{Vector{Float32},Matrix{Float32}}, env::Env)
    check_action(env, action)
    check(inside(handle -> mjenv_sample_actions(handle, action, length(action)), env))
    return action
end

"""
    sample_actions(env)

Draws an action for each row: see [`sample_actions!`](@ref).
"""
sample_actions(env::Env) = sample_actions!(
    env.rows == 1 ? zeros(Float32, env.action_count) : zeros(Float32, env.action_count, env.rows),
    env,
)

function check_action(env::Env, action)
    fits = ndims(action) == 1 && env.rows == 1 ? length(action) == env.action_count :
           size(action) == (env.action_count, env.rows)
    fits || refuse_action(env, action)
end

@noinline function refuse_action(env, action)
    wanted = env.rows == 1 ? "a vector of $(env.action_count)" : "a matrix of $(env.action_count)×$(env.rows)"
    throw(DimensionMismatch("the action of this $env is $wanted, not of size $(size(action))"))
end
