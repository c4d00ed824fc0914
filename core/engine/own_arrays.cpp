#include "engine/own_arrays.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "engine/mujoco.hpp"

namespace mjenv::core {

const OwnArray* OwnArrays::find(const std::string& name) const {
  const auto found =
      std::find_if(list_.begin(), list_.end(), [&](const OwnArray& a) { return a.original.name == name; });
  return found == list_.end() ? nullptr : &*found;
}

void OwnArrays::add(const std::string& name) {
  if (find(name)) return;
  OwnArray array = OwnArray::of(*model_, name);
  if (array.bytes == 0) return;
  append(std::move(array));
  // mj_resetData computes mocap_pos and mocap_quat from body_pos and body_quat.
  if (model_->get()->nmocap > 0 && (name == "body_pos" || name == "body_quat")) {
    add("mocap_pos");
    if (!kNormalizesMocap) add("mocap_quat");
  }
  if (name == "eq_active0") add("eq_active");  // mj_resetData copies eq_active0 to eq_active
}

void OwnArrays::append(OwnArray array) {
  array.offset = block_bytes_;
  block_bytes_ += (array.bytes + sizeof(double) - 1) / sizeof(double) * sizeof(double);
  has_inputs_ |= array.place == OwnArray::Place::data_input;
  list_.push_back(std::move(array));
}

void OwnArrays::fill(std::size_t first, std::byte* block) const {
  for (std::size_t i = first; i < list_.size(); ++i)
    if (list_[i].original.data) std::memcpy(block + list_[i].offset, list_[i].original.data, list_[i].bytes);
  clear_inputs(block, first);
}

void OwnArrays::copy(const OwnArrays& from, const std::byte* block, std::byte* to) const {
  fill(0, to);
  for (const OwnArray& array : list_)
    if (const OwnArray* found = from.find(array.original.name))
      std::memcpy(to + array.offset, block + found->offset, array.bytes);
}

void OwnArrays::clear_inputs(std::byte* block, std::size_t first) const {
  const mjModel& m = *model_->get();
  const auto values_of = [&](const char* name, const double* original) {
    const OwnArray* own = find(name);
    return own ? reinterpret_cast<const double*>(block + own->offset) : original;
  };
  for (std::size_t i = first; i < list_.size(); ++i) {
    const OwnArray& array = list_[i];
    if (array.place != OwnArray::Place::data_input) continue;
    if (array.cleared) {  // eq_active
      const OwnArray* own = find(array.original.name + "0");
      std::memcpy(block + array.offset, own ? block + own->offset : array.cleared, array.bytes);
      continue;
    }
    std::memset(block + array.offset, 0, array.bytes);
    const bool is_quat = array.original.name == "mocap_quat";
    if (!is_quat && array.original.name != "mocap_pos") continue;
    const double* of_bodies = is_quat ? values_of("body_quat", m.body_quat) : values_of("body_pos", m.body_pos);
    const std::size_t columns = is_quat ? 4 : 3;
    auto* to = reinterpret_cast<double*>(block + array.offset);
    for (int body = 0; body < m.nbody; ++body) {
      if (m.body_mocapid[body] < 0) continue;
      std::copy_n(of_bodies + columns * static_cast<std::size_t>(body), columns,
                  to + columns * static_cast<std::size_t>(m.body_mocapid[body]));
    }
  }
}

}  // namespace mjenv::core
