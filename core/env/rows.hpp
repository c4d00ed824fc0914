// The rows of an environment: the memory of their parts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include "engine/own_arrays.hpp"
#include "engine/work.hpp"
#include "env/parts.hpp"
#include "system/memory.hpp"
#include "task/task.hpp"

namespace mjenv::core {

// Which computation last produced the row's derived arrays (xpos and so on). cleared: mj_resetData. forward: the
// mj_forward of a reset, or of set_state before any step. step: the last mj_step. set: the mj_forward of set_state
// after a step, which keeps that step's forces (cacc, cfrc_int, cfrc_ext).
enum class Origin : std::uint8_t { cleared, forward, step, set };

// Whether state or own values were written after the derived arrays were computed. by_task: the task's step wrote own
// values or velocities, and carry was called afterwards. by_caller: the caller wrote, so carry must be called before
// the next step.
enum class Written : std::uint8_t { no, by_task, by_caller };

// What the caller of a physics_only task has yet to do with a row (Env::begin).
enum class Phase : std::uint8_t {
  done,       // nothing
  ended,      // begin a new episode, because the step has ended the old one (autoreset_mode same_step)
  begun,      // finish a reset
  restarted,  // finish the reset that follows a step
  advanced,   // finish a step
  diverged    // finish a step in which MuJoCo found bad numbers
};

class Rows {
 public:
  struct Head {
    Rng rng;
    std::int64_t steps = 0;
    Origin origin = Origin::cleared;
    bool seeded = false;  // rng is seeded
    bool ready = false;   // the row can be stepped: it was reset, or its state was set
    bool ended = false;   // the row's episode has ended
    Written written = Written::no;
    // mj_setConst was called after the derived arrays were computed. Worker::hold calls it again, because it changes
    // mjData.
    bool has_constants = false;
    std::uint8_t kept = 0;      // the kept parts that the row has, as bits (PartKind::kept)
    std::uint8_t warnings = 0;  // Work::step_warnings of the last step, reset or set_state
  };

  // history_count: how many numbers a row's history has.
  Rows(const Task& task, std::size_t history_count, std::int64_t count);

  std::int64_t count() const { return static_cast<std::int64_t>(heads_.size()); }
  void check(std::int64_t row) const;
  // Whether some row has constants (Head::has_constants).
  bool has_constants() const;
  const StateLayout& layout() const { return layout_; }

  Head& head(std::int64_t row) { return heads_[static_cast<std::size_t>(row)]; }
  const Head& head(std::int64_t row) const { return heads_[static_cast<std::size_t>(row)]; }
  // The worker that last computed the row. It is not part of the row, because results do not depend on it.
  std::int32_t& worker(std::int64_t row) { return workers_[static_cast<std::size_t>(row)]; }
  std::int32_t worker(std::int64_t row) const { return workers_[static_cast<std::size_t>(row)]; }
  // Like the worker, the phase is not part of the row, because a row with an open phase cannot be copied.
  Phase phase(std::int64_t row) const { return phases_.empty() ? Phase::done : phases_[static_cast<std::size_t>(row)]; }
  void set_phase(std::int64_t row, Phase phase) {
    if (!phases_.empty()) phases_[static_cast<std::size_t>(row)] = phase;
  }
  bool is_open(std::int64_t row) const { return phase(row) > Phase::ended; }
  // The first row with a step or reset to finish; -1 if there is none.
  std::int64_t first_open() const;
  double* state(std::int64_t row) { return numbers(Part::state, row); }
  // The state before the computation that Origin names, so that a worker can repeat it.
  double* computed_state(std::int64_t row) { return numbers(Part::computed_state, row); }
  double* stepped_state(std::int64_t row) { return numbers(Part::stepped_state, row); }
  double* constants_rest(std::int64_t row) { return numbers(Part::constants_rest, row); }
  double* carried(std::int64_t row) { return numbers(Part::carried, row); }
  double* parameters(std::int64_t row) { return numbers(Part::parameters, row); }
  double* perturbation(std::int64_t row) { return numbers(Part::perturbation, row); }
  const double* perturbation(std::int64_t row) const { return numbers(Part::perturbation, row); }
  double* history(std::int64_t row) { return numbers(Part::history, row); }
  // The row's stream of RandomState, if the task draws from one. A reset that succeeds replaces it.
  bool has_random_state() const { return has_random_state_; }
  np::RandomState random_state(std::int64_t row) const;
  void set_random_state(std::int64_t row, const np::RandomState& stream);
  double* ranges(std::int64_t row) { return numbers(Part::ranges, row); }
  bool has_perturbation() const { return sizes_[index_of(Part::perturbation)] > 0; }

