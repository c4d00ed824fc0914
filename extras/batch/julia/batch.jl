# Tasks over all rows at once, in "Batch-v0".

"""
    MJEnv.BatchTask

A task whose methods see all rows at once; [`MJEnv.BatchEnv`](@ref) plays it. Derive a type from it, with these methods:

- `MJEnv.reset!(task::T, rng, rows)` returns `(qpos, qvel)`, or `(qpos, qvel, state)`, of the `rows` rows that begin an
  episode. `MJEnv.uniform(rng, low, high, n)`, `MJEnv.normal(rng, n)` and `MJEnv.integers(rng, low, high, n)` draw `n`
  numbers for each of them, from its own stream, as the methods of NumPy's Generator. State that it leaves out is kept, and
  `rng.state` has the state of these rows: levels, or commands that the program writes (`envs.state.speed .= 1`).
- `MJEnv.observe(task::T, sim)` returns the observations of all rows, or a NamedTuple with those of each group.
- `MJEnv.step!(task::T, sim, action)` returns `(reward = ..., terminated = ..., info = ...)`, with vectors of all rows. `info`
  is a NamedTuple, and may be left out. It may write into the state: `sim.goal .+= 1`. It draws with `sim.rng`.
- `MJEnv.before_step(task::T, sim, action)` (optional) returns `ctrl`, the numbers for the actuators.
- `MJEnv.state_of(task::T)` (optional) has the names and lengths of what a row remembers, such as `(goal = 1,)`.

A matrix has a column for each row. `sim` has the arrays of mjData that the environment names, as
[`MJEnv.arrays`](@ref) has them, and the state. [`MJEnv.terrain`](@ref)`(env, geom)` reads the heights of a height field.
"""
abstract type BatchTask end

before_step(::BatchTask, sim, action) = nothing
state_of(::BatchTask) = NamedTuple()

"""
    MJEnv.BatchEnv(task; model, observations, infos = (), needs = (:qpos, :qvel), rows = 1, options...)

An environment of an [`MJEnv.BatchTask`](@ref), for `reset!`, `step!`, `rollout`, `snapshot`, `restore!` and
`MJEnv.Learner`. `model` is a file or the text of an MJCF model, `observations` how many numbers `observe` returns for a row,
or those of each group, `(policy = 5, critic = (speed = 3, mass = 1))`, also by term, `infos` the names in the info, and
`needs` the arrays in `sim`. `options` are those of `"Batch-v0"`, such as `frame_skip`, `max_episode_steps` and
`autoreset_mode`. The field `env` is the [`Env`](@ref), to seed, randomise and draw (`Renderer(envs.env)`,
`Window(envs.env)`), and `batch` the [`Batch`](@ref) of the last results.
"""
struct BatchEnv{T<:BatchTask,S<:NamedTuple}
    task::T
    env::Env
    batch::Batch{Float64}
    state::S
end

function BatchEnv(task::BatchTask; model, observations, infos = (), needs = (:qpos, :qvel), rows = 1, options...)
    state = map(length -> zeros(length, rows), state_of(task))
    given = (; rows = rows, infos = join(infos, " "), arrays = join(needs, " "), observed_option(observations)...)
    source = '<' in model ? (xml_string = model,) : (xml_file = model,)
    env = Env("Batch-v0"; given..., source..., carried = +(0, state_of(task)...), options...)
    return BatchEnv(task, env, Batch(env), state)
end

observed_option(count::Integer) = (observations = count,)
observed_option(groups::NamedTuple) = (terms = join((words_of(name, terms) for (name, terms) in pairs(groups)), " "),)
words_of(group, count::Integer) = "$group/$group=$count"
words_of(group, terms::NamedTuple) = join(("$group/$name=$count" for (name, count) in pairs(terms)), " ")

# Also of one row, the arrays have a column for each row.
sim_of(envs::BatchEnv) =
    merge(named(envs.batch, envs.env.fields.arrays, envs.batch.arrays, (envs.env.rows,)), envs.state)

observed(envs::BatchEnv) = columns(observe(envs.task, sim_of(envs)))
columns(obs) = obs
columns(groups::NamedTuple) = vcat(groups...)

