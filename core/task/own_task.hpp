// A registered task: the library's copy of a mjenv_task (mjenv/task.h).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mjenv/task.h"
#include "task/options.hpp"
#include "task/robot.hpp"

namespace mjenv::core {

// The library's functions for the callbacks of registered tasks (mjenv/task.h).
const mjenv_task_api& task_api();

// The largest carry_count.
constexpr std::int64_t kMaxCarried = 1 << 24;

// The library's copy of a mjenv_task_field.
struct OwnField {
  mjenv_role role;
  std::string name, doc;
  mjenv_type type;
  std::vector<std::int64_t> shape;  // -1: build sets this length
};

struct OwnCallbacks {
  void* user;
  decltype(mjenv_task::build) build;
  decltype(mjenv_task::destroy) destroy;
  decltype(mjenv_task::reset) reset;
  decltype(mjenv_task::reset_info) reset_info;
  decltype(mjenv_task::carry) carry;
  decltype(mjenv_task::observe) observe;
  decltype(mjenv_task::step) step;
};

// Copies the description. Only the callbacks' code and the memory that `user` points to remain the caller's.
class OwnTask {
 public:
  // Throws if the description is invalid. plugin: the dlopen handle of the task's plug-in, or null.
  OwnTask(const mjenv_task& given, const void* plugin);
  OwnTask(const OwnTask&) = delete;
  OwnTask& operator=(const OwnTask&) = delete;

  const std::string& id() const { return id_; }
  // The id without its version.
  const std::string& robot() const { return robot_; }
  int version() const { return version_; }
  const void* plugin() const { return plugin_; }

  void declare(Options& options) const { declare(options, options_); }
  // The task with the default options, without its model.
  Task outline() const;
  Task build(const Options& options) const;

 private:
  std::string id_, robot_, model_, model_text_;
  int version_ = 0;
  std::int32_t revision_, frame_skip_;
  double reward_threshold_;
  std::int64_t time_limit_, carry_count_;
  Camera camera_;
  std::vector<Option> options_;
  std::vector<OwnField> fields_;
  OwnCallbacks callbacks_;
  bool caller_thread_, physics_only_;
  const void* plugin_;

  [[noreturn]] void refuse(mjenv_status status, const std::string& why) const;
  void take_id(const char* id);
  void take_model(const mjenv_task& given);
  void take_options(const mjenv_task& given);
  void take_fields(const mjenv_task& given);
  void check_callbacks() const;
  void declare(Options& options, const std::vector<Option>& own) const;
  std::shared_ptr<const Model> open(const Options& options) const;
};

// Copies the struct of a caller that may have been compiled with an older or newer header.
std::unique_ptr<OwnTask> own_task(const mjenv_task* given, const void* plugin);
// Copies the field, whose lengths may be -1. Throws if a task cannot have it.
OwnField own_field(const mjenv_task_field& given);
// Replaces the field with the same role and name (a reward: with any name), or adds the field at the end. A new field
// without a doc takes over the old one's.
void replace_or_add(std::vector<OwnField>& fields, OwnField field);

// A row's random stream, as callbacks get it.
struct OwnRandom : mjenv_random {
  explicit OwnRandom(Rng& stream);

  Rng& rng;
  bool failed = false;  // a draw was refused, as NumPy would refuse it; task_message says why
};

// The reason that a callback gave for its failure on this thread; "" if it gave none.
const char* task_message();
void set_task_message(const char* text);

}  // namespace mjenv::core
