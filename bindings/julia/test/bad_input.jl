# Tests everything that a caller can get wrong. The error names the wrong argument, the outputs keep their values, and
# the environment stays usable.

@testset "ids and options" begin
    @test refuses(() -> Env("Ant-v6"), MJENV_E_NAME, "Ant-v6", "nearest: Ant-v4, Ant-v5; mjenv_id_at lists all")
    @test refuses(() -> Env(""), MJENV_E_NAME, "\"\"")
    @test refuses(() -> spec("Ant"), MJENV_E_NAME, "Ant")
    @test refuses(() -> options("Ant"), MJENV_E_NAME, "Ant")
    @test refuses(() -> MJEnv.schema("Ant"), MJENV_E_NAME, "Ant")
    @test refuses(() -> Env("Ant-v5\0"), ArgumentError, "NUL")
    @test refuses(() -> Env("Ant-v5"; colour = 1), MJENV_E_NAME, "colour", "mjenv_options_at lists all")
    @test refuses(() -> Env("Ant-v4"; main_body = 1), MJENV_E_NAME, "main_body", "mjenv_options_at lists all")
    @test refuses(() -> Env("Ant-v5"; terminate_when_unhealthy = ""), MJENV_E_TYPE, "terminate_when_unhealthy", "flag")
    @test refuses(() -> Env("Ant-v5"; terminate_when_unhealthy = 2), MJENV_E_VALUE, "terminate_when_unhealthy", "1")
    @test refuses(() -> Env("Ant-v5"; terminate_when_unhealthy = 1.0), MJENV_E_TYPE, "terminate_when_unhealthy")
    @test refuses(() -> Env("Ant-v5"; ctrl_cost_weight = :high), MJENV_E_TYPE, "ctrl_cost_weight", "real numbers")
    @test refuses(() -> Env("Ant-v5"; ctrl_cost_weight = NaN), MJENV_E_VALUE, "ctrl_cost_weight", "nan")
    @test refuses(() -> Env("Ant-v5"; ctrl_cost_weight = (1, 2)), MJENV_E_SIZE, "ctrl_cost_weight", "1 number")
    @test refuses(() -> Env("Ant-v5"; healthy_z_range = (1,)), MJENV_E_SIZE, "healthy_z_range", "2 number")
    @test refuses(() -> Env("Ant-v5"; healthy_z_range = ()), MJENV_E_SIZE, "healthy_z_range", "2 number")
    @test refuses(() -> Env("Ant-v5"; healthy_z_range = 1), MJENV_E_TYPE, "healthy_z_range")
    @test refuses(() -> Env("Ant-v5"; frame_skip = 0), MJENV_E_VALUE, "frame_skip", "1")
    @test refuses(() -> Env("Ant-v5"; frame_skip = 5.0), MJENV_E_TYPE, "frame_skip", "integer")
    @test refuses(() -> Env("Ant-v5"; frame_skip = big(2)^70), ArgumentError, "frame_skip", "64 bits")
    @test refuses(() -> Env("Ant-v5"; max_episode_steps = -1), MJENV_E_VALUE, "max_episode_steps")
    @test refuses(() -> Env("Ant-v5"; reset_noise_scale = -0.1), MJENV_E_VALUE, "reset_noise_scale")
    @test refuses(() -> Env("Ant-v5"; norm = "exact"), MJENV_E_VALUE, "norm", "exact", "fused")
    @test refuses(() -> Env("Ant-v5"; xml_file = nothing), ArgumentError, "xml_file", "Nothing")
    @test refuses(() -> Env("Ant-v5"; healthy_z_range = ("low", "high")), ArgumentError, "healthy_z_range")
    @test refuses(() -> Env("Ant-v5"; xml_string = "a\0b"), ArgumentError, "NUL")
    @test refuses(() -> Env("Ant-v5"; num_threads = -1), MJENV_E_VALUE, "num_threads", "-1")
    @test refuses(() -> Env("Ant-v5"; num_threads = 1025), MJENV_E_VALUE, "num_threads", "1024")
    @test refuses(() -> Env("Ant-v5"; rows = 0), MJENV_E_VALUE, "rows", "0")
    @test refuses(() -> Env("Ant-v5"; rows = -3), MJENV_E_VALUE, "rows", "-3")
    @test refuses(() -> Env("Ant-v5"; rows = typemax(Int)), MJENV_E_MEMORY, "rows")
    @test refuses(() -> Env("Ant-v5"; rows = big(2)^64), InexactError)
