# Tests tasks that are written in Julia, and plug-ins. The ids stay registered, so this is the last test set.

using MJEnv: MJENV_E_ARGUMENT, MJENV_E_TASK, MJENV_OK

include("hopper.jl")

# Every output, as bits.
written(batch) = (
    map(name -> reinterpret(UInt64, vec(getfield(batch, name))), FLOATS)...,
    (batch.terminated, batch.truncated, batch.status, batch.was_reset)...,
)
const FLOATS = (:obs, :reward, :step_info, :reset_info, :final_obs, :final_info, :arrays)

function pair(rows; threads = 1, options...)
    envs = (
        Env("Hopper-v5"; rows = rows, num_threads = threads, options...),
        Env("JuliaHopper-v5"; rows = rows, options...),
    )
    batches = map(Batch, envs)
    foreach(env -> seed!(env, 3), envs)
    foreach(reset!, batches, envs)
    @test written(batches[1]) == written(batches[2])
    seed_actions!(envs[1], 1)
    return envs, batches
end

# Steps both, and returns how many episodes ended, and whether all outputs were equal.
function compare((envs, batches), steps, T = Float32)
    drawn = sample_actions(envs[1])
    ended, equal = 0, true
    for _ in 1:steps
        action = T.(sample_actions!(drawn, envs[1]))
        foreach((batch, env) -> step!(batch, env, action), batches, envs)
        equal &= written(batches[1]) == written(batches[2])
        ended += count(batches[1].terminated .| batches[1].truncated)
    end
    return ended, equal
end

@testset "Hopper-v5 written in Julia: $mode, $T" for (mode, T, threads) in
                                                    (("next_step", Float32, 2), ("same_step", Float64, 5))
    ended, equal = compare(pair(64; threads = threads, autoreset_mode = mode), 1000, T)
    @test equal
    @test ended > 1000
end

@testset "options and descriptions" begin
    changed = (
        healthy_reward = 2,
        healthy_z_range = (0.2, 9),
        exclude_current_positions_from_observation = false,
        frame_skip = 3,
        ctrl_cost_weight = 0.25,
        reset_noise_scale = 0.02,
        max_episode_steps = 10,
        arrays = "xpos cfrc_ext",
        autoreset_mode = "next_step",
    )
    for options in (NamedTuple(), changed)
        envs, batches = pair(5; options...)
        for role in (:observation, :action, :reward, :info, :reset_info, :structure, :arrays)
            shown(field) = (field.name, field.shape, field.range, field.dtype)
            @test shown.(fields(envs[1], role)) == shown.(fields(envs[2], role))
        end
        @test observation_space(envs[1]) == observation_space(envs[2])
        @test string(info(batches[1])) == string(info(batches[2]))
        ended, equal = compare((envs, batches), isempty(options) ? 0 : 45)
        @test equal
        @test isempty(options) || ended > 15
        @test string(info(batches[1])) == string(info(batches[2]))
    end
    told(id) = [(o.name, o.kind, o.doc, o.default) for o in MJEnv.schema(id)]
    @test Set(told("JuliaHopper-v5")) == Set(told("Hopper-v5"))
    @test spec("JuliaHopper-v5") == merge(spec("Hopper-v5"), (id = "JuliaHopper-v5", robot = "JuliaHopper"))
end

@testset "states, images, rollouts, send and receive" begin
    envs, batches = both = pair(4; strict = false)
    images = map(env -> snapshot(env; rows = :), envs)
    @test last(compare(both, 20))
    foreach((env, image) -> restore!(env, image; rows = :), envs, images)
    for env in envs
        copy_row!(env, 1, [false, true, false, true])
        set_state!(env, read(env, :qpos; row = 3) .+ 0.01, read(env, :qvel; row = 3); row = 3)
        simulate!(env, [0.1, 0.2, 0.3], 2; row = 2)
    end
    @test same(observe(envs[1]), observe(envs[2]))
    @test last(compare(both, 20, Float64))
    actions = reshape(sin.(1:(3 * 7 * 4)), 3, 7, 4)
    planned = [rollout!(Batch(env; steps = 7), env, actions) for env in envs]
    @test written(planned[1]) == written(planned[2])
    rows = zeros(Int64, 4)
    for (env, batch) in zip(envs, batches)
        send!(env, actions[:, 1, 1:3]; rows = [4, 1, 2])
        @test sort(recv!(rows, batch, env; least = 3)) == [1, 2, 4]
    end
    @test written(batches[1]) == written(batches[2])
    @test refuses(() -> restore!(envs[2], images[1]; rows = :), MJENV_E_SNAPSHOT, "Hopper-v5")
end

@testset "threads" begin
    @test refuses(() -> Env("JuliaHopper-v5"; rows = 8, num_threads = 2), MJENV_E_VALUE, "num_threads", "set it to 1")
    @test Env(env -> options(env).num_threads, "JuliaHopper-v5"; rows = 8, num_threads = 0) == 0
    # An environment on each of Julia's threads.
    @test spoken("""
        include($(repr(joinpath(@__DIR__, "hopper.jl"))))
        function play(id)
            env = Env(id; rows = 8, autoreset_mode = "next_step")
            batch = Batch(env)
            seed!(env, 1)
            reset!(batch, env)
            seen = UInt64[]
            for t in 1:200
                step!(batch, env, fill(sin(t), 3, 8))
                push!(seen, hash(batch.obs, hash(batch.reward)))
                t % 50 == 0 && GC.gc()
            end
            return seen
        end
        found = Vector{Any}(undef, 6)
        Threads.@threads for i in 1:6
            found[i] = play(isodd(i) ? "Hopper-v5" : "JuliaHopper-v5")
        end
        print(length(found[1]), " ", all(==(found[1]), found))
        """; threads = 3) == "200 true"
end

@testset "nothing is allocated: $T" for T in (Float32, Float64)
    env = Env("JuliaHopper-v5"; rows = 2, strict = false)
    batch = Batch(env; dtype = T)
    @test allocated(reset!, batch, env) == 0
    @test allocated(step!, batch, env, zeros(T, 3, 2)) == 0
    @test allocated(observe!, batch, env) == 0
end

# ---- A task that shows what a task can read, and fails as its option says ----

