// The mjenv_builder that the library passes to a task's callback build.
#pragma once

#include <new>
#include <optional>
#include <string>
#include <vector>

#include "error.hpp"
#include "mjenv/task.h"
#include "task/options.hpp"
#include "task/random.hpp"
#include "task/task.hpp"
#include "task/task_field.hpp"

namespace mjenv::core {

class Builder : public mjenv_builder {
 public:
  // options: those that the caller set. view: shows the model's initial state.
  Builder(const Options& options, const Model& model, SimView& view, std::vector<Field> fields,
          std::int64_t carry_count, const Parameters& parameters);

  // Returns body's result. If body throws, keeps the error for `check` and returns `fallback`. After that, no further
  // body is called.
  template <typename T, typename Body>
  T attempt(T fallback, const Body& body) noexcept;
  template <typename Body>
  void attempt(const Body& body) noexcept {
    attempt(0, [&] { return body(), 0; });
  }
  // Throws the error that attempt kept, if there is one.
  void check() const;

  std::int64_t integer(const std::string& option) const;
  void reals(const std::string& option, double* values, std::int64_t count) const;
  bool is_integer(const std::string& option) const { return option_of(option, MJENV_KIND_REALS).given_as_integer; }
  const char* text(const std::string& option) const;
  int index(const std::string& type, const std::string& name) const;
  int option_index(const std::string& option, const std::string& type) const;
  np::Norm norm();
  void need(const std::string& array) { view_.need(array); }
  int array(const std::string& name, mjenv_field* field);
  void need_current() { view_.need_current(); }
  int need_own(const std::string& array) { return view_.need_own(array); }
  void action(std::int64_t count, const double* low, const double* high);
  void need_random_state() { view_.need_random_state(); }
  void describe(const mjenv_task_field& field) { replace_or_add(fields_, field_of(field)); }

  void carry(std::int64_t count);
  void carry_bounds(const CarryBounds& bounds);
  void keep(const KeptNumbers& numbers);
  std::int64_t parameter(const std::string& option) const;

  // The name of the model, for messages.
  const std::string& label() const { return model_.label(); }

  std::int64_t carry_count() const { return static_cast<std::int64_t>(view_.carry_count()); }
  const std::vector<CarryBounds>& bounds() const { return bounds_; }
  const std::vector<KeptNumbers>& kept() const { return kept_; }
  const std::vector<Field>& fields() const { return fields_; }
  // The rounding of norms, if the task has asked for it.
  const std::optional<np::Norm>& rounding() const { return norm_; }

 private:
  const Options& options_;
  const Model& model_;
  SimView& view_;
  std::vector<Field> fields_;
  const Parameters& parameters_;
  std::vector<CarryBounds> bounds_;
  std::vector<KeptNumbers> kept_;
  std::optional<np::Norm> norm_;
  Rng trial_stream_ = Rng::from_seed(0);
  Random trial_{&trial_stream_};
  mjenv_status status_ = MJENV_OK;
  std::string message_;

  const Option& option_of(const std::string& name, mjenv_kind kind) const;
};

template <typename T, typename Body>
T Builder::attempt(T fallback, const Body& body) noexcept {
  if (failed != 0) return fallback;
  try {
    try {
      return body();
    } catch (const Error& error) {
      message_ = error.what();
      status_ = error.status();
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& error) {
      message_ = error.what();
      status_ = MJENV_E_TASK;
    }
  } catch (const std::exception&) {  // out of memory, perhaps for the message
    status_ = MJENV_E_MEMORY;
  }
  failed = 1;
  return fallback;
}

}  // namespace mjenv::core