end

@testset "models" begin
    @test refuses(() -> Env("Ant-v5"; xml_file = "/nowhere/ant.xml"), MJENV_E_FILE, "/nowhere/ant.xml")
    @test refuses(() -> Env("Ant-v5"; xml_file = "bee.xml"), MJENV_E_FILE, "bee.xml", "ant.xml")
    @test refuses(() -> Env("Ant-v5"; xml_file = ""), MJENV_E_VALUE, "xml_file")
    @test refuses(() -> Env("Ant-v5"; xml_string = "<mujoco>"), MJENV_E_MODEL, "xml_string")
    @test refuses(() -> Env("Ant-v5"; xml_string = "<mujoco><bee/></mujoco>"), MJENV_E_MODEL, "bee")
    @test refuses(() -> Env("Pusher-v5"; xml_file = "ant.xml"), MJENV_E_MODEL, "ant.xml", "Pusher-v5")
    @test refuses(() -> Env("Ant-v5"; main_body = "tail"), MJENV_E_MODEL, "tail", "torso")
    @test refuses(() -> Env("Ant-v5"; main_body = 99), MJENV_E_MODEL, "main_body", "99", "14")
    mktempdir() do folder
        path = joinpath(folder, "broken.xml")
        write(path, "<mujoco><worldbody><body><geom size='-1'/></body></worldbody></mujoco>")
        @test refuses(() -> Env("Ant-v5"; xml_file = path), MJENV_E_MODEL, path)
        hinge = "<mujoco><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>"
        write(joinpath(folder, "above.xml"), hinge)
        below = joinpath(mkdir(joinpath(folder, "below")), "model.xml")
        write(below, "<mujoco><include file='../above.xml'/></mujoco>")
        @test Env("Model-v0"; xml_file = below) isa Env
        @test refuses(() -> Env("Model-v0"; xml_file = below, trust_xml = "no"), MJENV_E_MODEL, "outside", "trust_xml")
        never = () -> Env("Model-v0"; xml_file = below, trust_xml = "never")
        @test refuses(never, MJENV_E_VALUE, "trust_xml", "auto, yes, no")
        write(path, rand(UInt8, 1000))
        @test refuses(() -> Env("Ant-v5"; xml_file = path), MJENV_E_MODEL, path)
    end
end