const PROBE_MODEL = """
    <mujoco><option timestep="0.01"/><worldbody>
    <geom name="floor" type="plane" size="5 5 .1"/>
    <body name="cart" pos="0 0 1"><joint name="slide" type="slide" axis="1 0 0"/>
    <geom name="box" type="box" size=".1 .1 .1"/><site name="tip" pos="0 0 .2"/></body>
    <body name="ball" pos="1 0 .099"><freejoint name="free"/><geom name="ball" size=".1"/></body>
    </worldbody><actuator><motor name="push" joint="slide" gear="10" ctrllimited="true" ctrlrange="-1 1"/></actuator>
    <sensor><framepos name="at" objtype="body" objname="ball"/><jointpos joint="slide"/></sensor></mujoco>"""

struct Probe <: MJEnv.Task
    mode::String
    tip::Int
    free::NamedTuple{(:index, :qpos, :qvel),NTuple{3,Int}}
    place::UnitRange{Int}
    friction::MJEnv.NamedArray{Float64,2}
    bodies::MJEnv.NamedArray{Int32,1}
    main::Int
    count::Int
    drawn::UnitRange{Int}
    norm::MJEnv.Norm
    owner::Base.RefValue{Any}  # something to be freed
end

const KEPT = Ref{Any}(nothing)  # what the next environment's task holds
const OTHER = Ref{Any}(nothing)  # the environment that the mode "busy" calls

function MJEnv.build(::Type{Probe}, b; mode, flag, whole, real, pair, main)
    (flag, whole, real, pair) == (true, 3, 0.5, (1.0, 2.0)) || error("options $((flag, whole, real, pair))")
    b.sim.nq == 8 && b.sim.nbody == 3 && b.sim.qpos0[4] == 0.099 || error("the model is $(b.sim)")
    mode == "build" && error("no luck")
    mode == "name" && object_index(b, :site, "nose")
    mode == "array" && MJEnv.array(b, :nonsense)
    mode == "need" && MJEnv.need!(b, :nonsense)
    mode == "other" && return nothing
    mode == "unneeded" || MJEnv.need!(b, :contacts)
    MJEnv.need!(b, "geom_xpos")
    return Probe(
        mode,
        object_index(b, "site", "tip"),
        MJEnv.joint(b, "free"),
        MJEnv.sensor(b, "at"),
        MJEnv.array(b, "geom_friction"),
        MJEnv.array(b, "geom_bodyid"),
        main,
        MJEnv.keep!(b),
        MJEnv.keep!(b, 14),
        MJEnv.norm(b),
        Ref{Any}(KEPT[]),
    )
end

function MJEnv.reset!(task::Probe, start, rng)
    task.mode == "reset" && error("no start")
    @assert start.qpos == start.qpos0
    task.mode == "reset NaN" && (start.qpos[1] = NaN)
    task.mode == "range" && rand(rng, 1:0)
    task.mode == "draw" && MJEnv.uniform(rng, 0, Inf)
    drawn = [
        rand(rng), MJEnv.uniform(rng, -2, 3), randn(rng), rand(rng, -3:9), MJEnv.choice(rng, 5),
        MJEnv.choice(rng, [0.2, 0.3, 0.5]), MJEnv.sample(rng, 6, 3)..., MJEnv.permutation(rng, 4)..., rand(rng),
    ]
    start.carried[task.drawn] = drawn
    start.qvel[1] = start[task.bodies][2]
end

function MJEnv.observe(task::Probe, sim)
    task.mode == "observe" && sim.qpos[9]
    task.mode == "observe NaN" && return (x = NaN, count = 0.0)
    return (x = sim.qpos[1], count = sim.carried[task.count])
end

MJEnv.carry!(task::Probe, sim, carried) = task.mode == "carry" ? error("too heavy") : carried[task.count] += 1

function MJEnv.reset_info(task::Probe, sim)
    task.mode == "reset_info" && error("no info")
    return (drawn = view(sim.carried, task.drawn), velocity = sim.qvel[1])
end

function MJEnv.step!(task::Probe, sim, row)
    action, mode = sim.action[1], task.mode
    if action > 0.9  # in one row
        mode == "step" && error("it is\0 too strong")
        mode == "step NaN" && return (reward = NaN, terminated = false, info = wide_info(task, sim, row))
        mode == "names" && return (reward = 0.0, terminated = false, info = (other = 1,))
        mode == "length" && return (reward = 0.0, terminated = false, info = wide_info(task, sim, row; more = 1))
        mode == "outcome" && return 0.0
        mode == "terminated" && return (reward = 0.0, terminated = 1.0, info = wide_info(task, sim, row))
        mode == "reward" && return (reward = nothing, terminated = false, info = wide_info(task, sim, row))
        mode == "write" && (sim.qpos[1] = 0)
        mode == "property" && sim.qposs
        mode == "busy" && step!(OTHER[], fill(1.0, 1, 4))
        mode == "close" && close(OTHER[])
        mode == "collect" && GC.gc()
    end
    reward = MJEnv.typed(sim.time, MJEnv.MJENV_DTYPE_NATIVE_FLOAT)
    return (reward = reward, terminated = false, info = wide_info(task, sim, row))
end

function wide_info(task, sim, row; more = 0)
    contact = isempty(sim.contacts) ? nothing : sim.contacts[1]
    return (
        tip = sim.site_xpos[3, task.tip],
        ball = sim.qpos[task.free.qpos],
        place = sim.sensordata[task.place],
        friction = sim[task.friction],
        bodies = Tuple(Int.(sim[task.bodies])),
        box = sim.geom_xpos[:, 2],
        main = task.main,
        touching = contact !== nothing && (contact.geom1, contact.geom2) == (1, 3),
        force = contact === nothing ? 0.0 : contact.force[1],
        drawn = (x for x in 1:(3 + more)),
        norm = task.norm(0.1, 0.2, 0.3),
        random = rand(row.rng),
    )
end

MJEnv.register(
    "Probe-v0",
    Probe;
    model = PROBE_MODEL,
    options = (
        mode = "none",
        flag = true,
        whole = MJEnv.Setting(3, "a number"; low = 1, high = 4),
        real = 0.5,
        pair = (1, 2),
        main = MJEnv.Setting("cart"; object = :body),
    ),
    docs = (tip = "height of the tip, m",),
    time_limit = 400,
)

