# The constructor options of an id.

"""
    MJEnv.Option

Describes an option that an id takes, see [`MJEnv.schema`](@ref): its `name`; its `kind` (`MJEnv.MJENV_KIND_FLAG`,
`MJENV_KIND_INTEGER`, `MJENV_KIND_REALS`, `MJENV_KIND_STRING` or `MJENV_KIND_STRING_OR_INT`); its `doc`; the closed
bounds `low` and `high` of each number; the `count` of numbers; the valid texts `choices` (empty if every text may be tried); and its `default`.
"""
struct Option
    name::Symbol
    kind::mjenv_kind
    doc::String
    low::Float64
    high::Float64
    count::Int
    choices::Vector{String}
    default::Any
end

Base.show(io::IO, option::Option) = print(io, "MJEnv.Option(", repr(option.name), ", ", repr(option.default), ")")

# Creates the options of an id at their defaults, and passes them to f.
function with_options(f, engine::Engine, id::AbstractString)
    handle = Handle(engine, answer(mjenv_options_create, engine, Ptr{mjenv_options}(C_NULL), text(id)))
    try
        return f(handle)
    finally
        mjenv_options_destroy(handle)
    end
end

# The types in which Julia programs hold a few numbers.
const Numbers = Union{Tuple{Vararg{Real}},AbstractVector{<:Real}}

function set_option!(handle, id, name::Symbol, value::Integer)
    if !(typemin(Int64) <= value <= typemax(Int64))
        throw(ArgumentError("option \"$name\" of $id is $value, which does not fit into 64 bits"))
    end
    check(handle, mjenv_options_set_integer(handle, text(name), value))
end

set_option!(handle, id, name::Symbol, value::Real) = set_option!(handle, id, name, (value,))

function set_option!(handle, id, name::Symbol, value::Numbers)
    numbers = collect(Float64, value)
    check(handle, mjenv_options_set_reals(handle, text(name), numbers, length(numbers)))
end

set_option!(handle, id, name::Symbol, value::Union{AbstractString,Symbol}) =
    check(handle, mjenv_options_set_string(handle, text(name), text(value)))

set_option!(handle, id, name::Symbol, value) = throw(
    ArgumentError(
        "option \"$name\" of $id is a $(typeof(value)); give a Bool, a number, a tuple or vector of numbers, " *
        "a string or a symbol",
    ),
)

all_options(handle) =
    [answer(mjenv_options_at, handle, mjenv_option(), i) for i in 0:(mjenv_options_count(handle) - 1)]

get_integer(handle, name) = answer(mjenv_options_get_integer, handle, Int64(0), name)
get_string(handle, name) = unsafe_string(answer(mjenv_options_get_string, handle, Cstring(C_NULL), name))

function get_value(handle, option::mjenv_option)
    kind = mjenv_kind(option.kind)
    kind == MJENV_KIND_FLAG && return get_integer(handle, option.name) != 0
    kind == MJENV_KIND_INTEGER && return get_integer(handle, option.name)
    kind == MJENV_KIND_STRING && return get_string(handle, option.name)
    if kind == MJENV_KIND_REALS
        values = sized(mjenv_options_get_reals, handle, Float64, option.name)
        return length(values) == 1 ? values[1] : Tuple(values)
    end
    try
        return get_integer(handle, option.name)
    catch refusal
        refusal isa MJEnvError && refusal.status == MJENV_E_TYPE || rethrow()
        return get_string(handle, option.name)
    end
end

function values_of(handle)
    listed = all_options(handle)
    names = Tuple(Symbol(unsafe_string(option.name)) for option in listed)
    return NamedTuple{names}(Tuple(get_value(handle, option) for option in listed))
end

"""
    MJEnv.options(id; engine = nothing)
    MJEnv.options(env)

Returns the default options of an id, or the options with which an environment was built, as a NamedTuple: flags as
`Bool`, integers as `Int`, numbers as `Float64`, ranges as tuples of `Float64`, texts as `String`.
`Env(env.id; engine = env.engine, MJEnv.options(env)...)` builds an equal environment.
"""
options(id::AbstractString; engine::Union{Nothing,AbstractString} = nothing) =
    with_options(values_of, Engine(engine), id)

"`MJEnv.schema(id; engine = nothing)`: returns the options that an id takes, as a vector of [`MJEnv.Option`](@ref)."
schema(id::AbstractString; engine::Union{Nothing,AbstractString} = nothing) =
    with_options(Engine(engine), id) do handle
        map(all_options(handle)) do option
            name, choices = Symbol(unsafe_string(option.name)), split(borrowed(option.choices))
            kind, doc, default = mjenv_kind(option.kind), borrowed(option.doc), get_value(handle, option)
            Option(name, kind, doc, option.low, option.high, option.count, choices, default)
        end
    end
