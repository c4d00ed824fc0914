#include "engine/model.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>
#include <type_traits>

#include "engine/mujoco.hpp"
#include "error.hpp"
#include "hash.hpp"
#include "version.hpp"

namespace mjenv::core {
namespace {

struct Kind {
  const char* name;
  mjtObj type;
  mjtSize mjModel::*count;
};

constexpr std::array<Kind, 21> kinds{
    {{"body", mjOBJ_BODY, &mjModel::nbody},       {"joint", mjOBJ_JOINT, &mjModel::njnt},
     {"geom", mjOBJ_GEOM, &mjModel::ngeom},       {"site", mjOBJ_SITE, &mjModel::nsite},
     {"camera", mjOBJ_CAMERA, &mjModel::ncam},    {"light", mjOBJ_LIGHT, &mjModel::nlight},
     {"actuator", mjOBJ_ACTUATOR, &mjModel::nu},  {"tendon", mjOBJ_TENDON, &mjModel::ntendon},
     {"sensor", mjOBJ_SENSOR, &mjModel::nsensor}, {"mesh", mjOBJ_MESH, &mjModel::nmesh},
     {"skin", mjOBJ_SKIN, &mjModel::nskin},       {"hfield", mjOBJ_HFIELD, &mjModel::nhfield},
     {"texture", mjOBJ_TEXTURE, &mjModel::ntex},  {"material", mjOBJ_MATERIAL, &mjModel::nmat},
     {"pair", mjOBJ_PAIR, &mjModel::npair},       {"exclude", mjOBJ_EXCLUDE, &mjModel::nexclude},
     {"equality", mjOBJ_EQUALITY, &mjModel::neq}, {"numeric", mjOBJ_NUMERIC, &mjModel::nnumeric},
     {"text", mjOBJ_TEXT, &mjModel::ntext},       {"tuple", mjOBJ_TUPLE, &mjModel::ntuple},
     {"key", mjOBJ_KEY, &mjModel::nkey}}};

const Kind& kind_of(const std::string& type) {
  std::vector<std::string> names;
  for (const auto& kind : kinds) {
    if (type == kind.name) return kind;
    names.emplace_back(kind.name);
  }
  fail(MJENV_E_NAME, "no objects of type " + quoted(type) + "; there are " + listed(names));
}

template <typename T>
constexpr mjenv_dtype type_of(const T*) {
  if (std::is_same_v<T, mjtNum>) return MJENV_DTYPE_FLOAT64;
  if (std::is_same_v<T, float>) return MJENV_DTYPE_FLOAT32;
  if (std::is_same_v<T, int>) return MJENV_DTYPE_INT32;
  if (std::is_same_v<T, std::int64_t>) return MJENV_DTYPE_INT64;
  return MJENV_DTYPE_UINT8;  // mjtByte, mjtBool and char
}

std::vector<Array> arrays_of(const mjModel* m) {
  std::vector<Array> list;
  const auto add = [&](std::string name, const auto* data, std::vector<std::int64_t> shape) {
    list.push_back({std::move(name), type_of(data), std::move(shape), data});
  };
  for_each_number(*m, [&](const char* name, const auto* data, auto... count) { add(name, data, {count...}); });
  add("stat.meaninertia", &m->stat.meaninertia, {});
  add("stat.meanmass", &m->stat.meanmass, {});
  add("stat.meansize", &m->stat.meansize, {});
  add("stat.extent", &m->stat.extent, {});
  add("stat.center", m->stat.center, {3});
  const auto& view = m->vis.global;
  add("vis.global.fovy", &view.fovy, {});
  add("vis.global.azimuth", &view.azimuth, {});
  add("vis.global.elevation", &view.elevation, {});
  add("vis.global.offwidth", &view.offwidth, {});
  add("vis.global.offheight", &view.offheight, {});
  add("vis.map.znear", &m->vis.map.znear, {});
  add("vis.map.zfar", &m->vis.map.zfar, {});
  for_each_array(*m, [&](const char* name, const auto* data, std::int64_t rows, std::int64_t columns, bool is_vector) {
    add(name, data, is_vector ? std::vector{rows} : std::vector{rows, columns});
  });
  return list;
}

// Whether nothing but collision detection and drawing reads the frames of geoms, cameras and lights.
bool frames_unread(const mjModel& m) {
  if (m.nsensor > 0) return false;
  for (int i = 0; i < m.nwrap; ++i)
    if (m.wrap_type[i] == mjWRAP_SPHERE || m.wrap_type[i] == mjWRAP_CYLINDER) return false;
  for (int i = 0; i < m.neq; ++i)
    if (m.eq_type[i] == mjEQ_DISTANCE) return false;
  for (int g = 0; g < m.ngeom; ++g)
    if (m.geom_fluid[mjNFLUID * g] > 0) return false;
  return true;
}

// Makes the view of the model that mj_step uses. In it, collision detection tests the pairs of the list, and frames
// that no step reads are left out. Where MuJoCo cannot leave out such a frame of a geom, the view says that it equals
// that of the geom's body, so that MuJoCo only copies it. Work::complete computes all of them later.
std::unique_ptr<const mjModel> stepped_view(const mjModel& model, std::optional<Pairs>& pairs,
                                            std::vector<unsigned char>& sameframe) {
  auto view = std::make_unique<mjModel>(model);
  const bool frames = !frames_unread(model);
  if (!frames) view->ncam = view->nlight = 0;
  if (!pairs) return view;
  set_pairs(*view, *pairs);
  if (frames) return view;
  view->ngeom = 0;
  sameframe.assign(static_cast<std::size_t>(model.ngeom), 1);
  for (const auto& geoms : {pairs->geom1, pairs->geom2, pairs->searched})
    for (const int g : geoms) {
      sameframe[g] = model.geom_sameframe[g];
      view->ngeom = std::max<mjtSize>(view->ngeom, g + 1);
    }
  view->geom_sameframe = sameframe.data();
  return view;
}

// Makes the view without sensors. Returns null if there are none, or if MuJoCo must compute them in every mj_step,
// because their next values depend on it (sensors_have_memory) or the process's mjcb_sensor may compute them.
std::unique_ptr<const mjModel> sensorless_view(mjModel model, std::optional<Pairs>& pairs,
                                               std::vector<unsigned char>& sameframe) {
  const int* const types = model.sensor_type;
  if (model.nsensor == 0 || sensors_have_memory(model)) return nullptr;
  if (std::find(types, types + model.nsensor, mjSENS_USER) != types + model.nsensor) return nullptr;
  model.nsensor = 0;
  return stepped_view(model, pairs, sameframe);
}

// Copies the elements of an array that are in use, and sets the others among the first `before` to 0. Returns how many
// are in use.
template <typename From, typename To>
std::size_t copy_elements(const Array& array, To* to, std::size_t before) {
  const std::size_t all = array.count();
  const auto convert = [](auto x) { return static_cast<To>(x); };
  const auto* from = static_cast<const From*>(array.data);
  if (array.stride == 0) {
    const std::size_t used = array.held ? std::min(static_cast<std::size_t>(array.held()), all) : all;
    std::transform(from, from + used, to, convert);
    if (used < before) std::fill(to + used, to + before, To{});
    return used;
  }
  To* const first = to;
  const auto used = std::min<std::int64_t>(array.held(), array.shape[0]);
  const std::size_t columns = used == 0 ? 0 : all / static_cast<std::size_t>(array.shape[0]);
  for (std::int64_t i = 0; i < used; ++i) {
    std::array<double, 6> computed{};  // the longest is a contact's force
    if (array.compute) {
      array.compute(i, computed.data());
      to = std::transform(computed.begin(), computed.begin() + columns, to, convert);
    } else {
      to = std::transform(from, from + columns, to, convert);
      from = reinterpret_cast<const From*>(reinterpret_cast<const char*>(from) + array.stride);
    }
  }
  if (to < first + before) std::fill(to, first + before, To{});
  return static_cast<std::size_t>(to - first);
}

}  // namespace

std::size_t Array::count() const {
  std::size_t total = 1;
  for (const auto extent : shape) total *= static_cast<std::size_t>(extent);
  return total;
}

std::size_t Array::bytes() const {
  return count() * with_type(type, [](auto zero) { return sizeof zero; });
}

std::size_t Array::copy(std::byte* to, std::size_t before) const {
  return with_type(type, [&](auto zero) {
    auto* elements = reinterpret_cast<decltype(zero)*>(to);
    return sizeof zero * copy_elements<decltype(zero)>(*this, elements, before / sizeof zero);
  });
}

void Array::copy(std::byte* to) const { copy(to, bytes()); }

void Array::read(double* values) const {
  with_type(type, [&](auto zero) { copy_elements<decltype(zero)>(*this, values, count()); });
}

const Array* find(const std::vector<Array>& arrays, const std::string& name) {
  const auto found = std::find_if(arrays.begin(), arrays.end(), [&](const Array& array) { return array.name == name; });
  return found == arrays.end() ? nullptr : &*found;
}

void DeleteData::operator()(mjData* data) const { mj_deleteData(data); }
void Model::Delete::operator()(mjModel_* model) const { mj_deleteModel(model); }

Model::~Model() = default;

Model::Model(std::string label, Compiled model, Origin origin)
    : label_(std::move(label)),
      model_(std::move(model)),
      origin_(origin),
      pairs_(explicit_pairs(*model_, origin == Origin::built_in)),
      stepped_(stepped_view(*model_, pairs_, sameframe_)),
      sensorless_(sensorless_view(*model_, pairs_, sameframe_)),
      arrays_(arrays_of(model_.get())),
      nq_(static_cast<int>(model_->nq)),
      nv_(static_cast<int>(model_->nv)),
      na_(static_cast<int>(model_->na)),
      nu_(static_cast<int>(model_->nu)),
      nbody_(static_cast<int>(model_->nbody)) {}

int Model::more_state() const { return core::more_state(*model_); }
bool Model::is_valid_more(const double* state) const { return core::is_valid_more(*model_, state); }

std::size_t Model::work_bytes() const {
  std::size_t bytes = sizeof(mjData) + stack_bytes(*model_);
  for_each_array(*model_, nullptr, [&](const char*, const auto* data, std::int64_t rows, std::int64_t columns, bool) {
    bytes += sizeof(*data) * static_cast<std::size_t>(rows * columns);
  });
  return bytes;
}

std::vector<double> Model::action_bound(int side) const {
  std::vector<double> bound;
  for (int i = 0; i < nu_; ++i) bound.push_back(static_cast<float>(model_->actuator_ctrlrange[2 * i + side]));
  return bound;
}

bool Model::has_control_range(int i) const {
  return model_->actuator_ctrllimited[i] != 0 || model_->actuator_ctrlrange[2 * i] != 0 ||
         model_->actuator_ctrlrange[2 * i + 1] != 0;
}

int Model::count(const std::string& type) const { return static_cast<int>(model_.get()->*kind_of(type).count); }

int Model::index(const std::string& type, const std::string& name) const {
  const int found = mj_name2id(model_.get(), kind_of(type).type, name.c_str());
  if (found >= 0) return found;
  std::vector<std::string> names;
  for (int i = 0; i < count(type); ++i)
    if (*this->name(type, i)) names.emplace_back(this->name(type, i));
  fail(MJENV_E_NAME,
       "model " + quoted(label_) + " has no " + type + " " + quoted(name) + choices(name, names, "mjenv_object_name"));
}

const char* Model::name(const std::string& type, std::int64_t index) const {
  const Kind& kind = kind_of(type);
  check_index((type + " index").c_str(), index, static_cast<std::size_t>(model_.get()->*kind.count));
  const char* found = mj_id2name(model_.get(), kind.type, static_cast<int>(index));
  return found ? found : "";
}

std::string Model::actuator_label(int i) const {
  const std::string own = name("actuator", i);
  return own.empty() && model_->actuator_trntype[i] == mjTRN_JOINT ? name("joint", model_->actuator_trnid[2 * i]) : own;
}

int Model::free_dof(int body) const {
  const int joint = model_->body_jntadr[body];
  return joint >= 0 && model_->jnt_type[joint] == mjJNT_FREE ? model_->jnt_dofadr[joint] : -1;
}

std::uint64_t Model::fingerprint() const {
  const ErrorTrap trap;
  std::vector<unsigned char> image(static_cast<std::size_t>(mj_sizeModel(model_.get())));
  mj_saveModel(model_.get(), nullptr, image.data(), static_cast<mjtSize>(image.size()));
  return hash(image.data(), image.size());
}

const char* mujoco_version() { return open_mujoco(); }
bool math_is_portable() { return std::string_view(MJENV_MATH_TEXT) == "portable"; }

const char* library_version() {
  if (!mujoco_is_open()) return MJENV_VERSION_TEXT " (MuJoCo " MJENV_MUJOCO_TEXT ")";
  static const auto text = [] {
    std::array<char, 64> made{};
    std::snprintf(made.data(), made.size(), "%s (MuJoCo %s%s%s)", MJENV_VERSION_TEXT, open_mujoco(),
                  math_is_portable() ? ", portable math" : "", *MJENV_ARCH_TEXT ? ", " MJENV_ARCH_TEXT : "");
    return made;
  }();
  return text.data();
}

}  // namespace mjenv::core
