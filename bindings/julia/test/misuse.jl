# Tests finalizers in any order, threads, garbage collections at any time, and the end of the process.

@testset "finalized before its time" begin
    env = Env("Hopper-v5"; rows = 2)
    batch = reset!(Batch(env), env)
    space, told = action_space(env), info(batch)
    kept = deepcopy((space.low, space.high, told, batch.obs))
    finalize(env)
    @test !isopen(env)
    foreach(_ -> reset!(Env("Hopper-v5"; rows = 2)), 1:70)  # whoever gets its memory
    GC.gc()
    @test same(flat(told), flat(kept[3]))
    @test (space.low, space.high, batch.obs) == (kept[1], kept[2], kept[4])
    for call in (() -> reset!(env), () -> step!(batch, env, zeros(3, 2)), () -> snapshot(env), () -> action_space(env))
        @test refuses(call, ArgumentError, "closed")
    end
    finalize(env)
    @test close(env) === nothing
end

@testset "finalized in any order" begin
    for order in (identity, reverse, envs -> envs[[3, 1, 5, 2, 4]])
        envs = [Env("Reacher-v5"; rows = rows, num_threads = min(rows, 2)) for rows in 1:5]
        batches = [reset!(Batch(env), env) for env in envs]
        foreach(finalize, order(envs))
        @test all(batch -> all(isfinite, batch.obs), batches)
    end
    # One garbage collection frees all of them in an order of its own. Some refer to each other.
    for _ in 1:5
        envs = Any[Env("Reacher-v5") for _ in 1:10]
        ring = [Ref{Any}(env) for env in envs]
        foreach(i -> envs[i].latest = ring[i % 10 + 1], 1:10)
        envs = ring = nothing
        GC.gc()
    end
    # This finalizer uses an environment that may have been finalized before.
    outcome = Channel{Any}(10)
    for _ in 1:10
        owner = Ref(Env("Reacher-v5"))
        finalizer(o -> put!(outcome, thrown(() -> MJEnv.inside(identity, o[]))), owner)
    end
    GC.gc()
    GC.gc()
    while isready(outcome)
        e = take!(outcome)
        @test e === nothing || e isa ArgumentError
    end
end

@testset "what a pointer would survive" begin
    env = Env("Reacher-v5")
    @test refuses(() -> copy(env), MethodError)
    @test refuses(() -> deepcopy([env]), ArgumentError, "snapshot")
end

@testset "an exception passes through" begin
    kept = Ref{Any}()
    @test refuses(() -> Env(env -> (kept[] = env; error("mine")), "Reacher-v5"), ErrorException, "mine")
    @test !isopen(kept[])
    env = Env("Reacher-v5")
    @test refuses(() -> MJEnv.inside(_ -> error("mine"), env), ErrorException, "mine")
    close(env)  # nobody is inside
    @test !isopen(env)
end

# Threads create, step and drop environments while another thread collects garbage. The bits are those of one thread.
@testset "threads and collections" begin
    @test spoken("""
        function play(seed)
            env = Env("Hopper-v5"; rows = 1 + seed % 3, num_threads = 1 + seed % 2)
            seed!(env, seed)
            reset!(env)
            total = UInt(0)
            for _ in 1:5
                total = hash(step!(env, env.rows == 1 ? zeros(3) : zeros(3, env.rows)).obs, total)
            end
            return total
        end
        expected = [play(seed) for seed in 1:6]
        busy = Threads.Atomic{Int}(6)
        collector = Threads.@spawn while busy[] > 0
            GC.gc(false)
            sleep(0.002)
        end
        tasks = map(1:6) do seed
            Threads.@spawn begin
                played = [play(seed) for _ in 1:4]
                Threads.atomic_sub!(busy, 1)
                played
            end
        end
        all(fetch(tasks[seed]) == fill(expected[seed], 4) for seed in 1:6) || error("other bits")
        wait(collector)
        GC.gc()
        print("equal")
        """; threads = 3) == "equal"
end

# One thread closes the environment while others use it. Each call succeeds, or throws that another thread is inside or
# that the environment is closed.
@testset "closed while threads use it" begin
    @test spoken("""
        function hammer(env, batch)
            counts = zeros(Int, 3)
            while counts[3] == 0
                try
                    observe!(batch, env)
                    counts[1] += 1
                    counts[1] % 20 == 0 && sleep(0.001)  # or close would never find the environment empty
                catch e
                    e isa MJEnvError && e.status == MJEnv.MJENV_E_BUSY ? counts[2] += 1 :
                    e isa ArgumentError ? counts[3] += 1 : rethrow()
                end
            end
            return counts
        end
        for round in 1:8
            env = Env("Reacher-v5"; rows = 4)
            reset!(env)
            users = [Threads.@spawn hammer(env, Batch(env)) for _ in 1:2]
            sleep(0.005)
            while isopen(env)
                try
                    close(env)
                catch e
                    e isa MJEnvError && e.status == MJEnv.MJENV_E_BUSY || rethrow()
                end
            end
            foreach(fetch, users)
        end
        print("closed")
        """; threads = 3) == "closed"
end

# At the end of the process finalizers run in any order, while rows are under way and threads are inside.
@testset "the end of the process" begin
    @test spoken("""
        envs = [Env("Humanoid-v5"; rows = 8, num_threads = 2) for _ in 1:3]
        batches = map(envs) do env
            batch = reset!(Batch(env), env)
            send!(env, zeros(Float32, 17, 8))
            batch
        end
        print("ended")
        """) == "ended"
    @test spoken("""
        env = Env("Humanoid-v5"; rows = 8)
        batch = reset!(Batch(env), env)
        Threads.@spawn while true
            step!(batch, env, zeros(Float32, 17, 8))
            yield()  # or the main task would wait for ever when this one got its thread
        end
        sleep(0.2)
        print("ended")
        exit(0)
        """; threads = 2) == "ended"
    @test occursin("mine", spoken("env = Env(\"Reacher-v5\"); reset!(env); atexit(() -> close(env)); error(\"mine\")"))
end
