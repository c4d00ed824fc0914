# Compares every bit with Gymnasium's, through both forms of reset! and step!, in one row and in one of many.

@test sort!(unique(read_golden(path).id for path in goldens_in("trajectories"))) == MJEnv.ids()

@testset "$(basename(path))" for path in goldens_in("trajectories")
    g = read_golden(path)
    Env(g.id; g.options...) do env
        @test agrees(play(g, env, Batch(env)), g)
    end
end

@testset "custom/$(basename(path))" for path in goldens_in("custom")
    g = read_golden(path)
    env = cd(() -> make(g), dirname(path))
    @test agrees(play(g, env, Batch(env)), g)
end

@testset "allocating calls: $name" for name in ("Ant-v4", "Humanoid-v5", "Reacher-v5.options", "InvertedPendulum-v5")
    g = golden(name)
    env = make(g)
    seed!(env, g.seed)
    episode = 0
    for t in 1:size(g[:action], 2)
        if t - 1 in g[:reset_at]
            episode += 1
            obs, told = reset!(env)
            @test same(obs, g[:reset_obs][:, episode])
            @test same(flat(told), g[:reset_info][:, episode])
            @test same(flat(info(env)), flat(told))
        end
        obs, reward, terminated, truncated, told = step!(env, g[:action][:, t])
        @test same(obs, g[:obs][:, t])
        @test bits(reward) == bits(g[:reward][t])
        @test (terminated, truncated) == (g[:terminated][t] == 1, g[:truncated][t] == 1)
        @test same(flat(told), g[:info][:, t])
        @test same(observe(env), obs)
    end
end

# Returns the numbers of one row in the info of three.
flat_row(info, row) = Float64[x for value in info for x in reshape(value, :, 3)[:, row]]

# Row 2 of 3 plays the recording. The other rows have other seeds and actions, and their episodes never end.
@testset "one row of many: $name" for name in ("Ant-v5", "Humanoid-v5", "HalfCheetah-v5.options")
    g = golden(name)
    env = make(g; rows = 3, strict = false)
    middle = [false, true, false]
    seed!(env, [1, g.seed, 2])
    reset!(env)
    seed!(env, [g.seed]; rows = 2:2)
    episode = 0
    for t in 1:size(g[:action], 2)
        if t - 1 in g[:reset_at]
            episode += 1
            before = observe(env)
            obs, told = reset!(env; rows = middle)
            @test same(obs[:, 2], g[:reset_obs][:, episode])
            @test same(obs[:, [1, 3]], before[:, [1, 3]])
            @test same(flat_row(told, 2), g[:reset_info][:, episode])
            @test all(==(0), flat_row(told, 3))
        end
        action = g[:action][:, t] .* eltype(g[:action])[0 1 -1]
        obs, reward, terminated, truncated, told = step!(env, action)
        @test same(obs[:, 2], g[:obs][:, t])
        @test bits(reward[2]) == bits(g[:reward][t])
        @test (terminated[2], truncated[2]) == (g[:terminated][t] == 1, g[:truncated][t] == 1)
        @test same(flat_row(told, 2), g[:info][:, t])
        @test same(read(env, :qpos; row = 2), g[:qpos][:, t])
    end
end

@testset "float32 observations" begin
    g = golden("HalfCheetah-v5")
    env = make(g)
    batch = Batch(env; dtype = Float32)
    seed!(env, g.seed)
    reset!(batch, env)
    @test same(batch.obs, Float32.(g[:reset_obs][:, 1:1]))
    step!(batch, env, g[:action][:, 1])
    @test same(batch.obs, Float32.(g[:obs][:, 1:1]))
end
