#include "engine/constants.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <new>

#include "engine/errors.hpp"
#include "engine/mujoco.hpp"
#include "error.hpp"
#include "names.hpp"

namespace mjenv::core {
namespace {

// Whether the array belongs to a mesh, skin, texture, height field or bounding volumes. mj_setConst writes none of
// these, and copies would be large: a skybox of 800 x 800 pixels takes 11.5 MB.
bool is_asset(const std::string& name) {
  static constexpr std::array beginnings{"mesh_", "skin_", "tex_", "hfield_data", "oct_", "bvh_child", "bvh_nodeid"};
  return begins_with(beginnings, name);
}

}  // namespace

std::vector<std::string> constant_arrays(const Model& model, const std::vector<std::string>& changed) {
  const auto decides_pairs = [&](const std::string& name) {
    return OwnArray::of(model, name).collisions == OwnArray::Collisions::other_pairs;
  };
  const bool changes_pairs = std::any_of(changed.begin(), changed.end(), decides_pairs);
  std::vector<std::string> found;
  for (const Array& array : model.arrays())
    if (is_in(kConstants, array.name) && can_be_own(model, array) && (changes_pairs || !decides_pairs(array.name)))
      found.push_back(array.name);
  return found;
}

Constants::Constants(const Model& model)
    : blank_(std::make_unique<mjModel>(*model.get())), view_(std::make_unique<mjModel>()) {
  std::vector<std::size_t> members;
  std::size_t count = 0;  // of doubles
  for_each_array(*blank_, [&](const char* name, const auto& data, std::int64_t rows, std::int64_t columns, bool) {
    const auto bytes = static_cast<std::size_t>(rows * columns) * sizeof *data;
    if (bytes == 0 || is_asset(name)) return;
    const Array* array = find(model.arrays(), name);
    parts_.push_back({name, array && can_be_own(model, *array), nullptr, data, bytes});
    members.push_back(static_cast<std::size_t>(reinterpret_cast<const std::byte*>(&data) -
                                               reinterpret_cast<const std::byte*>(blank_.get())));
    count += (bytes + sizeof(double) - 1) / sizeof(double);
  });
  copies_.resize(count);
  auto* values = reinterpret_cast<std::byte*>(copies_.data());
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    parts_[i].values = values;
    std::memcpy(reinterpret_cast<std::byte*>(blank_.get()) + members[i], &values, sizeof values);
    values += (parts_[i].bytes + sizeof(double) - 1) / sizeof(double) * sizeof(double);
  }
  const OwnArrays arrays(model);
  for (const Array& array : model.arrays()) {
    if (!can_be_own(model, array)) continue;
    const OwnArray number = OwnArray::of(model, array.name);
    if (number.place == OwnArray::Place::model_number)
      parts_.push_back({array.name, true, values_of(number), array.data, number.bytes});
  }
  fill(arrays, nullptr);
}

void Constants::make_data() {
  if (data_) return;
  const ErrorTrap trap(ErrorTrap::Memory::is_checked);
  data_.reset(mj_makeData(view_.get()));
  if (!data_) throw std::bad_alloc();
}

Constants::~Constants() = default;

std::byte* Constants::values_of(const OwnArray& array) const {
  auto* member = reinterpret_cast<std::byte*>(view_.get()) + array.member;
  if (array.place == OwnArray::Place::model_number) return member;
  std::byte* values;
  std::memcpy(&values, member, sizeof values);
  return values;
}

bool Constants::is_copied(const OwnArray& array) const {
  return array.place != OwnArray::Place::data_input && values_of(array) != array.original.data;
}

void Constants::fill(const OwnArrays& arrays, const std::byte* block) {
  *view_ = *blank_;
  for (const Part& part : parts_) std::memcpy(part.values, part.original, part.bytes);
  if (!block) return;
  for (const OwnArray& array : arrays.list())
    if (is_copied(array)) std::memcpy(values_of(array), block + array.offset, array.bytes);
}

void Constants::compute(const OwnArrays& arrays, const std::byte* block, mjData_* data) {
  const ErrorTrap trap;
  fill(arrays, block);
  mj_setConst(view_.get(), data);
}

void Constants::compute(const OwnArrays& arrays, const std::byte* block) {
  const ErrorTrap trap;
  fill(arrays, block);
  reset_for_constants(*view_, *data_);
  mj_setConst(view_.get(), data_.get());
}

std::vector<std::string> Constants::new_arrays(const OwnArrays& arrays) const {
  std::vector<std::string> names;
  for (const Part& part : parts_) {
    if (std::memcmp(part.values, part.original, part.bytes) == 0) continue;
    if (!part.can_be_own)
      fail(MJENV_E_MODEL, "mj_setConst changes " + part.name + ", which all rows share: change the model file");
    if (!arrays.find(part.name)) names.push_back(part.name);
  }
  return names;
}

void Constants::save(const OwnArrays& arrays, std::byte* block) const {
  for (const OwnArray& array : arrays.list())
    if (is_copied(array)) std::memcpy(block + array.offset, values_of(array), array.bytes);
}

}  // namespace mjenv::core
