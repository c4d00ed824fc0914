"""
An `MJEnv.Env` of one row as an environment of ReinforcementLearningBase, which the algorithms of ReinforcementLearning
take: `convert(ReinforcementLearningBase.AbstractEnv, env)`.
"""
module MJEnvReinforcementLearningBaseExt

@static if isdefined(Base, :get_extension)
    using MJEnv: MJEnv
    using ReinforcementLearningBase: ReinforcementLearningBase
else
    using ..MJEnv: MJEnv
    using ..ReinforcementLearningBase: ReinforcementLearningBase
end

const RLBase = ReinforcementLearningBase

struct BaseEnv <: RLBase.AbstractEnv
    episode::MJEnv.Episode
end

Base.convert(::Type{RLBase.AbstractEnv}, env::MJEnv.Env) = BaseEnv(MJEnv.Episode(env))
Base.convert(::Type{MJEnv.Env}, base::BaseEnv) = base.episode.env

Base.show(io::IO, base::BaseEnv) =
    print(io, "convert(ReinforcementLearningBase.AbstractEnv, ", base.episode.env, ")")
Base.nameof(base::BaseEnv) = Symbol(base.episode.env.id)

RLBase.reset!(base::BaseEnv) = MJEnv.reset!(base.episode)

function RLBase.act!(base::BaseEnv, action)
    MJEnv.step!(base.episode, action)
    return nothing
end

RLBase.reward(base::BaseEnv) = base.episode.batch.reward[1]
RLBase.is_terminated(base::BaseEnv) = MJEnv.ended(base.episode)
RLBase.action_space(base::BaseEnv) = MJEnv.actions(base.episode)
RLBase.state(base::BaseEnv, ::RLBase.Observation, ::RLBase.DefaultPlayer) = MJEnv.observe(base.episode)
RLBase.state_space(base::BaseEnv, ::RLBase.Observation, ::RLBase.DefaultPlayer) = MJEnv.observations(base.episode)

# ReinforcementLearningBase's own copies deeply, which an environment outside Julia's memory refuses.
Base.copy(base::BaseEnv) = BaseEnv(copy(base.episode))

function MJEnv.Random.seed!(base::BaseEnv, seed::Integer)
    MJEnv.seed!(base.episode.env, seed)
    return base
end

end
