# The objects that the methods of a task read and change.

"`MJEnv.RowAction`: the action of a row: a vector of `Float64`. `narrow` is true if the caller passed `Float32`."
struct RowAction <: AbstractVector{Float64}
    values::ReadOnly{Float64,1}
    narrow::Bool
end

Base.size(action::RowAction) = size(action.values)
Base.IndexStyle(::Type{RowAction}) = IndexLinear()
Base.@propagate_inbounds Base.getindex(action::RowAction, index::Int) = action.values[index]

sum_square(action::RowAction) =
    action.narrow ? Scalar(sum_of(x -> abs2(Float32(x)), 0.0f0, action.values, 1, length(action)), true) :
    Scalar(sum_of(abs2, 0.0, action.values, 1, length(action)), false)

"""
    MJEnv.Contact

A contact: the indices `geom1` and `geom2` of the geoms; their `distance` (m, negative if they overlap); the point
`position` midway between them (m); `frame`, nine numbers, one axis after the other, of which the first is the normal
from `geom1` to `geom2`; and `force`, the force (N), then the torque (N m), in this frame.
"""
struct Contact
    geom1::Int
    geom2::Int
    distance::Float64
    position::NTuple{3,Float64}
    frame::NTuple{9,Float64}
    force::NTuple{6,Float64}
end

struct Contacts <: AbstractVector{Contact}
    found::ReadOnly{mjenv_contact,1}
end

Base.size(contacts::Contacts) = size(contacts.found)
Base.IndexStyle(::Type{Contacts}) = IndexLinear()
Base.@propagate_inbounds function Base.getindex(contacts::Contacts, index::Int)
    c = contacts.found[index]
    return Contact(c.geom1 + 1, c.geom2 + 1, c.distance, c.position, c.frame, c.force)
end

"""
    MJEnv.NamedArray{T,N}

An array of mjData or mjModel that [`MJEnv.array`](@ref) has looked up. `sim[array]` reads it, and `start[array]` if it
is one of mjModel.
"""
struct NamedArray{T,N}
    index::Int
    size::NTuple{N,Int}
end

"""
    MJEnv.Live

A live parameter, which `build` gets for an option with `live = true` ([`MJEnv.Setting`](@ref)). Each row has its own number
or numbers, at first the option's, which `write!(env, "parameters.NAME", values)` changes while the task runs. Methods read
them with `sim[live]`, and `reset!` with `start[live]`.
"""
struct Live{N}
    first::Int
    size::NTuple{N,Int}
end

@inline numbers(from::Ptr{Float64}, live::Live{0}) = unsafe_load(from, live.first + 1)
@inline numbers(from::Ptr{Float64}, live::Live{1}) = ReadOnly{Float64,1}(from + 8 * live.first, live.size)

"""
    MJEnv.Sim

One row's simulation, which a task reads. Its properties have MuJoCo's names:

- sizes: `nq`, `nv`, `na`, `nu`, `nbody`, `njnt`, `ngeom`, `nsite`, `ntendon`, `nsensordata`
- times, s: `time` since the reset, `timestep` of one `mj_step`, `dt` of one step of the environment
- the state: `qpos`, `qvel`, `act`, `ctrl`
- what MuJoCo computes from it: `qacc`, `xpos`, `xquat`, `xmat`, `xipos`, `ximat`, `xanchor`, `xaxis`, `site_xpos`,
  `site_xmat`, `subtree_com`, `cinert`, `cvel`, `sensordata`, `actuator_length`, `actuator_velocity`, `actuator_force`,
  `qfrc_actuator`, `qfrc_passive`, `qfrc_bias`, `qfrc_constraint`, `ten_length`, `ten_velocity`
- on demand, see [`MJEnv.need!`](@ref): `contacts` (a vector of [`MJEnv.Contact`](@ref)), `cfrc_ext`, `geom_xpos`,
  `geom_xmat`
- the model: `qpos0`, `body_mass`
- `action` (an [`MJEnv.RowAction`](@ref)), which is NaN except in `before_step!`, `before_substep!` and `step!`
- `carried`: the numbers that the row remembers, see [`MJEnv.keep!`](@ref)

Every other array is `sim[array]`, see [`MJEnv.array`](@ref). Arrays are [`MJEnv.RowArray`](@ref)s: `xpos` has the size
`(3, nbody)`. They are valid until the method returns.

After a step, what MuJoCo computes from the state is one timestep older than the state, as in Gymnasium. After a reset,
everything belongs to the same state.
"""
struct Sim
    raw::Ptr{mjenv_sim}
    carry_count::Int
end

