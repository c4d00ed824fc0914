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

# The walker's level is kept; its speed is written by the program. Of its reward, the step draws a part.
struct Walk <: MJEnv.BatchTask end

MJEnv.state_of(::Walk) = (level = 1, speed = 1, start = 1)
MJEnv.reset!(::Walk, rng, rows) =
    ([0, 1.25, 0, 0, 0, 0] .+ zeros(6, rows), zeros(6, rows), (level = rng.state.level .+ 1, start = MJEnv.uniform(rng, 0, 1)))
MJEnv.observe(::Walk, sim) = (policy = vcat(sim.qpos, sim.speed), critic = vcat(sim.level, sim.start))

function MJEnv.step!(::Walk, sim, action)
    sim.level .+= 0.25
    return (reward = vec(sim.speed .* MJEnv.uniform(sim.rng, 0, 1)), terminated = falses(length(sim.speed)))
end

walk(; options...) = MJEnv.BatchEnv(
    Walk(); model = "hopper.xml", observations = (policy = (qpos = 6, speed = 1), critic = 2), rows = 3, max_episode_steps = 4,
    options...,
)

@testset "groups, kept and written state, draws of steps, $mode" for mode in (:next_step, :same_step)
    envs = walk(; autoreset_mode = mode)
    seed!(envs.env, 1)
    @test [field.name for field in MJEnv.fields(envs.env, :observation)] == ["qpos", "speed", "critic"]
    reset!(envs)
    envs.state.speed .= [1.0 2.0 -1.0]
    # NumPy's default_rng(1), of which the reset has drawn the first number
    numbers = [0.5118216247002567, 0.9504636963259353, 0.14415961271963373, 0.9486494471372439, 0.31183145201048545, 0.42332644897257565]
    @test MJEnv.groups(envs.batch).critic[:, 1] == [1, numbers[1]]
    for step in 1:4
        found = step!(envs, zeros(3, 3))
        @test found.reward[1] == numbers[step + 1] && sign.(found.reward) == [1, 1, -1]
    end
    level, drawn = MJEnv.groups(envs.batch).critic[:, 1]
    if mode == :next_step
        @test (level, drawn) == (2, numbers[1])
        level, drawn = (step!(envs, zeros(3, 3)); MJEnv.groups(envs.batch).critic[:, 1])
    end
    @test (level, drawn) == (3, numbers[6])
    @test MJEnv.groups(envs.batch).policy[7, :] == [1, 2, -1]
    randomize!(envs.env, """{"noise": {"observation": {"policy": 0.1}}}""")
    reset!(envs)
    critic = copy(MJEnv.groups(envs.batch).critic)
    @test critic[1, :] == [4, 4, 4] && MJEnv.groups(envs.batch).policy[7, 1] != 1
end

@testset "rollouts, $mode" for mode in (:next_step, :same_step, :disabled)
    options = (max_episode_steps = 30, autoreset_mode = mode)
    env, envs = Env("Hopper-v5"; rows = 8, history = 2, options...), hop(; options...)
    foreach(each -> (seed!(each, 5)), (env, envs.env))
    reset!(env), reset!(envs)
    actions = [((7i + 11row + 3step) % 19) / 9 - 1 for i in 1:3, step in 1:40, row in 1:8]
    wanted, found = rollout(env, actions), rollout(envs, actions)
    @test same(found.obs, wanted.obs) && same(found.terminated, wanted.terminated) && same(found.truncated, wanted.truncated)
    @test same(found.reward, found.info.steps) && iszero(found.reward[40, :]) && maximum(found.reward) > 5
    @test_throws Union{ArgumentError,MJEnvError} rollout(envs, actions)
    reset!(envs), reset!(env)
    @test same(rollout(envs, actions[:, 1:3, :]).obs, rollout(env, actions[:, 1:3, :]).obs)
end

# tests/tasks/walk.cpp without its contacts, over all rows.
mutable struct Rough <: MJEnv.BatchTask
    qpos0::Vector{Float64}
    trunk::Int
    ground::MJEnv.Heights
    own::Matrix{Float32}  # the rows' hfield_data; empty: the model's
    Rough() = new()
end

function MJEnv.reset!(task::Rough, rng, rows)
    qpos = repeat(task.qpos0, 1, rows)
    qpos[1, :], qpos[2, :], qpos[3, :] = MJEnv.uniform(rng, -20, 20), MJEnv.uniform(rng, -10, 10), fill(0.6, rows)
    qpos[4:end, :] += MJEnv.uniform(rng, -0.1, 0.1, 16)
    return qpos, zeros(18, rows)
