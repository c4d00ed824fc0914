# Steps Hopper-v5 in Julia on request: worker.jl ID, where ID is Hopper-v5 or JuliaHopper-v5. peers/worker.py describes the
# commands.
using MJEnv

include(joinpath(@__DIR__, "..", "..", "bindings", "julia", "test", "hopper.jl"))

const WARM_UP = 30

struct Steps
    env::Env
    batch::Batch
    actions::Vector{Matrix{Float32}}  # drawn before measuring
end

function Steps(id, rows, seed)
    env = Env(id; rows = rows, autoreset_mode = "next_step")
    batch = Batch(env)
    seed!(env, seed)
    reset!(batch, env)
    seed_actions!(env, seed)
    return Steps(env, batch, [Float32.(sample_actions(env)) for _ in 1:max(64, 16384 ÷ rows)])
end

function run(steps::Steps, seconds, least = 1)
    taken, start = 0, time_ns()
    while (time_ns() - start) / 1e9 < seconds || taken < least
        step!(steps.batch, steps.env, steps.actions[taken % length(steps.actions) + 1])
        taken += 1
    end
    return taken * size(steps.actions[1], 2), (time_ns() - start) / 1e9
end

function serve(id)
    steps = nothing
    for line in eachline(stdin)
        command, arguments = Iterators.peel(split(line))
        answer = "ok"
        if command == "about"
            answer = "Julia $VERSION"
        elseif command == "open"
            _, rows, _, seed = arguments
            steps = Steps(id, parse(Int, rows), parse(Int, seed))
            run(steps, 0, WARM_UP)
        elseif command == "run"
            answer = join(run(steps, parse(Float64, first(arguments))), " ")
        end
        println(answer)
        flush(stdout)
    end
end

serve(ARGS[1])