# Their dimensions; a name stands for the size of the model with that name.
const SIM_ARRAYS = (
    qpos = (:nq,), qvel = (:nv,), act = (:na,), ctrl = (:nu,), qacc = (:nv,),
    xpos = (3, :nbody), xquat = (4, :nbody), xmat = (9, :nbody), xipos = (3, :nbody), ximat = (9, :nbody),
    xanchor = (3, :njnt), xaxis = (3, :njnt), geom_xpos = (3, :ngeom), geom_xmat = (9, :ngeom),
    site_xpos = (3, :nsite), site_xmat = (9, :nsite), subtree_com = (3, :nbody), cinert = (10, :nbody),
    cvel = (6, :nbody), cfrc_ext = (6, :nbody), sensordata = (:nsensordata,), actuator_length = (:nu,),
    actuator_velocity = (:nu,), actuator_force = (:nu,), qfrc_actuator = (:nv,), qfrc_passive = (:nv,),
    qfrc_bias = (:nv,), qfrc_constraint = (:nv,), ten_length = (:ntendon,), ten_velocity = (:ntendon,),
    qpos0 = (:nq,), body_mass = (:nbody,),
)
const SIM_SIZES = (:nq, :nv, :na, :nu, :nbody, :njnt, :ngeom, :nsite, :ntendon, :nsensordata)

Base.propertynames(::Sim, ::Bool = false) =
    (SIM_SIZES..., :time, :timestep, :dt, :action, :carried, :contacts, keys(SIM_ARRAYS)...)

for name in SIM_SIZES
    @eval @inline property(sim::Sim, name::Val{$(QuoteNode(name))}) = Int(member(raw(sim), name))
end
for (name, dimensions) in pairs(SIM_ARRAYS)
    extents = [d isa Symbol ? :(Int(member(raw(sim), Val($(QuoteNode(d)))))) : d for d in dimensions]
    on_demand = name in (:geom_xpos, :geom_xmat, :cfrc_ext)
    @eval @inline function property(sim::Sim, name::Val{$(QuoteNode(name))})
        pointer = member(raw(sim), name)
        $(on_demand ? :(pointer == C_NULL && refuse_unneeded(name)) : nothing)
        return ReadOnly{Float64,$(length(dimensions))}(pointer, ($(extents...),))
    end
end
@inline property(sim::Sim, name::Union{Val{:timestep},Val{:dt}}) = member(raw(sim), name)
@inline property(sim::Sim, name::Val{:time}) = unsafe_load(member(raw(sim), name))
@inline property(sim::Sim, name::Val{:action}) = RowAction(
    ReadOnly{Float64,1}(member(raw(sim), name), (Int(member(raw(sim), Val(:action_count))),)),
    member(raw(sim), Val(:action_dtype)) == Int32(MJENV_DTYPE_FLOAT32),
)
@inline property(sim::Sim, name::Val{:carried}) =
    ReadOnly{Float64,1}(member(raw(sim), name), (getfield(sim, :carry_count),))
@inline function property(sim::Sim, name::Val{:contacts})
    pointer = member(raw(sim), name)
    pointer == C_NULL && refuse_unneeded(name)
    return Contacts(ReadOnly{mjenv_contact,1}(pointer, (Int(member(raw(sim), Val(:contact_count))),)))
end
@noinline refuse_unneeded(::Val{name}) where {name} =
    throw(ArgumentError("$name is computed on demand: call MJEnv.need!(b, :$name) in build"))

@inline element(arrays::Ptr{Ptr{Cvoid}}, array::NamedArray{T,N}) where {T,N} =
    ReadOnly{T,N}(Ptr{T}(unsafe_load(arrays, array.index)), array.size)
@inline Base.getindex(sim::Sim, array::NamedArray) = element(member(raw(sim), Val(:arrays)), array)

@inline Base.getindex(sim::Sim, live::Live) = numbers(member(raw(sim), Val(:parameters)), live)

Base.show(io::IO, sim::Sim) = print(io, "MJEnv.Sim(nq = ", sim.nq, ", nv = ", sim.nv, ", nu = ", sim.nu, ")")

# An array of the row's own ([`MJEnv.own!`](@ref)), and how many elements it has.
struct Own
    index::Int
    count::Int
end

@inline function own_array(arrays::Ptr{Ptr{Float64}}, own::Own)
    pointer = arrays == C_NULL ? Ptr{Float64}(C_NULL) : unsafe_load(arrays, own.index)
    pointer == C_NULL && refuse_own()
    return Writable{Float64,1}(pointer, (own.count,))
end
@noinline refuse_own() = throw(ArgumentError("this own array cannot be written here: see MJEnv.own!"))

