# Reads, sets, copies and saves the state of rows.

function row_index(env::Env, row::Integer)
    1 <= row <= env.rows && return Int(row) - 1
    throw(ArgumentError("row $row is outside 1:$(env.rows)"))
end

function arrays_of(env::Env)
    if isempty(env.arrays)
        # If mjData and mjModel both have an array of a name, the library reads the model's.
        env.arrays = Dict(field.name => field for role in (:data, :model) for field in fields(env, role))
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
    values = inside(env) do handle
        count = Ref{Csize_t}()
        check(handle, mjenv_read(handle, index, name, C_NULL, 0, count))
        values = Vector{Float64}(undef, count[])
        check(handle, mjenv_read(handle, index, name, values, length(values), count))
        values
    end
    field = arrays_of(env)[name]
    return shaped(values, field, julia_type(field.type, Float64))
end

"""
    object_count(env, type)

Returns how many objects of a type the model has. `type` is `:body`, `:joint`, `:geom`, `:site`, `:camera`, `:actuator`,
`:tendon`, `:sensor` or `:light`. An unknown type throws an [`MJEnvError`](@ref).
"""
function object_count(env::Env, type::Union{Symbol,AbstractString})
    kind, count = text(type), Ref{Int64}()
    check(env.handle, inside(handle -> mjenv_object_count(handle, kind, count), env))
    return Int(count[])
end

"""
    object_index(env, type, name)

Returns the number of a named object: its column, from 1, in the arrays of [`read`](@ref). [`object_count`](@ref) lists
the types. An unknown type or name throws an [`MJEnvError`](@ref).
"""
function object_index(env::Env, type::Union{Symbol,AbstractString}, name::Union{Symbol,AbstractString})
    kind, wanted, index = text(type), text(name), Ref{Int64}()
    check(env.handle, inside(handle -> mjenv_object_index(handle, kind, wanted, index), env))
    return index[] + 1
end

"""
    object_name(env, type, index)

Returns the name of the object with the number `index`, from 1; `""` if it has no name. See [`object_index`](@ref).
"""
function object_name(env::Env, type::Union{Symbol,AbstractString}, index::Integer)
    kind, name = text(type), Ref(Cstring(C_NULL))
    return inside(env) do handle
        check(handle, mjenv_object_name(handle, kind, index - 1, name))
        borrowed(name[])
    end
end

function check_length(env::Env, name, given, needed)
    given == needed || throw(DimensionMismatch("$name has $given elements; this $env needs $needed"))
end

"""
    set_state!(env, qpos, qvel; row = 1)

Sets the positions and velocities of a row, in MuJoCo's units, and computes what depends on them, as Gymnasium's
`set_state` does. `qpos` and `qvel` are vectors or tuples of `nq` and `nv` finite numbers. The count of steps goes on.
After it the row may be stepped, even if it was never reset or its episode had ended. Returns `env`.
"""
function set_state!(env::Env, qpos::Numbers, qvel::Numbers; row::Integer = 1)
    index = row_index(env, row)
    check_length(env, "qpos", length(qpos), env.qpos_count)
    check_length(env, "qvel", length(qvel), env.qvel_count)
    q, v = collect(Float64, qpos), collect(Float64, qvel)
    check(env.handle, inside(handle -> mjenv_set_state(handle, index, q, length(q), v, length(v)), env))
    return env
end

# The values as the library takes them: all elements of the array, once for each row if rows are its last dimension.
function written(env::Env, name::String, values::Union{Real,AbstractArray{<:Real}}, rows::Tuple{Vararg{Int}})
    wanted = haskey(arrays_of(env), name) ? (arrays_of(env)[name].shape..., rows...) : size(values)
    size(values) == wanted && return collect(Float64, vec(collect(values)))
    throw(DimensionMismatch("the values of $name have the size $(size(values)); this $env needs $wanted"))
end

"""
    write!(env, array, values; row = 1)

Writes an array of the row's mjModel, or an input of its mjData, by its MuJoCo name: `:body_mass`, `:geom_friction`,
`"opt.timestep"`, `:xfrc_applied`. `values` has the size that [`read`](@ref) returns; `row = :` gives all rows these
values. The effect is that of the same assignment in Gymnasium (`env.unwrapped.model.body_mass[:] = values`): values of
the mjModel stay over resets, and a reset clears the inputs. mjenv.h lists what can be written. An array that can't be
written, or a value that MuJoCo could not compute with, throws an [`MJEnvError`](@ref), and nothing is written. Returns
`env`.

```julia
masses = read(env, :body_mass)
masses[2] *= 1.5
write!(env, :body_mass, masses)
```
"""
function write!(
    env::Env,
    array::Union{Symbol,AbstractString},
    values::Union{Real,AbstractArray{<:Real}};
    row::Union{Integer,Colon} = 1,
)
    index, name = rows_index(env, row), text(array)
    numbers = written(env, name, values, ())
    check(env.handle, inside(handle -> mjenv_write(handle, index, name, numbers, length(numbers)), env))
    return env
end

