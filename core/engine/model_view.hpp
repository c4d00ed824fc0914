// A view of a model in which some arrays are replaced by a row's own.
#pragma once

#include <cstddef>
#include <memory>

#include "engine/own_arrays.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core {

// Two views, as Model has them: of the whole model, and of the one with which mj_step is faster. Both share the model's
// arrays, except for those in the row's block.
class ModelView {
 public:
  explicit ModelView(const Model& model);
  ~ModelView();

  // Makes both views use the arrays in the block, which must live as long as the views use it.
  void use(const OwnArrays& arrays, const std::byte* block);
  const mjModel_& whole() const { return *whole_; }
  const mjModel_& stepped() const { return searches_ ? *whole_ : *stepped_; }

 private:
  const Model& model_;
  std::unique_ptr<mjModel_> whole_, stepped_;
  Pairs mixed_;
  bool searches_ = false;
};

}  // namespace mjenv::core
