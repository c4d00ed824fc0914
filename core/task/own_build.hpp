// The mjenv_builder that a registered task's callback `build` is given.
#pragma once

#include <string>
#include <vector>

#include "engine/work.hpp"
#include "error.hpp"
#include "mjenv/task.h"
#include "task/options.hpp"
#include "task/own_task.hpp"

namespace mjenv::core {

class OwnBuild : public mjenv_builder {
 public:
  // options: the caller's options. work: holds the model's initial state.
  OwnBuild(const Options& options, const Model& model, Work& work, std::vector<OwnField> fields,
           std::int64_t carry_count);

  // Calls body and returns its result. If body throws, keeps the error for `check` and returns `fallback`, and from
  // then on does not call body.
  template <typename T, typename Body>
  T attempt(T fallback, const Body& body) noexcept;
  // Throws the error that attempt kept, if there is one.
  void check() const;

  std::int64_t integer(const std::string& option) const;
  void reals(const std::string& option, double* values, std::int64_t count) const;
  bool is_integer(const std::string& option) const { return options_.get(option).given_as_integer; }
  const char* text(const std::string& option) const;
  int index(const std::string& type, const std::string& name) const;
  int option_index(const std::string& option, const std::string& type) const;
  np::Norm norm();
  void need(const std::string& array) { work_.need(array); }
  int array(const std::string& name, mjenv_field* field);
  void describe(const mjenv_task_field& field) { replace_or_add(fields_, own_field(field)); }

  void carry(std::int64_t count);

  std::int64_t carry_count() const { return static_cast<std::int64_t>(work_.carry_count()); }
  const std::vector<OwnField>& fields() const { return fields_; }
  // The rounding of norms, if the task has asked for it.
  const std::optional<np::Norm>& rounding() const { return norm_; }

 private:
  const Options& options_;
  const Model& model_;
  Work& work_;
  std::vector<OwnField> fields_;
  std::optional<np::Norm> norm_;
  Rng trial_rng_ = Rng::from_seed(0);
  OwnRandom trial_{trial_rng_};
  mjenv_status status_ = MJENV_OK;
  std::string message_;

  const Option& option_of(const std::string& name, mjenv_kind kind) const;
};

template <typename T, typename Body>
T OwnBuild::attempt(T fallback, const Body& body) noexcept {
  if (status_ != MJENV_OK) return fallback;
  try {
    try {
      return body();
    } catch (const Error& error) {
      message_ = error.what();
      status_ = error.status();
    } catch (const std::exception& error) {
      message_ = error.what();
      status_ = MJENV_E_TASK;
    }
  } catch (const std::exception&) {  // out of memory for the text
    status_ = MJENV_E_MEMORY;
  }
  return fallback;
}

}  // namespace mjenv::core