# Carries an index, which is at most this in environments that are built now.
const GREATEST = Ref(4)

struct Bounded <: MJEnv.Task
    target::Int
    places::UnitRange{Int}
end

MJEnv.build(::Type{Bounded}, b; options...) =
    Bounded(MJEnv.keep!(b; low = 0, high = GREATEST[]), MJEnv.keep!(b, 2; high = 9))

function MJEnv.reset!(task::Bounded, start, rng)
    start.carried[task.target] = 3
    start.carried[task.places] .= -1e300
end

MJEnv.observe(task::Bounded, sim) = (place = (0.5, 1.5, 2.5, 3.5, 4.5)[Int(sim.carried[task.target]) + 1],)
MJEnv.step!(task::Bounded, sim, row) = (reward = 0.0, terminated = false)
MJEnv.register("Bounded-v0", Bounded; model = PROBE_MODEL)

@testset "an image with a number out of bounds" begin
    wide = Env("Bounded-v0")
    @test reset!(wide).obs == [3.5]
    image = snapshot(wide)
    restore!(wide, image)
    GREATEST[] = 2
    narrow = Env("Bounded-v0")
    @test refuses(() -> restore!(narrow, image), MJENV_E_SNAPSHOT, "damaged")
    @test refuses(() -> reset!(narrow), MJENV_E_TASK, "reset: carried[0] is 3, not 0 to 2")
    GREATEST[] = -1
    @test refuses(() -> Env("Bounded-v0"), MJENV_E_VALUE, "does not contain 0")
    GREATEST[] = 4
end

# Shows its live parameters, and the number of steps, which resets keep.
struct Commanded <: MJEnv.Task
    speed::MJEnv.Live{0}
    gains::MJEnv.Live{1}
    steps::Int
    level::Int
end

MJEnv.build(::Type{Commanded}, b; speed, gains) =
    Commanded(speed, gains, MJEnv.keep!(b), MJEnv.keep!(b; low = 0, high = 9, resets = true))
MJEnv.reset!(task::Commanded, start, rng) = start.qvel[1] = start[task.speed]
MJEnv.observe(task::Commanded, sim) =
    (speed = sim[task.speed], gains = sim[task.gains], counts = (sim.carried[task.steps], sim.carried[task.level]))

function MJEnv.step!(task::Commanded, sim, row)
    row.carried[task.steps] += 1
    row.carried[task.level] += 1
    return (reward = sim[task.gains][2], terminated = false)
end

MJEnv.register(
    "Commanded-v0",
    Commanded;
    model = PROBE_MODEL,
    options = (
        speed = MJEnv.Setting(0.5, "the commanded speed, m/s"; low = -2, high = 2, live = true),
        gains = MJEnv.Setting((1, 2); live = true),
    ),
)

@testset "live parameters and kept numbers" begin
    env = Env("Commanded-v0")
    action = zeros(length(MJEnv.action_space(env).low))
    @test read(env, "parameters.gains") == [1, 2]
    write!(env, "parameters.speed", -1.5)
    @test reset!(env).obs == [-1.5, 1, 2, 0, 0]
    @test read(env, "qvel")[1] == -1.5
    write!(env, "parameters.gains", [3, 4])
    for steps in 1:3
        result = step!(env, action)
        @test result.obs == [-1.5, 3, 4, steps, steps]
        @test result.reward == 4
    end
    @test reset!(env).obs == [-1.5, 3, 4, 0, 3]
    @test refuses(() -> write!(env, "parameters.speed", 2.5), MJENV_E_VALUE, "parameters.speed", "[-2, 2]")
    @test refuses(() -> write!(env, "parameters.sped", 1), MJENV_E_NAME, "parameters.sped")
end

# Has groups of terms, and a term without one.
struct Grouped <: MJEnv.Task end

MJEnv.reset!(::Grouped, start, rng) = start.qvel[1] = randn(rng)
MJEnv.observe(::Grouped, sim) =
    (height = sim.qpos[3], speeds = sim.qvel[1:3], mass = sim.body_mass[2], clock = sim.time)
MJEnv.step!(::Grouped, sim, row) = (reward = 0, terminated = false)

MJEnv.register(
    "Grouped-v0",
    Grouped;
    model = PROBE_MODEL,
    groups = (policy = (:height, :speeds), critic = (:mass,)),
)

# The task tests/Goal-v0 in tests/tasks/groups.cpp written again.
struct Goals <: MJEnv.Task
    target::UnitRange{Int}
end
MJEnv.build(::Type{Goals}, b) = Goals(MJEnv.keep!(b, 2))
function MJEnv.reset!(task::Goals, start, rng)
    foreach(i -> start.qvel[i] = MJEnv.uniform(rng, -1, 1), 1:2)
    foreach(i -> start.carried[i] = MJEnv.uniform(rng, -1, 1), task.target)
end
MJEnv.observe(task::Goals, sim) =
    (achieved_goal = sim.qpos, desired_goal = sim.carried[task.target], observation = sim.qvel)
MJEnv.compute_reward(::Goals, achieved, desired) =
    desired[1] > 9 ? error("the goal is out of reach") :
    -abs(achieved[1] - desired[1]) - 2 * abs(achieved[2] - desired[2])
MJEnv.step!(task::Goals, sim, row) =
    (reward = MJEnv.compute_reward(task, sim.qpos, sim.carried[task.target]), terminated = false)

@testset "rewards of goals equal those in C++" begin
    MJEnv.load_tasks(joinpath(REPOSITORY, "build", "tests", "tasks", "libgroups.so"))
    MJEnv.register(
        "tests/JuliaGoal-v0",
        Goals;
        model = """
            <mujoco><worldbody><body><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><geom size=".1"/>
            </body></worldbody></mujoco>""",
        time_limit = 9,
    )
    envs = map(name -> Env("tests/$(name)Goal-v0"; rows = 3), ("Julia", ""))
    foreach(env -> seed!(env, 1), envs)
    foreach(reset!, envs)
    outputs = map(env -> step!(env, zeros(0, 3)), envs)
    @test outputs[1].obs == outputs[2].obs
    for env in envs
        achieved, desired = outputs[1].obs[1:2, :], outputs[1].obs[3:4, :]
        @test MJEnv.compute_reward(env, achieved, desired) == outputs[1].reward == outputs[2].reward
        @test MJEnv.compute_reward(env, [0.0, 1.0], [0.5, -1.0])[] == -4.5
        @test refuses(() -> MJEnv.compute_reward(env, [0.0, 1.0], [10.0, 0.0]), MJENV_E_TASK, "out of reach")
        @test refuses(() -> MJEnv.compute_reward(env, zeros(3), zeros(3)), MJENV_E_SIZE, "3, not 1 times 2")
    end
    @test refuses(() -> MJEnv.compute_reward(Env("Hopper-v5"), [0.0], [0.0]), MJENV_E_TASK, "has no compute_reward")
