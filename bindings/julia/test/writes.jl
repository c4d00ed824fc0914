# Tests rows with models and inputs of their own.

# A box that slides and turns above a floor, with a mass.
function with_mass(mass; rows = 1)
    model = """
    <mujoco><option timestep="0.01"/><worldbody><geom type="plane" size="9 9 1"/><body pos="0 0 .4">
    <joint name="x" type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 1 0"/>
    <geom type="box" size=".3 .3 .3" mass="$mass"/></body></worldbody>
    <actuator><motor joint="x" gear="50"/></actuator></mujoco>"""
    return Env("HalfCheetah-v5"; rows = rows, num_threads = min(rows, 2), xml_string = model)
end

# Whether each row computes what an environment of one row computes whose model file has the row's mass.
function has_masses(env, masses)
    singles = with_mass.(masses)
    for each in [env; singles]
        seed!(each, fill(7, each.rows))
        reset!(each)
    end
    return all(1:30) do _
        obs = step!(env, fill(0.7f0, 1, length(masses))).obs
        all(same(obs[:, row], step!(single, [0.7f0]).obs) for (row, single) in enumerate(singles))
    end
end

const MASS_ARRAYS = (:body_mass, :body_inertia)

@testset "a row with another mass" begin
    env, heavy, light = with_mass(3; rows = 3), with_mass(8), with_mass(0.5)
    @test has_masses(env, [3, 3, 3])
    for array in MASS_ARRAYS
        @test write!(env, array, read(heavy, array); rows = 2) === env
    end
    @test set_constants!(env; rows = 2) === env
    @test has_masses(env, [3, 8, 3])
    for array in MASS_ARRAYS
        write!(env, array, read(light, array); rows = :)
    end
    set_constants!(env; rows = :)
    @test has_masses(env, [0.5, 0.5, 0.5])
end

@testset "many rows at once" begin
    env, heavy, light = with_mass(3; rows = 3), with_mass(8), with_mass(0.5)
    for array in MASS_ARRAYS
        own = read(env, array)
        values = cat(read(light, array), own, read(heavy, array); dims = ndims(own) + 1)
        @test write!(env, array, values) === env
    end
    set_constants!(env; rows = :)
    @test has_masses(env, [0.5, 3, 8])
    for array in MASS_ARRAYS
        own = read(heavy, array)
        write!(env, string(array), cat(own, own, own; dims = ndims(own) + 1); rows = [true, false, false])
    end
    set_constants!(env; rows = 1)
    @test has_masses(env, [8, 3, 8])
    other = with_mass(3; rows = 3)
    restore!(other, snapshot(env; rows = 3); rows = 1)
    copy_row!(env, 2, [true, true, false])
    @test has_masses(env, [3, 3, 8])
    @test has_masses(other, [8, 3, 3])
end

@testset "model and inputs" begin
    env = Env("Reacher-v5"; rows = 2)
    write!(env, "opt.timestep", 0.005; rows = 2)
    reset!(env)
    write!(env, :qfrc_applied, 1:4; rows = 1)
    @test read(env, :qfrc_applied) == 1:4
    @test read(env, :qfrc_applied; row = 2) == zeros(4)
    reset!(env)
    @test read(env, :qfrc_applied) == zeros(4)
    @test [read(env, "opt.timestep"; row = row) for row in 1:2] == [0.01, 0.005]
    @test read(write!(env, "opt.timestep", [0.02, 0.03]), "opt.timestep"; row = 2) == 0.03
    # The size is that of read, which has MuJoCo's dimensions in reverse.
    friction = read(env, :geom_friction) .* 0.5
    write!(env, :geom_friction, friction; rows = 1)
    @test read(env, :geom_friction) == friction
    @test read(env, :geom_friction; row = 2) == 2 * friction
    send!(env, zeros(Float32, 2, 2))
    @test refuses(() -> write!(env, "opt.timestep", 0.005), MJEnv.MJENV_E_PENDING, "row")
    @test refuses(() -> set_constants!(env), MJEnv.MJENV_E_PENDING, "row")
end
