"""
An `MJEnv.Env` of one row as CommonRLInterface sees an environment: `convert(CommonRLInterface.AbstractEnv, env)`.
"""
module MJEnvCommonRLInterfaceExt

@static if isdefined(Base, :get_extension)
    using CommonRLInterface: CommonRLInterface
    using MJEnv: MJEnv
else
    # MJEnv includes this file, where packages are not found by their names.
    const CommonRLInterface, MJEnv = map((
        "CommonRLInterface" => "d842c3ba-07a1-494f-bbec-f5741b0a3e98",
        "MJEnv" => "d45b0081-1b21-4836-837c-1c954879dfb3",
    )) do (name, uuid)
        Base.loaded_modules[Base.PkgId(Base.UUID(uuid), name)]
    end
end

const RL = CommonRLInterface

struct CommonEnv <: RL.AbstractEnv
    env::MJEnv.Env
    batch::MJEnv.Batch{Float64}
end

function Base.convert(::Type{RL.AbstractEnv}, env::MJEnv.Env)
    env.rows == 1 || throw(ArgumentError("CommonRLInterface's environments have one row, not $(env.rows)"))
    return CommonEnv(env, MJEnv.observe!(MJEnv.Batch(env), env))
end

Base.convert(::Type{MJEnv.Env}, common::CommonEnv) = common.env

Base.show(io::IO, common::CommonEnv) = print(io, "convert(CommonRLInterface.AbstractEnv, ", common.env, ")")

function RL.reset!(common::CommonEnv)
    MJEnv.reset!(common.batch, common.env)
    return nothing
end

function RL.act!(common::CommonEnv, action)
    MJEnv.step!(common.batch, common.env, action)
    return common.batch.reward[1]
end

RL.observe(common::CommonEnv) = common.batch.obs[:, 1]
# Truncated, too: CommonRLInterface does not tell the two apart, and neither goes on.
RL.terminated(common::CommonEnv) = common.batch.terminated[1] || common.batch.truncated[1]
RL.actions(common::CommonEnv) = MJEnv.Box(MJEnv.action_space(common.env)...)
RL.observations(common::CommonEnv) = MJEnv.Box(MJEnv.observation_space(common.env)...)

# Everything that decides what follows, and what observe and terminated tell.
function RL.state(common::CommonEnv)
    batch = common.batch
    return (image = MJEnv.snapshot(common.env), terminated = batch.terminated[1], truncated = batch.truncated[1])
end

function RL.setstate!(common::CommonEnv, state)
    MJEnv.restore!(common.env, state.image)
    MJEnv.observe!(common.batch, common.env)
    common.batch.terminated[1], common.batch.truncated[1] = state.terminated, state.truncated
    return nothing
end

function RL.clone(common::CommonEnv)
    twin = convert(RL.AbstractEnv, MJEnv.Env(common.env.id; MJEnv.options(common.env)...))
    RL.setstate!(twin, RL.state(common))
    return twin
end

end