end

@testset "groups of terms" begin
    env = Env("Grouped-v0"; rows = 3)
    found = MJEnv.fields(env, :groups)
    @test [(field.name, field.range) for field in found] == [("policy", 1:4), ("critic", 5:5), ("clock", 6:6)]
    batch = reset!(Batch(env), env)
    groups = MJEnv.groups(batch)
    @test keys(groups) == (:policy, :critic, :clock)
    @test groups.policy == batch.obs[1:4, :]
    @test groups.policy[2, :] == [read(env, "qvel"; row)[1] for row in 1:3]
    @test groups.critic == [read(env, "body_mass"; row)[2] for _ in 1:1, row in 1:3]
    flat = Env("Grouped-v0"; observation = "flat")
    @test isempty(MJEnv.fields(flat, :groups)) && isempty(MJEnv.groups(Batch(flat)))
    MJEnv.register(
        "Grouped-v1",
        Grouped;
        model = PROBE_MODEL,
        groups = (critic = (:weight,),),
    )
    @test refuses(() -> Env("Grouped-v1"), MJENV_E_TASK, "groups has weight, which observe does not return")
end

# What NumPy 2.2.6 gives: draws of default_rng(7), as in reset!, and sums of 1/1 to 1/count and of their squares.
const DRAWN = [
    0x1.400c8353e3ca9p-1, 0x1.3e378257b5e00p+1, -0x1.18b7980d81558p-2, 7, 2, 2, 5, 6, 2, 1, 2, 3, 4,
    0x1.df2a571c79f0ep-2,
]
const SUMS = (
    (5, 0x1.2444444444444p+1, 0x1.76af37c048d16p+0),
    (20, 0x1.cc82bbab7a28bp+1, 0x1.989e2783af076p+0),
    (129, 0x1.5c37b09149ba9p+2, 0x1.a32054ff5d760p+0),
    (300, 0x1.92172a3e6965ap+2, 0x1.a4404f31f4130p+0),
)

@testset "what a task reads" begin
    env = Env("Probe-v0"; rows = 2, num_threads = 1)
    seed!(env, [7, 8])
    obs, told = reset!(env)
    @test told.drawn[:, 1] == DRAWN
    @test told.velocity == [1, 1]
    @test obs == [0 0; 1 1]
    obs, reward, terminated, truncated, told = step!(env, Float32[0.1 0.2])
    @test reward == [0.01, 0.01]
    @test obs[2, :] == [2, 2]
    @test told.tip ≈ [1.2, 1.2]
    @test told.ball == [1, 1]
    @test told.place == [1 1; 0 0; 0.099 0.099]
    @test told.friction[:, :, 1] == read(env, :geom_friction)
    @test told.bodies == [0 0; 1 1; 2 2]
    @test told.box[3, :] == [1, 1]
    @test told.main == [2, 2] && eltype(told.main) == Int64
    @test told.touching == [1, 1]
    for _ in 1:300
        told = step!(env, [0.0 0.0]).info
    end
    mass = read(env, :body_mass)[3]
    @test all(abs.(told.force .- 9.81 * mass) .< 1e-3 * mass)
    @test only(f.doc for f in fields(env, :info) if f.name == "tip") == "height of the tip, m"
    @test [f.dtype for f in fields(env, :reward)] == [MJEnv.MJENV_DTYPE_NATIVE_FLOAT]
    Env("Probe-v0"; main = "ball") do other
        seed!(other, 0)
        reset!(other)
        @test step!(other, [0.0]).info.main == 3
        @test step!(other, [0.0]).reward isa Float64
    end
    @test Env(other -> (reset!(other); step!(other, [0.0]).info.main), "Probe-v0"; main = 1) == 2
    @test refuses(() -> Env("Probe-v0"; whole = 5), MJENV_E_VALUE, "whole")
    @test refuses(() -> Env("Probe-v0"; main = "tail"), MJENV_E_MODEL, "tail")
end

# The norms of NumPy in random.txt, of numbers that the line gives, or of so many that the rule gives.
@testset "norms of any length" begin
    few = many = unlike = 0
    for words in split.(filter(startswith("norm "), readlines(joinpath(GOLDEN, "random.txt"))))
        if words[3] == "first"
            many += 1
            numbers = [((7919 * i + 13) % 1009) / 17.0 - 30.0 for i in 0:(parse(Int, words[4]) - 1)]
        else
            few += 1
            numbers = real_of.(words[3:(end - 1)])
            @test MJEnv.Norm(words[2] == "fused")(numbers...) == real_of(words[end])
        end
        @test MJEnv.Norm(words[2] == "fused")(numbers) == real_of(words[end])
        unlike += MJEnv.Norm(words[2] != "fused")(numbers) != real_of(words[end])
    end
    @test (few, many) == (400, 2 * 205)
    @test unlike > 20
    values = rand(100)
    @test allocated(MJEnv.Norm(true), values) <= 16
    @test allocated(MJEnv.Norm(false), values) <= 16
end

@testset "sums and norms as NumPy's" begin
    values = [1 / i for i in 1:300]
    for (count, total, squares) in SUMS
        @test MJEnv.numpy_sum(values[1:count]) == total
        @test MJEnv.sum_square(values[1:count]) == squares
    end
    @test MJEnv.Norm(false)(0.1, 0.2, 0.3) == sqrt(0.1^2 + 0.2^2 + 0.3^2)
    @test MJEnv.Norm(true)((3, 4)) == 5
    @test MJEnv.Norm(false)([3.0f0, 4]) == MJEnv.Norm(false)(view([0, 3, 4], 2:3)) == 5
    @test MJEnv.Norm(true)(Float64[]) == 0
    ctrl = 0.1 * MJEnv.Scalar(Float32(0.7), true)
    @test (ctrl.narrow, Float64(-ctrl)) == (true, -Float64(0.1f0 * 0.7f0))
