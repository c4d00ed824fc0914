#include "mjenv/mjenv.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "engine/model.hpp"
#include "firewall.hpp"
#include "held.hpp"
#include "structs.hpp"
#include "task/draws.hpp"
#include "task/registry.hpp"
#include "version.hpp"

using namespace mjenv::core;
using namespace mjenv::core::firewall;

namespace {

// Calls body with an environment that body may change.
template <typename F>
mjenv_status change_env(mjenv_env* handle, const F& body) noexcept {
  return change(handle, [&](HeldEnv& held) { held.env.with_mirrors([&] { body(held.env); }); });
}

// Does the same, and passes body the batch to which the call writes. If the caller gave no batch, its pointers are
// null.
template <typename F>
mjenv_status change_env(mjenv_env* handle, const mjenv_batch* out, const F& body) noexcept {
  return change_env(handle, [&](Env& env) { body(env, out ? read_struct(out, "out") : mjenv_batch{}); });
}

// Calls body with an environment. body may read only what never changes, because other threads may be inside a call
// with the environment.
template <typename F>
mjenv_status read_env(const mjenv_env* handle, const F& body) noexcept {
  return read(handle, [&](const HeldEnv& held) { body(held.env); });
}

mjenv_options* add_options(Options options) {
  mjenv_options* handle = handles<mjenv_options>.add(std::make_unique<Options>(std::move(options)));
  handle->borrowed = false;
  return handle;
}

template <typename F>
mjenv_status change_options(mjenv_options* handle, const F& body) noexcept {
  return change(handle, [&](Options& options) {
    if (handle->borrowed) fail(MJENV_E_ARGUMENT, "the options belong to an environment and cannot be changed");
    body(options);
  });
}

// Returns what body returns, or the fallback if it throws.
template <typename T, typename Handle, typename F>
T ask(T fallback, const Handle* handle, const F& body) noexcept {
  read(handle, [&](const auto& held) { fallback = body(held); });
  return fallback;
}

std::string text(const char* value, const char* name) { return &need(value, name); }

Action action_of(const void* values, std::int64_t count, mjenv_dtype dtype, const char* name = "action") {
  return {need_memory(values, count, name), known_dtype(dtype), count};
}

void fill(mjenv_field* to, const Field& field) {
  mjenv_field out{};
  out.ndim = static_cast<std::int32_t>(field.shape.size());
  out.name = field.name.c_str();
  out.doc = field.doc.c_str();
  std::copy(field.shape.begin(), field.shape.end(), out.shape);
  out.offset = field.offset;
  out.count = field.count;
  out.dtype = field.type;
  write_struct(to, "field", out);
}

void fill(mjenv_option* to, const Option& option) {
  mjenv_option out{};
  out.kind = option.kind;
  out.name = option.name.c_str();
  out.doc = option.doc.c_str();
  out.low = option.low;
  out.high = option.high;
  out.count = option.kind == MJENV_KIND_REALS ? static_cast<std::int64_t>(option.reals.size()) : 1;
  out.choices = option.choices.empty() ? nullptr : option.choices.c_str();
  write_struct(to, "option", out);
}

template <typename T>
const T& at(const std::vector<T>& list, std::int64_t index, const char* what) {
  check_index(what, index, list.size());
  return list[static_cast<std::size_t>(index)];
}

[[noreturn]] void refuse_kind(const Option& option, const char* asked) {
  fail(MJENV_E_TYPE, "option " + quoted(option.name) + " does not hold " + asked);
}

}  // namespace

std::uint32_t mjenv_abi_version() { return MJENV_ABI_VERSION; }
const char* mjenv_version() { return library_version(); }

const char* mjenv_status_name(mjenv_status status) {
  // The names from MJENV_DIVERGED (1) down to the smallest status.
  static constexpr std::array names{
      "MJENV_DIVERGED",      "MJENV_OK",         "MJENV_E_ARGUMENT",  "MJENV_E_NAME",          "MJENV_E_TYPE",
      "MJENV_E_VALUE",       "MJENV_E_SIZE",     "MJENV_E_NOT_RESET", "MJENV_E_EPISODE_ENDED", "MJENV_E_PENDING",
      "MJENV_E_NOT_PENDING", "MJENV_E_BUSY",     "MJENV_E_FORKED",    "MJENV_E_FILE",          "MJENV_E_MODEL",
      "MJENV_E_PHYSICS",     "MJENV_E_SNAPSHOT", "MJENV_E_RENDER",    "MJENV_E_MEMORY",        "MJENV_E_INTERNAL",
      "MJENV_E_TASK"};
  static_assert(names.size() == MJENV_DIVERGED - MJENV_E_TASK + 1);
  return MJENV_E_TASK <= status && status <= MJENV_DIVERGED ? names[static_cast<std::size_t>(MJENV_DIVERGED - status)]
                                                            : "unknown status";
}

