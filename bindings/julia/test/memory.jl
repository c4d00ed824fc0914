# Tests what is allocated, kept and freed.

@testset "nothing is allocated: $id, $T" for id in ("Ant-v5", "Pusher-v4", "InvertedPendulum-v4"),
    T in (Float32, Float64)

    env = Env(id; rows = 2, strict = false)
    batch = Batch(env; dtype = T)
    drawn = sample_actions(env)
    action = T.(drawn)
    @test allocated(reset!, batch, env) == 0
    @test allocated(step!, batch, env, action) == 0
    @test allocated(observe!, batch, env) == 0
    @test allocated(sample_actions!, drawn, env) == 0
    @test allocated(rollout!, Batch(env; dtype = T, steps = 3), env, repeat(action[:, 1:1], 1, 3, 2)) == 0
end

function resident_bytes()
    ccall(:malloc_trim, Cint, (Csize_t,), 0)  # freed memory is no matter
    return parse(Int, split(read("/proc/self/statm", String))[2]) * 4096
end

function drop_environments()
    for _ in 1:20
        env = Env("Reacher-v5")
        step!(reset!(Batch(env), env), env, zeros(Float32, 2))
    end
    GC.gc()
    GC.gc()
end

# Each environment takes about 3 MB. If they were kept, they would take 600 MB.
@testset "dropped environments are freed" begin
    foreach(_ -> drop_environments(), 1:3)
    before = resident_bytes()
    foreach(_ -> drop_environments(), 1:10)
    @test resident_bytes() - before < 100 * 2^20
end

# Collects garbage all the time, and makes garbage between the calls.
@testset "collections" begin
    g = golden("HalfCheetah-v5")
    env = make(g)
    batch = Batch(env)
    seed!(env, g.seed)
    episode = 0
    for t in 1:60
        if t - 1 in g[:reset_at]
            episode += 1
            reset!(batch, env)
            @test same(batch.obs[:, 1], g[:reset_obs][:, episode])
        end
        # The environment is dropped at once, and the garbage collector closes it.
        reset!(Env("InvertedPendulum-v5"; rows = 3))
        GC.gc(t % 10 == 0)
        image = snapshot(env)
        step!(env, g[:action][:, t] .* 1)
        restore!(env, image)
        obs, reward, _, _, told = step!(env, view(g[:action], :, t))
        GC.gc(false)
        @test same(obs, g[:obs][:, t])
        @test bits(reward) == bits(g[:reward][t])
        @test same(flat(told), g[:info][:, t])
        @test same(flat(info(env)), flat(told))
    end
end
