# Resets and steps whose outputs the program computes.

const MaybeVector = Union{Vector{Float64},Nothing}
const MaybeMatrix = Union{Matrix{Float64},Nothing}

pointer_or_null(array) = pointer(array)
pointer_or_null(::Nothing) = Ptr{Float64}(C_NULL)
count_of(array) = array === nothing ? 0 : length(array)

"""
    begin!(batch, env, qpos = nothing, qvel = nothing; rows = :)

Begins new episodes for `"Batch-v0"` and other tasks whose outputs the program computes, in these positions and
velocities: matrices with a column for each row of `env`; `nothing`: those of the model. Writes the arrays that the option
`arrays` names into the [`Batch`](@ref). Then compute the observations and call [`finish!`](@ref).
"""
function begin!(batch::Batch, env::Env, qpos::MaybeMatrix = nothing, qvel::MaybeMatrix = nothing; rows::Rows = (:))
    GC.@preserve batch qpos qvel begin
        q, v = pointer_or_null(qpos), pointer_or_null(qvel)
        call(mjenv_begin, env, mask_of(env, rows), q, count_of(qpos), v, count_of(qvel), raw(batch, env))
    end
    return batch
end

"""
    act(env, action; rows = :)

Returns the actions that the task sees in the next step: transformed, delayed and with noise. `action` has a column for
each row of `env`. Changes nothing.
"""
function act(env::Env, action::Action; rows::Rows = (:))
    given = dense(action)
    seen = zero(given)
    call(mjenv_act, env, mask_of(env, rows), given, length(given), dtype_of(eltype(given)), seen)
    return seen
end

"""
    advance!(batch, env, action; ctrl = nothing, rows = :)

Simulates a step, and writes the arrays that the option `arrays` names and `was_reset` into the [`Batch`](@ref). `action`
has a column for each row of `env`; so has `ctrl`, what the program makes of the actions. The rows of `was_reset` were not
stepped: call [`begin!`](@ref) for them. Then compute the outputs and call [`finish!`](@ref).
"""
function advance!(batch::Batch, env::Env, action::Action; ctrl::MaybeMatrix = nothing, rows::Rows = (:))
    given, chosen = dense(action), mask_of(env, rows)
    dtype, c = dtype_of(eltype(given)), pointer_or_null(ctrl)
    GC.@preserve batch ctrl begin
        call(mjenv_advance, env, chosen, given, length(given), dtype, c, count_of(ctrl), raw(batch, env))
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
    batch::Batch, env::Env; obs::StridedMatrix{T}, reward::MaybeVector = nothing,
    terminated::Union{Vector{Bool},Nothing} = nothing, info::MaybeVector = nothing,
    reset_info::MaybeVector = nothing, rows::Rows = (:),
) where {T<:Union{Float32,Float64}}
    info_count, reset_info_count = record_length(env.fields.info), record_length(env.fields.reset_info)
    fits(env, "obs", size(obs, 2), env.rows)
    for (name, array, count) in (
        ("reward", reward, 1), ("terminated", terminated, 1), ("info", info, info_count), ("reset_info", reset_info, reset_info_count),
    )
        array === nothing || fits(env, name, length(array), count * env.rows)
    end
    obs = dense(obs)
    GC.@preserve batch obs reward terminated info reset_info begin
        given = mjenv_batch(
            obs_dtype = Int32(dtype_of(T)),
            rows = env.rows,
            obs_count = size(obs, 1),
            info_count = info_count,
            reset_info_count = reset_info_count,
            obs = pointer(obs),
            reward = pointer_or_null(reward),
            terminated = terminated === nothing ? Ptr{Bool}(C_NULL) : pointer(terminated),
            info = pointer_or_null(info),
            reset_info = pointer_or_null(reset_info),
        )
        finish_given!(batch, env, Ref(given), rows)
    end
    return batch
end

finish!(batch::Batch, env::Env, ::Nothing; rows::Rows = (:)) = finish_given!(batch, env, C_NULL, rows)

function finish_given!(batch, env, given, rows)
    GC.@preserve batch call(mjenv_finish, env, mask_of(env, rows), given, raw(batch, env))
    return batch
end
