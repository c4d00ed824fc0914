# Usage, in the repository: julia --project=bindings/julia bindings/julia/test/runtests.jl [NAME...]
# It runs the test sets with these names; without names, it runs all. Pkg.test works too, but needs a registry.

using MJEnv
using MJEnv: fields, info, options, spec
using Test

const REPOSITORY = normpath(@__DIR__, "..", "..", "..")
const PACKAGE = dirname(@__DIR__)
const GOLDEN = joinpath(REPOSITORY, "tests", "golden")

include("goldens.jl")
include("errors.jl")
include("support.jl")

const TEST_SETS = (
    "trajectories" => "trajectories.jl",
    "schema" => "schema.jl",
    "interface" => "interface.jl",
    "many" => "many.jl",
    "halves" => "halves.jl",
    "rows" => "rows.jl",
    "writes" => "writes.jl",
    "randomisation" => "randomisation.jl",
    "bad input" => "bad_input.jl",
    "engines" => "engines.jl",
    "pictures" => "pictures.jl",
    "memory" => "memory.jl",
    "misuse" => "misuse.jl",
    "CommonRLInterface" => "common_rl.jl",
    "ReinforcementLearningBase" => "rl_base.jl",
    "example" => "example.jl",
    "package" => "package.jl",
    "tasks" => "tasks.jl",  # last, because its ids stay registered
)

ARGS ⊆ first.(TEST_SETS) || error("the test sets are ", join(first.(TEST_SETS), ", "))

@testset "MJEnv" begin
    @testset "$name" for (name, file) in TEST_SETS
        isempty(ARGS) || name in ARGS || continue
        include(file)
    end
end
