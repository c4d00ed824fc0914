// Defines, for MuJoCo 4.0, the names by which the core uses every version (mujoco.hpp). Its library is opened at run
// time, so that mjenv can use the one that the process has already loaded, the one of an installed Python package, or
// one that the caller names.
#pragma once

#include <mujoco/mjxmacro.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <new>
#include <string>
#include <vector>

#include "engine/errors.hpp"
#include "engine/load.hpp"
#include "engine/pairs.hpp"
#include "error.hpp"

#define MJDATA_POINTERS_PREAMBLE(m)  // MuJoCo 4.0 does not define it, because its MJDATA_POINTERS needs no preamble

// MuJoCo exports this function for its own language bindings. It sets a handler for one thread only.
// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
extern "C" mjfLogHandler _mjPRIVATE_setTlsLogHandler(mjfLogHandler);
// MuJoCo exports this one, too.
extern "C" void mju_mulMatVecSparse(mjtNum* res, const mjtNum* mat, const mjtNum* vec, int rows, const int* rownnz,
                                    const int* rowadr, const int* colind, const int* rowsuper);

// All functions of MuJoCo that the core calls, and the callbacks that it looks at.
// clang-format off
#define MJENV_MUJOCO_FUNCTIONS(X) \
  X(mj_version) X(mj_versionString) X(mj_defaultVFS) X(mj_deleteVFS) X(mj_mountVFS) X(mj_loadXML) \
  X(mj_freeLastXML) X(mj_saveModel) X(mj_sizeModel) X(mj_copyModel) X(mj_deleteModel) X(mj_setConst) X(mj_makeData) \
  X(mj_resetData) X(mj_deleteData) X(mj_step) X(mj_step1) X(mj_step2) X(mj_forward) X(mj_camlight) \
  X(mj_rnePostConstraint) X(mj_contactForce) X(mj_local2Global) X(mj_name2id) X(mj_id2name) X(mj_stateSize) \
  X(mj_getState) X(mj_setState) X(mju_mulQuat) X(mju_free) X(mjv_defaultCamera) X(mjv_moveCamera) \
  X(mjv_defaultPerturb) X(mjv_defaultOption) X(mjv_defaultScene) X(mjv_makeScene) X(mjv_freeScene) \
  X(mjv_updateScene) X(mjr_defaultContext) X(mjr_makeContext) X(mjr_freeContext) X(mjr_uploadHField) \
  X(mjr_uploadTexture) X(mjr_setBuffer) X(mjr_readPixels) X(mjr_render) X(mjr_overlay) X(_mjPRIVATE_setTlsLogHandler) \
  X(mj_kinematics) X(mj_comPos) X(mj_makeM) X(mj_factorM) X(mj_comVel) X(mj_rne) X(mj_tendon) X(mj_collision) \
  X(mj_makeConstraint) X(mj_island) X(mj_projectConstraint) X(mj_transmission) X(mj_energyPos) X(mj_energyVel) \
  X(mju_mulMatVecSparse) X(mju_rayGeom) X(mju_normalize3) X(mj_passive) X(mj_referenceConstraint) \
  X(mj_fwdActuation) X(mj_fwdAcceleration) X(mj_fwdConstraint) X(mj_Euler) X(mj_implicit) X(mj_RungeKutta) \
  X(mj_sensorPos) X(mj_sensorVel) X(mj_sensorAcc) X(mj_addContact) X(mjcb_passive) X(mjcb_control) \
  X(mjcb_contactfilter) X(mjcb_sensor) X(mjcb_time) X(mjcb_act_dyn) X(mjcb_act_gain) X(mjcb_act_bias)
// clang-format on

