# Tests resets that draw models, and noise, delays and pushes. tests/live compares the draws with Gymnasium's.

const DRAWS = """{
    "randomize": {
        "body_mass": {"kind": "scale", "low": 0.5, "high": 1.5, "elements": [1, 2], "set_constants": true},
        "geom_friction": {"kind": "scale", "distribution": "log_uniform", "low": 0.5, "high": 2, "shared": true},
        "opt.timestep": {"choices": [0.001, 0.002, 0.001, 0.002, 0.001]}
    },
    "noise": {"action": 0.1, "observation": 0.01},
    "delay": {"action": [1, 2], "observation": 2},
    "push": {"body": "torso", "every": 1, "force": [[-1, 1], [-1, 1], [-1, 1]], "torque": [[-1, 1], [-1, 1], [-1, 1]]}
}"""

drawing_hopper(rows) = seed!(randomize!(Env("Hopper-v5"; rows = rows), DRAWS), 3)

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
    @test occursin("\"body\":\"torso\"", randomization(many))
    @test randomize!(many, """{"randomize": null, "noise": null, "delay": null, "push": null}""") === many
    @test randomization(many) == "{}"
    @test refuses(() -> restore!(many, image), MJEnv.MJENV_E_SNAPSHOT, "randomisation")
end

@testset "forces last, and kicks change velocities" begin
    env = Env("Ant-v5")
    ahead = "[[5, 5], [0, 0], [0, 0]]"
    force = """{"body": "torso", "every": 1, "duration": 3, "force": $ahead}"""
    kick = """{"body": "torso", "every": 5, "velocity": $ahead}"""
    randomize!(env, """{"push": [$force, $kick]}""")
    reset!(seed!(env, 3))
    speeds = map(1:5) do _
        step!(env, zeros(8))
        @test read(env, :xfrc_applied)[1, 2] == 5
        read(env, :qvel)[1]
    end
    @test speeds[4] < 2 < speeds[5]
    @test refuses(() -> randomize!(env, """{"push": [$kick, $kick]}"""), MJEnv.MJENV_E_VALUE, "twice")
end

@testset "one draw for several arrays, from ranges of rows" begin
    env = Env("Hopper-v5"; rows = 3)
    randomize!(
        env,
        """{"randomize": {"actuator_gainprm": {"low": 20, "high": 40, "columns": 0},
                          "actuator_biasprm": {"kind": "same", "factor": -1, "columns": 1}}}""",
    )
    write!(env, "draws[0]", [50, 60]; rows = 2)
    @test read(env, "draws[0]"; row = 2) == [50, 60]
    reset!(seed!(env, 1))
    for row in 1:3
        low, high = row == 2 ? (50, 60) : (20, 40)
        gains = read(env, :actuator_gainprm; row)[1, :]
        @test gains == -read(env, :actuator_biasprm; row)[2, :] && all(low .<= gains .<= high)
    end
    @test refuses(() -> write!(env, "draws[0]", [2, 1]; rows = 3), MJEnv.MJENV_E_VALUE, "draws[0]", "above high")
end

@testset "what cannot be drawn" begin
    refused(document, status, words...) = refuses(() -> randomize!(Env("Hopper-v5"), document), status, words...)
    @test refused("""{"randomize": {"body_maas": {}}}""", MJEnv.MJENV_E_NAME, "randomize.body_maas")
    @test refused("""{"randomize": {"body_mass": {"low": 2, "high": 1}}}""", MJEnv.MJENV_E_VALUE, "above high")
    @test refused("""{"noise": {"observation": [1, 2]}}""", MJEnv.MJENV_E_SIZE, "noise.observation")
    @test refused("{", MJEnv.MJENV_E_VALUE, "no JSON")
end

@testset "lanes" begin
    @test lanes(Env("Hopper-v5"; rows = 4, lanes = 2)) == (count = 2, reason = "")
    @test ("energies" => "absent") in lane_stages(Env("Hopper-v5"; rows = 4, lanes = 2))
    @test lanes(Env("Hopper-v5"; rows = 4, lanes = 0)) == (count = 0, reason = "the option \"lanes\" is 0")
end