end

const POINTS = ((0, 0), (0.3, 0.1), (-0.2, 0.15), (5, -7))

function MJEnv.observe(task::Rough, sim)
    own = isempty(task.own) ? () : (task.own,)
    height = MJEnv.height(task.ground, sim.qpos[1:1, :], sim.qpos[2:2, :], own...)
    around = MJEnv.around(task.ground, sim.xpos[:, task.trunk, :], sim.xmat[:, task.trunk, :], POINTS, own...)
    return vcat(sim.qpos, sim.qvel, height, around)
end

function MJEnv.step!(::Rough, sim, action)
    MJEnv.uniform(sim.rng, 0, 1, 7)  # what the task in C++ draws, which never kicks
    return (reward = sim.qvel[1, :], terminated = falses(size(action, 2)))
end

@testset "heights of a terrain equal those in C++" begin
    folder = joinpath(dirname(realpath(ENV["MJENV_LIBRARY"])), "tests", "tasks")
    MJEnv.load_tasks(joinpath(folder, "libwalk.so"))
    twin = Env("tests/Walk-v0"; rows = 5, kicks = 0.0, autoreset_mode = :next_step)
    envs = MJEnv.BatchEnv(
        Rough(); model = joinpath(folder, "rough.xml"), observations = 42, needs = (:qpos, :qvel, :xpos, :xmat), rows = 5,
        frame_skip = 2, max_episode_steps = 60, autoreset_mode = :next_step,
    )
    task, env = envs.task, envs.env
    task.qpos0, task.trunk, task.ground = read(env, :qpos0), object_index(env, :body, "trunk"), MJEnv.terrain(env, :ground)
    seen(obs) = obs[[1:37; 50:54], :]  # of the twin
    for rough in (false, true)
        count = length(read(env, :hfield_data))
        own = rough ? Float32[mod(31i + 17row, 101) / 101 for i in 1:count, row in 1:5] : zeros(Float32, 0, 0)
        rough && foreach(each -> write!(each, :hfield_data, own), (twin, env))
        task.own = own
        foreach(each -> seed!(each, 3), (twin, env))
        @test same(reset!(envs).obs, seen(reset!(twin).obs))
        for step in 1:70
            action = [mod(7step + 3i + row, 11) / 5 - 1 for i in 1:12, row in 1:5]
            found, wanted = step!(envs, action), step!(twin, action)
            @test same(found.obs, seen(wanted.obs)) && same(found.truncated, wanted.truncated)
        end
        @test length(unique(envs.batch.obs[38:42, :])) > 10
    end
    x, y = envs.batch.obs[1, :], envs.batch.obs[2, :]
    @test same(MJEnv.height(task.ground, x, y, task.own), envs.batch.obs[38, :])
    @test MJEnv.height(task.ground, x[1], y[1], task.own[:, 1]) === envs.batch.obs[38, 1]
    @test isnan(MJEnv.height(task.ground, NaN, 0.0))
    @test_throws DimensionMismatch MJEnv.height(task.ground, x, y[1:4])
    @test_throws ArgumentError MJEnv.terrain(env, "fl_foot")
    @test_throws MJEnvError MJEnv.terrain(env, "sea")
end

isdefined(MJEnv, :Learner) && @testset "a learner" begin
    settings = (rollout_steps = 32, minibatch_size = 64, hidden = (16,))
    learners = map(1:2) do _
        envs = walk(; autoreset_mode = :same_step)
        envs.state.speed .= 1
        MJEnv.Learner(envs; seed = 3, actor_obs = [index <= 7 for index in 1:9], settings...)
    end
    first, second = learners
    MJEnv.train!(first, 5 * 96)
    foreach(_ -> MJEnv.train!(second, 96), 1:5)
    @test MJEnv.report(first).updates == 5 && MJEnv.policy_text(first) == MJEnv.policy_text(second)
    @test occursin("\ninput qpos 6\ninput speed 1\nmean", MJEnv.policy_text(first))
    mktempdir() do folder
        MJEnv.save(first, joinpath(folder, "checkpoint"))
        MJEnv.train!(MJEnv.load!(second, joinpath(folder, "checkpoint")), 96)
        @test MJEnv.report(second).updates == 6
    end
    first.stepped.state.speed .= NaN
    @test_throws MJEnvError MJEnv.train!(first, 96)
    first.stepped.state.speed .= 1
    MJEnv.train!(first, 96)
    @test MJEnv.report(first).updates == 6
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
