# Tests the ways to say for which rows a call is: all of four, one, some, or those of a mask.

# The ways, with the rows that they choose, in the order in which their arrays hold them.
const CHOICES = (
    (:, [1, 2, 3, 4]),
    (3, [3]),
    ([4, 2], [4, 2]),
    (2:4, [2, 3, 4]),
    (Int[], Int[]),
    ([true, false, true, false], [1, 3]),
    (falses(4), Int[]),
)

# The rows whose elements an array holds.
places(rows, chosen) = rows isa Union{Colon,AbstractVector{Bool}} ? (1:4) : chosen

# The first of the chosen rows repeats the recording, and the others have other seeds. Rows that are not chosen keep their
# state and their outputs.
@testset "played: $rows" for (rows, chosen) in CHOICES
    g = golden("Ant-v5")
    env = make(g; rows = 4)
    batch = Batch(env)
    @test seed!(env, [1, 2, 3, 4]) === env
    reset!(batch, env)
    before = copy(batch.obs)
    images = [snapshot(env; rows = row) for row in 1:4]
    holds(wanted) = all(1:4) do row
        row in chosen || return same(batch.obs[:, row], before[:, row]) && snapshot(env; rows = row) == images[row]
        row == chosen[1] && return same(batch.obs[:, row], wanted)
        return batch.obs[:, row] != wanted && batch.obs[:, row] != before[:, row]
    end

    is_first(row) = row == get(chosen, 1, 0)
    seeds = BigInt[is_first(row) ? g.seed : 100 + row for row in places(rows, chosen)]
    @test seed!(env, rows isa Integer ? seeds[1] : seeds; rows = rows) === env
    @test reset!(batch, env; rows = rows) === batch
    @test holds(g[:reset_obs][:, 1])
    # The library would refuse NaN in a row that is chosen.
    function action(t)
        columns = [
            is_first(row) ? g[:action][:, t] : fill(row in chosen ? 0.1f0 : NaN32, 8) for row in places(rows, chosen)
        ]
        return rows isa Integer ? columns[1] : reduce(hcat, columns; init = zeros(Float32, 8, 0))
    end
    @test step!(batch, env, action(1); rows = rows) === batch
    @test holds(g[:obs][:, 1])
    @test send!(env, action(2); rows = rows) === env
    if !isempty(chosen)
        @test sort(recv!(zeros(Int, 4), batch, env; least = length(chosen))) == sort(chosen)
        @test holds(g[:obs][:, 2])
    end
    stepped = step!(env, action(3); rows = rows)
    isempty(chosen) || @test same(stepped.obs[:, chosen[1]], g[:obs][:, 3])
    for row in setdiff(1:4, chosen)
        @test same(stepped.obs[:, row], before[:, row]) && stepped.reward[row] == 0
    end
end

# The first of the rows has the seed, the next one more.
@testset "one seed: $rows" for (rows, chosen) in CHOICES
    env, other = Env("Reacher-v5"; rows = 4), Env("Reacher-v5"; rows = 4)
    foreach(e -> seed!(e, 50), (env, other))
    seed!(env, typemax(UInt64); rows = rows)
    for (index, row) in enumerate(chosen)
        seed!(other, [big(2)^64 + index - 2]; rows = [row])
    end
    @test [MJEnv.stream(env; row = row) for row in 1:4] == [MJEnv.stream(other; row = row) for row in 1:4]
end

@testset "written: $rows" for (rows, chosen) in CHOICES
    env = Env("Hopper-v5"; rows = 4)
    timesteps() = [read(env, "opt.timestep"; row = row) for row in 1:4]
    @test write!(env, "opt.timestep", 0.004; rows = rows) === env
    @test timesteps() == [row in chosen ? 0.004 : 0.002 for row in 1:4]
    own = Float64[0.001 * (5 + row) for row in places(rows, chosen)]
    write!(env, "opt.timestep", rows isa Integer ? own[1] : own; rows = rows)
    @test timesteps() == [row in chosen ? 0.001 * (5 + row) : 0.002 for row in 1:4]
    # The mass of the whole model, which MuJoCo computes when it compiles a model.
    masses = read(env, :body_mass)
    write!(env, :body_mass, 2 * masses)
    @test set_constants!(env; rows = rows) === env
    for row in 1:4
        @test read(env, :body_subtreemass; row = row)[1] ≈ (row in chosen ? 2 : 1) * sum(masses)
    end
end

@testset "copied: $rows" for (rows, chosen) in CHOICES
    env = Env("Reacher-v5"; rows = 4)
    before = reset!(env).obs
    @test copy_row!(env, 2, rows) === env
    @test same(observe(env), before[:, [row in chosen ? 2 : row for row in 1:4]])
end

@testset "images" begin
    env = Env("Reacher-v5"; rows = 2)
    before = reset!(env).obs
    all_rows, second = snapshot(env), snapshot(env; rows = 2)
    @test snapshot(env; rows = :) == all_rows
    @test restore!(env, second; rows = 1) === env
    @test same(observe(env), before[:, [2, 2]])
    @test restore!(env, all_rows) === env
    @test same(observe(env), before)
end
