# Rollouts, and steps that are sent and received.

"""
    rollout(env, actions)

Steps every row many times, beginning at its present state, with given actions. `actions` has the size actuators × steps
× rows; for one row it may be a matrix of actuators × steps. A row whose episode ends stays there: for the steps that
remain, its flags and its observation repeat, and its rewards and infos are 0. No row is reset.

Returns `(obs = ..., reward = ..., terminated = ..., truncated = ..., info = ...)`. The last dimensions of these arrays
are those of `actions`: steps × rows, or steps. The rules for actions and the errors are those of [`step!`](@ref).

[`rollout!`](@ref) does the same and writes into preallocated arrays.
"""
function rollout(env::Env, actions::AbstractArray{<:Real})
    batch = rollout!(Batch(env; steps = size(actions, 2)), env, actions)
    dimensions = size(actions)[2:end]
    return (
        obs = reshape(batch.obs, (env.obs_count, dimensions...)),
        reward = reshape(batch.reward, dimensions),
        terminated = reshape(batch.terminated, dimensions),
        truncated = reshape(batch.truncated, dimensions),
        info = named(batch, batch.fields, batch.values, dimensions),
    )
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
    fields = env.info_fields
    GC.@preserve batch begin
        out = raw(batch, env, env.rows * steps)
        status = inside(handle -> mjenv_rollout(handle, actions, length(actions), dtype_of(T), steps, out), env)
        note!(batch, env, status, fields, T)
        check(status)
    end
    return batch
end

@noinline function refuse_actions(env, actions)
    wanted = "$(env.action_count) × steps" * (env.rows == 1 ? "" : " × $(env.rows)")
    throw(DimensionMismatch("the actions of a rollout of this $env are $wanted, not of size $(size(actions))"))
end

"""
    send!(batch, env, action; rows = 1:env.rows)

Begins a step of some rows and returns at once: `action` has a column for each of `rows`, and is copied. [`recv!`](@ref)
waits for them; each row's outputs go to its own place in the [`Batch`](@ref). While rows are under way their outputs
are not to be read, no array of the batch may be resized, and all rows under way share one batch; only `send!` of other
rows, `recv!` and `close` are allowed. Returns `env`.
"""
function send!(
    batch::Batch,
    env::Env,
    action::Action;
    rows::AbstractVector{<:Integer} = 1:env.rows,
)
    given = dense(action)
    fits = ndims(given) == 1 ? length(rows) == 1 && length(given) == env.action_count :
           size(given) == (env.action_count, length(rows))
    fits || refuse_sent(env, given, length(rows))
    numbers = Int64[row_index(env, row) for row in rows]
    isempty(numbers) && return env
    fields = env.info_fields
    alone(env) do
        GC.@preserve batch send_and_keep!(batch, env, fields, numbers, given)
    end
    return env
end

function send_and_keep!(batch, env, fields, numbers, given)
    raw(batch, env)  # refuses a batch of other sizes before anything is under way
    check(inside(env) do handle
        mjenv_send(handle, numbers, length(numbers), given, length(given), dtype_of(eltype(given)))
    end)
    env.under_way += length(numbers)
    env.written = batch
    note!(batch, env, MJENV_OK, fields, eltype(given))
    return
end

# Calls f unless another thread is between a call of the library and the note of what it put under way.
function alone(f, env::Env)
    if Threads.atomic_cas!(env.halves, 0, 1) != 0
        throw(MJEnvError(MJENV_E_BUSY, "another thread is inside this environment"))
    end
    try
        return f()
    finally
        env.halves[] = 0
    end
end

@noinline function refuse_sent(env, action, count)
    wanted = "$(env.action_count)×$count"
    throw(DimensionMismatch("the action for $count row(s) of this $env is $wanted, not of size $(size(action))"))
end

"""
    recv!(rows, env; least = 1)

Waits until at least `least` rows that were sent have been stepped. Writes the numbers of all that have into `rows`, as
many as fit, and 0 behind them; returns a view of the numbers. Where MuJoCo fails in some of them an `MJEnvError` of
status `MJENV_E_PHYSICS` is thrown after `rows` was written, and `status` in the batch tells which.
"""
recv!(rows::Vector{Int64}, env::Env; least::Integer = 1) = alone(() -> receive!(rows, env, least), env)

function receive!(rows, env, least)
    received = Ref{Csize_t}(0)
    batch = env.written
    status = batch === nothing ? inside(handle -> mjenv_recv(handle, least, -1.0, rows, length(rows), received, C_NULL), env) :
             GC.@preserve batch begin
        out = raw(batch, env)
        inside(handle -> mjenv_recv(handle, least, -1.0, rows, length(rows), received, out), env)
    end
    # A failure in a row, for want of memory, too, is told as the rows are; any other tells none.
    status == MJENV_OK || received[] > 0 || check(status)
    count = Int(received[])
    rows[1:count] .+= 1
    rows[(count + 1):end] .= 0
    env.under_way -= count
    env.under_way == 0 && (env.written = nothing)
    check(status)
    return view(rows, 1:count)
end
