// An array whose values can differ from row to row, and the rules for these values. It is an array or option of
// mjModel, or an input of mjData that is no part of a row's state.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/model.hpp"

namespace mjenv::core {

struct OwnArray {
  enum class Place { model_array, model_number, data_input };
  // What own values of the array can change in collisions: nothing; the parameters of contacts; or which pairs MuJoCo
  // finds and how.
  enum class Collisions { same, other_contacts, other_pairs };

  Array original;  // its data are the model's values; null for an input of mjData
  Place place;
  Collisions collisions;
  std::size_t member;  // the offset of the array's pointer, or of the number, in mjModel or mjData
  std::size_t bytes;
  std::size_t shared;  // the bytes of the model's array behind those that rows own, which all rows share
  std::size_t offset;  // of the array in a row's block (OwnArrays)
  std::optional<std::pair<double, double>> bounds;  // the least and the greatest value, if it holds integers
  int fixed;                                        // flags that keep the model's values
  std::vector<bool> signs;                          // the elements that keep the sign of the model's; empty: none
  // Of an input of mjData: the model's array that mj_resetData copies to it. Null: mj_resetData sets zeros, or the
  // bodies' poses for mocap_pos and mocap_quat (OwnArrays::clear_inputs).
  const void* cleared;

  // The array of this name. Fails with MJENV_E_NAME and the reason if rows cannot have their own.
  static OwnArray of(const Model& model, const std::string& name);
  // The same, but fails also if only mj_setConst writes the array.
  static OwnArray written(const Model& model, const std::string& name);

  // These fail with MJENV_E_VALUE if MuJoCo could not compute with the values, or with the array's values in a row's
  // block.
  void check(const double* values) const;
  void check(const std::byte* block) const;
  // Whether the model's own values break the rules of `check`, which accepts them nevertheless.
  bool refuses_originals() const;
  // Whether `check` judges each element without the others.
  bool checks_elements_alone() const;

  // Copies the values in a row's block, and those that all rows share behind them, to `whole`. Returns `whole`.
  std::byte* complete(const std::byte* block, std::byte* whole) const;
  // The values in a row's block as doubles.
  void read(const std::byte* block, double* values) const;
  void write(const double* values, std::byte* block) const;
  void write(std::size_t element, double value, std::byte* block) const;
};

// Whether rows can have their own values of this array of mjModel.
bool can_be_own(const Model& model, const Array& of_model);
// Whether only mj_setConst writes it.
bool is_computed(const std::string& name);
// The arrays of mjModel that can be written.
std::vector<std::string> writable_names(const Model& model);

}  // namespace mjenv::core
