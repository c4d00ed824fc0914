# Tests the calls that the trajectories and the schema do not use.

@testset "library" begin
    @test occursin(r"^\d+\.\d+\.\d+ \(MuJoCo 2\.2\.2\)$", MJEnv.version())
    @test length(MJEnv.ids()) == 22
    @test issorted(MJEnv.ids())
end

# HalfCheetah's positions start at 0, and a reset adds the first nine numbers of uniform(-0.1, 0.1) from NumPy's
# generator.
@testset "seeds" begin
    recorded = Dict{BigInt,Vector{Float64}}()
    seed = nothing
    for line in eachline(joinpath(GOLDEN, "random.txt"))
        words = split(line)
        words[1] == "seed" && (seed = parse(BigInt, words[2]; base = 16))
        words[1] == "uniform" && (recorded[seed] = real_of.(words[2:end]))
    end
    @test maximum(keys(recorded)) > typemax(UInt128)
    Env("HalfCheetah-v5") do env
        for (seed, uniform) in recorded
            seed!(env, seed)
            reset!(env)
            @test same(read(env, :qpos), uniform[1:9])
        end
        for seed in (UInt8(42), Int16(42), 42, UInt64(42), big(42))
            @test seed!(env, seed) === env
            reset!(env)
            @test same(read(env, :qpos), recorded[42][1:9])
        end
    end
    Env("HalfCheetah-v5"; rows = 2) do env
        seed!(env, 0)
        reset!(env)
        @test same(read(env, :qpos; row = 1), recorded[0][1:9])
        @test same(read(env, :qpos; row = 2), recorded[1][1:9])
        seed!(env, [1]; rows = [1])
        reset!(env; rows = BitVector([true, false]))
        @test same(read(env, :qpos; row = 1), recorded[1][1:9])
        @test same(read(env, :qpos; row = 2), recorded[1][1:9])
        seed!(env, [maximum(keys(recorded)), 0])
        reset!(env)
        @test same(read(env, :qpos; row = 1), recorded[maximum(keys(recorded))][1:9])
        @test same(read(env, :qpos; row = 2), recorded[0][1:9])
    end
end

@testset "options" begin
    @test options("Ant-v5").healthy_z_range === (0.2, 1.0)
    @test options("Ant-v5").main_body === 1
    @test options("Ant-v5").terminate_when_unhealthy === true
    env = Env(
        SubString("Ant-v5", 1);
        frame_skip = 3,
        ctrl_cost_weight = 1 // 4,
        healthy_reward = 2,
        main_body = :torso,
        terminate_when_unhealthy = false,
        healthy_z_range = [0.3, Inf],
        contact_force_range = (-1, 2.5f0),
        max_episode_steps = 7,
        norm = :plain,
    )
    read_back = options(env)
    @test read_back.xml_file == "ant.xml"
    @test read_back.frame_skip === 3
    @test env.frame_skip == 3
    @test read_back.ctrl_cost_weight === 0.25
    @test read_back.healthy_reward === 2.0
    @test read_back.main_body == "torso"
    @test read_back.terminate_when_unhealthy === false
    @test read_back.healthy_z_range === (0.3, Inf)
    @test read_back.contact_force_range === (-1.0, 2.5)
    @test read_back.norm == "plain"
    @test spec(env).max_episode_steps == 7
    @test spec("Ant-v5").max_episode_steps == 1000
    @test spec(Env("Ant-v5"; max_episode_steps = 0)).max_episode_steps === nothing
    @test options(Env(env.id; options(env)...)) == read_back
    norm, = [option for option in MJEnv.schema("Ant-v5") if option.name == :norm]
    @test norm.choices == ["auto", "fused", "plain"]
end

