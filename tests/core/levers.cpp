// What makes stepping fast leaves every bit as plain MuJoCo gives it: the built-in models and models of every odd kind,
// played on a work space and by mj_resetData, mj_step and mj_rnePostConstraint on the model as compiled.
#include "engine/mujoco.hpp"  // before cmocka's macro fail

#include <algorithm>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

#include "engine/assets.hpp"
#include "engine/model.hpp"
#include "engine/work.hpp"
#include "run.hpp"

// In the core's namespace, in which MuJoCo's names are the functions of the library that the core has opened.
namespace mjenv::core {
namespace {

constexpr int kEpisodes = 3;
constexpr int kSteps = 120;
constexpr int kFrames = 3;

// In [-1, 1), the same on every machine.
class Noise {
 public:
  double operator()() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(state_ >> 11) * 0x1p-52 - 1;
  }

 private:
  std::uint64_t state_ = 42;
};

struct Data {
  mjData* d;
  explicit Data(const mjModel* m) : d(mj_makeData(m)) {}
  ~Data() { mj_deleteData(d); }
  Data(const Data&) = delete;
  Data& operator=(const Data&) = delete;
};

// How much of an array has a meaning: as many rows as there are constraints.
std::size_t length(const Array& array, const mjData& d) {
  if (array.name.rfind("efc_", 0) != 0) return array.count();
  static const char* const dense[] = {"efc_type",       "efc_id",    "efc_pos",  "efc_margin", "efc_frictionloss",
                                      "efc_diagApprox", "efc_D",     "efc_R",    "efc_vel",    "efc_aref",
                                      "efc_b",          "efc_force", "efc_state"};
  for (const char* name : dense)
    if (array.name == name) return static_cast<std::size_t>(d.nefc);
  return 0;
}

// The name of an array of contacts that differs, "" if none does. Behind the last contact are zeros.
std::string contact_difference(const std::vector<Array>& arrays, const mjData& plain) {
  using Read = void (*)(const mjContact&, double*);
  static const struct {
    const char* name;
    int columns;
    Read read;
  } members[] = {
      {"contact.dist", 1, [](const mjContact& c, double* to) { *to = c.dist; }},
      {"contact.pos", 3, [](const mjContact& c, double* to) { std::copy_n(c.pos, 3, to); }},
      {"contact.frame", 9, [](const mjContact& c, double* to) { std::copy_n(c.frame, 9, to); }},
      {"contact.includemargin", 1, [](const mjContact& c, double* to) { *to = c.includemargin; }},
      {"contact.friction", 5, [](const mjContact& c, double* to) { std::copy_n(c.friction, 5, to); }},
      {"contact.solref", 2, [](const mjContact& c, double* to) { std::copy_n(c.solref, 2, to); }},
      {"contact.solimp", 5, [](const mjContact& c, double* to) { std::copy_n(c.solimp, 5, to); }},
      {"contact.dim", 1, [](const mjContact& c, double* to) { *to = c.dim; }},
      {"contact.geom1", 1, [](const mjContact& c, double* to) { *to = c.geom1; }},
      {"contact.geom2", 1, [](const mjContact& c, double* to) { *to = c.geom2; }},
      {"contact.exclude", 1, [](const mjContact& c, double* to) { *to = c.exclude; }},
      {"contact.efc_address", 1, [](const mjContact& c, double* to) { *to = c.efc_address; }},
  };
  for (const auto& member : members) {
    const auto array = std::find_if(arrays.begin(), arrays.end(), [&](const auto& a) { return a.name == member.name; });
    if (array == arrays.end()) return member.name;
    std::vector<double> expected(array->count()), values(array->count(), 1.0);
    for (int i = 0; i < plain.ncon; ++i)
      member.read(plain.contact[i], expected.data() + static_cast<std::ptrdiff_t>(i) * member.columns);
    array->read(values.data());
    if (std::memcmp(values.data(), expected.data(), values.size() * sizeof(double))) return member.name;
  }
  return "";
}

// The name of an array that differs, "" if none does.
std::string difference(Work& work, const mjData& plain) {
  work.complete();
  const auto arrays = work.arrays();
  const auto find = [&](const char* name) {
    for (const auto& array : arrays)
      if (array.name == name) return array.data;
    return static_cast<const void*>(nullptr);
  };
  const auto* time = static_cast<const double*>(find("time"));
  const auto* self = reinterpret_cast<const mjData*>(reinterpret_cast<const char*>(time) - offsetof(mjData, time));
  if (self->ncon != plain.ncon) return "ncon";
  if (self->nefc != plain.nefc) return "nefc";
  const std::string of_contacts = contact_difference(arrays, plain);
  if (!of_contacts.empty()) return of_contacts;
  const auto* base = static_cast<const char*>(self->buffer);
  for (const auto& array : arrays) {
    if (array.stride) continue;
    const auto* mine = static_cast<const char*>(array.data);
    const bool inside = mine >= base && mine < base + self->nbuffer;
    const char* theirs = inside ? static_cast<const char*>(plain.buffer) + (mine - base)
                                : reinterpret_cast<const char*>(&plain) + (mine - reinterpret_cast<const char*>(self));
    const std::size_t size = array.type == MJENV_DTYPE_UINT8   ? 1
                             : array.type == MJENV_DTYPE_INT32 ? sizeof(int)
                                                               : sizeof(double);
    if (length(array, plain) && std::memcmp(mine, theirs, length(array, plain) * size)) return array.name;
  }
  return "";
}

// Plays episodes both ways; says where they part, "" if nowhere.
std::string play(const std::shared_ptr<const Model>& model) {
  const ErrorTrap trap;
  const mjModel* m = model->get();
  Work work(model);
  const auto& layout = work.layout();
  const Data plain(m);
  mjData* d = plain.d;
  std::vector<double> state(layout.size), before(layout.size), action(layout.nu);
  Noise noise;
  int contacts = 0;
  for (int episode = 0; episode < kEpisodes; ++episode) {
    mj_resetData(m, d);
    for (int i = 0; i < m->nv; ++i) d->qvel[i] = 0.3 * noise();
    work.begin();
    work.save(state.data());
    std::copy_n(d->qvel, m->nv, layout.qvel(state.data()));
    work.load(state.data());
    work.forward();
    mj_forward(m, d);
    for (int t = 0; t <= kSteps; ++t) {
      const std::string found = difference(work, *d);
      if (!found.empty())
        return found + " in episode " + std::to_string(episode) + " after " + std::to_string(t) + " steps";
      contacts += d->ncon;
      for (double& a : action) a = noise();
      work.save(state.data());
      work.load(state.data());
      work.act({action.data(), MJENV_DTYPE_FLOAT64, m->nu});
      work.step(kFrames, before.data());
      std::copy(action.begin(), action.end(), d->ctrl);
      for (int k = 0; k < kFrames; ++k) mj_step(m, d);
      mj_rnePostConstraint(m, d);
    }
  }
  std::printf("%s: %d contacts, %d explicit pairs of %d geoms\n", model->label().c_str(), contacts,
              static_cast<int>(model->stepped()->npair), static_cast<int>(m->ngeom));
  return "";
}

// How much memory MuJoCo allocates for an mjData.
std::size_t allocated_bytes(const mjData& d) {
#if mjVERSION_HEADER == 222
  return sizeof d + static_cast<std::size_t>(d.nbuffer) + static_cast<std::size_t>(d.nstack) * sizeof(mjtNum);
#else
  return sizeof d + static_cast<std::size_t>(d.nbuffer) + static_cast<std::size_t>(d.narena);
#endif
}

// Without the alignment of its arrays, which takes up to 64 bytes for each.
void test_work_bytes(void** /*state*/) {
  for (std::size_t i = 0; i < asset_count; ++i) {
    const auto model = Model::open(assets[i].name);
    const std::size_t allocated = allocated_bytes(*Data(model->get()).d), counted = model->work_bytes();
    if (counted > allocated || counted + 16384 < allocated)
      fail_msg("%s: %zu of %zu bytes", assets[i].name, counted, allocated);
  }
}

std::string failures;

void test_built_in(void** /*state*/) {
  failures.clear();
  for (std::size_t i = 0; i < asset_count; ++i) {
    const std::string found = play(Model::open(assets[i].name));
    if (!found.empty()) failures += std::string(assets[i].name) + ": " + found + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

void test_odd(void** /*state*/) {
  failures.clear();
  for (const char* name : {"tethered_pair.xml", "tendons.xml", "mocap.xml", "explicit_pairs.xml", "sensors.xml",
                           "sensing.xml", "quadruped.xml", "swimmers.xml", "world_only.xml", "terrain.xml"}) {
    const std::string found = play(Model::parse(name, odd_model(name)));
    if (!found.empty()) failures += std::string(name) + ": " + found + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

int run() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_work_bytes), cmocka_unit_test(test_built_in),
                              cmocka_unit_test(test_odd)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}

}  // namespace
}  // namespace mjenv::core

int run_levers() { return mjenv::core::run(); }
