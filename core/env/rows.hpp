// The rows of an environment, in two arrays: their heads and their records.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/work.hpp"
#include "task/robot.hpp"

namespace mjenv::core {

// Which computation last produced a row's derived arrays (xpos, cfrc_ext and the like). `set` is a forward in
// mid-episode: forces are still those of the step before it.
enum class Origin : std::uint8_t { cleared, forward, step, set };

class Rows {
 public:
  struct Head {
    Rng rng;
    std::int64_t steps = 0;
    std::int32_t worker = 0;  // the one that computed this row last
    Origin origin = Origin::cleared;
    bool seeded = false, ready = false, ended = false;
  };

  Rows(const StateLayout& layout, Eigen::Index carry_count, std::int64_t count);

  std::int64_t count() const { return static_cast<std::int64_t>(heads_.size()); }
  void check(std::int64_t row) const;
  Head& head(std::int64_t row) { return heads_[static_cast<std::size_t>(row)]; }
  const Head& head(std::int64_t row) const { return heads_[static_cast<std::size_t>(row)]; }

  // A record is four parts, one after the other: the state; the state before the last evaluation (after `set`, before
  // the last step); what the task carries; and after `set` the qpos and qacc_warmstart that the forward changed.
  double* state(std::int64_t row) { return records_.data() + static_cast<std::size_t>(row) * record_size_; }
  const double* state(std::int64_t row) const { return const_cast<Rows*>(this)->state(row); }
  double* before(std::int64_t row) { return state(row) + state_size_; }
  double* carried(std::int64_t row) { return before(row) + state_size_; }
  double* changed(std::int64_t row) { return carried(row) + carry_count_; }
  std::size_t record_bytes() const { return record_size_ * sizeof(double); }

  void copy(std::int64_t from, std::int64_t to);

 private:
  std::size_t state_size_, carry_count_, record_size_;
  std::vector<Head> heads_;
  std::vector<double> records_;
};

}  // namespace mjenv::core
