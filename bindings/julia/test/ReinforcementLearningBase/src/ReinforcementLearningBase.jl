"""
Stands in for the registered package where there is none: the names of its interface that MJEnv adds methods to, and the
defaults by which a call of few arguments reaches them.
"""
module ReinforcementLearningBase

using Random: Random

abstract type AbstractEnv end

struct Observation{T} end
struct DefaultPlayer end

for name in (:reset!, :act!, :reward, :is_terminated, :action_space)
    @eval function $name end
end

state(env::AbstractEnv) = state(env, Observation{Any}(), DefaultPlayer())
state_space(env::AbstractEnv) = state_space(env, Observation{Any}(), DefaultPlayer())
legal_action_space(env::AbstractEnv) = action_space(env)
Base.copy(env::AbstractEnv) = deepcopy(env)
Random.seed!(env::AbstractEnv, seed) = error("method not implemented")

end
