"""
An `MJEnv.Env` of one row as an environment of CommonRLInterface: `convert(CommonRLInterface.AbstractEnv, env)`.
"""
module MJEnvCommonRLInterfaceExt

@static if isdefined(Base, :get_extension)
    using CommonRLInterface: CommonRLInterface
    using MJEnv: MJEnv
else
    using ..CommonRLInterface: CommonRLInterface
    using ..MJEnv: MJEnv
end

const RL = CommonRLInterface

struct CommonEnv <: RL.AbstractEnv
    episode::MJEnv.Episode
end

Base.convert(::Type{RL.AbstractEnv}, env::MJEnv.Env) = CommonEnv(MJEnv.Episode(env))
Base.convert(::Type{MJEnv.Env}, common::CommonEnv) = common.episode.env

Base.show(io::IO, common::CommonEnv) =
    print(io, "convert(CommonRLInterface.AbstractEnv, ", common.episode.env, ")")

RL.reset!(common::CommonEnv) = MJEnv.reset!(common.episode)
RL.act!(common::CommonEnv, action) = MJEnv.step!(common.episode, action)
RL.observe(common::CommonEnv) = MJEnv.observe(common.episode)
RL.terminated(common::CommonEnv) = MJEnv.ended(common.episode)
RL.actions(common::CommonEnv) = MJEnv.actions(common.episode)
RL.observations(common::CommonEnv) = MJEnv.observations(common.episode)
RL.state(common::CommonEnv) = MJEnv.state(common.episode)
RL.setstate!(common::CommonEnv, state) = MJEnv.set_state!(common.episode, state)
RL.clone(common::CommonEnv) = CommonEnv(copy(common.episode))
RL.render(common::CommonEnv) = MJEnv.picture(common.episode)

end