# With two rows, every array can have a wrong size.
function bad_calls(env, batch, action)
    wrong(change!) = (other = deepcopy(batch); change!(other); () -> step!(other, env, action))
    with_nan = copy(action)
    with_nan[2, 1] = NaN
    with_infinity = copy(action)
    with_infinity[1, 2] = -Inf
    nq, nv = Int(read(env, :nq)), Int(read(env, :nv))
    image = snapshot(env)
    damaged = copy(image)
    damaged[end - 3] ⊻= 0x10
    foreign = Env(snapshot, "Reacher-v5")
    otherwise = Env(snapshot, env.id; healthy_reward = 7)
    nu = size(action, 1)
    return [
        (() -> step!(batch, env, with_nan), (MJENV_E_VALUE, "row 0", "action[1]", "nan", "strict")),
        (() -> step!(batch, env, with_infinity), (MJENV_E_VALUE, "row 1", "action[0]", "-inf")),
        (() -> step!(env, Float64.(with_nan)), (MJENV_E_VALUE, "row 0", "action[1]")),
        (() -> step!(batch, env, action[:, 1]), (DimensionMismatch, "action", "$(nu)×2", "($nu,)")),
        (() -> step!(batch, env, action[1:(end - 1), :]), (DimensionMismatch, "action", "$(nu)×2")),
        (() -> step!(batch, env, permutedims(action)), (DimensionMismatch, "action", "$(nu)×2", "(2, $nu)")),
        (() -> step!(env, vec(action)), (DimensionMismatch, "action", "$(nu)×2")),
        (() -> step!(env, Float32[]), (DimensionMismatch, "action")),
        (() -> step!(env, complex.(action)), (MethodError,)),
        (() -> step!(env, nothing), (MethodError,)),
        (wrong(b -> b.obs = b.obs[1:(end - 1), :]), (DimensionMismatch, "obs")),
        (wrong(b -> b.obs = b.obs[:, 1:1]), (DimensionMismatch, "obs")),
        (wrong(b -> resize!(b.reward, 1)), (DimensionMismatch, "reward", "(1,)", "(2,)")),
        (wrong(b -> resize!(b.terminated, 0)), (DimensionMismatch, "terminated")),
        (wrong(b -> resize!(b.truncated, 3)), (DimensionMismatch, "truncated")),
        (wrong(b -> resize!(b.status, 1)), (DimensionMismatch, "status")),
        (wrong(b -> resize!(b.step_info, 1)), (DimensionMismatch, "step_info")),
        (() -> reset!(Batch(Env("Reacher-v5"; rows = 2)), env), (DimensionMismatch, "obs")),
        (() -> observe!(Batch(Env(env.id; rows = 3)), env), (DimensionMismatch, "obs")),
        (() -> reset!(batch, env; rows = [true]), (DimensionMismatch, "mask")),
        (() -> reset!(env; rows = trues(3)), (DimensionMismatch, "mask")),
        (() -> reset!(env; rows = [1, 0]), (ArgumentError, "row 0")),
        (() -> reset!(env; rows = [1.0, 0.0]), (TypeError, "rows")),
        (() -> seed!(env, -1), (ArgumentError, "-1")),
        (() -> seed!(env, [1, -2]), (ArgumentError, "-2")),
        (() -> seed!(env, [1, 2, 3]), (DimensionMismatch, "3 seeds", "2 rows")),
        (() -> seed!(env, [1, 2]; rows = 1), (DimensionMismatch, "2 seeds", "1 rows")),
        (() -> seed!(env, [1]; rows = [true, false]), (DimensionMismatch, "1 seeds", "2 rows")),
        (() -> seed!(env, 1; rows = 0), (ArgumentError, "row 0", "1:2")),
        (() -> seed!(env, 1; rows = [true]), (DimensionMismatch, "mask", "1", "2")),
        (() -> seed!(env, 1.5), (MethodError,)),
        (() -> reset!(batch, env; rows = 3), (ArgumentError, "row 3", "1:2")),
        (() -> reset!(batch, env; rows = [0, 1]), (ArgumentError, "row 0", "1:2")),
        (() -> step!(batch, env, action; rows = 2), (DimensionMismatch, "1 row(s)", "$(nu)×1", "($nu, 2)")),
        (() -> step!(batch, env, action[:, 1]; rows = 1:2), (DimensionMismatch, "2 row(s)", "$(nu)×2", "($nu,)")),
        (() -> step!(batch, env, action[:, 1]; rows = [true, false]), (DimensionMismatch, "action", "$(nu)×2")),
        (() -> step!(batch, env, action; rows = [1, 4]), (ArgumentError, "row 4", "1:2")),
        (() -> send!(env, action[:, 1]; rows = [true, false]), (DimensionMismatch, "$(nu)×2")),
        (() -> copy_row!(env, 1, [3]), (ArgumentError, "row 3")),
        (() -> seed_actions!(env, -1), (ArgumentError, "-1")),
        (() -> seed_actions!(env, big(2)^64), (ArgumentError, "18446744073709551616")),
        (() -> sample_actions!(zeros(Float32, nu), env), (DimensionMismatch, "action")),
        (() -> sample_actions!(zeros(nu, 2), env), (MethodError,)),
        (() -> read(env, :xpo), (MJENV_E_NAME, "xpo", "xpos")),
        (() -> read(env, :xpos; row = 0), (ArgumentError, "row 0", "1:2")),
        (() -> read(env, :xpos; row = 3), (ArgumentError, "row 3", "1:2")),
        (() -> read(env, "\0"), (ArgumentError, "NUL")),
        (() -> fields(env, :rewards), (ArgumentError, ":rewards", ":reset_info")),
        (() -> object_index(env, :bodies, "torso"), (MJENV_E_NAME, "bodies", "tendon")),
        (() -> object_count(env, :bodies), (MJENV_E_NAME, "bodies", "tendon")),
        (() -> object_index(env, :body, "tail"), (MJENV_E_NAME, "tail", "torso")),
        (() -> object_name(env, :body, 0), (MJENV_E_VALUE, "body", "-1")),
        (() -> object_name(env, :body, 99), (MJENV_E_VALUE, "body", "98")),
        (() -> set_state!(env, zeros(nq - 1), zeros(nv)), (DimensionMismatch, "qpos", "$nq")),
        (() -> set_state!(env, zeros(nq), zeros(nv + 1)), (DimensionMismatch, "qvel", "$nv")),
        (() -> set_state!(env, fill(NaN, nq), zeros(nv)), (MJENV_E_VALUE, "qpos[0]")),
        (() -> set_state!(env, zeros(nq), [zeros(nv - 1); Inf]), (MJENV_E_VALUE, "qvel[$(nv - 1)]")),
        (() -> set_state!(env, zeros(nq), zeros(nv); row = 5), (ArgumentError, "row 5")),
        (() -> simulate!(env, zeros(nu + 1), 1), (DimensionMismatch, "ctrl")),
        (() -> simulate!(env, zeros(nu), 0), (MJENV_E_VALUE, "frames")),
        (() -> write!(env, :body_maas, 1.0), (MJENV_E_NAME, "body_maas")),
        (() -> write!(env, :xpos, read(env, :xpos)), (MJENV_E_NAME, "xpos", "MuJoCo computes it")),
        (() -> write!(env, :body_parentid, read(env, :body_parentid)), (MJENV_E_NAME, "structure")),
        (() -> write!(env, :body_mass, 1.0), (DimensionMismatch, "body_mass", "()", "(14,)")),
        (() -> write!(env, :body_mass, fill(-1, 14)), (MJENV_E_VALUE, "body_mass", "-1")),
        (() -> write!(env, :body_mass, fill(NaN, 14); rows = :), (MJENV_E_VALUE, "body_mass", "nan")),
        (() -> write!(env, :body_mass, ones(14); rows = 3), (ArgumentError, "row 3")),
        (() -> write!(env, :body_mass, ones(Complex{Int}, 14)), (MethodError,)),
        (() -> write!(env, "body_mass\0", ones(14)), (ArgumentError, "NUL")),
        (() -> write!(env, :body_mass, ones(14, 3)), (DimensionMismatch, "body_mass", "(14, 3)", "(14,)", "(14, 2)")),
        (() -> write!(env, :body_mass, ones(14, 2); rows = [1]), (DimensionMismatch, "body_mass", "(14, 1)")),
        (() -> write!(env, :body_mass, ones(14, 1); rows = 1), (DimensionMismatch, "body_mass", "(14, 1)", "(14,)")),
        (() -> write!(env, :body_mass, ones(14); rows = [1, 3]), (ArgumentError, "row 3")),
        (() -> write!(env, :body_mass, [ones(14) fill(-1, 14)]), (MJENV_E_VALUE, "body_mass", "-1")),
        (() -> write!(env, :body_mass, ones(14, 2); rows = [true]), (DimensionMismatch, "mask")),
        (() -> set_constants!(env; rows = 3), (ArgumentError, "row 3")),
        (() -> snapshot(env; rows = -1), (ArgumentError, "row -1")),
        (() -> snapshot(env; rows = [1]), (TypeError, "rows")),
        (() -> restore!(env, image; rows = trues(2)), (TypeError, "rows")),
        (() -> restore!(env, image; rows = 3), (ArgumentError, "row 3")),
        (() -> restore!(env, UInt8[]), (MJENV_E_SNAPSHOT,)),
        (() -> restore!(env, rand(UInt8, length(image))), (MJENV_E_SNAPSHOT,)),
        (() -> restore!(env, image[1:(end - 1)]), (MJENV_E_SNAPSHOT,)),
        (() -> restore!(env, [image; 0x00]), (MJENV_E_SNAPSHOT,)),
        (() -> restore!(env, damaged), (MJENV_E_SNAPSHOT, "damaged")),
        (() -> restore!(env, foreign), (MJENV_E_SNAPSHOT, "another")),
        (() -> restore!(env, otherwise), (MJENV_E_SNAPSHOT, "options")),
        (() -> restore!(env, "image"), (MethodError,)),
        (() -> deepcopy(env), (ArgumentError, "restore!")),
    ]
