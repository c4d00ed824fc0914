# Written by tools/declarations.py from learn.h in extras/learn/include/mjenv: do not edit.

const MJENV_LEARN_ABI_VERSION = 1

struct mjenv_learner end
struct mjenv_policy end

@enum mjenv_learned::Int32 begin
    MJENV_LEARNED_LAST = 1
    MJENV_LEARNED_BEST = 2
end

@enum mjenv_precision::Int32 begin
    MJENV_PRECISION_FLOAT64 = 1
    MJENV_PRECISION_FLOAT32 = 2
end

Base.@kwdef struct mjenv_learn_calls
    struct_size::UInt32 = sizeof(mjenv_learn_calls)
    reserved::UInt32 = 0
    last_error::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    info_of::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    options_of::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    options_get_string::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    space_of::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    seed::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    reset::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    step::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    snapshot::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    restore::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
    field_at::Ptr{Cvoid} = Ptr{Cvoid}(C_NULL)
end

Base.@kwdef struct mjenv_learn_report
    struct_size::UInt32 = sizeof(mjenv_learn_report)
    reserved::UInt32 = 0
    updates::Int64 = 0
    steps::Int64 = 0
    episodes::Int64 = 0
    mean_return::Float64 = 0
    mean_length::Float64 = 0
    learning_rate::Float64 = 0
    policy_loss::Float64 = 0
    value_loss::Float64 = 0
    entropy::Float64 = 0
    approx_kl::Float64 = 0
    clip_fraction::Float64 = 0
    grad_norm::Float64 = 0
    explained_variance::Float64 = 0
    std::Float64 = 0
    epochs::Int64 = 0
end

Base.@kwdef struct mjenv_policy_spec
    struct_size::UInt32 = sizeof(mjenv_policy_spec)
    reserved::UInt32 = 0
    layer_count::Int64 = 0
    clip::Float64 = 0
    mean::Ptr{Float64} = Ptr{Float64}(C_NULL)
    scale::Ptr{Float64} = Ptr{Float64}(C_NULL)
    low::Ptr{Float64} = Ptr{Float64}(C_NULL)
    high::Ptr{Float64} = Ptr{Float64}(C_NULL)
    input_count::Int64 = 0
    about::Cstring = Cstring(C_NULL)
end

Base.@kwdef struct mjenv_policy_input
    struct_size::UInt32 = sizeof(mjenv_policy_input)
    reserved::UInt32 = 0
    name::Cstring = Cstring(C_NULL)
    count::Int64 = 0
    seen::Int64 = 0
    elements::Ptr{Int64} = Ptr{Int64}(C_NULL)
end

Base.@kwdef struct mjenv_policy_layer
    struct_size::UInt32 = sizeof(mjenv_policy_layer)
    reserved::UInt32 = 0
    activation::Cstring = Cstring(C_NULL)
    inputs::Int64 = 0
    outputs::Int64 = 0
    weights::Ptr{Float64} = Ptr{Float64}(C_NULL)
    bias::Ptr{Float64} = Ptr{Float64}(C_NULL)
end

# learn_address(index) is the function at this index in LEARN_FUNCTIONS.
const LEARN_FUNCTIONS = (
    :mjenv_learn_abi_version, :mjenv_learn_last_error, :mjenv_learn_instructions, :mjenv_learn_setting_count,
    :mjenv_learn_setting_at, :mjenv_learn_settings, :mjenv_learner_create, :mjenv_learner_create_apart,
    :mjenv_learner_destroy, :mjenv_learner_train, :mjenv_learner_act, :mjenv_learner_feed, :mjenv_learner_restart,
    :mjenv_learner_set_env, :mjenv_learner_set, :mjenv_learner_report, :mjenv_learner_report_at, :mjenv_learner_save,
    :mjenv_checkpoint_note, :mjenv_learner_load, :mjenv_learner_policy, :mjenv_learner_save_policy,
    :mjenv_learner_describe, :mjenv_policy_parse, :mjenv_policy_load, :mjenv_policy_destroy, :mjenv_policy_id,
    :mjenv_policy_sizes, :mjenv_policy_spec_of, :mjenv_policy_layer_at, :mjenv_policy_input_at, :mjenv_policy_find,
    :mjenv_policy_act, :mjenv_evaluate
)
mjenv_learn_abi_version() =
    ccall(learn_address(1), UInt32, ())
mjenv_learn_last_error() =
    ccall(learn_address(2), Cstring, ())
mjenv_learn_instructions() =
    ccall(learn_address(3), Cstring, ())
mjenv_learn_setting_count() =
    ccall(learn_address(4), Int64, ())
mjenv_learn_setting_at(index, setting) =
    ccall(learn_address(5), mjenv_status, (Int64, Ptr{mjenv_option}), index, setting)
mjenv_learn_settings(id, settings, text, capacity, size) =
    ccall(learn_address(6), mjenv_status, (Cstring, Cstring, Ptr{Cchar}, Int64, Ptr{Int64}), id, settings, text, capacity, size)
mjenv_learner_create(calls, env, id, settings, learner) =
    ccall(learn_address(7), mjenv_status, (Ptr{mjenv_learn_calls}, Ptr{mjenv_env}, Cstring, Cstring, Ptr{Ptr{mjenv_learner}}), calls, env, id, settings, learner)
mjenv_learner_create_apart(observation, action, id, settings, obs, obs_count, learner) =
    ccall(learn_address(8), mjenv_status, (Ptr{mjenv_space}, Ptr{mjenv_space}, Cstring, Cstring, Ptr{Float64}, Int64, Ptr{Ptr{mjenv_learner}}), observation, action, id, settings, obs, obs_count, learner)
