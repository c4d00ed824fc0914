#include "engine/model_view.hpp"

#include <algorithm>
#include <cstring>

#include "engine/mujoco.hpp"

namespace mjenv::core {

ModelView::ModelView(const Model& model)
    : model_(model),
      whole_(std::make_unique<mjModel>(*model.get())),
      stepped_(std::make_unique<mjModel>(*model.stepped())),
      sensorless_(std::make_unique<mjModel>(*model.sensorless())) {}

ModelView::~ModelView() = default;

void ModelView::use(const OwnArrays& arrays, const std::byte* block) {
  using Collisions = OwnArray::Collisions;
  Collisions collisions = Collisions::same;
  for (const OwnArray& array : arrays.list()) {
    collisions = std::max(collisions, array.collisions);
    if (array.place == OwnArray::Place::data_input) continue;
    const std::byte* values = block + array.offset;
    if (array.shared > 0) {
      whole_array_.resize(array.bytes + array.shared);
      values = array.complete(block, whole_array_.data());
    }
    for (mjModel* view : {whole_.get(), stepped_.get(), sensorless_.get()}) {
      std::byte* member = reinterpret_cast<std::byte*>(view) + array.member;
      if (array.place == OwnArray::Place::model_number)
        std::memcpy(member, values, array.bytes);
      else
        std::memcpy(member, &values, sizeof values);
    }
  }
  searches_ = collisions == Collisions::other_pairs || !are_searched_alike(*whole_, *model_.get());
  must_mix_ = collisions == Collisions::other_contacts && model_.pairs();
  if (must_mix_ && mixed_.dim.empty()) mix();  // so that later calls allocate no memory
}

void ModelView::mix() {
  mix_again(*model_.pairs(), *whole_, mixed_);
  set_pairs(*stepped_, mixed_);
  set_pairs(*sensorless_, mixed_);
  must_mix_ = false;
}

}  // namespace mjenv::core
