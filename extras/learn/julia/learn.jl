# Trains policies with libmjenv-learn, and plays them: MJEnv.train and MJEnv.evaluate.

include("capi.jl")

const LEARN_ADDRESSES = fill(C_NULL, length(LEARN_FUNCTIONS))  # null until the library is loaded
push!(ADDRESSES, LEARN_ADDRESSES)

# Returns the address of LEARN_FUNCTIONS[index]. The first call loads the library.
function learn_address(index)
    LEARN_ADDRESSES[end] == C_NULL && load_learn!()
    return LEARN_ADDRESSES[index]
end

# libmjenv-learn is in the folder of an engine's library.
function learn_paths()
    folders = unique(dirname(path) for library in LIBRARIES for path in paths(library))
    name = "libmjenv-learn." * Libdl.dlext
    return [isempty(folder) ? "$name.$MJENV_LEARN_ABI_VERSION" : joinpath(folder, name) for folder in folders]
end

@noinline function load_learn!()
    lock(LOADING) do
        LEARN_ADDRESSES[end] == C_NULL || return
        reasons = String[]
        handle = open_first(learn_paths(), reasons) do handle, path
            abi = ccall(dlsym(handle, :mjenv_learn_abi_version), UInt32, ())
            abi == MJENV_LEARN_ABI_VERSION || error("$path has ABI version $abi; this package needs $MJENV_LEARN_ABI_VERSION")
            return nothing
        end
        handle === nothing && error("training needs libmjenv-learn, which was not found:\n", join(reasons, '\n'))
        copyto!(LEARN_ADDRESSES, [dlsym(handle, name) for name in LEARN_FUNCTIONS])
    end
end

# As check, for a status of this library.
learn_check(status::Status) =
    status == MJENV_OK ? nothing : throw(MJEnvError(status, unsafe_string(mjenv_learn_last_error())))

# The functions of an engine that libmjenv-learn calls.
function learn_calls(engine::Engine)
    names = filter(name -> !(name in (:struct_size, :reserved)), fieldnames(mjenv_learn_calls))
    functions = (name => address(engine, findfirst(==(Symbol(:mjenv_, name)), FUNCTIONS)) for name in names)
    return mjenv_learn_calls(; functions...)
end

# Keywords of their own of Learner and train.
const NO_SETTINGS = ("seed", "threads")

# Settings as the library reads them: NAME=VALUE, separated by blanks.
function setting_words(settings)
    words = ["$name=$(setting_text(value))" for (name, value) in pairs(settings)]
    blank = findfirst(word -> any(isspace, word), words)
    blank === nothing || throw(ArgumentError("the setting $(repr(words[blank])) has a blank"))
    return join(words, ' ')
end

setting_text(value) = string(value)
setting_text(::Nothing) = ""
setting_text(value::Union{Tuple,AbstractVector}) = join(Int.(value), ',')

"""
    MJEnv.learn_settings(id; settings...)

Returns the settings of PPO for an id as a NamedTuple: tuned ones for the robots of Gymnasium's v5, else one set of
defaults. The keywords replace some of them. `mjenv train --help` describes them. `hidden` is a tuple with the widths of
the hidden layers; `actor_obs` and `critic_obs` have a 1 for each element of the observation that the actor and the
critic see, and are empty if they see all.
"""
function learn_settings(id::AbstractString; settings...)
    words = delivered() do bytes, capacity, size
        learn_check(mjenv_learn_settings(text(id), text(setting_words(settings)), bytes, capacity, size))
    end
    texts = Dict(split(word, '='; limit = 2) for word in split(words, ' '))
    found = Ref(mjenv_option())
    values = Pair{Symbol,Any}[]
    for index in 1:mjenv_learn_setting_count()
        learn_check(mjenv_learn_setting_at(index - 1, found))
        name = unsafe_string(found[].name)
        name in NO_SETTINGS || push!(values, Symbol(name) => setting_value(found[], texts[name]))
    end
    return (; values...)
end

function setting_value(setting::mjenv_option, word)
    kind = setting.kind
    kind == Int32(MJENV_KIND_STRING) && return Symbol(word)
    kind == Int32(MJENV_KIND_FLAG) && return word == "true"
    setting.count > 1 && return Tuple(parse(Int, one) for one in split(word, ','; keepempty = false))
    return parse(kind == Int32(MJENV_KIND_REALS) ? Float64 : Int, word)
end

