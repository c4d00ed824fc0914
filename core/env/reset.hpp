// Plays the reset of a row.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>

#include "env/holder.hpp"
#include "env/randomization.hpp"
#include "env/scratch.hpp"

namespace mjenv::core {

// The initial state that the caller gives to an episode: positions, velocities, or neither (null).
struct Initial {
  const double *qpos = nullptr, *qvel = nullptr;

  void copy_to(const Work::State& state, const StateLayout& layout) const {
    if (qpos) std::copy_n(qpos, layout.nq, state.qpos);
    if (qvel) std::copy_n(qvel, layout.nv, state.qvel);
  }
};

class Reset {
 public:
  Reset(Holder& holder, Scratch& scratch) : holder_(holder), scratch_(scratch) {}

  // Begins an episode: the task draws the initial state from rng, the randomisation draws its values, and mj_forward
  // computes the derived arrays. As with a wrapper around Gymnasium's environment, which draws after the reset, this
  // reset still has the row's old values; `adopt` gives it the drawn ones.
  // initial: replaces what the task has drawn.
  void begin(std::int64_t row, const Rng& rng, const Randomization& randomization = {}, const Initial& initial = {});
  void adopt(std::int64_t row) noexcept;

 private:
  Holder& holder_;
  Scratch& scratch_;
  const std::function<void()> take_own_ = [this] { take_own(); };

  // Copies what the task has written to the own values. Throws if MuJoCo cannot compute with it.
  void take_own();
  // Draws own values for `adopt`.
  void draw(std::int64_t row, const Randomization& randomization);
};

}  // namespace mjenv::core