end

contents(batch) = deepcopy([getfield(batch, name) for name in fieldnames(Batch)])
equal(a, b) = repr(a) == repr(b)  # NaN included

# A recorded episode goes on with the same bits, whatever is tried between its steps.
@testset "in the midst of an episode" begin
    g = golden("Ant-v5.options")
    env = make(g; rows = 2)
    batch = Batch(env)
    seed!(env, [g.seed, g.seed])
    calls = nothing
    episode = 0
    for t in 1:40
        if t - 1 in g[:reset_at]
            reset!(batch, env)
        end
        action = g[:action][:, [t, t]]
        calls === nothing && (calls = bad_calls(env, batch, action))
        tried = t == 1 ? calls : calls[[mod1(t, length(calls))]]
        for (call, wanted) in tried
            before = contents(batch)
            @test refuses(call, wanted...)
            @test equal(contents(batch), before)
        end
        step!(batch, env, action)
        for row in 1:2
            @test same(batch.obs[:, row], g[:obs][:, t])
            @test bits(batch.reward[row]) == bits(g[:reward][t])
        end
    end
end

@testset "out of turn" begin
    g = golden("InvertedPendulum-v5")
    env = make(g)
    batch = Batch(env)
    untouched = contents(batch)
    @test refuses(() -> step!(batch, env, g[:action][:, 1]), MJENV_E_NOT_RESET, "row 0", "reset")
    @test equal(contents(batch), untouched)
    seed!(env, g.seed)
    reset!(batch, env)
    last_step = g[:reset_at][2]
    for t in 1:last_step
        step!(batch, env, g[:action][:, t])
    end
    ended = contents(batch)
    @test batch.terminated[1]
    @test refuses(() -> step!(batch, env, g[:action][:, 1]), MJENV_E_EPISODE_ENDED, "row 0", "ended", "strict")
    @test equal(contents(batch), ended)
    reset!(batch, env)
    @test same(batch.obs[:, 1], g[:reset_obs][:, 2])
    step!(batch, env, g[:action][:, last_step + 1])
    @test same(batch.obs[:, 1], g[:obs][:, last_step + 1])