mjenv_learner_destroy(learner) =
    ccall(learn_address(9), Cvoid, (Ptr{mjenv_learner},), learner)
mjenv_learner_train(learner, steps) =
    ccall(learn_address(10), mjenv_status, (Ptr{mjenv_learner}, Int64), learner, steps)
mjenv_learner_act(learner, action, count) =
    ccall(learn_address(11), mjenv_status, (Ptr{mjenv_learner}, Ptr{Float32}, Int64), learner, action, count)
mjenv_learner_feed(learner, out) =
    ccall(learn_address(12), mjenv_status, (Ptr{mjenv_learner}, Ptr{mjenv_batch}), learner, out)
mjenv_learner_restart(learner, obs, obs_count) =
    ccall(learn_address(13), mjenv_status, (Ptr{mjenv_learner}, Ptr{Float64}, Int64), learner, obs, obs_count)
mjenv_learner_set_env(learner, env) =
    ccall(learn_address(14), mjenv_status, (Ptr{mjenv_learner}, Ptr{mjenv_env}), learner, env)
mjenv_learner_set(learner, settings) =
    ccall(learn_address(15), mjenv_status, (Ptr{mjenv_learner}, Cstring), learner, settings)
mjenv_learner_report(learner, report) =
    ccall(learn_address(16), mjenv_status, (Ptr{mjenv_learner}, Ptr{mjenv_learn_report}), learner, report)
mjenv_learner_report_at(learner, update, report) =
    ccall(learn_address(17), mjenv_status, (Ptr{mjenv_learner}, Int64, Ptr{mjenv_learn_report}), learner, update, report)
mjenv_learner_save(learner, path, note) =
    ccall(learn_address(18), mjenv_status, (Ptr{mjenv_learner}, Cstring, Cstring), learner, path, note)
mjenv_checkpoint_note(path, text, capacity, size) =
    ccall(learn_address(19), mjenv_status, (Cstring, Ptr{Cchar}, Int64, Ptr{Int64}), path, text, capacity, size)
mjenv_learner_load(learner, path) =
    ccall(learn_address(20), mjenv_status, (Ptr{mjenv_learner}, Cstring), learner, path)
mjenv_learner_policy(learner, which, text, capacity, size) =
    ccall(learn_address(21), mjenv_status, (Ptr{mjenv_learner}, mjenv_learned, Ptr{Cchar}, Int64, Ptr{Int64}), learner, which, text, capacity, size)
mjenv_learner_save_policy(learner, which, path) =
    ccall(learn_address(22), mjenv_status, (Ptr{mjenv_learner}, mjenv_learned, Cstring), learner, which, path)
mjenv_learner_describe(learner, about, names, counts, term_count) =
    ccall(learn_address(23), mjenv_status, (Ptr{mjenv_learner}, Cstring, Ptr{Cstring}, Ptr{Int64}, Int64), learner, about, names, counts, term_count)
mjenv_policy_parse(text, size, policy) =
    ccall(learn_address(24), mjenv_status, (Cstring, Int64, Ptr{Ptr{mjenv_policy}}), text, size, policy)
mjenv_policy_load(path, policy) =
    ccall(learn_address(25), mjenv_status, (Cstring, Ptr{Ptr{mjenv_policy}}), path, policy)
mjenv_policy_destroy(policy) =
    ccall(learn_address(26), Cvoid, (Ptr{mjenv_policy},), policy)
mjenv_policy_id(policy) =
    ccall(learn_address(27), Cstring, (Ptr{mjenv_policy},), policy)
mjenv_policy_sizes(policy, observations, actuators) =
    ccall(learn_address(28), mjenv_status, (Ptr{mjenv_policy}, Ptr{Int64}, Ptr{Int64}), policy, observations, actuators)
mjenv_policy_spec_of(policy, spec) =
    ccall(learn_address(29), mjenv_status, (Ptr{mjenv_policy}, Ptr{mjenv_policy_spec}), policy, spec)
mjenv_policy_layer_at(policy, index, layer) =
    ccall(learn_address(30), mjenv_status, (Ptr{mjenv_policy}, Int64, Ptr{mjenv_policy_layer}), policy, index, layer)
mjenv_policy_input_at(policy, index, input) =
    ccall(learn_address(31), mjenv_status, (Ptr{mjenv_policy}, Int64, Ptr{mjenv_policy_input}), policy, index, input)
mjenv_policy_find(policy, names, counts, term_count, places, place_count) =
    ccall(learn_address(32), mjenv_status, (Ptr{mjenv_policy}, Ptr{Cstring}, Ptr{Int64}, Int64, Ptr{Int64}, Int64), policy, names, counts, term_count, places, place_count)
mjenv_policy_act(policy, precision, rows, obs, obs_count, action, action_count) =
    ccall(learn_address(33), mjenv_status, (Ptr{mjenv_policy}, mjenv_precision, Int64, Ptr{Float64}, Int64, Ptr{Float32}, Int64), policy, precision, rows, obs, obs_count, action, action_count)
mjenv_evaluate(calls, env, policy, precision, seed, episodes, returns, lengths) =
    ccall(learn_address(34), mjenv_status, (Ptr{mjenv_learn_calls}, Ptr{mjenv_env}, Ptr{mjenv_policy}, mjenv_precision, UInt64, Int64, Ptr{Float64}, Ptr{Int64}), calls, env, policy, precision, seed, episodes, returns, lengths)
