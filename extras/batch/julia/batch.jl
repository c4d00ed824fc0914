# Tasks over all rows at once, in "Batch-v0".

"""
    MJEnv.BatchTask

A task whose methods see all rows at once; [`MJEnv.BatchEnv`](@ref) plays it. Derive a type from it, with these methods:

- `MJEnv.reset!(task::T, rng, rows)` returns `(qpos, qvel)`, or `(qpos, qvel, state)`, of the `rows` rows that begin an
  episode. `MJEnv.uniform(rng, low, high, n)`, `MJEnv.normal(rng, n)` and `MJEnv.integers(rng, low, high, n)` draw `n`
  numbers for each of them, from its own stream, as the methods of NumPy's Generator.
- `MJEnv.observe(task::T, sim)` returns the observations of all rows.
- `MJEnv.step!(task::T, sim, action)` returns `(reward = ..., terminated = ..., info = ...)`, with vectors of all rows. `info`
  is a NamedTuple, and may be left out. It may write into the state: `sim.goal .+= 1`.
- `MJEnv.before_step(task::T, sim, action)` (optional) returns `ctrl`, the numbers for the actuators.
- `MJEnv.state_of(task::T)` (optional) has the names and lengths of what a row remembers, such as `(goal = 1,)`.

A matrix has a column for each row. `sim` has the arrays of mjData that the environment names, as
[`MJEnv.arrays`](@ref) has them, and the state.
"""
abstract type BatchTask end

before_step(::BatchTask, sim, action) = nothing
state_of(::BatchTask) = NamedTuple()

"""
    MJEnv.BatchEnv(task; model, observations, infos = (), needs = (:qpos, :qvel), rows = 1, options...)

An environment of an [`MJEnv.BatchTask`](@ref), for `reset!`, `step!`, `snapshot` and `restore!`. `model` is a file or the text
of an MJCF model, `observations` how many numbers `observe` returns for a row, `infos` the names in the info, and `needs` the
arrays in `sim`. `options` are those of `"Batch-v0"`, such as `frame_skip`, `max_episode_steps` and `autoreset_mode`. The field
`env` is the [`Env`](@ref), to seed and randomise, and `batch` the [`Batch`](@ref) of the last results.
"""
struct BatchEnv{T<:BatchTask,S<:NamedTuple}
    task::T
    env::Env
    batch::Batch{Float64}
    state::S
end

function BatchEnv(task::BatchTask; model, observations, infos = (), needs = (:qpos, :qvel), rows = 1, options...)
    state = map(length -> zeros(length, rows), state_of(task))
    given = (; rows = rows, observations = observations, infos = join(infos, " "), arrays = join(needs, " "))
    source = '<' in model ? (xml_string = model,) : (xml_file = model,)
    env = Env("Batch-v0"; given..., source..., carried = +(0, state_of(task)...), options...)
    return BatchEnv(task, env, Batch(env), state)
end

# Also of one row, the arrays have a column for each row.
sim_of(envs::BatchEnv) =
    merge(named(envs.batch, envs.env.fields.arrays, envs.batch.arrays, (envs.env.rows,)), envs.state)

# Streams of the rows that begin an episode.
struct BatchRng
    env::Env
    words::Matrix{UInt64}
end

function drawn(rng::BatchRng, kind, low, high, n)
    values = zeros(n, size(rng.words, 2))
    call(mjenv_draw, rng.env, rng.words, size(values, 2), kind, low, high, values, length(values))
    return values
end

uniform(rng::BatchRng, low, high, n = 1) = drawn(rng, MJENV_DISTRIBUTION_UNIFORM, low, high, n)
normal(rng::BatchRng, n = 1) = drawn(rng, MJENV_DISTRIBUTION_NORMAL, 0, 0, n)
integers(rng::BatchRng, low, high, n = 1) = drawn(rng, MJENV_DISTRIBUTION_INTEGERS, low, high, n)

# Begins episodes in the rows of a mask, and computes their observations.
function begin_rows!(envs::BatchEnv, mask)
    env, chosen = envs.env, findall(mask)
    words = zeros(UInt64, 6, env.rows)
    call(mjenv_get_stream, env, MJENV_ALL_ROWS, words, length(words))
    unseeded = findall(row -> mask[row] && iszero(words[3, row]), 1:(env.rows))
    isempty(unseeded) || seed!(env, rand(UInt64, length(unseeded)); rows = unseeded)
    call(mjenv_get_stream, env, MJENV_ALL_ROWS, words, length(words))
    rng = BatchRng(env, words[:, chosen])
    qpos, qvel, state = (reset!(envs.task, rng, length(chosen))..., NamedTuple())
    words[:, chosen] = rng.words
    call(mjenv_set_stream, env, MJENV_ALL_ROWS, words, length(words))
    whole(values, count) = (all_rows = zeros(count, env.rows); all_rows[:, chosen] = values; all_rows)
    begin!(envs.batch, env, whole(qpos, env.qpos_count), whole(qvel, env.qvel_count); rows = mask)
    foreach(name -> envs.state[name][:, chosen] = state[name], keys(envs.state))
    return observe(envs.task, sim_of(envs))
end

# Calls f; an error gives up the step or reset under way, and undoes what it has written into the state.
function attempt(f, envs::BatchEnv)
    before = deepcopy(envs.state)
    try
        return f()
    catch
        foreach(copyto!, envs.state, before)
        finish!(envs.batch, envs.env, nothing)
        rethrow()
    end
end

function reset!(envs::BatchEnv; rows::Rows = (:))
    mask = rows isa Colon ? ones(Bool, envs.env.rows) : mask_of(envs.env, rows)
    attempt(() -> finish!(envs.batch, envs.env; obs = begin_rows!(envs, mask), rows = mask), envs)
    return (obs = outputs(envs.env, envs.batch).obs, info = NamedTuple())
end

function step!(envs::BatchEnv, action::Action)
    env, batch, task = envs.env, envs.batch, envs.task
    attempt(envs) do
        seen = act(env, action)
        advance!(batch, env, action; ctrl = before_step(task, sim_of(envs), seen))
        resets = copy(batch.was_reset)
        found = step!(task, sim_of(envs), seen)
        info = Float64[number for field in env.fields.info for number in found.info[Symbol(field.name)]]
        obs = any(resets) ? begin_rows!(envs, resets) : observe(task, sim_of(envs))
        reward, terminated = Vector{Float64}(found.reward), Vector{Bool}(found.terminated)
        finish!(batch, env; obs = obs, reward = reward, terminated = terminated, info = info)
        ended = copy(batch.was_reset)
        env.same_step && any(ended) && finish!(batch, env; obs = begin_rows!(envs, ended), rows = ended)
    end
    return merge(outputs(env, batch), (info = named(batch, env.fields.info, batch.step_info),))
end

function snapshot(envs::BatchEnv)
    isempty(envs.state) || write!(envs.env, "carried", vcat(envs.state...))
    return snapshot(envs.env)
end

function restore!(envs::BatchEnv, image)
    restore!(envs.env, image)
    observe!(envs.batch, envs.env)
    last = 0
    for values in envs.state
        for row in axes(values, 2)
            values[:, row] = read(envs.env, "carried"; row = row)[last .+ axes(values, 1)]
        end
        last += size(values, 1)
    end
    return envs
end
