# Named parts of records: the terms of an observation, the values of an info, MuJoCo's arrays.

"""
    MJEnv.Field

A named part of a record, as [`MJEnv.fields`](@ref) lists it: its `name`, `doc`, `shape` (`()` for a number), the
`range` of its elements within one row's record, and the `type` that Gymnasium gives it, such as
`MJEnv.MJENV_NUMPY_FLOAT64`.

A shape is the reverse of NumPy's, because Julia stores columns and NumPy rows: `xpos` is `(3, nbody)` here, and
`xpos[:, b]` the position of body `b`.
"""
struct Field
    name::String
    doc::String
    shape::Tuple{Vararg{Int}}
    range::UnitRange{Int}
    type::mjenv_type
end

function Field(f::mjenv_field)
    shape = reverse(f.shape[1:f.ndim])
    range = (f.offset + 1):(f.offset + f.count)
    return Field(unsafe_string(f.name), borrowed(f.doc), shape, range, mjenv_type(f.type))
end

role_name(role::mjenv_role) = Symbol(lowercase(replace(string(role), "MJENV_" => "")))
const ROLES = Dict(role_name(role) => role for role in instances(mjenv_role))

function role_of(name::Symbol)
    haskey(ROLES, name) && return ROLES[name]
    throw(ArgumentError("no role :$name; there are $(join(map(repr ∘ role_name, instances(mjenv_role)), ", "))"))
end

function fields_of(handle::Ptr{mjenv_env}, role::mjenv_role)
    return map(0:(mjenv_field_count(handle, role) - 1)) do index
        field = Ref(mjenv_field())
        check(mjenv_field_at(handle, role, index, field))
        Field(field[])
    end
end

# How many numbers the fields take in one row's record.
record_length(fields::Vector{Field}) = isempty(fields) ? 0 : last(fields[end].range)

julia_type(type::mjenv_type, action_type::Type) =
    type == MJENV_ACTION_DTYPE ? action_type :
    type in (MJENV_PYTHON_INT, MJENV_NUMPY_INT64) ? Int64 :
    type == MJENV_NUMPY_FLOAT32 ? Float32 :
    type == MJENV_NUMPY_INT32 ? Int32 :
    type == MJENV_NUMPY_UINT8 ? UInt8 : Float64

# A field of one row: a number, or an array of the field's shape.
shaped(values, field::Field, T::Type) = isempty(field.shape) ? T(values[1]) : reshape(T.(values), field.shape)

# A field of many rows: they are the last dimensions.
shaped(values, field::Field, T::Type, ::Tuple{}) = shaped(values, field, T)
shaped(values, field::Field, T::Type, dimensions) = reshape(T.(values), (field.shape..., dimensions...))
