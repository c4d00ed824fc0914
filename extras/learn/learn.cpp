// The functions of the C interface. They turn exceptions into statuses, and refuse destroyed handles and calls while
// another thread is inside a call with the same handle.
#include "mjenv/learn.h"

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>

#include "checkpoint.hpp"
#include "handles.hpp"
#include "learner.hpp"
#include "policy.hpp"
#include "reasons.hpp"
#include "settings.hpp"
#include "structs.hpp"
#include "system/files.hpp"
#include "system/floats.hpp"

struct mjenv_learner : mjenv::core::Slot<mjenv::learn::Learner> {
  static constexpr const char* kName = "learner";
  static constexpr const char* kThing = "learner";
  static constexpr bool kReadersSeeChanges = true;
};

struct mjenv_policy : mjenv::core::Slot<mjenv::learn::Policy> {
  static constexpr const char* kName = "policy";
  static constexpr const char* kThing = "policy";
  static constexpr bool kReadersSeeChanges = false;
};

namespace mjenv::core {

// Makes sure that what the C++ library keeps for this thread is allocated. glibc would allocate it at the first use,
// and end the process if there is no memory.
bool prepare_thread_locals() noexcept {
  constexpr std::size_t kEnough = 4096;
  void* const volatile room = std::malloc(kEnough);  // volatile: otherwise the compiler drops the allocation
  const bool enough = room != nullptr;
  std::free(room);
  if (enough) static_cast<void>(std::uncaught_exceptions());
  return enough;
}

}  // namespace mjenv::core

namespace {

using namespace mjenv::core;
using namespace mjenv::learn;

// Calls body and turns what it throws into a status and the thread's last reason.
template <typename F>
mjenv_status guard(const F& body) noexcept {
  if (!prepare_thread()) return MJENV_E_MEMORY;
  const DefaultFloats floats;
  try {
    body();
    return MJENV_OK;
  } catch (const Error& error) {
    keep_last_reason(error.what());
    return error.status();
  } catch (const std::bad_alloc&) {
    keep_last_reason("out of memory");
    return MJENV_E_MEMORY;
  } catch (const std::length_error&) {
    keep_last_reason("out of memory: more than can be addressed");
    return MJENV_E_MEMORY;
  } catch (const std::exception& error) {
    keep_last_reason(error.what());
    return MJENV_E_INTERNAL;
  }
}

// Calls body with what a handle holds. body may change it.
template <typename Handle, typename F>
mjenv_status change(Handle* handle, const F& body) noexcept {
  return guard([&] { body(*Entered(handle)); });
}

// Calls body with what a handle holds. body may only read it.
template <typename Handle, typename F>
mjenv_status read(const Handle* handle, const F& body) noexcept {
  return guard([&] { body(*Reading(handle)); });
}

template <typename T>
T& need(T* pointer, const char* name) {
  if (!pointer) fail(MJENV_E_ARGUMENT, std::string(name) + " is NULL");
  return *pointer;
}

mjenv_learn_calls calls_of(const mjenv_learn_calls* given) {
  const mjenv_learn_calls calls = read_struct(given, "calls");
  if (!calls.last_error || !calls.info_of || !calls.options_of || !calls.options_get_string || !calls.space_of ||
      !calls.seed || !calls.reset || !calls.step || !calls.snapshot || !calls.restore || !calls.field_at)
    fail(MJENV_E_ARGUMENT, "a function of calls is NULL");
  return calls;
}

// The settings of a learner with this number of rows, if `words` does not say another.
Settings settings_of(const char* id, const char* words, const Spaces& spaces, std::int64_t rows) {
  Settings settings(&need(id, "id"), "rows=" + std::to_string(rows) + ' ' + (words ? words : ""));
  settings.check_masks(spaces.observations);
  return settings;
}

// Writes a text with a NUL, and its size; with capacity 0 the size alone. Fails if the capacity is too small.
void deliver(const std::string& content, char* text, std::int64_t capacity, std::int64_t* size) {
  const auto needed = static_cast<std::int64_t>(content.size() + 1);
  need(size, "size");
  if (capacity < 0) fail(MJENV_E_SIZE, "capacity is " + std::to_string(capacity) + ", less than 0");
  if (capacity > 0) {
    need(text, "text");
    if (capacity < needed)
      fail(MJENV_E_SIZE,
           "the capacity is " + std::to_string(capacity) + ", but " + std::to_string(needed) + " are needed");
    content.copy(text, content.size());
    text[content.size()] = '\0';
  }
  *size = needed;
}

// The terms of an observation, which stand one after the other.
Terms terms_of(const char* const* names, const std::int64_t* counts, std::int64_t term_count) {
  constexpr std::int64_t kMost = 1 << 20;
  if (term_count < 0 || term_count > kMost)
    fail(MJENV_E_SIZE, "term_count is " + std::to_string(term_count) + ", not 0 to " + std::to_string(kMost));
  Terms terms;
  for (std::int64_t i = 0; i < term_count; ++i) {
    const std::int64_t count = (&need(counts, "counts"))[i];
    if (count < 0 || count > kMost)
      fail(MJENV_E_SIZE,
           "counts[" + std::to_string(i) + "] is " + std::to_string(count) + ", not 0 to " + std::to_string(kMost));
    terms.push_back({&need((&need(names, "names"))[i], "a name"), static_cast<std::size_t>(count)});
  }
  return terms;
}

mjenv_policy* add_policy(std::string_view text) { return handles<mjenv_policy>.add(std::make_unique<Policy>(text)); }

template <typename Handle>
void destroy(Handle* handle) noexcept {
  prepare_thread();
  handles<Handle>.destroy(handle);
}

}  // namespace

