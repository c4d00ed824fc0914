// A view of a model in which some arrays are replaced by a row's own.
#pragma once

#include <cstddef>
#include <memory>

#include "engine/own_arrays.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core {

// Three views, as Model has them: of the whole model, of the one with which mj_step is faster, and of that one without
// sensors. They share the model's arrays, except for those in the row's block.
class ModelView {
 public:
  explicit ModelView(const Model& model);
  ~ModelView();

  // Makes all views use the arrays in the block, which must live as long as the views use it.
  void use(const OwnArrays& arrays, const std::byte* block);
  const mjModel_& whole() const { return *whole_; }
  const mjModel_& stepped() {
    if (must_mix_) mix();
    return unmixed();
  }
  const mjModel_& sensorless() {
    if (must_mix_) mix();
    return searches_ ? *whole_ : *sensorless_;
  }
  // The view of `stepped`, for code that does not read the parameters of its list of pairs: they may be those of
  // another row.
  const mjModel_& unmixed() const { return searches_ ? *whole_ : *stepped_; }
  // Whether the row's arrays may change which pairs MuJoCo finds, so that no list of them is valid.
  bool searches() const { return searches_; }

 private:
  const Model& model_;
  std::unique_ptr<mjModel_> whole_, stepped_, sensorless_;
  std::vector<std::byte> whole_array_;  // of the array of which rows own a part (OwnArray::shared)
  Pairs mixed_;                         // the model's list of pairs, with parameters that depend on the row's arrays
  bool searches_ = false;
  bool must_mix_ = false;  // the parameters in mixed_ are not yet those of the row

  void mix();
};

}  // namespace mjenv::core