@testset "fields and info" begin
    Env("Humanoid-v5"; rows = 3) do env
        terms = fields(env, :observation)
        @test vcat((collect(term.range) for term in terms)...) == 1:348
        obs, told = reset!(env)
        for row in 1:3
            @test same(obs[terms[1].range, row], read(env, :qpos; row = row)[3:end])
            @test same(told.tendon_length[:, row], read(env, :ten_length; row = row))
            @test told.x_position[row] == read(env, :qpos; row = row)[1]
        end
        @test info(env) == told
        xpos, = [field for field in fields(env, :data) if field.name == "xpos"]
        @test xpos.shape == (3, 14) == size(read(env, :xpos))
        told = step!(env, zeros(Float32, 17, 3)).info
        @test size(told.tendon_velocity) == (2, 3)
        @test told.x_position isa Vector{Float64}
    end
    env = Env("Ant-v5")
    @test info(env) == info(Batch(env)) == NamedTuple()
    reset!(env)
    @test step!(env, zeros(Float32, 8)).info.reward_ctrl isa Float32
    @test step!(env, zeros(8)).info.reward_ctrl isa Float64
end

@testset "actions" begin
    # In every kind of array Float32 stays Float32, and all other types become Float64.
    g = golden("HalfCheetah-v5")
    rewards = map((
        action -> Float64.(action),
        identity,
        action -> view([action zero(action)], :, 1),
        action -> view([action zero(action)]', 1, :),
        action -> reshape(action, :, 1),
        action -> view([action action], :, 2:2),
        action -> view([action'; action'], 1:1, :)',
        action -> Real[x for x in action],
        action -> BigFloat.(action),
    )) do form
        env = make(g)
        seed!(env, g.seed)
        reset!(env)
        step!(env, form(g[:action][:, 1])).reward
    end
    @test all(==(g[:reward][1]), rewards[2:7])
    @test all(==(rewards[1]), rewards[8:9])
    @test rewards[1] != g[:reward][1]

    space = action_space(make(g))
    env = Env("HalfCheetah-v5"; rows = 4)
    @test seed_actions!(env, typemax(UInt64)) === env
    drawn = sample_actions(env)
    @test drawn isa Matrix{Float32} && size(drawn) == (6, 4)
    @test all(space.low .<= drawn .<= space.high)
    seed_actions!(env, typemax(UInt64))
    again = zeros(Float32, 6, 4)
    @test sample_actions!(again, env) === again
    @test same(again, drawn)
end

@testset "tuples" begin
    env, same_env = Env("Reacher-v5"), Env("Reacher-v5")
    foreach(e -> (seed!(e, 1); reset!(e)), (env, same_env))
    for (tuple, vector) in (((0.1, -0.2), [0.1, -0.2]), ((0.1f0, 0.2f0), [0.1f0, 0.2f0]), ((1, 0.5f0), [1.0f0, 0.5f0]))
        @test step!(env, tuple) == step!(same_env, vector)
    end
    batch, rows = Batch(env), [0]
    send!(env, (1, 0))
    recv!(rows, batch, env)
    @test vec(batch.obs) == step!(same_env, [1, 0]).obs
    simulate!(env, (0.5, 0.5), 2)
    simulate!(same_env, [0.5, 0.5], 2)
    @test observe(env) == observe(same_env)
    set_state!(env, (0.1, 0.2, 0, 0), (0, 0, 0, 0))
    @test read(env, :qpos) == [0.1, 0.2, 0, 0]
    @test refuses(() -> step!(env, (1.0,)), DimensionMismatch, "vector of 2")
    @test refuses(() -> step!(env, ()), MethodError)
end

@testset "broadcasting" begin
    env = Env("Reacher-v5"; rows = 2)
    batch = reset!(Batch(env), env)
    @test read.(env, [:nq, :nv]) == [4, 4]
    @test getproperty.(batch, (:reward, :terminated)) == ([0.0, 0.0], [false, false])
    @test isopen.(Renderer(env)) === true
end

@testset "state: $(basename(path))" for path in goldens_in("state")
    g = read_golden(path)
    env = make(g)
    seed!(env, g.seed)
    told_by = Dict(name => Symbol(last(split(name, '.'; limit = 2))) for name in keys(g.arrays) if '.' in name)
    for (s, stage) in enumerate(g[:stage])
        if stage == 0
            reset!(env)
        elseif stage == 1
            _, reward, _, _, told = step!(env, g[:action][:, s])
            @test bits(reward) == bits(g[:reward][s])
            @test same(flat(told), g[:info][:, s])
        elseif stage == 2
            @test set_state!(env, g[:set_qpos][:, s], g[:set_qvel][:, s]) === env
        else
            @test simulate!(env, g[:action][:, s], 3) === env
        end
        @test same(observe(env), g[:obs][:, s])
        for (name, array) in told_by
            startswith(name, "model.") && s > 1 && continue
            @test same(collect(Float64, read(env, array))[:], g.arrays[name][:, s])
        end
    end
end

@testset "objects" begin
    env = Env("Ant-v5")
    reset!(env)
    torso = object_index(env, :body, "torso")
    @test torso == 2  # the world is 1
    @test object_name(env, "body", torso) == "torso"
    @test object_name(env, :body, 1) == "world"
    @test read(env, :xpos)[3, torso] == read(env, :qpos)[3]
    @test read(env, :nbody) === Int32(14)
    @test object_count(env, :body) == 14
    @test object_count(env, "tendon") == 0
    @test object_count(env, :actuator) == length(action_space(env).low)
    @test read(env, "opt.timestep") === 0.01
    @test read(env, :geom_rgba) isa Matrix{Float32}
    @test read(env, :jnt_limited) isa Vector{UInt8}
end

@testset "snapshots" begin
    g = golden("Ant-v5")
    env = make(g)
    batch = Batch(env)
    # After each step another environment continues.
    images = Vector{UInt8}[]
    other = make(g; rows = 2)
    hand_over(env, batch, t) = begin
        image = snapshot(env)
        restore!(other, image; rows = 2)
        restore!(env, isodd(t) ? image : snapshot(other; rows = 2))
        push!(images, image)
    end
    @test agrees(play(g, env, batch; meddle = hand_over), g)
    @test allunique(images)
    @test restore!(env, view(images[end], :)) === env
    step!(batch, env, g[:action][:, end])
    @test same(vec(batch.obs), g[:obs][:, end])
end

@testset "spaces" begin
    Env("Reacher-v5") do env
        low, high = space = action_space(env)
        @test space isa MJEnv.Box{Float32} && (low, high) == (space.low, space.high) == ([-1, -1], [1, 1])
        @test sample_actions(env) in space && !([2, 0] in space)
        @test observation_space(env) isa MJEnv.Box{Float64}
        @test sprint(show, space) == "MJEnv.Box(Float32[-1.0, -1.0], Float32[1.0, 1.0])"
    end
end

@testset "what Julia's functions show" begin
    env = Env("Ant-v5"; arrays = "xpos")
    field, = fields(env, :arrays)
    @test sprint(show, field) == "MJEnv.Field(\"xpos\", 3 × 14)"
    option, = filter(option -> option.name == :frame_skip, MJEnv.schema("Ant-v5"))
    @test sprint(show, option) == "MJEnv.Option(:frame_skip, 5)"
    @test sprint(show, Batch(env; dtype = Float32)) == "Batch{Float32} of 105 observations × 1 rows"
    # The name is that of the standard library, so that programs can use both.
    @test seed! === MJEnv.Random.seed!
end

@testset "life" begin
    env = Env("Reacher-v5"; rows = 2)
    @test isopen(env)
    @test sprint(show, env) == "Env(\"Reacher-v5\"; rows = 2)"
    @test close(env) === nothing
    @test close(env) === nothing
    @test !isopen(env)
    @test sprint(show, env) == "Env(\"Reacher-v5\"; rows = 2) (closed)"
    kept = Ref{Env}()
    @test Env(env -> (kept[] = env; isopen(env)), "Reacher-v5")
    @test !isopen(kept[])
    @test_throws ErrorException Env(env -> (kept[] = env; error("out of here")), "Reacher-v5")
    @test !isopen(kept[])
end

@testset "documentation of $name" for name in [
    names(MJEnv)
    [:info, :reset_info, :final_info, :arrays, :stream]
    [:spec, :options, :fields, :Field, :ids, :schema, :Option, :version, :Status, :Box, :Picture, :Rows]
]
    @test haskey(Base.Docs.meta(MJEnv), Base.Docs.Binding(MJEnv, name))
end