"""
    MJEnv.Start

The initial state of an episode, which `reset!` changes: the vectors `qpos`, which equals the model's `qpos0` before the
call, `qvel` and `act`, which are 0, and `carried`, which is 0 except for numbers that resets keep. `qpos0` is
read-only. `start[own]` is an [`MJEnv.own!`](@ref).

If the task called [`MJEnv.current!`](@ref), `start.sim` is the live simulation, of which `qpos`, `qvel` and `act` are the
state, and these simulate:

- `MJEnv.forward!(start)` calls mj_forward with actuation disabled, on the state that the reset has written.
- `MJEnv.advance!(start, count)` simulates timesteps. With the integrator Euler, the first timestep uses the arrays that were
  computed last, even if `qpos` was written since.
- `MJEnv.restart!(start)` begins again: calls mj_resetData, after which own arrays keep their values, and then `forward!`.
- `MJEnv.contact_count(start)` returns the number of contacts that the last of these calls has found.
- `MJEnv.set_time!(start, time)` sets the simulation's time.

A loop that waits for something must be bounded, and throw when it gives up: the row then stays as it was.
"""
struct Start
    raw::Ptr{mjenv_start}
end

function simulated(failed)
    failed == 0 || error("the simulation failed")  # the library knows why
    return nothing
end
forward!(start::Start) = simulated(task_forward(member(raw(start), Val(:api)), raw(start)))
advance!(start::Start, count::Integer) = simulated(task_advance(member(raw(start), Val(:api)), raw(start), count))
restart!(start::Start) = simulated(task_restart(member(raw(start), Val(:api)), raw(start)))
contact_count(start::Start) = Int(task_contact_count(member(raw(start), Val(:api)), raw(start)))
function set_time!(start::Start, time::Real)
    pointer = member(raw(start), Val(:time))
    pointer == C_NULL && throw(ArgumentError("call MJEnv.current!(b) in build to set the time in reset"))
    unsafe_store!(pointer, time)
    return start
end

Base.propertynames(::Start, ::Bool = false) = (:qpos0, :qpos, :qvel, :act, :carried, :sim)
Base.show(io::IO, ::Start) = print(io, "MJEnv.Start")

for (name, size) in ((:qpos, :nq), (:qvel, :nv), (:act, :na), (:carried, :carry_count))
    @eval @inline property(start::Start, name::Val{$(QuoteNode(name))}) =
        Writable{Float64,1}(member(raw(start), name), (Int(member(raw(start), Val($(QuoteNode(size))))),))
end
@inline property(start::Start, name::Val{:qpos0}) =
    ReadOnly{Float64,1}(member(raw(start), name), (Int(member(raw(start), Val(:nq))),))
@inline function property(start::Start, name::Val{:sim})
    pointer = member(raw(start), name)
    pointer == C_NULL && throw(ArgumentError("call MJEnv.current!(b) in build to see the simulation in reset"))
    return Sim(pointer, Int(member(raw(start), Val(:carry_count))))
end
@inline Base.getindex(start::Start, array::NamedArray) = element(member(raw(start), Val(:arrays)), array)
@inline Base.getindex(start::Start, own::Own) = own_array(member(raw(start), Val(:own)), own)
@inline Base.getindex(start::Start, live::Live) = numbers(member(raw(start), Val(:parameters)), live)

"""
    MJEnv.Rng

A row's random stream: NumPy's `default_rng`. Each function returns what the method of `numpy.random.Generator` returns,
and leaves the stream in the same state. Arguments that NumPy refuses make the task's method fail.

- `rand(rng)`: `random()`, in [0, 1)
- `rand(rng, low:high)`: `integers(low, high + 1)`
- `randn(rng)`: `standard_normal()`
- [`MJEnv.uniform`](@ref)`(rng, low, high)`
- [`MJEnv.choice`](@ref), [`MJEnv.sample`](@ref), [`MJEnv.permutation`](@ref)
"""
struct Rng
    raw::Ptr{mjenv_random}
end

@inline api(rng::Rng) = member(rng.raw, Val(:api))

Base.rand(rng::Rng) = task_random(api(rng), rng.raw)
Base.randn(rng::Rng) = task_normal(api(rng), rng.raw)
function Base.rand(rng::Rng, range::AbstractUnitRange{<:Integer})
    isempty(range) && throw(ArgumentError("the range $range is empty"))
    return task_integers(api(rng), rng.raw, first(range), Base.checked_add(Int64(last(range)), Int64(1)))
end