end

@testset "unbounded actuator" begin
    model = """
    <mujoco><worldbody><body><joint name="slider" type="slide"/><geom size=".1"/>
    <body><joint name="hinge" type="hinge"/><geom size=".1"/></body></body></worldbody>
    <actuator><motor joint="slider" ctrllimited="true" ctrlrange="-1 inf"/></actuator></mujoco>"""
    env = Env("InvertedPendulum-v5"; xml_string = model)
    @test action_space(env).high == [Inf32]
    @test refuses(() -> sample_actions(env), MJENV_E_MODEL, "actuator 0")
    reset!(env)
    @test step!(env, [0.5]).obs isa Vector{Float64}
end

@testset "closed" begin
    env = Env("Ant-v5")
    batch = reset!(Batch(env), env)
    image = snapshot(env)
    close(env)
    for call in (
        () -> seed!(env, 1),
        () -> seed_actions!(env, 1),
        () -> sample_actions(env),
        () -> reset!(env),
        () -> reset!(batch, env),
        () -> step!(env, zeros(8)),
        () -> step!(batch, env, zeros(Float32, 8)),
        () -> observe(env),
        () -> options(env),
        () -> spec(env),
        () -> fields(env, :info),
        () -> observation_space(env),
        () -> action_space(env),
        () -> read(env, :qpos),
        () -> object_index(env, :body, "torso"),
        () -> object_name(env, :body, 1),
        () -> set_state!(env, zeros(15), zeros(14)),
        () -> simulate!(env, zeros(8), 1),
        () -> snapshot(env),
        () -> restore!(env, image),
    )
        @test refuses(call, ArgumentError, "Ant-v5", "closed")
    end
    @test close(env) === nothing
end

# A box slides and turns above a floor. The model's stack is too small for contacts.
const BOX = """
<mujoco><size nstack="120"/><option timestep="0.01"/><worldbody><geom type="plane" size="9 9 1"/><body pos="0 0 3">
<joint name="x" type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 1 0"/>
<geom type="box" size=".3 .3 .3"/></body></worldbody><actuator><motor joint="x"/></actuator></mujoco>
"""

