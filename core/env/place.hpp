// Where a call writes the outputs of one row.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "mjenv/mjenv.h"
#include "task/task.hpp"

namespace mjenv::core {

// One element of a batch's arrays, which have `rows` elements: one for each row, or in a rollout one for each step of
// each row. The functions that write do nothing for a null array. A call without outputs has a batch of null arrays.
struct Place {
  const mjenv_batch& out;
  std::int64_t rows, index;

  template <typename T>
  void put(T* array, T value) const {
    if (array) array[index] = value;
  }
  // array must not be null.
  template <typename T>
  T get(const T* array) const {
    return array[index];
  }
  void put_status(mjenv_status status) const { put<std::int32_t>(out.status, status); }
  void put_result(double reward, bool terminated, bool truncated) const {
    put<double>(out.reward, reward);
    put<std::uint8_t>(out.terminated, terminated);
    put<std::uint8_t>(out.truncated, truncated);
  }
  // Call this before a step, and if the step fails after it has written its result. The reward and flags of a row that
  // fails are then 0. Its other outputs except the status are undefined.
  void forget() const {
    put_result(0, false, false);
    put<std::uint8_t>(out.was_reset, 0);
  }
  // Writes an observation of `count` numbers in the batch's dtype.
  void put_observation(const double* from, std::int64_t count, void* array) const {
    if (!array) return;
    if (out.obs_dtype == MJENV_DTYPE_FLOAT32)
      std::transform(from, from + count, static_cast<float*>(array) + index * count,
                     [](double x) { return static_cast<float>(x); });
    else
      std::copy_n(from, count, static_cast<double*>(array) + index * count);
  }
  // Writes this element of an array that has a block for each field (mjenv_batch). values: the numbers of all fields,
  // one after the other.
  void put(const std::vector<Field>& fields, const double* values, double* array) const {
    if (!array) return;
    for (const auto& f : fields)
      if (f.count == 1)
        array[start(f)] = values[f.offset];
      else
        std::copy_n(values + f.offset, f.count, array + start(f));
  }
  // Sets this element of an array of blocks to 0.
  void clear(const std::vector<Field>& fields, double* array) const {
    if (!array) return;
    for (const auto& f : fields) std::fill_n(array + start(f), f.count, 0.0);
  }
  // Copies this element from one array of blocks to another.
  void copy(const std::vector<Field>& fields, const double* from, double* to) const {
    if (!from || !to) return;
    for (const auto& f : fields) std::copy_n(from + start(f), f.count, to + start(f));
  }
  // Where the numbers of this element and field begin in an array of blocks.
  std::int64_t start(const Field& f) const { return f.offset * rows + index * f.count; }
};

}  // namespace mjenv::core
