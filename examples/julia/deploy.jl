# Plays a policy that extras/curricula/python/train_*.py saved. It needs neither Python nor a learning library.
#
#     julia --project=bindings/julia examples/julia/deploy.jl POLICY [EPISODES [SEED]]        (3 episodes from seed 100)
#
# Prints a line for each episode: its length, its return as a hexadecimal float, and a checksum over the bits of all
# actions. examples/cpp/deploy.cpp, extras/curricula/python/deploy.py and examples/rust/src/bin/deploy.rs print the same.
# docs/training.md describes the file.

using MJEnv
using Printf: @printf

# Julia has a tanh of its own, whose last bits differ from those of the C library, which the other languages use.
squash(x::Float64) = ccall((:tanh, "libm.so.6"), Cdouble, (Cdouble,), x)

struct Layer
    squashes::Bool  # whether tanh follows
    bias::Vector{Float64}
    weights::Vector{Vector{Float64}}  # a vector for each output
end

struct Policy
    id::String
    numbers::Dict{String,Vector{Float64}}  # mean, scale, clip, low, high
    layers::Vector{Layer}
end

function load(path)
    lines = split.(readlines(path))
    length(lines) > 1 && lines[1] in (["mjenv-policy", "1"], ["mjenv-policy", "2"]) || error("$path: no policy")
    policy = Policy(lines[2][2], Dict(), [])
    for line in lines[3:end]
        name, words = line[1], line[2:end]
        if name == "layer"
            words[3] in ("tanh", "identity") || error("unknown activation ", words[3])
            push!(policy.layers, Layer(words[3] == "tanh", [], []))
        elseif name == "bias"
            append!(last(policy.layers).bias, parse.(Float64, words))
        elseif name == "weights"
            push!(last(policy.layers).weights, parse.(Float64, words))
        elseif name != "about" && name != "input"  # what version 2 tells of the environment
            policy.numbers[name] = parse.(Float64, words)
        end
    end
    return policy
end

# Throws unless the sizes of the policy's arrays fit each other and the environment.
function check(policy::Policy, observations, actions)
    width = observations
    for layer in policy.layers
        fits = length(layer.weights) == length(layer.bias) && all(row -> length(row) == width, layer.weights)
        fits || error("layers that do not fit")
        width = length(layer.bias)
    end
    width == actions || error("the last layer must have as many outputs as an action has numbers")
    sizes = ("mean" => observations, "scale" => observations, "clip" => 1, "low" => actions, "high" => actions)
    for (name, size) in sizes
        length(get(policy.numbers, name, [])) == size || error("$name is missing or of another length")
    end
end

# The sum begins with the bias and adds from the left.
function output(bias, weights, inputs)
    sum = bias
    for (weight, input) in zip(weights, inputs)
        sum += weight * input
    end
    return sum
end

function apply(layer::Layer, inputs)
    sums = [output(bias, weights, inputs) for (bias, weights) in zip(layer.bias, layer.weights)]
    return layer.squashes ? squash.(sums) : sums
end

function act(policy::Policy, observation)
    numbers = policy.numbers
    bound = numbers["clip"][1]
    values = clamp.((observation .- numbers["mean"]) ./ numbers["scale"], -bound, bound)
    for layer in policy.layers
        values = apply(layer, values)
    end
    return Float32.(clamp.(values, numbers["low"], numbers["high"]))
end

function play(policy::Policy, env::Env, episodes, seed)
    batch = Batch(env)
    check(policy, size(batch.obs, 1), env.action_count)
    seed!(env, seed)
    for _ in 1:episodes
        reset!(batch, env)
        steps, total, checksum = 0, 0.0, 0xcbf29ce484222325
        while !(batch.terminated[1] || batch.truncated[1])
            action = act(policy, view(batch.obs, :, 1))
            for number in action
                checksum = (checksum ⊻ reinterpret(UInt32, number)) * 0x00000100000001b3
            end
            step!(batch, env, action)
            total += batch.reward[1]
            steps += 1
        end
        @printf("%d %a %016x\n", steps, total, checksum)
    end
end

function main(arguments)
    if !(1 <= length(arguments) <= 3)
        println(stderr, "deploy.jl POLICY [EPISODES [SEED]]")
        exit(2)
    end
    policy = load(arguments[1])
    episodes = length(arguments) > 1 ? parse(Int, arguments[2]) : 3
    seed = length(arguments) > 2 ? parse(Int, arguments[3]) : 100
    Env(env -> play(policy, env, episodes, seed), policy.id)
end

main(ARGS)
