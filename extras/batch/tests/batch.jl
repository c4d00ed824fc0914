# A task over all rows equals the built-in Hopper-v5, with resets, draws, noise and images.

using MJEnv
using Test

struct Hop <: MJEnv.BatchTask
    fault::Base.RefValue{Symbol}
end

MJEnv.state_of(::Hop) = (steps = 1, start = 6)

function MJEnv.reset!(task::Hop, rng, rows)
    qpos = [0, 1.25, 0, 0, 0, 0] .+ MJEnv.uniform(rng, -5e-3, 5e-3, 6)
    task.fault[] == :reset && error("in reset!")
    return qpos, MJEnv.uniform(rng, -5e-3, 5e-3, 6), (steps = zeros(1, rows), start = qpos)
end

MJEnv.observe(::Hop, sim) = vcat(sim.qpos[2:end, :], clamp.(sim.qvel, -10, 10))

function MJEnv.step!(task::Hop, sim, action)
    sim.steps .+= 1
    task.fault[] == :step && error("in step!")
    reward = vec(task.fault[] == :reward ? sim.steps .* NaN : sim.steps)
    small = all(abs.(vcat(sim.qpos[3:end, :], sim.qvel)) .< 100; dims = 1)
    healthy = vec(small) .& (sim.qpos[2, :] .> 0.7) .& (abs.(sim.qpos[3, :]) .< 0.2)
    return (reward = reward, terminated = .!healthy, info = (steps = vec(sim.steps), height = sim.qpos[2, :]))
end

hop(; options...) = MJEnv.BatchEnv(
    Hop(Ref(:none)); model = "hopper.xml", observations = 11, infos = (:steps, :height), rows = 8, frame_skip = 4,
    history = 2, options...,
)

same(a, b) = size(a) == size(b) && all(a .=== b)

const DRAWS = """{"randomize": {"body_mass": {"kind": "scale", "low": 0.5, "high": 2}}, "noise": {"action": 0.1, "observation": 0.01},
    "delay": {"action": [0, 2]}}"""

@testset "equal to Hopper-v5, $mode" for mode in (:next_step, :same_step)
    options = (max_episode_steps = 30, autoreset_mode = mode)
    env, envs = Env("Hopper-v5"; rows = 8, history = 2, options...), hop(; options...)
    batch = Batch(env)
    for each in (env, envs.env)
        randomize!(each, DRAWS)
        seed!(each, 5)
    end
    reset!(batch, env)
    @test same(reset!(envs).obs, batch.obs)
    image, ended = UInt8[], 0
    for step in 1:100
        action = [((7i + 11row + 3step) % 19) / 9 - 1 for i in 1:3, row in 1:8]
        step == 50 && (image = MJEnv.snapshot(envs))
        step == 60 && MJEnv.restore!(envs, MJEnv.snapshot(envs))  # in mid-episode
        step!(batch, env, action)
        found = step!(envs, action)
        @test same(found.obs, batch.obs) && same(found.terminated, batch.terminated)
        @test same(found.truncated, batch.truncated) && same(envs.batch.was_reset, batch.was_reset)
        mode == :same_step && @test same(envs.batch.final_obs, batch.final_obs)
        @test same(found.reward[.!batch.was_reset], found.info.steps[.!batch.was_reset]) || mode == :same_step
        ended += count(found.terminated .| found.truncated)
    end
    @test ended > 20
    other, action = hop(; options...), fill(0.5, 3, 8)
    for each in (envs, other)
        randomize!(each.env, DRAWS)
        MJEnv.restore!(each, image)
    end
    @test same(step!(envs, action).obs, step!(other, action).obs)
    @test same(envs.state.steps, other.state.steps) && same(envs.state.start, other.state.start)
end

@testset "one row" begin
    env, envs = Env("Hopper-v5"; history = 2), hop(; rows = 1)
    foreach(each -> seed!(each, 5), (env, envs.env))
    @test same(reset!(envs).obs, reset!(env).obs)
    found, wanted = step!(envs, zeros(3, 1)), step!(env, zeros(3))
    @test same(found.obs, wanted.obs) && found.reward === found.info.steps === 1.0
end

@testset "errors" begin
    envs = hop()
    reset!(envs)  # from the system's entropy
    @test length(unique(envs.batch.obs[12, :])) == 8
    for (fault, message) in ((:step, "in step!"), (:reward, "row 0"), (:reset, "in reset!"))
        envs.task.fault[] = fault
        before = copy(envs.state.steps)
        error = try
            fault == :reset ? reset!(envs) : step!(envs, zeros(3, 8))
        catch error
            error
        end
        @test occursin(message, sprint(showerror, error))
        @test envs.state.steps == before
        envs.task.fault[] = :none
        step!(envs, zeros(3, 8))
    end
    @test_throws MJEnvError step!(envs, zeros(3, 7))
    @test_throws MJEnvError hop(; frame_skip = 0)
end
