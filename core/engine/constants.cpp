#include "engine/constants.hpp"

#include <cstring>
#include <new>
#include <type_traits>

#include "engine/errors.hpp"
#include "engine/mujoco.hpp"
#include "error.hpp"

namespace mjenv::core {

void Constants::Delete::operator()(mjModel_* model) const { mj_deleteModel(model); }

Constants::Constants(const Model& model) : model_(model) {
  const ErrorTrap trap(ErrorTrap::Memory::is_checked);
  copy_.reset(mj_copyModel(nullptr, model.get()));
  if (!copy_) throw std::bad_alloc();
}

Constants::~Constants() = default;

std::byte* Constants::values_of(const OwnArray& array) const {
  auto* member = reinterpret_cast<std::byte*>(copy_.get()) + array.member;
  if (array.place == OwnArray::Place::model_number) return member;
  std::byte* values;
  std::memcpy(&values, member, sizeof values);
  return values;
}

void Constants::compute(const OwnArrays& arrays, const std::byte* block, mjData_* data) {
  const ErrorTrap trap;
  mj_copyModel(copy_.get(), model_.get());
  for (const OwnArray& array : arrays.list())
    if (block && array.place != OwnArray::Place::data_input)
      std::memcpy(values_of(array), block + array.offset, array.bytes);
  mj_setConst(copy_.get(), data);
}

// Fails if mj_setConst has changed an array of which rows cannot have their own values.
void Constants::check_shared() const {
  std::vector<const void*> originals;
  for_each_array(*model_.get(), [&](const char*, const auto* data, auto...) { originals.push_back(data); });
  std::size_t i = 0;
  for_each_array(*copy_, [&](const char* name, const auto* data, std::int64_t rows, std::int64_t columns, bool) {
    const void* original = originals[i++];
    const auto size = static_cast<std::size_t>(rows * columns) * sizeof *data;
    const bool is_real = std::is_floating_point_v<std::decay_t<decltype(*data)>>;
    if (is_real || size == 0 || std::memcmp(data, original, size) == 0) return;
    fail(MJENV_E_MODEL, "mj_setConst changes " + std::string(name) + ", which all rows share: change the model file");
  });
}

std::vector<std::string> Constants::new_arrays(const OwnArrays& arrays) const {
  check_shared();
  std::vector<std::string> names;
  OwnArrays all(model_);
  for (const Array& array : model_.arrays()) {
    if (!is_writable(array) || arrays.find(array.name) || array.count() == 0) continue;
    all.add(array.name);
    const OwnArray& candidate = *all.find(array.name);
    if (std::memcmp(values_of(candidate), array.data, candidate.bytes) != 0) names.push_back(array.name);
  }
  return names;
}

void Constants::save(const OwnArrays& arrays, std::byte* block) const {
  for (const OwnArray& array : arrays.list())
    if (array.place != OwnArray::Place::data_input) std::memcpy(block + array.offset, values_of(array), array.bytes);
}

}  // namespace mjenv::core
