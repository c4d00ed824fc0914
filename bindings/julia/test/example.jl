# Compares the example's episodes with Gymnasium's, and those of two tasks of dm_control's suite with dm_control's.

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

const OF_SUITE = ("dm_control/humanoid_CMU-walk-v0", "dm_control/reacher-hard-v0")

@testset "$(line[1])" for line in filter(line -> line[1] in OF_SUITE, expected("dm_control.txt"))
    check(line; max_episode_steps = 50)
end
