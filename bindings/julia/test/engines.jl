# Tests the choice of an engine. tests/mujoco4/both_engines.jl needs the library on MuJoCo 4.0, and plays with it.

const HERE = realpath(get(ENV, "MJENV_LIBRARY", joinpath(REPOSITORY, "build", "libmjenv.so")))

@testset "this engine" begin
    @test "2.2.2" in MJEnv.engines()
    @test Env(env -> env.engine, "Hopper-v5") == "2.2.2"
    @test Env(env -> env.engine, "Hopper-v5"; engine = "2.2.2") == "2.2.2"
    @test MJEnv.version(engine = "2.2.2") == MJEnv.version()
    @test MJEnv.spec("Hopper-v5"; engine = "2.2.2") == MJEnv.spec("Hopper-v5")
    @test MJEnv.options("Hopper-v5"; engine = "2.2.2") == MJEnv.options("Hopper-v5")
    @test length(MJEnv.schema("Hopper-v5"; engine = "2.2.2")) == length(MJEnv.schema("Hopper-v5"))
    @test MJEnv.ids(engine = "2.2.2") == MJEnv.ids()
end

@testset "unknown engines" begin
    for name in ("3.0", "4", "", "mujoco")
        @test refuses(() -> Env("Hopper-v5"; engine = name), ArgumentError, repr(name), "\"2.2.2\" and \"4.0\"")
    end
    @test refuses(() -> MJEnv.ids(engine = "5"), ArgumentError, "\"5\"")
    @test_throws TypeError Env("Hopper-v5"; engine = 4.0)
    said = spoken("print(MJEnv.ids())"; variables = ["MJENV_ENGINE" => "latest"])
    @test occursin("MJENV_ENGINE", said) && occursin("\"latest\"", said) && occursin("\"4.0\"", said)
end

# An engine whose library is missing, or is another one.
@testset "missing libraries" begin
    mktempdir() do folder
        only_one = joinpath(folder, "libmjenv.so")
        symlink(HERE, only_one)
        variables = ["MJENV_LIBRARY" => only_one]
        @test occursin("[\"2.2.2\"]", spoken("print(MJEnv.engines())"; variables = variables))
        said = spoken("Env(\"Hopper-v5\"; engine = \"4.0\")"; variables = variables)
        @test occursin("MuJoCo 4.0 was not found", said)
        @test occursin(joinpath(folder, "libmjenv-mujoco4.so"), said)
        @test occursin("MJENV_ENGINE=", said)  # how to build it
        symlink(HERE, joinpath(folder, "libmjenv-mujoco4.so"))
        said = spoken("Env(\"Hopper-v5\"; engine = \"4.0\")"; variables = variables)
        @test occursin("libmjenv-mujoco4.so: it works with MuJoCo 2.2.2", said)
    end
end