const char* mjenv_last_error() { return last_reason(); }

mjenv_status mjenv_error_of(const void* handle, char* text, std::int64_t capacity, std::int64_t* size) {
  return guard([&] {
    need(size, "size");
    need_array(text, capacity, "text");
    const bool found = copy_reason<mjenv_env>(handle, text, capacity, size) ||
                       copy_reason<mjenv_options>(handle, text, capacity, size) ||
                       copy_reason<mjenv_renderer>(handle, text, capacity, size) ||
                       copy_reason<mjenv_window>(handle, text, capacity, size);
    if (!found) fail(MJENV_E_ARGUMENT, "handle is no live handle: it was destroyed, or never created");
  });
}

// ---- Ids ----

std::int64_t mjenv_id_count() {
  return answer<std::int64_t>(0, [] { return id_count(); });
}

const char* mjenv_id_at(std::int64_t index) {
  return answer<const char*>(nullptr, [&] { return id_at(index).name; });
}

mjenv_status mjenv_spec_of(const char* id, mjenv_spec* spec) {
  return guard([&] {
    const Id& found = id_of(text(id, "id"));
    const Outline task = task_of(found)->outline();
    mjenv_spec out{};
    out.version = found.version;
    out.id = found.name;
    out.robot = found.robot;
    out.max_episode_steps = task.time_limit;
    out.reward_threshold = task.reward_threshold;
    out.camera_distance = task.camera.distance;
    out.camera_elevation = task.camera.elevation;
    std::copy(std::begin(task.camera.lookat), std::end(task.camera.lookat), out.camera_lookat);
    out.camera_trackbodyid = task.camera.trackbodyid;
    out.revision = task.revision;
    out.model_xml = task.model_xml;
    write_struct(spec, "spec", out);
  });
}

// ---- Options ----

mjenv_status mjenv_options_create(const char* id, mjenv_options** options) {
  return guard([&] {
    need(options, "options");
    *options = add_options(default_options(id_of(text(id, "id"))));
  });
}

mjenv_status mjenv_options_copy(const mjenv_options* options, mjenv_options** copy) {
  return read(options, [&](const Options& o) {
    need(copy, "copy");
    *copy = add_options(o);
  });
}

void mjenv_options_destroy(mjenv_options* options) {
  if (handles<mjenv_options>.contains(options) && !options->borrowed) destroy(options);
}

std::int64_t mjenv_options_count(const mjenv_options* options) {
  return ask<std::int64_t>(0, options, [](const Options& o) { return o.all().size(); });
}

mjenv_status mjenv_options_at(const mjenv_options* options, std::int64_t index, mjenv_option* option) {
  return read(options, [&](const Options& o) { fill(option, at(o.all(), index, "option")); });
}

mjenv_status mjenv_options_set_integer(mjenv_options* options, const char* name, std::int64_t value) {
  return change_options(options, [&](Options& o) { o.set_integer(text(name, "name"), value); });
}

mjenv_status mjenv_options_set_reals(mjenv_options* options, const char* name, const double* values,
                                     std::int64_t count) {
  return change_options(options, [&](Options& o) {
    o.set_reals(text(name, "name"), need_array(values, count, "values"), static_cast<std::size_t>(count));
  });
}

mjenv_status mjenv_options_set_string(mjenv_options* options, const char* name, const char* value) {
  return change_options(options, [&](Options& o) { o.set_string(text(name, "name"), text(value, "value")); });
}

mjenv_status mjenv_options_get_integer(const mjenv_options* options, const char* name, std::int64_t* value) {
  return read(options, [&](const Options& o) {
    const Option& option = o.get(text(name, "name"));
    const bool index = option.kind == MJENV_KIND_STRING_OR_INT && option.given_as_integer;
    if (!index && option.kind != MJENV_KIND_FLAG && option.kind != MJENV_KIND_INTEGER)
      refuse_kind(option, "an integer");
    need(value, "value") = option.integer;
  });
}

mjenv_status mjenv_options_get_reals(const mjenv_options* options, const char* name, double* values,
                                     std::int64_t capacity, std::int64_t* count) {
  return read(options, [&](const Options& o) {
    const Option& option = o.get(text(name, "name"));
    if (option.kind != MJENV_KIND_REALS) refuse_kind(option, "real numbers");
    deliver(static_cast<std::int64_t>(option.reals.size()), capacity, values, "values", count,
            [&] { std::copy(option.reals.begin(), option.reals.end(), values); });
  });
}

