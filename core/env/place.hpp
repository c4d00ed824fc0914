// Where a call writes the outputs of one row.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "mjenv/mjenv.h"
#include "task/task.hpp"

namespace mjenv::core {

// Element `index` of the batch's arrays of `rows` elements: one for each row, in a rollout one for each step of each
// row. Functions that write skip null arrays. A call without outputs has a batch of null arrays.
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
  // Call this before a step: if it fails, the reward and flags must not be an earlier step's. The rest is undefined.
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
  // Writes this element of an array that has a block for each field (mjenv_batch). values: field after field.
  void put(const std::vector<Field>& fields, const double* values, double* array) const {
    if (!array) return;
    for (const auto& f : fields)
      if (f.count == 1)
        array[start(f)] = values[f.offset];
      else
        std::copy_n(values + f.offset, f.count, array + start(f));
  }
  // Sets this element to 0 in such an array.
  void clear(const std::vector<Field>& fields, double* array) const {
    if (!array) return;
    for (const auto& f : fields) std::fill_n(array + start(f), f.count, 0.0);
  }
  // Copies this element from one such array to another.
  void copy(const std::vector<Field>& fields, const double* from, double* to) const {
    if (!from || !to) return;
    for (const auto& f : fields) std::copy_n(from + start(f), f.count, to + start(f));
  }
  // Where this element's numbers of the field begin in such an array.
  std::int64_t start(const Field& f) const { return f.offset * rows + index * f.count; }
};

}  // namespace mjenv::core
