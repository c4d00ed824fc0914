// The arrays whose values differ from row to row in an environment. An array is added when it is first written.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "engine/own_array.hpp"

namespace mjenv::core {

// Lays out the block of memory that holds the values of one row. Arrays are appended and never removed.
class OwnArrays {
 public:
  explicit OwnArrays(const Model& model) : model_(&model) {}

  const std::vector<OwnArray>& list() const { return list_; }
  bool empty() const { return list_.empty(); }
  // An empty layout for the same model.
  OwnArrays empty_layout() const { return OwnArrays(*model_); }
  std::size_t block_bytes() const { return block_bytes_; }
  bool has_inputs() const { return has_inputs_; }  // of mjData
  const OwnArray* find(const std::string& name) const;
  // Appends the array, and the inputs that mj_resetData computes from it, unless they are already there.
  void add(const std::string& name);
  // Appends the array alone.
  void append(OwnArray array);

  // Writes the original values of the arrays with index `first` and above to the block.
  void fill(std::size_t first, std::byte* block) const;
  // Copies a block with the layout `from` to a block with this layout. Arrays that `from` lacks get their original
  // values.
  void copy(const OwnArrays& from, const std::byte* block, std::byte* to) const;
  // Sets the inputs of mjData among the arrays with index `first` and above to the values that mj_resetData gives them.
  void clear_inputs(std::byte* block, std::size_t first = 0) const;

 private:
  const Model* model_;
  std::vector<OwnArray> list_;
  std::size_t block_bytes_ = 0;
  bool has_inputs_ = false;
};

}  // namespace mjenv::core