"""
    MJEnv.Learner(env; seed = 1, threads = 1, settings...)

Makes a learner that trains a policy by PPO in all rows of `env`, whose option `autoreset_mode` must be `:same_step`. It
seeds and resets the environment, which others must not use until the learner is closed. `settings` replace some of
[`MJEnv.learn_settings`](@ref)`(env.id)`; `rows` is that of the environment. The same seed gives the same bits with any
number of `threads`.

In place of an [`Env`](@ref), `env` may be an environment that Julia steps, such as an `MJEnv.BatchEnv`: an object with the fields
`env` and `batch`, and methods of `reset!` and `step!`.

You may read the fields `env` and `settings`. `close(learner)` frees its memory at once; without it the garbage
collector frees it at some time.

```julia
env = Env("Hopper-v5"; rows = 8, autoreset_mode = :same_step)
learner = MJEnv.Learner(env)
MJEnv.train!(learner, 1_000_000)
MJEnv.save(learner, "checkpoint")
write("policy.txt", MJEnv.policy_text(learner))
```
"""
mutable struct Learner
    handle::Ptr{mjenv_learner}
    env::Env
    settings::NamedTuple
    stepped::Any  # what Julia steps; nothing: the library steps env
    restarts::Bool  # the rollout under way was given up

    function Learner(create, env::Env, stepped, seed::Integer, threads::Integer, settings)
        chosen = learn_settings(env.id; rows = env.rows, settings...)
        created = Ref{Ptr{mjenv_learner}}(C_NULL)
        words = text("$(setting_words(chosen)) seed=$seed threads=$threads")
        learn_check(inside(handle -> create(handle, text(env.id), words, created), env))
        return finalizer(destroy, new(created[], env, chosen, stepped, false))
    end
end

function Learner(env::Env; seed::Integer = 1, threads::Integer = 1, settings...)
    calls = Ref(learn_calls(env.handle.engine))
    create(handle, id, words, created) = mjenv_learner_create(calls, handle, id, words, created)
    return Learner(create, env, nothing, seed, threads, settings)
end

function Learner(stepped; seed::Integer = 1, threads::Integer = 1, settings...)
    env, obs = stepped.env, stepped.batch.obs
    env.same_step || throw(ArgumentError("training needs the option autoreset_mode = :same_step"))
    seed!(env, seed)
    reset!(stepped)
    spaces = [Ref(space_of(env.handle, role)) for role in (MJENV_ROLE_OBSERVATION, MJENV_ROLE_ACTION)]
    create(_, id, words, created) = mjenv_learner_create_apart(spaces..., id, words, obs, length(obs), created)
    learner = Learner(create, env, stepped, seed, threads, settings)
    names, counts = terms_of(env)
    learning(handle -> mjenv_learner_describe(handle, Cstring(C_NULL), names, counts, length(names)), learner)
    return learner
end

# The names and lengths of the terms of an observation.
function terms_of(env::Env)
    terms = fields(env, :observation)
    return [term.name for term in terms], [Int64(length(term.range)) for term in terms]
end

destroy(learner::Learner) = (mjenv_learner_destroy(learner.handle); learner.handle = C_NULL; nothing)
Base.close(learner::Learner) = destroy(learner)
Base.isopen(learner::Learner) = learner.handle != C_NULL
Base.show(io::IO, learner::Learner) = print(io, "MJEnv.Learner(", learner.env, ")")

# Calls f with the handle, which is not collected while f runs.
function learning(f, learner::Learner)
    isopen(learner) || throw(ArgumentError("this $learner is closed"))
    return GC.@preserve learner learn_check(f(learner.handle))
end

"""
    MJEnv.train!(learner, steps)

Plays whole rollouts, each with its update, until at least `steps` more steps of all rows together are done. If it throws,
also because of Ctrl-C, the learner is as after its last update. Returns `learner`.
"""
function train!(learner::Learner, steps::Integer)
    steps >= 0 || throw(ArgumentError("steps is $steps, less than 0"))
    for _ in 1:cld(steps, learner.settings.rows * learner.settings.rollout_steps)
        if learner.stepped === nothing
            inside(_ -> learning(handle -> mjenv_learner_train(handle, 1), learner), learner.env)
        else
            play_rollout!(learner, learner.stepped)
        end
    end
    return learner
end

