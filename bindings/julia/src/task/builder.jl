# The functions with which a task's build reads and declares.

"""
    MJEnv.Builder

The argument with which `MJEnv.build` prepares an environment. `b.sim` is the model's initial state, a
[`MJEnv.Sim`](@ref) that is valid until build returns. If a lookup fails, the build fails with the reason, even if it
returns a task. Indices count from 1.

[`object_index`](@ref)`(b, :body, "torso")`, [`MJEnv.joint`](@ref), [`MJEnv.sensor`](@ref), [`MJEnv.array`](@ref) and
[`MJEnv.terrain`](@ref) look up; [`MJEnv.need!`](@ref), [`MJEnv.keep!`](@ref), [`MJEnv.current!`](@ref),
[`MJEnv.own!`](@ref), [`MJEnv.random_state!`](@ref), [`MJEnv.action!`](@ref) and [`MJEnv.structure!`](@ref) declare what
the task needs; [`MJEnv.is_integer`](@ref) and [`MJEnv.norm`](@ref) say how options were set.
"""
mutable struct Builder
    raw::Ptr{mjenv_builder}
    api::Ptr{mjenv_task_api}
    sim::Sim
    carry_count::Int
    skipped_qpos::Union{Nothing,Int}
    has_structure::Bool
    own::Vector{Own}
end

Builder(raw::Ptr{mjenv_builder}) =
    Builder(raw, member(raw, Val(:api)), Sim(member(raw, Val(:sim)), 0), 0, nothing, false, Own[])

object_index(b::Builder, type::Union{AbstractString,Symbol}, name::Union{AbstractString,Symbol}) =
    Int(task_index(b.api, b.raw, text(type), text(name))) + 1

"""
    MJEnv.joint(b, name)

Returns `(index = ..., qpos = ..., qvel = ...)`: the index of a joint, and of its first elements in `sim.qpos` and
`sim.qvel`.
"""
function joint(b::Builder, name::Union{AbstractString,Symbol})
    index = object_index(b, :joint, name)
    return (index = index, qpos = element_of(b, :jnt_qposadr, index) + 1, qvel = element_of(b, :jnt_dofadr, index) + 1)
end

"`MJEnv.sensor(b, name)`: returns the range of a sensor's values in `sim.sensordata`."
function sensor(b::Builder, name::Union{AbstractString,Symbol})
    index = object_index(b, :sensor, name)
    first = element_of(b, :sensor_adr, index) + 1
    return first:(first + element_of(b, :sensor_dim, index) - 1)
end

# An element of an array; 0 if the model lacks it, and then the build fails.
function value_of(b::Builder, name::Symbol, index::Int)
    values = b.sim[array(b, name)]
    return index <= length(values) ? values[index] : zero(eltype(values))
end
element_of(b::Builder, name::Symbol, index::Int) = Int(value_of(b, name, index))

"""
    MJEnv.array(b, name)

Looks up an array of mjData or mjModel by its name in MuJoCo, for example `:geom_friction`. Returns a
[`MJEnv.NamedArray`](@ref), with which `sim[array]` reads it. Its type says the element type and the number of
dimensions: a field of a task is a `MJEnv.NamedArray{Float64,2}`.
"""
function array(b::Builder, name::Union{AbstractString,Symbol})
    field = Ref(mjenv_field())
    index = Int(task_array(b.api, b.raw, text(name), field)) + 1
    field[].name == C_NULL && throw(ArgumentError("there is no array $name"))  # the library says more
    T = julia_type(mjenv_dtype(field[].dtype), Float64)
    size = reverse(field[].shape[1:field[].ndim])
    return NamedArray{T,length(size)}(index, size)
end

"""
    MJEnv.need!(b, name)

Makes an array that is computed on demand available in all methods: `:contacts`, `:cfrc_ext`, `:geom_xpos` (and
`geom_xmat`), or one that [`MJEnv.array`](@ref) looks up: `:cfrc_int`, `:cacc`, `:cam_xpos`, `:cam_xmat`, `:light_xpos`
or `:light_xdir`.
"""
need!(b::Builder, name::Union{AbstractString,Symbol}) = task_need(b.api, b.raw, text(name))

"""
    MJEnv.keep!(b; low = -Inf, high = Inf, resets = false)
    MJEnv.keep!(b, count; low = -Inf, high = Inf, resets = false)

Declares one or `count` numbers that a row remembers from step to step, which are 0 at the start of an episode. Returns
the index or the range of indices of `sim.carried`, `start.carried` and `row.carried`.

`low` and `high` are closed bounds, which must contain 0: a method that writes a number out of the bounds fails, and an
image with one is refused. Bound numbers that the task uses as indices or sizes, because an image may come from a stranger.

With `resets = true`, resets keep the numbers, for instance the level of a terrain. They are 0 until the first reset.
"""
keep!(b::Builder; low::Real = -Inf, high::Real = Inf, resets::Bool = false) = first(keep!(b, 1; low, high, resets))

