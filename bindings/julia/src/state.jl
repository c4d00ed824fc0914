# The state of one row.

function row_index(env::Env, row::Integer)
    1 <= row <= env.rows && return Int(row) - 1
    throw(ArgumentError("row $row is outside 1:$(env.rows)"))
end

function arrays_of(env::Env)
    if isempty(env.arrays)
        # Where both have a name, the model's array is the one that is read.
        env.arrays = Dict(field.name => field for role in (:data, :model) for field in fields(env, role))
    end
    return env.arrays
end

"""
    read(env, array; row = 1)

An array of the row's mjData or of the mjModel, by its MuJoCo name (`:qpos`, `:xpos`, `:body_mass`, `:nq`,
`"opt.timestep"`), as Gymnasium's `env.unwrapped.data` holds it after the last step: a number or a new array, of the
type it has in MuJoCo. `MJEnv.fields(env, :data)` and `MJEnv.fields(env, :model)` list them.

An array's shape is the reverse of NumPy's: `read(env, :xpos)` is 3 × nbody, `xpos[:, b]` the position of body `b`. The
bodies and other objects count from 1 here: see [`object_index`](@ref). Numbers of objects that MuJoCo stores in its
arrays count from 0.
"""
function Base.read(env::Env, array::Union{Symbol,AbstractString}; row::Integer = 1)
    name = text(array)
    index = row_index(env, row)
    values = inside(env) do handle
        count = Ref{Csize_t}()
        check(mjenv_read(handle, index, name, C_NULL, 0, count))
        values = Vector{Float64}(undef, count[])
        check(mjenv_read(handle, index, name, values, length(values), count))
        values
    end
    field = arrays_of(env)[name]
    return shaped(values, field, julia_type(field.type, Float64))
end

"""
    object_index(env, type, name)

The number of a named object, from 1, as the columns of [`read`](@ref)'s arrays count. `type` is `:body`, `:joint`,
`:geom`, `:site`, `:camera`, `:actuator`, `:tendon`, `:sensor` or `:light`.
"""
function object_index(env::Env, type::Union{Symbol,AbstractString}, name::Union{Symbol,AbstractString})
    kind, wanted, index = text(type), text(name), Ref{Int64}()
    check(inside(handle -> mjenv_object_index(handle, kind, wanted, index), env))
    return index[] + 1
end

"""
    object_name(env, type, index)

The name of the object with that number, from 1; empty if it has none. See [`object_index`](@ref).
"""
function object_name(env::Env, type::Union{Symbol,AbstractString}, index::Integer)
    kind, name = text(type), Ref(Cstring(C_NULL))
    return inside(env) do handle
        check(mjenv_object_name(handle, kind, index - 1, name))
        borrowed(name[])
    end
end

function check_length(env::Env, name, given, needed)
    given == needed || throw(DimensionMismatch("$name has $given elements; this $env needs $needed"))
end

"""
    set_state!(env, qpos, qvel; row = 1)

Sets the positions and velocities of a row and computes what follows from them, as Gymnasium's `set_state`. The step
count goes on; a row that was never reset, or had ended, may be stepped again. Returns `env`.
"""
function set_state!(env::Env, qpos::Numbers, qvel::Numbers; row::Integer = 1)
    index = row_index(env, row)
    check_length(env, "qpos", length(qpos), env.qpos_count)
    check_length(env, "qvel", length(qvel), env.qvel_count)
    q, v = collect(Float64, qpos), collect(Float64, qvel)
    check(inside(handle -> mjenv_set_state(handle, index, q, length(q), v, length(v)), env))
    return env
end

"""
    simulate!(env, ctrl, frames; row = 1)

`frames` times mj_step of a row under `ctrl`, as Gymnasium's `do_simulation`: no step is counted, and the task sees only
the new state. Returns `env`.
"""
function simulate!(env::Env, ctrl::Numbers, frames::Integer; row::Integer = 1)
    index = row_index(env, row)
    check_length(env, "ctrl", length(ctrl), env.action_count)
    c = collect(Float64, ctrl)
    check(inside(handle -> mjenv_simulate(handle, index, c, length(c), frames), env))
    return env
end

"""
    MJEnv.stream(env; row = 1)

A row's random stream as NumPy's PCG64 has it: the state, then the increment, each as its low and its high 64 bits.
Throws an `MJEnvError` where the row was neither seeded nor reset.
"""
function stream(env::Env; row::Integer = 1)
    index, words = row_index(env, row), zeros(UInt64, 4)
    check(inside(handle -> mjenv_get_stream(handle, index, words, 4), env))
    return Tuple(words)
end

"""
    set_stream!(env, words; row = 1)

Replaces a row's random stream by one as [`MJEnv.stream`](@ref) tells it; the increment is odd. Returns `env`.
"""
function set_stream!(env::Env, words::Union{NTuple{4,UInt64},AbstractVector{UInt64}}; row::Integer = 1)
    index = row_index(env, row)
    check_length(env, "words", length(words), 4)
    check(inside(handle -> mjenv_set_stream(handle, index, collect(UInt64, words), 4), env))
    return env
end

"""
    copy_row!(env, from, to)

Makes the rows where the `Bool` vector `to` is true equal to the row `from`: simulation, random stream, counters.
Returns `env`.
"""
function copy_row!(env::Env, from::Integer, to::AbstractVector{Bool})
    index, mask = row_index(env, from), as_mask(env, to)
    check(inside(handle -> mjenv_copy_row(handle, index, mask), env))
    return env
end

rows_index(env::Env, row::Integer) = row_index(env, row)
rows_index(::Env, ::Colon) = MJENV_ALL_ROWS

"""
    snapshot(env; row = 1)

Copies a row, its simulation, random stream and counters, or with `row = :` all rows, into a new `Vector{UInt8}` for
[`restore!`](@ref).
"""
function snapshot(env::Env; row::Union{Integer,Colon} = 1)
    index = rows_index(env, row)
    return inside(env) do handle
        size = Ref{Csize_t}()
        check(mjenv_snapshot(handle, index, C_NULL, 0, size))
        image = Vector{UInt8}(undef, size[])
        check(mjenv_snapshot(handle, index, image, length(image), size))
        image
    end
end

"""
    restore!(env, image; row = 1)

Continues a row, or with `row = :` all rows, from a [`snapshot`](@ref), bit for bit, also in another process and with
another number of threads. The environment must have the id, the model and the options (`num_threads`, `cpu_affinity`, `arrays`
aside) of the one the image was taken from, and as many rows if the image is of all. Returns `env`.
"""
function restore!(env::Env, image::AbstractVector{UInt8}; row::Union{Integer,Colon} = 1)
    index = rows_index(env, row)
    bytes = convert(Vector{UInt8}, image)
    check(inside(handle -> mjenv_restore(handle, index, bytes, length(bytes)), env))
    return env
end