  // The arrays for which rows have their own values.
  const OwnArrays& arrays() const { return arrays_; }
  std::size_t block_bytes() const { return arrays_.block_bytes(); }
  // A block with the model's values, and for inputs of mjData, those that mj_resetData sets. All rows whose values were
  // never written share it, so that only the others need memory.
  const std::byte* model_values() const { return reinterpret_cast<const std::byte*>(model_values_.data()); }
  bool shares_model_values(std::int64_t row) const { return owns_values_[static_cast<std::size_t>(row)] == 0; }
  // The row's own values in this version. If the version `constants` has none of its own, returns null.
  const std::byte* values(std::int64_t row, Version version = Version::now) const;
  // The row's present own values, for writing. If the row has shared the model's, it now has a copy of them.
  std::byte* own_values(std::int64_t row);
  // Replaces the row's present own values. If the row shares the model's values and the new ones are equal to these, it
  // goes on sharing them.
  void set_values(std::int64_t row, const std::byte* block);
  void share_model_values(std::int64_t row) { owns_values_[static_cast<std::size_t>(row)] = 0; }
  // Gives all rows own values of these arrays; at first they are those of model_values. Changes nothing if it fails.
  // Invalidates pointers to own values.
  void add_arrays(const std::vector<std::string>& names);

  // Clears the inputs of mjData among the present values (qfrc_applied, mocap_pos, ...), as mj_resetData does.
  void clear_inputs(std::int64_t row);

  // These allocate the memory that keep_step and keep_constants need. `keep` needs none.
  void prepare_keep_step() { make_room({Part::stepped_state, Part::stepped_values}); }
  void prepare_keep_constants() { make_room({Part::constants_rest, Part::constants_values}); }
  // Gives all rows memory for these parts.
  void make_room(std::initializer_list<Part> parts);
  // Call this before the row's state or own values are written. Keeps the values from which the derived arrays were
  // computed.
  void keep(std::int64_t row);
  // Call this after a step, before set_state replaces the version `computed`. Keeps the step's version as `stepped`.
  void keep_step(std::int64_t row);
  // Call this before the results of mj_setConst replace the present state and values. Keeps these as `constants`, in
  // place of what an earlier call has kept.
  void keep_constants(std::int64_t row);
  // Call this when all derived arrays have been computed from the present state and values.
  void drop_kept(std::int64_t row) { head(row).kept = 0; }
  // Call this instead of drop_kept when set_state has computed the derived arrays after a step, because what keep_step
  // has kept is still needed.
  void drop_all_but_step(std::int64_t row) {
    head(row).kept &= kept_bit(Part::stepped_state) | kept_bit(Part::stepped_values);
  }

  // Access to any part of a row, for copies, images and new settings.
  bool has(std::int64_t row, const PartKind& kind) const { return kind.is_in(head(row).kept); }
  std::size_t bytes_of(Content content) const;
  const std::byte* bytes(Part part, std::int64_t row) const;
  // The same for writing all bytes of the part.
  std::byte* room(Part part, std::int64_t row);
  void copy(std::int64_t from, std::int64_t to);

  // make_perturbation returns records of `size` numbers for all rows, for set_perturbation.
  Zeros make_perturbation(std::uint64_t size) const;
  void set_perturbation(Zeros records, std::size_t size) noexcept;
  // ranges: those that all rows have at first.
  Zeros make_ranges(const std::vector<double>& ranges) const;
  void set_ranges(Zeros of_rows, std::size_t size) noexcept;

 private:
  StateLayout layout_;
  std::size_t carry_count_, parameter_count_, history_count_;
  bool has_random_state_;
  OwnArrays arrays_;
  std::vector<Head> heads_;
  std::vector<std::int32_t> workers_;
  std::vector<Phase> phases_;  // empty unless the task is physics_only
  std::vector<double> model_values_;
  // Whether the row has a copy of its own. Bytes instead of bits, because threads write neighbours at the same time.
  std::vector<std::uint8_t> owns_values_;
  // For each part except the head: the numbers of all rows, and how many a row has (for kept parts 0, until one is
  // needed).
  std::array<Zeros, kPartCount> numbers_;
  std::array<std::size_t, kPartCount> sizes_{};

  double* numbers(Part part, std::int64_t row) {
    return numbers_[index_of(part)].data() + static_cast<std::size_t>(row) * sizes_[index_of(part)];
  }
  const double* numbers(Part part, std::int64_t row) const { return const_cast<Rows*>(this)->numbers(part, row); }
  bool is_kept(std::int64_t row, Part part) const { return (head(row).kept & kept_bit(part)) != 0; }
  // Copies the numbers to this part of the row and marks it as kept.
  void keep_as(std::int64_t row, Part part, const void* numbers);
};

}  // namespace mjenv::core
