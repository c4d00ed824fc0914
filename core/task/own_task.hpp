// A task from outside of the library: what mjenv/task.h describes.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mjenv/task.h"
#include "task/options.hpp"
#include "task/robot.hpp"

namespace mjenv::core {

// Numbers that a row may carry for its task.
constexpr std::int64_t kMaxCarried = 1 << 24;

// A mjenv_task_field.
struct OwnField {
  mjenv_role role;
  std::string name, doc;
  mjenv_type type;
  std::vector<std::int64_t> shape;  // -1: build will tell
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

// A registered task. It copies the description: the callbacks and what the user's pointer points to stay outside.
class OwnTask {
 public:
  // Checks the description. plugin: the handle of the shared object that brought the task, or null.
  OwnTask(const mjenv_task& given, const void* plugin);
  OwnTask(const OwnTask&) = delete;
  OwnTask& operator=(const OwnTask&) = delete;

  const std::string& id() const { return id_; }
  // The id without its version.
  const std::string& robot() const { return robot_; }
  int version() const { return version_; }
  const void* plugin() const { return plugin_; }

  void declare(Options& options) const { declare(options, options_); }
  // The task without its model.
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

// The struct is read as far as it was known to who made it.
std::unique_ptr<OwnTask> own_task(const mjenv_task* given, const void* plugin);
// Throws if a field is not one that a task can have. It may have a length that is not known yet.
OwnField own_field(const mjenv_task_field& given);
// Replaces the field of that role and name, or adds it.
void put_field(std::vector<OwnField>& fields, OwnField field);

// The row's stream, as callbacks see it.
struct OwnRandom : mjenv_random {
  explicit OwnRandom(Rng& stream);

  Rng& rng;
  bool failed = false;  // NumPy would refuse a draw; the message says why
};

// What a callback last failed with on this thread; "" if it said nothing.
const char* task_message();
void set_task_message(const char* text);

}  // namespace mjenv::core
