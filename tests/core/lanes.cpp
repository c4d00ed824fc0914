// Lanes compute every array of mjData as MuJoCo's own functions do, bit for bit: steps of random states, in all
// instruction sets of this CPU, against mj_step.
// Before cmocka's macro fail:
#include "engine/mujoco.hpp"
#include "error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>
// Sanitizers have allocators of their own, whose memory mallinfo2 does not count.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#if __GLIBC_PREREQ(2, 33)
#define COUNTS_MEMORY
#include <malloc.h>
#endif
#endif

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

// Functions of MuJoCo that mujoco.h does not list
extern "C" {
void mju_transposeSparse(mjtNum* res, const mjtNum* mat, int nr, int nc, int* res_rownnz, int* res_rowadr,
                         int* res_colind, const int* rownnz, const int* rowadr, const int* colind);
void mju_superSparse(int nr, int* rowsuper, const int* rownnz, const int* rowadr, const int* colind);
void mju_sqrMatTDSparse(mjtNum* res, const mjtNum* mat, const mjtNum* matT, const mjtNum* diag, int nr, int nc,
                        int* res_rownnz, int* res_rowadr, int* res_colind, const int* rownnz, const int* rowadr,
                        const int* colind, const int* rowsuper, const int* rownnzT, const int* rowadrT,
                        const int* colindT, const int* rowsuperT, mjData* d);
mjtNum mju_dotSparse(const mjtNum* vec1, const mjtNum* vec2, const int nnz1, const int* ind1);
int mju_cholFactorSparse(mjtNum* mat, int n, mjtNum mindiag, int* rownnz, int* rowadr, int* colind, mjData* d);
void mju_cholSolveSparse(mjtNum* res, const mjtNum* mat, const mjtNum* vec, int n, const int* rownnz, const int* rowadr,
                         const int* colind);
int mju_cholUpdateSparse(mjtNum* mat, mjtNum* x, int n, int flg_plus, int* rownnz, int* rowadr, int* colind, int x_nnz,
                         int* x_ind, mjData* d);
}

#define MJENV_LANES_WIDTH 2
#include "engine/assets.hpp"
#include "engine/lanes/code.hpp"
#include "engine/lanes/model_tables.hpp"
#include "engine/lanes/stepper.hpp"
#include "engine/model.hpp"
#include "engine/own_arrays.hpp"
#include "engine/work.hpp"
#include "noise.hpp"
#include "run.hpp"

namespace mjenv::core {
namespace {

constexpr int kRows = 120, kFewRows = 48;  // of each kind of state
int share = 1;                             // of these rows, one of so many is stepped
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinite = std::numeric_limits<double>::infinity();

// How wild the random states are. Lanes compute the tame ones themselves, except where MuJoCo warns. In tiny ones, velocities
// are negative zeros, and so are accelerations by controls. Those at the limit have numbers around the greatest that MuJoCo
// allows.
enum class Kind { at_rest, tame, odd, fast, bad, tiny, at_limit };

std::vector<double> random_state(const mjModel& m, const StateLayout& layout, Kind kind, Noise& noise) {
  std::vector<double> state(layout.size);
  double *qpos = layout.qpos(state.data()), *qvel = layout.qvel(state.data()), *warm = layout.warmstart(state.data());
  double* ctrl = warm + layout.nv;
  const double spread = kind == Kind::at_rest ? 0 : kind == Kind::fast ? 4 : 0.4;
  for (int i = 0; i < m.nq; ++i) qpos[i] = m.qpos0[i] + spread * noise();
  for (int i = 0; i < m.nv; ++i) {
    qvel[i] = kind == Kind::at_rest ? 0 : (kind == Kind::fast ? 30 : 3) * noise();
    warm[i] = kind == Kind::at_rest ? 0 : 10 * noise();
  }
  for (int i = 0; i < m.nu; ++i) ctrl[i] = 1.5 * noise();
  for (int i = 0; i < m.na; ++i) layout.act(state.data())[i] = 0.5 + 0.6 * noise();
  for (std::size_t i = 0; i < layout.more; ++i) layout.rest(state.data())[i] = noise();  // mocap_quat
  for (int j = 0; j < m.njnt; ++j) {
    if (m.jnt_type[j] != mjJNT_FREE && m.jnt_type[j] != mjJNT_BALL) continue;
    double* quat = qpos + m.jnt_qposadr[j] + (m.jnt_type[j] == mjJNT_FREE ? 3 : 0);
    if (kind != Kind::at_rest)
      for (int k = 0; k < 4; ++k) quat[k] = noise();
    if (kind == Kind::odd)
      for (int k = 0; k < 4; ++k) quat[k] = noise.below(3) ? noise.odd() : k == 0;
  }
  if (kind == Kind::odd) {
    for (int i = 0; i < m.nq; ++i)
      if (noise.below(3) == 0) qpos[i] = noise.below(2) ? m.qpos0[i] : noise.odd();
    for (int i = 0; i < m.nv; ++i)
      if (noise.below(3) == 0) qvel[i] = noise.odd();
    for (int i = 0; i < m.nu; ++i)
      if (noise.below(3) == 0) ctrl[i] = noise.odd();
  }
  if (kind == Kind::tiny) {
    std::fill_n(qvel, m.nv, -0.0);
    std::fill_n(ctrl, m.nu, -5e-324);
  }
  if (kind == Kind::at_limit) {
    const double values[] = {0, 9e9, 9.99e9, 1e10, std::nextafter(1e10, kInfinite), 1.001e10, 1.01e10};
    const auto any = [&] { return (noise.below(2) ? 1 : -1) * values[noise.below(std::size(values))]; };
    for (int i = 0; i < m.nq; ++i) qpos[i] = any();
    for (int i = 0; i < m.nv; ++i) qvel[i] = any();
  }
  if (kind == Kind::bad) {
    const double values[] = {kNaN, -kNaN, INFINITY, -INFINITY, 1e11, -1e300, 9.9e9};
    const auto any = [&](double* array, int count) {
      if (count > 0) array[noise.below(static_cast<std::uint64_t>(count))] = values[noise.below(std::size(values))];
    };
    switch (noise.below(5)) {
      case 0: any(qpos, m.nq); break;
      case 1: any(qvel, m.nv); break;
      case 2: any(ctrl, m.nu); break;
      case 3: any(layout.rest(state.data()), static_cast<int>(layout.more)); break;
      default: any(warm, m.nv);
    }
  }
  return state;
}

// How much of an array has a meaning. Of those of constraints, as many rows as there are constraints.
std::size_t length(const Array& array, const mjModel& m, const mjData& d) {
  // mj_Euler factorises the matrix with damping only if there is damping.
  const bool is_damped = std::any_of(m.dof_damping, m.dof_damping + m.nv, [](mjtNum damping) { return damping > 0; });
  if ((array.name == "qH" || array.name == "qHDiagInv") && !is_damped) return 0;
  if (array.name.rfind("wrap_", 0) == 0 || (array.name.rfind("ten_J", 0) == 0 && array.held))
    return static_cast<std::size_t>(array.held());
  if (array.name.rfind("efc_", 0) != 0) return array.count();
  const auto rows = static_cast<std::size_t>(d.nefc);
  if (array.name == "efc_J" && mj_isSparse(&m)) return rows ? d.efc_J_rowadr[rows - 1] + d.efc_J_rownnz[rows - 1] : 0;
  if (array.name == "efc_J") return rows * static_cast<std::size_t>(m.nv);
  if (array.name == "efc_KBIP") return 4 * rows;
  static const char* const ones[] = {"efc_type",       "efc_id",    "efc_pos",  "efc_margin", "efc_frictionloss",
                                     "efc_diagApprox", "efc_D",     "efc_R",    "efc_vel",    "efc_aref",
                                     "efc_b",          "efc_force", "efc_state"};
  return std::count(std::begin(ones), std::end(ones), array.name) ? rows : 0;
}

// The name of an array in which two work spaces differ, "" if there is none. Only of arrays that may be read.
std::string difference(Work& got, Work& want) {
  if (got.is_whole()) {
    got.complete();
    want.complete();
  } else {
    got.complete_frames();
    want.complete_frames();
  }
  if (got.reads_forces()) {
    got.complete_forces();
    want.complete_forces();
  }
  const std::vector<Array> found = got.arrays(), expected = want.arrays();
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!got.is_whole() && !is_always_readable(found[i].name) && !(got.reads_forces() && is_force(found[i].name)))
      continue;
    if (got.has_lost_forces() && is_force(found[i].name)) continue;
    const std::size_t count = length(expected[i], want.model(), *want.data());
    if (found[i].stride) {
      std::vector<double> a(found[i].count()), b(a.size());
      found[i].read(a.data());
      expected[i].read(b.data());
      if (std::memcmp(a.data(), b.data(), a.size() * sizeof(double))) return found[i].name;
      continue;
    }
    const std::size_t size = found[i].type == MJENV_DTYPE_UINT8   ? 1
                             : found[i].type == MJENV_DTYPE_INT32 ? sizeof(int)
                                                                  : sizeof(double);
    if (count && std::memcmp(found[i].data, expected[i].data, count * size)) return found[i].name;
  }
  return "";
}

bool ends_with(const std::string& name, const std::string& end) {
  return name.size() >= end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0;
}

// Changes the integers of an array at random: flags, which geoms can touch, and numbers of iterations.
void change_integers(const Array& array, std::vector<double>& values, Noise& noise) {
  const bool is_flag = array.type == MJENV_DTYPE_UINT8, is_changed = noise.below(24) == 0;
  for (double& value : values)
    if (is_flag)
      value = noise.below(4) ? value : 1 - value;
    else if (array.name == "opt.iterations")
      value = std::floor(value * (1 + 0.3 * noise()));
    else if (is_changed && array.name != "opt.mpr_iterations")
      value = static_cast<double>(noise.below(3));
}

// Values of their own for a row: those of the model, changed at random. Half of the rows have numbers in an array where the
// model has zeros.
std::vector<double> random_block(const OwnArrays& own, Noise& noise) {
  std::vector<double> block(own.block_bytes() / sizeof(double));
  auto* bytes = reinterpret_cast<std::byte*>(block.data());
  for (const OwnArray& array : own.list()) {
    if (!array.original.data) {  // an input of mjData
      std::vector<double> values(array.original.count());
      const bool is_still = noise.below(3) == 0;
      for (double& value : values) value = is_still || noise.below(4) == 0 ? noise.odd() * 0 : 0.3 * noise();
      array.write(values.data(), bytes);
      continue;
    }
    const bool is_raised = noise.below(2 * own.list().size()) == 0;
    std::vector<double> values(array.original.count());
    array.original.read(values.data());
    const bool is_cleared = array.original.name == "dof_damping" && noise.below(8) == 0;
    const bool is_shifted = array.original.name == "jnt_stiffness" && noise.below(8) == 0;
    const std::string& name = array.original.name;
    if (array.original.type == MJENV_DTYPE_UINT8 || array.original.type == MJENV_DTYPE_INT32) {
      change_integers(array.original, values, noise);
      array.write(values.data(), bytes);
      continue;
    }
    for (double& value : values) {
      value = is_cleared ? 0 : value * (1 + 0.3 * noise()) + (is_shifted ? 1 : 0);
      if (is_raised && value == 0 && noise.below(2)) value = 0.1 + 0.1 * noise();
    }
    if ((ends_with(name, "_quat") || ends_with(name, "_iquat")) && noise.below(8) > 0)
      for (std::size_t i = 0; i < values.size(); i += 4) mju_normalize4(&values[i]);
    // In a fluid, MuJoCo passes over bodies whose mass is below 1e-15.
    if (array.original.name == "body_mass" && noise.below(8) == 0) values[noise.below(values.size())] = 1e-16;
    array.write(values.data(), bytes);
  }
  return block;
}

// Whether MuJoCo resets the simulation in this step, or fails.
bool diverges(Work& work, int frames, double* before) {
  try {
    work.step(frames, before);
  } catch (const Error&) {
    return true;
  }
  return work.diverged() || work.diverged_early();
}

struct Counts {
  int rows = 0, left = 0, contacts = 0, constraints = 0;
};

// Steps `width` random states of a kind in lanes and one by one. Says where they part, "" if nowhere. own: the arrays of
// which the rows have their own values.
std::string compare(const Model& model, lanes::Stepper& stepper, std::vector<std::unique_ptr<Work>>& works, Work& plain,
                    const OwnArrays& own, Kind kind, int frames, Noise& noise, Counts& counts) {
  const mjModel& m = *model.get();
  const StateLayout layout(model);
  const int count = works.size() > 2 && noise.below(4) == 0 ? 2 : static_cast<int>(works.size());
  std::vector<Work*> some;
  std::vector<std::vector<double>> states, befores, blocks;
  std::vector<double*> before;
  const auto begin = [&](Work& work, std::size_t i) {
    const std::vector<double>& state = states[i];
    if (!own.list().empty()) work.use(own, reinterpret_cast<std::byte*>(blocks[i].data()));
    work.load(state.data());
    work.act({state.data() + layout.size - layout.more - layout.nu, MJENV_DTYPE_FLOAT64, m.nu});
  };
  for (int i = 0; i < count; ++i) {
    states.push_back(random_state(m, layout, kind, noise));
    befores.emplace_back(layout.size);
    blocks.push_back(random_block(own, noise));
    some.push_back(works[static_cast<std::size_t>(i)].get());
    begin(*some.back(), static_cast<std::size_t>(i));
  }
  for (auto& state : befores) before.push_back(state.data());
  const std::uint32_t done = stepper.step(some.data(), count, frames, before.data());
  for (int i = 0; i < count; ++i) {
    ++counts.rows;
    std::vector<double> last(layout.size);
    begin(plain, static_cast<std::size_t>(i));
    if (!(done >> i & 1)) {
      // Lanes also leave rows whose numbers are bad between the stages of RK4, where MuJoCo does not check them. It finds
      // them at the beginning of the next step.
      counts.left += !diverges(plain, frames, last.data()) && !diverges(plain, 1, last.data());
      continue;
    }
    plain.step(frames, last.data());
    counts.contacts += plain.data()->ncon;
    counts.constraints += plain.data()->nefc;
    if (plain.diverged()) return "a row that diverges was not left to MuJoCo";
    if (std::memcmp(last.data(), before[static_cast<std::size_t>(i)], last.size() * sizeof(double))) return "before";
    const std::vector<double>&raw = some[static_cast<std::size_t>(i)]->raw_qpos(), &expected = plain.raw_qpos();
    if (std::memcmp(raw.data(), expected.data(), expected.size() * sizeof(double))) return "raw_qpos";
    const std::string found = difference(*some[static_cast<std::size_t>(i)], plain);
    if (!found.empty()) return found;
  }
  return "";
}

// Whether a step may read the array.
bool is_read(const std::string& name) {
  for (const char* kind : {"key_", "light_", "mat_", "numeric_", "tex_", "tuple_", "stat."})
    if (name.rfind(kind, 0) == 0 && name != "stat.meaninertia") return false;
  return !ends_with(name, "_user") && !ends_with(name, "_rgba") && !ends_with(name, "_matid");
}

bool is_writable(const Model& model, const Array& array) {
  const std::vector<std::string> names = writable_names(model);
  return std::find(names.begin(), names.end(), array.name) != names.end();
}

// The arrays of which rows can have their own values; with those of frames and of which geoms touch, or without them.
OwnArrays own_arrays(const Model& model, bool with_frames) {
  OwnArrays own(model);
  const std::vector<std::string> frames{"body_pos", "body_quat",   "body_iquat",   "jnt_pos",          "jnt_axis",
                                        "qpos0",    "geom_pos",    "geom_quat",    "geom_size",        "geom_margin",
                                        "geom_gap", "geom_rbound", "geom_contype", "geom_conaffinity", "geom_fluid",
                                        "site_pos", "site_quat"};
  for (const Array& array : model.arrays())
    if (is_writable(model, array) && is_read(array.name) &&
        (with_frames || std::count(frames.begin(), frames.end(), array.name) == 0))
      own.add(array.name);
  for (const char* input : {"qfrc_applied", "xfrc_applied"}) own.add(input);
  if (model.get()->nmocap > 0) own.add("mocap_pos");
  return own;
}

// Of rows in usual states, those that lanes may leave to MuJoCo: one of so many
struct Leavable {
  int of_shared = 20;  // of rows that share the model
  int of_own = 2;      // of rows with values of their own
};