# Streams of the rows of a mask, which have no words until the first draw, and the rows' state.
mutable struct BatchRng
    env::Env
    rows::Vector{Bool}
    state::NamedTuple
    words::Matrix{UInt64}
end

BatchRng(env::Env, rows, state = NamedTuple()) = BatchRng(env, rows, state, zeros(UInt64, 6, 0))

function streams(env::Env)
    words = zeros(UInt64, 6, env.rows)
    call(mjenv_get_stream, env, MJENV_ALL_ROWS, words, length(words))
    return words
end

function drawn(rng::BatchRng, kind, low, high, n)
    isempty(rng.words) && (rng.words = streams(rng.env)[:, rng.rows])
    values = zeros(n, size(rng.words, 2))
    call(mjenv_draw, rng.env, rng.words, size(values, 2), kind, low, high, values, length(values))
    return values
end

uniform(rng::BatchRng, low, high, n = 1) = drawn(rng, MJENV_DISTRIBUTION_UNIFORM, low, high, n)
normal(rng::BatchRng, n = 1) = drawn(rng, MJENV_DISTRIBUTION_NORMAL, 0, 0, n)
integers(rng::BatchRng, low, high, n = 1) = drawn(rng, MJENV_DISTRIBUTION_INTEGERS, low, high, n)

# Gives the streams after its draws to those of its rows that are in the mask.
function keep_draws!(rng::BatchRng, mask)
    isempty(rng.words) && return
    words = streams(rng.env)
    words[:, rng.rows .& mask] = rng.words[:, mask[rng.rows]]
    call(mjenv_set_stream, rng.env, MJENV_ALL_ROWS, words, length(words))
    return
end

# Begins episodes in the rows of a mask, and computes the observations.
function begin_rows!(envs::BatchEnv, mask)
    env, state = envs.env, envs.state
    unseeded = findall(mask .& iszero.(streams(env)[3, :]))
    isempty(unseeded) || seed!(env, rand(UInt64, length(unseeded)); rows = unseeded)
    rng = BatchRng(env, mask, map(values -> values[:, mask], state))
    qpos, qvel, new = (reset!(envs.task, rng, count(mask))..., NamedTuple())
    keep_draws!(rng, mask)
    whole(values, count) = (all_rows = zeros(count, env.rows); all_rows[:, mask] = values; all_rows)
    begin!(envs.batch, env, whole(qpos, env.qpos_count), whole(qvel, env.qvel_count); rows = mask)
    foreach(name -> state[name][:, mask] = new[name], keys(new))
    return observed(envs)
end

# Simulates the rows of a mask but those that must be reset, and calls the task's step!. before: the state. Returns which
# rows were stepped, and their outputs.
function step_rows!(envs::BatchEnv, action, mask, before)
    env, batch, task, state = envs.env, envs.batch, envs.task, envs.state
    seen = act(env, action; rows = mask)
    advance!(batch, env, action; ctrl = before_step(task, sim_of(envs), seen), rows = mask)
    stepped = mask .& .!batch.was_reset
    rng = BatchRng(env, ones(Bool, env.rows))
    found = step!(task, merge(sim_of(envs), (rng = rng,)), seen)
    keep_draws!(rng, stepped)
    foreach(name -> state[name][:, .!stepped] = before[name][:, .!stepped], keys(state))
    info = Float64[number for field in env.fields.info for number in found.info[Symbol(field.name)]]
    return stepped, (reward = Vector{Float64}(found.reward), terminated = Vector{Bool}(found.terminated), info = info)
end

# Calls f with a copy of the state; an error gives up the step or reset under way, and undoes what it has written into it.
function attempt(f, envs::BatchEnv)
    before = deepcopy(envs.state)
    try
        return f(before)
    catch
        foreach(copyto!, envs.state, before)
        finish!(envs.batch, envs.env, nothing)
        rethrow()
    end
end

function reset!(envs::BatchEnv; rows::Rows = (:))
    mask = rows isa Colon ? ones(Bool, envs.env.rows) : mask_of(envs.env, rows)
    attempt(_ -> finish!(envs.batch, envs.env; obs = begin_rows!(envs, mask), rows = mask), envs)
    return (obs = outputs(envs.env, envs.batch).obs, info = NamedTuple())
end

