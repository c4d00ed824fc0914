// Defines, for MuJoCo 2.2.2, the names by which the core uses every version (mujoco.hpp).
#pragma once

#include <mujoco/mjxmacro.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/errors.hpp"
#include "engine/load.hpp"
#include "engine/pairs.hpp"

// MuJoCo exports these functions for its own language bindings. They set handlers for one thread only.
// NOLINTBEGIN(bugprone-reserved-identifier): MuJoCo's names
extern "C" {
using mjenv_mju_handler = void (*)(const char*);
mjenv_mju_handler _mjPRIVATE__get_tls_error_fn();
void _mjPRIVATE__set_tls_error_fn(mjenv_mju_handler);
mjenv_mju_handler _mjPRIVATE__get_tls_warning_fn();
void _mjPRIVATE__set_tls_warning_fn(mjenv_mju_handler);
}
// NOLINTEND(bugprone-reserved-identifier)

#ifdef MJ_STATIC  // the engine is compiled in
// mj_ray for a rangefinder, with the same result (cmake/engine/rays.c).
extern "C" mjtNum mjenv_ray(const mjModel*, const mjData*, const mjtNum* point, const mjtNum* direction,
                            const mjtByte* groups, mjtByte counts_static, int excluded_body, int* found);
// mj_collision, with the same result (cmake/engine/collision.c).
extern "C" void mjenv_collision(const mjModel*, mjData*);
// mj_applyFT, with the same result (cmake/engine/forces.c).
extern "C" void mjenv_applyFT(const mjModel*, mjData*, const mjtNum* force, const mjtNum* torque, const mjtNum* point,
                              int body, mjtNum* qfrc_target);
#else
constexpr auto mjenv_ray = &mj_ray;
constexpr auto mjenv_collision = &mj_collision;
constexpr auto mjenv_applyFT = &mj_applyFT;
#endif

using mjtSize = int;
using mjtBool = mjtByte;

namespace mjenv::core {

// Makes MuJoCo's functions ready to be called, and returns its version.
inline const char* open_mujoco() { return mj_versionString(); }
inline bool mujoco_is_open() { return true; }
inline void use_thread_locals() {}

// ---- Equality constraints ----

inline bool is_active(const mjModel& m, const mjData& /*d*/, int equality) { return m.eq_active[equality] != 0; }
// Whether the objects of an equality constraint are sites.
inline bool are_sites(const mjModel& /*m*/, int /*equality*/) { return false; }

// ---- Errors ----

// Sets what MuJoCo calls on this thread when it fails. Warnings are ignored. Returns the previous handlers.
template <void (*on_error)(const char*)>
Handlers set_handlers() {
  const Handlers previous{reinterpret_cast<void (*)()>(_mjPRIVATE__get_tls_error_fn()),
                          reinterpret_cast<void (*)()>(_mjPRIVATE__get_tls_warning_fn())};
  _mjPRIVATE__set_tls_error_fn(on_error);
  _mjPRIVATE__set_tls_warning_fn([](const char*) {});
  return previous;
}

inline void restore_handlers(const Handlers& previous) {
  _mjPRIVATE__set_tls_error_fn(reinterpret_cast<mjenv_mju_handler>(previous[0]));
  _mjPRIVATE__set_tls_warning_fn(reinterpret_cast<mjenv_mju_handler>(previous[1]));
}

// ---- Models ----

#ifdef MJ_STATIC
// Whether MuJoCo tells files in memory apart by their paths, not only by their names.
constexpr bool kKnowsFilesByPath = true;  // cmake/engine/load.cc
#else
constexpr bool kKnowsFilesByPath = false;

// MuJoCo's view of files in memory. Of several files with the same name, and of too many files, MuJoCo reads some from
// the disk.
class VirtualFiles {
 public:
  explicit VirtualFiles(const Files& files) {
    std::map<std::string, int> names;
    for (const auto& [path, content] : files) ++names[name_of(path)];
    for (const auto& [path, content] : files) {
      const std::string name = name_of(path);
      if (names[name] > 1) continue;
      const int index = vfs_->nfile;
      if (mj_makeEmptyFileVFS(vfs_.get(), name.c_str(), static_cast<int>(content->size())) == 0)
        std::memcpy(vfs_->filedata[index], content->data(), content->size());
    }
  }
  const mjVFS* get() const { return vfs_.get(); }

