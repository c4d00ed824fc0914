# Compares the example's episodes with Gymnasium's.

module Example
include(joinpath(@__DIR__, "..", "..", "..", "examples", "julia", "episodes.jl"))
end

expected(file) = split.(filter(!startswith('#'), readlines(joinpath(recordings(), file))))

function check((id, norm, steps, total, checksum); options...)
    played = Env(Example.play, id; norm = norm, options...)
    @test played.steps == parse(Int, steps)
    @test played.total === real_of(total)
    @test played.checksum == parse(UInt64, checksum; base = 16)
end

const EXPECTED = expected("episodes.txt")

@test length(EXPECTED) == 22

@testset "$(line[1])" for line in EXPECTED
    check(line)
end
