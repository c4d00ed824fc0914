# Tests many rows: automatic resets, rollouts, send! and recv!, copies, images and random streams.

# ---- The three modes of automatic resets, compared with Gymnasium's SyncVectorEnv ----

const VECTOR_ROWS = 3

# The part of a recorded column that belongs to a row.
function row_part(column, row)
    count = length(column) ÷ VECTOR_ROWS
    return column[((row - 1) * count + 1):(row * count)]
end

# Whether a row has exactly the recorded keys, with the recorded numbers. told holds its numbers by key, or is nothing.
function infos_agree(g, table, fields, line, row, told)
    values, masks = g[Symbol(table)][:, line], g[Symbol(table, "_mask")][:, line]
    counts = [parse(Int, words[2]) for words in fields]
    mask = row_part(masks, row)
    offset = (row - 1) * reduce(+, counts; init = 0)
    for (f, words) in enumerate(fields)
        key = Symbol(words[1])
        (told !== nothing && haskey(told, key)) == (mask[f] == 1) || return false
        if mask[f] == 1
            got = vec(collect(Float64, selectdim(told[key], ndims(told[key]), row)))
            same(got, values[(offset + 1):(offset + counts[f])]) || return false
        end
        offset += counts[f]
    end
    return true
end

function play_reset(g, env, batch, index)
    mask = g[:reset_mask][:, index] .== 1
    seeds = vec(g[:reset_seed][:, index])
    seed!(env, max.(seeds, 0); rows = seeds .>= 0)
    reset!(batch, env; rows = mask)
    return all(filter(row -> mask[row], 1:VECTOR_ROWS)) do row
        batch.was_reset[row] &&
            same(batch.obs[:, row], row_part(g[:reset_obs][:, index], row)) &&
            infos_agree(g, "reset_reset_info", g.reset_info_fields, index, row, MJEnv.reset_info(batch))
    end
end

function play_step(g, env, batch, step)
    step!(batch, env, reshape(g[:action][:, step], :, VECTOR_ROWS))
    same(batch.reward, g[:reward][:, step]) || return false
    batch.terminated == (g[:terminated][:, step] .== 1) || return false
    batch.truncated == (g[:truncated][:, step] .== 1) || return false
    return all(1:VECTOR_ROWS) do row
        told = batch.was_reset[row] ? MJEnv.reset_info(batch) : info(batch)
        final = g[:final_obs_mask][row, step] == 1
        same(batch.obs[:, row], row_part(g[:obs][:, step], row)) &&
            infos_agree(g, "info", g.info_fields, step, row, told) &&
            infos_agree(g, "reset_info", g.reset_info_fields, step, row, told) &&
            infos_agree(g, "final_info", g.info_fields, step, row, final ? MJEnv.final_info(batch) : nothing) &&
            (!final || same(batch.final_obs[:, row], row_part(g[:final_obs][:, step], row)))
    end
end

@testset "$(basename(path))" for path in goldens_in("vector")
    g = read_golden(path)
    env = make(g; rows = VECTOR_ROWS, num_threads = 2)
    batch = Batch(env)
    for step in 1:size(g[:reward], 2)
        index = findfirst(==(step - 1), vec(g[:reset_at]))
        index === nothing || @test play_reset(g, env, batch, index)
        @test play_step(g, env, batch, step)
    end
end

# ---- Rollouts ----

@testset "rollout: $name" for name in ("Ant-v5", "Hopper-v4", "Humanoid-v5", "Reacher-v5.options")
    g = golden(name)
    last = g[:reset_at][2]
    steps = last + 3
    # There are more actions than the episode has steps.
    actions = repeat(g[:action][:, 1:steps], 1, 1, 2)
    env = make(g; rows = 2, num_threads = 2)
    seed!(env, [g.seed, g.seed])
    reset!(env)
    played = rollout(env, actions)
    @test size(played.obs) == (env.obs_count, steps, 2)
    for row in 1:2
        @test same(played.obs[:, 1:last, row], g[:obs][:, 1:last])
        @test same(played.reward[1:last, row], g[:reward][1:last])
        @test played.terminated[1:last, row] == (g[:terminated][1:last] .== 1)
        @test played.truncated[1:last, row] == (g[:truncated][1:last] .== 1)
        for step in (1, last)
            told = map(value -> selectdim(selectdim(value, ndims(value), row), ndims(value) - 1, step), played.info)
            @test same(flat(told), g[:info][:, step])
        end
        # The row stays where its episode ended.
        @test all(==(0), played.reward[(last + 1):end, row])
        @test all(played.terminated[last:end, row] .| played.truncated[last:end, row])
        @test same(played.obs[:, end, row], g[:obs][:, last])
    end
    # A rollout of one row into a batch of Float32.
    one = make(g)
    batch = Batch(one; dtype = Float32, steps = steps)
    seed!(one, g.seed)
    reset!(one)
    @test rollout!(batch, one, actions[:, :, 1]) === batch
    @test same(batch.obs, Float32.(played.obs[:, :, 1]))
    @test same(batch.reward, played.reward[:, 1])
