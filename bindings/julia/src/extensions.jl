# Functions for the interfaces of other packages, and the code that loads their extensions.

# An environment of one row together with its outputs. Other packages call this an environment.
mutable struct Episode
    env::Env
    batch::Batch{Float64}
    renderer::Union{Nothing,Renderer}  # created by the first picture
end

function Episode(env::Env)
    env.rows == 1 || throw(ArgumentError("environments of other packages have one row; this $env has $(env.rows)"))
    return Episode(env, observe!(Batch(env), env), nothing)
end

function reset!(episode::Episode)
    reset!(episode.batch, episode.env)
    return nothing
end

# Returns the reward.
function step!(episode::Episode, action)
    step!(episode.batch, episode.env, action)
    return episode.batch.reward[1]
end

observe(episode::Episode) = episode.batch.obs[:, 1]
observations(episode::Episode) = observation_space(episode.env)
actions(episode::Episode) = action_space(episode.env)
# These interfaces do not distinguish truncation from termination. In both cases the episode is over.
ended(episode::Episode) = episode.batch.terminated[1] || episode.batch.truncated[1]

# The image has the state of the row; the other fields are outputs that the image does not contain.
function state(episode::Episode)
    batch = episode.batch
    outcome = (reward = batch.reward[1], terminated = batch.terminated[1], truncated = batch.truncated[1])
    return merge((image = snapshot(episode.env),), outcome)
end

function set_state!(episode::Episode, state::NamedTuple)
    batch = episode.batch
    restore!(episode.env, state.image)
    observe!(batch, episode.env)
    batch.reward[1] = state.reward
    batch.terminated[1], batch.truncated[1] = state.terminated, state.truncated
    return nothing
end

function Base.copy(episode::Episode)
    twin = Episode(Env(episode.env.id; engine = episode.env.engine, options(episode.env)...))
    set_state!(twin, state(episode))
    return twin
end

function picture(episode::Episode)
    episode.renderer === nothing && (episode.renderer = Renderer(episode.env))
    return Picture(render(episode.renderer))
end

# Julia before 1.9 has no extensions, so MJEnv includes them when the other package is loaded.
const EXTENSIONS = Dict(
    Base.PkgId(Base.UUID(uuid), name) => joinpath(@__DIR__, "..", "ext", "MJEnv$(name)Ext.jl") for (name, uuid) in (
        "CommonRLInterface" => "d842c3ba-07a1-494f-bbec-f5741b0a3e98",
        "ReinforcementLearningBase" => "e575027e-6cd6-5018-9292-cdc6200d2b44",
    )
)

function include_extension(package)
    haskey(EXTENSIONS, package) || return
    # An extension inside this module cannot find packages by their names. It takes them from the module instead.
    extensions = Module(:Extensions)
    Core.eval(extensions, :(const MJEnv = $(@__MODULE__)))
    Core.eval(extensions, :(const $(Symbol(package.name)) = $(Base.loaded_modules[package])))
    Base.include(extensions, EXTENSIONS[package])
    return
end

function watch_packages()
    foreach(package -> haskey(Base.loaded_modules, package) && include_extension(package), keys(EXTENSIONS))
    push!(Base.package_callbacks, include_extension)
    return
end
