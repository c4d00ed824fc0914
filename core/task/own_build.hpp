// What the callback build of a task from outside is given.
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
  // options: as the caller set them. work: holds the model's initial state.
  OwnBuild(const Options& options, const Model& model, Work& work, std::vector<OwnField> fields,
           std::int64_t carry_count);

  // Calls body and returns what it does. What it throws is kept for check; from then on this returns `otherwise`.
  template <typename T, typename Body>
  T attempt(T otherwise, const Body& body) noexcept;
  // Throws what an attempt failed with.
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
  void describe(const mjenv_task_field& field) { put_field(fields_, own_field(field)); }

  void carry(std::int64_t count);

  std::int64_t carry_count() const { return static_cast<std::int64_t>(work_.carry_count()); }
  const std::vector<OwnField>& fields() const { return fields_; }
  // The rounding of norms, if the task asked for it.
  const std::optional<np::Norm>& rounding() const { return norm_; }

 private:
  const Options& options_;
  const Model& model_;
  Work& work_;
  std::vector<OwnField> fields_;
  std::optional<np::Norm> norm_;
  Rng trial_rng_ = Rng::from_seed(0);
  OwnRandom trial_{trial_rng_};
  mjenv_status failed_ = MJENV_OK;
  std::string why_;

  const Option& option_of(const std::string& name, mjenv_kind kind) const;
};

template <typename T, typename Body>
T OwnBuild::attempt(T otherwise, const Body& body) noexcept {
  if (failed_ != MJENV_OK) return otherwise;
  try {
    try {
      return body();
    } catch (const Error& error) {
      why_ = error.what();
      failed_ = error.status();
    } catch (const std::exception& error) {
      why_ = error.what();
      failed_ = MJENV_E_TASK;
    }
  } catch (const std::exception&) {  // no memory for the text
    failed_ = MJENV_E_MEMORY;
  }
  return otherwise;
}

}  // namespace mjenv::core