# The row keeps its state, the others are stepped, and after a reset the row can be stepped again.
@testset "a row that MuJoCo fails in" begin
    env, whole = (Env("HalfCheetah-v5"; rows = 3, num_threads = 2, xml_string = BOX) for _ in 1:2)
    batch, wanted = Batch(env), Batch(whole)
    for (e, b) in ((env, batch), (whole, wanted))
        seed!(e, [1, 2, 3])
        reset!(b, e)
    end
    set_state!(env, [0, -2.6, 0], [0, -10, 0]; row = 2)
    @test refuses(() -> step!(batch, env, ones(Float32, 1, 3)), MJEnv.MJENV_E_PHYSICS, "row 1", "MuJoCo")
    step!(wanted, whole, ones(Float32, 1, 3))
    @test batch.status == [MJEnv.MJENV_OK, MJEnv.MJENV_E_PHYSICS, MJEnv.MJENV_OK]
    @test same(batch.obs[:, [1, 3]], wanted.obs[:, [1, 3]])
    @test read(env, :qpos; row = 2) == [0, -2.6, 0]
    reset!(batch, env)
    step!(batch, env, ones(Float32, 1, 3))
end

# Julia ends while rows are under way.
@testset "exit while rows are under way" begin
    script = """
    using MJEnv
    env = Env("Humanoid-v5"; rows = 64, num_threads = 3)
    batch = Batch(env)
    reset!(batch, env)
    send!(env, zeros(Float32, 17, 64))
    print("sent")
    """
    julia = `$(Base.julia_cmd()) --startup-file=no --project=$PACKAGE`
    @test read(`$julia -e $script`, String) == "sent"
end

# MuJoCo warns about a diverging simulation. The warning must appear neither on the terminal nor in a file.
@testset "MuJoCo's warnings" begin
    mktempdir() do folder
        cd(folder) do
            env = Env("HalfCheetah-v5"; strict = false)
            reset!(env)
            batch = Batch(env)
            set_state!(env, zeros(9), fill(1e9, 9))
            for _ in 1:20
                step!(batch, env, fill(1e30, 6))
                batch.status[1] == MJEnv.MJENV_DIVERGED && break
            end
            @test batch.status[1] == MJEnv.MJENV_DIVERGED
            @test isempty(readdir(folder))
        end
    end
end

# The number of Julia's threads cannot change after the start, so another process runs this test.
@testset "two threads" begin
    script = """
    using MJEnv
    env = Env("Humanoid-v5"; rows = 8)
    reset!(env)
    results = Channel{Any}(Inf)
    steps = Threads.Atomic{Int}(0)
    deadline = time() + 60
    seen = Threads.Atomic{Bool}(false)
    Threads.@threads for thread in 1:2
        batch = Batch(env)
        action = zeros(Float32, 17, 8)
        while !seen[] && time() < deadline
            try
                thread == 1 ? reset!(batch, env) : observe!(batch, env)
                Threads.atomic_add!(steps, 1)
            catch e
                seen[] = true
                put!(results, e)
            end
        end
    end
    e = take!(results)
    e isa MJEnvError && e.status == MJEnv.MJENV_E_BUSY || error(e)
    occursin("another thread", e.message) || error(e.message)
    steps[] > 0 || error("no call went through")
    step!(env, zeros(Float32, 17, 8))
    close(env)
    print("busy")
    """
    julia = `$(Base.julia_cmd()) --startup-file=no --project=$PACKAGE --threads=2`
    @test read(`$julia -e $script`, String) == "busy"
end

# Closing refuses to free an environment while a call is inside.
@testset "close while another thread is inside" begin
    env = Env("Reacher-v5")
    MJEnv.inside(env) do handle
        @test refuses(() -> close(env), MJENV_E_BUSY, "another thread")
    end
    @test isopen(env)
    reset!(env)
    close(env)
    @test !isopen(env)
end

@testset "library not found" begin
    script = """
    using MJEnv
    try
        MJEnv.ids()
    catch e
        print(sprint(showerror, e))
    end
    """
    julia = `$(Base.julia_cmd()) --startup-file=no --project=$PACKAGE`
    told(path) = withenv(() -> read(`$julia -e $script`, String), "MJENV_LIBRARY" => path)
    @test occursin("/nowhere/libmjenv.so", told("/nowhere/libmjenv.so"))
    @test occursin("MJENV_LIBRARY", told("/nowhere/libmjenv.so"))
    @test occursin("cmake", told("/nowhere/libmjenv.so"))
    @test told(nothing) == told("") == ""
end
