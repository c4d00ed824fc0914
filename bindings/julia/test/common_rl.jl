# Tests that CommonRLInterface's functions return what MJEnv's functions return, which other tests compare with
# Gymnasium. If the package is not installed, a module with the names of its functions replaces it.

Base.find_package("CommonRLInterface") === nothing && push!(LOAD_PATH, joinpath(@__DIR__, "CommonRLInterface"))

using CommonRLInterface: CommonRLInterface
const RL = CommonRLInterface

@testset "an episode" begin
    env = Env("Hopper-v5")
    common = convert(RL.AbstractEnv, seed!(Env("Hopper-v5"), 3))
    @test common isa RL.AbstractEnv
    @test convert(Env, common).id == "Hopper-v5"
    seed!(env, 3)
    @test RL.reset!(common) === nothing
    @test RL.observe(common) == reset!(env).obs
    steps = 0
    while !RL.terminated(common)
        action = rand(RL.actions(common))
        @test RL.act!(common, action) === step!(env, action).reward
        @test RL.observe(common) == observe(env)
        steps += 1
    end
    @test 1 < steps < 1000
    @test_throws MJEnvError RL.act!(common, zeros(3))
end

@testset "spaces" begin
    common = convert(RL.AbstractEnv, Env("Ant-v5"))
    box = RL.actions(common)
    @test (box.low, box.high) == (fill(-1.0f0, 8), fill(1.0f0, 8))
    @test eltype(box) == Vector{Float32}
    @test all(rand(box) in box for _ in 1:100)
    @test rand(box) != rand(box)
    @test !(zeros(7) in box) && !(fill(1.1, 8) in box)
    @test length(RL.observations(common).low) == 105
    @test box == RL.actions(common) && box != RL.observations(common)
    @test hash(box) == hash(RL.actions(common))
    @test_throws ArgumentError rand(RL.observations(common))
end

@testset "state and clone" begin
    common = convert(RL.AbstractEnv, seed!(Env("Reacher-v5"; max_episode_steps = 4, reward_control_weight = 0.5), 1))
    RL.reset!(common)
    RL.act!(common, [0.5, -0.5])
    state, seen = RL.state(common), RL.observe(common)
    twin = RL.clone(common)
    @test RL.observe(twin) == seen
    rewards = [RL.act!(common, [0.1, 0.2]) for _ in 1:3]
    @test RL.terminated(common)
    @test !RL.terminated(twin)
    @test [RL.act!(twin, [0.1, 0.2]) for _ in 1:3] == rewards
    RL.setstate!(common, state)
    @test !RL.terminated(common)
    @test RL.observe(common) == seen
    @test [RL.act!(common, [0.1, 0.2]) for _ in 1:3] == rewards
    final = RL.state(common)
    RL.reset!(common)
    RL.setstate!(common, final)
    @test RL.terminated(common)
end

@testset "render" begin
    env = Env("Reacher-v5")
    common = convert(RL.AbstractEnv, env)
    RL.reset!(common)
    picture = RL.render(common)
    @test picture.pixels == render(Renderer(env))
    @test showable(MIME("image/png"), picture)
    RL.act!(common, (1.0, 1.0))
    @test RL.render(common).pixels != picture.pixels
end

@test_throws ArgumentError convert(RL.AbstractEnv, Env("Reacher-v5"; rows = 2))