function play_rollout!(learner::Learner, stepped)
    if learner.restarts
        reset!(stepped)
        obs = stepped.batch.obs
        learning(handle -> mjenv_learner_restart(handle, obs, length(obs)), learner)
    end
    learner.restarts = true
    action = zeros(Float32, learner.env.action_count, learner.env.rows)
    for _ in 1:(learner.settings.rollout_steps)
        learning(handle -> mjenv_learner_act(handle, action, length(action)), learner)
        step!(stepped, action)
        GC.@preserve stepped learning(handle -> mjenv_learner_feed(handle, raw(stepped.batch, learner.env)), learner)
    end
    learner.restarts = false
    return learner
end

"""
    MJEnv.train(id; steps = nothing, seed = 1, threads = 1, settings = (;), options...)

Trains a policy for an id and returns the [`MJEnv.Learner`](@ref). `steps` are those of all rows together; without it,
they are those of the settings. `settings` replace some of [`MJEnv.learn_settings`](@ref)`(id)`, `options` are those of
[`Env`](@ref). `threads` step the rows and compute the networks.
"""
function train(
    id::AbstractString;
    steps::Union{Nothing,Integer} = nothing,
    seed::Integer = 1,
    threads::Integer = 1,
    settings = NamedTuple(),
    options...,
)
    steps === nothing || (settings = (; settings..., steps = steps))
    rows = learn_settings(id; settings...).rows
    env = Env(id; rows = rows, num_threads = threads, lanes = "max", options..., autoreset_mode = :same_step)
    learner = Learner(env; seed = seed, threads = threads, settings...)
    return train!(learner, learner.settings.steps)
end

"""
    MJEnv.set!(learner; settings...)

Changes settings from the next rollout on. Those of the networks and of the rollouts' sizes cannot change. Returns
`learner`.
"""
function set!(learner::Learner; settings...)
    words = text(setting_words(settings))
    learning(handle -> mjenv_learner_set(handle, words), learner)
    learner.settings = learn_settings(learner.env.id; learner.settings..., settings...)
    return learner
end

function report_of(raw::mjenv_learn_report)
    names = Tuple(filter(name -> !(name in (:struct_size, :reserved)), fieldnames(mjenv_learn_report)))
    return NamedTuple{names}(Tuple(getfield(raw, name) for name in names))
end

"""
    MJEnv.report(learner)

Describes the learner after its last update as a NamedTuple: `updates`, `steps` and `episodes` so far, `mean_return` and
`mean_length` of the last episodes of the exploring policy, and figures of the update. `mjenv/learn.h` describes all
members. Before the first update the means are `NaN`.
"""
function report(learner::Learner)
    found = Ref(mjenv_learn_report())
    learning(handle -> mjenv_learner_report(handle, found), learner)
    return report_of(found[])
end

"""
    MJEnv.curve(learner)

Returns the learning curve: a vector with the [`MJEnv.report`](@ref) of each update.
"""
function curve(learner::Learner)
    found = Ref(mjenv_learn_report())
    return map(1:(report(learner).updates)) do update
        learning(handle -> mjenv_learner_report_at(handle, update, found), learner)
        report_of(found[])
    end
end

"""
    MJEnv.save(learner, path; note = "")

Saves a checkpoint: networks, optimizer, normalisation, random streams, curve, and the state of all rows. `note`: a text
that [`MJEnv.checkpoint_note`](@ref) reads, for example the options of the environment.
"""
save(learner::Learner, path::AbstractString; note::AbstractString = "") =
    learning(handle -> mjenv_learner_save(handle, text(path), text(note)), learner)

"""
    MJEnv.checkpoint_note(path)

Returns the note in a checkpoint, which may come from a stranger.
"""
checkpoint_note(path::AbstractString) = delivered() do bytes, capacity, size
    learn_check(mjenv_checkpoint_note(text(path), bytes, capacity, size))
end

"""
    MJEnv.load!(learner, path)

Continues from a checkpoint, bit for bit. The learner must have been made for the same id and sizes. Returns `learner`.
"""
function load!(learner::Learner, path::AbstractString)
    inside(_ -> learning(handle -> mjenv_learner_load(handle, text(path)), learner), learner.env)
    learner.restarts = learner.stepped !== nothing
    return learner
end

"""
    MJEnv.policy_text(learner; best = false)

Returns the deterministic policy of the last update as text, which a file `policy.txt` contains. `best`: that of the
update after which the mean return of the last episodes was greatest.
"""
function policy_text(learner::Learner; best::Bool = false)
    which = best ? MJENV_LEARNED_BEST : MJENV_LEARNED_LAST
    return delivered() do bytes, capacity, size
        learning(handle -> mjenv_learner_policy(handle, which, bytes, capacity, size), learner)
    end
