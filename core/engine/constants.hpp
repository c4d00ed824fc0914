// Calls mj_setConst, which computes those numbers of a model that follow from its other numbers.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "engine/own_arrays.hpp"

namespace mjenv::core {

// The arrays that mj_setConst may change in rows that have their own values of the arrays `changed`. It changes those
// that decide which pairs of geoms MuJoCo finds only if one of `changed` does so, too.
std::vector<std::string> constant_arrays(const Model& model, const std::vector<std::string>& changed);

// Calls mj_setConst for one row after the other. mj_setConst changes its model, so it gets a view with copies of all
// arrays that it may write. Arrays of meshes, skins, textures and height fields are large and not written, so
// they are shared.
class Constants {
 public:
  explicit Constants(const Model& model);
  ~Constants();

  // Computes the constants of the model with a row's own arrays, or, if block is null, of the compiled model.
  // Afterwards `data` is in the position qpos_spring, because mj_setConst computes for it last.
  void compute(const OwnArrays& arrays, const std::byte* block, mjData_* data);
  // Computes them in this object's own mjData. The result is the same as with a new mjData.
  void compute(const OwnArrays& arrays, const std::byte* block);
  // Allocates this object's mjData.
  void make_data();
  // The arrays that mj_setConst has changed and for which rows do not have their own values yet. Fails with
  // MJENV_E_MODEL if it has changed one for which they cannot.
  std::vector<std::string> new_arrays(const OwnArrays& arrays) const;
  // Writes the constants to the row's own arrays.
  void save(const OwnArrays& arrays, std::byte* block) const;

 private:
  // An array that the view has a copy of, or one of the view's options or statistics.
  struct Part {
    std::string name;
    bool can_be_own;
    std::byte* values;
    const void* original;
    std::size_t bytes;
  };
  std::unique_ptr<mjModel_> blank_, view_;  // blank_: the view before a row's arrays are copied into it
  std::vector<double> copies_;
  std::vector<Part> parts_;
  std::unique_ptr<mjData_, DeleteData> data_;

  void fill(const OwnArrays& arrays, const std::byte* block);
  std::byte* values_of(const OwnArray& array) const;
  bool is_copied(const OwnArray& array) const;
};

}  // namespace mjenv::core