std::uint32_t mjenv_learn_abi_version() { return MJENV_LEARN_ABI_VERSION; }
const char* mjenv_learn_last_error() { return last_reason(); }
const char* mjenv_learn_instructions() { return usable_kernels().back()->name; }

std::int64_t mjenv_learn_setting_count() { return setting_count(); }

mjenv_status mjenv_learn_setting_at(std::int64_t index, mjenv_option* setting) {
  return guard([&] { write_struct(setting, "setting", setting_at(index)); });
}

mjenv_status mjenv_learn_settings(const char* id, const char* settings, char* text, std::int64_t capacity,
                                  std::int64_t* size) {
  return guard([&] { deliver(Settings(&need(id, "id"), settings ? settings : "").text(), text, capacity, size); });
}

// ---- Training ----

mjenv_status mjenv_learner_create(const mjenv_learn_calls* calls, mjenv_env* env, const char* id, const char* settings,
                                  mjenv_learner** learner) {
  return guard([&] {
    need(learner, "learner");
    need(env, "env");
    const mjenv_learn_calls functions = calls_of(calls);
    const Environment found(functions, env, "same_step");
    const Settings chosen = settings_of(id, settings, found.spaces(), found.rows());
    *learner = handles<mjenv_learner>.add(std::make_unique<Learner>(functions, env, chosen));
  });
}

mjenv_status mjenv_learner_create_apart(const mjenv_space* observation, const mjenv_space* action, const char* id,
                                        const char* settings, const double* obs, std::int64_t obs_count,
                                        mjenv_learner** learner) {
  return guard([&] {
    need(learner, "learner");
    need(obs, "obs");
    const mjenv_space seen = read_struct(observation, "observation"), acting = read_struct(action, "action");
    need(acting.low, "action->low");
    need(acting.high, "action->high");
    if (seen.count < 0 || acting.count < 0) fail(MJENV_E_SIZE, "the count of a space is less than 0");
    const Spaces spaces(seen, acting);
    const auto rows = std::max<std::int64_t>(1, obs_count / std::max<std::int64_t>(1, seen.count));
    const Settings chosen = settings_of(id, settings, spaces, rows);
    *learner = handles<mjenv_learner>.add(std::make_unique<Learner>(spaces, chosen, obs, obs_count));
  });
}

void mjenv_learner_destroy(mjenv_learner* learner) { destroy(learner); }

mjenv_status mjenv_learner_train(mjenv_learner* learner, std::int64_t steps) {
  return change(learner, [&](Learner& held) { held.train(steps); });
}

mjenv_status mjenv_learner_act(mjenv_learner* learner, float* action, std::int64_t count) {
  return change(learner, [&](Learner& held) { held.act(&need(action, "action"), count); });
}

mjenv_status mjenv_learner_feed(mjenv_learner* learner, const mjenv_batch* out) {
  return change(learner, [&](Learner& held) { held.feed(read_struct(out, "out")); });
}

mjenv_status mjenv_learner_restart(mjenv_learner* learner, const double* obs, std::int64_t obs_count) {
  return change(learner, [&](Learner& held) { held.restart(&need(obs, "obs"), obs_count); });
}

mjenv_status mjenv_learner_set_env(mjenv_learner* learner, mjenv_env* env) {
  return change(learner, [&](Learner& held) { held.set_env(&need(env, "env")); });
}

mjenv_status mjenv_learner_set(mjenv_learner* learner, const char* settings) {
  return change(learner, [&](Learner& held) { held.set(&need(settings, "settings")); });
}

mjenv_status mjenv_learner_report(const mjenv_learner* learner, mjenv_learn_report* report) {
  return read(learner, [&](const Learner& held) { write_struct(report, "report", held.report()); });
}

mjenv_status mjenv_learner_report_at(const mjenv_learner* learner, std::int64_t update, mjenv_learn_report* report) {
  return read(learner, [&](const Learner& held) { write_struct(report, "report", held.report_at(update)); });
}

mjenv_status mjenv_learner_save(const mjenv_learner* learner, const char* path, const char* note) {
  return read(learner, [&](const Learner& held) { held.save(&need(path, "path"), note ? note : ""); });
}

mjenv_status mjenv_checkpoint_note(const char* path, char* text, std::int64_t capacity, std::int64_t* size) {
  return guard([&] { deliver(read_note(&need(path, "path")), text, capacity, size); });
}

mjenv_status mjenv_learner_load(mjenv_learner* learner, const char* path) {
  return change(learner, [&](Learner& held) { held.load(&need(path, "path")); });
}