end

# The text that a function of the library delivers, without the NUL at its end.
function delivered(get)
    size = Ref{Int64}()
    get(C_NULL, 0, size)
    bytes = Vector{UInt8}(undef, size[])
    get(bytes, length(bytes), size)
    return String(bytes[1:(end - 1)])
end

"""
    MJEnv.Policy(learner; best = false)
    MJEnv.Policy(path)

A deterministic policy: a learner's, or that of a file `policy.txt`. Call it with what it sees of an observation
([`MJEnv.places`](@ref)), or with a matrix that has a column for each row, to compute actions: `policy(obs)`. The actions
are `Float32`, computed in `Float64`, or with `precision = Float32` as the learner computes.

You may read the fields `id`, `observations` and `actuators`.
"""
mutable struct Policy
    handle::Ptr{mjenv_policy}
    id::String
    observations::Int
    actuators::Int

    function Policy(handle::Ptr{mjenv_policy})
        policy = finalizer(held -> mjenv_policy_destroy(held.handle), new(handle))
        inputs, outputs = Ref{Int64}(), Ref{Int64}()
        learn_check(mjenv_policy_sizes(handle, inputs, outputs))
        policy.id, policy.observations, policy.actuators = unsafe_string(mjenv_policy_id(handle)), inputs[], outputs[]
        return policy
    end
end

function Policy(path::AbstractString)
    made = Ref{Ptr{mjenv_policy}}(C_NULL)
    learn_check(mjenv_policy_load(text(path), made))
    return Policy(made[])
end

function Policy(learner::Learner; best::Bool = false)
    content = Vector{UInt8}(policy_text(learner; best = best))
    made = Ref{Ptr{mjenv_policy}}(C_NULL)
    GC.@preserve content learn_check(
        mjenv_policy_parse(Cstring(pointer(content)), length(content), made),
    )
    return Policy(made[])
end

Base.show(io::IO, policy::Policy) = print(io, "MJEnv.Policy of ", policy.id)

"""
    MJEnv.places(policy, env)

Returns where the numbers that the policy sees are in an observation of the environment: `policy(obs[places])`. Throws an
error that names the term if the observation lacks one.
"""
function places(policy::Policy, env::Env)
    names, counts = terms_of(env)
    found = zeros(Int64, policy.observations)
    GC.@preserve policy learn_check(
        mjenv_policy_find(policy.handle, names, counts, length(names), found, length(found)),
    )
    return found .+ 1
end

precision_of(::Type{Float64}) = MJENV_PRECISION_FLOAT64
precision_of(::Type{Float32}) = MJENV_PRECISION_FLOAT32
precision_of(other) = throw(ArgumentError("precision is $other, not Float64 or Float32"))

function (policy::Policy)(obs::AbstractVecOrMat{<:Real}; precision::Type = Float64)
    seen = convert(Array{Float64}, obs)
    rows = size(seen, 2)
    action = ndims(seen) == 1 ? zeros(Float32, policy.actuators) : zeros(Float32, policy.actuators, rows)
    GC.@preserve policy learn_check(
        mjenv_policy_act(policy.handle, precision_of(precision), rows, seen, length(seen), action, length(action)),
    )
    return action
end

"""
    MJEnv.evaluate(policy; episodes = 1000, id = policy.id, seed = 0, rows = 64, precision = Float64, options...)

Plays whole episodes of a policy in the library. Returns `(returns, lengths)`: the sum of the rewards of each episode
and its steps. Episode `k`, counted from 0, begins with a reset by `seed + k`, so that the result does not depend on the
number of rows. `options` are those of [`Env`](@ref).
"""
function evaluate(
    policy::Policy;
    episodes::Integer = 1000,
    id::AbstractString = policy.id,
    seed::Integer = 0,
    rows::Integer = 64,
    precision::Type = Float64,
    options...,
)
    episodes >= 1 || throw(ArgumentError("episodes is $episodes, less than 1"))
    returns, lengths = zeros(episodes), zeros(Int64, episodes)
    Env(id; rows = min(rows, episodes), lanes = "max", options..., autoreset_mode = :disabled) do env
        calls = Ref(learn_calls(env.handle.engine))
        GC.@preserve policy inside(env) do handle
            learn_check(
                mjenv_evaluate(
                    calls, handle, policy.handle, precision_of(precision), seed, episodes, returns, lengths,
                ),
            )
        end
    end
    return (returns = returns, lengths = lengths)
end
