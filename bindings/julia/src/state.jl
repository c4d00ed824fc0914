# Reads, sets, copies and saves the state of rows.

function arrays_of(env::Env)
    if isempty(env.arrays)
        # If mjData and mjModel both have an array of a name, the library reads the model's.
        env.arrays = Dict(field.name => field for role in (:data, :model, :parameters) for field in fields(env, role))
    end
    return env.arrays
end

"""
    read(env, array; row = 1)

Reads an array of the row's mjData or of the mjModel by its MuJoCo name: `:qpos`, `:xpos`, `:body_mass`, `:nq`,
`"opt.timestep"`. The values are those of Gymnasium's `env.unwrapped.data` after the last step. Returns a number or a
new array with the element type that MuJoCo uses. `MJEnv.fields(env, :data)` and `MJEnv.fields(env, :model)` list the
arrays with their shapes and units. An unknown name throws an [`MJEnvError`](@ref).

Shapes are the reverse of NumPy's: `read(env, :xpos)` has the size 3 × nbody, and `xpos[:, b]` is the position of body
`b`. Bodies and other objects are numbered from 1, see [`object_index`](@ref). Where MuJoCo stores the number of an
object in an array, that number counts from 0.
"""
function Base.read(env::Env, array::Union{Symbol,AbstractString}; row::Integer = 1)
    name = text(array)
    index = row_index(env, row)
    values = inside(handle -> sized(mjenv_read, handle, Float64, index, name), env)
    field = get(arrays_of(env), name, nothing)
    field === nothing && return values  # the parameters from which resets draw
    return shaped(values, field, julia_type(field.dtype, Float64))
end

"""
    object_count(env, type)

Returns how many objects of a type the model has. `type` is its name in MJCF: `:body`, `:joint`, `:mesh`, `:key` and so
on. An unknown type throws an [`MJEnvError`](@ref), which lists all.
"""
object_count(env::Env, type::Union{Symbol,AbstractString}) =
    Int(inside(handle -> answer(mjenv_object_count, handle, Int64(0), text(type)), env))

"""
    object_index(env, type, name)

Returns the number of a named object: its column, from 1, in the arrays of [`read`](@ref). [`object_count`](@ref) lists
the types. An unknown type or name throws an [`MJEnvError`](@ref).
"""
object_index(env::Env, type::Union{Symbol,AbstractString}, name::Union{Symbol,AbstractString}) =
    inside(handle -> answer(mjenv_object_index, handle, Int64(0), text(type), text(name)), env) + 1

"""
    object_name(env, type, index)

Returns the name of the object with the number `index`, from 1; `""` if it has no name. See [`object_index`](@ref).
"""
object_name(env::Env, type::Union{Symbol,AbstractString}, index::Integer) =
    inside(handle -> borrowed(answer(mjenv_object_name, handle, Cstring(C_NULL), text(type), index - 1)), env)

"""
    set_state!(env, qpos, qvel; row = 1)

Sets the positions and velocities of a row, in MuJoCo's units, and computes what depends on them, as Gymnasium's
`set_state` does. `qpos` and `qvel` are vectors or tuples of `nq` and `nv` finite numbers. The step count does not change.
Afterwards the row can be stepped, even if it was never reset or its episode had ended. Returns `env`.
"""
function set_state!(env::Env, qpos::Numbers, qvel::Numbers; row::Integer = 1)
    index = row_index(env, row)
    fits(env, "qpos", length(qpos), env.qpos_count)
    fits(env, "qvel", length(qvel), env.qvel_count)
    return call(mjenv_set_state, env, index, collect(Float64, qpos), length(qpos), collect(Float64, qvel), length(qvel))
end

# The values as the library takes them: all elements of the array, once or for each row of the environment.
function written(env::Env, name::String, values::Union{Real,AbstractArray{<:Real}}, rows::Rows)
    shape = haskey(arrays_of(env), name) ? arrays_of(env)[name].shape : size(values)
    size(values) == shape && return collect(Float64, vec(collect(values)))
    count = row_count(env, rows)
    if rows isa Integer || size(values) != (shape..., count)
        also = rows isa Integer ? "" : " or $((shape..., count))"
        throw(DimensionMismatch("the values of $name have the size $(size(values)); this $env needs $shape$also"))
    end
    rows isa Union{Colon,AbstractVector{Bool}} && return collect(Float64, vec(values))
    all_rows = zeros(prod(shape), env.rows)
    all_rows[:, numbers_of(env, rows)] = reshape(values, prod(shape), count)
    return vec(all_rows)
end

"""
    write!(env, array, values; rows = :)

Writes an array of the mjModel of the [`MJEnv.Rows`](@ref) `rows`, or an input of their mjData, by its MuJoCo name:
`:body_mass`, `:geom_friction`, `"opt.timestep"`, `:xfrc_applied`. `values` has the size that [`read`](@ref) returns, and
each of the rows gets these values; or it has one more dimension, the row, and each row gets its own.

The effect is that of the same assignment in Gymnasium (`env.unwrapped.model.body_mass[:] = values`). Resets keep values
of the mjModel, and clear the inputs. docs/c.md lists what can be written. An array that can't be written, or a value
that MuJoCo could not compute with, throws an [`MJEnvError`](@ref), and nothing is written. Returns `env`.
"""
function write!(env::Env, array::Union{Symbol,AbstractString}, values::Union{Real,AbstractArray{<:Real}}; rows::Rows = (:))
    name = text(array)
    numbers = written(env, name, values, rows)
    rows isa Integer && return call(mjenv_write_row, env, row_index(env, rows), name, numbers, length(numbers))
    return call(mjenv_write, env, mask_of(env, rows), name, numbers, length(numbers))
