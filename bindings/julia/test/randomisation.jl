# Tests resets that draw models, and noise, delays and pushes. tests/live compares the draws with Gymnasium's.

function drawing_hopper(rows)
    env = Env("Hopper-v5"; rows = rows)
    randomize!(
        env,
        [
            MJEnv.Draw(:body_mass, :scale, 0.5, 1.5; elements = [2, 3], constants = true),
            MJEnv.Draw(:geom_friction, :scale, 0.5, 2; distribution = :log_uniform, shared = true),
            MJEnv.Draw("opt.timestep", :value, 0.001, 0.002, 0.001, 0.002, 0.001; distribution = :choice),
        ],
    )
    push = MJEnv.Push(object_index(env, :body, "torso"), fill(-1, 6), ones(6); every = (1, 1))
    noise = (action_noise = 0.1, observation_noise = 0.01)
    perturb!(env; noise..., action_delay = 1:2, observation_delay = 2, pushes = [push])
    return seed!(env, 3)
end

@testset "rows draw as environments of one row" begin
    many, one, own = drawing_hopper(2), drawing_hopper(1), read(Env("Hopper-v5"), :body_mass)
    reset!(many)
    reset!(one)
    for _ in 1:8
        obs = step!(many, fill(0.1f0, 3, 2)).obs
        @test same(obs[:, 1], step!(one, fill(0.1f0, 3)).obs)
    end
    mass = read(many, :body_mass; row = 2)
    @test all(0.5 .<= mass[2:3] ./ own[2:3] .<= 1.5) && mass[2:3] != own[2:3] && mass[4:end] == own[4:end]
    @test read(many, "opt.timestep"; row = 2) in (0.001, 0.002)
    @test read(many, :xfrc_applied; row = 2)[1, 2] != 0
    restore!(one, snapshot(many; rows = 1))
    @test read(one, :geom_friction) == read(many, :geom_friction)
    image = snapshot(many; rows = 1)
    @test randomize!(many, []) === many
    @test perturb!(many) === many
    @test refuses(() -> restore!(many, image), MJEnv.MJENV_E_SNAPSHOT, "randomisation")
end

@testset "forces last, and kicks change velocities" begin
    env = Env("Ant-v5")
    torso, ahead = object_index(env, :body, "torso"), [5, 0, 0, 0, 0, 0]
    force = MJEnv.Push(torso, ahead, ahead; every = (1, 1), duration = (3, 3))
    kick = MJEnv.Push(torso, ahead, ahead; every = (5, 5), kick = true)
    perturb!(env; pushes = [force, kick])
    reset!(seed!(env, 3))
    speeds = map(1:5) do _
        step!(env, zeros(8))
        @test read(env, :xfrc_applied)[1, 2] == 5
        read(env, :qvel)[1]
    end
    @test speeds[4] < 2 < speeds[5]
    @test refuses(() -> perturb!(env; pushes = [kick, kick]), MJEnv.MJENV_E_VALUE, "twice")
end

@testset "one draw for several arrays, from ranges of rows" begin
    env = Env("Hopper-v5"; rows = 3)
    gain = MJEnv.Draw(:actuator_gainprm, :value, 20, 40; elements = [1, 11, 21])
    randomize!(env, [gain, MJEnv.Same(:actuator_biasprm, :value; factor = -1, elements = [2, 12, 22])])
    write!(env, "draws[0]", [50, 60]; rows = 2)
    @test read(env, "draws[0]"; row = 2) == [50, 60]
    reset!(seed!(env, 1))
    for row in 1:3
        low, high = row == 2 ? (50, 60) : (20, 40)
        gains = read(env, :actuator_gainprm; row)[1, :]
        @test gains == -read(env, :actuator_biasprm; row)[2, :] && all(low .<= gains .<= high)
    end
    @test refuses(() -> write!(env, "draws[0]", [2, 1]; rows = 3), MJEnv.MJENV_E_VALUE, "draws[0]", "above high")
    @test_throws ArgumentError perturb!(env; action_delay = 2:1)
    @test perturb!(env; action_delay = 0:2, observation_delay = 1:3, redraw_delays = true) === env
end

@testset "what cannot be drawn" begin
    env = Env("Hopper-v5")
    draws(arguments...; keywords...) = () -> randomize!(env, [MJEnv.Draw(arguments...; keywords...)])
    @test refuses(draws(:body_maas, :scale, 1, 2), MJEnv.MJENV_E_NAME, "body_maas")
    @test refuses(draws(:body_mass, :scale, 2, 1), MJEnv.MJENV_E_VALUE, "above high")
    @test refuses(draws(:body_mass, :scale, 1, 2; elements = [0]), MJEnv.MJENV_E_VALUE, "element -1")
    @test refuses(draws(:body_mass, :scale; distribution = :choice), MJEnv.MJENV_E_SIZE, "parameter_count")
    @test_throws ArgumentError MJEnv.Draw(:body_mass, :times, 1, 2)
    @test_throws ArgumentError MJEnv.Draw(:body_mass, :scale, 1, 2; distribution = :beta)
    @test refuses(() -> perturb!(env; action_noise = -1), MJEnv.MJENV_E_VALUE, "action_noise")
    @test refuses(() -> perturb!(env; observation_noise = [1, 2]), MJEnv.MJENV_E_SIZE, "observation_noise")
    @test refuses(() -> perturb!(env; action_delay = -1), MJEnv.MJENV_E_VALUE, "action_delay")
    push = MJEnv.Push(1, zeros(6), ones(6))
    @test refuses(() -> perturb!(env; pushes = [push]), MJEnv.MJENV_E_VALUE, "body is 0")
    @test_throws DimensionMismatch MJEnv.Push(2, zeros(3), ones(3))
end

@testset "lanes" begin
    @test lanes(Env("Hopper-v5"; rows = 4, lanes = 2)) == (count = 2, reason = "")
    @test ("energies" => "absent") in lane_stages(Env("Hopper-v5"; rows = 4, lanes = 2))
    @test lanes(Env("Hopper-v5"; rows = 4, lanes = 0)) == (count = 0, reason = "the option \"lanes\" is 0")
end
