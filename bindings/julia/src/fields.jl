# The named parts of observations, actions and infos, and MuJoCo's arrays.

"""
    MJEnv.Field

Describes a term of an observation, an actuator, an info or an array of MuJoCo: its `name`, its `doc`, its `shape` (`()`
for a number), the `range` of its elements within one row, and the `dtype` that Gymnasium gives it, such as
`MJEnv.MJENV_DTYPE_FLOAT64`.

Shapes are the reverse of NumPy's, because Julia stores columns and NumPy stores rows: `xpos` has the shape
`(3, nbody)`, and `xpos[:, b]` is the position of body `b`.
"""
struct Field
    name::String
    doc::String
    shape::Tuple{Vararg{Int}}
    range::UnitRange{Int}
    dtype::mjenv_dtype
end

Base.show(io::IO, field::Field) =
    print(io, "MJEnv.Field(", repr(field.name), isempty(field.shape) ? "" : ", " * join(field.shape, " × "), ")")

function Field(f::mjenv_field)
    shape = reverse(f.shape[1:f.ndim])
    range = (f.offset + 1):(f.offset + f.count)
    return Field(unsafe_string(f.name), borrowed(f.doc), shape, range, mjenv_dtype(f.dtype))
end

role_name(role::mjenv_role) = Symbol(lowercase(replace(string(role), "MJENV_ROLE_" => "")))
const ROLES = Dict(role_name(role) => role for role in instances(mjenv_role))

function role_of(name::Symbol)
    haskey(ROLES, name) && return ROLES[name]
    throw(ArgumentError("no role :$name; there are $(join(map(repr ∘ role_name, instances(mjenv_role)), ", "))"))
end

fields_of(handle, role) =
    [Field(answer(mjenv_field_at, handle, mjenv_field(), role, i)) for i in 0:(mjenv_field_count(handle, role) - 1)]

# The fields of an environment's outputs, which are named like their roles.
struct Outputs
    info::Vector{Field}
    reset_info::Vector{Field}
    arrays::Vector{Field}
    groups::Vector{Field}
end

# How many numbers the fields of one row have together.
record_length(fields::Vector{Field}) = isempty(fields) ? 0 : last(fields[end].range)

julia_type(dtype::mjenv_dtype, action_type::Type) =
    dtype == MJENV_DTYPE_ACTION ? action_type :
    dtype in (MJENV_DTYPE_NATIVE_INT, MJENV_DTYPE_INT64) ? Int64 :
    dtype == MJENV_DTYPE_FLOAT32 ? Float32 :
    dtype == MJENV_DTYPE_INT32 ? Int32 :
    dtype == MJENV_DTYPE_UINT8 ? UInt8 : Float64

# The value of a field: of one row a number, or an array of the field's shape; of many rows, these are the last dimensions.
shaped(values, field::Field, T::Type, dimensions = ()) =
    isempty(field.shape) && isempty(dimensions) ? T(values[1]) : reshape(T.(values), (field.shape..., dimensions...))
