// The values of the arrays that rows have of their own: a block of memory for each row, laid out by OwnArrays. And what
// is needed to compute a row's derived arrays again after its values or its state were written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/own_arrays.hpp"

namespace mjenv::core {

// A row's derived arrays are computed again with the values with which they were computed first. So a row keeps up to
// four versions of its values: the present ones; those with which its derived arrays were computed, if they were
// written since; those with which its last mj_step ran, if set_state has computed with others; and those with which
// mj_setConst was called. It also keeps the state that set_state has set, if it was written since.
class OwnValues {
 public:
  OwnValues(const Model& model, std::int64_t rows) : arrays_(model), rows_(static_cast<std::size_t>(rows)) {}

  bool empty() const { return arrays_.list().empty(); }
  const OwnArrays& arrays() const { return arrays_; }
  // Gives all rows their own values of these arrays, at first the model's. Changes nothing if it fails.
  void add(const std::vector<std::string>& names);

  std::size_t block_bytes() const { return arrays_.block_bytes(); }

  // The row's values as last written; those with which its derived arrays were computed; those with which its last
  // mj_step ran. The latter two are the present values if no others are kept. For use while not empty().
  std::byte* present(std::int64_t row);
  std::byte* computed(std::int64_t row);
  std::byte* stepped(std::int64_t row);
  const std::byte* present(std::int64_t row) const { return const_cast<OwnValues*>(this)->present(row); }
  // The values with which mj_setConst was called.
  std::byte* of_constants(std::int64_t row);
  // The state that was kept, or null.
  const double* state(std::int64_t row) const;

  // Call before the row's values, or its state, are written.
  void keep(std::int64_t row);
  void keep_state(std::int64_t row, const double* state, std::size_t size);
  // Call before mj_setConst.
  void keep_constants(std::int64_t row);
  // Call computed_all when all derived arrays were computed with the present values, and computed_after_step when
  // set_state computed them, whose forces are still those of the last mj_step.
  void computed_all(std::int64_t row);
  void computed_after_step(std::int64_t row);

  // Clears the inputs of mjData, as mj_resetData does.
  void clear_inputs(std::int64_t row) { arrays_.clear_inputs(present(row)); }
  void copy(std::int64_t from, std::int64_t to);

  // For images of rows. What was kept of a row; a null pointer where nothing was.
  using Block = std::unique_ptr<double[]>;  // aligned for doubles
  struct Past {
    Block computed, stepped, constants, state;
  };
  // Null if there is no room for what is kept: nothing was kept then.
  const Past* past(std::int64_t row) const { return past_.empty() ? nullptr : &past_[static_cast<std::size_t>(row)]; }
  // Allocates room for what is kept of the rows.
  void make_pasts();
  // Copies a block that is laid out by `layout` into a new block that is laid out by arrays(). Arrays that `layout`
  // lacks get the model's values.
  Block translated(const OwnArrays& layout, const std::byte* block) const;
  // Does not throw. Call make_pasts first.
  void set(std::int64_t row, const OwnArrays& layout, const std::byte* block, Past past);

 private:
  OwnArrays arrays_;
  std::size_t rows_;
  std::vector<double> blocks_;
  std::vector<Past> past_;  // empty until there is room for what is kept
  std::size_t state_size_ = 0;

  Past* past(std::int64_t row) { return past_.empty() ? nullptr : &past_[static_cast<std::size_t>(row)]; }
  Past& make_past(std::int64_t row);
  void translate(const OwnArrays& layout, const std::byte* block, std::byte* to) const;
};

}  // namespace mjenv::core
