# The functions of a task that the library calls. No exception leaves them.

# The fields that a method writes: their names, and how many numbers each has.
struct Layout
    names::Any  # a tuple of Symbols
    counts::Vector{Int}
end

# Keeps an environment's task alive. Finalizers, which may run anywhere, empty it without a lock.
mutable struct Slot
    held::Any
end

const SLOTS = Slot[]
const SLOTS_LOCK = Threads.SpinLock()

# A task in one environment, which the library knows as `self`.
mutable struct Built{T<:Task}
    task::T
    carry_count::Int
    observation::Layout
    info::Layout
    reset_info::Layout
    slot::Slot
end

function hold!(built::Built)
    lock(SLOTS_LOCK) do
        found = findfirst(slot -> slot.held === nothing, SLOTS)
        found === nothing && push!(SLOTS, Slot(built))
        built.slot = SLOTS[something(found, length(SLOTS))]
        built.slot.held = built
    end
end

# ---- What the methods return ----

const Value = Union{Real,Scalar,Typed}

@inline number(value::Real) = Float64(value)
@inline number(value::Union{Scalar,Typed}) = value.value

type_of(::Value) = MJENV_DTYPE_FLOAT64
type_of(::Integer) = MJENV_DTYPE_NATIVE_INT
type_of(::Float32) = MJENV_DTYPE_FLOAT32
type_of(::Scalar) = MJENV_DTYPE_ACTION
type_of(value::Typed) = value.dtype
type_of(::AbstractArray{<:Integer}) = MJENV_DTYPE_INT64
type_of(values) = MJENV_DTYPE_FLOAT64

shape_of(::Value) = ()
shape_of(values::AbstractArray) = reverse(size(values))
shape_of(values) = (count(_ -> true, values),)

# Writes a field and returns where the next one is written.
@inline function write_field!(to::Ptr{Float64}, layout::Layout, field::Int, value::Value)
    layout.counts[field] == 1 || refuse_length(layout, field, 1)
    unsafe_store!(to, number(value))
    return to + sizeof(Float64)
end

@inline function write_field!(to::Ptr{Float64}, layout::Layout, field::Int, values)
    needed, written = layout.counts[field], 0
    for value in values
        written += 1
        written <= needed && unsafe_store!(to, number(value), written)
    end
    written == needed || refuse_length(layout, field, written)
    return to + needed * sizeof(Float64)
end

@generated function write_fields!(to::Ptr{Float64}, layout::Layout, values::NamedTuple{names}) where {names}
    writes = [:(to = write_field!(to, layout, $i, values[$i])) for i in 1:length(names)]
    return quote
        layout.names === $names || refuse_names(layout, $names)
        $(writes...)
        return
    end
end
write_fields!(::Ptr{Float64}, ::Layout, values) = refuse_type(values)

@noinline refuse_length(layout, field, found) = throw(
    ArgumentError("$(layout.names[field]) has $found number(s), but it had $(layout.counts[field]) in the first call"),
)
@noinline refuse_names(layout, names) =
    throw(ArgumentError("it returned the names $names, but in the first call it returned $(layout.names)"))
@noinline refuse_type(values) = throw(ArgumentError("it returned a $(typeof(values)), not a NamedTuple"))

# The reward, whether the episode has terminated, and the info.
@inline function parts_of(outcome::NamedTuple)
    (haskey(outcome, :reward) && haskey(outcome, :terminated)) || refuse_outcome(outcome)
    outcome.reward isa Value || refuse_part("reward", outcome.reward, "a number")
    outcome.terminated isa Bool || refuse_part("terminated", outcome.terminated, "a Bool")
    return outcome.reward, outcome.terminated, haskey(outcome, :info) ? outcome.info : NamedTuple()
end
parts_of(outcome) = refuse_outcome(outcome)

@noinline refuse_part(name, value, wanted) = throw(ArgumentError("$name is a $(typeof(value)), not $wanted"))
@noinline refuse_outcome(outcome) =
    throw(ArgumentError("it returned a $(typeof(outcome)), not (reward = ..., terminated = ..., info = ...)"))

# ---- Building an environment ----

build(::Type{T}, b; options...) where {T<:Task} = T(; options...)