end

"""
    set_constants!(env; rows = :)

Calls mj_setConst for the [`MJEnv.Rows`](@ref) `rows`: MuJoCo computes again what it computes from masses, sizes and
`qpos0` when it compiles a model, for instance `body_subtreemass` and `dof_invweight0`. The rows end in the position
`qpos_spring`, for which mj_setConst computes last: reset them, or set their state. Returns `env`.
"""
set_constants!(env::Env; rows::Rows = (:)) =
    rows isa Integer ? call(mjenv_set_constants_row, env, row_index(env, rows)) :
    call(mjenv_set_constants, env, mask_of(env, rows))

"""
    simulate!(env, ctrl, frames; row = 1)

Advances the simulation of a row by `frames` steps of MuJoCo (mj_step) with the controls `ctrl`, a vector or tuple of a
number for each actuator, as Gymnasium's `do_simulation` does. This is not a step of the episode and gives no reward.
Returns `env`.
"""
function simulate!(env::Env, ctrl::Numbers, frames::Integer; row::Integer = 1)
    index = row_index(env, row)
    fits(env, "ctrl", length(ctrl), env.action_count)
    return call(mjenv_simulate, env, index, collect(Float64, ctrl), length(ctrl), frames)
end

"""
    MJEnv.compute_reward(env, achieved, desired)

Returns the rewards of pairs of goals by the task's `compute_reward`, for hindsight experience replay. The columns of
`achieved` and `desired`, of the size `(n, ...)`, are goals; the rewards have the other dimensions. Throws an `MJEnvError` if
the task has no `compute_reward`.
"""
function compute_reward(env::Env, achieved::AbstractArray{<:Real}, desired::AbstractArray{<:Real})
    size(achieved) == size(desired) ||
        throw(DimensionMismatch("the goals have the sizes $(size(achieved)) and $(size(desired))"))
    from, to = (convert(Array{Float64}, goals) for goals in (achieved, desired))
    rewards = zeros(size(achieved)[2:end])
    call(mjenv_compute_reward, env, from, to, length(from), rewards, length(rewards))
    return rewards
end

"""
    MJEnv.stream(env; row = 1)

Returns a row's random stream, a PCG64 as NumPy has it, as a tuple of six `UInt64`: the low and high half of the state,
the low and high half of the increment, and `has_uint32` and `uinteger`, which hold the half of a 64-bit draw that is not
yet used. Throws an `MJEnvError` if the row was neither seeded nor reset.
"""
function stream(env::Env; row::Integer = 1)
    words = zeros(UInt64, 6)
    call(mjenv_get_stream, env, row_index(env, row), words, 6)
    return Tuple(words)
end

"""
    set_stream!(env, words; row = 1)

Replaces a row's random stream by `words`, six `UInt64` in the order of [`MJEnv.stream`](@ref); the increment must be
odd. Returns `env`.
"""
function set_stream!(env::Env, words::Union{NTuple{6,UInt64},AbstractVector{UInt64}}; row::Integer = 1)
    fits(env, "words", length(words), 6)
    return call(mjenv_set_stream, env, row_index(env, row), collect(UInt64, words), 6)
end

"""
    copy_row!(env, from, to)

Copies the row `from` into the [`MJEnv.Rows`](@ref) `to`: simulation, random stream, counters and written arrays. Returns
`env`.
"""
copy_row!(env::Env, from::Integer, to::Rows) = call(mjenv_copy_row, env, mask_of(env, to), row_index(env, from))

"""
    snapshot(env; rows = :)

Saves all rows, or the row of a number, as a new `Vector{UInt8}`, called an image: simulation, random stream, counters and
written arrays. [`restore!`](@ref) continues from it.
"""
snapshot(env::Env; rows::Union{Integer,Colon} = (:)) =
    inside(handle -> sized(mjenv_snapshot, handle, UInt8, image_row(env, rows)), env)

"""
    restore!(env, image; rows = :)

Sets all rows, or the row of a number, to the state that a [`snapshot`](@ref) of as many rows saved. They continue with
the same bits, also in another process and with another number of threads. The environment must have the same id, model
and options as the one that was saved, except for options such as `num_threads` and `arrays` (docs/rows.md lists them).
Otherwise, or if the image is damaged, it throws an [`MJEnvError`](@ref) of status `MJENV_E_SNAPSHOT`. Returns `env`.
"""
restore!(env::Env, image::AbstractVector{UInt8}; rows::Union{Integer,Colon} = (:)) =
    call(mjenv_restore, env, image_row(env, rows), convert(Vector{UInt8}, image), length(image))
