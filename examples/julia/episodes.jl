# Plays three seeded episodes of each id.
#
#     julia --project=bindings/julia examples/julia/episodes.jl [--norm auto|fused|plain] ID...
#
# Prints ID, steps, return, steps per second and a checksum over every bit of every output, separated by tabs.

using MJEnv

const EPISODES = 3
const SEED = 42

mix(hash::UInt64, word::UInt64) = (hash ⊻ word) * 0x00000100000001b3
mix(hash::UInt64, value::Float64) = mix(hash, reinterpret(UInt64, value))
mix(hash::UInt64, flag::Bool) = mix(hash, UInt64(flag))
mix(hash::UInt64, values::Array) = foldl(mix, values; init = hash)

struct Episodes
    steps::Int
    total::Float64
    checksum::UInt64
end

function play(env::Env)
    batch = Batch(env)
    action = sample_actions(env)
    steps, total, checksum = 0, 0.0, 0xcbf29ce484222325
    seed!(env, SEED)
    seed_actions!(env, SEED)
    for episode in 1:EPISODES
        reset!(batch, env)
        checksum = mix(mix(checksum, batch.obs), batch.reset_info)
        while !(batch.terminated[1] || batch.truncated[1])
            step!(batch, env, sample_actions!(action, env))
            checksum = mix(mix(checksum, batch.obs), batch.reward)
            checksum = mix(mix(checksum, batch.terminated), batch.truncated)
            checksum = mix(checksum, batch.step_info)
            total += batch.reward[1]
            steps += 1
        end
    end
    return Episodes(steps, total, checksum)
end

function main(arguments)
    norm = "auto"
    if length(arguments) >= 2 && arguments[1] == "--norm"
        norm = arguments[2]
        arguments = arguments[3:end]
    end
    if isempty(arguments)
        println(stderr, "usage: episodes.jl [--norm auto|fused|plain] ID...; the ids are ", join(MJEnv.ids(), ' '))
        exit(2)
    end
    # Makes Julia compile everything first, so that the measured times do not include the compiler.
    Env(play, first(arguments); max_episode_steps = 1)
    for id in arguments
        println(stderr, "playing ", id, " ...")
        Env(id; norm = norm) do env
            start = time_ns()
            played = play(env)
            rate = played.steps / ((time_ns() - start) * 1e-9)
            checksum = string(played.checksum; base = 16, pad = 16)
            println(join((id, played.steps, played.total, round(Int, rate), checksum), '\t'))
        end
    end
end

# The tests include this file only for the function play.
abspath(PROGRAM_FILE) == @__FILE__() && main(ARGS)
