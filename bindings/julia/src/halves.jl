# Resets and steps whose outputs the program computes.

pointer_or_null(array) = pointer(array)
pointer_or_null(::Nothing) = Ptr{Float64}(C_NULL)
count_of(array) = array === nothing ? 0 : length(array)

"""
    begin!(batch, env, qpos = nothing, qvel = nothing; rows = :)

Begins new episodes for `"Batch-v0"` and other tasks whose outputs the program computes, in these positions and
velocities: matrices with a column for each row of `env`; `nothing`: those of the model. Writes the arrays that the option
`arrays` names into the [`Batch`](@ref). Then compute the observations and call [`finish!`](@ref).
"""
function begin!(
    batch::Batch,
    env::Env,
    qpos::Union{Matrix{Float64},Nothing} = nothing,
    qvel::Union{Matrix{Float64},Nothing} = nothing;
    rows::Rows = (:),
)
    chosen = mask_of(env, rows)
    GC.@preserve batch qpos qvel begin
        out, q, v = raw(batch, env), pointer_or_null(qpos), pointer_or_null(qvel)
        check(env.handle, inside(h -> mjenv_begin(h, chosen, q, count_of(qpos), v, count_of(qvel), out), env))
    end
    return batch
end

"""
    act(env, action; rows = :)

Returns the actions that the task sees in the next step: transformed, delayed and with noise. `action` has a column for
each row of `env`. Changes nothing.
"""
function act(env::Env, action::Action; rows::Rows = (:))
    given, chosen = dense(action), mask_of(env, rows)
    seen = zero(given)
    dtype = dtype_of(eltype(given))
    check(env.handle, inside(h -> mjenv_act(h, chosen, given, length(given), dtype, seen), env))
    return seen
end

"""
    advance!(batch, env, action; ctrl = nothing, rows = :)

Simulates a step, and writes the arrays that the option `arrays` names and `was_reset` into the [`Batch`](@ref). `action`
has a column for each row of `env`; so has `ctrl`, what the program makes of the actions. The rows of `was_reset` were not
stepped: call [`begin!`](@ref) for them. Then compute the outputs and call [`finish!`](@ref).
"""
function advance!(
    batch::Batch,
    env::Env,
    action::Action;
    ctrl::Union{Matrix{Float64},Nothing} = nothing,
    rows::Rows = (:),
)
    given, chosen = dense(action), mask_of(env, rows)
    dtype, count = dtype_of(eltype(given)), length(given)
    GC.@preserve batch ctrl begin
        out, c = raw(batch, env), pointer_or_null(ctrl)
        check(env.handle, inside(h -> mjenv_advance(h, chosen, given, count, dtype, c, count_of(ctrl), out), env))
    end
    return batch
end

"""
    finish!(batch, env; obs, reward, terminated, info, reset_info, rows = :)
    finish!(batch, env, nothing; rows = :)

Ends the step or reset of rows with what the program has computed for all rows: `obs` a matrix with a column for each row,
of the task's own numbers; `reward` and `terminated` vectors; `info` and `reset_info` field by field, as in a
[`Batch`](@ref). What is left out is 0. Writes the outputs into the batch. `nothing` gives the step up. With the option
`autoreset_mode = :same_step`, call [`begin!`](@ref) and `finish!` for the rows of `batch.was_reset`.
"""
function finish!(
    batch::Batch,
    env::Env;
    obs::StridedMatrix{T},
    reward::Union{Vector{Float64},Nothing} = nothing,
    terminated::Union{Vector{Bool},Nothing} = nothing,
    info::Union{Vector{Float64},Nothing} = nothing,
    reset_info::Union{Vector{Float64},Nothing} = nothing,
    rows::Rows = (:),
) where {T<:Union{Float32,Float64}}
    info_count, reset_info_count = record_length(env.info_fields), record_length(env.reset_info_fields)
    obs_count = size(obs, 1)
    fits(env, "obs", size(obs, 2), env.rows)
    reward === nothing || fits(env, "reward", length(reward), env.rows)
    terminated === nothing || fits(env, "terminated", length(terminated), env.rows)
    info === nothing || fits(env, "info", length(info), info_count * env.rows)
    reset_info === nothing || fits(env, "reset_info", length(reset_info), reset_info_count * env.rows)
    obs = dense(obs)
    GC.@preserve batch obs reward terminated info reset_info begin
        given = Ref(
            mjenv_batch(
                obs_dtype = Int32(dtype_of(T)),
                rows = env.rows,
                obs_count = obs_count,
                info_count = info_count,
                reset_info_count = reset_info_count,
                obs = pointer(obs),
                reward = pointer_or_null(reward),
                terminated = terminated === nothing ? Ptr{Bool}(C_NULL) : pointer(terminated),
                info = pointer_or_null(info),
                reset_info = pointer_or_null(reset_info),
            ),
        )
        finish_given!(batch, env, given, rows)
    end
    return batch
end

finish!(batch::Batch, env::Env, ::Nothing; rows::Rows = (:)) = finish_given!(batch, env, C_NULL, rows)

function finish_given!(batch, env, given, rows)
    chosen = mask_of(env, rows)
    GC.@preserve batch begin
        out = raw(batch, env)
        check(env.handle, inside(h -> mjenv_finish(h, chosen, given, out), env))
    end
    return batch
end