end

# ---- send! and recv! ----

@testset "send and receive: $name, $threads threads" for (name, threads) in
    (("Hopper-v5", 1), ("Reacher-v4", 3), ("Humanoid-v5", 2))

    g = golden(name)
    steps = size(g[:action], 2)
    rows = 5
    env = make(g; rows = rows, num_threads = threads, autoreset_mode = :next_step)
    batch = Batch(env)
    numbers = zeros(Int, rows)
    step = ones(Int, rows)  # the recorded step that each row plays next
    fine = true
    seed!(env, fill(g.seed, rows))
    reset!(batch, env)
    send!(env, repeat(g[:action][:, 1], 1, rows))
    under_way = rows
    while under_way > 0
        least = min(2, under_way)
        received = collect(recv!(numbers, batch, env; least = least))
        fine &= length(received) >= least && allunique(received) && all(==(0), numbers[(length(received) + 1):end])
        for row in received
            t = step[row]
            if batch.was_reset[row]
                episode = findfirst(==(t - 1), vec(g[:reset_at]))
                fine &= same(batch.obs[:, row], g[:reset_obs][:, episode])
            else
                fine &= same(batch.obs[:, row], g[:obs][:, t]) && bits(batch.reward[row]) == bits(g[:reward][t])
                step[row] += 1
            end
        end
        on = filter(row -> step[row] <= steps, received)
        send!(env, g[:action][:, step[on]]; rows = on)
        under_way += length(on) - length(received)
    end
    @test fine
    @test all(==(steps + 1), step)
end

@testset "rows under way" begin
    env = Env("HalfCheetah-v5"; rows = 4, num_threads = 2)
    batch, other = Batch(env), Batch(env)
    rows, action = zeros(Int, 4), zeros(Float32, 6, 4)
    @test refuses(() -> recv!(rows, batch, env), MJENV_E_NOT_PENDING, "send")
    @test refuses(() -> send!(env, action), MJENV_E_NOT_RESET, "reset")
    reset!(batch, env)
    @test refuses(() -> send!(env, action; rows = [1, 5]), DimensionMismatch, "6×2")
    @test refuses(() -> send!(env, action[:, 1:2]; rows = [1, 5]), ArgumentError, "row 5", "1:4")
    @test refuses(() -> send!(env, action[:, 1:2]; rows = [3, 3]), MJENV_E_PENDING, "row 2", "under way")
    @test refuses(() -> send!(env, fill(NaN, 6, 4)), MJENV_E_VALUE, "row 0")
    @test send!(env, action[:, 1:0]; rows = Int[]) === env
    send!(env, action[:, 1]; rows = 2:2)
    send!(env, action[:, 1:2]; rows = [4, 1])
    @test refuses(() -> step!(other, env, action), MJENV_E_PENDING, "under way")
    @test refuses(() -> reset!(other, env), MJENV_E_PENDING, "under way")
    @test refuses(() -> snapshot(env), MJENV_E_PENDING, "under way")
    @test refuses(() -> recv!(rows, Batch(env; steps = 2), env), DimensionMismatch, "obs")
    @test refuses(() -> recv!(rows, batch, env; least = 4), MJENV_E_SIZE, "4", "3")
    @test refuses(() -> recv!(zeros(Int, 2), batch, env; least = 3), MJENV_E_SIZE, "2", "3")
    @test refuses(() -> recv!(rows, batch, env; timeout = -1), ArgumentError, "timeout")
    @test refuses(() -> recv!(rows, batch, env; timeout = NaN), ArgumentError, "timeout")
    before = batch.obs[:, 3]
    # A timeout of 0 returns the rows that are done.
    received = Int[]
    while length(received) < 3
        append!(received, recv!(rows, batch, env; least = 3 - length(received), timeout = 0))
    end
    @test sort(received) == [1, 2, 4]
    @test batch.obs[:, 3] == before
    @test info(batch).x_position isa Vector{Float64}
    step!(batch, env, action)
    # The environment is closed, and dropped, while rows are under way.
    send!(env, action)
    @test close(env) === nothing
    @test refuses(() -> recv!(rows, batch, env), ArgumentError, "closed")
    drop() = (e = Env("Ant-v5"; rows = 8, num_threads = 3); reset!(e); send!(e, zeros(8, 8)); nothing)
    foreach(_ -> drop(), 1:5)
    GC.gc()
    GC.gc()