namespace mjenv::core {

// Pointers to MuJoCo's functions, with the names of the functions. In this namespace they hide the global declarations,
// so the core's calls look like direct calls. The pointers are null until open_mujoco() has returned.
#define MJENV_POINTER(name) extern decltype(&::name) name;
MJENV_MUJOCO_FUNCTIONS(MJENV_POINTER)
#undef MJENV_POINTER
extern const mjfCollision (*mjCOLLISIONFUNC)[mjNGEOMTYPES];

// Opens MuJoCo's library at the first call, and returns its version. Throws MJENV_E_FILE if there is no library or it
// is not version 4.0.
const char* open_mujoco();
bool mujoco_is_open();
// Allocates the thread-local variables of mujoco4.cpp.
void use_thread_locals();

// ---- Equality constraints ----

inline bool is_active(const mjModel& /*m*/, const mjData& d, int equality) { return d.eq_active[equality] != 0; }
// Whether the objects of an equality constraint are sites.
inline bool are_sites(const mjModel& m, int equality) { return m.eq_objtype[equality] == mjOBJ_SITE; }

// ---- Errors ----

// Sets what MuJoCo calls on this thread when it fails. Warnings are ignored. Returns the previous handlers.
template <void (*on_error)(const char*)>
Handlers set_handlers() {
  if (!mujoco_is_open()) return {};
  const mjfLogHandler log = [](const mjLogMessage* message) {
    if (message->level == mjLOG_ERROR) on_error(message->subject);
  };
  return {reinterpret_cast<void (*)()>(_mjPRIVATE_setTlsLogHandler(log))};
}

// If MuJoCo was opened after `previous` was read, `previous` is empty, so the handlers are removed.
inline void restore_handlers(const Handlers& previous) {
  if (mujoco_is_open()) _mjPRIVATE_setTlsLogHandler(reinterpret_cast<mjfLogHandler>(previous[0]));
}

// ---- Models ----

// MuJoCo's view of files in memory.
class VirtualFiles {
 public:
  explicit VirtualFiles(const Files& files);
  ~VirtualFiles() { mj_deleteVFS(&vfs_); }
  VirtualFiles(const VirtualFiles&) = delete;
  VirtualFiles& operator=(const VirtualFiles&) = delete;
  const mjVFS* get() const { return &vfs_; }

