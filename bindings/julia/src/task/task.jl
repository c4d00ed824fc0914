# Users' own robots and tasks.

"""
    MJEnv.Task

A robot and what it has to do. Derive a type from it, define these methods for it, and give it an id with
[`MJEnv.register`](@ref):

- `MJEnv.build(::Type{T}, b; options...)` returns a `T`. It reads the options and looks up names in the model of the
  [`MJEnv.Builder`](@ref) `b`. Without this method, `T(; options...)` is called.
- `MJEnv.reset!(task::T, start, rng)` draws the initial state of an episode: it changes the [`MJEnv.Start`](@ref).
- `MJEnv.observe(task::T, sim)` returns the parts of the observation, a NamedTuple. It must depend only on `sim`.
- `MJEnv.step!(task::T, sim, row)` returns `(reward = ..., terminated = ..., info = ...)`. `info` is a NamedTuple, and
  may be left out. It is called once in each step, after the simulation has advanced by `frame_skip` timesteps.
- `MJEnv.before_step!(task::T, sim, row, control)` (optional) turns the action into `control.ctrl`, once in each step, before
  its first timestep; without it `ctrl` is the action. `MJEnv.before_substep!(task::T, sim, row, control)` (optional) changes
  `ctrl` or forces before each timestep. Both take an [`MJEnv.Control`](@ref). In their `sim`, what MuJoCo
  computes from the state is not valid: it belongs to other rows or older states.
- `MJEnv.compute_reward(task::T, achieved, desired)` (optional) returns the reward of one pair of goals, for hindsight
  experience replay ([`MJEnv.compute_reward`](@ref)). The observation has the groups or parts `achieved_goal` and
  `desired_goal`.
- `MJEnv.reset_info(task::T, sim)` (optional) returns the info of a reset, a NamedTuple.
- `MJEnv.carry!(task::T, sim, carried)` (optional) writes into `carried` what the next step needs to know about the
  present state. It is called at the end of each reset and step, and after `set_state!` and `simulate!`.

`sim` is a [`MJEnv.Sim`](@ref), `rng` a [`MJEnv.Rng`](@ref) and `row` a [`MJEnv.Row`](@ref). The values of a NamedTuple
are numbers, arrays, tuples or generators; a generator such as `(clamp(v, -10, 10) for v in sim.qvel)` allocates no
memory. Each call must return the same names and lengths as the trial call when the environment is built. A number is a
`Float64` in Python; a `Bool` or an `Integer` is an int; [`MJEnv.Scalar`](@ref) and [`MJEnv.typed`](@ref) have other
types.

Where an option turns one of them off, it does what the library does without it: `before_step!` writes `sim.action` into
`control.ctrl`. A method with other arguments is an error when an environment is built.

One value of `T` serves all rows of an environment. So it must not change from step to step. Declare the numbers that a row
remembers by [`MJEnv.keep!`](@ref); snapshots and `copy_row!` contain them.

docs/tasks/julia.md says what an exception in a method does, and on which thread the methods run: that of the caller. A
method cannot step or change the environment that it runs for, and must not wait for another Julia task.
"""
abstract type Task end

function build end
function carry! end
function before_step! end
function before_substep! end
function compute_reward end

"""
    MJEnv.Setting(default, doc = ""; low = -Inf, high = Inf, choices = (), object = nothing, live = false)

An option of a task. Its type is that of `default`: a `Bool`, an integer, a real number, a tuple of numbers, or a
text. `low` and `high` are the closed bounds of each number, and `choices` the valid texts. With `object = :body` (or
another type, see [`object_index`](@ref)) it names an object of the model, or gives its index as in Gymnasium, from 0;
`build` gets the index from 1. With `live = true` a real number, or a tuple of them, is a live parameter: `build` gets a
[`MJEnv.Live`](@ref).
"""
struct Setting
    default::Any
    doc::String
    low::Float64
    high::Float64
    choices::Vector{String}
    object::Union{Nothing,String}
    live::Bool
end

Setting(default, doc = ""; low = -Inf, high = Inf, choices = (), object = nothing, live = false) =
    Setting(default, doc, low, high, collect(String, choices), object === nothing ? nothing : String(object), live)