mjenv_status mjenv_options_get_string(const mjenv_options* options, const char* name, const char** value) {
  return read(options, [&](const Options& o) {
    const Option& option = o.get(text(name, "name"));
    const bool named = option.kind == MJENV_KIND_STRING_OR_INT && !option.given_as_integer;
    if (!named && option.kind != MJENV_KIND_STRING) refuse_kind(option, "a text");
    need(value, "value") = option.text.c_str();
  });
}

// ---- Environment ----

mjenv_status mjenv_create(const mjenv_options* options, std::int64_t rows, mjenv_env** env) {
  return read(options, [&](const Options& chosen) {
    need(env, "env");
    if (rows < 1) fail(MJENV_E_VALUE, "rows is " + std::to_string(rows) + ", less than 1");
    auto held = std::make_unique<HeldEnv>(chosen, rows);
    const auto link = held->link;
    *env = link->env = handles<mjenv_env>.add(std::move(held));
  });
}

void mjenv_destroy(mjenv_env* env) { destroy(env); }

mjenv_status mjenv_info_of(mjenv_env* env, mjenv_info* info) {
  return change(env, [&](HeldEnv& held) {
    const LaneChoice& lanes = held.env.lanes();
    mjenv_info out{};
    out.threads = held.env.threads();
    out.rows = held.env.rows();
    out.frame_skip = held.env.frame_skip();
    out.lanes = lanes.width;
    out.lanes_reason = lanes.reason.c_str();
    write_struct(info, "info", out);
  });
}

const char* mjenv_lane_stages_of(mjenv_env* env) {
  const char* text = nullptr;
  change(env, [&](HeldEnv& held) {
    if (!held.lane_stages) held.lane_stages = held.env.lane_stages();
    text = held.lane_stages->c_str();
  });
  return text;
}

const mjenv_options* mjenv_options_of(const mjenv_env* env) {
  return ask<const mjenv_options*>(nullptr, env, [](const HeldEnv& held) { return held.options; });
}

mjenv_status mjenv_space_of(const mjenv_env* env, mjenv_role role, mjenv_space* space) {
  return read_env(env, [&](const Env& e) {
    if (role != MJENV_ROLE_OBSERVATION && role != MJENV_ROLE_ACTION)
      fail(MJENV_E_ARGUMENT, "role is " + std::to_string(role) + ", not MJENV_ROLE_OBSERVATION or MJENV_ROLE_ACTION");
    mjenv_space out{};
    out.dtype = role == MJENV_ROLE_OBSERVATION ? MJENV_DTYPE_FLOAT64 : MJENV_DTYPE_FLOAT32;
    const Space& bounds = e.schema().space(role);
    out.count = static_cast<std::int64_t>(bounds.low.size());
    out.low = bounds.low.data();
    out.high = bounds.high.data();
    out.ndim = static_cast<std::int32_t>(bounds.shape.size());
    std::copy(bounds.shape.begin(), bounds.shape.end(), out.shape);
    write_struct(space, "space", out);
  });
}

std::int64_t mjenv_field_count(const mjenv_env* env, mjenv_role role) {
  return ask<std::int64_t>(0, env, [&](const HeldEnv& held) { return held.env.schema().fields(role).size(); });
}

mjenv_status mjenv_field_at(const mjenv_env* env, mjenv_role role, std::int64_t index, mjenv_field* field) {
  return read_env(env, [&](const Env& e) { fill(field, at(e.schema().fields(role), index, "field")); });
}

mjenv_status mjenv_seed(mjenv_env* env, const std::uint8_t* mask, const std::uint64_t* seeds, std::int64_t count) {
  return change_env(env, [&](Env& e) { e.seed(e.masked(mask), &need(seeds, "seeds"), count); });
}

mjenv_status mjenv_seed_row(mjenv_env* env, std::int64_t row, const std::uint64_t* words, std::int64_t count) {
  return change_env(env, [&](Env& e) { e.seed(e.only(row), &need(words, "words"), count); });
}

mjenv_status mjenv_reset(mjenv_env* env, const std::uint8_t* mask, const mjenv_batch* out) {
  return change_env(env, out, [&](Env& e, const mjenv_batch& batch) { e.reset(mask, batch); });
}

mjenv_status mjenv_step(mjenv_env* env, const std::uint8_t* mask, const void* action, std::int64_t count,
                        mjenv_dtype dtype, const mjenv_batch* out) {
  return change_env(env, out,
                    [&](Env& e, const mjenv_batch& batch) { e.step(mask, action_of(action, count, dtype), batch); });
}