function step!(envs::BatchEnv, action::Action)
    env, batch = envs.env, envs.batch
    attempt(envs) do before
        stepped, found = step_rows!(envs, action, ones(Bool, env.rows), before)
        obs = all(stepped) ? observed(envs) : begin_rows!(envs, .!stepped)
        finish!(batch, env; obs = obs, found...)
        ended = copy(batch.was_reset)
        env.same_step && any(ended) && finish!(batch, env; obs = begin_rows!(envs, ended), rows = ended)
    end
    return merge(outputs(env, batch), (info = named(batch, env.fields.info, batch.step_info),))
end

# As that of an Env. The actions are actuators × steps × rows.
function rollout(envs::BatchEnv, actions::AbstractArray{<:Real,3})
    env, batch, (_, steps, rows) = envs.env, envs.batch, size(actions)
    obs, reward, playing = zeros(env.obs_count, steps, rows), zeros(steps, rows), ones(Bool, rows)
    terminated, truncated, info = zeros(Bool, steps, rows), zeros(Bool, steps, rows), NamedTuple[]
    for step in 1:steps
        any(playing) && attempt(envs) do before
            stepped, found = step_rows!(envs, actions[:, step, :], playing, before)
            stepped == playing || throw(ArgumentError("row $(findfirst(stepped .!= playing)): its episode has ended: reset it"))
            finish!(batch, env; obs = observed(envs), found..., rows = playing)
            finish!(batch, env, nothing)  # no row is reset
        end
        batch.step_info[repeat(.!playing, length(env.fields.info))] .= 0
        obs[:, step, :], reward[step, playing] = batch.obs, batch.reward[playing]
        terminated[step, :], truncated[step, :] = batch.terminated, batch.truncated
        push!(info, map(copy, named(batch, env.fields.info, batch.step_info, (rows,))))
        playing .&= .!(batch.terminated .| batch.truncated)
    end
    by_name = (name => permutedims(hcat((one[name] for one in info)...)) for name in keys(first(info)))
    return (; obs, reward, terminated, truncated, info = (; by_name...))
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

"""
    MJEnv.Heights

A height field, as an [`MJEnv.Terrain`](@ref), for tasks over all rows; [`MJEnv.terrain`](@ref)`(env, geom)` returns it.
"""
struct Heights
    data::Vector{Float32}
    grid::Grid
end

"""
    MJEnv.terrain(env, geom)

Returns the [`MJEnv.Heights`](@ref) of the geom with this name in the model of an [`Env`](@ref), for a task over all rows:

- `MJEnv.height(terrain, x, y)` returns the heights at `x` and `y`, m in the world's frame: numbers, or arrays of one size,
  whose last dimension is the row.
- `MJEnv.around(terrain, position, mat, points)` returns the heights at the `points` `(x, y)` around a body, in its frame
  turned by its yaw alone, with a column for each row. `position` and `mat`: those of the body,
  `sim.xpos[:, body, :]` and `sim.xmat[:, body, :]`.

If rows have their own `hfield_data`, pass it as one more argument, with a column for each row.
"""
function terrain(env::Env, geom::Union{AbstractString,Symbol})
    at = object_index(env, :geom, geom)
    return Heights(read(env, :hfield_data), grid_of((name, index) -> read(env, name)[index], at, geom))
end

height(terrain::Heights, x::Real, y::Real, data::AbstractVector = terrain.data) = height_of(terrain.grid, data, x, y)

function height(terrain::Heights, x::AbstractArray, y::AbstractArray, data::AbstractVecOrMat = terrain.data)
    axes(x) == axes(y) || throw(DimensionMismatch("x has the size $(size(x)), but y $(size(y))"))
    of_row(at) = data isa AbstractVector ? data : view(data, :, last(Tuple(at)))
    return [height(terrain, x[at], y[at], of_row(at)) for at in CartesianIndices(x)]
end

function around(
    terrain::Heights, position::AbstractMatrix, mat::AbstractMatrix, points, data::AbstractVecOrMat = terrain.data
)
    places = [yawed(position[1, row], position[2, row], mat[1, row], mat[4, row]) for row in axes(position, 2)]
    found = [place(point) for point in points, place in places]
    return height(terrain, first.(found), last.(found), data)
end