"`MJEnv.Typed`: a number with the type that it has in Python: see [`MJEnv.typed`](@ref)."
struct Typed
    value::Float64
    dtype::mjenv_dtype
end

"""
    MJEnv.typed(value, dtype)

A number of the info, or a reward, that has another type in Python: `MJEnv.MJENV_DTYPE_NATIVE_FLOAT` is a float,
`MJENV_DTYPE_NATIVE_INT` an int, `MJENV_DTYPE_INT64` an np.int64, and so on.
"""
typed(value::Real, dtype::mjenv_dtype) = Typed(value, dtype)

# A registered task, which the libraries point to for the rest of the process.
mutable struct Registration{T<:Task}
    id::String
    settings::Vector{Pair{Symbol,Setting}}
    docs::Dict{Symbol,String}
    groups::Dict{Symbol,Symbol}  # of terms of the observation
    raw::Base.RefValue{mjenv_task}
    kept::Vector{Any}  # what raw points to
end

# For libraries that are loaded later.
const REGISTRATIONS = Registration[]
const PLUGINS = String[]

"""
    MJEnv.register(id, T; model, options...)

Gives the [`MJEnv.Task`](@ref) `T` an id such as `"Cartpole-v0"`, which `Env` then knows. The options are:

- `model`: a built-in model (`"hopper.xml"`), the path of a file (`joinpath(@__DIR__, "cartpole.xml")`), or the text of
  an MJCF model
- `frame_skip`: how many timesteps make a step; by default 1
- `time_limit`: the number of steps after which an episode is truncated; `nothing`: never
- `reward_threshold`: the return from which the task counts as solved; `nothing`: none
- `camera`: Gymnasium's default_camera_config, as `(distance = 3.0, elevation = -20)`; also `trackbodyid`, which counts
  from 0, and `lookat`
- `options`: the options of the constructor, as `(weight = 0.1, noise = MJEnv.Setting(0.1, "spread"; low = 0))`
- `docs`: one line of documentation for parts of the observation and the infos, as `(height = "of the tip, m",)`
- `groups`: the groups of terms of the observation, as `(policy = (:angle, :speed), critic = (:mass,))`. The terms of
  a group stand one after the other in what `observe` returns. With groups, the observation is a Gymnasium Dict
- `revision`: increase it when the task changes, so that snapshots of the old task are refused

The id stays for the rest of the process. A package registers its tasks in its `__init__`. An id that exists, a
malformed one and bad descriptions throw an [`MJEnvError`](@ref).
"""
function register(
    id::AbstractString, ::Type{T}; model::AbstractString, frame_skip::Integer = 1,
    time_limit::Union{Nothing,Integer} = nothing, reward_threshold::Union{Nothing,Real} = nothing,
    camera::Union{Nothing,NamedTuple} = nothing, options::NamedTuple = NamedTuple(), docs::NamedTuple = NamedTuple(),
    groups::NamedTuple = NamedTuple(), revision::Integer = 0,
) where {T<:Task}
    isconcretetype(T) || throw(ArgumentError("$T is not a concrete type"))
    if ccall(:jl_generating_output, Cint, ()) != 0
        error("a task cannot be registered while a package is precompiled: call MJEnv.register in __init__")
    end
    for (method, arguments, text) in (
        (reset!, Tuple{T,Start,Rng}, "reset!(task::$T, start, rng)"),
        (observe, Tuple{T,Sim}, "observe(task::$T, sim)"),
        (step!, Tuple{T,Sim,Row}, "step!(task::$T, sim, row)"),
    )
        hasmethod(method, arguments) || throw(ArgumentError("$id: the method MJEnv.$text is missing"))
    end
    settings = Pair{Symbol,Setting}[name => given isa Setting ? given : Setting(given) for (name, given) in pairs(options)]
    kept = Any[]
    described = Dict(name => String(doc) for (name, doc) in pairs(docs))
    grouped = Dict(term => group for (group, terms) in pairs(groups) for term in terms)
    registration = Registration{T}(id, settings, described, grouped, Ref(mjenv_task()), kept)
    keep(value) = (push!(kept, value); value)
    c_text(value) = Cstring(pointer(keep(text(value))))
    listed = keep([raw_option(name, setting, keep, c_text) for (name, setting) in settings])
    is_text = '<' in model
    given_camera = camera === nothing ? mjenv_task_camera[] : keep([raw_camera(; camera...)])
    registration.raw[] = mjenv_task(;
        revision = revision,
        id = c_text(id),
        model = is_text ? Cstring(C_NULL) : c_text(startswith(model, "./") ? abspath(model) : model),
        model_text = is_text ? c_text(model) : Cstring(C_NULL),
        frame_skip = frame_skip,
        has_reward_threshold = reward_threshold !== nothing,
        reward_threshold = something(reward_threshold, 0),
        time_limit = something(time_limit, 0),
        camera = isempty(given_camera) ? C_NULL : pointer(given_camera),
        options = pointer(listed),
        option_count = length(listed),
        user = pointer_from_objref(registration),
        caller_thread = 1,
        callbacks(T)...,
    )
    in_libraries(library -> register(library, registration), REGISTRATIONS, registration)
    return nothing