"""
    write_rows!(env, array, values; mask = nothing)

Writes an array of many rows, each with values of its own: the last dimension of `values` is the row. Rows where the
`Bool` vector `mask` is false keep theirs. Otherwise it is like [`write!`](@ref). Returns `env`.

```julia
write_rows!(env, "opt.timestep", [0.01, 0.02, 0.03])  # three rows
```
"""
function write_rows!(
    env::Env,
    array::Union{Symbol,AbstractString},
    values::AbstractArray{<:Real};
    mask::Union{Nothing,AbstractVector{Bool}} = nothing,
)
    name = text(array)
    numbers = written(env, name, values, (env.rows,))
    flags = as_mask(env, mask)
    check(env.handle, inside(handle -> mjenv_write_rows(handle, flags, name, numbers, length(numbers)), env))
    return env
end

"""
    set_constants!(env; row = 1)

Calls mj_setConst for a row, or for all rows with `row = :`: MuJoCo computes anew what it computes from masses, sizes
and `qpos0` when it compiles a model, for instance `body_subtreemass` and `dof_invweight0`. The row ends in the position
`qpos_spring`, for which mj_setConst computes last: reset the row, or set its state. Returns `env`.
"""
function set_constants!(env::Env; row::Union{Integer,Colon} = 1)
    index = rows_index(env, row)
    check(env.handle, inside(handle -> mjenv_set_constants(handle, index), env))
    return env
end

"""
    simulate!(env, ctrl, frames; row = 1)

Advances the simulation of a row by `frames` steps of MuJoCo (mj_step) with the controls `ctrl`, a vector or tuple of a
number for each actuator, as Gymnasium's `do_simulation` does. It counts no step of the environment and gives no reward.
Returns `env`.
"""
function simulate!(env::Env, ctrl::Numbers, frames::Integer; row::Integer = 1)
    index = row_index(env, row)
    check_length(env, "ctrl", length(ctrl), env.action_count)
    c = collect(Float64, ctrl)
    check(env.handle, inside(handle -> mjenv_simulate(handle, index, c, length(c), frames), env))
    return env
end

"""
    MJEnv.stream(env; row = 1)

Returns a row's random stream, a PCG64 as NumPy has it, as a tuple of six `UInt64`: the low and high half of the state,
the low and high half of the increment, and `has_uint32` and `uinteger`, which keep the half of a 64-bit draw that is
not used yet. Throws an `MJEnvError` if the row was neither seeded nor reset.
"""
function stream(env::Env; row::Integer = 1)
    index, words = row_index(env, row), zeros(UInt64, 6)
    check(env.handle, inside(handle -> mjenv_get_stream(handle, index, words, 6), env))
    return Tuple(words)
end

"""
    set_stream!(env, words; row = 1)

Replaces a row's random stream by `words`, six `UInt64` in the order of [`MJEnv.stream`](@ref); the increment must be
odd. Returns `env`.
"""
function set_stream!(env::Env, words::Union{NTuple{6,UInt64},AbstractVector{UInt64}}; row::Integer = 1)
    index = row_index(env, row)
    check_length(env, "words", length(words), 6)
    check(env.handle, inside(handle -> mjenv_set_stream(handle, index, collect(UInt64, words), 6), env))
    return env
end

"""
    copy_row!(env, from, to)

Copies the row `from` into all rows where the `Bool` vector `to` is true: simulation, random stream, counters and
written arrays. Returns `env`.
"""
function copy_row!(env::Env, from::Integer, to::AbstractVector{Bool})
    index, mask = row_index(env, from), as_mask(env, to)
    check(env.handle, inside(handle -> mjenv_copy_row(handle, index, mask), env))
    return env
end

rows_index(env::Env, row::Integer) = row_index(env, row)
rows_index(::Env, ::Colon) = MJENV_ALL_ROWS

"""
    snapshot(env; row = 1)

Saves a row (or all rows with `row = :`) as a new `Vector{UInt8}`, called an image: simulation, random stream,
counters and written arrays. [`restore!`](@ref) continues from it.
"""
function snapshot(env::Env; row::Union{Integer,Colon} = 1)
    index = rows_index(env, row)
    return inside(env) do handle
        size = Ref{Csize_t}()
        check(handle, mjenv_snapshot(handle, index, C_NULL, 0, size))
        image = Vector{UInt8}(undef, size[])
        check(handle, mjenv_snapshot(handle, index, image, length(image), size))
        image
    end
end

"""
    restore!(env, image; row = 1)

Sets a row (or all rows with `row = :`) to the state that a [`snapshot`](@ref) saved. The row continues with the same
bits, also in another process and with another number of threads. The environment must have the same id, model and
options as the one that was saved, except for `num_threads`, `lanes`, `cpu_affinity` and `arrays`; an image of all rows
needs as many rows. Otherwise, or if the image is damaged, it throws an [`MJEnvError`](@ref) of status `MJENV_E_SNAPSHOT`.
Returns `env`.
"""
function restore!(env::Env, image::AbstractVector{UInt8}; row::Union{Integer,Colon} = 1)
    index = rows_index(env, row)
    bytes = convert(Vector{UInt8}, image)
    check(env.handle, inside(handle -> mjenv_restore(handle, index, bytes, length(bytes)), env))
    return env
end