end

@testset "environments that are not built: $mode" for (mode, status, words) in (
    ("build", MJENV_E_TASK, ("Probe-v0: build: no luck",)),
    ("name", MJENV_E_MODEL, ("build", "nose", "tip")),
    ("array", MJENV_E_NAME, ("build", "nonsense")),
    ("need", MJENV_E_NAME, ("build", "nonsense")),
    ("other", MJENV_E_TASK, ("build returned a Nothing, not a Probe",)),
    ("unneeded", MJENV_E_TASK, ("first call of step!", "call MJEnv.need!(b, :contacts) in build")),
    ("observe", MJENV_E_TASK, ("first call of observe", "BoundsError")),
    ("carry", MJENV_E_TASK, ("first call of carry!", "too heavy")),
    ("reset_info", MJENV_E_TASK, ("first call of reset_info", "no info")),
)
    @test refuses(() -> Env("Probe-v0"; mode = mode), status, words...)
end

@testset "calls that fail: $mode" for (mode, words) in (
    ("step", ("row 2: Probe-v0: step: it is\\0 too strong",)),
    ("step NaN", ("row 2", "step", "the reward is NaN")),
    ("names", ("it returned the names (:other,)", "in the first call")),
    ("length", ("drawn has 4 number(s), but it had 3",)),
    ("outcome", ("it returned a Float64, not (reward = ..., terminated = ..., info = ...)",)),
    ("terminated", ("terminated is a Float64, not a Bool",)),
    ("reward", ("reward is a Nothing, not a number",)),
    ("write", ("a task can only read this array",)),
    ("property", ("sim has no qposs; it has nq",)),
    ("busy", ("MJENV_E_BUSY",)),
    ("close", ("MJENV_E_BUSY",)),
)
    env = Env("Probe-v0"; rows = 4, mode = mode)
    seed!(env, 1)
    reset!(env)
    OTHER[] = env
    image = snapshot(env; rows = :)
    before = observe(env)
    batch = Batch(env)
    @test refuses(() -> step!(batch, env, [0.0 0.0 1.0 0.0]), MJENV_E_TASK, words...)
    @test batch.status == [MJENV_OK, MJENV_OK, MJENV_E_TASK, MJENV_OK]
    @test observe(env)[:, 3] == before[:, 3]
    @test observe(env)[2, [1, 2, 4]] == [2, 2, 2]  # the others were stepped
    @test step!(env, [0.0 0.0 0.0 0.0]).reward == [0.02, 0.02, 0.01, 0.02]
    send!(env, [0.0 0.0 1.0 0.0])
    @test refuses(() -> recv!(zeros(Int64, 4), batch, env; least = 4), MJENV_E_TASK, words...)
    restore!(env, image; rows = :)
    @test observe(env) == before
    OTHER[] = nothing
    close(env)
end

@testset "resets that fail: $mode" for (mode, words) in (
    ("reset", ("row 0: Probe-v0: reset: no start",)),
    ("reset NaN", ("reset: qpos[0] is nan",)),
    ("range", ("the range 1:0 is empty",)),
    ("draw", ("uniform: high - low is not finite",)),
    ("observe NaN", ("observation[0] is NaN",)),
)
    env = Env("Probe-v0"; rows = 2, mode = mode)
    @test refuses(() -> reset!(env), MJENV_E_TASK, words...)
end

@testset "garbage" begin
    # Tasks live as long as their environments, and no longer.
    freed = Ref(0)
    function drop(count)
        for _ in 1:count
            KEPT[] = finalizer(_ -> freed[] += 1, Ref(1))
            env = Env("Probe-v0"; mode = "collect")
            KEPT[] = nothing
            GC.gc()
            reset!(env)
            step!(env, [1.0])
            close(env)
        end
    end
    drop(10)
    GC.gc()
    @test freed[] >= 9  # the stack may hold the last one
    held = length(MJEnv.SLOTS)
    drop(10)
    @test length(MJEnv.SLOTS) == held
    # Without close, the garbage collector destroys environments, also in a callback.
    foreach(_ -> reset!(Env("Probe-v0"; rows = 2)), 1:20)
    env = Env("Probe-v0"; rows = 2, mode = "collect")
    reset!(env)
    @test step!(env, [1.0 1.0]).reward == [0.01, 0.01]
end

# ---- Registration ----

struct Plain <: MJEnv.Task end
MJEnv.reset!(::Plain, start, rng) = nothing
MJEnv.observe(::Plain, sim) = (qpos = sim.qpos,)
MJEnv.step!(::Plain, sim, row) = (reward = 1, terminated = false)

struct Stepless <: MJEnv.Task end
MJEnv.reset!(::Stepless, start, rng) = nothing
MJEnv.observe(::Stepless, sim) = (qpos = sim.qpos,)

struct Plane <: MJEnv.Task end
MJEnv.reset!(::Plane, start, rng) = nothing
MJEnv.observe(::Plane, sim) = (xpos = sim.xpos,)
MJEnv.step!(::Plane, sim, row) = (reward = 0.0, terminated = false)

struct Parametric{T} <: MJEnv.Task end

