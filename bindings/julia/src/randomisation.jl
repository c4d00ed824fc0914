# Draws of resets for the model; noise, delays and pushes.

"""
    MJEnv.Draw(array, effect, numbers...; distribution = :uniform, elements = :, shared = false, constants = false,
               factor = 1)

A draw of resets for an array of the mjModel, see [`randomize!`](@ref). The new value is the draw if `effect` is `:value`,
the model's own value times the draw if it is `:scale`, and their sum if it is `:offset`. `numbers` are

- `low, high` of the distributions `:uniform` and `:log_uniform`
- `mean, std` of `:normal`
- `mean, std, low, high` of `:truncated_normal`
- the values of `:choice`

`elements` are the numbers, from 1, of the elements that are drawn, in the order of the draws. With `shared` there is
one draw for all elements. With `constants`, mj_setConst is called after the draws. Each draw is multiplied by `factor`.
"""
struct Draw
    array::String
    effect::Int32
    distribution::Int32
    parameters::Vector{Float64}
    elements::Union{Nothing,Vector{Int64}}
    shared::Bool
    constants::Bool
    repeats::Bool
    factor::Float64
end

"""
    MJEnv.Same(array, effect; factor = 1, elements = :, constants = false)

An item of [`randomize!`](@ref) that uses the draws of the item before for another array: element i takes the draw of
element i, or the shared draw, times `factor`. For example, an actuator's kp is drawn for `:actuator_gainprm`, and
`:actuator_biasprm` takes it with the factor -1.
"""
function Same(
    array::Union{Symbol,AbstractString},
    effect::Symbol;
    factor::Real = 1,
    elements::Union{Colon,Integer,AbstractVector{<:Integer}} = (:),
    constants::Bool = false,
)
    how, from = number_of("effect", effect, EFFECTS), Int32(MJENV_DISTRIBUTION_UNIFORM)
    return Draw(text(array), how, from, Float64[], chosen(elements), false, constants, true, factor)
end

chosen(::Colon) = nothing
chosen(elements) = Int64[element - 1 for element in elements]

const EFFECTS = (value = MJENV_EFFECT_VALUE, scale = MJENV_EFFECT_SCALE, offset = MJENV_EFFECT_OFFSET)
const DISTRIBUTIONS = (
    uniform = MJENV_DISTRIBUTION_UNIFORM,
    log_uniform = MJENV_DISTRIBUTION_LOG_UNIFORM,
    normal = MJENV_DISTRIBUTION_NORMAL,
    truncated_normal = MJENV_DISTRIBUTION_TRUNCATED_NORMAL,
    choice = MJENV_DISTRIBUTION_CHOICE,
)

# The number in C of a name.
function number_of(what, name, numbers)
    haskey(numbers, name) && return Int32(numbers[name])
    throw(ArgumentError("the $what is one of $(join(repr.(keys(numbers)), ", ")), not $(repr(name))"))
end

function Draw(
    array::Union{Symbol,AbstractString},
    effect::Symbol,
    numbers::Real...;
    distribution::Symbol = :uniform,
    elements::Union{Colon,Integer,AbstractVector{<:Integer}} = (:),
    shared::Bool = false,
    constants::Bool = false,
    factor::Real = 1,
)
    from, how = number_of("distribution", distribution, DISTRIBUTIONS), number_of("effect", effect, EFFECTS)
    return Draw(text(array), how, from, Float64[numbers...], chosen(elements), shared, constants, false, factor)
end

"""
    randomize!(env, draws)

Replaces the draws of resets by a vector of [`MJEnv.Draw`](@ref), from each row's next reset on. A reset makes them in
this order from the row's random stream, after the task's own draws. With an empty vector, nothing is drawn. Later,
`write!(env, "draws[0]", [low, high]; rows)` changes the parameters of the first item for some rows, and `read` reads
them; these numbers count from 0. Returns `env`.

```julia
friction = MJEnv.Draw(:geom_friction, :scale, 0.5, 1.5)
randomize!(env, [friction, MJEnv.Draw(:body_mass, :offset, -0.5, 0.5; elements = 2)])
```
"""
function randomize!(env::Env, draws::AbstractVector{Draw})
    kept = collect(draws)
    GC.@preserve kept begin
        items = [
            mjenv_randomization(
                distribution = draw.distribution,
                array = Cstring(pointer(draw.array)),
                elements = draw.elements === nothing ? Ptr{Int64}(C_NULL) : pointer(draw.elements),
                element_count = draw.elements === nothing ? 0 : length(draw.elements),
                parameters = pointer(draw.parameters),
                parameter_count = length(draw.parameters),
                effect = draw.effect,
                shared = draw.shared,
                constants = draw.constants,
                repeats = draw.repeats,
                factor = draw.factor,
            ) for draw in kept
        ]
        check(env.handle, inside(handle -> mjenv_randomize(handle, items, length(items)), env))
    end
    return env
