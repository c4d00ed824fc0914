# Tests that ReinforcementLearningBase's functions return what MJEnv's functions return, which other tests compare with
# Gymnasium. If the package is not installed, a module with the names of its functions replaces it.

Base.find_package("ReinforcementLearningBase") === nothing &&
    push!(LOAD_PATH, joinpath(@__DIR__, "ReinforcementLearningBase"))

using Random: Random
using ReinforcementLearningBase: ReinforcementLearningBase
const RLBase = ReinforcementLearningBase

@testset "an episode" begin
    env = seed!(Env("Hopper-v5"), 3)
    base = convert(RLBase.AbstractEnv, Env("Hopper-v5"))
    @test base isa RLBase.AbstractEnv
    @test convert(Env, base).id == "Hopper-v5"
    @test nameof(base) == Symbol("Hopper-v5")
    @test sprint(show, base) == "convert(ReinforcementLearningBase.AbstractEnv, Env(\"Hopper-v5\"))"
    @test Random.seed!(base, 3) === base
    @test RLBase.reset!(base) === nothing
    @test RLBase.reward(base) === 0.0
    @test RLBase.state(base) == reset!(env).obs
    steps = 0
    while !RLBase.is_terminated(base)
        action = rand(RLBase.legal_action_space(base))
        @test action in RLBase.action_space(base)
        RLBase.act!(base, action)
        @test RLBase.reward(base) === step!(env, action).reward
        @test RLBase.state(base) == observe(env)
        @test RLBase.state(base) in RLBase.state_space(base)
        steps += 1
    end
    @test 1 < steps < 1000
    @test_throws MJEnvError RLBase.act!(base, zeros(3))
    RLBase.reset!(base)
    @test !RLBase.is_terminated(base) && RLBase.reward(base) === 0.0
end

@testset "copies" begin
    base = convert(RLBase.AbstractEnv, seed!(Env("Reacher-v5"; max_episode_steps = 4, reward_control_weight = 2), 1))
    RLBase.reset!(base)
    RLBase.act!(base, (0.5, -0.5))
    twin = copy(base)
    @test RLBase.action_space(twin) == RLBase.action_space(base)
    @test (RLBase.state(twin), RLBase.reward(twin)) == (RLBase.state(base), RLBase.reward(base))
    play(env) = map(_ -> (RLBase.act!(env, [0.1, 0.2]); (RLBase.state(env), RLBase.reward(env))), 1:3)
    played = play(base)
    @test RLBase.is_terminated(base) && !RLBase.is_terminated(twin)
    @test play(twin) == played
    # The copy has the random stream, too.
    RLBase.reset!(base)
    RLBase.reset!(twin)
    @test RLBase.state(twin) == RLBase.state(base)
end

@test_throws ArgumentError convert(RLBase.AbstractEnv, Env("Reacher-v5"; rows = 2))