mjenv_status mjenv_learner_policy(const mjenv_learner* learner, mjenv_learned which, char* text, std::int64_t capacity,
                                  std::int64_t* size) {
  return read(learner, [&](const Learner& held) { deliver(held.policy(which), text, capacity, size); });
}

mjenv_status mjenv_learner_save_policy(const mjenv_learner* learner, mjenv_learned which, const char* path) {
  return read(learner, [&](const Learner& held) {
    const std::string text = held.policy(which);
    replace_file(&need(path, "path"), text.data(), text.size());
  });
}

mjenv_status mjenv_learner_describe(mjenv_learner* learner, const char* about, const char* const* names,
                                    const std::int64_t* counts, std::int64_t term_count) {
  return change(learner, [&](Learner& held) {
    held.describe({about ? about : "", terms_of(names, counts, term_count)});
  });
}

// ---- Policies ----

mjenv_status mjenv_policy_parse(const char* text, std::int64_t size, mjenv_policy** policy) {
  return guard([&] {
    need(policy, "policy");
    if (size < 0) fail(MJENV_E_SIZE, "size is " + std::to_string(size) + ", less than 0");
    *policy = add_policy({&need(text, "text"), static_cast<std::size_t>(size)});
  });
}

mjenv_status mjenv_policy_load(const char* path, mjenv_policy** policy) {
  return guard([&] {
    need(policy, "policy");
    constexpr std::int64_t kMostBytes = 256 << 20;
    const std::string content = read_file(&need(path, "path"), kMostBytes, "", MJENV_E_FILE, MJENV_E_VALUE);
    try {
      *policy = add_policy(content);
    } catch (const Error& error) {
      fail(error.status(), std::string(path) + ": " + error.what());
    }
  });
}

void mjenv_policy_destroy(mjenv_policy* policy) { destroy(policy); }

const char* mjenv_policy_id(const mjenv_policy* policy) {
  const char* id = nullptr;
  read(policy, [&](const Policy& held) { id = held.id().c_str(); });
  return id;
}

mjenv_status mjenv_policy_sizes(const mjenv_policy* policy, std::int64_t* observations, std::int64_t* actuators) {
  return read(policy, [&](const Policy& held) {
    std::int64_t &inputs = need(observations, "observations"), &outputs = need(actuators, "actuators");
    inputs = static_cast<std::int64_t>(held.observations());
    outputs = static_cast<std::int64_t>(held.actuators());
  });
}

mjenv_status mjenv_policy_spec_of(const mjenv_policy* policy, mjenv_policy_spec* spec) {
  return read(policy, [&](const Policy& held) { write_struct(spec, "spec", held.spec()); });
}

mjenv_status mjenv_policy_layer_at(const mjenv_policy* policy, std::int64_t index, mjenv_policy_layer* layer) {
  return read(policy, [&](const Policy& held) { write_struct(layer, "layer", held.layer(index)); });
}

mjenv_status mjenv_policy_input_at(const mjenv_policy* policy, std::int64_t index, mjenv_policy_input* input) {
  return read(policy, [&](const Policy& held) { write_struct(input, "input", held.input(index)); });
}

mjenv_status mjenv_policy_find(const mjenv_policy* policy, const char* const* names, const std::int64_t* counts,
                               std::int64_t term_count, std::int64_t* places, std::int64_t place_count) {
  return read(policy, [&](const Policy& held) {
    const std::vector<std::size_t> found = held.find(terms_of(names, counts, term_count));
    check_count("place_count", place_count, static_cast<std::int64_t>(found.size()));
    std::copy(found.begin(), found.end(), &need(places, "places"));
  });
}

mjenv_status mjenv_policy_act(const mjenv_policy* policy, mjenv_precision precision, std::int64_t rows,
                              const double* obs, std::int64_t obs_count, float* action, std::int64_t action_count) {
  return read(policy, [&](const Policy& held) {
    constexpr std::int64_t kMost = 1 << 24;
    if (rows < 0 || rows > kMost)
      fail(MJENV_E_SIZE, "rows is " + std::to_string(rows) + ", not 0 to " + std::to_string(kMost));
    check_count("obs_count", obs_count, rows * static_cast<std::int64_t>(held.observations()));
    check_count("action_count", action_count, rows * static_cast<std::int64_t>(held.actuators()));
    if (rows > 0) held.act(precision, static_cast<std::size_t>(rows), &need(obs, "obs"), &need(action, "action"));
  });
}

mjenv_status mjenv_evaluate(const mjenv_learn_calls* calls, mjenv_env* env, const mjenv_policy* policy,
                            mjenv_precision precision, std::uint64_t seed, std::int64_t episodes, double* returns,
                            std::int64_t* lengths) {
  return read(policy, [&](const Policy& held) {
    need(env, "env");
    if (episodes < 1) fail(MJENV_E_VALUE, "episodes is " + std::to_string(episodes) + ", less than 1");
    Environment environment(calls_of(calls), env, "disabled");
    evaluate_policy(environment, held, precision, seed, episodes, returns, lengths);
  });
}
