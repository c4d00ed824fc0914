// A model in which some arrays are a row's own.
#pragma once

#include <cstddef>
#include <memory>

#include "engine/own_arrays.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core {

// Two views as Model has them: the whole model, and one that mj_step computes faster. Both share the model's arrays,
// except for those in the row's block.
class ModelView {
 public:
  explicit ModelView(const Model& model);
  ~ModelView();

  // Makes both views use the arrays in the block, which must outlive their use.
  void use(const OwnArrays& arrays, std::byte* block);
  const mjModel_& whole() const { return *whole_; }
  const mjModel_& stepped() const { return searches_ ? *whole_ : *stepped_; }

 private:
  const Model& model_;
  std::unique_ptr<mjModel_> whole_, stepped_;
  Pairs mixed_;
  bool searches_ = false;
};

}  // namespace mjenv::core