mjenv_status mjenv_begin(mjenv_env* env, const std::uint8_t* mask, const double* qpos, std::int64_t nq,
                         const double* qvel, std::int64_t nv, const mjenv_batch* out) {
  return change_env(env, out, [&](Env& e, const mjenv_batch& batch) { e.begin(mask, qpos, nq, qvel, nv, batch); });
}

mjenv_status mjenv_act(mjenv_env* env, const std::uint8_t* mask, const void* action, std::int64_t count,
                       mjenv_dtype dtype, void* seen) {
  return change_env(env, [&](Env& e) {
    need_memory(seen, count, "seen");
    e.act(mask, action_of(action, count, dtype), seen);
  });
}

mjenv_status mjenv_advance(mjenv_env* env, const std::uint8_t* mask, const void* action, std::int64_t count,
                           mjenv_dtype dtype, const double* ctrl, std::int64_t ctrl_count, const mjenv_batch* out) {
  return change_env(env, out, [&](Env& e, const mjenv_batch& batch) {
    e.advance(mask, action_of(action, count, dtype), ctrl, ctrl_count, batch);
  });
}

mjenv_status mjenv_finish(mjenv_env* env, const std::uint8_t* mask, const mjenv_batch* given, const mjenv_batch* out) {
  return change_env(env, out, [&](Env& e, const mjenv_batch& batch) {
    const mjenv_batch read = given ? read_struct(given, "given") : mjenv_batch{};
    e.finish(mask, given ? &read : nullptr, batch);
  });
}

mjenv_status mjenv_send(mjenv_env* env, const std::int64_t* rows, std::int64_t row_count, const void* action,
                        std::int64_t count, mjenv_dtype dtype) {
  return change_env(env, [&](Env& e) { e.send(rows, row_count, action_of(action, count, dtype)); });
}

mjenv_status mjenv_recv(mjenv_env* env, std::int64_t least, double timeout, std::int64_t* rows, std::int64_t capacity,
                        std::int64_t* count, const mjenv_batch* out) {
  return change_env(env, out, [&](Env& e, const mjenv_batch& batch) {
    e.receive(least, timeout, &need(rows, "rows"), capacity, &need(count, "count"), batch);
  });
}

mjenv_status mjenv_rollout(mjenv_env* env, const void* action, std::int64_t count, mjenv_dtype dtype,
                           std::int64_t steps, const mjenv_batch* out) {
  return change_env(
      env, out, [&](Env& e, const mjenv_batch& batch) { e.rollout(action_of(action, count, dtype), steps, batch); });
}

mjenv_status mjenv_compute_reward(mjenv_env* env, const double* achieved, const double* desired, std::int64_t count,
                                  double* rewards, std::int64_t reward_count) {
  return change_env(env, [&](Env& e) {
    e.compute_reward(&need(achieved, "achieved"), &need(desired, "desired"), count, &need(rewards, "rewards"),
                     reward_count);
  });
}

mjenv_status mjenv_get_stream(mjenv_env* env, std::int64_t row, std::uint64_t* words, std::int64_t count) {
  return change_env(env, [&](Env& e) { e.get_stream(row, &need(words, "words"), count); });
}

mjenv_status mjenv_set_stream(mjenv_env* env, std::int64_t row, const std::uint64_t* words, std::int64_t count) {
  return change_env(env, [&](Env& e) { e.set_stream(row, &need(words, "words"), count); });
}

mjenv_status mjenv_draw(std::uint64_t* words, std::int64_t streams, mjenv_distribution kind, double low, double high,
                        double* values, std::int64_t count) {
  return guard([&] { draw(&need(words, "words"), streams, kind, low, high, &need(values, "values"), count); });
}

mjenv_status mjenv_seed_actions(mjenv_env* env, std::uint64_t seed) {
  return change_env(env, [&](Env& e) { e.seed_actions(seed); });
}

mjenv_status mjenv_sample_actions(mjenv_env* env, float* action, std::int64_t count) {
  return change_env(env, [&](Env& e) {
    need_array(action, count, "action");
    e.sample_actions(action, count);
  });
}

// ---- State of one row ----

mjenv_status mjenv_read(mjenv_env* env, std::int64_t row, const char* array, double* values, std::int64_t capacity,
                        std::int64_t* count) {
  return change_env(env, [&](Env& e) {
    const std::string name = text(array, "array");
    const bool all = row == MJENV_ALL_ROWS;
    const Array& found = e.array(all ? 0 : row, name);
    const std::size_t each = found.count();
    deliver(static_cast<std::int64_t>(each) * (all ? e.rows() : 1), capacity, values, "values", count,
            [&] { all ? e.read(name, values, each) : found.read(values); });
  });
}

