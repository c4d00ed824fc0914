// The rows of an environment: the memory of their parts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/own_arrays.hpp"
#include "engine/work.hpp"
#include "env/parts.hpp"
#include "system/memory.hpp"
#include "task/task.hpp"

namespace mjenv::core {

// The first entry of a row's recipe. cleared: mj_resetData. forward: mj_resetData and mj_forward, in a reset or in a
// set_state before any step. step: the last mj_step.
enum class Origin : std::uint8_t { cleared, forward, step };

// Whether the present state or own values differ from those of the recipe's last entry. by_task: the task's step wrote
// them, and carry was called afterwards. by_caller: the caller wrote, so carry must be called before the next step.
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
    std::uint8_t warnings = 0;  // Work::step_warnings of the last step, reset or set_state
    std::uint16_t kept = 0;     // the kept parts that the row has, as bits (PartKind::kept)
  };

  // history_count: how many numbers a row's history has.
  Rows(const Task& task, std::size_t history_count, std::int64_t count);

  std::int64_t count() const { return static_cast<std::int64_t>(heads_.size()); }
  void check(std::int64_t row) const;
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
  // The numbers of any part but the head.
  double* numbers(Part part, std::int64_t row) {
    return numbers_[index_of(part)].data() + static_cast<std::size_t>(row) * sizes_[index_of(part)];
  }
  // The state with which an entry of the recipe began; of set_constants, StateLayout::rest.
  double* state(std::int64_t row, Entry entry = Entry::now) { return numbers(state_of(entry), row); }
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
  // The own values with which an entry of the recipe began.
  const std::byte* values(std::int64_t row, Entry entry = Entry::now) const;
  // The row's present own values, for writing. If the row has shared the model's, it now has a copy of them.
  std::byte* own_values(std::int64_t row);
  // Replaces the row's present own values. A row that shares the model's values gets no copy of equal ones.
  void set_values(std::int64_t row, const std::byte* block);
  void share_model_values(std::int64_t row) { owns_values_[static_cast<std::size_t>(row)] = 0; }
  // Gives all rows own values of these arrays; at first they are those of model_values. Changes nothing if it fails.
  // Invalidates pointers to own values.
  void add_arrays(const std::vector<std::string>& names);

  // Clears the inputs of mjData among the present values (qfrc_applied, mocap_pos, ...), as mj_resetData does.
  void clear_inputs(std::int64_t row);

  // Whether the row's recipe, or that of some row, has this entry.
  bool has(std::int64_t row, Entry entry) const { return kParts[index_of(state_of(entry))].is_in(head(row).kept); }
  bool any_has(Entry entry) const;
  // The last entry of the row's recipe before `now`.
  Entry last(std::int64_t row) const { return last_before(row, Entry::now); }
  // Whether the present state or own values may differ from those that the recipe's computations leave.
  bool is_written(std::int64_t row) const { return head(row).written != Written::no || has(row, Entry::set_constants); }
  // Whether mjData is what the last step has left.
  bool ends_with_step(std::int64_t row) const {
    return head(row).origin == Origin::step && !has(row, Entry::set_state) && !is_written(row);
  }
  // Begins a new recipe. The caller then writes the state of the entry `first`.
  void begin(std::int64_t row, Origin origin);
  // Appends an entry, in place of this and later ones that the recipe has. The caller then writes the entry's state.
  // Call make_room first.
  void append(std::int64_t row, Entry entry);
  // Call this before the row's present own values are written: the recipe keeps those with which it has computed.
  void keep(std::int64_t row);
  // Gives all rows memory for what this entry keeps. The other functions for recipes need none.
  void make_room(Entry entry);

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

  const double* numbers(Part part, std::int64_t row) const { return const_cast<Rows*>(this)->numbers(part, row); }
  bool is_kept(std::int64_t row, Part part) const { return (head(row).kept & kept_bit(part)) != 0; }
  Entry last_before(std::int64_t row, Entry entry) const;
  void keep_values(std::int64_t row, Entry entry, const std::byte* block);
};

}  // namespace mjenv::core
