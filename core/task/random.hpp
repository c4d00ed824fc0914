// A row's random stream, as callbacks get it (mjenv/task.h).
#pragma once

#include "mjenv/task.h"
#include "numpy/random.hpp"
#include "numpy/random_state.hpp"

namespace mjenv::core {

using Rng = np::Generator;

// A copy of the row's stream, made at the first draw. The row gets the copy only if the callback succeeds.
class Random : public mjenv_random {
 public:
  // stream: null if the row was never seeded. Then the first draw seeds it.
  explicit Random(const Rng* stream);

  Rng& rng() {
    if (!drew_) copy();
    return rng_;
  }
  bool drew() const { return drew_; }

  // The RandomState from which this callback draws; null if it has none.
  np::RandomState* state = nullptr;

  // Why a draw, or in reset a simulation, failed. If it is MJENV_E_TASK, task_message() tells the reason.
  mjenv_status failure = MJENV_OK;

 private:
  const Rng* stream_;
  bool drew_ = false;
  Rng rng_;

  void copy();
};

}  // namespace mjenv::core