 private:
  static void release(mjVFS* vfs) {
    mj_deleteVFS(vfs);
    delete vfs;
  }
  std::unique_ptr<mjVFS, void (*)(mjVFS*)> vfs_{new mjVFS{}, release};
};
#endif

// Advice for a model with an element or attribute that this version does not know.
constexpr const char* kNewerEngine =
    "; if a newer MuJoCo knows it, load the model with the engine 4.0, which is engine=\"4.0\" in Python and Julia, "
    "the feature \"mujoco4\" in Rust and libmjenv-mujoco4 in C and C++";

// MuJoCo 2.2.2 has no models whose simulation depends on more than a row stores.
inline void check_supported(const mjModel&) {}

// Whether MuJoCo also searches the folder of an included file for the files to which that file refers.
constexpr bool kIncludesHaveFolders = false;

// Whether what sensors measure depends on how often they have been computed: noise comes from one random generator.
inline bool sensors_have_memory(const mjModel& m) { return (m.opt.enableflags & mjENBL_SENSORNOISE) != 0; }

// Whether MuJoCo resets a simulation in which it finds bad numbers.
inline bool resets_diverged(const mjModel&) { return true; }

// Calls visit(name, pointer) for each number of mjModel, and visit(name, pointer, count) for each short vector.
template <typename Visit>
void for_each_number(const mjModel& m, const Visit& visit) {
#define X(name) visit(#name, &m.name);
  MJMODEL_INTS
#undef X
#define X(type, name) visit("opt." #name, &m.opt.name);
  MJOPTION_FLOATS
  MJOPTION_INTS
#undef X
#define X(name, size) visit("opt." #name, m.opt.name, size);
  MJOPTION_VECTORS
#undef X
}

// How much memory mjData has besides the arrays that for_each_array visits.
inline std::size_t stack_bytes(const mjModel& m) { return static_cast<std::size_t>(m.nstack) * sizeof(mjtNum); }

// How many contacts mjData can hold.
inline int max_contacts(const mjModel& m) { return m.nconmax; }
inline std::int64_t max_constraints(const mjModel& m) { return m.njmax; }

// Calls add(name, member, columns) for the members of mjContact that only this version has.
template <typename Add>
void add_more_of_contacts(const mjContact*, const Add&) {}

// Returns a function that tells how many elements of the array are in use, if that depends on the number of constraints
// or on the tendons' sparse Jacobians. Otherwise the function is empty.
inline std::function<std::int64_t()> held_by_constraints(const mjModel& m, const mjData& d, const std::string& name) {
  using Count = std::int64_t;
  const auto sparse = [](const int* rowadr, const int* rownnz, Count rows) {
    return rows > 0 ? Count{rowadr[rows - 1]} + rownnz[rows - 1] : 0;
  };
  if (name == "ten_J" || name == "ten_J_colind") {
    if (mj_isSparse(&m) == 0) return {};
    return [&m, &d, sparse] { return sparse(d.ten_J_rowadr, d.ten_J_rownnz, m.ntendon); };
  }
  if (name.rfind("efc_", 0) != 0) return {};
  if (name == "efc_J" || name == "efc_JT" || name == "efc_J_colind" || name == "efc_JT_colind")
    return [&m, &d, sparse] {
      return mj_isSparse(&m) ? sparse(d.efc_J_rowadr, d.efc_J_rownnz, d.nefc) : Count{d.nefc} * m.nv;
    };
  if (name.rfind("efc_JT_", 0) == 0) return [&m, &d] { return d.nefc > 0 ? m.nv : 0; };
  if (name == "efc_AR" || name == "efc_AR_colind")
    return [&m, &d, sparse] {
      return mj_isSparse(&m) ? sparse(d.efc_AR_rowadr, d.efc_AR_rownnz, d.nefc) : Count{d.nefc} * d.nefc;
    };
  return [&d, columns = name == "efc_KBIP" ? 4 : 1] { return Count{d.nefc} * columns; };
}

// ---- State ----

// Whether mj_kinematics normalizes mocap_quat in place, so that it changes in steps and belongs to a row's state.
constexpr bool kNormalizesMocap = true;

// How many numbers a row's state has besides time, qpos, qvel, act, qacc_warmstart and ctrl: those of mocap_quat.
inline int more_state(const mjModel& m) { return 4 * m.nmocap; }
inline void save_more(const mjModel& m, const mjData& d, double* state) {
  std::copy_n(d.mocap_quat, more_state(m), state);
}
inline void load_more(const mjModel& m, mjData& d, const double* state) {
  std::copy_n(state, more_state(m), d.mocap_quat);
}
// Whether MuJoCo can compute with that part of a state.
inline bool is_valid_more(const mjModel&, const double*) { return true; }

// Discards what an interrupted or an earlier computation left on MuJoCo's stack.
inline void clear_stack(mjData& d) { d.pstack = 0; }
inline void clear_caches(const mjModel& m, mjData& d) { std::fill_n(d.qH, m.nM, 0.0); }

// Iterations of the constraint solver in the last step.
inline const int* solver_iterations(const mjData& d) { return &d.solver_iter; }
constexpr const char* kSolverIterations = "solver_iter";
constexpr int kSolverIterationsCount = 1;

// The arrays of the part Lag::frames.
inline constexpr std::array kFrameArrays{"geom_xpos", "geom_xmat", "cam_xpos", "cam_xmat", "light_xpos", "light_xdir"};

// Computes the frame of one geom as mj_kinematics does.
inline void update_frame(const mjModel& m, mjData& d, int geom) {
  mj_local2Global(&d, d.geom_xpos + 3 * geom, d.geom_xmat + 9 * geom, m.geom_pos + 3 * geom, m.geom_quat + 4 * geom,
                  m.geom_bodyid[geom], m.geom_sameframe[geom]);
}

// Resets what mj_setConst reads, so that it computes the same as with a new mjData: the poses of mocap bodies and the
// stack. mj_setConst computes everything else that it reads. mj_resetData would do, too, but clears megabytes if njmax
// is large.
inline void reset_for_constants(const mjModel& m, mjData& d) {
  clear_stack(d);
  for (int body = 0; body < m.nbody; ++body) {
    const int mocap = m.body_mocapid[body];
    if (mocap < 0) continue;
    std::copy_n(m.body_pos + 3 * body, 3, d.mocap_pos + 3 * mocap);
    std::copy_n(m.body_quat + 4 * body, 4, d.mocap_quat + 4 * mocap);
  }
}

// ---- Geom pairs ----

// Whether collision detection sorts the geom pairs of two bodies by the geoms' numbers.
constexpr bool kSortsPairs = false;

// The flags (opt.enableflags, opt.disableflags) that change which pairs this version finds, and with which parameters.
constexpr int kSearchEnabled = mjENBL_OVERRIDE, kSearchDisabled = 0;
// Whether the model has another setting that changes which pairs this version finds.
inline bool has_search_settings(const mjModel& m) { return m.opt.collision == mjCOL_PAIR; }

inline double mixed_margin(double a, double b) { return std::max(a, b); }

// Whether MuJoCo finds other contacts of a body with the world if their geoms are in a list of pairs.
inline bool needs_search(const mjModel&, int /*body*/) { return false; }

// Appends a pair to the arrays that only this version has: there are none.
inline void append_more(Pairs&, const mjModel&, int /*g1*/, int /*g2*/, int /*first*/, bool /*equal*/) {}

// Excludes bodies from the search: this version excludes all of them, by a setting (use_pairs).
inline void exclude_bodies(Pairs&, const mjModel&) {}
// Makes collision detection test the listed pairs and no others.
inline void use_pairs(mjModel& view, Pairs&) { view.opt.collision = mjCOL_PAIR; }

// ---- Own arrays of rows ----

// Flags of mjOption that no row can change, because a row's state lacks what they depend on.
inline int fixed_flags(const mjModel&, bool enable) { return enable ? int{mjENBL_SENSORNOISE} : int{mjDSBL_SENSOR}; }
constexpr int kLastIntegrator = mjINT_IMPLICIT;

// Whether an array of real numbers holds indices that only this version has: there are none.
inline bool has_indices(const mjModel&, const std::string&) { return false; }
// Flags that say which frames coincide, if mj_setConst computes them: not in this version.
inline const std::vector<const char*> kSameframes{};
// The arrays and numbers of mjModel that mj_setConst writes.
inline const std::vector<const char*> kConstants{
    "body_subtreemass",   "body_invweight0",  "dof_invweight0", "dof_M0",           "tendon_length0",
    "tendon_invweight0",  "actuator_length0", "actuator_acc0",  "eq_data",          "cam_pos0",
    "cam_poscom0",        "cam_mat0",         "light_pos0",     "light_poscom0",    "light_dir0",
    "stat.extent",        "stat.meansize",    "stat.meanmass",  "stat.meaninertia", "stat.center",
    "tendon_lengthspring"};
// Arrays that only in this version decide which pairs MuJoCo's search finds: there are none.
inline const std::vector<const char*> kMoreSearch{};
// How many boxes of bvh_aabb belong to bodies: this version has no such array.
inline std::int64_t body_boxes(const mjModel&) { return 0; }
// Of each element of an array, whether its sign decides which variables an actuator's state consists of: none does.
inline std::vector<bool> fixed_signs(const mjModel&, const std::string&) { return {}; }
// Calls visit for each input of mjData that only this version has: there are none.
template <typename Visit>
void for_each_more_input(const mjModel&, const mjData&, const Visit&) {}

// ---- Drawing ----

// The index in mjvOption.flags of a flag of mjenv_render_settings.visual.
constexpr int visual_flag(int flag) { return flag; }
// The mjtLabel of an mjenv_label.
constexpr int label_kind(int label) { return label; }

// The pixels of all textures.
inline const mjtByte* pixels_of(const mjModel& m) { return m.tex_rgb; }
// Makes MuJoCo draw materials with the textures that the model gives them, as this version always does.
inline void use_textures(const mjModel&, mjrContext&) {}

inline void move_camera(const mjModel& m, int action, double dx, double dy, const mjvScene& scene, mjvCamera& camera) {
  mjv_moveCamera(&m, action, dx, dy, &scene, &camera);
}

}  // namespace mjenv::core