mjenv_status mjenv_mirror(mjenv_env* env, std::int64_t row, const char* array, void* values, std::int64_t bytes) {
  return change_env(env, [&](Env& e) { e.mirror(row, text(array, "array"), static_cast<std::byte*>(values), bytes); });
}

mjenv_status mjenv_object_count(const mjenv_env* env, const char* type, std::int64_t* count) {
  return read_env(env, [&](const Env& e) { need(count, "count") = e.model().count(text(type, "type")); });
}

mjenv_status mjenv_object_index(const mjenv_env* env, const char* type, const char* name, std::int64_t* index) {
  return read_env(
      env, [&](const Env& e) { need(index, "index") = e.model().index(text(type, "type"), text(name, "name")); });
}

mjenv_status mjenv_object_name(const mjenv_env* env, const char* type, std::int64_t index, const char** name) {
  return read_env(env, [&](const Env& e) { need(name, "name") = e.model().name(text(type, "type"), index); });
}

mjenv_status mjenv_set_state(mjenv_env* env, std::int64_t row, const double* qpos, std::int64_t nq, const double* qvel,
                             std::int64_t nv) {
  return change_env(env, [&](Env& e) {
    need_array(qpos, nq, "qpos");
    need_array(qvel, nv, "qvel");
    e.set_state(row, qpos, nq, qvel, nv);
  });
}

mjenv_status mjenv_reset_data(mjenv_env* env, const std::uint8_t* mask) {
  return change_env(env, [&](Env& e) { e.reset_data(e.masked(mask)); });
}

mjenv_status mjenv_write(mjenv_env* env, const std::uint8_t* mask, const char* array, const double* values,
                         std::int64_t count) {
  return change_env(env, [&](Env& e) {
    const std::string name = text(array, "array");
    e.write(e.masked(mask), name, need_array(values, count, "values"), count);
  });
}

mjenv_status mjenv_write_row(mjenv_env* env, std::int64_t row, const char* array, const double* values,
                             std::int64_t count) {
  return change_env(env, [&](Env& e) {
    const std::string name = text(array, "array");
    e.write(e.only(row), name, need_array(values, count, "values"), count);
  });
}

mjenv_status mjenv_set_constants(mjenv_env* env, const std::uint8_t* mask) {
  return change_env(env, [&](Env& e) { e.set_constants(e.masked(mask)); });
}

mjenv_status mjenv_set_constants_row(mjenv_env* env, std::int64_t row) {
  return change_env(env, [&](Env& e) { e.set_constants(e.only(row)); });
}

mjenv_status mjenv_randomize(mjenv_env* env, const char* document) {
  return change_env(env, [&](Env& e) { e.randomize(document ? document : ""); });
}

mjenv_status mjenv_randomization(mjenv_env* env, const char** document) {
  return change_env(env, [&](Env& e) { need(document, "document") = e.randomization().c_str(); });
}

mjenv_status mjenv_simulate(mjenv_env* env, std::int64_t row, const double* ctrl, std::int64_t count,
                            std::int64_t frames) {
  return change_env(env, [&](Env& e) { e.simulate(row, action_of(ctrl, count, MJENV_DTYPE_FLOAT64, "ctrl"), frames); });
}

mjenv_status mjenv_observe(mjenv_env* env, const mjenv_batch* out) {
  return change_env(env, out, [&](Env& e, const mjenv_batch& batch) {
    need(out, "out");
    e.observe(batch);
  });
}

mjenv_status mjenv_observe_row(mjenv_env* env, std::int64_t row, const mjenv_batch* out) {
  return change_env(env, out, [&](Env& e, const mjenv_batch& batch) {
    need(out, "out");
    e.observe(row, batch);
  });
}

mjenv_status mjenv_copy_row(mjenv_env* env, const std::uint8_t* mask, std::int64_t from) {
  return change_env(env, [&](Env& e) { e.copy_row(mask, from); });
}

mjenv_status mjenv_snapshot(mjenv_env* env, std::int64_t row, void* image, std::int64_t capacity_bytes,
                            std::int64_t* size_bytes) {
  return change_env(env, [&](Env& e) {
    deliver(e.snapshot_size(row), capacity_bytes, image, "image", size_bytes, [&] { e.snapshot(row, image); });
  });
}

mjenv_status mjenv_restore(mjenv_env* env, std::int64_t row, const void* image, std::int64_t size_bytes) {
  return change_env(env, [&](Env& e) {
    need_memory(image, 1, "image");
    e.restore(row, image, size_of(size_bytes, "image"));
  });
}
