# From the repository: julia --project=bindings/julia bindings/julia/test/runtests.jl
# (Pkg.test works too, but wants a registry.)

using MJEnv
using MJEnv: fields, info, options, spec
using Test

const REPOSITORY = normpath(@__DIR__, "..", "..", "..")
const PACKAGE = dirname(@__DIR__)
const GOLDEN = joinpath(REPOSITORY, "tests", "golden")

include("goldens.jl")
include("errors.jl")

@testset "MJEnv" begin
    @testset "trajectories" begin
        include("trajectories.jl")
    end
    @testset "schema" begin
        include("schema.jl")
    end
    @testset "interface" begin
        include("interface.jl")
    end
    @testset "many" begin
        include("many.jl")
    end
    @testset "bad input" begin
        include("bad_input.jl")
    end
    @testset "pictures" begin
        include("pictures.jl")
    end
    @testset "memory" begin
        include("memory.jl")
    end
    @testset "misuse" begin
        include("misuse.jl")
    end
    @testset "CommonRLInterface" begin
        include("common_rl.jl")
    end
    @testset "example" begin
        include("example.jl")
    end
end