function keep!(b::Builder, count::Integer; low::Real = -Inf, high::Real = Inf, resets::Bool = false)
    count >= 0 || throw(ArgumentError("the count $count is negative"))
    before = b.carry_count
    b.carry_count += count
    task_carry(b.api, b.raw, b.carry_count)
    (low, high) == (-Inf, Inf) || task_carry_bounds(b.api, b.raw, before, count, low, high)
    resets && task_keep(b.api, b.raw, before, count)
    b.sim = Sim(member(b.raw, Val(:sim)), b.carry_count)
    return (before + 1):(b.carry_count)
end

"""
    MJEnv.current!(b)

Lets the methods see the new state. After the last mj_step of a step, the library computes the stages of mj_step1, so
positions, velocities, contacts and the sensors that depend on them belong to the new `qpos` and `qvel`. Forces and
accelerations belong to the state before.
"""
current!(b::Builder) = task_current(b.api, b.raw)

"""
    MJEnv.own!(b, name)

Gives each row its own array, and returns the key `own` with which methods write it. `reset!` writes an array of mjModel
as `start[own]` and `step!` as `row[own]`. `before_step!` and `before_substep!` write `:qfrc_applied` or `:xfrc_applied` as
`control[own]`, and `step!` as `row[own]`. If a method fails, the row keeps its old values. Numbers are rounded if MuJoCo's
array is `Float32` (`:hfield_data`, `:geom_rgba`).
"""
function own!(b::Builder, name::Union{AbstractString,Symbol})
    found = array(b, name)
    push!(b.own, Own(Int(task_own(b.api, b.raw, text(name))) + 1, prod(found.size)))
    return last(b.own)
end

"""
    MJEnv.random_state!(b)

Gives each row a stream of NumPy's `RandomState` besides its [`MJEnv.Rng`](@ref). `reset!` draws from it with
`MJEnv.state_rand(rng)`, `state_uniform(rng, low, high)`, `state_randn(rng)`, `state_randint(rng, low, high)` (an integer in
[low, high)), `state_choice(rng, count)` and `state_choice(rng, p)` (an index from 1), `state_permutation(rng, count)` (the
indices `1:count` in random order) and `state_shuffle!(rng, vector)`.
"""
random_state!(b::Builder) = task_random_state(b.api, b.raw)

"""
    MJEnv.action!(b, bounds)

Sets the action space: the bounds `(low, high)` of each number of an action, which `before_step!` turns into `ctrl`.
"""
function action!(b::Builder, bounds)
    low, high = Float64[first(pair) for pair in bounds], Float64[last(pair) for pair in bounds]
    task_action(b.api, b.raw, length(low), low, high)
end

"""
    MJEnv.is_integer(b, option)

Whether the caller set an option of real numbers to an integer. In Python, the product of such an option and a bool is
an int.
"""
is_integer(b::Builder, option::Union{AbstractString,Symbol}) = task_is_integer(b.api, b.raw, text(option)) != 0

"`MJEnv.norm(b)`: returns the [`MJEnv.Norm`](@ref) that the option `norm` chooses."
norm(b::Builder) = Norm(task_norm_is_fused(b.api, b.raw) != 0)

"""
    MJEnv.structure!(b; skipped_qpos = nothing)

Declares Gymnasium's `observation_structure`: how many elements of qpos the observation leaves out (`nothing`: not
listed), then the length of each part of the observation.
"""
function structure!(b::Builder; skipped_qpos::Union{Nothing,Integer} = nothing)
    b.skipped_qpos = skipped_qpos
    b.has_structure = true
    return b
end

function describe(b::Builder, role::mjenv_role, name::Symbol, doc::String, dtype::mjenv_dtype, shape::Tuple; group::Symbol = Symbol(""))
    length(shape) <= 4 || throw(ArgumentError("the field $name has $(length(shape)) dimensions; there are at most 4"))
    called, told, grouped = text(name), text(doc), text(group)
    GC.@preserve called told grouped begin
        field = mjenv_task_field(
            role = Int32(role),
            name = Cstring(pointer(called)),
            doc = Cstring(pointer(told)),
            dtype = Int32(dtype),
            ndim = length(shape),
            shape = ntuple(i -> i <= length(shape) ? Int64(shape[i]) : Int64(0), 4),
            group = Cstring(pointer(grouped)),
        )
        task_field(b.api, b.raw, Ref(field))
    end
    return
end

size_of_live(default) = default isa Tuple ? (length(default),) : ()

# The value of an option that the task has declared.
function option_value(b::Builder, name::Symbol, setting::Setting)
    called, default = text(name), setting.default
    setting.object === nothing || return Int(task_option_index(b.api, b.raw, called, setting.object)) + 1
    setting.live && return Live(Int(task_parameter(b.api, b.raw, called)), size_of_live(default))
    default isa Bool && return task_integer(b.api, b.raw, called) != 0
    default isa Integer && return Int(task_integer(b.api, b.raw, called))
    default isa Union{AbstractString,Symbol} && return unsafe_string(task_text(b.api, b.raw, called))
    values = Vector{Float64}(undef, length(default))
    task_reals(b.api, b.raw, called, values, length(values))
    return default isa Tuple ? Tuple(values) : values[1]
end