@testset "registration" begin
    register(id, T = Plain; model = "hopper.xml", options...) = MJEnv.register(id, T; model = model, options...)
    @test register("Plain-v0") === nothing
    @test "Plain-v0" in MJEnv.ids()
    Env("Plain-v0"; rows = 3) do env
        seed!(env, 1)
        reset!(env)
        @test step!(env, zeros(3, 3)).reward == [1, 1, 1]
        @test isempty(info(env))
    end
    kept = length(MJEnv.REGISTRATIONS)
    @test refuses(() -> register("Plain-v0"), MJENV_E_VALUE, "Plain-v0", "already registered")
    @test refuses(() -> register("Hopper-v5"), MJENV_E_VALUE, "Hopper-v5", "built-in")
    @test refuses(() -> register("bad id"), MJENV_E_VALUE, "bad id")
    @test refuses(() -> register("New-v0\0"), ArgumentError, "NUL")
    @test refuses(() -> register("New-v0"; frame_skip = 0), MJENV_E_VALUE, "frame_skip is 0")
    @test refuses(() -> register("New-v0"; time_limit = -1), MJENV_E_VALUE, "time_limit")
    @test refuses(() -> register("New-v0"; model = ""), MJENV_E_VALUE, "model is empty")
    @test refuses(() -> register("New-v0"; options = (x = nothing,)), ArgumentError, "\"x\"", "Nothing")
    @test refuses(() -> register("New-v0"; options = (strict = true,)), MJENV_E_VALUE, "strict")
    @test refuses(
        () -> register("New-v0"; options = (x = MJEnv.Setting(2.0; low = 3, high = 4),)),
        MJENV_E_VALUE,
        "\"x\"",
        "2",
    )
    @test refuses(
        () -> register("New-v0"; options = (x = MJEnv.Setting("c"; choices = ["a", "b"]),)),
        MJENV_E_VALUE,
        "\"x\"",
        "choices",
    )
    @test refuses(() -> register("New-v0"; camera = (zoom = 2,)), MethodError, "zoom")
    @test refuses(() -> register("New-v0", Stepless), ArgumentError, "MJEnv.step!(task::Stepless, sim, row)")
    @test refuses(() -> register("New-v0", Parametric), ArgumentError, "Parametric", "concrete")
    @test length(MJEnv.REGISTRATIONS) == kept
    @test !("New-v0" in MJEnv.ids())
    register("Unknown-v0"; model = "bee.xml")
    @test refuses(() -> Env("Unknown-v0"), MJENV_E_FILE, "bee.xml")
    register("Plane-v0", Plane)
    @test refuses(() -> Env("Plane-v0"), MJENV_E_VALUE, "an observation's terms are vectors")
    # A file of one's own.
    mktempdir() do folder
        path = joinpath(folder, "probe.xml")
        write(path, PROBE_MODEL)
        register("Filed-v0"; model = path)
        cd(() -> register("Near-v0"; model = "./probe.xml"), folder)
        @test all(id -> Env(env -> length(observation_space(env).low), id) == 8, ("Filed-v0", "Near-v0"))
    end
end

# Shows where a falling ball is, according to qpos and to mjData's positions of bodies.
struct Falls <: MJEnv.Task end
function MJEnv.build(::Type{Falls}, b; current)
    current && MJEnv.current!(b)
    return Falls()
end
MJEnv.reset!(::Falls, start, rng) = (start.qpos[3] = MJEnv.uniform(rng, 2, 3); nothing)
MJEnv.observe(::Falls, sim) = (height = (sim.qpos[3], sim.xpos[3, 2]),)
MJEnv.step!(::Falls, sim, row) = (reward = 0.0, terminated = false)

@testset "the new state" begin
    ball = "<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"
    MJEnv.register("Falls-v0", Falls; model = ball, options = (current = true,))
    for current in (false, true)
        env = Env("Falls-v0"; rows = 4, current = current)
        reset!(env)
        for _ in 1:5
            obs = step!(env, zeros(0, 4)).obs
            @test all((obs[1, :] .== obs[2, :]) .== current)
        end
    end
end

# Its reset lets the ball fall until it touches the floor, begins again 5 cm above, and moves a marker.
struct Falling <: MJEnv.Task
    place::MJEnv.Own
    places::MJEnv.NamedArray{Float64,2}
    touched::Int
    most::Int
end
function MJEnv.build(::Type{Falling}, b; most)
    MJEnv.current!(b)
    MJEnv.random_state!(b)
    return Falling(MJEnv.own!(b, :geom_pos), MJEnv.array(b, :geom_pos), MJEnv.keep!(b), most)
end
function MJEnv.reset!(task::Falling, start, rng)
    start[task.place][4] = MJEnv.state_uniform(rng, 0, 1)
    start[task.place][5] += 1  # counts the resets
    MJEnv.forward!(start)
    for _ in 1:(task.most)
        MJEnv.contact_count(start) > 0 && break
        MJEnv.advance!(start, 1)
    end
    MJEnv.contact_count(start) > 0 || error("the ball never touches the floor")
    touched = start.sim.xpos[3, 2]
    MJEnv.restart!(start)
    start.qpos[1] == 0 || error("it has not begun again")
    start.qpos[1] = touched - 1 + 0.05
    MJEnv.set_time!(start, 0.5)
    start.carried[task.touched] = touched
end
MJEnv.observe(task::Falling, sim) = (
    marker = sim[task.places][:, 2],
    ball = (sim.qpos[1], sim.xpos[3, 2], sim.time),
    touched = sim.carried[task.touched],
)
MJEnv.step!(::Falling, sim, row) = (reward = 0.0, terminated = false)

@testset "a reset that simulates" begin
    model = """
        <mujoco><option timestep="0.01"/><worldbody><geom name="floor" type="plane" size="5 5 .1"/>
        <geom name="marker" pos="0 0 2" size=".1" contype="0" conaffinity="0"/>
        <body name="ball" pos="0 0 1"><joint name="z" type="slide" axis="0 0 1"/><geom size=".1"/></body>
        </worldbody></mujoco>"""
    MJEnv.register("Falling-v0", Falling; model = model, options = (most = 100,))
    env = Env("Falling-v0"; rows = 3)
    seed!(env, [1, 2, 3])
    obs = reset!(env).obs
    # numpy.random.RandomState(seed).uniform(0, 1)
    @test obs[1, :] == [0.417022004702574, 0.43599490214200376, 0.5507979025745755]
    @test all(obs[2, :] .== 1) && all(obs[3, :] .== 2)
    touched = obs[7, :]
    @test all(0.05 .< touched .< 0.1)
    @test obs[4, :] == touched .- 1 .+ 0.05
    @test obs[5, :] == 1 .+ obs[4, :]
    @test all(obs[6, :] .== 0.5)
    @test all(reset!(env).obs[2, :] .== 2)
    @test refuses(() -> reset!(Env("Falling-v0"; most = 1)), MJENV_E_TASK, "never touches the floor")
end

