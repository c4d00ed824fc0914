// An array of which rows can have their own values, and which values it takes: an array or option of mjModel, or an
// input of mjData that is no part of a row's state.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "engine/model.hpp"

namespace mjenv::core {

struct OwnArray {
  enum class Place { model_array, model_number, data_input };
  // What own values can change of collisions: nothing, the parameters of contacts, or which pairs are found, and how.
  enum class Collisions { same, other_contacts, other_pairs };

  Array original;  // data: the model's values; null for an input of mjData
  Place place;
  Collisions collisions;
  std::size_t member;  // the offset of the array's pointer, or of the number, in mjModel or mjData
  std::size_t bytes;
  std::size_t offset;   // in a row's block (OwnArrays)
  const void* cleared;  // of an input of mjData: the array of the model that mj_resetData copies; null: none

  // The array of this name. Fails with MJENV_E_NAME and the reason if it cannot be written.
  static OwnArray of(const Model& model, const std::string& name);

  // Fail with MJENV_E_VALUE if MuJoCo could not compute with these values, or with those in a block.
  void check(const double* values) const;
  void check(const std::byte* block) const;
  // Whether `check` would refuse the model's own values if it did not accept them as originals.
  bool refuses_originals() const;
  // Whether `check` looks at each element alone.
  bool checks_elements_alone() const;

  void write(const double* values, std::byte* block) const;
  void write(std::size_t element, double value, std::byte* block) const;
};

// Whether rows can have their own values of this array of mjModel.
bool is_writable(const Model& model, const Array& of_model);
std::vector<std::string> writable_names(const Model& model);

}  // namespace mjenv::core