end

@testset "a masked step" begin
    g = golden("Ant-v5")
    env = make(g; rows = 3, num_threads = 2)
    batch = Batch(env)
    seed!(env, fill(g.seed, 3))
    reset!(batch, env)
    action = repeat(g[:action][:, 1], 1, 3)
    image = snapshot(env; rows = 2)
    @test step!(batch, env, action; rows = [true, false, true]) === batch
    for (row, wanted) in ((1, g[:obs][:, 1]), (2, g[:reset_obs][:, 1]), (3, g[:obs][:, 1]))
        @test same(batch.obs[:, row], wanted)
    end
    @test snapshot(env; rows = 2) == image
    stepped = step!(env, action; rows = BitVector([false, true, false]))
    @test same(stepped.obs[:, 2], g[:obs][:, 1])
    @test same(stepped.obs[:, 1], batch.obs[:, 1]) && stepped.reward[1] == 0
    @test refuses(() -> step!(batch, env, action; rows = [true]), DimensionMismatch, "mask", "3")
end

# Calls f with a stand-in for the library's function of that name.
function standing_in(f, name, pointer)
    index = findfirst(==(name), MJEnv.FUNCTIONS)
    library = MJEnv.library_of(MJEnv.Engine(nothing))
    real = MJEnv.address(library, index)
    library.addresses[index] = pointer
    try
        return f(real)
    finally
        library.addresses[index] = real
    end
end

const REAL = Ref{Ptr{Cvoid}}(C_NULL)

function receive_short_of_memory(env, least, timeout, rows, capacity, count, out)
    ccall(REAL[], Int32, (Ptr{Cvoid}, Int64, Cdouble, Ptr{Int64}, Int64, Ptr{Int64}, Ptr{Cvoid}),
          env, least, timeout, rows, capacity, count, out)
    return Int32(MJEnv.MJENV_E_MEMORY)
end

@testset "rows that failed for want of memory" begin
    env = Env("Reacher-v5"; rows = 2)
    batch, rows = reset!(Batch(env), env), zeros(Int, 2)
    send!(env, zeros(2, 2))
    pointer = @cfunction(receive_short_of_memory, Int32,
                         (Ptr{Cvoid}, Int64, Cdouble, Ptr{Int64}, Int64, Ptr{Int64}, Ptr{Cvoid}))
    standing_in(:mjenv_recv, pointer) do real
        REAL[] = real
        @test refuses(() -> recv!(rows, batch, env; least = 2), MJEnv.MJENV_E_MEMORY)
    end
    @test sort(rows) == [1, 2]
end

# ---- Copies, images of all rows, streams, exported arrays ----

@testset "copies and images of all rows: $name" for name in ("Ant-v5", "Humanoid-v5")
    g = golden(name)
    env, other = make(g; rows = 3), make(g; rows = 3, num_threads = 3)
    seed!(env, [1, g.seed, 2])
    reset!(env)
    step!(env, repeat(g[:action][:, 1], 1, 3))
    @test copy_row!(env, 2, [true, false, false]) === env
    @test restore!(other, snapshot(env; rows = :); rows = :) === other
    for e in (env, other)
        obs = step!(e, repeat(g[:action][:, 2], 1, 3)).obs
        @test same(obs[:, 1], g[:obs][:, 2])
        @test same(obs[:, 2], g[:obs][:, 2])
        @test obs[:, 3] != g[:obs][:, 2]
    end
    @test snapshot(env; rows = :) == snapshot(other; rows = :)
    @test refuses(() -> restore!(make(g; rows = 2), snapshot(env; rows = :); rows = :), MJENV_E_SNAPSHOT, "3", "2")
    @test refuses(() -> restore!(env, snapshot(env); rows = 1), MJENV_E_SNAPSHOT, "3", "1")
    @test refuses(() -> copy_row!(env, 4, trues(3)), ArgumentError, "row 4", "1:3")
    @test refuses(() -> copy_row!(env, 1, trues(2)), DimensionMismatch, "2", "3")
