# Rollouts, and steps that are sent and received.

"""
    rollout(env, actions)

Steps every row many times from its present state with given actions. `actions` has the size actuators × steps
× rows; for one row it may be a matrix of actuators × steps. A row whose episode ends stays there: for the steps that
remain, its flags and its observation repeat, and its rewards and infos are 0. No row is reset.

Returns `(obs = ..., reward = ..., terminated = ..., truncated = ..., info = ...)`. The last dimensions of these arrays
are those of `actions`: steps × rows, or steps. The rules for actions and the errors are those of [`step!`](@ref).

[`rollout!`](@ref) does the same and writes into preallocated arrays.
"""
function rollout(env::Env, actions::AbstractArray{<:Real})
    batch = rollout!(Batch(env; steps = size(actions, 2)), env, actions)
    dimensions = size(actions)[2:end]
    reward, terminated, truncated = (reshape(x, dimensions) for x in (batch.reward, batch.terminated, batch.truncated))
    obs = reshape(batch.obs, (env.obs_count, dimensions...))
    return (; obs, reward, terminated, truncated, info = named(batch, batch.fields, batch.values, dimensions))
end

"""
    rollout!(batch, env, actions)

Does what [`rollout`](@ref) does, and writes into a [`Batch`](@ref) that was built with as many `steps`, which it
returns. It allocates nothing if `actions` is an `Array` of `Float32` or `Float64`.
"""
rollout!(batch::Batch, env::Env, actions::AbstractArray{<:Real}) = rollout_dense!(batch, env, dense(actions))

function rollout_dense!(batch::Batch, env::Env, actions::StridedArray{T}) where {T}
    steps = size(actions, 2)
    fits = ndims(actions) == 2 && env.rows == 1 ? size(actions, 1) == env.action_count :
           size(actions) == (env.action_count, steps, env.rows)
    fits || refuse_actions(env, actions)
    return written!(batch, env, env.fields.info, T, env.rows * steps) do handle, out
        mjenv_rollout(handle, actions, length(actions), dtype_of(T), steps, out)
    end
end

@noinline function refuse_actions(env, actions)
    wanted = "$(env.action_count) × steps" * (env.rows == 1 ? "" : " × $(env.rows)")
    throw(DimensionMismatch("the actions of a rollout of this $env are $wanted, not of size $(size(actions))"))
end

"""
    send!(env, action; rows = :)

Begins a step of the [`MJEnv.Rows`](@ref) `rows` and returns at once, so that the program can work while the rows are
stepped. `action` is that of [`step!`](@ref), and is copied. [`recv!`](@ref) returns the results. While rows are under
way, only `send!` of other rows, `recv!` and `close` are allowed; other functions that read or change rows throw an
[`MJEnvError`](@ref). The errors are those of [`step!`](@ref), except that `recv!` throws those of MuJoCo. Returns `env`.
"""
function send!(env::Env, action::Action; rows::Rows = (:))
    given = dense(action)
    check_columns(env, given, row_count(env, rows))
    numbers = Int64.(numbers_of(env, rows)) .- 1
    isempty(numbers) && return env
    sent = rows isa AbstractVector{Bool} ? given[:, rows] : given
    check(env.handle, inside(env) do handle
        mjenv_send(handle, numbers, length(numbers), sent, length(sent), dtype_of(eltype(sent)))
    end)
    env.sent_type = eltype(sent)
    return env
end

# Whether an action has a column for each of so many rows.
function check_columns(env::Env, action, count)
    fits = ndims(action) == 1 ? count == 1 && length(action) == env.action_count :
           size(action) == (env.action_count, count)
    fits || refuse_columns(env, action, count)
end

@noinline function refuse_columns(env, action, count)
    wanted = env.rows == 1 ? "a vector of $(env.action_count)" : "$(env.action_count)×$count"
    throw(DimensionMismatch("the action for $count row(s) of this $env is $wanted, not of size $(size(action))"))
end

"""
    recv!(rows, batch, env; least = 1, timeout = Inf)

Waits until at least `least` of the rows that were sent have been stepped, or until `timeout` seconds have passed.
Writes the outputs of all rows that are done into a [`Batch`](@ref), each row's in its own place, and their numbers into
`rows`, a `Vector{Int64}`: as many as fit, followed by zeros. Returns a view of the numbers. Each row is reported once.

If MuJoCo fails in some of the rows, `recv!` throws an [`MJEnvError`](@ref) of status `MJENV_E_PHYSICS` after it has
written `rows` and `batch`. The field `status` of the batch says which rows failed.
"""
function recv!(rows::Vector{Int64}, batch::Batch, env::Env; least::Integer = 1, timeout::Real = Inf)
    timeout >= 0 || throw(ArgumentError("timeout is $timeout; it must be 0 or more seconds"))
    seconds = isinf(timeout) ? -1.0 : Float64(timeout)  # the library waits without limit for a negative time
    received = Ref{Int64}(0)
    status = GC.@preserve batch begin
        out = raw(batch, env)
        inside(handle -> mjenv_recv(handle, least, seconds, rows, length(rows), received, out), env)
    end
    count = Int(received[])
    # Rows that failed are reported; a call that was refused reports none.
    if status == MJENV_OK || count > 0
        note!(batch, env, MJENV_OK, env.fields.info, env.sent_type)
        rows[1:count] .+= 1
        rows[(count + 1):end] .= 0
    end
    check(env.handle, status)
    return view(rows, 1:count)
end