std::string compare(const std::shared_ptr<const Model>& model, int width, lanes::Stepper& stepper, const OwnArrays& own,
                    int rows, Leavable leavable) {
  // In turns, no more of mjData is read than after every step, all of it, or forces; and the same of the new state.
  constexpr std::size_t kKinds = 6;
  static std::size_t turn = 0;
  std::array<std::vector<std::unique_ptr<Work>>, kKinds> works;
  for (std::size_t kind = 0; kind < kKinds; ++kind)
    for (int i = 0; i < width; ++i) {
      works[kind].push_back(std::make_unique<Work>(model));
      if (kind % 3 == 1) works[kind].back()->expect("qM");
      if (kind % 3 == 2) works[kind].back()->expect("cfrc_ext");
      if (kind >= 3) works[kind].back()->keep_current();
    }
  Work plain(model), plain_current(model);
  plain_current.keep_current();
  plain_current.expect("cfrc_ext");  // so that its steps compute the forces
  Noise noise;
  const bool are_shared = own.list().empty();
  for (const auto& [kind, name] : {std::pair{Kind::at_rest, "at rest"},
                                   {Kind::tame, "tame"},
                                   {Kind::odd, "odd"},
                                   {Kind::fast, "fast"},
                                   {Kind::bad, "bad"}}) {
    Counts counts;
    for (int round = 0; round < rows / share / width; ++round) {
      const std::size_t use = turn++ % kKinds;
      const bool is_current = use >= 3;
      const std::string found = compare(*model, stepper, works[use], is_current ? plain_current : plain, own, kind,
                                        1 + static_cast<int>(noise.below(3)), noise, counts);
      if (!found.empty())
        return found + (is_current ? ", of the new state," : "") + " with " + std::to_string(width) + " lanes, round " +
               std::to_string(round) + " of states " + name + (are_shared ? "" : " of rows with values of their own");
    }
    std::printf("%s, %d lanes, %s%s: %d rows, %d left to MuJoCo, %d contacts, %d constraints\n", model->label().c_str(),
                width, name, are_shared ? "" : ", own values", counts.rows, counts.left, counts.contacts,
                counts.constraints);
    // A fifth of the rows is too few to say how many are usual.
    const int left_of = are_shared ? leavable.of_shared : leavable.of_own;
    if (share == 1 && kind < Kind::odd && counts.left > counts.rows / left_of)
      return "lanes leave too many rows to MuJoCo";
  }
  return "";
}

// How often constraints were made in lanes, and how often those of contacts were.
int made, made_of_contacts;
// How many rows Newton's solver has left to MuJoCo.
int left_by_solver;
const lanes::Code* counted;

void count_making(lanes::Lanes& d, const lanes::Contacts& contacts, lanes::Constraints& c) {
  ++made;
  made_of_contacts += contacts.contact_count > 0;
  counted->makeConstraint(d, contacts, c);
}

void count_leaving(lanes::Lanes& d, lanes::Constraints& c) {
  const unsigned before = d.left_to_mujoco;
  counted->solNewton(d, c);
  for (unsigned left = d.left_to_mujoco & ~before; left; left &= left - 1) ++left_by_solver;
}

// Rows that share the model, rows with values of their own, some of them with frames of their own, and again rows that share
// it, on one stepper.
std::string compare(const std::shared_ptr<const Model>& model, int rows = kRows, Leavable leavable = {}) {
  const ErrorTrap trap;
  const OwnArrays shared(*model), own = own_arrays(*model, false), placed = own_arrays(*model, true);
  made = made_of_contacts = left_by_solver = 0;
  for (const int width : lanes::widths()) {
    counted = lanes::code_of(width);
    lanes::Code code = *counted;
    code.makeConstraint = count_making;
    code.solNewton = count_leaving;
    const auto stepper = lanes::make_stepper(*model, code);
    for (const OwnArrays* arrays : {&shared, &own, &placed, &shared}) {
      const std::string found = compare(model, width, *stepper, *arrays, rows, leavable);
      if (!found.empty()) return found;
    }
  }
  return "";
}

std::string failures;

