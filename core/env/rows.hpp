// The rows of an environment. Each has a head (random stream, counters, flags) and a record (its simulation state).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/work.hpp"
#include "env/own_values.hpp"
#include "task/task.hpp"

namespace mjenv::core {

// Which computation last produced the row's derived arrays (xpos and so on): mj_resetData (cleared), the mj_forward of
// a reset or of set_state before any step (forward), the last mj_step (step), or the mj_forward of set_state after a
// step (set), which keeps that step's forces (cacc, cfrc_int, cfrc_ext).
enum class Origin : std::uint8_t { cleared, forward, step, set };

class Rows {
 public:
  struct Head {
    Rng rng;
    std::int64_t steps = 0;
    std::int32_t worker = 0;  // the worker that last computed this row
    Origin origin = Origin::cleared;
    bool seeded = false;  // rng is seeded
    bool ready = false;   // the row can be stepped: it was reset, or its state was set
    bool ended = false;   // the row's episode has ended
    // State or own values were written after the derived arrays were computed.
    bool written = false;
    // mj_setConst was called after the derived arrays were computed. It also changes mjData, so Worker::hold must call
    // it again.
    bool has_constants = false;
  };

  Rows(const Model& model, std::int64_t carry_count, std::int64_t count);

  std::int64_t count() const { return static_cast<std::int64_t>(heads_.size()); }
  void check(std::int64_t row) const;
  Head& head(std::int64_t row) { return heads_[static_cast<std::size_t>(row)]; }
  const Head& head(std::int64_t row) const { return heads_[static_cast<std::size_t>(row)]; }

  // A record has five parts, one after the other:
  // 1. the state;
  // 2. the state before the computation that Origin names (for `set`: before the last mj_step), so that Worker can
  //    compute it again;
  // 3. the numbers that the task keeps for the row's next step (Work::carried);
  // 4. for `set`: qpos, qacc_warmstart and StateLayout::rest as its mj_forward got them, because it changes them;
  // 5. StateLayout::rest as it was when mj_setConst was called.
  double* state(std::int64_t row) { return records_.data() + static_cast<std::size_t>(row) * record_size_; }
  const double* state(std::int64_t row) const { return const_cast<Rows*>(this)->state(row); }
  double* before(std::int64_t row) { return state(row) + state_size_; }
  double* carried(std::int64_t row) { return before(row) + state_size_; }
  double* changed(std::int64_t row) { return carried(row) + carry_count_; }
  double* of_constants(std::int64_t row) { return changed(row) + layout_.nq + layout_.nv + layout_.more; }
  std::size_t record_bytes() const { return record_size_ * sizeof(double); }
  const StateLayout& layout() const { return layout_; }

  OwnValues& own() { return own_; }
  const OwnValues& own() const { return own_; }
  // Call before the row's state or own values are written. Keeps the old ones as long as the derived arrays need them.
  void keep(std::int64_t row);

  // What a row needs for noise, delays and pushes; nothing without them (Perturbation).
  bool has_perturbed() const { return perturbed_size_ > 0; }
  double* perturbed(std::int64_t row) { return perturbed_.data() + static_cast<std::size_t>(row) * perturbed_size_; }
  const double* perturbed(std::int64_t row) const { return const_cast<Rows*>(this)->perturbed(row); }
  std::size_t perturbed_bytes() const { return perturbed_size_ * sizeof(double); }
  std::vector<double> make_perturbed(std::size_t size) const;
  void set_perturbed(std::vector<double> records, std::size_t size) noexcept;

  // kept: what OwnValues::copied_past returned for `from`, or empty.
  void copy(std::int64_t from, std::int64_t to, OwnValues::Past kept);

 private:
  StateLayout layout_;
  std::size_t state_size_, carry_count_, record_size_;
  OwnValues own_;
  std::vector<Head> heads_;
  std::vector<double> records_, perturbed_;
  std::size_t perturbed_size_ = 0;
};

}  // namespace mjenv::core