# tests/tasks/follow.cpp written again.
struct Follow <: MJEnv.Task
    kp::Float64
    kd::Float64
    limit::Float64
    trunk::Int
    marker::Int
    joints::NTuple{2,NamedTuple{(:index, :qpos, :qvel),NTuple{3,Int}}}
    home::MJEnv.NamedArray{Float64,2}
    forces::MJEnv.NamedArray{Float64,2}
    places::MJEnv.NamedArray{Float64,2}
    target::UnitRange{Int}
    torque::UnitRange{Int}
    gust::MJEnv.Own
    place::Union{Nothing,MJEnv.Own}
end

function MJEnv.build(::Type{Follow}, b; kp, kd, limit, current)
    MJEnv.action!(b, ((-1, 1), (-1, 1)))
    current && MJEnv.current!(b)
    current && MJEnv.need!(b, :geom_xpos)
    return Follow(
        kp, kd, limit,
        object_index(b, :body, "trunk"),
        object_index(b, :geom, "marker"),
        (MJEnv.joint(b, "hip"), MJEnv.joint(b, "knee")),
        MJEnv.array(b, :key_qpos), MJEnv.array(b, :xfrc_applied), MJEnv.array(b, :geom_pos),
        MJEnv.keep!(b, 2), MJEnv.keep!(b, 2),
        MJEnv.own!(b, :xfrc_applied),
        current ? MJEnv.own!(b, :geom_pos) : nothing,
    )
end

function MJEnv.reset!(task::Follow, start, rng)
    for i in 1:9
        start.qpos[i] = start[task.home][i, 1] + MJEnv.uniform(rng, -0.05, 0.05)
    end
end

function MJEnv.before_step!(task::Follow, sim, row, control)
    for i in 1:2
        wanted = sim[task.home][task.joints[i].qpos, 1] + 0.5 * clamp(sim.action[i], -0.8, 0.8)
        row.carried[task.target[i]] += 0.4 * (wanted - row.carried[task.target[i]])
    end
    control[task.gust][6 * (task.trunk - 1) + 1] = MJEnv.uniform(row.rng, -20, 20)
end

function MJEnv.before_substep!(task::Follow, sim, row, control)
    control.substep == 4 && sim.qpos[3] > task.limit && error("the trunk flies")
    control[task.gust][6 * (task.trunk - 1) + 3] = control.substep - 1
    for (i, joint) in enumerate(task.joints)
        control.ctrl[i] = row.carried[task.torque[i]]
        row.carried[task.torque[i]] =
            task.kp * (row.carried[task.target[i]] - sim.qpos[joint.qpos]) - task.kd * sim.qvel[joint.qvel]
    end
end

function MJEnv.observe(task::Follow, sim)
    seen = (
        qpos = sim.qpos, qvel = sim.qvel, ctrl = sim.ctrl, target = sim.carried[task.target],
        sites = sim.xpos[:, task.trunk], gust = sim[task.forces][:, task.trunk],
    )
    task.place === nothing && return seen
    return (; seen..., marker = [sim[task.places][:, task.marker]; sim.geom_xpos[:, task.marker]])
end

function MJEnv.step!(task::Follow, sim, row)
    task.place === nothing || (row[task.place][3 * (task.marker - 1) + 1] += 0.25)
    row.qvel[2] += 0.1 * sim.action[1]
    return (reward = sim.action[1] + sim.action[2], terminated = false, info = (speed = sim.qvel[1],))
end

@testset "maps of actions and own arrays equal those in C++" begin
    MJEnv.load_tasks(joinpath(REPOSITORY, "build", "tests", "tasks", "libfollow.so"))
    MJEnv.register(
        "tests/JuliaFollow-v0",
        Follow;
        model = joinpath(REPOSITORY, "tests", "tasks", "follow.xml"),
        frame_skip = 4,
        time_limit = 50,
        options = (kp = 30.0, kd = 1.0, limit = 40.0, current = false),
    )
    for current in (false, true)
        envs = map(name -> Env("tests/$(name)Follow-v0"; rows = 4, current = current), ("Julia", ""))
        foreach(env -> seed!(env, 3), envs)
        @test ==(map(env -> reset!(env).obs, envs)...)
        for step in 1:40
            action = [mod(7 * step + 3 * i, 11) / 5 - 1 for i in 1:2, _ in 1:4]
            outputs = map(env -> step!(env, action), envs)
            @test outputs[1].obs == outputs[2].obs
            @test outputs[1].reward == outputs[2].reward
        end
    end
    env = Env("tests/JuliaFollow-v0"; limit = 0.0)
    reset!(env)
    @test refuses(() -> step!(env, [0.0, 0.0]), MJENV_E_TASK, "before_substep", "the trunk flies")
end

# tests/tasks/terrain.cpp written again.
struct Rolling <: MJEnv.Task
    heights::MJEnv.Own
    colours::MJEnv.Own
    field::MJEnv.NamedArray{Float32,1}
    rgba::MJEnv.NamedArray{Float32,2}
    ball::Int
    balls::Tuple{Int}
    ground_geom::Int
    ground::MJEnv.Terrain
    touched::Int
    air::UnitRange{Int}
end

const AROUND = ((0.3, 0.1), (-0.2, 0.4), (9.0, -7.0))

function MJEnv.build(::Type{Rolling}, b; ground)
    MJEnv.current!(b)
    MJEnv.random_state!(b)
    MJEnv.need!(b, :contacts)
    return Rolling(
        MJEnv.own!(b, :hfield_data), MJEnv.own!(b, :geom_rgba),
        MJEnv.array(b, :hfield_data), MJEnv.array(b, :geom_rgba),
        object_index(b, :body, "ball"), (object_index(b, :geom, "ball"),), object_index(b, :geom, "ground"),
        MJEnv.terrain(b, ground), MJEnv.keep!(b), MJEnv.keep!(b, 1),
    )
end

function MJEnv.reset!(task::Rolling, start, rng)
    start[task.heights] .= (MJEnv.state_permutation(rng, 30) .- 1) ./ 30
    MJEnv.state_shuffle!(rng, view(start[task.heights], 1:7))
    start[task.colours][1] = (MJEnv.state_choice(rng, 5) - 1) / 10
    start[task.colours][5] += 0.01  # counts the resets
    start.qpos[1] = MJEnv.state_uniform(rng, -1, 1)
    MJEnv.forward!(start)
    for _ in 1:200
        MJEnv.contact_count(start) > 0 && break
        MJEnv.advance!(start, 1)
    end
    x, y, z = start.sim.xpos[:, task.ball]
    start.carried[task.touched] = z - MJEnv.height(task.ground, start, x, y)
    MJEnv.set_time!(start, 0)