"`MJEnv.uniform(rng, low, high)`: draws a number in [low, high)."
uniform(rng::Rng, low::Real, high::Real) = task_uniform(api(rng), rng.raw, low, high)

"""
    MJEnv.choice(rng, count)
    MJEnv.choice(rng, p)

Draws an index in `1:count`, or in `1:length(p)` with the probabilities `p`, whose sum is 1. It is NumPy's `choice`,
plus 1.
"""
function choice end

"""
    MJEnv.sample(rng, count, size)

Draws `size` different indices in `1:count`: NumPy's `choice(count, size, replace=False)`, plus 1.
"""
function sample(rng::Rng, count::Integer, size::Integer)
    chosen = Vector{Int64}(undef, 0 <= size <= count ? size : 0)  # the library refuses other sizes
    task_sample(api(rng), rng.raw, count, size, chosen)
    return chosen .+= 1
end

"`MJEnv.permutation(rng, count)`: returns the indices `1:count` in random order: NumPy's `permutation(count)`, plus 1."
function permutation end

# NumPy's Generator and RandomState draw these alike.
for (choice, permutation, prefix) in ((:choice, :permutation, :task_), (:state_choice, :state_permutation, :task_state_))
    @eval $choice(rng::Rng, count::Integer) = Int($(Symbol(prefix, :choice))(api(rng), rng.raw, count, C_NULL)) + 1
    @eval $choice(rng::Rng, p::AbstractVector{<:Real}) =
        Int($(Symbol(prefix, :choice))(api(rng), rng.raw, length(p), convert(Vector{Float64}, p))) + 1
    @eval function $permutation(rng::Rng, count::Integer)
        count >= 0 || throw(ArgumentError("the count $count is negative"))
        order = Vector{Int64}(undef, count)
        $(Symbol(prefix, :permutation))(api(rng), rng.raw, count, order)
        return order .+= 1
    end
end

state_rand(rng::Rng) = task_state_rand(api(rng), rng.raw)
state_uniform(rng::Rng, low::Real, high::Real) = task_state_uniform(api(rng), rng.raw, low, high)
state_randn(rng::Rng) = task_state_randn(api(rng), rng.raw)
state_randint(rng::Rng, low::Integer, high::Integer) = Int(task_state_randint(api(rng), rng.raw, low, high))
function state_shuffle!(rng::Rng, values::AbstractVector)
    values .= values[state_permutation(rng, length(values))]
    return values
end

"""
    MJEnv.Row

The parts of its row that `step!` may change:

- `rng`: the row's random stream
- `carried`: the numbers that the row remembers
- `row[own]`: an [`MJEnv.own!`](@ref), which the next step uses
- `qvel`: the velocities, for a kick. `carry!`, `observe` and the next step see the new velocities; arrays that MuJoCo has
  computed belong to the old ones. In `before_step!` and `before_substep!` it is empty.
"""
struct Row
    rng::Rng
    carried::Writable{Float64,1}
    own::Ptr{Ptr{Float64}}
    qvel::Writable{Float64,1}
end

@inline Base.getindex(row::Row, own::Own) = own_array(row.own, own)

"""
    MJEnv.Control

The controls and forces of a step, which `before_step!` and `before_substep!` write:

- `ctrl` has a number for each actuator. In `before_step!` it is that of the last step, or 0 after a reset. In
  `before_substep!` it is that of `before_step!` or the call before; without `before_step!` it is at first the action.
- `substep`: the number of the next mj_step of the step, from 1 on.
- `control[own]`: the row's `qfrc_applied` or `xfrc_applied` ([`MJEnv.own!`](@ref)), which act until they are written again.
"""
struct Control
    raw::Ptr{mjenv_control}
    nu::Int
end

# Their properties are members of C's structs.
@inline Base.getproperty(object::Union{Sim,Start,Control}, name::Symbol) = property(object, Val(name))
@inline raw(object::Union{Sim,Start,Control}) = getfield(object, :raw)
property(object::Union{Sim,Start,Control}, ::Val{name}) where {name} = throw(
    ArgumentError(
        "$(lowercase(string(nameof(typeof(object))))) has no $name; it has $(join(propertynames(object), ", "))" *
        (object isa Sim ? "; MJEnv.array looks up others" : ""),
    ),
)
Base.propertynames(::Control, ::Bool = false) = (:ctrl, :substep)
@inline property(control::Control, name::Val{:ctrl}) =
    Writable{Float64,1}(member(raw(control), name), (getfield(control, :nu),))
@inline property(control::Control, name::Val{:substep}) = Int(member(raw(control), name)) + 1
@inline Base.getindex(control::Control, own::Own) =
    own_array(member(raw(control), Val(:own)), own)