end

# The numbers are those of np.random.default_rng(42) in NumPy.
@testset "streams" begin
    env = Env("HalfCheetah-v5"; rows = 2)
    @test refuses(() -> MJEnv.stream(env), MJENV_E_NOT_RESET, "row 0")
    seed!(env, 42)
    state, increment = 274674114334540486603088602300644985544, 332724090758049132448979897138935081983
    halves(x) = (UInt64(x & typemax(UInt64)), UInt64(x >> 64))
    words = (halves(state)..., halves(increment)..., UInt64(0), UInt64(0))
    @test MJEnv.stream(env) === words
    @test set_stream!(env, MJEnv.stream(env); row = 2) === env
    reset!(env)
    @test same(read(env, :qpos; row = 1), read(env, :qpos; row = 2))
    @test MJEnv.stream(env; row = 1) === MJEnv.stream(env; row = 2)
    @test MJEnv.stream(env; row = 1) !== words
    @test refuses(() -> set_stream!(env, (UInt64(1), UInt64(2), UInt64(4), UInt64(3), UInt64(0), UInt64(0))), MJENV_E_VALUE, "odd")
    @test refuses(() -> set_stream!(env, UInt64[1, 2, 3]), DimensionMismatch, "words", "6")
    @test refuses(() -> set_stream!(env, words; row = 3), ArgumentError, "row 3")
    # After integers(0, 10), which uses half of a draw.
    half = (halves(95376830783351682500486580248632280039)..., halves(increment)..., UInt64(1), UInt64(3324115917))
    set_stream!(env, half)
    @test MJEnv.stream(env) === half
end

@testset "exported arrays" begin
    env = Env("Ant-v5"; rows = 2, arrays = "xpos cfrc_ext ncon time")
    batch = Batch(env)
    reset!(batch, env)
    for _ in 1:10
        step!(batch, env, sample_actions(env))
        exported = MJEnv.arrays(batch)
        @test keys(exported) == (:xpos, :cfrc_ext, :ncon, :time)
        for row in 1:2, name in keys(exported)
            wanted = read(env, name; row = row)
            @test same(collect(selectdim(exported[name], ndims(exported[name]), row)), collect(wanted))
        end
    end
    @test eltype(MJEnv.arrays(batch).ncon) == Int32
    @test MJEnv.arrays(Batch(Env("Ant-v5"))) == NamedTuple()
    @test MJEnv.final_info(batch) == NamedTuple()
    @test refuses(() -> Env("Ant-v5"; arrays = "xpos x_pos"), MJENV_E_NAME, "x_pos")
end

@testset "bad rollouts" begin
    env = Env("Reacher-v5"; rows = 2)
    reset!(env)
    batch = Batch(env; steps = 4)
    before = snapshot(env; rows = :)
    @test refuses(() -> rollout(env, zeros(2, 4)), DimensionMismatch, "2 × steps × 2")
    @test refuses(() -> rollout(env, zeros(3, 4, 2)), DimensionMismatch, "2 × steps × 2", "(3, 4, 2)")
    @test refuses(() -> rollout(env, zeros(2, 4, 1)), DimensionMismatch)
    @test refuses(() -> rollout(env, zeros(2, 0, 2)), MJENV_E_VALUE, "steps")
    @test refuses(() -> rollout(env, fill(Inf, 2, 4, 2)), MJENV_E_VALUE, "row 0")
    @test refuses(() -> rollout!(batch, env, zeros(2, 5, 2)), DimensionMismatch, "obs")
    @test refuses(() -> step!(batch, env, zeros(2, 2)), DimensionMismatch, "obs")
    @test snapshot(env; rows = :) == before
end
