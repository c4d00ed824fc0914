// The arrays of which each row of an environment has its own values, because they were written: arrays and options of
// mjModel, and inputs of mjData that are no part of a row's state.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "engine/model.hpp"

namespace mjenv::core {

struct OwnArray {
  enum class Place { model_array, model_number, data_input };

  Array original;  // data: the model's values; null for an input of mjData
  Place place;
  std::size_t member;  // the offset of the array's pointer, or of the number, in mjModel or mjData
  std::size_t bytes;
  std::size_t offset;   // in a row's block
  const void* cleared;  // of an input of mjData: the array of the model that mj_resetData copies; null: none
};

// Lays out the block of memory that holds the values of one row. Arrays are appended and never removed.
class OwnArrays {
 public:
  explicit OwnArrays(const Model& model) : model_(&model) {}

  const std::vector<OwnArray>& list() const { return list_; }
  bool empty() const { return list_.empty(); }
  // An empty layout for the same model.
  OwnArrays none() const { return OwnArrays(*model_); }
  std::size_t block_bytes() const { return block_bytes_; }
  const OwnArray* find(const std::string& name) const;
  // Fails with MJENV_E_NAME and the reason if the array cannot be written.
  OwnArray describe(const std::string& name) const;
  // Appends the array, and the inputs that mj_resetData computes from it, unless they are there.
  void add(const std::string& name);
  // Appends the array alone.
  void append(OwnArray array);

  // Fails with MJENV_E_VALUE if MuJoCo could not compute with these values.
  static void check(const OwnArray& array, const double* values);
  // The same for the values in a block.
  static void check(const OwnArray& array, const std::byte* block);
  static void write(const OwnArray& array, const double* values, std::byte* block);
  // The same for one element of an array, and for reading all of them.
  static void write(const OwnArray& array, std::size_t element, double value, std::byte* block);
  static void read(const OwnArray& array, const std::byte* block, double* values);
  // Whether `check` would refuse the model's own values if they were another's.
  static bool refuses_originals(const OwnArray& array);
  // Whether `check` looks at each element alone.
  static bool checks_elements_alone(const OwnArray& array);
  // Writes the original values of the arrays from number `first` on to the block.
  void fill(std::size_t first, std::byte* block) const;
  // Copies a block that is laid out by `from` to one that is laid out by this. Arrays that `from` lacks get their
  // original values.
  void copy(const OwnArrays& from, const std::byte* block, std::byte* to) const;
  // Gives the inputs of mjData, from array number `first` on, the values that mj_resetData gives them.
  void clear_inputs(std::byte* block, std::size_t first = 0) const;

  // Whether lanes can compute with them, where has_forces is false; and those with which they cannot.
  bool fit_lanes() const { return fit_lanes_; }
  std::vector<std::string> beyond_lanes() const;
  // Whether the block has a number that is not 0 in an input of mjData that lanes take for 0, such as xfrc_applied.
  bool has_forces(const std::byte* block) const;
  bool has_inputs() const { return has_inputs_; }
  // Whether they may change which geom pairs can touch, or how precisely MuJoCo searches for them.
  bool change_search() const { return change_search_; }
  // Whether they may change the parameters of contacts.
  bool change_contacts() const { return change_contacts_; }

 private:
  const Model* model_;
  std::vector<OwnArray> list_;
  std::size_t block_bytes_ = 0;
  bool has_inputs_ = false, change_search_ = false, change_contacts_ = false, fit_lanes_ = true;
};

// Whether rows can have their own values of this array of mjModel.
bool is_writable(const Array& of_model);
std::vector<std::string> writable_names(const Model& model);

}  // namespace mjenv::core