void test_built_in(void** /*state*/) {
  assert_true(!lanes::widths().empty());
  failures.clear();
  for (std::size_t i = 0; i < asset_count; ++i) {
    const auto model = Model::open(assets[i].name);
    assert_string_equal(lanes::obstacle(*model).c_str(), "");
    const std::string found = compare(model);
    if (!found.empty()) failures += std::string(assets[i].name) + ": " + found + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

std::string with(const std::string& from, const std::string& to, std::string text) {
  return text.replace(text.find(from), from.size(), to);
}

std::string without(const std::string& word, std::string text) {
  for (std::size_t at; (at = text.find(word)) != std::string::npos;)
    text.erase(at, text.find('"', at + word.size()) + 1 - at);
  return text;
}

// What the robots lack: MuJoCo's search for pairs of geoms beside their list, both integrators, other options.
// Lanes solve constraints only if joints and tendons have no friction, and only with two solvers and one kind of cone.
void test_odd(void** /*state*/) {
  failures.clear();
  const std::string text = odd_model("lanes.xml");
  // With these affinities, geoms touch the floor alone, so their pairs can be listed.
  const std::string listed = with("<worldbody>", "<default><geom conaffinity=\"0\"/></default><worldbody>", text);
  const std::string smooth = without(" frictionloss=\"", text), smooth_listed = without(" frictionloss=\"", listed);
  // Zeros that are negative in axes alone, in positions alone, and nowhere.
  const std::string of_axes = with("pos=\"0.02 -0 0.01\"", "pos=\"0.02 0 0.01\"", smooth_listed);
  const auto without_axes = [](const std::string& from) {
    return with("axis=\"1 -0 0\"", "axis=\"1 0 0\"", with("axis=\"-0 0 1\"", "axis=\"0 0 1\"", from));
  };
  const std::string thin = with("density=\"30\" ", "", smooth_listed),
                    slick = with("viscosity=\"0.2\" ", "", smooth_listed);
  const std::string of_positions = without_axes(smooth_listed), of_none = without_axes(of_axes);
  const std::vector<std::string> one{"<option"}, few{"<option", "<option integrator=\"RK4\"", "<option solver=\"PGS\""},
      all{"<option",
          "<option integrator=\"RK4\"",
          "<option solver=\"PGS\"",
          "<option iterations=\"2\"",
          "<option iterations=\"1\"",
          "<option iterations=\"0\"",
          "<option iterations=\"-1\"",
          "<option tolerance=\"0\"",
          "<option impratio=\"3\"",
          "<option solver=\"PGS\" iterations=\"2\"",
          "<option solver=\"PGS\" iterations=\"0\"",
          "<option solver=\"PGS\" iterations=\"-1\" tolerance=\"0\"",
          "<option cone=\"elliptic\"",
          "<option noslip_iterations=\"3\"",
          "<option><flag gravity=\"disable\"/></option><option",
          "<option><flag clampctrl=\"disable\"/></option><option",
          "<option><flag constraint=\"disable\"/></option><option",
          "<option><flag warmstart=\"disable\"/></option><option",
          "<option solver=\"CG\""};
  for (const auto& [base, options] : {std::pair{&text, &few},
                                      {&listed, &few},
                                      {&smooth, &few},
                                      {&smooth_listed, &all},
                                      {&of_axes, &one},
                                      {&of_positions, &one},
                                      {&of_none, &one},
                                      {&thin, &one},
                                      {&slick, &one}})
    for (const std::string& option : *options) {
      const auto model = Model::parse("lanes.xml", with("<option", option, *base));
      assert_string_equal(lanes::obstacle(*model).c_str(), "");
      assert_int_equal(model->pairs() != nullptr, base != &text && base != &smooth);
      const std::string found = compare(model);
      if (!found.empty()) failures += option + ": " + found + "\n";
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

std::string in_front_of_body(const std::string& what, const std::string& text) {
  return with("<worldbody>", what + "<worldbody>", text);
}

// Sensors and energies, which MuJoCo's functions compute row by row; mocap bodies, equality constraints, friction; and contacts
// of all shapes, also of moving bodies with each other.
void test_stages(void** /*state*/) {
  const std::string quadruped = odd_model("quadruped.xml");
  const std::string touching =
      with("<clock/>", "<clock/><touch site='fl'/><force site='fr'/><jointlimitfrc joint='fl3'/>", quadruped);
  const std::string lanes = odd_model("lanes.xml");
  const std::string actuated = with("</actuator>",
                                    "<motor site='tip' refsite='base' gear='1 0 2 0 0.1 0'/>"
                                    "<general joint='x' dyntype='integrator' actlimited='true' actrange='0 0.8'/>"
                                    "<muscle joint='knee' lengthrange='-1 1'/></actuator>",
                                    with("<site name=\"tip\"", "<site name=\"base\"/><site name=\"tip\"", lanes));
  const std::string passive = with("type=\"ellipsoid\"", "type=\"ellipsoid\" fluidshape=\"ellipsoid\"",
                                   with("<joint type=\"ball\"", "<joint type=\"ball\" stiffness=\"2\"", lanes));
  const std::string disabled =
      with("<option", "<option><flag passive=\"disable\" actuation=\"disable\"/></option><option", lanes);
  const struct {
    const char* name;
    std::string text;
    bool are_made;  // whether lanes make the constraints
  } models[] = {{"quadruped.xml", quadruped, true},
                {"quadruped.xml, touch", touching, true},
                {"shapes.xml", odd_model("shapes.xml"), true},
                {"sensors.xml", odd_model("sensors.xml"), true},
                {"mocap.xml", odd_model("mocap.xml"), false},
                {"tendons.xml", odd_model("tendons.xml"), true},
                {"terrain.xml", odd_model("terrain.xml"), false},
                {"lanes.xml, actuators", actuated, true},
                {"lanes.xml, passive", passive, true},
                {"lanes.xml, disabled", disabled, true},
                {"tethered_pair.xml", odd_model("tethered_pair.xml"), true},
                {"equalities.xml", odd_model("equalities.xml"), true},
                {"actuators.xml", odd_model("actuators.xml"), true},
                {"sensing.xml", odd_model("sensing.xml"), true}};
  failures.clear();
  for (const auto& m : models)
    for (const char* option :
         {"", "<option solver='PGS'/>", "<option integrator='RK4'><flag energy='enable'/></option>",
          "<option solver='CG'/>", "<option solver='CG' cone='elliptic' iterations='30'/>",
          "<option solver='PGS' cone='elliptic' noslip_iterations='2'/>", "<option integrator='implicit'/>",
          "<option integrator='implicit' jacobian='sparse'/>", "<option solver='Newton' cone='pyramidal'/>",
          "<option solver='Newton' cone='elliptic'/>",
          "<option><flag equality='disable' frictionloss='disable' warmstart='disable' "
          "sensor='disable'/></option>"}) {
      const auto model = Model::parse(m.name, in_front_of_body(option, m.text));
      assert_string_equal(lanes::obstacle(*model).c_str(), "");
      const std::string found = compare(model, kFewRows), which = std::string(m.name) + ", " + option + ": ";
      if (!found.empty()) failures += which + found + "\n";
      if (m.are_made && made == 0 && !mj_isSparse(model->get())) failures += which + "no constraints made in lanes\n";
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Fluids that act on bodies as on boxes and as on ellipsoids, with and without density, viscosity and wind
void test_fluids(void** /*state*/) {
  failures.clear();
  for (const char* option :
       {"", "<option density='0'/>", "<option viscosity='0'/>", "<option density='0' viscosity='0'/>",
        "<option density='-5'/>", "<option viscosity='-0.3'/>", "<option wind='0 0 0' integrator='RK4'/>",
        "<option><flag passive='disable'/></option>"}) {
    const auto model = Model::parse("fluids.xml", in_front_of_body(option, odd_model("fluids.xml")));
    const std::string found = compare(model, kFewRows);
    if (!found.empty()) failures += option + (": " + found) + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Limits and contacts of all kinds, with each solver
void test_contacts(void** /*state*/) {
  const struct {
    std::string from, to;
    bool are_made;
    const char* cone = "pyramidal";
  } cases[] = {
      {"", "", true},
      {"<option", "<option integrator=\"RK4\"", true},
      {"<option", "<option impratio=\"3\"", true},
      {"<option", "<option jacobian=\"dense\" iterations=\"1\"", true},
      {"<option", "<option tolerance=\"0\" iterations=\"20\"", true},
      {"<geom conaffinity", "<geom condim=\"1\" conaffinity", true},
      {"<geom conaffinity", "<geom condim=\"4\" conaffinity", true},
      {"<geom conaffinity", "<geom condim=\"6\" conaffinity", true},
      {"<geom conaffinity", "<geom margin=\"0.05\" gap=\"0.03\" conaffinity", true},
      {"<geom conaffinity", "<geom solref=\"-500 -20\" conaffinity", true},
      {"<geom conaffinity", "<geom solref=\"0.005 1\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0.8 0.95 0.02 0.3 3\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0.8 0.95 0.02 0.7 1\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0.9 0.9 0.02\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0.8 0.9 0\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0 1 0.02 0 2\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0 0.9 0.02 1 2\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0.8 0.95 0.02 0.5 0.5\" conaffinity", true},
      {"<geom conaffinity", "<geom solref=\"0.02 -1\" conaffinity", false},
      {"friction=\"0.8", "friction=\"0", true},
      {"name=\"other\" type=\"sphere\" size=\"0.1\"", "type=\"box\" size=\"0.1 0.1 0.1\"", true},
      {"name=\"x\"", "name=\"x\" frictionloss=\"0.1\"", true},
      {"type=\"ball\"", "type=\"ball\" limited=\"true\" range=\"0 10\"", true},
      {"<option", "<option collision=\"dynamic\"><flag limit=\"disable\"/></option><option", true},
      {"<option", "<option><flag refsafe=\"disable\"/></option><option", true},
      {"<option", "<option><flag contact=\"disable\"/></option><option", false},
      {"<option", "<option cone=\"elliptic\"", true},
      {"<option", "<option cone=\"elliptic\" impratio=\"100\" integrator=\"RK4\"", true},
      {"<option", "<option cone=\"elliptic\" iterations=\"2\"><flag refsafe=\"disable\"/></option><option", true},
      {"<geom conaffinity", "<geom condim=\"1\" conaffinity", true, "elliptic"},
      {"<geom conaffinity", "<geom condim=\"4\" conaffinity", true, "elliptic"},
      {"<geom conaffinity", "<geom condim=\"6\" conaffinity", true, "elliptic"},
      {"<geom conaffinity", "<geom margin=\"0.05\" gap=\"0.03\" condim=\"6\" conaffinity", true, "elliptic"},
      {"friction=\"0.8", "friction=\"0", true, "elliptic"},
      {"name=\"x\"", "name=\"x\" frictionloss=\"0.1\"", true, "elliptic"},
      {"<option", "<size nconmax=\"3\"/><option", true},
      {"<option", "<size njmax=\"12\"/><option", true}};
  failures.clear();
  for (const auto& c : cases)
    for (const char* solver : {"Newton", "PGS", "CG"}) {
      const bool is_elliptic = c.cone == std::string("elliptic") || c.to.find("elliptic") != std::string::npos;
      const std::string cone = std::string("<option cone=\"") + (is_elliptic ? "elliptic" : "pyramidal") + "\"/>";
      const std::string text = in_front_of_body(
          cone, with("<option", std::string("<option solver=\"") + solver + '"', odd_model("contacts.xml")));
      const auto model = Model::parse("contacts.xml", with(c.from, c.to, text));
      assert_string_equal(lanes::obstacle(*model).c_str(), "");
      const std::string found = compare(model, kFewRows);
      if (!found.empty()) failures += std::string(solver) + ", " + c.to + ": " + found + "\n";
      if ((made_of_contacts > 0) != c.are_made)
        failures +=
            std::string(solver) + ", " + c.to + ": made in lanes " + std::to_string(made_of_contacts) + " times\n";
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Parameters of contacts at which MuJoCo's comparisons change their result; and no room for constraints. The ball
// touches the floor so slightly that accelerations stay finite even if the contact is very stiff.
void test_parameters_at_limits(void** /*state*/) {
  const struct {
    const char *attribute, *size;
    bool are_made;
  } cases[] = {{"solimp='0.8 0.9 1e-15'", "", true}, {"solref='0 0'", "", true}, {"", "<size njmax='0'/>", false}};
  for (const auto& c : cases) {
    const auto model = Model::parse("ball", std::string("<mujoco>") + c.size + "<default><geom " + c.attribute +
                                                "/></default><worldbody><geom type='plane' size='1 1 1'/>"
                                                "<body pos='0 0 0.0999999999'><freejoint/><geom size='0.1'/></body>"
                                                "</worldbody></mujoco>");
    assert_string_equal(compare(model, kFewRows).c_str(), "");
    assert_int_equal(made_of_contacts > 0, c.are_made);
  }
}

// After each main solver, noslip finds other forces of dry friction and of both kinds of cones.
void test_noslip(void** /*state*/) {
  const std::string contacts = with("name=\"x\"", "name=\"x\" frictionloss=\"0.1\"", odd_model("contacts.xml"));
  failures.clear();
  for (const char* solver : {"Newton", "PGS", "CG"})
    for (const char* cone : {"pyramidal", "elliptic"})
      for (const auto& [other, dim] : {std::pair{"noslip_iterations='3'", "1"},
                                       {"noslip_iterations='3'", "3"},
                                       {"noslip_iterations='3'", "4"},
                                       {"noslip_iterations='3'", "6"},
                                       {"noslip_iterations='20' noslip_tolerance='1e-3' impratio='5'", "3"}}) {
        const std::string option = std::string("<option solver='") + solver + "' cone='" + cone + "' " + other + "/>";
        const std::string text =
            with("<geom conaffinity", std::string("<geom condim=\"") + dim + "\" conaffinity", contacts);
        const std::string found = compare(Model::parse("contacts.xml", in_front_of_body(option, text)), kFewRows);
        if (!found.empty()) failures += option + ", condim " + dim + ": " + found + "\n";
        if (made_of_contacts == 0) failures += option + ", condim " + dim + ": no contacts made in lanes\n";
      }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Actuators whose moments depend on contacts, also on those in the gap
void test_adhesion(void** /*state*/) {
  const std::string sticky =
      with("</mujoco>",
           "<actuator><adhesion body='ball' ctrlrange='0 3' gain='20'/><motor joint='knee' gear='2'/>"
           "<adhesion body='leg' ctrlrange='0 1' gain='50' forcelimited='true' forcerange='0 30'/></actuator></mujoco>",
           with("<body pos=\"0.3 0.1 0.3\">", "<body name='ball' pos='0.3 0.1 0.3'>",
                with("<body pos=\"0.3 0 0\">", "<body name='leg' pos='0.3 0 0'>", odd_model("contacts.xml"))));
  failures.clear();
  for (const char* option :
       {"<option/>", "<option cone='elliptic' integrator='RK4'/>", "<option solver='PGS' integrator='implicit'/>",
        "<option noslip_iterations='2'/>", "<option collision='dynamic'><flag actuation='disable'/></option>"}) {
    const auto model = Model::parse("contacts.xml", in_front_of_body(option, sticky));
    assert_string_equal(lanes::obstacle(*model).c_str(), "");
    const std::string found = compare(model, kFewRows);
    if (!found.empty()) failures += option + (": " + found) + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Masses and forces at which MuJoCo's solvers clamp numbers. Balls with these masses slide on the floor, which those at a
// height of 0.1 touch.
void test_clamped_numbers(void** /*state*/) {
  struct Ball {
    const char *mass, *armature, *friction, *height;
  };
  const std::vector<Ball> heavy{
      {"4e9", "7e9", "0.1", "0.099"}, {"1e6", "0", "0", "0.09"}, {"4e9", "7e9", "0.1", "0.0999"}},
      touching{{"1", "0", "1", "0.09999999999999998"},
               {"0.01", "0", "1", "0.09999999999999999"},
               {"1", "0", "1", "0.0999999999"},
               {"1", "0", "1", "0.0999999999999"}};
  const auto text = [](const std::string& option, const std::vector<Ball>& balls, const std::string& more) {
    std::string bodies;
    for (std::size_t i = 0; i < balls.size(); ++i) {
      const Ball& ball = balls[i];
      bodies += "<body pos='" + std::to_string(i) + " 0 " + ball.height + "'>";
      for (const char* axis : {"1 0 0", "0 1 0", "0 0 1"})
        bodies += std::string("<joint type='slide' axis='") + axis + "' armature='" + ball.armature + "'/>";
      bodies += std::string("<geom size='0.1' mass='") + ball.mass + "' friction='" + ball.friction + "'/></body>";
    }
    return "<mujoco>" + option + "<default><geom conaffinity='0'/></default><worldbody>" +
           "<geom type='plane' size='9 9 1' conaffinity='1' friction='0'/>" + bodies + more + "</worldbody></mujoco>";
  };
  // The runner that comes second is deeper in the floor, so in the end it carries the sledge alone.
  const std::string sledge =
      "<body pos='0 5 0.099'><freejoint/><inertial pos='0 0 0' mass='1' diaginertia='.1 .1 .1'/>"
      "<geom size='0.1' pos='-.05 0 0'/><geom size='0.1' pos='.05 0 -.01'/></body>";
  const std::string flywheel =
      "<body><joint frictionloss='5e9'/><inertial pos='2000 .001 0' mass='4e9' diaginertia='1 1 1'/></body>";
  failures.clear();
  for (const char* cone : {"pyramidal", "elliptic"})
    for (const char* solver :
         {"PGS", "PGS' noslip_iterations='3", "CG' noslip_iterations='3", "Newton' noslip_iterations='3"}) {
      const std::string option =
          std::string("<option jacobian='dense' iterations='3' cone='") + cone + "' solver='" + solver + "'";
      for (const auto& [name, model] : {std::pair{"heavy", text(option + " gravity='6 1 -9.8'/>", heavy, "")},
                                        {"flywheel", text(option + " gravity='3 0 0'/>", {}, flywheel)},
                                        {"touching", text(option + " gravity='3 0 0'/>", touching, sledge)}}) {
        // The masses are near MuJoCo's limit, so that others may be beyond it.
        const std::string found = compare(Model::parse(name, model), 16 * share, {20, 1});
        if (!found.empty()) failures += name + (", " + option) + ": " + found + "\n";
      }
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// The range of a ball is the greater of two numbers, of which XML can only set the second.
void test_range_of_ball(void** /*state*/) {
  const auto model = Model::parse("contacts.xml", with("type=\"ball\"", "type=\"ball\" limited=\"true\" range=\"0 10\"",
                                                       odd_model("contacts.xml")));
  const mjModel& m = *model->get();
  const int* const ball = std::find(m.jnt_type, m.jnt_type + m.njnt, mjJNT_BALL);
  m.jnt_range[2 * (ball - m.jnt_type)] = 0.5;  // the model's memory is not constant
  assert_string_equal(compare(model, kFewRows).c_str(), "");
}

// Tendons that wrap around a sphere and a cylinder, at a site beside the geom, and inside of it, where they have no
// length; and behind a pulley. One of the side sites is the first site.
void test_wraps(void** /*state*/) {
  const auto model = Model::parse("wraps", R"(<mujoco><default><geom contype='0' conaffinity='0'/></default><worldbody>
    <site name='in_ball'/><site name='start' pos='-0.3 0 0.3'/>
    <geom name='ball' type='sphere' size='0.1'/><site name='above' pos='0 0 0.3'/>
    <geom name='drum' type='cylinder' size='0.08 0.5' euler='90 0 0' pos='0 0 -0.5'/>
    <site name='in_drum' pos='0.02 0 -0.5'/><site name='below' pos='0 0 -0.9'/>
    <body pos='0.3 0 0.3'><joint type='slide' axis='0 0 1'/><joint axis='0 1 0'/><geom size='0.05'/>
    <site name='end' pos='0.1 0 -0.1'/></body></worldbody>
    <tendon>
    <spatial stiffness='1'><site site='start'/><geom geom='ball' sidesite='in_ball'/><site site='end'/></spatial>
    <spatial damping='1'><site site='start'/><geom geom='ball' sidesite='above'/><site site='end'/></spatial>
    <spatial stiffness='1'><site site='start'/><geom geom='drum' sidesite='in_drum'/><site site='end'/></spatial>
    <spatial damping='1'><site site='start'/><geom geom='drum' sidesite='below'/><site site='end'/></spatial>
    <spatial stiffness='2'><site site='start'/><site site='end'/><pulley divisor='2'/>
    <site site='start'/><geom geom='drum' sidesite='below'/><site site='end'/></spatial>
    </tendon></mujoco>)");
  assert_string_equal(compare(model, kFewRows).c_str(), "");
}

// A damped tendon that touches a ball in some rows alone. Only there does its sparse Jacobian have elements for the
// ball's joint.
void test_sparse_wraps(void** /*state*/) {
  const auto model = Model::parse("sparse wraps", R"(<mujoco><option jacobian='sparse' integrator='implicit'/>
    <default><geom contype='0' conaffinity='0'/></default><worldbody><site name='start' pos='-0.3 0 0.1'/>
    <body><joint type='slide' axis='0 0 1'/><geom name='ball' size='0.1'/></body>
    <body pos='0.3 0 0.1'><joint type='slide' axis='0 0 1'/><joint axis='0 1 0'/><geom size='0.05'/>
    <site name='end' pos='0.1 0 -0.1'/></body></worldbody>
    <tendon><spatial damping='1'><site site='start'/><geom geom='ball'/><site site='end'/></spatial></tendon>
    </mujoco>)");
  assert_string_equal(compare(model, kFewRows).c_str(), "");
}

// Sparse Jacobians, with and without equality constraints, by each solver that lanes have for them. In the pairs of contacts.xml,
// each shape and kind of friction touches the world.
void test_sparse(void** /*state*/) {
  const std::string text = odd_model("sparse.xml"),
                    contacts = with("<option", "<option jacobian=\"sparse\"", odd_model("contacts.xml"));
  const std::string free = with("<option", "<option><flag equality=\"disable\"/></option><option", text);
  // MuJoCo makes no constraint of a contact that no dof moves.
  const std::string unmoved = with("</worldbody>",
                                   "<geom name='sunk' size='0.1' pos='2 2 0'/></worldbody>"
                                   "<contact><pair geom1='floor' geom2='sunk'/></contact>",
                                   text);
  // A joint that depends on the first joint, and a joint that is held alone
  const std::string coupled = R"(<mujoco><option jacobian='sparse'/><worldbody><geom type='plane' size='5 5 1'/>
    <body pos='0 0 0.1'><joint name='first' axis='0 1 0'/><geom size='0.1' pos='0.2 0 0'/>
    <body pos='0.2 0 0'><joint name='second' axis='1 0 0'/><geom size='0.1' pos='0.1 0.1 0'/></body></body>
    <body pos='2 0 0.1'><joint name='third' axis='0 1 0'/><geom size='0.1' pos='0.2 0 0'/></body></worldbody>
    <equality><joint joint1='second' joint2='first' polycoef='0.1 0.5 0.1 0 0'/>
    <joint joint1='third'/></equality></mujoco>)";
  const struct {
    const char* name;
    const std::string& text;
    std::vector<const char*> options;
    bool are_made = true;
  } cases[] = {{"sparse.xml",
                text,
                {"", "<option solver='CG'/>", "<option cone='elliptic'/>", "<option solver='CG' cone='elliptic'/>"}},
               {"sparse.xml without equality",
                free,
                {"", "<option cone='elliptic' impratio='10'/>", "<option integrator='RK4' iterations='3'/>",
                 "<option><flag warmstart='disable' frictionloss='disable' limit='disable'/></option>"}},
               {"contacts.xml", contacts, {"", "<option solver='CG'/>", "<option cone='elliptic'/>"}},
               {"coupled joints", coupled, {"", "<option solver='CG'/>"}},
               {"sparse.xml with a contact of the world", unmoved, {""}, false}};
  failures.clear();
  for (const auto& c : cases)
    for (const char* option : c.options) {
      const auto model = Model::parse(c.name, in_front_of_body(option, c.text));
      assert_true(mj_isSparse(model->get()));
      const std::string found = compare(model, kFewRows), which = std::string(c.name) + ", " + option + ": ";
      if (!found.empty()) failures += which + found + "\n";
      if ((made_of_contacts > 0) != c.are_made)
        failures += which + "made in lanes " + std::to_string(made_of_contacts) + " times\n";
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// At 60 dofs MuJoCo's own choice is sparse matrices.
void test_many_dofs(void** /*state*/) {
  std::string bodies;
  for (int i = 0; i < 11; ++i)
    bodies += "<body pos='" + std::to_string(i) +
              " 0 0.2'><freejoint/><geom type='capsule' size='0.1 0.2' conaffinity='0'/>" +
              (i % 4 ? "" : "<body pos='0 0 0.3'><joint axis='0 1 0'/><geom size='0.1' conaffinity='0'/></body>") +
              "</body>";
  failures.clear();
  for (const char* option : {"", "solver='PGS'", "integrator='RK4'"})
    for (const bool is_dense : {true, false}) {
      const auto model = Model::parse(
          "many dofs", std::string("<mujoco><option ") + option + (is_dense ? " jacobian='dense'" : "") +
                           "/><worldbody><geom type='plane' size='9 9 1'/>" + bodies + "</worldbody></mujoco>");
      assert_true(model->get()->nv >= 60);
      const std::string found = compare(model, kFewRows);
      if (!found.empty()) failures += option + (": " + found) + "\n";
      assert_int_equal(made_of_contacts > 0, is_dense || std::string(option) != "solver='PGS'");
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// mju_cholUpdate, with random signs and vectors so long that some matrices lose rank
void test_rank_loss(void** /*state*/) {
  constexpr int n = 7;
  Noise noise;
  int lost = 0;
  for (int round = 0; round < 3000; ++round) {
    double want[lanes::kWidth][n * n], x[lanes::kWidth][n];
    alignas(lanes::V) double mat[n * n * lanes::kWidth], vec[n * lanes::kWidth];
    unsigned plus = 0, ranks = 0;
    for (int lane = 0; lane < lanes::kWidth; ++lane) {
      for (double& number : want[lane]) number = noise();
      for (int i = 0; i < n; ++i) want[lane][i * n + i] = 1 + noise.below(3) / 2.0;
      // A column of the matrix removes as much as its diagonal has.
      const auto column = noise.below(n);
      for (int i = 0; i < n; ++i)
        x[lane][i] = noise.below(3) ? noise() : noise.below(2) ? 0 : want[lane][i * n + column];
      for (int i = 0; i < n * n; ++i) mat[i * lanes::kWidth + lane] = want[lane][i];
      for (int i = 0; i < n; ++i) vec[i * lanes::kWidth + lane] = x[lane][i];
      const bool is_plus = noise.below(2) == 0;
      plus |= static_cast<unsigned>(is_plus) << lane;
      ranks |= static_cast<unsigned>(mju_cholUpdate(want[lane], x[lane], n, is_plus) < n) << lane;
    }
    const unsigned found = lanes::cholUpdate(lanes::vectors(mat), lanes::vectors(vec), n, lanes::mask_of(plus));
    assert_int_equal(found, ranks);
    for (int lane = 0; lane < lanes::kWidth; ++lane) {
      lost += ranks >> lane & 1;
      for (int i = 0; i < n * n; ++i)
        assert_memory_equal(&mat[i * lanes::kWidth + lane], &want[lane][i], sizeof(double));
    }
  }
  assert_in_range(lost, 1000, 5000);
}

// Random sparse matrices as Newton's solver has them, in lanes with different constraints, against MuJoCo's functions: J' * D *
// J + M, its Cholesky factor, solutions, and rank-one updates by a constraint. Many numbers are zeros of both signs.
class SparseMatrices {
 public:
  int lost = 0, mixed = 0;  // how many matrices lost rank, and how many rows differed between lanes

  void compare() {
    make_constraints();
    find_sums();
    lanes::SparseFactor factor(c_, n_, H_);
    factor.find_pattern();
    factor.clear();
    for (int r = 0; r < n_; ++r)
      for (int c = 0; c <= r; ++c)
        if (is_listed(r, c))
          for (int lane = 0; lane < kWidth; ++lane) at(H_, r * n_ + c, lane) = sums_[lane][r * n_ + c];
    factor.addM(m_, lanes::vectors(qM_));
    assert_same();
    const unsigned ranks = factor.factor();
    for (int lane = 0; lane < kWidth; ++lane) {
      Matrix& want = want_[lane];
      const int rank = mju_cholFactorSparse(want.numbers, n_, mjMINVAL, want.nnz, want.adr, want.columns, d_);
      assert_int_equal(ranks >> lane & 1, rank < n_);
    }
    for (int r = 0; r < n_; ++r) mixed += is_mixed_[r];
    // Without full rank, numbers may overflow, and the sign of NaN is undefined.
    if (ranks != 0) return;
    assert_same();
    for (int round = 0; round < 3; ++round) {
      solve(factor);
      if (!update(factor)) return;
      assert_same();
    }
  }

 private:
  static constexpr int kWidth = lanes::kWidth, n_ = 13, kMost = 9;
  struct Matrix {
    mjtNum numbers[n_ * n_];
    int nnz[n_], adr[n_], columns[n_ * n_];
  };
  const std::shared_ptr<const Model> model_ = Model::parse("tree", R"(<mujoco><worldbody>
    <body><joint/><geom size='.1'/><body><joint axis='0 1 0'/><joint axis='1 0 0'/><geom size='.1'/>
      <body><joint/><geom size='.1'/><body><joint/><geom size='.1'/></body></body>
      <body><joint type='ball'/><geom size='.1'/><body><joint/><geom size='.1'/></body></body></body></body>
    <body><joint axis='0 1 0'/><geom size='.1'/></body>
    <body><joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 1 0'/><joint type='slide'/><geom size='.1'/></body>
    </worldbody></mujoco>)");
  Work work_{model_};
  const mjModel& m_ = *model_->get();
  mjData* const d_ = work_.data();
  Noise noise_;
  lanes::Constraints c_{};
  alignas(lanes::V) double J_[kMost * n_ * kWidth]{}, H_[n_ * n_ * kWidth]{}, qM_[n_ * n_ * kWidth]{},
      x_[n_ * kWidth]{}, products_[2 * n_ * kWidth]{}, solution_[n_ * kWidth]{};
  unsigned char of_M_[n_ * n_]{}, of_J_[n_ * n_]{}, filled_[n_ * n_]{}, is_changed_[n_]{}, is_mixed_[n_]{},
      vector_[n_]{}, holders_[kMost]{}, couples_[kMost]{}, product_lanes_[n_]{};
  int columns_[n_ * n_]{}, counts_[n_]{}, chains_[kMost * n_]{}, chain_counts_[kMost]{}, places_[n_ * kMost]{},
      place_counts_[n_]{};
  double D_[kMost]{}, sums_[kWidth][n_ * n_]{};
  Matrix want_[kWidth]{};

  static double& at(double* numbers, int i, int lane) { return numbers[i * kWidth + lane]; }
  double number() { return noise_.below(3) ? noise_() : noise_.odd() * 0; }
  bool is_listed(int r, int c) const {
    return r == c || std::count(columns_ + r * n_, columns_ + r * n_ + counts_[r], c) > 0;
  }

 public:
  SparseMatrices() {
    assert_int_equal(m_.nv, n_);
    assert_true(m_.dof_simplenum[n_ - 1] > 0);
    for (int i = 0; i < n_; ++i)
      for (int j = i; j >= 0; j = m_.dof_simplenum[i] ? -1 : m_.dof_parentid[j]) of_M_[i * n_ + j] = 255;
    std::fill_n(is_changed_, n_, 1);
    c_.J = J_;
    c_.columns = chains_;
    c_.column_counts = chain_counts_;
    c_.holders = holders_;
    c_.couples = couples_;
    c_.product_lanes = product_lanes_;
    c_.products = products_;
    c_.most_places = kMost;
    c_.dof_places = places_;
    c_.dof_place_counts = place_counts_;
    c_.pattern = {of_M_, of_J_, filled_, columns_, counts_, is_changed_, is_mixed_, vector_};
  }

 private:
  // Constraints between two dofs and what moves them; a few in each lane.
  void make_constraints() {
    c_.size = static_cast<int>(noise_.below(kMost + 1));
    std::fill_n(place_counts_, n_, 0);
    for (int i = 0; i < c_.size; ++i) {
      holders_[i] = static_cast<unsigned char>(1 + noise_.below((1U << kWidth) - 1));
      couples_[i] = 1;
      D_[i] = noise_.below(3) ? 1 + noise_() : 0;
      bool has[n_]{};
      for (int end = 0; end < 2; ++end)
        for (int dof = static_cast<int>(noise_.below(n_)); dof >= 0; dof = m_.dof_parentid[dof]) has[dof] = true;
      chain_counts_[i] = 0;
      for (int k = 0; k < n_; ++k) {
        for (int lane = 0; lane < kWidth; ++lane)
          at(J_, i * n_ + k, lane) = holders_[i] >> lane & 1 && has[k] ? number() : 0;
        if (!has[k]) continue;
        chains_[i * n_ + chain_counts_[i]++] = k;
        places_[k * kMost + place_counts_[k]++] = i;
      }
    }
    const double least = noise_.below(4) ? 6 : 0;  // of the diagonal of M
    for (int i = 0; i < n_; ++i) {
      int adr = m_.dof_Madr[i];
      for (int j = i; j >= 0; j = m_.dof_simplenum[i] ? -1 : m_.dof_parentid[j], ++adr)
        for (int lane = 0; lane < kWidth; ++lane)
          at(qM_, adr, lane) = i == j ? least + 0.1 + std::fabs(noise_()) : number();
    }
  }

  // MuJoCo's J' * D * J + M, and the sums J' * D * J
  void find_sums() {
    for (int lane = 0; lane < kWidth; ++lane) {
      mjtNum J[kMost * n_], JT[kMost * n_], D[kMost];
      int nnz[kMost], adr[kMost], colind[kMost * n_], super[kMost], nnzT[n_], adrT[n_], colindT[kMost * n_], superT[n_];
      int rows = 0, next = 0;
      std::fill_n(sums_[lane], n_ * n_, 0.0);
      for (int i = 0; i < c_.size; ++i) {
        if (!(holders_[i] >> lane & 1)) continue;
        adr[rows] = next;
        nnz[rows] = chain_counts_[i];
        for (int k = 0; k < chain_counts_[i]; ++k) {
          colind[next] = chains_[i * n_ + k];
          J[next++] = at(J_, i * n_ + chains_[i * n_ + k], lane);
        }
        D[rows++] = D_[i];
        for (int r = 0; r < n_; ++r)
          for (int c = 0; c <= r; ++c)
            sums_[lane][r * n_ + c] += at(J_, i * n_ + r, lane) * D_[i] * at(J_, i * n_ + c, lane);
      }
      Matrix& want = want_[lane];
      if (rows > 0) {
        mju_transposeSparse(JT, J, rows, n_, nnzT, adrT, colindT, nnz, adr, colind);
        mju_superSparse(rows, super, nnz, adr, colind);
        mju_superSparse(n_, superT, nnzT, adrT, colindT);
        mju_sqrMatTDSparse(want.numbers, J, JT, D, rows, n_, want.nnz, want.adr, want.columns, nnz, adr, colind, super,
                           nnzT, adrT, colindT, superT, d_);
      } else {
        for (int r = 0; r < n_; ++r) want.nnz[r] = 0, want.adr[r] = r * n_;
      }
      for (int i = 0; i < m_.nM; ++i) d_->qM[i] = at(qM_, i, lane);
      mj_addM(&m_, d_, want.numbers, want.nnz, want.adr, want.columns);
    }
  }

  // Compares the elements that MuJoCo's matrices have. After the factorisation, there are no others.
  void assert_same() {
    for (int lane = 0; lane < kWidth; ++lane) {
      const Matrix& want = want_[lane];
      for (int r = 0; r < n_; ++r)
        for (int i = 0; i < want.nnz[r]; ++i) {
          const int c = want.columns[want.adr[r] + i];
          if (c > r) continue;
          assert_true(r == c || filled_[r * n_ + c] >> lane & 1);
          assert_memory_equal(&at(H_, r * n_ + c, lane), &want.numbers[want.adr[r] + i], sizeof(double));
        }
    }
  }

  void solve(const lanes::SparseFactor& factor) {
    for (double& x : x_) x = number();
    factor.solve(lanes::vectors(solution_), lanes::vectors(x_));
    for (int lane = 0; lane < kWidth; ++lane) {
      const Matrix& want = want_[lane];
      mjtNum vec[n_], res[n_];
      for (int k = 0; k < n_; ++k) vec[k] = at(x_, k, lane);
      mju_cholSolveSparse(res, want.numbers, vec, n_, want.nnz, want.adr, want.columns);
      for (int k = 0; k < n_; ++k) assert_memory_equal(&at(solution_, k, lane), &res[k], sizeof(double));
      for (int r = 0; r < n_; ++r) {
        int count = 0;
        for (int c = 0; c < r; ++c) count += filled_[r * n_ + c] >> lane & 1;
        assert_int_equal(count + 1, want.nnz[r]);
      }
    }
  }

  // Returns whether all matrices keep their rank.
  bool update(lanes::SparseFactor& factor) {
    unsigned plus = 0, ranks = 0;
    factor.begin_vector(lanes::vectors(x_));
    for (int lane = 0; lane < kWidth; ++lane) {
      std::vector<int> own;
      for (int i = 0; i < c_.size; ++i)
        if (holders_[i] >> lane & 1) own.push_back(i);
      if (own.empty() || noise_.below(4) == 0) continue;
      const int i = own[noise_.below(own.size())];
      const bool is_plus = noise_.below(2) == 0;
      plus |= static_cast<unsigned>(is_plus) << lane;
      const double scale = noise_.below(3) ? 0.5 : 4;
      mjtNum vec[n_];
      int columns[n_];
      for (int k = 0; k < chain_counts_[i]; ++k) {
        columns[k] = chains_[i * n_ + k];
        vec[k] = at(x_, columns[k], lane) = at(J_, i * n_ + columns[k], lane) * scale;
        factor.add_element(columns[k], 1U << lane);
      }
      Matrix& want = want_[lane];
      const int rank = mju_cholUpdateSparse(want.numbers, vec, n_, is_plus, want.nnz, want.adr, want.columns,
                                            chain_counts_[i], columns, d_);
      ranks |= static_cast<unsigned>(rank < n_) << lane;
      lost += rank < n_;
    }
    assert_int_equal(factor.update(lanes::vectors(x_), lanes::mask_of(plus)), ranks);
    return ranks == 0;
  }
};

void test_sparse_matrices(void** /*state*/) {
  SparseMatrices matrices;
  for (int round = 0; round < 2000; ++round) matrices.compare();
  assert_in_range(matrices.lost, 100, 10000);
  assert_in_range(matrices.mixed, 1000, 28000);
}

// mju_dotSparse, where lanes have different products, or different blocks of four. Most products are zeros of both signs.
void test_sparse_sums(void** /*state*/) {
  constexpr int kMost = 14;
  const std::vector<double> ones(kMost, 1.0);
  std::vector<int> indices(kMost);
  for (int i = 0; i < kMost; ++i) indices[static_cast<std::size_t>(i)] = i;
  Noise noise;
  int negative = 0;
  for (int round = 0; round < 20000; ++round) {
    const int count = 1 + static_cast<int>(noise.below(kMost));
    const bool in_blocks = noise.below(2) == 0;
    alignas(lanes::V) double products[kMost * lanes::kWidth]{};
    unsigned char holders[kMost]{};
    std::vector<double> own[lanes::kWidth];
    for (int i = 0; i < count; ++i) {
      holders[i] = in_blocks && i % 4 != 0 ? holders[i - 1]
                                           : static_cast<unsigned char>(noise.below(std::uint64_t{1} << lanes::kWidth));
      for (int lane = 0; lane < lanes::kWidth; ++lane) {
        const double product = noise.below(8) == 0 ? noise() : noise.below(8) == 0 ? 0.0 : -0.0;
        products[i * lanes::kWidth + lane] = product;
        if (holders[i] >> lane & 1) own[lane].push_back(product);
      }
    }
    const lanes::V found = lanes::sum_of_each(lanes::vectors(products), holders, count);
    for (int lane = 0; lane < lanes::kWidth; ++lane) {
      const double want =
          mju_dotSparse(own[lane].data(), ones.data(), static_cast<int>(own[lane].size()), indices.data());
      const double got = found[lane];
      negative += want == 0 && std::signbit(want);
      assert_memory_equal(&got, &want, sizeof want);
    }
  }
  assert_true(negative > 100);
}

// Rows whose Hessian loses rank are left to MuJoCo. Friction that is this strong leaves little of the inertia in Newton's
// Hessian, so taking a constraint away can lose rank.
void test_rows_of_lost_rank(void** /*state*/) {
  const std::string plain = odd_model("contacts.xml"), strong = with("<option", "<option impratio=\"1e11\"", plain);
  // A share of the rows may have no Hessian that loses rank. With values of their own, more than half of the rows may lose it.
  const int rows = kFewRows * share;
  assert_string_equal(compare(Model::parse("contacts.xml", plain), rows).c_str(), "");
  const int usual = left_by_solver;
  assert_string_equal(compare(Model::parse("contacts.xml", strong), rows, {20, 1}).c_str(), "");
  assert_true(left_by_solver > usual);
}

// MuJoCo makes no constraint of a tendon that no dof moves, but one of an equality of this tendon with another one.
void test_still_tendons(void** /*state*/) {
  const auto model = Model::parse("tendons", R"(<mujoco><worldbody>
    <body><joint name='a' axis='0 1 0'/><geom size='0.1' pos='0.2 0 0' conaffinity='0'/></body></worldbody>
    <tendon><fixed name='still'><joint joint='a' coef='0'/></fixed>
    <fixed name='moved'><joint joint='a' coef='2'/></fixed></tendon>
    <equality><tendon tendon1='still' tendon2='moved' polycoef='0.1 0.5 0 0 0'/></equality></mujoco>)");
  assert_string_equal(compare(model, kFewRows).c_str(), "");
  assert_true(made > 0);
}

// Radii of bounding spheres that MuJoCo's compiler does not write: of a plane, which is then bounded, and 0 of other
// shapes, which are then unbounded.
void test_odd_radii(void** /*state*/) {
  const ErrorTrap trap;
  const auto geom = [](const char* body, const char* attributes) {
    return std::string("<body pos='") + body + "'><freejoint/><geom " + attributes + " contype='0'/></body>";
  };
  const auto model = Model::parse(
      "radii", "<mujoco><worldbody><geom type='plane' size='1 1 1'/><geom size='0.2' pos='5 0 0.5'/>" +
                   geom("0.2 0 0.09", "size='0.1'") + geom("2 0 0.09", "size='0.1'") + geom("3 0 0.09", "size='0.1'") +
                   geom("5 0 0.75", "type='capsule' size='0.1 0.1'") + "</worldbody></mujoco>");
  const mjModel& m = *model->get();
  assert_non_null(model->pairs());
  const OwnArrays none(*model);
  for (const bool is_bounded : {true, false}) {
    // The model's memory is not constant.
    m.geom_rbound[0] = is_bounded ? 1 : 0;
    for (const int odd : {4, 5}) m.geom_rbound[odd] = 0;
    const auto stepper = lanes::make_stepper(*model, *lanes::code_of(2));
    assert_string_equal(compare(model, 2, *stepper, none, kFewRows, {}).c_str(), "");
  }
}

// Each row reaches as many limits as lanes have room for. But the rows reach different ones, together too many.
void test_many_limits(void** /*state*/) {
  std::string bodies;
  for (int i = 0; i < 60; ++i)
    bodies += "<body><joint type='slide' limited='true' range='-0.01 0.01'/><geom size='0.1' conaffinity='0'/></body>";
  const auto model =
      Model::parse("limits", "<mujoco><option jacobian='dense'/><worldbody>" + bodies + "</worldbody></mujoco>");
  assert_string_equal(compare(model, 16 * share).c_str(), "");
}

// Cameras that only a reference names; rangefinders, which MuJoCo computes, beside a sensor that lanes compute; and a
// sensor that alone reads constraints before there are forces
void test_lone_sensors(void** /*state*/) {
  const auto text = [](const char* sensor) {
    return std::string(R"(<mujoco><worldbody><geom type='plane' size='5 5 1'/>
    <body name='a' pos='0 0 0.3'><joint name='a' axis='0 1 0'/><geom size='0.1' pos='0.2 0 0'/><site pos='0.1 0 0'/>
    <camera pos='0.1 0 0'/><body name='b' pos='0.3 0 0'><joint axis='1 0 0'/><geom name='b' size='0.1' pos='0 0.1 0'/>
    <site name='down' pos='0 0.1 -0.1' euler='170 20 0'/>
    <camera name='eye' pos='0 0 0.1' euler='10 20 30' mode='track'/></body></body></worldbody>
    <tendon><fixed name='t' limited='true' range='-0.1 0.1' margin='0.1'><joint joint='a' coef='1'/></fixed></tendon>
    <sensor>)") +
           sensor + "</sensor></mujoco>";
  };
  failures.clear();
  for (const char* sensor :
       {"<framepos objtype='xbody' objname='a' reftype='camera' refname='eye'/>",
        "<framequat objtype='xbody' objname='a' reftype='camera' refname='eye'/>",
        "<rangefinder site='down'/><rangefinder site='down' cutoff='0.2'/><framequat objtype='geom' objname='b'/>",
        "<tendonlimitvel tendon='t'/>", "<force site='down'/><torque site='down'/>"}) {
    const std::string found = compare(Model::parse("sensor", text(sensor)), kFewRows);
    if (!found.empty()) failures += sensor + (": " + found) + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Frames of geoms and cameras, rays, and the quaternion of a ball, without sensors that read constraints. With RK4,
// MuJoCo computes the energies of its last stage.
void test_sensors_of_frames(void** /*state*/) {
  const std::string scene = R"(<mujoco><default><geom contype='0' conaffinity='0'/></default><worldbody>
    <geom type='plane' size='5 5 1'/>
    <body pos='0 0 1'><joint axis='0 1 0' stiffness='2' springref='30'/>
    <geom type='capsule' size='0.05 0.2'/><site name='a' pos='0.3 0 0' euler='180 10 0'/>
    <body pos='0.2 0 0.1' euler='10 20 30'><joint name='ball' type='ball' stiffness='3'/>
    <geom name='b' type='box' size='0.1 0.2 0.05'/><site name='b' pos='0.1 0 0' euler='150 0 30'/>
    <body pos='0 0.3 0'><joint axis='1 0 0' damping='0.1'/>
    <geom name='c' type='box' size='0.4 0.1 0.2' euler='0 10 0'/><site name='c' pos='0 0.2 -0.3' euler='200 0 0'/>
    <camera name='fixed' pos='0.1 0 0.2' euler='10 20 30'/><camera name='tracking' pos='0 0.1 0' mode='trackcom'/>
    </body></body></body></worldbody><sensor>
    <framexaxis objtype='geom' objname='b'/><frameyaxis objtype='geom' objname='c'/>
    <framepos objtype='geom' objname='c'/><framepos objtype='camera' objname='fixed'/>
    <framepos objtype='camera' objname='tracking'/><frameyaxis objtype='camera' objname='fixed'/>
    <rangefinder site='a'/><rangefinder site='b'/><rangefinder site='c'/><ballquat joint='ball'/>
    </sensor></mujoco>)";
  const ErrorTrap trap;
  for (const char* option : {"", "<option integrator='RK4'><flag energy='enable'/></option>"}) {
    const auto model = Model::parse("frames", in_front_of_body(option, scene));
    const auto stepper = lanes::make_stepper(*model, *lanes::code_of(2));
    const std::string found = compare(model, 2, *stepper, OwnArrays(*model), 12 * share, {});
    if (!found.empty()) fail_msg("%s: %s", option, found.c_str());
  }
}

// Slightly different values of an array for a row
std::vector<double> other_values(const OwnArray& array, Noise& noise) {
  std::vector<double> values(array.original.count());
  array.original.read(values.data());
  if (array.original.type == MJENV_DTYPE_FLOAT64 || array.original.type == MJENV_DTYPE_FLOAT32)
    for (double& value : values) value *= 1 + 0.01 * noise();
  if (ends_with(array.original.name, "quat"))
    for (std::size_t i = 0; i < values.size(); i += 4) mju_normalize4(&values[i]);
  return values;
}

using Values = std::function<std::vector<double>(const OwnArray& array, Noise& noise)>;

// Steps rows that differ in one array, of which `values` chooses those of the next row. Says where lanes and MuJoCo part,
// or that lanes leave other rows than those of `left` (bits); "" if neither. Lanes make the constraints of all frames but
// the last, first with the values that the rows share, then with their own.
std::string compare_own(const std::shared_ptr<const Model>& model, const std::string& array,
                        const Values& values = other_values, std::uint32_t left = 0, int frames = 1,
                        Kind kind = Kind::tame) {
  const mjModel& m = *model->get();
  const StateLayout layout(*model);
  const int width = lanes::widths().back();
  counted = lanes::code_of(width);
  lanes::Code code = *counted;
  code.makeConstraint = count_making;
  made = made_of_contacts = 0;
  const auto stepper = lanes::make_stepper(*model, code);
  OwnArrays own(*model);
  own.add(array);
  const OwnArray& written = own.list().front();
  Noise noise;
  std::vector<std::unique_ptr<Work>> works;
  std::vector<Work*> some;
  std::vector<std::vector<double>> states, befores, blocks;
  std::vector<double*> before;
  const auto begin = [&](Work& work, std::size_t i, bool is_own) {
    if (is_own) work.use(own, reinterpret_cast<std::byte*>(blocks[i].data()));
    work.load(states[i].data());
    work.act({states[i].data() + layout.size - layout.more - layout.nu, MJENV_DTYPE_FLOAT64, m.nu});
  };
  for (std::size_t i = 0; i < static_cast<std::size_t>(width); ++i) {
    states.push_back(random_state(m, layout, kind, noise));
    befores.emplace_back(layout.size);
    blocks.emplace_back(own.block_bytes() / sizeof(double) + 1);
    written.write(values(written, noise).data(), reinterpret_cast<std::byte*>(blocks.back().data()));
    before.push_back(befores.back().data());
    works.push_back(std::make_unique<Work>(model));
    works.back()->expect("qM");
    some.push_back(works.back().get());
    begin(*some.back(), i, false);
  }
  const std::uint32_t usual = stepper->step(some.data(), width, frames, before.data());
  if (usual + 1 != 1U << width) return "left to MuJoCo without values of their own";
  for (std::size_t i = 0; i < some.size(); ++i) begin(*some[i], i, true);
  const std::uint32_t done = stepper->step(some.data(), width, frames, before.data());
  if (done != (usual & ~left)) return (usual & ~left & ~done) != 0 ? "left to MuJoCo" : "not left to MuJoCo";
  Work plain(model);
  std::vector<double> last(layout.size);
  for (std::size_t i = 0; i < some.size(); ++i) {
    if (!(done >> i & 1)) continue;
    begin(plain, i, true);
    plain.step(frames, last.data());
    const std::string found = difference(*some[i], plain);
    if (!found.empty()) return found;
  }
  return "";
}

// Rows stay in lanes with values of their own of any array of the model.
void test_own_arrays(void** /*state*/) {
  failures.clear();
  for (const char* name : {"lanes.xml", "actuators.xml", "equalities.xml", "sensing.xml", "shapes.xml", "fluids.xml"}) {
    const auto model = Model::parse(name, odd_model(name));
    const ErrorTrap trap;
    for (const Array& array : model->arrays()) {
      if (!is_writable(*model, array) || !is_read(array.name) || array.count() == 0) continue;
      const std::string found = compare_own(model, array.name);
      if (!found.empty()) failures += std::string(name) + ", " + array.name + ": " + found + "\n";
    }
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Actuators with different ranges of force, and with states, of which RK4 keeps the derivatives of each stage
void test_many_actuators(void** /*state*/) {
  std::string bodies, actuators;
  for (int i = 1; i <= 4; ++i) {
    const std::string name = "'j" + std::to_string(i) + "'", most = "0." + std::to_string(i);
    bodies += "<body><joint name=" + name + "/><geom size='0.1' pos='0.2 0 0' contype='0'/></body>";
    actuators += "<general joint=" + name + " dyntype='integrator' forcelimited='true' forcerange='-" + most + " " +
                 most + "'/>";
  }
  const auto model = Model::parse("actuators", "<mujoco><option integrator='RK4'/><worldbody>" + bodies +
                                                   "</worldbody><actuator>" + actuators + "</actuator></mujoco>");
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 2).c_str(), "");
}

// MuJoCo tests the pairs of geoms that lanes have not rejected: of three pairs with 1, 3 and 6 friction dimensions, the
// last two.
void test_dimensions_of_near_pairs(void** /*state*/) {
  const auto model = Model::parse("pairs", R"(<mujoco><default><geom conaffinity='0'/></default><worldbody>
    <geom type='plane' size='5 5 1' conaffinity='1' condim='1'/>
    <body pos='0 0 2'><freejoint/><geom size='0.1' condim='1'/></body>
    <body pos='1 0 0.09'><freejoint/><geom size='0.1' condim='3'/></body>
    <body pos='2 0 0.09'><freejoint/><geom size='0.1' condim='6'/></body></worldbody></mujoco>)");
  assert_non_null(model->pairs());
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 1, Kind::at_rest).c_str(), "");
}

// In a fluid, MuJoCo passes over a body with next to no mass, also where the body is heavy in the other rows.
void test_light_bodies(void** /*state*/) {
  const auto model = Model::parse("fluids.xml", odd_model("fluids.xml"));
  const ErrorTrap trap;
  for (int body = 1; body < model->get()->nbody; ++body) {
    if (model->get()->body_parentid[body] == 0) continue;  // without its mass, none may be left for some dofs
    int row = 0;
    const auto masses = [&](const OwnArray& array, Noise& /*noise*/) {
      std::vector<double> values(array.original.count());
      array.original.read(values.data());
      if (row++ % 2 == 1) values[static_cast<std::size_t>(body)] = 1e-16;
      return values;
    };
    assert_string_equal(compare_own(model, "body_mass", masses).c_str(), "");
  }
}

// mjMINVAL (1e-15) is the least mass of a body over which MuJoCo does not pass.
void test_least_mass(void** /*state*/) {
  const auto model = Model::parse("least mass", R"(<mujoco><option density='5' viscosity='2'/><worldbody>
    <body><joint axis='0 1 0'/><geom size='0.1' pos='0.2 0 0'/><body pos='0.1 0.2 0.3'>
    <inertial pos='0.1 0.3 0.7' mass='1e-15' diaginertia='1e-17 1e-17 1e-17'/></body></body></worldbody></mujoco>)");
  assert_true(model->get()->body_mass[2] == mjMINVAL);
  assert_string_equal(compare(model, kFewRows).c_str(), "");
}

// The stages of RK4 add accelerations that are negative zeros to zeros.
void test_tiny_accelerations(void** /*state*/) {
  std::string bodies, actuators;
  for (int i = 0; i < 4; ++i) {
    const std::string name = "j" + std::to_string(i);
    bodies +=
        "<body><joint name='" + name + "' type='slide'/><inertial pos='0 0 0' mass='100' diaginertia='1 1 1'/></body>";
    actuators += "<motor joint='" + name + "'/>";
  }
  const auto model = Model::parse("tiny", "<mujoco><option integrator='RK4' gravity='0 0 0'/><worldbody>" + bodies +
                                              "</worldbody><actuator>" + actuators + "</actuator></mujoco>");
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 1, Kind::tiny).c_str(), "");
}

// The odd rows, as bits
constexpr std::uint32_t kOddRows = 0xAAAAAAAA;

// The values of the model; in odd rows, a number instead of the last `count` of them, or of all
Values in_odd_rows(double number, std::ptrdiff_t count = 0) {
  int row = 0;
  return [row, number, count](const OwnArray& array, Noise& /*noise*/) mutable {
    std::vector<double> values(array.original.count());
    if (array.original.data) array.original.read(values.data());
    if (row++ % 2 == 1) std::fill(count ? values.end() - count : values.begin(), values.end(), number);
    return values;
  };
}

// Without coefficients, the Jacobian of a tendon is 0, so MuJoCo makes none of its constraints. Lanes leave these rows to
// MuJoCo, because another number of constraints changes the order in which its solvers add.
void test_tendons_without_coefficients(void** /*state*/) {
  const std::pair<const char*, const char*> kinds[] = {
      {"frictionloss='2'", ""},
      {"limited='true' range='5 9'", ""},
      {"", "<equality><tendon tendon1='t' polycoef='1 0 0 0 0'/></equality>"}};
  std::string bodies;
  for (const char* name : {"a", "b", "c", "d", "e", "f"})
    bodies += std::string("<body><joint frictionloss='0.5' pos='0.1 0 0.2' axis='1 0.3 ") + (name[0] % 2 ? "0" : "1") +
              "' name='" + name + "'/><geom size='0.1' pos='0.3 0 0' conaffinity='0'/></body>";
  for (const auto& [attributes, equality] : kinds)
    for (const char* solver : {"PGS", "Newton"}) {
      const auto model =
          Model::parse("tendon", std::string("<mujoco><option solver='") + solver + "'/><worldbody>" + bodies +
                                     "</worldbody><tendon><fixed name='t' " + attributes +
                                     "><joint joint='a' coef='1'/><joint joint='b' coef='-0.5'/></fixed></tendon>" +
                                     equality + "</mujoco>");
      assert_string_equal(compare_own(model, "wrap_prm", in_odd_rows(0), kOddRows, 2).c_str(), "");
    }
}

// Lanes know which fluid model acts on a geom of the shared model, and leave the rows to MuJoCo in which it is another one. They
// need it for passive forces, or, if MuJoCo's functions compute these, for the derivatives of mj_implicit.
void test_other_fluid_models(void** /*state*/) {
  for (const char* integrator : {"Euler", "implicit"})
    for (const char* jacobian : {"dense", "sparse"}) {
      const bool knows_fluids = std::strcmp(integrator, "implicit") == 0 || std::strcmp(jacobian, "dense") == 0;
      const auto option = std::string("<option integrator='") + integrator + "' jacobian='" + jacobian + "'/>";
      const auto model = Model::parse("lanes.xml", in_front_of_body(option, odd_model("lanes.xml")));
      assert_string_equal(compare_own(model, "geom_fluid", in_odd_rows(0.5), knows_fluids ? kOddRows : 0).c_str(), "");
    }
}

// Values of odd rows that decide whether geoms touch. In the other rows, the boxes are apart, and the ball touches the
// floor, or is above it, with or without a margin that reaches the floor.
void test_own_contacts(void** /*state*/) {
  const auto ball = [](const char* height, const char* attributes) {
    return std::string("<mujoco><worldbody><geom type='plane' size='1 1 1' ") + attributes + "/><body pos='0 0 " +
           height + "'><freejoint/><geom size='0.1' " + attributes + "/></body></worldbody></mujoco>";
  };
  const std::string boxes = R"(<mujoco><worldbody><geom type='box' size='.1 .1 .1'/><body pos='.3 0 0'>
    <joint type='slide' axis='1 0 0'/><geom type='box' size='.1 .1 .1'/></body></worldbody></mujoco>)",
                    hills = R"(<mujoco><asset><hfield name='hills' nrow='5' ncol='5' size='.5 .5 1 .1'/></asset>
    <worldbody><geom type='hfield' hfield='hills'/><body pos='0 0 .3'>
    <joint type='slide' axis='0 0 1'/><geom type='box' size='.1 .1 .1'/></body></worldbody></mujoco>)";
  const struct {
    std::string text;
    const char* array;
    double value;
    std::ptrdiff_t count = 0;  // of the last values of the array; 0: all
    std::uint32_t left = 0;
  } cases[] = {{boxes, "geom_size", 0.17},
               {boxes, "geom_margin", 0.15},
               {hills, "hfield_size", 2.5},
               {hills, "hfield_data", 0.25},
               {ball("0.15", "margin='0.1'"), "geom_gap", 0.1},
               {ball("0.15", ""), "geom_margin", 0.1},
               {ball("0.09", ""), "geom_rbound", 0.01, 1},
               {ball("0.09", ""), "geom_contype", 0},
               {ball("0.09", ""), "geom_conaffinity", 0},
               {ball("0.09", ""), "geom_margin", -0.01, 1, kOddRows}};
  const ErrorTrap trap;
  failures.clear();
  for (const auto& c : cases) {
    const auto model = Model::parse("contacts", c.text);
    const mjModel& m = *model->get();
    std::fill_n(m.hfield_data, m.nhfielddata, 0.1F);  // the model's memory is not constant
    const std::string found = compare_own(model, c.array, in_odd_rows(c.value, c.count), c.left, 2, Kind::at_rest);
    if (!found.empty()) failures += std::string(c.array) + ": " + found + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Lanes make the constraints of two bodies in deep contact, also if rows have their own margins of geoms.
void test_own_margins_of_deep_contacts(void** /*state*/) {
  const auto model = Model::parse("deep", R"(<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body>
    <body pos='0.1 0 0'><freejoint/><geom size='0.1'/></body></worldbody></mujoco>)");
  assert_string_equal(compare_own(model, "geom_margin", in_odd_rows(0.01), 0, 2, Kind::at_rest).c_str(), "");
  assert_int_equal(made_of_contacts, 2);
}

// Arrays of numbers that lanes compute with, so that they may not be above MuJoCo's limit
const char* const kLimited[] = {"qpos0",
                                "qpos_spring",
                                "body_pos",
                                "body_quat",
                                "body_ipos",
                                "body_iquat",
                                "body_mass",
                                "body_inertia",
                                "jnt_pos",
                                "jnt_axis",
                                "jnt_stiffness",
                                "dof_armature",
                                "dof_damping",
                                "dof_M0",
                                "geom_pos",
                                "geom_quat",
                                "site_pos",
                                "site_quat",
                                "tendon_stiffness",
                                "tendon_damping",
                                "wrap_prm",
                                "actuator_gear",
                                "actuator_gainprm",
                                "tendon_lengthspring",
                                "actuator_ctrlrange",
                                "opt.timestep",
                                "actuator_biasprm",
                                "opt.gravity",
                                "opt.wind",
                                "opt.density",
                                "opt.viscosity"};

// Lanes leave rows to MuJoCo whose own numbers are above MuJoCo's limit.
void test_excessive_own_numbers(void** /*state*/) {
  const auto model = Model::parse("lanes.xml", odd_model("lanes.xml"));
  const ErrorTrap trap;
  failures.clear();
  int compared = 0;
  for (const Array& array : model->arrays()) {
    if (!is_writable(*model, array) ||
        !std::any_of(std::begin(kLimited), std::end(kLimited), [&](const char* name) { return array.name == name; }))
      continue;
    const std::string found = compare_own(model, array.name, in_odd_rows(1.1e10, 1), kOddRows);
    ++compared;
    if (!found.empty()) failures += array.name + ": " + found + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
  assert_true(compared > 25);
}

// Lanes leave rows to MuJoCo whose inputs are not finite or above MuJoCo's limit.
void test_bad_inputs(void** /*state*/) {
  const auto model = Model::parse("inputs", R"(<mujoco><worldbody><body mocap='true'><geom size='0.1'/></body>
    <body pos='2 0 0' mocap='true'><geom size='0.1'/></body>
    <body pos='1 0 0'><joint type='slide'/><geom size='0.1'/></body></worldbody></mujoco>)");
  const ErrorTrap trap;
  for (const char* name : {"qfrc_applied", "xfrc_applied", "mocap_pos"}) {
    assert_string_equal(compare_own(model, name, in_odd_rows(1e10, 1)).c_str(), "");
    for (const double number : {std::nextafter(1e10, kInfinite), -1.1e10, -kInfinite, kNaN}) {
      const std::string found = compare_own(model, name, in_odd_rows(number, 1), kOddRows);
      if (!found.empty()) fail_msg("%s, %g: %s", name, number, found.c_str());
    }
  }
}

// MuJoCo resets the simulation where a position or velocity is above its limit. In a step, damping brings a velocity back
// below the limit, and gravity brings one above it.
void test_states_at_limit(void** /*state*/) {
  const auto model = Model::parse("limit", R"(<mujoco><option timestep='0.1'/><worldbody>
    <body><joint type='slide' damping='0.2'/><geom size='0.1' mass='1'/></body>
    <body pos='1 0 0'><joint type='slide'/><geom size='0.1' mass='1'/></body></worldbody></mujoco>)");
  const ErrorTrap trap;
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  Noise noise;
  for (const bool is_current : {false, true}) {
    const auto work = [&] {
      auto one = std::make_unique<Work>(model);
      if (is_current) one->keep_current();
      return one;
    };
    std::vector<std::unique_ptr<Work>> works;
    for (int i = 0; i < width; ++i) works.push_back(work());
    Counts counts;
    for (int round = 0; round < 300; ++round) {
      const std::string found = compare(*model, *stepper, works, *work(), OwnArrays(*model), Kind::at_limit,
                                        1 + static_cast<int>(noise.below(2)), noise, counts);
      assert_string_equal(found.c_str(), "");
    }
    assert_int_equal(counts.left, 0);
  }
}

// Work spaces of rows that are stepped together, and the memory for their states before the last frame
struct Group {
  std::vector<std::unique_ptr<Work>> works;
  std::vector<Work*> some;
  std::vector<std::vector<double>> befores;
  std::vector<double*> before;

  Group(const std::shared_ptr<const Model>& model, int width)
      : befores(static_cast<std::size_t>(width), std::vector<double>(StateLayout(*model).size)) {
    for (auto& state : befores) {
      works.push_back(std::make_unique<Work>(model));
      some.push_back(works.back().get());
      before.push_back(state.data());
    }
  }
};

// Steps a row from each state. Compares those rows that lanes do not leave to MuJoCo, and returns them, as bits.
// expected: an array that is read after the step; "" if no more is read than after every step.
std::uint32_t step_rows(const std::shared_ptr<const Model>& model, lanes::Stepper& stepper,
                        std::vector<std::vector<double>> states, const std::string& expected = "") {
  const ErrorTrap trap;
  const int count = static_cast<int>(states.size());
  Group group(model, count);
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!expected.empty()) group.works[i]->expect(expected);
    group.works[i]->load(states[i].data());
  }
  const std::uint32_t done = stepper.step(group.some.data(), count, 1, group.before.data());
  Work plain(model);
  std::vector<double> last(StateLayout(*model).size);
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!(done >> i & 1)) continue;
    plain.load(states[i].data());
    plain.step(1, last.data());
    assert_memory_equal(last.data(), group.befores[i].data(), last.size() * sizeof(double));
    assert_string_equal(difference(*group.works[i], plain).c_str(), "");
  }
  return done;
}

// Where a test writes the state of a row
struct RowState {
  double *qpos, *qvel, *warmstart, *ctrl;
};
using SetState = std::function<void(std::size_t row, const RowState& state)>;

// Calls step_rows with rows for the widest lanes, on the same stepper for each of `sets`, which change the model's
// initial state. Returns what the last call returns.
std::uint32_t step_from(const std::shared_ptr<const Model>& model, const std::vector<SetState>& sets,
                        const std::string& expected = "") {
  const mjModel& m = *model->get();
  const StateLayout layout(*model);
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  std::uint32_t done = 0;
  for (const SetState& set : sets) {
    std::vector<std::vector<double>> states(static_cast<std::size_t>(width), std::vector<double>(layout.size));
    for (std::size_t i = 0; i < states.size(); ++i) {
      double *const state = states[i].data(), *const warmstart = layout.warmstart(state);
      std::copy_n(m.qpos0, m.nq, layout.qpos(state));
      set(i, {layout.qpos(state), layout.qvel(state), warmstart, warmstart + layout.nv});
    }
    done = step_rows(model, *stepper, states, expected);
  }
  return done;
}

void keep_state(std::size_t /*row*/, const RowState& /*state*/) {}

// MuJoCo's search for pairs misses contacts that are shallower than its float32 numbers are precise. Rows with such
// contacts are left to it.
void test_missed_contacts(void** /*state*/) {
  std::vector<std::shared_ptr<const Model>> models;
  int missed = 0;
  for (int i = 0; i < 60; ++i) {
    std::array<char, 32> place{};
    std::snprintf(place.data(), place.size(), "%.17g", 3.2 - 1e-8 * i);
    models.push_back(Model::parse("spheres",
                                  "<mujoco><worldbody><body pos='3 0.1 0.2'><freejoint/><geom size='0.1'/></body>"
                                  "<body pos='" +
                                      std::string(place.data()) +
                                      " 0.1 0.2'><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"));
    Work work(models.back());
    work.forward();
    missed += i > 0 && work.data()->ncon == 0;
    step_from(models.back(), {keep_state});
  }
  assert_in_range(missed, 1, 58);
  failures.clear();
  for (std::size_t i = 0; i < models.size(); ++i) {
    const std::string found = compare(models[i], 16 * share);
    if (!found.empty()) failures += std::to_string(i) + ": " + found + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// The model's initial state, once for each of the widest lanes. In odd rows, the number with this index is another one.
std::vector<std::vector<double>> states_with(const Model& model, std::size_t index, double number) {
  Noise noise;
  std::vector<std::vector<double>> states(static_cast<std::size_t>(lanes::widths().back()),
                                          random_state(*model.get(), StateLayout(model), Kind::at_rest, noise));
  for (std::size_t i = 1; i < states.size(); i += 2) states[i][index] = number;
  return states;
}

// Lanes leave rows to MuJoCo in which the state of an actuator or a mocap body's quaternion is not finite or above
// MuJoCo's limit, although MuJoCo does not check these.
void test_bad_states(void** /*state*/) {
  const auto model = Model::parse("states", R"(<mujoco><worldbody><body mocap='true'><geom size='0.1'/></body>
    <body pos='2 0 0' mocap='true'><geom size='0.1'/></body>
    <body pos='1 0 0'><joint name='j' type='slide'/><geom size='0.1'/></body></worldbody><actuator>
    <general joint='j' dyntype='filter' gainprm='1e-9'/><general joint='j' dyntype='filter' gainprm='1e-9'/>
    </actuator></mujoco>)");
  const StateLayout layout(*model);
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  const std::uint32_t all = (1U << width) - 1;
  const std::size_t last_act = 1 + layout.nq + layout.nv + layout.na - 1, last_quat = layout.size - 1;
  for (const std::size_t index : {last_act, last_quat})
    for (const double number : {1e10, std::nextafter(1e10, kInfinite), -1.1e10, kInfinite, kNaN})
      assert_int_equal(step_rows(model, *stepper, states_with(*model, index, number)),
                       number == 1e10 ? all : all & ~kOddRows);
}

// Lanes leave rows to MuJoCo in which a number is above MuJoCo's limit within a step, where MuJoCo does not check it: a
// position or velocity of a stage of RK4, and an acceleration that a constraint takes away.
void test_numbers_within_steps(void** /*state*/) {
  const struct {
    const char *option, *joint;
    double qpos, qvel, ctrl;
  } cases[] = {{"integrator='RK4' timestep='1'", "damping='3'", 9.9e9, 3e8, 0},
               {"integrator='RK4' timestep='1'", "stiffness='0.3'", -1e9, 9.9e9, 0},
               {"", "limited='true' range='-1 1' solimplimit='0.9999 0.9999'", 1.01, 0, 1e10}};
  for (const auto& c : cases) {
    const auto model = Model::parse("slide", std::string("<mujoco><option ") + c.option + R"(/><worldbody>
      <body><joint name='j' type='slide' axis='1 0 0' )" +
                                                 c.joint + R"(/><geom size='0.1' mass='1'/></body></worldbody>
      <actuator><motor joint='j' gear='20'/></actuator></mujoco>)");
    auto states = states_with(*model, 1, c.qpos);
    for (std::size_t i = 1; i < states.size(); i += 2) {
      states[i][2] = c.qvel;
      states[i].back() = c.ctrl;
    }
    Work plain(model);
    std::vector<double> last(StateLayout(*model).size);
    plain.load(states[1].data());
    assert_false(diverges(plain, 1, last.data()) || diverges(plain, 1, last.data()));
    const int width = lanes::widths().back();
    const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
    assert_int_equal(step_rows(model, *stepper, states), ((1U << width) - 1) & ~kOddRows);
  }
}

// Steps rows with values of their own of an array, which are `number` in odd rows, and in the others at one place or at
// none. Odd rows are left to MuJoCo.
void step_beside_left_rows(const std::shared_ptr<const Model>& model, const std::string& array, double number,
                           bool are_others_without) {
  OwnArrays own(*model);
  own.add(array);
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  const auto states = states_with(*model, 1, 2e10);
  std::vector<std::vector<double>> blocks;
  Group group(model, width);
  const auto begin = [&](Work& work, std::size_t row) {
    work.use(own, reinterpret_cast<std::byte*>(blocks[row].data()));
    work.load(states[row].data());
  };
  for (std::size_t row = 0; row < states.size(); ++row) {
    std::vector<double> values(own.list().front().original.count(), row % 2 == 1 ? number : 0.0);
    if (!are_others_without) values[row] = number;
    blocks.emplace_back(own.block_bytes() / sizeof(double) + 1);
    own.list().front().write(values.data(), reinterpret_cast<std::byte*>(blocks.back().data()));
    begin(*group.works[row], row);
  }
  const ErrorTrap trap;
  const std::uint32_t done = stepper->step(group.some.data(), width, 1, group.before.data());
  assert_int_equal(done, ((1U << width) - 1) & ~kOddRows);
  Work plain(model);
  std::vector<double> last(StateLayout(*model).size);
  for (std::size_t row = 0; row < states.size(); row += 2) {
    begin(plain, row);
    plain.step(1, last.data());
    assert_string_equal(difference(*group.works[row], plain).c_str(), "");
  }
}

// Rows that are left to MuJoCo have more friction and equalities of their own than lanes have room for. These are
// neither written nor read.
void test_constraints_of_left_rows(void** /*state*/) {
  std::string bodies, connects;
  for (int i = 0; i < 200; ++i)
    bodies += "<body><joint type='slide' frictionloss='0.1'/><geom size='0.1' contype='0'/></body>";
  step_beside_left_rows(Model::parse("friction", "<mujoco><option solver='PGS' jacobian='dense'/><worldbody>" + bodies +
                                                     "</worldbody></mujoco>"),
                        "dof_frictionloss", 0.1, false);
  for (int i = 0; i < 1000; ++i) connects += "<connect body1='b' anchor='0 0 0' active='false'/>";
  step_beside_left_rows(
      Model::parse("equalities", R"(<mujoco><size njmax='50'/><option cone='elliptic'/><worldbody>
    <body name='b'><joint type='slide'/><geom size='0.1'/><site name='s'/></body></worldbody><equality>)" +
                                     connects + "</equality><sensor><force site='s'/></sensor></mujoco>"),
      "eq_active", 1, true);
}

// After a step with contacts, a step without any. MuJoCo's functions make the constraints of both.
void test_step_without_constraints(void** /*state*/) {
  const auto model = Model::parse("ball", R"(<mujoco><worldbody><geom type='plane' size='1 1 1'/><body pos='0 0 0.09'>
    <joint type='slide' damping='1'/><geom size='0.1'/></body></worldbody></mujoco>)");
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  std::vector<std::vector<double>> states = states_with(*model, 1, 0);
  for (const double height : {0, 1}) {
    for (auto& state : states) state[1] = height;
    assert_int_equal(step_rows(model, *stepper, states, "qM") + 1, 1U << width);
  }
}

// Each of 20 spheres touches the floor in some rows and the ceiling in others. In lanes, the constraints of these
// contacts have more places than a row can have constraints. In rows with values of their own, spheres also touch each
// other, and there are too few places.
void test_many_places(void** /*state*/) {
  std::string bodies;
  for (int i = 0; i < 20; ++i) bodies += "<body><joint type='slide'/><geom size='0.1' conaffinity='0'/></body>";
  const auto model = Model::parse("places",
                                  "<mujoco><option cone='elliptic' jacobian='dense'/><worldbody>"
                                  "<geom type='plane' size='1 1 1' pos='0 0 -0.1'/>"
                                  "<geom type='plane' size='1 1 1' pos='0 0 0.1' euler='180 0 0'/>" +
                                      bodies + "</worldbody></mujoco>");
  assert_string_equal(compare(model, 16 * share).c_str(), "");

  counted = lanes::code_of(lanes::widths().back());
  lanes::Code code = *counted;
  code.makeConstraint = count_making;
  const auto stepper = lanes::make_stepper(*model, code);
  Group group(model, code.width);
  Work plain(model);
  Noise noise;
  Counts counts;
  made_of_contacts = 0;
  const std::string found =
      compare(*model, *stepper, group.works, plain, OwnArrays(*model), Kind::tame, 1, noise, counts);
  assert_string_equal(found.c_str(), "");
  assert_int_equal(counts.constraints, 60 * counts.rows);
  assert_int_equal(made_of_contacts, 1);
}

// A callback changes the controls and forces between the frames of a step. Rows that get an invalid control are left to MuJoCo, which
// then uses none, and so are rows in which the callback fails.
void test_controls_of_substeps(void** /*state*/) {
  const auto model = Model::parse("pusher", R"(<mujoco><worldbody>
    <body><joint name='a'/><geom size='0.1' pos='0.2 0 0'/></body></worldbody>
    <actuator><motor joint='a' gear='1e-3'/></actuator></mujoco>)");
  const StateLayout layout(*model);
  const ErrorTrap trap;
  constexpr int frames = 3;
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  OwnArrays own(*model);
  own.add("qfrc_applied");
  std::vector<double> no_force(own.block_bytes() / sizeof(double));
  for (const auto& [odd_control, fails] : {std::pair{1e10, false}, {1.1e10, false}, {1e10, true}}) {
    Noise noise;
    Group group(model, width);
    std::vector<std::vector<double>> states;
    const auto control = [&, odd_control = odd_control](Work& work, int row, std::int64_t frame) {
      work.data()->ctrl[0] = row % 2 == 1 && frame == 1 ? odd_control : 1e3 * row + 1e4 * static_cast<double>(frame);
      work.data()->qfrc_applied[0] = row + static_cast<double>(frame);
    };
    for (Work* const work : group.some) {
      states.push_back(random_state(*model->get(), layout, Kind::tame, noise));
      work->use(own, reinterpret_cast<std::byte*>(no_force.data()));
      work->load(states.back().data());
    }
    const lanes::Stepper::BeforeSubstep of_row = [&, fails = fails](int row, std::int64_t frame) {
      if (fails && row % 2 == 1) throw Error(MJENV_E_TASK, "it fails");
      control(*group.some[static_cast<std::size_t>(row)], row, frame);
    };
    const std::uint32_t done = stepper->step(group.some.data(), width, frames, group.before.data(), &of_row);
    const std::uint32_t all = (1U << width) - 1;
    assert_int_equal(done, fails || odd_control > 1e10 ? all & ~kOddRows : all);
    Work plain(model);
    plain.use(own, reinterpret_cast<std::byte*>(no_force.data()));
    std::vector<double> last(layout.size);
    for (std::size_t i = 0; i < states.size(); ++i) {
      if (!(done >> i & 1)) continue;
      const Work::BeforeSubstep alone = [&](std::int64_t frame) { control(plain, static_cast<int>(i), frame); };
      plain.load(states[i].data());
      plain.step(frames, last.data(), &alone);
      assert_memory_equal(last.data(), group.befores[i].data(), last.size() * sizeof(double));
      assert_string_equal(difference(*group.some[i], plain).c_str(), "");
    }
  }
}

// Lanes make the constraints of every step, also after more contacts in all steps than one step may have. In a step
// without contacts, noslip does not solve those of the step before again.
void test_made_again(void** /*state*/) {
  for (const char* solver : {"Newton", "PGS"}) {
    const auto model =
        Model::parse("ball", std::string("<mujoco><size nconmax='1'/><option noslip_iterations='2' solver='") + solver +
                                 R"('/><worldbody><geom type='plane' size='1 1 1'/>
      <body pos='0 0 0.09'><freejoint/><geom size='0.1'/></body></worldbody></mujoco>)");
    const StateLayout layout(*model);
    const int width = lanes::widths().back();
    counted = lanes::code_of(width);
    lanes::Code code = *counted;
    code.makeConstraint = count_making;
    const auto stepper = lanes::make_stepper(*model, code);
    Group group(model, width);
    Work plain(model);
    made_of_contacts = 0;
    for (int step = 1; step <= 6; ++step) {
      Noise noise;
      const auto load = [&](Work& work, int row) {
        std::vector<double> state = random_state(*model->get(), layout, Kind::at_rest, noise);
        const bool touches = step < 5 || (step == 5 && row % 2 == 0);
        if (!touches) layout.qpos(state.data())[2] += 1;
        work.load(state.data());
      };
      for (int row = 0; row < width; ++row) load(*group.some[static_cast<std::size_t>(row)], row);
      assert_int_equal(stepper->step(group.some.data(), width, 1, group.before.data()) + 1, 1U << width);
      assert_int_equal(made_of_contacts, std::min(step, 5));
      for (int row = 0; row < width; ++row) {
        std::vector<double> last(layout.size);
        load(plain, row);
        plain.step(1, last.data());
        Work& work = *group.some[static_cast<std::size_t>(row)];
        assert_string_equal(difference(work, plain).c_str(), "");
        assert_int_equal(work.constraint_count(), plain.constraint_count());
      }
    }
  }
}

// Zeros that are negative only in a row's own positions of joints. They matter at an anchor that is -0 in the world, which
// takes a free body at -0 and no rotation.
void test_own_negative_zeros(void** /*state*/) {
  const auto model = Model::parse("zeros", R"(<mujoco><worldbody><body pos='-0 0 0'><freejoint/><geom size='0.1'/>
    <body pos='-0 -1 -1'><joint axis='1 1 1'/><geom size='0.1'/></body></body></worldbody></mujoco>)");
  assert_string_equal(compare_own(model, "jnt_pos", in_odd_rows(-0.0), 0, 1, Kind::at_rest).c_str(), "");
}

// If only contype and conaffinity keep too many pairs of geoms apart for a list, rows with their own ones are left to MuJoCo.
void test_many_kept_apart(void** /*state*/) {
  std::string geoms;
  for (int i = 0; i < 65; ++i) geoms += "<geom size='0.1' contype='1' conaffinity='2'/>";
  const auto model = Model::parse("apart", "<mujoco><worldbody><body><joint/>" + geoms + "</body><body><joint/>" +
                                               geoms + "</body></worldbody></mujoco>");
  assert_string_equal(compare_own(model, "geom_contype", other_values, ~0U).c_str(), "");
  assert_string_equal(compare_own(model, "geom_size", other_values).c_str(), "");
}

// Muscles whose length is exactly where one part of their curve of forces ends and the next begins: at lmin, in the middle
// between lmin and 1, at 1, in the middle between 1 and lmax, and at lmax, which may be next to 1, or below 1 in a row.
void test_muscle_lengths(void** /*state*/) {
  std::string bodies, muscles;
  for (const auto& [length, most] : {std::pair{"0.5", "1.5"},
                                     {"0.75", "1.5"},
                                     {"1", "1.5"},
                                     {"1.25", "1.5"},
                                     {"1.5", "1.5"},
                                     {"1.0000000000000004", "1.0000000000000009"}}) {
    const std::string name = "j" + std::to_string(bodies.size());
    bodies += "<body><joint type='slide' name='" + name + "' ref='" + length + "'/><geom size='0.1'/></body>";
    muscles += "<muscle joint='" + name + "' lengthrange='0 1' range='0 1' lmin='0.5' lmax='" + most + "' force='9'/>";
  }
  const auto model = Model::parse(
      "muscles", "<mujoco><option integrator='implicit'/><default><geom contype='0'/></default><worldbody>" + bodies +
                     "</worldbody><actuator>" + muscles + "</actuator></mujoco>");
  int row = 0;
  const auto shorter = [&](const OwnArray& array, Noise& /*noise*/) {
    std::vector<double> values(array.original.count());
    array.original.read(values.data());
    if (row++ % 2 == 1)
      for (std::size_t i = 5; i < values.size(); i += mjNGAIN) values[i] = 0.9;  // lmax
    return values;
  };
  assert_string_equal(compare_own(model, "actuator_gainprm", shorter, 0, 1, Kind::at_rest).c_str(), "");
}

// MuJoCo makes the constraints of all rows if a row has numbers of its own of which MuJoCo warns.
void test_own_solref(void** /*state*/) {
  const auto model = Model::parse("equalities.xml", odd_model("equalities.xml"));
  const ErrorTrap trap;
  int row = 0;
  const auto mixed = [&](const OwnArray& array, Noise& /*noise*/) {
    std::vector<double> values(array.original.count());
    array.original.read(values.data());
    if (row++ % 2 == 1) values[0] = -values[0];
    return values;
  };
  for (const char* array : {"eq_solref", "dof_solref"})
    assert_string_equal(compare_own(model, array, mixed, 0, 2).c_str(), "");
}

// Without a callback, MuJoCo leaves user sensors at 0, beside sensors of motion and beside those that read constraints.
void test_user_sensors(void** /*state*/) {
  const std::string user = "<user objtype='joint' objname='knee' datatype='real' needstage='acc' dim='2' cutoff='1'/>",
                    motion = "<sensor><jointvel joint='knee'/>" + user + "</sensor></mujoco>",
                    limits = "<sensor><jointlimitfrc joint='knee'/>" + user + "</sensor></mujoco>";
  for (const std::string& sensors : {motion, limits})
    assert_string_equal(
        compare(Model::parse("contacts.xml", with("</mujoco>", sensors, odd_model("contacts.xml"))), 16).c_str(), "");
}

// Rows are left to MuJoCo where its stack may be too small to solve the constraints.
void test_small_stacks(void** /*state*/) {
  std::string spheres;
  for (int i = 0; i < 12; ++i) spheres += "<geom size='0.1' pos='" + std::to_string(0.1 * i - 0.6) + " 0 0'/>";
  for (int size = 200; size <= 600; size += 200) {
    const auto model =
        Model::parse("stack", "<mujoco><size nstack='" + std::to_string(size) +
                                  "'/><default><geom conaffinity='0'/></default><worldbody>"
                                  "<geom type='plane' size='9 9 1' conaffinity='1'/><body pos='0 0 0.4'><freejoint/>" +
                                  spheres + "</body></worldbody></mujoco>");
    const std::string found = compare(model, 16 * share);
    if (!found.empty()) fail_msg("%d numbers: %s", size, found.c_str());
  }
}

// Heavy friction, whose quadratic zone is so small that a line search with no tolerance uses up its evaluations
void test_exhausted_line_search(void** /*state*/) {
  for (const char* solver : {"Newton", "CG"}) {
    const auto model = Model::parse("exhausted", std::string("<mujoco><option tolerance='0' iterations='20' solver='") +
                                                     solver + R"('/><default><joint frictionloss='2' axis='0 1 0'
      solimpfriction='0.9999 0.9999'/><geom size='0.05' pos='0.1 0 0' contype='0'/></default><worldbody>
      <body><joint/><geom/><body pos='0.2 0 0'><joint/><geom/><body pos='0.2 0 0'><joint/><geom/></body></body></body>
      </worldbody></mujoco>)");
    const mjModel& m = *model->get();
    std::fill_n(m.dof_invweight0, m.nv, 1e-12);  // the model's memory is not constant
    const std::string found = compare(model, 64 * share, {1, 1});
    if (!found.empty()) fail_msg("%s: %s", solver, found.c_str());
  }
}

// With a tolerance that is not a number, MuJoCo's line search ends after its first step.
void test_undefined_tolerance(void** /*state*/) {
  for (const char* solver : {"Newton", "CG"}) {
    const auto model = Model::parse(
        "contacts.xml", with("<option", std::string("<option solver=\"") + solver + '"', odd_model("contacts.xml")));
    const_cast<double&>(model->get()->opt.tolerance) = kNaN;  // the model's memory is not constant
    assert_string_equal(compare(model, 16).c_str(), "");
  }
}

// Dry friction counts as sliding from the end of its quadratic zone on.
void test_end_of_friction(void** /*state*/) {
  for (const int side : {-1, 1}) {
    const auto model = Model::parse("friction", "<mujoco><option iterations='0' gravity='" + std::to_string(side) +
                                                    R"( 0 0'/><worldbody><body>
      <joint type='slide' axis='1 0 0' frictionloss='0.9'/><geom size='0.1' mass='1'/></body></worldbody></mujoco>)");
    const StateLayout layout(*model);
    const int width = lanes::widths().back();
    const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
    Work plain(model);
    plain.forward();
    assert_int_equal(plain.data()->nefc, 1);
    std::vector<double> state(layout.size);
    *layout.warmstart(state.data()) = side * plain.data()->efc_R[0] * plain.data()->efc_frictionloss[0];
    Group group(model, width);
    for (Work* const work : group.some) {
      work->expect("efc_state");
      work->load(state.data());
    }
    assert_int_equal(stepper->step(group.some.data(), width, 1, group.before.data()) + 1, 1U << width);
    std::vector<double> last(layout.size);
    plain.load(state.data());
    plain.step(1, last.data());
    assert_int_equal(plain.data()->efc_state[0], side > 0 ? mjCNSTRSTATE_LINEARPOS : mjCNSTRSTATE_LINEARNEG);
    for (Work* const work : group.some) assert_string_equal(difference(*work, plain).c_str(), "");
  }
}

// Rows are left to MuJoCo where the cost overflows in the line search.
void test_overflowing_costs(void** /*state*/) {
  const auto model = Model::parse("overflow", R"(<mujoco><option solver='CG'/><worldbody>
    <body><joint name='a'/><geom size='0.1'/></body><body pos='1 0 0'><joint name='b'/><geom size='0.1'/></body>
    </worldbody><equality><joint joint1='a' joint2='b' polycoef='0 1e70 0 0 0' active='false'/></equality></mujoco>)");
  const ErrorTrap trap;
  assert_string_equal(compare_own(model, "eq_active", in_odd_rows(1), kOddRows, 2).c_str(), "");
}

// Many limits and contacts, for which the lanes' memory must be large enough: 36 balls have limits, and 36 geoms of one
// body touch the floor.
void test_many_entries(void** /*state*/) {
  std::string balls, geoms;
  for (int i = 0; i < 36; ++i) {
    const std::string x = std::to_string(i);
    balls += "<body pos='" + x + " 0 0.2'><joint type='ball' limited='true' range='0 10'/><geom size='0.1'/></body>";
    geoms += "<geom size='0.1' pos='" + x + " 0.2 0'/>";
  }
  const std::string slides =
      "<body pos='0 5 0.09'><joint type='slide' limited='true' range='-0.01 0.01'/><geom size='0.1'/></body>";
  for (const std::string& bodies :
       {balls + slides, "<body pos='0 0 0.099'><joint type='slide'/><joint axis='1 0 0'/>" + geoms + "</body>"}) {
    const auto model = Model::parse("entries",
                                    "<mujoco><option jacobian='dense'/><default><geom conaffinity='0' condim='1'/>"
                                    "</default><worldbody><geom type='plane' size='9 9 1' conaffinity='1'/>" +
                                        bodies + "</worldbody></mujoco>");
    const bool are_limits = model->get()->njnt > 2;
    const std::string found =
        compare_own(model, "body_mass", other_values, 0, 2, are_limits ? Kind::tame : Kind::at_rest);
    assert_string_equal(found.c_str(), "");
    assert_true((are_limits ? made : made_of_contacts) > 0);
  }
}

// A box on a height field, of which MuJoCo's function finds as many contacts as it may
void test_many_single_contacts(void** /*state*/) {
  const auto model =
      Model::parse("field", R"(<mujoco><asset><hfield name='flat' nrow='20' ncol='20' size='1 1 0.1 0.1'/>
    </asset><default><geom conaffinity='0' condim='1'/></default><worldbody>
    <geom type='hfield' hfield='flat' conaffinity='1'/>
    <body pos='0 0 0.098'><joint type='slide'/><joint axis='1 0 0'/><joint axis='0 1 0'/>
    <geom type='box' size='0.4 0.4 0.1'/></body></worldbody></mujoco>)");
  Work work(model);
  work.forward();
  assert_in_range(work.data()->ncon, 30, mjMAXCONPAIR);
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 2, Kind::at_rest).c_str(), "");
  assert_true(made_of_contacts > 0);
}

// Contacts without friction beside those with elliptic cones. From step to step other bodies touch the floor.
void test_mixed_cones(void** /*state*/) {
  std::string bodies;
  for (const char* dim : {"3", "1", "4", "1", "3"})
    bodies += "<body pos='" + std::to_string(bodies.size()) +
              " 0 0.15'><freejoint/><geom type='capsule' size='0.1 0.1' " + "condim='" + dim + "'/></body>";
  for (const char* option : {"solver='Newton'", "solver='CG'", "solver='Newton' jacobian='sparse'"}) {
    const auto model = Model::parse("cones", std::string("<mujoco><option cone='elliptic' ") + option +
                                                 "/><default><geom conaffinity='0'/></default><worldbody>"
                                                 "<geom type='plane' size='9 9 1' conaffinity='1' condim='1'/>" +
                                                 bodies + "</worldbody></mujoco>");
    const std::string found = compare(model, kFewRows);
    if (!found.empty()) fail_msg("%s: %s", option, found.c_str());
    assert_true(made_of_contacts > 0);
  }
}

// In the first step a contact with an elliptic cone has the place that one without friction has in the second step.
void test_exchanged_contacts(void** /*state*/) {
  std::string bodies;
  for (const char* dim : {"3", "1", "3"})
    bodies += "<body pos='" + std::to_string(bodies.size()) + " 0 0.099'><joint type='slide' axis='1 0 0'/>" +
              "<joint type='slide'/><geom size='0.1' condim='" + dim + "'/></body>";
  const auto model = Model::parse("exchanged",
                                  "<mujoco><option cone='elliptic'/><default><geom conaffinity='0'/>"
                                  "</default><worldbody><geom type='plane' size='9 9 1' conaffinity='1' "
                                  "condim='1'/>" +
                                      bodies + "</worldbody></mujoco>");
  const auto slide = [](std::size_t /*row*/, const RowState& state) { state.qvel[0] = state.qvel[4] = 1; };
  const auto lift = [&](std::size_t row, const RowState& state) {
    slide(row, state);
    state.qpos[1] = 1;
  };
  assert_int_equal(step_from(model, {slide, lift}) + 1, 1U << lanes::widths().back());
}

// Models whose only actuator acts on a ball or on a free joint
void test_lone_actuators(void** /*state*/) {
  for (const char* joints : {"<joint axis='0 1 0'/><geom size='0.1' pos='0.1 0 0'/><body pos='0.3 0 0'>"
                             "<joint name='j' type='ball'/><geom size='0.1' pos='0 0.1 0'/></body>",
                             "<freejoint name='j'/><geom size='0.1' pos='0 0.1 0'/>"}) {
    const auto model = Model::parse(
        "actuator", std::string("<mujoco><default><geom contype='0'/></default><worldbody>") + "<body>" + joints +
                        "</body></worldbody><actuator>" + "<motor joint='j' gear='1 2 3 4 5 6'/></actuator></mujoco>");
    assert_string_equal(compare_own(model, "body_mass", other_values, 0, 2).c_str(), "");
  }
}

// A fluid that acts on the only geom of the model as on an ellipsoid
void test_lone_ellipsoid(void** /*state*/) {
  const auto model = Model::parse("ellipsoid", R"(<mujoco><option density='1000' viscosity='0.1'/><worldbody><body>
    <freejoint/><geom type='ellipsoid' size='0.1 0.2 0.3' fluidshape='ellipsoid'/></body></worldbody></mujoco>)");
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 2).c_str(), "");
}

// MuJoCo sets the stiffness of friction to 0, also where solref and solimp give an infinite one.
void test_stiff_friction(void** /*state*/) {
  const auto model = Model::parse("friction", R"(<mujoco><worldbody><body><joint frictionloss='1'
    solreffriction='-1e305 -1' solimpfriction='0.0001 0.0001 0.001'/><geom size='0.1' pos='0.2 0 0'/></body>
    </worldbody></mujoco>)");
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 2).c_str(), "");
  assert_true(made > 0);
}

// MuJoCo searches for pairs in rows with sizes of their own. They are left to it where its stack is too small for that.
void test_small_stack_of_search(void** /*state*/) {
  std::string bodies;
  for (int i = 0; i < 70; ++i) bodies += "<body/>";
  const auto model = Model::parse("search",
                                  "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body pos='0 0 0.09'>"
                                  "<joint type='slide'/><geom size='0.1'/></body>" +
                                      bodies + "</worldbody></mujoco>");
  assert_non_null(model->pairs());
  const_cast<int&>(model->get()->nstack) = 1500;  // the model's memory is not constant
  assert_string_equal(compare(model, 16 * share).c_str(), "");
}

// More contacts than nconmax, of which MuJoCo uses the first ones
void test_too_many_contacts(void** /*state*/) {
  const auto model = Model::parse("full", R"(<mujoco><size nconmax='1'/><worldbody><geom type='plane' size='9 9 1'/>
    <body pos='0 0 0.09'><joint type='slide'/><geom size='0.1'/></body>
    <body pos='1 0 0.09'><joint type='slide'/><geom size='0.1'/></body></worldbody></mujoco>)");
  step_from(model, {keep_state});
}

// Rows are left to MuJoCo whose Jacobians or stiffnesses are so large that products with them may overflow.
void test_huge_numbers(void** /*state*/) {
  // PGS's matrix is infinite. So MuJoCo rejects the forces that the tiny acceleration gives.
  const auto infinite = Model::parse("infinite", R"(<mujoco><option solver='PGS' iterations='0' gravity='0 0 0'/>
    <worldbody><body><joint name='a' type='slide'/><geom size='0.1'/></body><body pos='1 0 0'>
    <joint name='b' type='slide'/><inertial pos='0 0 0' mass='1e-14' diaginertia='1e-14 1e-14 1e-14'/></body>
    </worldbody><equality><joint joint1='a' joint2='b' polycoef='0 1e302 0 0 0'/></equality></mujoco>)");
  const auto accelerate = [](std::size_t /*row*/, const RowState& state) { state.warmstart[0] = 1e-300; };
  assert_int_equal(step_from(infinite, {accelerate}), 0);
  for (const char* solver : {"Newton", "CG", "PGS"}) {
    const std::string option = std::string("<mujoco><option jacobian='dense' solver='") + solver + "' ";
    if (std::strcmp(solver, "PGS") != 0) {
      const auto coupled = Model::parse("coupled", option + R"(gravity='0 0 0'/><worldbody><body><joint name='a'/>
        <geom size='0.1'/></body><body pos='1 0 0'><joint/><geom size='0.1'/></body></worldbody><tendon>
        <fixed name='t'><joint joint='a' coef='1'/></fixed><fixed name='u'><joint joint='a' coef='1'/></fixed></tendon>
        <equality><tendon tendon1='t' tendon2='u' polycoef='0 1e300 0 0 0'/></equality></mujoco>)");
      assert_int_equal(step_from(coupled, {keep_state}), 0);
      const auto sparse =
          Model::parse("sparse", std::string("<mujoco><option jacobian='sparse' solver='") + solver + R"('/>
        <worldbody><body><joint name='a'/><geom size='0.1'/></body><body pos='1 0 0'><joint name='b'/>
        <geom size='0.1'/></body></worldbody><equality><joint joint1='b' joint2='a' polycoef='0 1e80 0 0 0'/></equality>
        </mujoco>)");
      assert_int_equal(step_from(sparse, {keep_state}), 0);
    }
    const auto stiff = Model::parse("stiff", option + R"(impratio='1e300'/><worldbody><geom type='plane' size='1 1 1'/>
      <body pos='0 0 0.099'><joint type='slide'/><geom size='0.1'/></body></worldbody></mujoco>)");
    const auto leave_floor = [](std::size_t /*row*/, const RowState& state) { state.qvel[0] = 1; };
    assert_int_equal(step_from(stiff, {leave_floor}), 0);
  }
}

// Touch sensors with zones of different shapes, on the first and on the second body of contacts; rows touch with
// different forces or not at all. The last body has so little weight that its force must be normalized.
void test_touch(void** /*state*/) {
  const auto model = Model::parse("touch", R"(<mujoco><worldbody><geom type='plane' size='2 2 1'/>
    <body pos='0 0 0.099'><joint type='slide' axis='0 0 1'/><joint type='slide' axis='1 0 0'/><geom size='0.1'/>
    <site name='foot' size='0.03 0.03 0.03' pos='0.03 0 -0.08'/><site name='around' type='box' size='0.2 0.15 0.11'/>
    <site name='over' size='0.03' pos='0.02 0 -0.06'/><site name='under' size='0.03' pos='0.02 0 -0.14'/></body>
    <body pos='0 0 0.296'><joint type='slide' axis='0 0 1'/><geom size='0.1'/>
    <site name='below' type='ellipsoid' size='0.05 0.08 0.11' pos='0.01 0 0' euler='0 10 0'/></body>
    <body pos='1 0 0.0999'><joint type='slide' axis='0 0 1'/><geom size='0.1'/><site name='light' size='0.2'/>
    <inertial pos='0 0 0' mass='1e-9' diaginertia='1e-12 1e-12 1e-12'/></body></worldbody>
    <sensor><touch site='foot'/><touch site='around' cutoff='30'/><touch site='around'/><touch site='below'/>
    <touch site='over'/><touch site='under'/><touch site='light'/></sensor>
    </mujoco>)");
  const auto move = [](std::size_t row, const RowState& state) {
    const auto number = static_cast<double>(row);
    state.qpos[0] = row % 4 == 3 ? 0.01 : 0;
    state.qpos[1] = row % 3 == 1 ? 0.1 : 0;
    state.qvel[0] = 0.1 - 0.1 * number;
    state.qvel[2] = -0.2 * number;
  };
  assert_int_equal(step_from(model, {move}) + 1, 1U << lanes::widths().back());
}

// Accelerations that are negative zeros along a constraint. PGS and noslip leave rows to MuJoCo where b is -0. Newton's method
// changes the sign of zeros where MuJoCo does.
void test_zeros_along_constraints(void** /*state*/) {
  const auto body = [](const char* attributes, const char* mass) {
    return std::string("<body><joint type='slide' ") + attributes + "/><inertial pos='0 0 0' mass='" + mass +
           "' diaginertia='1 1 1'/></body>";
  };
  for (const char* option : {"solver='PGS'", "noslip_iterations='1'"}) {
    const auto sliding = Model::parse("sliding", std::string("<mujoco><option ") + option + "/><worldbody>" +
                                                     body("name='a' axis='1 0 0' frictionloss='1'", "100") +
                                                     body("", "1") + body("", "1") + body("", "1") +
                                                     "</worldbody><actuator><motor joint='a'/></actuator></mujoco>");
    const auto move = [](std::size_t row, const RowState& state) {
      const double sign = row % 2 == 1 ? -1 : 1;
      state.qvel[0] = sign * 0.0;
      for (int i = 1; i < 4; ++i) state.qvel[i] = sign;
      state.ctrl[0] = -5e-324;
    };
    assert_int_equal(step_from(sliding, {move}), ((1U << lanes::widths().back()) - 1) & ~kOddRows);
  }

  const auto coupled =
      Model::parse("coupled", "<mujoco><worldbody>" + body("name='a' axis='1 0 0'", "1") +
                                  body("name='b' axis='1 0 0'", "1") + body("frictionloss='100'", "1") + body("", "1") +
                                  "</worldbody><equality><joint joint1='a' joint2='b' polycoef='0 1 0 0 0'/></equality>"
                                  "</mujoco>");
  const auto hold = [](std::size_t row, const RowState& state) {
    state.warmstart[0] = state.qvel[0] = row & 1 ? -0.0 : 0.0;
    state.warmstart[1] = state.qvel[1] = row & 2 ? -0.0 : 0.0;
    state.warmstart[2] = -1;
    state.warmstart[3] = -9.81;
    state.qvel[2] = -1e-3;
    state.qvel[3] = -1;
  };
  assert_int_equal(step_from(coupled, {hold}, "qM") + 1, 1U << lanes::widths().back());
}

// Zeros of both signs in the sparse Jacobians of equalities between bodies with diagonal inertia, and in the velocities
// and accelerations of these bodies
void test_zeros_of_simple_bodies(void** /*state*/) {
  const std::string slides =
      "<joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 1 0'/><joint type='slide'/>"
      "<geom size='0.1' contype='0'/></body>";
  for (const char* bodies : {"body1='a' body2='b'", "body1='b' body2='a'"}) {
    std::string connects;
    for (const char* anchor : {"0 0 0", "0 0 1"})
      connects += std::string("<connect ") + bodies + " anchor='" + anchor + "'/>";
    const auto model =
        Model::parse("simple", "<mujoco><option jacobian='sparse' gravity='0 0 0'/><worldbody><body name='a'>" +
                                   slides + "<body name='b' pos='1 0 0'>" + slides + "</worldbody><equality>" +
                                   connects + "</equality></mujoco>");
    assert_true(model->get()->body_simple[1] && model->get()->body_simple[2]);
    unsigned signs = 0;
    const auto set = [&](std::size_t /*row*/, const RowState& state) {
      for (int i = 0; i < 6; ++i) {
        state.qvel[i] = signs >> i / 3 & 1 ? -0.0 : 0.0;
        state.warmstart[i] = signs >> (2 + i / 3) & 1 ? -0.0 : 0.0;
      }
      ++signs;
    };
    assert_int_equal(step_from(model, std::vector<SetState>(8, set)) + 1, 1U << lanes::widths().back());
  }
}

void assert_names(const std::string& found, const char* word) {
  if (found.find(word) == std::string::npos) fail_msg("\"%s\" does not name %s", found.c_str(), word);
}

void test_obstacles(void** /*state*/) {
  const auto obstacle = [](const std::string& option, const std::string& rest,
                           const char* joint = "<joint name='j'/>") {
    return lanes::obstacle(*Model::parse(
        "obstacle", "<mujoco>" + option + "<worldbody><site name='s'/><body name='b'>" + joint +
                        "<geom name='g' size='0.1'/><site name='t'/></body></worldbody>" + rest + "</mujoco>"));
  };
  const char* const ball = "<joint name='j' type='ball'/>";
  assert_string_equal(obstacle("", "").c_str(), "");
  assert_string_equal(obstacle("", "", ball).c_str(), "");
  assert_names(obstacle("", "", ""), "no joints");
  assert_names(obstacle("<option><flag fwdinv='enable'/></option>", ""), "enableflags");
  assert_names(obstacle("<option><flag sensornoise='enable'/></option>", ""), "enableflags");
}

// Each array that lanes compute with may have numbers up to MuJoCo's limit.
void test_excessive_numbers(void** /*state*/) {
  const auto model = Model::parse(
      "lanes.xml", with("<site name=\"tip\"", "<site name=\"base\"/><site name=\"tip\"", odd_model("lanes.xml")));
  for (const char* const limited : kLimited) {
    const std::string name = limited;
    const auto found = std::find_if(model->arrays().begin(), model->arrays().end(),
                                    [&](const Array& array) { return array.name == name; });
    assert_true(found != model->arrays().end());
    // The array's last number. The model's memory is not constant.
    double& number = const_cast<double*>(static_cast<const double*>(found->data))[found->count() - 1];
    const double own = number;
    for (const double value : {1e10, -1e10}) {
      number = value;
      if (name != "jnt_stiffness") assert_string_equal(lanes::obstacle(*model).c_str(), "");
    }
    for (const double value : {std::nextafter(1e10, kInfinite), -1.1e10, kInfinite, kNaN}) {
      number = value;
      assert_names(lanes::obstacle(*model), name.c_str());
    }
    number = own;
  }
}

// The process's callbacks of MuJoCo change what its functions compute.
void test_callbacks(void** /*state*/) {
  const auto model = Model::open("hopper.xml");
  const auto assert_is_obstacle = [&](auto& callback, auto function) {
    callback = function;
    const std::string found = lanes::obstacle(*model);
    callback = nullptr;
    assert_names(found, "callbacks");
  };
  const auto act = [](const mjModel*, const mjData*, int) -> mjtNum { return 0; };
  assert_is_obstacle(mjcb_passive, [](const mjModel*, mjData*) {});
  assert_is_obstacle(mjcb_control, [](const mjModel*, mjData*) {});
  assert_is_obstacle(mjcb_contactfilter, [](const mjModel*, mjData*, int, int) { return 0; });
  assert_is_obstacle(mjcb_sensor, [](const mjModel*, mjData*, int) {});
  assert_is_obstacle(mjcb_time, []() -> mjtNum { return 0; });
  assert_is_obstacle(mjcb_act_dyn, act);
  assert_is_obstacle(mjcb_act_gain, act);
  assert_is_obstacle(mjcb_act_bias, act);
  assert_string_equal(lanes::obstacle(*model).c_str(), "");
}

// As many lanes as a thread has rows, at most as many as asked for; none for a model with obstacles.
void test_best_width(void** /*state*/) {
  const auto model = Model::open("hopper.xml");
  const std::vector<int> widths = lanes::widths();
  const auto has = [&](int width) { return std::count(widths.begin(), widths.end(), width) > 0; };
  const int four = has(4) ? 4 : 2, eight = has(8) ? 8 : four;
  assert_int_equal(lanes::best_width(*model, 1, 8), 0);
  assert_int_equal(lanes::best_width(*model, 2, 8), 2);
  assert_int_equal(lanes::best_width(*model, 3, 8), 2);
  assert_int_equal(lanes::best_width(*model, 4, 8), four);
  assert_int_equal(lanes::best_width(*model, 64, 4), four);
  assert_int_equal(lanes::best_width(*model, 64, 8), eight);
  assert_int_equal(
      lanes::best_width(*Model::parse("sensors.xml", in_front_of_body("<option><flag sensornoise='enable'/></option>",
                                                                      odd_model("sensors.xml"))),
                        64, 8),
      0);
}

// Steppers have memory only for what the model needs. For the integrator implicit: the two triangles of qDeriv and of
// qLU, two vectors of six numbers and a 6 x 6 matrix for each body, and a Jacobian. For sensors: their results and
// cutoffs, three arrays of velocities and the mass of each subtree, and the sizes of sites. For sensors of cameras: the
// cameras' poses. Because of the fluid, MuJoCo places geoms also without sensors.
void test_needed_memory(void** /*state*/) {
  const int width = lanes::widths().front();
  const auto numbers = [&](const char* option, const char* sensor) {
    const auto model = Model::parse("needs", std::string("<mujoco>") + option +
                                                 R"(<worldbody><body name='a'><joint/><joint axis='0 1 0'/>
        <geom size='0.1' pos='0.2 0 0' fluidshape='ellipsoid'/>
        <camera name='eye'/><camera/><site/><site/><site/><body><joint axis='1 0 0'/>
        <joint/><geom size='0.1' pos='0.2 0 0'/></body></body></worldbody><sensor>)" +
                                                 sensor + "</sensor></mujoco>");
    return std::pair{model, static_cast<int>(lanes::stepper_bytes(*model, width) / sizeof(double)) / width};
  };
  const auto [model, fewest] = numbers("", "");
  const mjModel& m = *model->get();
  assert_int_equal(numbers("<option integrator='implicit'/>", "").second - fewest,
                   4 * m.nM + (6 + 6 + 36) * m.nbody + 6 * m.nv);
  const int sensing = numbers("", "<framepos objtype='body' objname='a'/>").second;
  assert_int_equal(sensing - fewest, 3 + 1 + (6 + 3 + 3 + 1) * m.nbody + 3 * m.nsite);
  assert_int_equal(numbers("", "<framepos objtype='camera' objname='eye'/>").second - sensing, (3 + 9 + 4) * m.ncam);
}

#ifdef COUNTS_MEMORY
std::size_t allocated_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

// What an environment counts before it is created is at least a quarter of what its steppers then allocate.
void test_memory(void** /*state*/) {
  for (std::size_t i = 0; i < asset_count; ++i) {
    const auto model = Model::open(assets[i].name);
    for (const int width : lanes::widths()) {
      const std::size_t counted_bytes = lanes::stepper_bytes(*model, width), before = allocated_bytes();
      auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
      const std::size_t taken = allocated_bytes() - before;
      if (counted_bytes > taken || 4 * counted_bytes < taken)
        fail_msg("%s, %d lanes: %zu of %zu bytes", assets[i].name, width, counted_bytes, taken);
      stepper.reset();
      // glibc counts the small blocks that a thread keeps for later as allocated.
      if (const std::size_t after = allocated_bytes(); after > before + counted_bytes / 2)
        fail_msg("%s, %d lanes: %zu bytes are not freed", assets[i].name, width, after - before);
    }
  }
}

// A step allocates no memory, also the first one with a contact of a pair that MuJoCo searches for.
void test_no_allocation(void** /*state*/) {
  const auto model = Model::parse("spheres", R"(<mujoco><worldbody><body><joint type='slide'/><geom size='0.1'/></body>
    <body pos='0.15 0 0'><joint type='slide' axis='1 0 0'/><geom size='0.1'/></body></worldbody></mujoco>)");
  assert_null(model->pairs());
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  Noise noise;
  const std::vector<double> state = random_state(*model->get(), StateLayout(*model), Kind::at_rest, noise);
  Group group(model, width);
  for (Work* const work : group.some) work->load(state.data());
  const std::size_t before = allocated_bytes();
  assert_int_equal(stepper->step(group.some.data(), width, 1, group.before.data()) + 1, 1U << width);
  assert_int_equal(allocated_bytes(), before);
}
#endif

// The comparison of squares rejects what the comparison of roots rejects.
void test_largest_square(void** /*state*/) {
  Noise noise;
  std::vector<double> radii{0, 5e-324, 1e-170, 1e-155, 0.1, 1, 2, 1e10, 1e154, 1.4e154, 1e308};
  for (int i = 0; i < 10000; ++i) radii.push_back(std::exp(20 * noise()));
  for (const double radius : radii) {
    const double square = lanes::largest_square(radius);
    assert_true(std::sqrt(square) <= radius);
    assert_true(std::sqrt(std::nextafter(square, INFINITY)) > radius);
  }
  assert_true(lanes::largest_square(-1e-300) < 0);
  assert_true(std::isinf(lanes::largest_square(INFINITY)));
}

int run(bool few) {
  if (few) share = 5;
  const CMUnitTest tests[] = {cmocka_unit_test(test_built_in),
                              cmocka_unit_test(test_odd),
                              cmocka_unit_test(test_stages),
                              cmocka_unit_test(test_fluids),
                              cmocka_unit_test(test_missed_contacts),
                              cmocka_unit_test(test_contacts),
                              cmocka_unit_test(test_parameters_at_limits),
                              cmocka_unit_test(test_noslip),
                              cmocka_unit_test(test_adhesion),
                              cmocka_unit_test(test_clamped_numbers),
                              cmocka_unit_test(test_range_of_ball),
                              cmocka_unit_test(test_wraps),
                              cmocka_unit_test(test_sparse_wraps),
                              cmocka_unit_test(test_sparse),
                              cmocka_unit_test(test_sparse_matrices),
                              cmocka_unit_test(test_sparse_sums),
                              cmocka_unit_test(test_many_dofs),
                              cmocka_unit_test(test_rank_loss),
                              cmocka_unit_test(test_rows_of_lost_rank),
                              cmocka_unit_test(test_still_tendons),
                              cmocka_unit_test(test_odd_radii),
                              cmocka_unit_test(test_many_limits),
                              cmocka_unit_test(test_lone_sensors),
                              cmocka_unit_test(test_sensors_of_frames),
                              cmocka_unit_test(test_own_arrays),
                              cmocka_unit_test(test_many_actuators),
                              cmocka_unit_test(test_dimensions_of_near_pairs),
                              cmocka_unit_test(test_light_bodies),
                              cmocka_unit_test(test_least_mass),
                              cmocka_unit_test(test_tiny_accelerations),
                              cmocka_unit_test(test_tendons_without_coefficients),
                              cmocka_unit_test(test_other_fluid_models),
                              cmocka_unit_test(test_own_contacts),
                              cmocka_unit_test(test_own_margins_of_deep_contacts),
                              cmocka_unit_test(test_excessive_own_numbers),
                              cmocka_unit_test(test_bad_inputs),
                              cmocka_unit_test(test_states_at_limit),
                              cmocka_unit_test(test_bad_states),
                              cmocka_unit_test(test_numbers_within_steps),
                              cmocka_unit_test(test_constraints_of_left_rows),
                              cmocka_unit_test(test_step_without_constraints),
                              cmocka_unit_test(test_many_places),
                              cmocka_unit_test(test_controls_of_substeps),
                              cmocka_unit_test(test_made_again),
                              cmocka_unit_test(test_own_negative_zeros),
                              cmocka_unit_test(test_many_kept_apart),
                              cmocka_unit_test(test_muscle_lengths),
                              cmocka_unit_test(test_own_solref),
                              cmocka_unit_test(test_user_sensors),
                              cmocka_unit_test(test_small_stacks),
                              cmocka_unit_test(test_exhausted_line_search),
                              cmocka_unit_test(test_undefined_tolerance),
                              cmocka_unit_test(test_end_of_friction),
                              cmocka_unit_test(test_overflowing_costs),
                              cmocka_unit_test(test_many_entries),
                              cmocka_unit_test(test_many_single_contacts),
                              cmocka_unit_test(test_mixed_cones),
                              cmocka_unit_test(test_exchanged_contacts),
                              cmocka_unit_test(test_lone_actuators),
                              cmocka_unit_test(test_lone_ellipsoid),
                              cmocka_unit_test(test_stiff_friction),
                              cmocka_unit_test(test_small_stack_of_search),
                              cmocka_unit_test(test_too_many_contacts),
                              cmocka_unit_test(test_huge_numbers),
                              cmocka_unit_test(test_touch),
                              cmocka_unit_test(test_zeros_along_constraints),
                              cmocka_unit_test(test_zeros_of_simple_bodies),
                              cmocka_unit_test(test_obstacles),
                              cmocka_unit_test(test_excessive_numbers),
                              cmocka_unit_test(test_callbacks),
                              cmocka_unit_test(test_best_width),
                              cmocka_unit_test(test_needed_memory),
#ifdef COUNTS_MEMORY
                              cmocka_unit_test(test_memory),
                              cmocka_unit_test(test_no_allocation),
#endif
                              cmocka_unit_test(test_largest_square)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}

}  // namespace
}  // namespace mjenv::core

int run_lanes(bool few) { return mjenv::core::run(few); }

std::string compare_in_lanes(const std::shared_ptr<const mjenv::core::Model>& model, int rows) {
  return mjenv::core::compare(model, rows, {20, 1});  // these rows are few, and all of them may have odd values
}
