#include "engine/constants.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <type_traits>

#include "engine/errors.hpp"
#include "engine/mujoco.hpp"
#include "error.hpp"

namespace mjenv::core {

std::vector<std::string> constant_arrays(const Model& model) {
  static constexpr std::array names{
      "body_subtreemass",   "body_invweight0",  "dof_invweight0", "dof_M0",           "tendon_length0",
      "tendon_invweight0",  "actuator_length0", "actuator_acc0",  "eq_data",          "cam_pos0",
      "cam_poscom0",        "cam_mat0",         "light_pos0",     "light_poscom0",    "light_dir0",
      "stat.extent",        "stat.meansize",    "stat.meanmass",  "stat.meaninertia", "stat.center",
      "tendon_lengthspring"};
  std::vector<std::string> found;
  const auto is_in = [](const auto& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  for (const Array& array : model.arrays())
    if ((is_in(names, array.name) || is_in(kSameframes, array.name)) && is_writable(array)) found.push_back(array.name);
  return found;
}

void Constants::Delete::operator()(mjModel_* model) const { mj_deleteModel(model); }
void Constants::Delete::operator()(mjData_* data) const { mj_deleteData(data); }

Constants::Constants(const Model& model) : model_(model), writable_(model) {
  const ErrorTrap trap(ErrorTrap::Memory::is_checked);
  copy_.reset(mj_copyModel(nullptr, model.get()));
  if (!copy_) throw std::bad_alloc();
  for (const Array& array : model.arrays())
    if (is_writable(array)) writable_.add(array.name);
}

void Constants::make_data() {
  if (data_) return;
  const ErrorTrap trap(ErrorTrap::Memory::is_checked);
  data_.reset(mj_makeData(copy_.get()));
  if (!data_) throw std::bad_alloc();
}

Constants::~Constants() = default;

std::byte* Constants::values_of(const OwnArray& array) const {
  auto* member = reinterpret_cast<std::byte*>(copy_.get()) + array.member;
  if (array.place == OwnArray::Place::model_number) return member;
  std::byte* values;
  std::memcpy(&values, member, sizeof values);
  return values;
}

void Constants::fill(const OwnArrays& arrays, const std::byte* block) {
  mj_copyModel(copy_.get(), model_.get());
  for (const OwnArray& array : arrays.list())
    if (block && array.place != OwnArray::Place::data_input)
      std::memcpy(values_of(array), block + array.offset, array.bytes);
}

void Constants::compute(const OwnArrays& arrays, const std::byte* block, mjData_* data) {
  const ErrorTrap trap;
  fill(arrays, block);
  mj_setConst(copy_.get(), data);
}

void Constants::compute(const OwnArrays& arrays, const std::byte* block) {
  const ErrorTrap trap;
  fill(arrays, block);
  mj_resetData(copy_.get(), data_.get());
  mj_setConst(copy_.get(), data_.get());
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
    if (is_real || size == 0 || std::memcmp(data, original, size) == 0 || writable_.find(name)) return;
    fail(MJENV_E_MODEL, "mj_setConst changes " + std::string(name) + ", which all rows share: change the model file");
  });
}

std::vector<std::string> Constants::new_arrays(const OwnArrays& arrays) const {
  check_shared();
  std::vector<std::string> names;
  for (const OwnArray& array : writable_.list()) {
    if (array.place == OwnArray::Place::data_input) continue;
    const bool same = std::memcmp(values_of(array), array.original.data, array.bytes) == 0;
    if (!same && !arrays.find(array.original.name)) names.push_back(array.original.name);
  }
  return names;
}

void Constants::save(const OwnArrays& arrays, std::byte* block) const {
  for (const OwnArray& array : arrays.list())
    if (array.place != OwnArray::Place::data_input) std::memcpy(block + array.offset, values_of(array), array.bytes);
}

}  // namespace mjenv::core