end

register(library::Library, registration::Registration) =
    check(library, mjenv_register_task(library, registration.raw))

# Calls f with each library that is loaded, the default one included. For libraries that are loaded later, `list` keeps
# what a library has accepted.
function in_libraries(f, list, what)
    lock(LOADING) do
        load!(library_of(Engine(nothing)))
        push!(list, what)  # first, because another thread may use it as soon as the library knows it
        accepted = false
        try
            for library in filter(is_loaded, LIBRARIES)
                f(library)
                accepted = true
            end
        catch
            accepted || pop!(list)
            rethrow()
        end
    end
end

raw_camera(; trackbodyid = MJENV_BODY_UNSET, distance = NaN, lookat = (NaN, NaN, NaN), elevation = NaN) =
    mjenv_task_camera(trackbodyid = trackbodyid, distance = distance, lookat = Tuple(lookat), elevation = elevation)

function raw_option(name, setting::Setting, keep, c_text)
    default = setting.default
    bounded = !(default isa Bool) && (setting.low, setting.high) != (-Inf, Inf)
    numbers = default isa Tuple{Real,Vararg{Real}} ? keep(collect(Float64, default)) : nothing
    is_text = default isa (setting.object === nothing ? Union{AbstractString,Symbol} : AbstractString)
    kind = is_text && setting.object === nothing ? MJENV_KIND_STRING :
           default isa Union{Integer,AbstractString} && setting.object !== nothing ? MJENV_KIND_STRING_OR_INT :
           default isa Bool ? MJENV_KIND_FLAG : default isa Integer ? MJENV_KIND_INTEGER :
           default isa Real || numbers !== nothing ? MJENV_KIND_REALS : nothing
    kind === nothing && throw(
        ArgumentError("option \"$name\": the default is a $(typeof(default)), not a Bool, a number, a tuple of numbers or a text"),
    )
    return mjenv_task_option(
        kind = Int32(kind),
        name = c_text(name),
        doc = c_text(setting.doc),
        value = default isa Real ? default : 0.0,
        low = bounded ? setting.low : 0.0,
        high = bounded ? setting.high : 0.0,
        values = numbers === nothing ? C_NULL : pointer(numbers),
        count = numbers === nothing ? 0 : length(numbers),
        text = is_text ? c_text(default) : Cstring(C_NULL),
        choices = kind == MJENV_KIND_STRING && !isempty(setting.choices) ? c_text(join(setting.choices, " ")) : Cstring(C_NULL),
        live = Int32(setting.live),
    )
end

"""
    MJEnv.load_tasks(path)
    MJEnv.load_tasks()

Loads a plug-in, a shared object with tasks written in C, C++ or Rust, whose ids `Env` then knows. Loading it again does
nothing. Without a path it loads those that the environment variable `MJENV_TASKS` lists, which also happens by itself,
and throws if one of them cannot be loaded. A file that is not a plug-in throws an [`MJEnvError`](@ref) of status
`MJENV_E_TASK`.
"""
function load_tasks(path::AbstractString)
    found = text('/' in path ? abspath(path) : path)
    in_libraries(library -> load_tasks(library, found), PLUGINS, found)
    return nothing
end

load_tasks(library::Library, path) = check(library, mjenv_load_tasks(library, path))

function load_tasks()
    default = library_of(Engine(nothing))
    check(default, mjenv_load_tasks(default, Cstring(C_NULL)))
end