function describe_all(b::Builder, role::mjenv_role, values::NamedTuple, docs, groups = Dict{Symbol,Symbol}())
    for term in keys(groups)
        haskey(values, term) || throw(ArgumentError("groups has $term, which observe does not return"))
    end
    for (name, value) in pairs(values)
        type = role == MJENV_ROLE_OBSERVATION ? MJENV_DTYPE_FLOAT64 : type_of(value)
        describe(b, role, name, get(docs, name, ""), type, shape_of(value); group = get(groups, name, Symbol("")))
    end
    return Layout(keys(values), Int[prod(shape_of(value)) for value in values])
end
describe_all(::Builder, ::mjenv_role, values, _...) = refuse_type(values)

# Calls a method for the first time.
function first_call(f, name)
    try
        return f()
    catch reason
        reason isa MJEnvError && rethrow()
        error("first call of $name: $(text_of(reason))")
    end
end

# Finds which of the methods that a task can lack are there, removes the callbacks of the others from the environment's copy
# of the task, and returns the names of the callbacks that stay.
function choose_callbacks!(raw::Ptr{mjenv_task}, ::Type{T}) where {T}
    called = Symbol[]
    for (name, method, arguments) in (
        (Val(:reset_info), reset_info, (Sim,)),
        (Val(:carry), carry!, (Sim, Writable{Float64,1})),
        (Val(:before_step), before_step!, (Sim, Row, Control)),
        (Val(:before_substep), before_substep!, (Sim, Row, Control)),
        (Val(:compute_reward), compute_reward, (Goal, Goal)),
    )
        if hasmethod(method, Tuple{T,arguments...})
            push!(called, typeof(name).parameters[1])
        elseif isempty(methods(method, Tuple{T,Vararg{Any}}))
            member!(raw, name, C_NULL)
        else
            throw(ArgumentError("MJEnv.$method takes the arguments $((T, arguments...)), but the task's has others"))
        end
    end
    return called
end

function build_environment(registration::Registration{T}, b::Builder) where {T}
    settings = registration.settings
    names = Tuple(name for (name, _) in settings)
    values = NamedTuple{names}(Tuple(option_value(b, name, setting) for (name, setting) in settings))
    task = build(T, b; values...)
    task isa T || throw(ArgumentError("build returned a $(typeof(task)), not a $T"))

    # The first calls, on the model's initial state, find out the fields.
    sim, docs, called = b.sim, registration.docs, choose_callbacks!(member(b.raw, Val(:task)), T)
    observed = first_call(() -> observe(task, sim), "observe")
    observation = describe_all(b, MJENV_ROLE_OBSERVATION, observed, docs, registration.groups)
    reset_told = NamedTuple()
    if :reset_info in called
        reset_told = first_call(() -> reset_info(task, sim), "reset_info")
    end
    reset_layout = describe_all(b, MJENV_ROLE_RESET_INFO, reset_told, docs)
    numbers = zeros(b.carry_count)
    values = [zeros(own.count) for own in b.own]
    arrays = [pointer(array) for array in values]
    velocities = collect(Float64, sim.qvel)
    GC.@preserve numbers values arrays velocities begin
        carried = numbers_at(pointer(numbers), length(numbers))
        :carry in called && first_call(() -> carry!(task, sim, carried), "carry!")
        qvel = numbers_at(pointer(velocities), length(velocities))
        row = Row(Rng(member(b.raw, Val(:random))), carried, pointer(arrays), qvel)
        reward, _, info = first_call(() -> parts_of(step!(task, sim, row)), "step!")
    end
    layout = describe_all(b, MJENV_ROLE_INFO, info, docs)
    type_of(reward) == MJENV_DTYPE_FLOAT64 || describe(b, MJENV_ROLE_REWARD, :reward, "", type_of(reward), ())
    if b.has_structure
        count(name, length) = describe(b, MJENV_ROLE_STRUCTURE, name, "", MJENV_DTYPE_FLOAT64, (length,))
        b.skipped_qpos === nothing || count(:skipped_qpos, b.skipped_qpos)
        foreach(count, observation.names, observation.counts)
    end
    return Built{T}(task, b.carry_count, observation, layout, reset_layout, Slot(nothing))
end

# ---- The callbacks ----

function text_of(reason)
    try
        return sprint(showerror, reason)
    catch
        return "it threw a $(typeof(reason)), which cannot be shown"
    end
end

# Tells the library why a callback fails. Returns the callback's result.
@noinline fail_with(api::Ptr{mjenv_task_api}, reason) =
    task_fail_with(api, replace(text_of(reason), '\0' => "\\0"))

# Calls the body, and returns what a callback returns.
@inline function guarded(body::F, api::Ptr{mjenv_task_api}) where {F}
    try
        body()
    catch reason
        return fail_with(api, reason)
    end
    return Int32(0)
