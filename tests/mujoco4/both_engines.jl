# The libraries on MuJoCo 2.2.2 and 4.0 in one process of Julia. ENV["MJENV_LIBRARY"] names that on 4.0; the other is in the
# same folder. ENV["MJENV_MUJOCO"] names MuJoCo 4.0. test_languages.py runs this script.

using MJEnv, Test

include(joinpath(@__DIR__, "..", "..", "bindings", "julia", "test", "support.jl"))

struct Still <: MJEnv.Task end
MJEnv.reset!(::Still, start, rng) = nothing
MJEnv.observe(::Still, sim) = (time = sim.time,)
MJEnv.step!(task::Still, sim, row) = sim.time > 0.05 ? error("too late") : (reward = sim.time, terminated = false)

const IMAGES = Dict{String,Vector{UInt8}}()

# The observations of some steps.
function played(engine, id = "Ant-v5")
    Env(id; engine = engine) do env
        @test env.engine == engine
        seed!(env, 1)
        seed_actions!(env, 1)
        found = [reset!(env).obs]
        for _ in 1:20
            push!(found, step!(env, sample_actions(env)).obs)
        end
        IMAGES[engine] = snapshot(env)
        return found
    end
end

# Before the library on 4.0 is loaded.
MJEnv.register("Still-v0", Still; model = "hopper.xml")

@testset "both engines" begin
    @test MJEnv.engines() == ["2.2.2", "4.0"]
    @test occursin("MuJoCo 2.2.2", MJEnv.version(engine = "2.2.2"))
    @test occursin("MuJoCo 4.0", MJEnv.version(engine = "4.0"))
    @test occursin("MuJoCo 4.0", MJEnv.version())  # of the library that is named
    @test "Pusher-v4" in MJEnv.ids(engine = "2.2.2")
    @test "Hopper-v5" in MJEnv.ids(engine = "4.0")

    # As long as there is no MuJoCo 4.0, only the engine 2.2.2 can be used.
    withenv("MJENV_MUJOCO" => "/dev/null") do
        @test Env(env -> env.engine, "Reacher-v5"; engine = "2.2.2") == "2.2.2"
        refused = try
            Env("Reacher-v5"; engine = "4.0")
        catch e
            e
        end
        @test refused isa MJEnvError && refused.status == MJEnv.MJENV_E_FILE
        @test occursin("mujoco-core", refused.message)
    end
    @test Env(env -> env.engine, "Reacher-v5") == "4.0"

    alone = Dict(engine => played(engine) for engine in ("2.2.2", "4.0"))
    @test alone["2.2.2"] != alone["4.0"]
    @test played("4.0") == alone["4.0"]
    @test played("2.2.2") == alone["2.2.2"]
    @sync for engine in ("2.2.2", "4.0"), _ in 1:2
        Threads.@spawn @test played(engine) == alone[engine]
    end

    # An image belongs to its engine.
    for (engine, other) in (("2.2.2", "4.0"), ("4.0", "2.2.2"))
        Env("Ant-v5"; engine = engine) do env
            @test restore!(env, IMAGES[engine]) === env
            refused = try
                restore!(env, IMAGES[other])
            catch e
                e
            end
            @test refused isa MJEnvError && refused.status == MJEnv.MJENV_E_SNAPSHOT
            @test occursin("MuJoCo $other", refused.message)
        end
    end

    # An error comes from the library that was called.
    for engine in ("2.2.2", "4.0"), name in ("Ann-v5", "Bob-v5")
        refused = try
            Env(name; engine = engine)
        catch e
            e
        end
        @test refused isa MJEnvError && occursin(name, refused.message)
    end

    # Options and equal environments keep the engine.
    Env("Ant-v5"; engine = "4.0", ctrl_cost_weight = 0.1) do env
        Env(env.id; engine = env.engine, MJEnv.options(env)...) do twin
            seed!(env, 5), seed!(twin, 5)
            @test reset!(env).obs == reset!(twin).obs
            @test MJEnv.options(twin).ctrl_cost_weight == 0.1
        end
        @test MJEnv.spec(env).max_episode_steps == 1000
    end

    # A task works with both, and its errors reach the right library.
    MJEnv.register("Still-v1", Still; model = "hopper.xml")
    for engine in ("2.2.2", "4.0"), id in ("Still-v0", "Still-v1")
        Env(id; engine = engine) do env
            reset!(env)
            refused = nothing
            for _ in 1:100
                refused = try
                    step!(env, zeros(3))
                    nothing
                catch e
                    e
                end
                refused === nothing || break
            end
            @test refused isa MJEnvError && occursin("too late", refused.message)
        end
    end

    # A step allocates nothing.
    Env("Reacher-v5"; engine = "4.0") do env
        @test allocated(step!, reset!(Batch(env), env), env, zeros(Float32, 2)) == 0
    end
end