end

randomize!(env::Env, draws::AbstractVector) = isempty(draws) ? randomize!(env, Draw[]) : randomize!(env, Draw[draws...])

"""
    MJEnv.Push(body, low, high; every = (100, 200), duration = (1, 1), kick = false)

Pushes of a body at random times, see [`perturb!`](@ref): the number of the body ([`object_index`](@ref)), and the bounds
of the 6 numbers that are written to `xfrc_applied`. With `kick = true`, they are added to `qvel` of the body's free
joint before a step. `every` gives the fewest and the most steps from the reset, or the last step of a push, to the next
push, and `duration` the fewest and the most steps that a force lasts.
"""
struct Push
    body::Int
    low::NTuple{6,Float64}
    high::NTuple{6,Float64}
    every::Tuple{Int,Int}
    duration::Tuple{Int,Int}
    kick::Bool
end

function Push(
    body::Integer,
    low::Numbers,
    high::Numbers;
    every::Tuple{Integer,Integer} = (100, 200),
    duration::Tuple{Integer,Integer} = (1, 1),
    kick::Bool = false,
)
    length(low) == length(high) == 6 || throw(DimensionMismatch("low and high of a push have 6 numbers each"))
    return Push(body, NTuple{6,Float64}(low), NTuple{6,Float64}(high), every, duration, kick)
end

# Standard deviations or a first action as a vector, which is empty for 0, the library's default.
deviations(noise::Real) = iszero(noise) ? Float64[] : Float64[noise]
deviations(noise::Numbers) = collect(Float64, noise)

"""
    perturb!(env; action_noise = 0, observation_noise = 0, action_delay = 0, observation_delay = 0, pushes = [],
             first_action = 0, redraw_delays = false)

Ends the present noise, delays and pushes at once; the new ones act on each row from its next reset on. The noise is
one standard deviation, or one for each actuator or element of the observation. The delays are numbers of steps, or
ranges such as `0:2`, from which resets draw them, or with `redraw_delays` each step. Until the first delayed action
arrives, the task gets `first_action`: one number for all actuators, or one for each. `pushes` are
[`MJEnv.Push`](@ref), for each body at most one force and one kick. docs/randomisation.md describes what happens in a
step. Returns `env`.
"""
function perturb!(
    env::Env;
    action_noise::Union{Real,Numbers} = 0,
    observation_noise::Union{Real,Numbers} = 0,
    action_delay::Union{Integer,UnitRange{<:Integer}} = 0,
    observation_delay::Union{Integer,UnitRange{<:Integer}} = 0,
    pushes::AbstractVector = Push[],
    first_action::Union{Real,Numbers} = 0,
    redraw_delays::Bool = false,
)
    greatest(delay) = delay isa UnitRange ? last(delay) : 0
    for delay in (action_delay, observation_delay)
        delay isa UnitRange && isempty(delay) && throw(ArgumentError("the range $delay of a delay is empty"))
    end
    of_actions, of_observations = deviations(action_noise), deviations(observation_noise)
    first_one = deviations(first_action)
    structs = mjenv_push[
        mjenv_push(
            body = clamp(push.body - 1, typemin(Int32), typemax(Int32)),
            min_steps = push.every[1],
            max_steps = push.every[2],
            low = push.low,
            high = push.high,
            is_kick = push.kick,
            min_duration = push.duration[1],
            max_duration = push.duration[2],
        ) for push in pushes
    ]
    GC.@preserve of_actions of_observations first_one structs begin
        perturbation = Ref(
            mjenv_perturbation(
                action_noise = pointer(of_actions),
                action_noise_count = length(of_actions),
                observation_noise = pointer(of_observations),
                observation_noise_count = length(of_observations),
                action_delay = first(action_delay),
                observation_delay = first(observation_delay),
                max_action_delay = greatest(action_delay),
                max_observation_delay = greatest(observation_delay),
                redraws_delays = redraw_delays,
                pushes = pointer(structs),
                push_count = length(structs),
                first_action = pointer(first_one),
                first_action_count = length(first_one),
            ),
        )
        check(env.handle, inside(handle -> mjenv_perturb(handle, perturbation), env))
    end
    return env
end
