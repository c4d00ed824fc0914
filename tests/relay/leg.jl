# leg.jl GOLDEN FIRST END IN OUT THREADS: as leg.c, from Julia.

using MJEnv, Test  # goldens.jl uses Test

const GOLDEN = joinpath(@__DIR__, "..", "golden")
include(joinpath(@__DIR__, "..", "..", "bindings", "julia", "test", "goldens.jl"))

function main(path, first_step, end_step, taken, left, threads)
    g = read_golden(path)
    env = make(g; rows = 3, num_threads = parse(Int, threads), strict = false)
    batch = Batch(env)
    seed!(env, [1, 2, g.seed])
    reset!(batch, env)
    first_step == "0" || restore!(env, read(taken); rows = 3)
    for t in (parse(Int, first_step) + 1):parse(Int, end_step)
        if t > 1 && t - 1 in g[:reset_at]
            reset!(batch, env; rows = [false, false, true])
            same(batch.obs[:, 3], g[:reset_obs][:, findfirst(==(t - 1), g[:reset_at])]) || error("reset before $t")
        end
        step!(batch, env, repeat(g[:action][:, t], 1, 3))
        same(batch.obs[:, 3], g[:obs][:, t]) || error("observation of $t")
        bits(batch.reward[3]) == bits(g[:reward][t]) || error("reward of $t")
        (batch.terminated[3], batch.truncated[3]) == (g[:terminated][t] == 1, g[:truncated][t] == 1) ||
            error("flags of $t")
    end
    write(left, snapshot(env; rows = 3))
end

main(ARGS...)