end
@inline guarded(body::F, raw::Ptr) where {F} = guarded(body, member(raw, Val(:api)))

@inline object(pointer::Ptr{T}) where {T} = unsafe_pointer_to_objref(Ptr{Cvoid}(pointer))::T
@inline numbers_at(pointer::Ptr{Float64}, count) = Writable{Float64,1}(pointer, (Int(count),))

on_build(raw::Ptr{mjenv_builder}, user::Ptr{Registration{T}}, self::Ptr{Ptr{Cvoid}}) where {T} = guarded(raw) do
    built = hold!(build_environment(object(user), Builder(raw)))
    unsafe_store!(self, pointer_from_objref(built))
end

# Runs in finalizers, too, so it takes no lock.
function on_destroy(self::Ptr{Built{T}})::Cvoid where {T}
    object(self).slot.held = nothing
    return
end

on_reset(self, start) = guarded(start) do
    reset!(object(self).task, Start(start), Rng(member(start, Val(:random))))
end

on_reset_info(self, sim, to) = guarded(sim) do
    built = object(self)
    write_fields!(to, built.reset_info, reset_info(built.task, Sim(sim, built.carry_count)))
end

on_carry(self, sim, to) = guarded(sim) do
    built = object(self)
    carry!(built.task, Sim(sim, built.carry_count), numbers_at(to, built.carry_count))
end

on_observe(self, sim, to) = guarded(sim) do
    built = object(self)
    write_fields!(to, built.observation, observe(built.task, Sim(sim, built.carry_count)))
end

on_step(self, sim, outcome) = guarded(sim) do
    built = object(self)
    carried = numbers_at(member(outcome, Val(:carried)), built.carry_count)
    qvel = numbers_at(member(outcome, Val(:qvel)), member(sim, Val(:nv)))
    row = Row(Rng(member(outcome, Val(:random))), carried, member(outcome, Val(:own)), qvel)
    reward, terminated, info = parts_of(step!(built.task, Sim(sim, built.carry_count), row))
    write_fields!(member(outcome, Val(:info)), built.info, info)
    member!(outcome, Val(:reward), number(reward))
    member!(outcome, Val(:terminated), Int32(terminated))
end

on_control(map!, self, sim, to) = guarded(sim) do
    built = object(self)
    carried = numbers_at(member(to, Val(:carried)), built.carry_count)
    row = Row(Rng(member(to, Val(:random))), carried, Ptr{Ptr{Float64}}(C_NULL), numbers_at(Ptr{Float64}(C_NULL), 0))
    map!(built.task, Sim(sim, built.carry_count), row, Control(to, Int(member(sim, Val(:nu)))))
end
on_before_step(self, sim, to) = on_control(before_step!, self, sim, to)
on_before_substep(self, sim, to) = on_control(before_substep!, self, sim, to)

const Goal = ReadOnly{Float64,1}

on_compute_reward(self, api, achieved, desired, size, to) = guarded(api) do
    reward = compute_reward(object(self).task, Goal(achieved, (Int(size),)), Goal(desired, (Int(size),)))
    unsafe_store!(to, number(reward))
end

# What the callbacks take after `self`.
const CALLBACKS = (
    reset = (Ptr{mjenv_start},),
    reset_info = (Ptr{mjenv_sim}, Ptr{Float64}),
    carry = (Ptr{mjenv_sim}, Ptr{Float64}),
    observe = (Ptr{mjenv_sim}, Ptr{Float64}),
    step = (Ptr{mjenv_sim}, Ptr{mjenv_outcome}),
    before_step = (Ptr{mjenv_sim}, Ptr{mjenv_control}),
    before_substep = (Ptr{mjenv_sim}, Ptr{mjenv_control}),
    compute_reward = (Ptr{mjenv_task_api}, Ptr{Float64}, Ptr{Float64}, Int64, Ptr{Float64}),
)

# The addresses of the callbacks, compiled for one type of task.
@eval callbacks(::Type{T}) where {T<:Task} = (
    build = @cfunction(on_build, Int32, (Ptr{mjenv_builder}, Ptr{Registration{T}}, Ptr{Ptr{Cvoid}})),
    destroy = @cfunction(on_destroy, Cvoid, (Ptr{Built{T}},)),
    $((:($name = @cfunction($(Symbol(:on_, name)), Int32, (Ptr{Built{T}}, $(types...)))) for (name, types) in pairs(CALLBACKS))...),
)