 private:
  struct Provider : mjpResourceProvider {
    const std::string* content;
    std::string fingerprint;
  };
  static const Provider& of(const mjResource& file) { return *static_cast<const Provider*>(file.provider); }
  std::vector<Provider> providers_;
  mjVFS vfs_{};
};

// Whether MuJoCo tells files in memory apart by their paths, not only by their names.
constexpr bool kKnowsFilesByPath = true;

// The advice for an unknown element or attribute: none, because mjenv has no build for a newer MuJoCo.
constexpr const char* kNewerEngine = "";

// Refuses a model whose simulation depends on data that a row's state does not contain.
inline void check_supported(const mjModel& m) {
  const auto refuse = [](const char* what) {
    fail(MJENV_E_MODEL,
         std::string(what) +
             "; MuJoCo's state of a simulation lacks the data for this, so rows could not share an mjData");
  };
  if (m.opt.enableflags & mjENBL_SLEEP) refuse("the model enables sleeping, which depends on earlier steps");
  if (m.nflex > 0 && m.opt.enableflags & mjENBL_IPC) refuse("the contacts of flexes depend on earlier steps (ipc)");
  const bool has_kinetic = std::count(m.sensor_type, m.sensor_type + m.nsensor, mjSENS_E_KINETIC) > 0;
  if (has_kinetic && m.opt.enableflags & mjENBL_ENERGY)
    refuse("the sensor e_kinetic has the energy of the step before (flag energy)");
  if (m.nplugin > 0) refuse("the model has plugins, which keep data of their own");
}

// Whether MuJoCo also searches the folder of an included file for the files to which that file refers.
constexpr bool kIncludesHaveFolders = true;

// Whether what sensors measure depends on how often they have been computed: a delayed sensor keeps what it has
// measured.
inline bool sensors_have_memory(const mjModel& m) { return m.nhistory > 0; }

// Whether MuJoCo resets a simulation in which it finds bad numbers.
inline bool resets_diverged(const mjModel& m) { return (m.opt.disableflags & mjDSBL_AUTORESET) == 0; }

// Calls visit(name, pointer) for each number of mjModel, and visit(name, pointer, count) for each short vector.
template <typename Visit>
void for_each_number(const mjModel& m, const Visit& visit) {
#define X(name) visit(#name, &m.name);
  MJMODEL_SIZES
#undef X
#pragma push_macro("XVEC")
#undef XVEC
  visit("flg_gravcomp", &m.flg_gravcomp);
  visit("flg_surfacevel", &m.flg_surfacevel);
  visit("flg_adhesion", &m.flg_adhesion);
#define X(type, name, size) visit("opt." #name, &m.opt.name);
#define XVEC(type, name, size) visit("opt." #name, m.opt.name, size);
  MJOPTION_FIELDS
#undef X
#pragma pop_macro("XVEC")
}

// How much memory mjData has besides the arrays that for_each_array visits.
inline std::size_t stack_bytes(const mjModel& m) { return static_cast<std::size_t>(m.narena); }

// How many contacts of a row can be read at most: nconmax, or 500 if that is not set, but no more than the arena holds.
inline int max_contacts(const mjModel& m) {
  constexpr mjtSize kDefault = 500;
  const auto room = m.narena / static_cast<mjtSize>(sizeof(mjContact));
  return static_cast<int>(std::min(m.nconmax >= 0 ? m.nconmax : kDefault, room));
}

// Calls add(name, member, columns) for the members of mjContact that only this version has.
template <typename Add>
void add_more_of_contacts(const mjContact* contact, const Add& add) {
  add("contact.solreffriction", contact->solreffriction, mjNREF);
  add("contact.adhesion", &contact->adhesion, 1);
  add("contact.surfacevel", contact->surfacevel, 3);
  add("contact.flex", contact->flex, 2);
  add("contact.elem", contact->elem, 2);
  add("contact.vert", contact->vert, 2);
}

// Of how many constraints the forces can be read at most: njmax, or ten for each contact if that is not set.
inline std::int64_t max_constraints(const mjModel& m) { return m.njmax >= 0 ? m.njmax : 10 * max_contacts(m); }

// Always empty: the arrays whose length depends on the number of constraints are in the arena, and cannot be read.
inline std::function<std::int64_t()> held_by_constraints(const mjModel&, const mjData&, const std::string&) {
  return {};
}

// ---- State ----

// False: mj_kinematics normalizes a copy of mocap_quat, so that mocap_quat itself is no part of the state.
constexpr bool kNormalizesMocap = false;

// What a row's state contains besides time, qpos, qvel, act, qacc_warmstart and ctrl: the state of delays, plugins and
// plasticity.
constexpr int kMoreState = mjSTATE_HISTORY | mjSTATE_PLUGIN | mjSTATE_PLASTIC;
inline int more_state(const mjModel& m) { return mj_stateSize(&m, kMoreState); }
inline void save_more(const mjModel& m, const mjData& d, double* state) { mj_getState(&m, &d, state, kMoreState); }
inline void load_more(const mjModel& m, mjData& d, const double* state) { mj_setState(&m, &d, state, kMoreState); }
// Whether MuJoCo can compute with that part of a state. It begins with the histories of the delays. Each history
// begins with a number that is not checked; then come the cursor, the times of the samples, and the samples. MuJoCo
// uses the cursor as an index without a check.
inline bool is_valid_more(const mjModel& m, const double* state) {
  const auto is_valid = [state](const int* history, int start) {
    if (start < 0) return true;
    const double cursor = state[start + 1];
    return cursor >= 0 && cursor < history[0] && cursor == std::floor(cursor);
  };
  for (int i = 0; i < m.nactuator; ++i)
    if (!is_valid(m.actuator_history + 2 * i, m.actuator_historyadr[i])) return false;
  for (int i = 0; i < m.nsensor; ++i)
    if (!is_valid(m.sensor_history + 2 * i, m.sensor_historyadr[i])) return false;
  return true;
}

// Discards what an interrupted or an earlier computation left on MuJoCo's stack.
inline void clear_stack(mjData& d) { d.pstack = d.pbase = 0; }
inline void clear_caches(const mjModel& m, mjData& d) {
  std::fill_n(d.qH, m.nC, 0.0);
  d.flg_rnepost = d.flg_subtreevel = d.flg_energypos = d.flg_energyvel = false;
}

// Iterations of the constraint solver in the last step, of each island.
inline const int* solver_iterations(const mjData& d) { return d.solver_niter; }
constexpr const char* kSolverIterations = "solver_niter";
constexpr int kSolverIterationsCount = mjNISLAND;

// The arrays of the part Lag::frames.
inline constexpr std::array kFrameArrays{"geom_xpos", "geom_xmat",  "geom_xquat", "cam_xpos",
                                         "cam_xmat",  "light_xpos", "light_xdir"};

// Computes the frame of one geom as mj_kinematics does.
inline void update_frame(const mjModel& m, mjData& d, int geom) {
  const int body = m.geom_bodyid[geom], sameframe = m.geom_sameframe[geom];
  mj_local2Global(&d, d.geom_xpos + 3 * geom, d.geom_xmat + 9 * geom, m.geom_pos + 3 * geom, m.geom_quat + 4 * geom,
                  body, m.geom_sameframe[geom]);
  double* const quat = d.geom_xquat + 4 * geom;
  if (sameframe == mjSAMEFRAME_NONE)
    mju_mulQuat(quat, d.xquat + 4 * body, m.geom_quat + 4 * geom);
  else  // a product with the geom's own quaternion could turn -0 into +0
    std::copy_n((sameframe == mjSAMEFRAME_BODY || sameframe == mjSAMEFRAME_BODYROT ? d.xquat : d.xiquat) + 4 * body, 4,
                quat);
}

// Resets what mj_setConst reads, so that it computes the same as with a new mjData.
inline void reset_for_constants(const mjModel& m, mjData& d) { mj_resetData(&m, &d); }

// ---- Geom pairs ----

// Whether collision detection sorts the geom pairs of two bodies by the geoms' numbers.
constexpr bool kSortsPairs = true;

// The flags (opt.enableflags, opt.disableflags) that change which pairs this version finds, and with which parameters.
constexpr int kSearchEnabled = mjENBL_OVERRIDE | mjENBL_SLEEP | mjENBL_IPC | mjENBL_SPECULATIVE;
constexpr int kSearchDisabled = mjDSBL_MIDPHASE;
// Whether the model has another setting that changes which pairs this version finds.
inline bool has_search_settings(const mjModel& m) {
  constexpr mjtSize kMaxBodies = 0x7fff;  // the signature of a pair has 16 bits for each body
  const double* surfacevel = m.geom_surfacevel;
  return m.nflex > 0 || m.nbody > kMaxBodies ||
         std::any_of(surfacevel, surfacevel + 6 * m.ngeom, [](double v) { return v != 0; });
}

inline double mixed_margin(double a, double b) { return a + b; }

// Whether MuJoCo finds other contacts of a body with the world if their geoms are in a list of pairs. Of bodies with
// several geoms it compares boxes first. It takes planes for boxes of 1e10 m, whose rounded numbers hide contacts in
// which geoms overlap by less than about 1e-6 m.
inline bool needs_search(const mjModel& m, int body) { return m.body_geomnum[0] > 1 || m.body_geomnum[body] > 1; }

// Appends a pair to the arrays that only this version has. equal: both geoms have the same priority. If not, the
// parameters are those of the geom `first`.
inline void append_more(Pairs& pairs, const mjModel& m, int g1, int g2, int first, bool equal) {
  pairs.adhesion.push_back(equal ? m.geom_adhesion[g1] + m.geom_adhesion[g2] : m.geom_adhesion[first]);
  pairs.solreffriction.insert(pairs.solreffriction.end(), mjNREF, 0.0);
  const auto bodies = std::minmax(m.geom_bodyid[g1], m.geom_bodyid[g2]);
  pairs.signature.push_back((bodies.first << 16) + bodies.second);
}

// Excludes from the search all bodies but those of `searched`.
inline void exclude_bodies(Pairs& pairs, const mjModel& m) {
  pairs.contype.assign(static_cast<std::size_t>(m.nbody), 0);
  pairs.conaffinity = pairs.contype;
  for (const int geom : pairs.searched) {
    const int body = m.geom_bodyid[geom];
    pairs.contype[static_cast<std::size_t>(body)] = m.body_contype[body];
    pairs.conaffinity[static_cast<std::size_t>(body)] = m.body_conaffinity[body];
  }
}

// Makes collision detection test the listed pairs, and those of `searched`.
inline void use_pairs(mjModel& view, Pairs& pairs) {
  view.body_contype = pairs.contype.data();
  view.body_conaffinity = pairs.conaffinity.data();
  view.pair_signature = pairs.signature.data();
  view.pair_solreffriction = pairs.solreffriction.data();
  view.pair_adhesion = pairs.adhesion.data();
}

// ---- Own arrays of rows ----

// Flags of mjOption that no row can change, because a row's state lacks what they depend on.
inline int fixed_flags(const mjModel& m, bool enable) {
  const bool has_kinetic = std::count(m.sensor_type, m.sensor_type + m.nsensor, mjSENS_E_KINETIC) > 0;
  return enable ? mjENBL_SLEEP | mjENBL_IPC | (has_kinetic ? mjENBL_ENERGY : 0) : int{mjDSBL_SENSOR};
}
constexpr int kLastIntegrator = mjINT_IMPLICITFAST;

// Whether an array of real numbers holds indices: eq_data does for equality constraints of flexes.
inline bool has_indices(const mjModel& m, const std::string& name) {
  return name == "eq_data" && std::any_of(m.eq_type, m.eq_type + m.neq, [](int type) {
           return type == mjEQ_FLEX || type == mjEQ_FLEXVERT || type == mjEQ_FLEXSTRAIN;
         });
}
// Flags that say which frames coincide. In this version mj_setConst computes them.
inline const std::vector<const char*> kSameframes{"body_sameframe", "geom_sameframe", "site_sameframe"};
// The arrays of mjModel that mj_setConst writes, as MuJoCo's header lists them.
inline const std::vector<const char*> kConstants = [] {
  std::vector<const char*> names;
#define X(name, fixed, kin0, inert0, spring) \
  if constexpr (((fixed) | (kin0) | (inert0) | (spring)) & mjSC_OUT) names.push_back(#name);
  MJSETCONST_ARRAYS
#undef X
#define X(name) names.push_back(#name);
  MJSETCONST_SCALARS
#undef X
  return names;
}();
// Arrays that only in this version decide which pairs MuJoCo's search finds, or from which mj_setConst computes such
// arrays. The search compares boxes in the frames of the bodies' inertia.
inline const std::vector<const char*> kMoreSearch{"body_ipos",    "body_iquat",       "geom_aabb",
                                                  "bvh_aabb",     "body_margin",      "geom_surfacevel",
                                                  "body_contype", "body_conaffinity", "hfield_size"};
// How many boxes of bvh_aabb belong to bodies. Those of meshes, which mj_setConst leaves alone, follow.
inline std::int64_t body_boxes(const mjModel& m) {
  int count = 0;
  for (int i = 0; i < m.nbody; ++i) count = std::max(count, m.body_bvhadr[i] + m.body_bvhnum[i]);
  return count;
}
// Of each element of an array, whether its sign decides which variables an actuator's state consists of. Empty: none.
inline std::vector<bool> fixed_signs(const mjModel& m, const std::string& name) {
  const bool is_bias = name == "actuator_biasprm";
  const int columns = name == "actuator_dynprm" ? mjNDYN : name == "actuator_gainprm" ? mjNGAIN : is_bias ? mjNBIAS : 0;
  std::vector<bool> fixed;
  for (int i = 0; columns > 0 && i < m.nactuator; ++i) {
    const int dyn = m.actuator_dyntype[i], gain = m.actuator_gaintype[i];
    const bool is_motor = dyn == mjDYN_DCMOTOR || gain == mjGAIN_DCMOTOR || m.actuator_biastype[i] == mjBIAS_DCMOTOR;
    const bool is_pid = dyn == mjDYN_PID || gain == mjGAIN_PID;
    fixed.insert(fixed.end(), static_cast<std::size_t>(columns), is_motor || (is_pid && !is_bias));
  }
  return fixed;
}
// Calls visit(name, pointer, count, source) for each input of mjData that only this version has. mj_resetData copies
// `source` to the input.
template <typename Visit>
void for_each_more_input(const mjModel& m, const mjData& d, const Visit& visit) {
  visit("eq_active", d.eq_active, m.neq, m.eq_active0);
}

// ---- Drawing ----

// mjenv_render_settings.visual has the flags of MuJoCo 2.2.2. Returns the index of such a flag in this version's
// mjvOption.flags.
constexpr int visual_flag(int flag) { return flag < mjVIS_ISLAND ? flag : flag + 1; }
// mjenv_label has the labels of MuJoCo 2.2.2, which lacks those of flexes and of contact points. Returns this version's
// mjtLabel.
constexpr int label_kind(int label) {
  return label < mjLABEL_FLEX ? label : label + 1 < mjLABEL_CONTACTPOINT ? label + 1 : label + 2;
}

// The pixels of all textures.
inline const mjtByte* pixels_of(const mjModel& m) { return m.tex_data; }
// Makes MuJoCo draw materials with the textures that the model gives them.
inline void use_textures(const mjModel& m, mjrContext& context) {
  std::copy_n(m.mat_texid, mjNTEXROLE * std::min<mjtSize>(m.nmat, mjMAXMATERIAL), context.mat_texid);
}

inline void move_camera(const mjModel& m, int action, double dx, double dy, const mjvScene&, mjvCamera& camera) {
  mjv_moveCamera(&m, action, dx, dy, &camera);
}

}  // namespace mjenv::core
