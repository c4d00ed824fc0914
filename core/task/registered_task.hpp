// A task that the registry knows: the library's copy of a mjenv_task (mjenv/task.h).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mjenv/task.h"
#include "task/options.hpp"
#include "task/task.hpp"
#include "task/task_field.hpp"

namespace mjenv::core {

// The largest frame_skip.
constexpr std::int64_t kMaxFrameSkip = 1'000'000;

// What is known about a task before a model is compiled.
struct Outline {
  const char* model_xml;  // the text of its default model; null if that is a file, or if there is none (Model-v0)
  std::int64_t time_limit;
  double reward_threshold;  // NaN if the task has none
  mjenv_task_camera camera;
  std::int32_t revision;
};

// The folder, with a "/" at its end, of the shared object or program that contains the code; the current folder if that
// is unknown.
std::string folder_of(const void* code);

// Copies the description of a task. Only the callbacks' code and the memory at `user` still belong to the caller.
class RegisteredTask {
 public:
  enum class Origin { built_in, user };
  // Throws if the description is invalid. plugin: the dlopen handle of the task's plug-in, or null.
  RegisteredTask(const mjenv_task& given, Origin origin, const void* plugin = nullptr);
  RegisteredTask(const RegisteredTask&) = delete;
  RegisteredTask& operator=(const RegisteredTask&) = delete;

  const std::string& id() const { return id_; }
  // The id without its version.
  const std::string& robot() const { return robot_; }
  int version() const { return version_; }
  const void* plugin() const { return plugin_; }

  // Declares the task's options, and those common options whose presence or default depends on the task.
  // declare_env_options adds the others.
  void declare(Options& options) const { declare(options, options_); }
  Outline outline() const;
  Task build(const Options& options) const;

 private:
  std::string id_, robot_, model_, model_text_;
  int version_ = 0;
  bool built_in_;
  // The description. Of its pointers, only the callbacks and `user` are valid. What the others pointed to was copied to
  // the other members of this class.
  mjenv_task given_;
  mjenv_task_camera camera_;
  std::vector<Option> options_;
  std::vector<Field> fields_;
  const void* plugin_;

  void take_id(const char* id);
  void take_model(const mjenv_task& given);
  void take_options(const mjenv_task& given);
  void take_fields(const mjenv_task& given);
  void check_callbacks(const mjenv_task& c, const std::vector<Field>& fields) const;
  void declare(Options& options, const std::vector<Option>& of_task) const;
  std::shared_ptr<const Model> open(const Options& options) const;
  std::int64_t goal_count(const std::vector<Field>& observation) const;
  Fields described(const Builder& builder, const mjenv_task& callbacks) const;
};

// Makes a task of the struct of a caller, which may have been compiled with an older or newer header.
std::unique_ptr<RegisteredTask> users_task(const mjenv_task* given, const void* plugin);

}  // namespace mjenv::core