end

MJEnv.observe(task::Rolling, sim) = (
    qpos = sim.qpos, qvel = sim.qvel,
    field = Float64.(sim[task.field]), rgba = Float64.(vec(sim[task.rgba])),
    touched = sim.carried[task.touched],
    touching = Float64.(MJEnv.touching(sim, task.balls, task.ground_geom)),
    air = view(sim.carried, task.air),
    below = MJEnv.height(task.ground, sim, sim.xpos[1, task.ball], sim.xpos[2, task.ball]),
    around = MJEnv.around(task.ground, sim, task.ball, AROUND),
)

function MJEnv.step!(task::Rolling, sim, row)
    at = rand(row.rng, 0:29)
    row[task.heights][at + 1] = rand(row.rng)
    touching = MJEnv.touching(sim, task.balls, task.ground_geom)
    flight = only(MJEnv.air_time!(view(row.carried, task.air), touching, sim.dt))
    return (reward = sim.qpos[1], terminated = false, info = (height = sim.qpos[3], flight = flight))
end

@testset "own terrains equal those in C++" begin
    MJEnv.load_tasks(joinpath(REPOSITORY, "build", "tests", "tasks", "libterrain.so"))
    MJEnv.register(
        "tests/JuliaTerrain-v0",
        Rolling;
        model = joinpath(REPOSITORY, "tests", "tasks", "terrain.xml"),
        frame_skip = 4,
        time_limit = 25,
        options = (ground = "ground",),
    )
    envs = map(name -> Env("tests/$(name)Terrain-v0"; rows = 4), ("Julia", ""))
    foreach(env -> seed!(env, 3), envs)
    @test ==(map(env -> reset!(env).obs, envs)...)
    landed = false
    for step in 1:24
        action = [mod(7 * step + 3 * i, 11) / 5 - 1 for i in 1:2, _ in 1:4]
        outputs = map(env -> step!(env, action), envs)
        @test outputs[1].obs == outputs[2].obs
        @test outputs[1].reward == outputs[2].reward
        @test outputs[1].info.flight == outputs[2].info.flight
        landed |= any(outputs[1].info.flight .> 0)
    end
    @test landed
    @test refuses(() -> Env("tests/JuliaTerrain-v0"; ground = "ball"), MJENV_E_TASK, "geom \"ball\" is no height field")
end

@testset "plug-ins" begin
    folder = joinpath(REPOSITORY, "build", "tests", "tasks")
    @test MJEnv.load_tasks(joinpath(folder, "libhopper_c.so")) === nothing
    @test MJEnv.load_tasks(joinpath(folder, "libhopper_c.so")) === nothing
    MJEnv.load_tasks(joinpath(folder, "libtyped.so"))
    @test ["OwnHopper-v5", "Typed-v7"] ⊆ MJEnv.ids()
    envs = map(id -> Env(id; rows = 3, num_threads = 2), ("OwnHopper-v5", "Hopper-v5"))
    foreach(env -> seed!(env, 1), envs)
    @test reset!(envs[1]).obs == reset!(envs[2]).obs
    Env("Typed-v7") do env
        seed!(env, 1)
        reset!(env)
        told = step!(env, [0.0]).info
        @test (told.float64, told.native_int, told.int32, told.uint8) === (200.0, 200, Int32(200), 0xc8)
        @test told.uint8s == UInt8[1 2]' && told.float32s isa Matrix{Float32}
    end
    for (name, status, words) in (
        ("no_entry", MJENV_E_TASK, ("MJENV_PLUGIN",)),
        ("other_abi", MJENV_E_TASK, ("999",)),
        ("no_tasks", MJENV_E_TASK, ("it contains no task",)),
        ("refuses", MJENV_E_TASK, ("it lacks the licence",)),
        ("says_nothing", MJENV_E_TASK, ("gave no reason",)),
        ("twice", MJENV_E_VALUE, ("already registered",)),
        ("absent", MJENV_E_TASK, ("No such file",)),
    )
        @test refuses(() -> MJEnv.load_tasks(joinpath(folder, "lib$name.so")), status, "lib$name.so", words...)
    end
    @test refuses(() -> MJEnv.load_tasks("a\0b"), ArgumentError, "NUL")
    listed = joinpath(folder, "libhopper_cpp.so") * ":/nowhere/x.so"
    @test spoken("""
        try
            MJEnv.load_tasks()
        catch reason
            print("CppHopper-v5" in MJEnv.ids(), occursin("/nowhere/x.so", reason.message))
        end
        """; variables = ("MJENV_TASKS" => listed,)) == "truetrue"
end

# Methods that a task can lack: defined after the registration, under an option, or with other arguments.
struct Optional <: MJEnv.Task
    maps::Bool
end

Optional(; maps) = Optional(maps)
MJEnv.reset!(::Optional, start, rng) = nothing
MJEnv.observe(::Optional, sim) = (x = sim.qpos,)
MJEnv.step!(::Optional, sim, row) = (reward = sim.ctrl[1], terminated = false)

@testset "methods under options" begin
    model = """<mujoco><worldbody><body><joint name="x" type="slide" axis="1 0 0"/><geom size=".1"/></body></worldbody>
        <actuator><motor joint="x" ctrllimited="true" ctrlrange="-9 9"/></actuator></mujoco>"""
    MJEnv.register("tests/JuliaOptional-v0", Optional; model, options = (maps = false,))
    @eval MJEnv.before_step!(task::Optional, sim, row, control) = control.ctrl[1] = task.maps ? 3 : sim.action[1]
    for maps in (false, true)
        env = Env("tests/JuliaOptional-v0"; maps)
        reset!(env)
        @test step!(env, [1.0]).reward == (maps ? 3 : 1)
        close(env)
    end
    @eval MJEnv.before_substep!(task::Optional, sim, control) = nothing
    @test refuses(() -> Env("tests/JuliaOptional-v0"), MJEnv.MJENV_E_TASK, "MJEnv.before_substep! takes the arguments")
end
