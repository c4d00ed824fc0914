// Calls mj_setConst, which computes the numbers of a model that depend on its other numbers.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "engine/own_arrays.hpp"

namespace mjenv::core {

// The arrays that mj_setConst computes and that rows can have of their own, where the model and MuJoCo have them.
std::vector<std::string> constant_arrays(const Model& model);

// Calls mj_setConst for one row after the other. It changes the model, so it gets a view with copies of all arrays that
// it may write. The view shares those with meshes, textures and heights, which are large.
class Constants {
 public:
  explicit Constants(const Model& model);
  ~Constants();

  // Computes the constants of the model with a row's own arrays; block null: of the model as it was compiled. As in
  // MuJoCo, data ends in the position qpos_spring, for which mj_setConst computes last.
  void compute(const OwnArrays& arrays, const std::byte* block, mjData_* data);
  // The same in an mjData of this object's own, as if it were new.
  void compute(const OwnArrays& arrays, const std::byte* block);
  // Allocates that mjData.
  void make_data();
  // The arrays that mj_setConst changed and that rows still share. Fails with MJENV_E_MODEL if rows must share one.
  std::vector<std::string> new_arrays(const OwnArrays& arrays) const;
  // Writes the constants to the row's own arrays.
  void save(const OwnArrays& arrays, std::byte* block) const;

 private:
  // A copied array, or an option or statistic of the view.
  struct Part {
    enum class Kind { own, shared, unchecked };
    std::string name;
    Kind kind;  // whether rows can have their own values; if not, whether it is an error that mj_setConst changes it
    std::byte* values;
    const void* original;
    std::size_t bytes;
  };
  std::unique_ptr<mjModel_> blank_, view_;  // blank_: what the view is before the arrays are copied
  std::vector<double> copies_;
  std::vector<Part> parts_;
  std::unique_ptr<mjData_, DeleteData> data_;

  void fill(const OwnArrays& arrays, const std::byte* block);
  std::byte* values_of(const OwnArray& array) const;
  bool is_copied(const OwnArray& array) const;
};

}  // namespace mjenv::core
