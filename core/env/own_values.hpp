// Stores each row's own values of arrays (a block of memory per row, laid out by OwnArrays), and the older values and
// state from which its derived arrays can be computed again after a write.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/own_arrays.hpp"

namespace mjenv::core {

// As in Gymnasium, a write changes no derived array until the next mj_step or mj_forward. But rows do not store their
// derived arrays: workers compute them again when they are needed, and after a write this must give what it gave before
// the write. So a row keeps up to four versions of its values: the present ones; those with which its derived arrays
// were computed, if the row was written since, or MuJoCo cleared its inputs when it diverged; those with which its last
// mj_step ran, if set_state was called since and its mj_forward used other values; and those with which mj_setConst was
// called. It also keeps the state that set_state has set after a step, if the row was written since.
class OwnValues {
 public:
  // state_size: how many numbers the state of a row has.
  OwnValues(const Model& model, std::int64_t rows, std::size_t state_size)
      : arrays_(model), rows_(static_cast<std::size_t>(rows)), state_size_(state_size) {}

  bool empty() const { return arrays_.list().empty(); }
  const OwnArrays& arrays() const { return arrays_; }
  // Gives all rows their own values of these arrays, at first the model's; for inputs of mjData, those that
  // mj_resetData sets. Changes nothing if it fails.
  void add(const std::vector<std::string>& names);

  std::size_t block_bytes() const { return arrays_.block_bytes(); }
  using Block = std::unique_ptr<double[]>;  // aligned for doubles
  Block room() const { return std::make_unique<double[]>(block_bytes() / sizeof(double)); }

  // The row's values as last written; those with which its derived arrays were computed (the present ones unless older
  // ones are kept); those with which its last mj_step ran (the computed ones unless older ones are kept). Call these
  // only if rows have own values: !empty().
  std::byte* present(std::int64_t row);
  std::byte* computed(std::int64_t row);
  std::byte* stepped(std::int64_t row);
  const std::byte* present(std::int64_t row) const { return const_cast<OwnValues*>(this)->present(row); }
  // The values with which mj_setConst was called; null if the row had none of its own then.
  const std::byte* of_constants(std::int64_t row) const;
  // The state that set_state has set, if it is kept, else null.
  const double* state(std::int64_t row) const;

  // Call keep before own values are overwritten, and keep_state before the row's state is overwritten, if set_state has
  // set it. Neither replaces what is kept already.
  void keep(std::int64_t row);
  // The same without allocating: room has block_bytes().
  void keep(std::int64_t row, Block room) noexcept;
  void keep_state(std::int64_t row, const double* state);
  // Call this before you overwrite the present values with the constants that mj_setConst has computed. Replaces what
  // was kept before.
  void keep_constants(std::int64_t row);
  // Call computed_all when everything was computed with the present values: nothing older is needed. Call
  // computed_after_step when set_state has computed after a step: the derived forces stay those of that step, so the
  // values with which it ran stay kept.
  void computed_all(std::int64_t row);
  void computed_after_step(std::int64_t row);

  // Clears the inputs of mjData (qfrc_applied, mocap_pos, ...: own_arrays.hpp), as mj_resetData does.
  void clear_inputs(std::int64_t row);
  // Whether the row has forces that lanes do not compute (OwnArrays::has_forces), and how many rows have. Call
  // note_forces when inputs of mjData were written to the present values.
  bool has_forces(std::int64_t row) const { return !forced_.empty() && forced_[static_cast<std::size_t>(row)] != 0; }
  std::int64_t forced_rows() const;
  void note_forces(std::int64_t row);

  // For copies and images of rows. What was kept of a row; a null pointer where nothing was.
  struct Past {
    Block computed, stepped, constants, state;
  };
  // Null until make_pasts or add has allocated room: until then nothing is kept of any row.
  const Past* past(std::int64_t row) const { return past_.empty() ? nullptr : &past_[static_cast<std::size_t>(row)]; }
  // A copy of what was kept of the row. Call only if past(row) is not null.
  Past copied_past(std::int64_t row) const;
  // Copies the values of a row. Does not throw. kept: what copied_past returned for `from`; empty if past is null.
  void copy(std::int64_t from, std::int64_t to, Past kept);
  // Allocates room for what is kept of the rows.
  void make_pasts();
  // Copies a block that is laid out by `layout` into a new block that is laid out by arrays(). Arrays that `layout`
  // lacks get the values that `add` gives them.
  Block translated(const OwnArrays& layout, const std::byte* block) const;
  // Replaces the row's values and what is kept of it. Does not throw. If `past` has anything, call make_pasts first.
  void set(std::int64_t row, const OwnArrays& layout, const std::byte* block, Past past);

 private:
  OwnArrays arrays_;
  std::size_t rows_;
  std::vector<double> blocks_;
  std::vector<std::uint8_t> forced_;  // for has_forces; empty until rows have inputs of their own
  std::vector<Past> past_;            // empty until make_pasts or add has allocated it
  std::size_t state_size_;

  Past* past(std::int64_t row) { return past_.empty() ? nullptr : &past_[static_cast<std::size_t>(row)]; }
  Past& make_past(std::int64_t row);
  void translate(const OwnArrays& layout, const std::byte* block, std::byte* to) const;
};

}  // namespace mjenv::core
