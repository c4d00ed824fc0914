// What a worker needs to compute with rows' own arrays.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "engine/own_arrays.hpp"
#include "env/holder.hpp"
#include "task/sim_view.hpp"

namespace mjenv::core {

// `prepare` allocates it, because resets and steps allocate nothing.
struct Scratch {
  // A row's own array that the task writes (mjenv_build_own), as doubles.
  struct TaskArray {
    const OwnArray* array;
    bool is_force;                       // of mjData; the others are arrays of mjModel
    std::vector<double> values, before;  // before: the values with which the last mj_step has computed
  };
  std::vector<TaskArray> task_arrays;
  // Their values, by the index that mjenv_build_own has returned. A reset writes no forces, before_step nothing else.
  std::vector<double*> of_step, of_control, of_reset;
  std::vector<std::byte> block;  // own values with which a reset computes
  std::vector<std::byte> drawn;  // own values that a reset has drawn; empty if it has drawn none

  // Call this when the layout of the rows' arrays has changed. If `prepare` is not called afterwards, or throws, the
  // next reset or step calls it.
  void forget_layout() { is_prepared_ = false; }
  void ensure(Holder& holder) {
    if (!is_prepared_) prepare(holder);
  }
  void prepare(Holder& holder) {
    holder.release();
    is_prepared_ = false;
    const OwnArrays& arrays = holder.rows().arrays();
    const std::vector<std::string>& names = holder.task().needs.own;
    drawn.reserve(arrays.block_bytes());
    block.resize(arrays.block_bytes());
    std::vector<TaskArray> found;  // so that the arrays of the last call stay if memory runs out
    found.reserve(names.size());
    for (std::vector<double*>* each : {&of_step, &of_control, &of_reset}) each->assign(names.size(), nullptr);
    for (std::size_t i = 0; i < names.size(); ++i) {
      const OwnArray* array = arrays.find(names[i]);
      if (!array) continue;  // not yet added to the rows' arrays
      const std::vector<double> zeros(array->original.count());
      found.push_back({array, is_applied_force(names[i]), zeros, zeros});
      of_step[i] = found.back().values.data();
      (found.back().is_force ? of_control : of_reset)[i] = of_step[i];
    }
    task_arrays = std::move(found);
    arrays.fill(0, block.data());
    holder.use(block.data());
    is_prepared_ = true;
  }

 private:
  bool is_prepared_ = true;
};

}  // namespace mjenv::core
