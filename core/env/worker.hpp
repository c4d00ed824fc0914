// Computes rows, one at a time.
#pragma once

#include <cstdint>
#include <new>
#include <vector>

#include "env/failures.hpp"
#include "env/holder.hpp"
#include "env/perturbation.hpp"
#include "env/reset.hpp"
#include "env/scratch.hpp"
#include "env/task_step.hpp"
#include "env/writer.hpp"
#include "error.hpp"

namespace mjenv::core {

class Worker : public Holder {
  Scratch scratch_;

 public:
  Worker(std::int32_t i, const Task& task, Rows& rows) : Holder(i, task, rows), writer(task, work(), view()) {}

  Reset reset{*this, scratch_};
  TaskStep step{*this, scratch_};
  Writer writer;
  Failures failures;
  // Scratch memory for one step of a perturbed row (Perturbation::make_step), and for an action (ActionTransform::apply).
  Perturbation::Step perturbed;
  std::vector<double> transformed;

  void prepare(const Schema& schema, const Frames& frames) {
    writer.prepare(schema, frames, arrays());
    transformed.resize(static_cast<std::size_t>(task().action_count()));
  }
  // Allocates what steps and resets need if rows have arrays of their own. forget_layout: Scratch.
  void prepare() { scratch_.prepare(*this); }
  void forget_layout() { scratch_.forget_layout(); }

  // Calls body(). If it throws, adds the error to the failures and returns false.
  template <typename Body>
  bool attempt(std::int64_t row, const Body& body) noexcept;

 private:
  void fail_row(std::int64_t row, mjenv_status status, const char* what) noexcept;
};

template <typename Body>
bool Worker::attempt(std::int64_t row, const Body& body) noexcept {
  try {
    body();
    return true;
  } catch (const std::bad_alloc&) {
    fail_row(row, MJENV_E_MEMORY, "out of memory");
  } catch (const Error& error) {
    fail_row(row, error.status(), error.what());
  } catch (const std::exception& error) {
    fail_row(row, MJENV_E_INTERNAL, error.what());
  }
  return false;
}

inline void Worker::fail_row(std::int64_t row, mjenv_status status, const char* what) noexcept {
  release();
  try {
    failures.add(status, in_row(row, what));
  } catch (const std::exception&) {  // no memory for the text
    failures.add(MJENV_E_MEMORY, "");
  }
}

}  // namespace mjenv::core
