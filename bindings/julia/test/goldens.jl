# Reads and plays trajectories of Gymnasium, which tests/golden/record.py recorded.

struct Golden
    name::String
    id::String
    seed::BigInt
    options::Vector{Pair{Symbol,Any}}
    info_fields::Vector{Vector{SubString{String}}}  # name, count, type
    reset_info_fields::Vector{Vector{SubString{String}}}
    arrays::Dict{String,Array}  # a matrix has a column for each step
end

Base.getindex(golden::Golden, array::Symbol) = golden.arrays[String(array)]

const ELEMENT_TYPES = Dict("f4" => Float32, "f8" => Float64, "u1" => UInt8, "i8" => Int64, "u8" => UInt64)

real_of(word) = parse(Float64, word)  # C99 hexadecimal, inf and nan included

function option_value(kind, words)
    kind == "integer" && return parse(Int, words[1])
    kind == "reals" && return length(words) == 1 ? real_of(words[1]) : Tuple(map(real_of, words))
    kind == "string" && return String(words[1])
    error("unknown kind of option: $kind")
end

function read_golden(path)
    open(path) do file
        readline(file) == "mjenv-golden 1" || error("$path is no golden")
        single = Dict{String,String}()
        options, info, reset_info, listed = Pair{Symbol,Any}[], [], [], []
        for line in eachline(file)
            line == "data" && break
            key, words = Iterators.peel(split(line))
            words = collect(words)
            if key == "option"
                push!(options, Symbol(words[1]) => option_value(words[2], words[3:end]))
            elseif key in ("info", "reset_info")
                push!(key == "info" ? info : reset_info, words)
            elseif key == "array"
                push!(listed, words)
            else
                single[key] = join(words, ' ')
            end
        end
        push!(options, :norm => single["norm"])
        arrays = Dict(
            String(words[1]) => read!(
                file,
                Array{ELEMENT_TYPES[words[2]]}(undef, reverse(parse.(Int, words[3:end]))...),
            ) for words in listed
        )
        eof(file) || error("$path holds more than it lists")
        Golden(basename(path), single["id"], parse(BigInt, single["seed"]), options, info, reset_info, arrays)
    end
end

# The folder of the recordings that fit this CPU: the C library chooses variants of its functions by CPU.
function recordings()
    sine = ccall((:sin, "libm.so.6"), Cdouble, (Cdouble,), 692)
    sine == 0x1.80869e3fad89ap-1 && return joinpath(GOLDEN, "fma")
    sine == 0x1.80869e3fad899p-1 && return joinpath(GOLDEN, "sse2")
    error("this C library's sin(692) is $sine, which belongs to no recording")
end

goldens_in(folder) = filter(endswith(".golden"), readdir(joinpath(recordings(), folder); join = true))
golden(name) = read_golden(joinpath(recordings(), "trajectories", name * ".golden"))

make(g::Golden; options...) = Env(g.id; g.options..., options...)

bits(x::Float64) = reinterpret(UInt64, x)
bits(x::Float32) = reinterpret(UInt32, x)
bits(x::Integer) = x

# What a recording with these elements has of a row's numbers: the numbers, or their hash.
recorded(::Type, numbers) = vec(numbers)
recorded(::Type{UInt64}, numbers) = foldl(bits.(numbers); init = 0xcbf29ce484222325) do hash, word
    hash = (hash ⊻ word) * 0x00000100000001b3
    return hash ⊻ (hash >> 32)
end

# Columns of numbers, and the recorded hash of each.
same(got::AbstractArray{Float64}, wanted::AbstractArray{UInt64}) =
    [recorded(UInt64, column) for column in eachcol(got)] == vec(wanted)

# Whether two arrays are equal in every bit. Prints where they differ.
function same(got::AbstractArray, wanted::AbstractArray)
    if size(got) != size(wanted)
        println(stderr, "sizes differ: ", size(got), " ", size(wanted))
        return false
    end
    for index in eachindex(got, wanted)
        bits(got[index]) == bits(wanted[index]) && continue
        println(stderr, "first difference at ", index, ": ", got[index], " ", wanted[index])
        return false
    end
    return true
end

flat(info::NamedTuple) = Float64[x for value in info for x in value]

const INFO_TYPES = Dict(
    "numpy_float64" => _ -> Float64,
    "action_dtype" => identity,
    "python_float" => _ -> Float64,
    "python_int" => _ -> Int64,
    "numpy_int64" => _ -> Int64,
)

# Whether an info has the same keys, order, sizes and types as Gymnasium's.
function described(info::NamedTuple, listed, action_type)
    return collect(String.(keys(info))) == [words[1] for words in listed] &&
           [length(value) for value in info] == [parse(Int, words[2]) for words in listed] &&
           [eltype(value) for value in info] == [INFO_TYPES[words[3]](action_type) for words in listed]
end

# Plays a recording into a batch. Before each step it calls meddle, which may do things that must not change the
# results.
function play(g::Golden, env::Env, batch::Batch; meddle = (env, batch, t) -> nothing)
    steps = size(g[:action], 2)
    got = Golden(g.name, g.id, g.seed, [], [], [], Dict(name => zero(array) for (name, array) in g.arrays))
    episode = 0
    keep(array, t, numbers) = got[array][:, t] .= recorded(eltype(g[array]), numbers)
    seed!(env, g.seed)
    for t in 1:steps
        meddle(env, batch, t)
        if t - 1 in g[:reset_at]
            episode += 1
            reset!(batch, env)
            got[:reset_at][episode] = t - 1
            keep(:reset_obs, episode, batch.obs)
            got[:reset_info][:, episode] = flat(info(batch))
            @test described(info(batch), g.reset_info_fields, Float64)
        end
        step!(batch, env, g[:action][:, t])
        got[:action][:, t] = g[:action][:, t]
        keep(:obs, t, batch.obs)
        got[:reward][t] = batch.reward[1]
        got[:terminated][t] = batch.terminated[1]
        got[:truncated][t] = batch.truncated[1]
        got[:info][:, t] = flat(info(batch))
        keep(:qpos, t, read(env, :qpos))
        keep(:qvel, t, read(env, :qvel))
    end
    @test described(info(batch), g.info_fields, eltype(g[:action]))
    return got
end

function agrees(got::Golden, wanted::Golden)
    differing = [name for name in sort!(collect(keys(wanted.arrays))) if !same(got.arrays[name], wanted.arrays[name])]
    isempty(differing) || println(stderr, wanted.name, " differs in ", join(differing, ", "))
    return isempty(differing)
end
