# Compares the example's episodes with Gymnasium's.

module Example
include(joinpath(@__DIR__, "..", "..", "..", "examples", "julia", "episodes.jl"))
end

const EXPECTED = filter(!startswith('#'), readlines(joinpath(recordings(), "episodes.txt")))

@test length(EXPECTED) == 22

@testset "$(split(line)[1])" for line in EXPECTED
    id, norm, steps, total, checksum = split(line)
    played = Env(Example.play, id; norm = norm)
    @test played.steps == parse(Int, steps)
    @test played.total === real_of(total)
    @test played.checksum == parse(UInt64, checksum; base = 16)
end
