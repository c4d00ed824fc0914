# Compares what the library declares with what Gymnasium declares, which is recorded in schema.txt.

function read_schema()
    schema = Dict{String,Vector{Vector{String}}}()
    id = ""
    for line in eachline(joinpath(GOLDEN, "schema.txt"))
        words = String.(split(line))
        if words[1] == "id"
            id = words[2]
            schema[id] = []
        elseif id != "" && words[1] != "#"
            push!(schema[id], words)
        end
    end
    return schema
end

const SCHEMA = read_schema()
const KINDS = Dict(
    "flag" => MJEnv.MJENV_KIND_FLAG,
    "integer" => MJEnv.MJENV_KIND_INTEGER,
    "reals" => MJEnv.MJENV_KIND_REALS,
    "string" => MJEnv.MJENV_KIND_STRING,
    "string_or_int" => MJEnv.MJENV_KIND_STRING_OR_INT,
)

default_of(kind, words) =
    kind == "flag" ? words == ["1"] :
    kind == "string_or_int" ? parse(Int, words[1]) : option_value(kind, words)

const TYPES = Dict(
    MJEnv.MJENV_DTYPE_FLOAT64 => "numpy_float64",
    MJEnv.MJENV_DTYPE_ACTION => "action_dtype",
    MJEnv.MJENV_DTYPE_NATIVE_FLOAT => "python_float",
    MJEnv.MJENV_DTYPE_NATIVE_INT => "python_int",
    MJEnv.MJENV_DTYPE_INT64 => "numpy_int64",
)

listed(fields) = [[field.name, string(length(field.range)), TYPES[field.dtype]] for field in fields]

# If all bounds are equal, schema.txt holds one.
bound_of(words, count) = length(words) == 1 ? fill(real_of(words[1]), count) : real_of.(words)

@test sort!(collect(keys(SCHEMA))) == MJEnv.ids()

@testset "$id" for id in MJEnv.ids()
    lines(key) = [words[2:end] for words in SCHEMA[id] if words[1] == key]
    only_line(key) = (found = lines(key); @test(length(found) == 1); found[1])
    number(key) = real_of(only_line(key)[1])

    gymnasium = lines("option")
    ours = MJEnv.schema(id)
    @test [String(o.name) for o in ours[1:length(gymnasium)]] == [words[1] for words in gymnasium]
    @test [o.kind for o in ours[1:length(gymnasium)]] == [KINDS[words[2]] for words in gymnasium]
    @test [o.default for o in ours[1:length(gymnasium)]] == [default_of(words[2], words[3:end]) for words in gymnasium]
    @test all(o -> !isempty(o.doc) && o.low <= o.high && o.count == length(o.default) || o.default isa String, ours)

    Env(id) do env
        threshold = only_line("reward_threshold")
        promised = spec(id)
        @test promised.id == id == "$(promised.robot)-v$(promised.version)"
        @test promised.max_episode_steps == number("max_episode_steps")
        @test promised.reward_threshold == (threshold[1] == "none" ? nothing : real_of(threshold[1]))
        @test spec(env) == promised
        @test env.dt == number("dt")
        @test env.frame_skip == number("frame_skip")

        for (role, space, T) in ((:observation, observation_space(env), Float64), (:action, action_space(env), Float32))
            (dtype, count), = [words[2:3] for words in lines("space") if words[1] == String(role)]
            @test dtype == lowercase(string(T))
            for (side, bound) in ((:low, space.low), (:high, space.high))
                words, = [words[2:end] for words in lines(String(side)) if words[1] == String(role)]
                @test bound isa Vector{T}
                @test bound == bound_of(words, parse(Int, count))
            end
            @test last(fields(env, role)[end].range) == parse(Int, count)
        end

        @test listed(fields(env, :info)) == lines("info")
        @test listed(fields(env, :reset_info)) == lines("reset_info")
        @test [TYPES[field.dtype] for field in fields(env, :reward)] == only_line("reward")
        @test [[f.name, string(length(f.range))] for f in fields(env, :structure)] == lines("structure")
    end
end
