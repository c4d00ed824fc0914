#include "engine/own_array.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include "engine/mujoco.hpp"
#include "engine/untrusted/limits.hpp"
#include "error.hpp"
#include "names.hpp"

namespace mjenv::core {
namespace {

using Names = std::vector<const char*>;

// Rows cannot have their own real numbers of arrays whose names begin like this: they are large, MuJoCo uses them as
// indices, or only drawing reads them (vis).
const Names kShared{"mesh_", "skin_", "tex_", "flex_", "oct_", "plugin_", "vis."};
// Arrays whose names begin like this are written by mj_setConst alone.
const Names kComputed{"bvh_aabb", "flexedge_", "ngravcomp", "flg_"};

// The integers of which rows can have their own values, with their bounds.
struct IntegerRule {
  const char* array;
  double low, high;
};
const std::vector<IntegerRule> kIntegers{
    {"eq_active", 0, 1},
    {"eq_active0", 0, 1},
    {"jnt_limited", 0, 1},
    {"tendon_limited", 0, 1},
    {"actuator_ctrllimited", 0, 1},
    {"actuator_forcelimited", 0, 1},
    {"geom_contype", 0, std::numeric_limits<int>::max()},
    {"geom_conaffinity", 0, std::numeric_limits<int>::max()},
    {"body_contype", 0, std::numeric_limits<int>::max()},
    {"body_conaffinity", 0, std::numeric_limits<int>::max()},
    {"ngravcomp", 0, std::numeric_limits<int>::max()},
    {"flg_gravcomp", 0, 1},
    {"flg_surfacevel", 0, 1},
    {"flg_adhesion", 0, 1},
    {"tex_rgb", 0, 255},
    {"tex_data", 0, 255},
    {"opt.iterations", 1, static_cast<double>(kIterations.untrusted)},
    {"opt.noslip_iterations", 0, static_cast<double>(kIterations.untrusted)},
    {"opt.mpr_iterations", 1, static_cast<double>(kIterations.untrusted)},
    {"opt.ccd_iterations", 1, static_cast<double>(kIterations.untrusted)},
    {"opt.ls_iterations", 1, static_cast<double>(kSearches.untrusted)},
    {"opt.sdf_iterations", 1, static_cast<double>(kSearches.untrusted)},
    {"opt.sdf_initpoints", 1, static_cast<double>(kSearches.untrusted)},
    {"opt.integrator", 0, kLastIntegrator},
    {"opt.cone", mjCONE_PYRAMIDAL, mjCONE_ELLIPTIC},
    {"opt.solver", mjSOL_PGS, mjSOL_NEWTON},
    {"opt.disableflags", 0, (1 << mjNDISABLE) - 1},
    {"opt.enableflags", 0, (1 << mjNENABLE) - 1},
    {"opt.disableactuator", 0, std::numeric_limits<int>::max()},
};

// The arrays of indices of which rows can have their own, with the number of what they refer to. -1 refers to nothing.
struct IndexRule {
  const char* array;
  mjtSize mjModel::*count;
};
const std::vector<IndexRule> kIndices{{"geom_matid", &mjModel::nmat},
                                      {"site_matid", &mjModel::nmat},
                                      {"tendon_matid", &mjModel::nmat},
                                      {"mat_texid", &mjModel::ntex}};

// MuJoCo divides by the elements of these arrays. So an element may be 0 only if it is 0 in the model.
const Names kPositive{"body_mass",     "body_inertia",  "geom_size",       "hfield_size",
                      "cam_fovy",      "opt.timestep",  "opt.impratio",    "stat.extent",
                      "stat.meansize", "stat.meanmass", "stat.meaninertia"};
const Names kNotNegative{"geom_friction", "geom_rbound",         "geom_solmix",   "dof_armature", "dof_frictionloss",
                         "pair_friction", "tendon_frictionloss", "opt.tolerance", "opt.density",  "opt.viscosity",
                         "tendon_width",  "site_size",           "opt.apirate"};
const Names kQuaternions{"body_quat", "body_iquat", "geom_quat", "site_quat", "cam_quat"};
const Names kDirections{"jnt_axis"};

// The arrays of OwnArray::Collisions::other_pairs, with kMoreSearch, and other_contacts. geom_fluid changes
// no pairs, but it decides whether fluid forces read the frames of geoms, which Model::stepped may leave out. It is in
// kSearch, because ModelView uses the whole model if rows have their own values of an array in this list.
const Names kSearch{"geom_size", "geom_rbound",  "geom_pos",         "geom_quat",  "geom_margin",
                    "geom_gap",  "geom_contype", "geom_conaffinity", "geom_fluid", "body_pos",
                    "body_quat", "jnt_pos",      "jnt_axis"};
const Names kContacts{"geom_friction", "geom_solref", "geom_solimp", "geom_solmix", "geom_adhesion"};

template <typename Struct>
std::size_t offset_in(const Struct& start, const void* member) {
  return static_cast<std::size_t>(static_cast<const char*>(member) - reinterpret_cast<const char*>(&start));
}

struct Input {
  const char* name;
  mjenv_dtype type;
  std::size_t member;
  std::int64_t rows, columns;
  const void* cleared;
};

std::vector<Input> inputs_of(const mjModel& m) {
  const mjData d{};
  std::vector<Input> list;
  const auto add = [&](const char* name, const auto& member, std::int64_t rows, std::int64_t columns = 1) {
    list.push_back({name, MJENV_DTYPE_FLOAT64, offset_in(d, &member), rows, columns, nullptr});
  };
  add("qfrc_applied", d.qfrc_applied, m.nv);
  add("xfrc_applied", d.xfrc_applied, m.nbody, 6);
  add("mocap_pos", d.mocap_pos, m.nmocap, 3);
  if (!kNormalizesMocap) add("mocap_quat", d.mocap_quat, m.nmocap, 4);  // otherwise it is part of a row's state
  add("userdata", d.userdata, m.nuserdata);
  for_each_more_input(m, d, [&](const char* name, const auto& member, std::int64_t rows, const void* cleared) {
    list.push_back({name, MJENV_DTYPE_UINT8, offset_in(d, &member), rows, 1, cleared});
  });
  return list;
}

bool is_integer(mjenv_dtype type) { return type != MJENV_DTYPE_FLOAT64 && type != MJENV_DTYPE_FLOAT32; }

// The least and the greatest value of an array of integers. No value if rows cannot have their own.
std::optional<std::pair<double, double>> bounds_of(const mjModel& m, const std::string& name) {
  if (is_in(kSameframes, name)) return std::pair(0.0, 4.0);  // mjtSameFrame
  for (const IntegerRule& rule : kIntegers)
    if (name == rule.array) return std::pair(rule.low, rule.high);
  for (const IndexRule& rule : kIndices)
    if (name == rule.array) return std::pair(-1.0, static_cast<double>(m.*rule.count - 1));
  return std::nullopt;
}

[[noreturn]] void refuse_name(const std::string& name, const std::string& why) {
  fail(MJENV_E_NAME, "array " + quoted(name) + " cannot be written: " + why);
}

double element(mjenv_dtype type, const void* data, std::size_t index) {
  return with_type(type, [&](auto value) {
    std::memcpy(&value, static_cast<const std::byte*>(data) + index * sizeof value, sizeof value);
    return static_cast<double>(value);
  });
}

// Throws if MuJoCo could not compute with these values. value_of(i) returns element i. accepts_originals: an element
// may have the model's own value even if that breaks a rule, such as an infinite bound. Resets check what they draw, so
// this allocates memory only when it throws.
template <typename Value>
void check_values(const OwnArray& array, const Value& value_of, bool accepts_originals) {
  const std::string& name = array.original.name;
  const std::size_t count = array.original.count();
  const auto refuse = [&](std::size_t i, const std::string& why) {
    fail(MJENV_E_VALUE, element_is(name, i, value_of(i)) + why);
  };
  const bool positive = is_in(kPositive, name), not_negative = positive || is_in(kNotNegative, name);
  for (std::size_t i = 0; i < count; ++i) {
    const double value = value_of(i);
    const double original = array.original.data ? element(array.original.type, array.original.data, i) : 0;
    if (accepts_originals && array.original.data && value == original) continue;
    if (!std::isfinite(value)) refuse(i, ", but must be finite");
    if (name == "hfield_size" && value > mjMAXVAL) refuse(i, ", which is too large");
    if (!array.signs.empty() && array.signs[i] && (value > 0) - (value < 0) != (original > 0) - (original < 0))
      refuse(i, ", but must have the sign of the model's own " + number(original) +
                    ", which says what the actuator's state consists of");
    if (array.bounds && (value != std::floor(value) || value < array.bounds->first || value > array.bounds->second))
      refuse(i, ", but must be an integer from " + number(array.bounds->first) + " to " + number(array.bounds->second));
    if (const int changed = array.fixed ? array.fixed & (static_cast<int>(value) ^ static_cast<int>(original)) : 0)
      refuse(i, ", which changes what a row's state does not allow to change: the flag " + std::to_string(changed));
    if (array.original.type == MJENV_DTYPE_FLOAT32 && std::fabs(value) > std::numeric_limits<float>::max())
      refuse(i, ", more than a float32 can hold");
    if (not_negative && value < 0) refuse(i, ", but must not be negative");
    if (positive && value == 0 && original > 0) refuse(i, ", but must be positive, because MuJoCo divides by it");
  }
  const std::size_t columns = is_in(kQuaternions, name) ? 4 : is_in(kDirections, name) ? 3 : 0;
  for (std::size_t i = 0; columns > 0 && i < count; i += columns) {
    double square = 0;
    for (std::size_t j = i; j < i + columns; ++j) square += value_of(j) * value_of(j);
    if (square < mjMINVAL)
      refuse(i, std::string(", the first number of a ") + (columns == 4 ? "quaternion" : "direction") +
                    " that is too short");
  }
}

// Where in mjModel the pointer to the array is, in bytes from the beginning; 0 if mjModel itself holds the values.
std::size_t pointer_to(const mjModel& m, const std::string& name) {
  std::size_t member = 0;
  for_each_array(m, [&](const char* n, const auto& data, std::int64_t, std::int64_t, bool) {
    if (name == n) member = offset_in(m, &data);
  });
  return member;
}

// Whether wrap_prm holds indices of sites, as it does in a model with spatial tendons.
bool has_sites(const mjModel& m, const std::string& name) {
  return name == "wrap_prm" &&
         std::any_of(m.wrap_type, m.wrap_type + m.nwrap, [](int type) { return type != mjWRAP_JOINT; });
}

}  // namespace

bool can_be_own(const Model& model, const Array& of_model) {
  if (has_indices(*model.get(), of_model.name) || has_sites(*model.get(), of_model.name)) return false;
  return is_integer(of_model.type) ? bounds_of(*model.get(), of_model.name).has_value()
                                   : !begins_with(kShared, of_model.name);
}

bool is_computed(const std::string& name) { return begins_with(kComputed, name); }

std::vector<std::string> writable_names(const Model& model) {
  std::vector<std::string> names;
  for (const Array& array : model.arrays())
    if (can_be_own(model, array) && !is_computed(array.name)) names.push_back(array.name);
  return names;
}

OwnArray OwnArray::of(const Model& model, const std::string& name) {
  const mjModel& m = *model.get();
  OwnArray array{};
  if (const Array* of_model = find(model.arrays(), name)) {
    if (!can_be_own(model, *of_model))
      refuse_name(name,
                  std::string(is_integer(of_model->type)
                                  ? "it is part of the model's structure, which all rows share"
                                  : "it is shared by all rows, because it is large, an index, or only for drawing") +
                      ": change the model file");
    array.original = *of_model;
    const std::size_t pointer = pointer_to(m, name);
    array.place = pointer ? Place::model_array : Place::model_number;
    array.member = pointer ? pointer : offset_in(m, array.original.data);
  } else {
    const auto inputs = inputs_of(m);
    const auto input = std::find_if(inputs.begin(), inputs.end(), [&](const Input& i) { return name == i.name; });
    if (input == inputs.end()) {
      const std::vector<std::string> likely = nearest(name, writable_names(model));
      refuse_name(name,
                  "MuJoCo computes it, or there is no such array; " +
                      (likely.empty() ? "" : "mjModel has " + listed(likely) + "; ") +
                      "of mjData these can be written: time, qpos, qvel, act, qacc_warmstart, ctrl, qfrc_applied, "
                      "xfrc_applied, mocap_pos, mocap_quat, userdata, and eq_active of MuJoCo 4.0");
    }
    array.original = {name, input->type, {input->rows}, nullptr};
    if (input->columns > 1) array.original.shape.push_back(input->columns);
    array.place = Place::data_input;
    array.member = input->member;
    array.cleared = input->cleared;
  }
  if (is_integer(array.original.type)) array.bounds = bounds_of(m, name);
  array.signs = fixed_signs(m, name);
  if (name == "opt.enableflags" || name == "opt.disableflags") array.fixed = fixed_flags(m, name == "opt.enableflags");
  array.collisions = is_in(kSearch, name) || is_in(kMoreSearch, name) ? Collisions::other_pairs
                     : is_in(kContacts, name)                         ? Collisions::other_contacts
                                                                      : Collisions::same;
  const std::size_t of_model = array.original.bytes();
  if (name == "bvh_aabb") array.original.shape[0] = body_boxes(m);
  array.bytes = array.original.bytes();
  array.shared = of_model - array.bytes;
  return array;
}

OwnArray OwnArray::written(const Model& model, const std::string& name) {
  if (is_computed(name) && find(model.arrays(), name))
    refuse_name(name, "mj_setConst computes it (mjenv_set_constants)");
  return of(model, name);
}

void OwnArray::check(const double* values) const {
  check_values(
      *this, [values](std::size_t i) { return values[i]; }, true);
}

void OwnArray::check(const std::byte* block) const {
  check_values(
      *this, [&](std::size_t i) { return element(original.type, block + offset, i); }, true);
}

bool OwnArray::refuses_originals() const {
  try {
    check_values(
        *this, [&](std::size_t i) { return element(original.type, original.data, i); }, false);
  } catch (const Error&) {
    return true;
  }
  return false;
}

bool OwnArray::checks_elements_alone() const {
  return !is_in(kQuaternions, original.name) && !is_in(kDirections, original.name);
}

std::byte* OwnArray::complete(const std::byte* block, std::byte* whole) const {
  std::memcpy(whole, block + offset, bytes);
  std::memcpy(whole + bytes, static_cast<const std::byte*>(original.data) + bytes, shared);
  return whole;
}

void OwnArray::read(const std::byte* block, double* values) const {
  with_type(original.type, [&](auto zero) {
    const auto* from = reinterpret_cast<const decltype(zero)*>(block + offset);
    std::copy_n(from, original.count(), values);
  });
}

void OwnArray::write(const double* values, std::byte* block) const {
  with_type(original.type, [&](auto zero) {
    auto* to = reinterpret_cast<decltype(zero)*>(block + offset);
    std::transform(values, values + original.count(), to, [](double x) { return static_cast<decltype(zero)>(x); });
  });
}

void OwnArray::write(std::size_t index, double value, std::byte* block) const {
  with_type(original.type, [&](auto converted) {
    converted = static_cast<decltype(converted)>(value);
    std::memcpy(block + offset + index * sizeof converted, &converted, sizeof converted);
  });
}

}  // namespace mjenv::core
