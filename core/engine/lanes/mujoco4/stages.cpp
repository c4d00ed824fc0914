// Which stages of a step, and which models, the lane code for MuJoCo 4.0 computes.
#include "engine/lanes/frame/stages.hpp"

#include <link.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>

#include "engine/lanes/frame/lane_arrays.hpp"
#include "engine/lanes/frame/stepper.hpp"
#include "engine/lanes/mujoco4/collider.hpp"
#include "engine/lanes/mujoco4/sensing.hpp"
#include "engine/lanes/mujoco4/solver.hpp"
#include "hash.hpp"

namespace mjenv::core::lanes {
namespace {

std::string text_if(bool condition, const char* text) { return condition ? text : ""; }

template <typename Number>
bool any(const Number* numbers, mjtSize count, Number usual) {
  return std::any_of(numbers, numbers + count, [&](Number number) { return number != usual; });
}

// ---- Obstacles ----

std::string no_joints(const Model& model) { return text_if(model.get()->nv == 0, "no joints"); }

std::string comparison(const Model& model) {
  return text_if(model.get()->opt.enableflags & mjENBL_FWDINV,
                 "the comparison of forward and inverse dynamics (opt.enableflags)");
}

std::string flexes(const Model& model) { return text_if(model.get()->nflex > 0, "flexes"); }
std::string plastic(const Model& model) { return text_if(model.get()->nplastic > 0, "plastic joints or tendons"); }
std::string histories(const Model& model) { return text_if(model.get()->nhistory > 0, "delays or histories"); }

std::string inertia(const Model& model) {
  const mjModel& m = *model.get();
  return text_if(any(m.jnt_actuatorid, m.njnt, -1) || any(m.tendon_armature, m.ntendon, 0.0) ||
                     any(m.tendon_actuatorid, m.ntendon, -1),
                 "actuators or tendons with inertia or damping");
}

std::string energies(const Model& model) {
  const mjModel& m = *model.get();
  const bool has = std::any_of(m.sensor_type, m.sensor_type + m.nsensor,
                               [](int type) { return type == mjSENS_E_POTENTIAL || type == mjSENS_E_KINETIC; });
  return text_if(has, "sensors of energies");
}

std::string damping(const Model& model) {
  const mjModel& m = *model.get();
  return text_if(any(m.dof_dampingpoly, m.nv * mjNPOLY, 0.0), "damping that is not linear");
}

// All but mjcb_time, which has no access to mjData. The Python package mujoco sets it.
std::string callbacks(const Model& /*model*/) {
  return text_if(*mjcb_passive || *mjcb_control || *mjcb_contactfilter || *mjcb_sensor || *mjcb_act_dyn ||
                     *mjcb_act_gain || *mjcb_act_bias,
                 "the process's MuJoCo callbacks");
}

std::string discrete(const Model& model) {
  return text_if(model.get()->opt.integrator == mjINT_DISCRETE, "the integrator discrete");
}

std::string excess(const Model& model) {
  const std::string array = excessive_array(*model.get());
  return array.empty() ? "" : "a number in " + array + " that is not finite or whose absolute value is above 1e10";
}

// ---- Stages, row by row ----

bool always(const Model& /*model*/) { return true; }
std::string never(const Model& /*model*/) { return ""; }

void compute_places(Work& work, const mjModel& /*m*/, mjData& d) {
  mj_kinematics(&work.stepped(), &d);
  mj_comPos(&work.stepped(), &d);
}

void compute_inertia(Work& work, const mjModel& /*m*/, mjData& d) {
  mj_makeM(&work.stepped(), &d);
  mj_factorM(&work.stepped(), &d);
}

void compute_velocities(Work& work, const mjModel& /*m*/, mjData& d) {
  mj_comVel(&work.stepped(), &d);
  mj_rne(&work.stepped(), &d, 0, d.qfrc_bias);
}

std::string other_solvers(const Model& model) { return Solver::unsupported_feature(*model.get()); }

void compute_contacts(Work& work, const mjModel& /*m*/, mjData& d) {
  mj_collision(&work.stepped(), &d);
  mj_makeConstraint(&work.stepped(), &d);
}

bool has_actuators(const Model& model) { return model.get()->nactuator > 0; }

bool compensates_by_actuators(const mjModel& m) { return any(m.jnt_actgravcomp, m.njnt, mjtBool{0}); }

std::string actuation(const Model& model) {
  const mjModel& m = *model.get();
  if (m.na > 0) return "states of actuators";
  if (m.nactuator != m.nu || m.nactuator != m.nout) return "actuators with several inputs or outputs";
  if (m.opt.disableflags & mjDSBL_ACTUATION || m.opt.disableactuator) return "disabled actuators";
  if (compensates_by_actuators(m)) return "compensation of gravity by actuators";
  if (any(m.tendon_actfrclimited, m.ntendon, mjtBool{0})) return "tendons that limit the forces of actuators";
  for (int i = 0; i < m.nactuator; ++i) {
    const int object = m.actuator_trnid[2 * i], type = m.actuator_trntype[i];
    const bool is_on_joint = type == mjTRN_JOINT || type == mjTRN_JOINTINPARENT;
    if (type != mjTRN_TENDON &&
        (!is_on_joint || (m.jnt_type[object] != mjJNT_SLIDE && m.jnt_type[object] != mjJNT_HINGE)))
      return "actuators that act on something other than slides, hinges and tendons";
    const int gain = m.actuator_gaintype[i], bias = m.actuator_biastype[i];
    if ((gain != mjGAIN_FIXED && gain != mjGAIN_AFFINE) || (bias != mjBIAS_NONE && bias != mjBIAS_AFFINE) ||
        m.actuator_dyntype[i] != mjDYN_NONE || m.actuator_plugin[i] >= 0)
      return "gains and biases that are neither constant nor affine";
  }
  return "";
}

void compute_actuation(Work& work, const mjModel& /*m*/, mjData& d) {
  const mjModel& m = work.stepped();
  mj_transmission(&m, &d);
  if (m.opt.disableflags & mjDSBL_ACTUATION)
    std::fill_n(d.actuator_velocity, m.nout, 0.0);
  else
    mju_mulMatVecSparse(d.actuator_velocity, d.actuator_moment, d.qvel, m.nout, d.moment_rownnz, d.moment_rowadr,
                        d.moment_colind, nullptr);
  mj_fwdActuation(&m, &d);
}

std::string passive(const Model& model) {
  const mjModel& m = *model.get();
  if (any(m.tendon_stiffnesspoly, m.ntendon * mjNPOLY, 0.0) || any(m.tendon_dampingpoly, m.ntendon * mjNPOLY, 0.0))
    return "springs and dampers of tendons that are not linear";
  for (int i = 0; i < m.njnt; ++i)
    if (m.jnt_stiffness[i] != 0 && (m.jnt_type[i] == mjJNT_FREE || m.jnt_type[i] == mjJNT_BALL))
      return "springs of free joints and balls";
  if (any(m.jnt_stiffnesspoly, m.njnt * mjNPOLY, 0.0)) return "springs that are not linear";
  for (int i = 0; i < m.ngeom; ++i)
    if (m.geom_fluid[mjNFLUID * i] > 0) return "the fluid model of ellipsoids";
  if (compensates_by_actuators(m)) return "compensation of gravity by actuators";
  return m.flg_adhesion ? "adhesion" : "";
}

// Where contacts are found in lanes, this happens after all other stages but constraints.
std::string contacts(const Model& model) {
  const mjModel& m = *model.get();
  if (std::any_of(m.actuator_trntype, m.actuator_trntype + m.nactuator, [](int type) { return type == mjTRN_BODY; }))
    return "actuators that act on bodies";
  if (!other_solvers(model).empty()) return "the solver is computed row by row";
  return Collider::obstacle(model);
}

// Where a later stage is computed row by row, this copies to mjData what that stage reads, too.
std::string tendons(const Model& model) {
  const mjModel& m = *model.get();
  if (std::any_of(m.wrap_type, m.wrap_type + m.nwrap,
                  [](int type) { return type != mjWRAP_JOINT && type != mjWRAP_SITE; }))
    return "tendons around geoms or over pulleys";
  const bool is_alone = actuation(model).empty() && passive(model).empty() && contacts(model).empty();
  return text_if(!is_alone, "a later stage is computed row by row");
}

void compute_tendons(Work& work, const mjModel& /*m*/, mjData& d) {
  const mjModel& m = work.stepped();
  mj_tendon(&m, &d);
  mju_mulMatVecSparse(d.ten_velocity, d.ten_J, d.qvel, m.ntendon, m.ten_J_rownnz, m.ten_J_rowadr, m.ten_J_colind,
                      nullptr);
}

void compute_passive(Work& work, const mjModel& /*m*/, mjData& d) { mj_passive(&work.stepped(), &d); }

void compute_acceleration(Work& work, const mjModel& /*m*/, mjData& d) { mj_fwdAcceleration(&work.stepped(), &d); }

void compute_constraints(Work& work, const mjModel& /*m*/, mjData& d) {
  mj_island(&work.stepped(), &d);
  mj_projectConstraint(&work.stepped(), &d);
  mj_referenceConstraint(&work.stepped(), &d);
  mj_fwdConstraint(&work.stepped(), &d);
}

std::string integration(const Model& model) {
  const mjModel& m = *model.get();
  if (m.na > 0) return "states of actuators";
  if (m.opt.integrator == mjINT_IMPLICIT) return "the integrator implicit";
  if (m.opt.integrator != mjINT_IMPLICITFAST) return "";
  if (m.opt.density > 0 || m.opt.viscosity > 0) return "implicitfast with a fluid";
  if (any(m.tendon_damping, m.ntendon, 0.0) || any(m.tendon_dampingpoly, m.ntendon * mjNPOLY, 0.0))
    return "implicitfast with dampers of tendons";
  if (!actuation(model).empty()) return "implicitfast with actuators that are computed row by row";
  if (std::find(m.actuator_trntype, m.actuator_trntype + m.nactuator, mjTRN_TENDON) != m.actuator_trntype + m.nactuator)
    return "implicitfast with actuators of tendons";
  for (int i = 0; i < m.njnt; ++i)
    if (m.jnt_type[i] == mjJNT_FREE && m.tree_dofnum[m.dof_treeid[m.jnt_dofadr[i]]] == 6)
      return "implicitfast with free bodies that have no other joints";
  return "";
}

// ---- The library ----

// The published libraries, with the hashes of their code. Another compiler may add in another order.
struct Published {
  const char* version;
  std::uint64_t code;
};
constexpr Published kPublished[] = {{"4.0.0", 0x751575f41449f932}, {"4.0.1", 0x1821749a38063305}};

// The hash of the code of the library that has this function.
std::uint64_t hash_of_code(const void* function) {
  struct Search {
    ElfW(Addr) function;
    std::uint64_t hash;
  } search{reinterpret_cast<ElfW(Addr)>(function), 0};
  dl_iterate_phdr(
      [](dl_phdr_info* library, std::size_t /*size*/, void* data) {
        auto& [wanted, value] = *static_cast<Search*>(data);
        for (int i = 0; i < library->dlpi_phnum; ++i) {
          const auto& part = library->dlpi_phdr[i];
          const ElfW(Addr) start = library->dlpi_addr + part.p_vaddr;
          if (part.p_type != PT_LOAD || wanted < start || wanted >= start + part.p_filesz) continue;
          value = core::hash(reinterpret_cast<const void*>(start), part.p_filesz);
          return 1;
        }
        return 0;
      },
      &search);
  return search.hash;
}

}  // namespace

std::string absence() {
  if (!mujoco_is_open()) return "";
  static const std::string why = [] {
    const std::string version = mj_versionString(),
                      follow = "lanes follow the published libraries of MuJoCo 4.0.0 and 4.0.1, and ";
    const auto* const found = std::find_if(std::begin(kPublished), std::end(kPublished),
                                           [&](const Published& known) { return known.version == version; });
    if (found == std::end(kPublished)) return follow + "its library is " + version;
    const bool is_same = hash_of_code(reinterpret_cast<const void*>(mj_version)) == found->code;
    return is_same ? "" : follow + "its library is another build of " + version;
  }();
  return why;
}

const std::vector<Obstacle>& obstacles() {
  static const std::vector<Obstacle> list{
      {"no joints", "nothing moves", no_joints},
      {"`fwdinv`", "it reads and writes nearly all of mjData", comparison},
      {"flexes", "not written yet", flexes},
      {"plastic joints and tendons", "not written yet", plastic},
      {"the integrator discrete", "not written yet", discrete},
      {"delays and histories of actuators and sensors", "their samples lie in mjData", histories},
      {"sensors of energies", "they may have the values of an earlier step", energies},
      {"actuators or tendons with inertia or damping", "not written yet", inertia},
      {"damping that is not linear", "not written yet", damping},
      {"MuJoCo's callbacks in the process, except `mjcb_time`", "they may read and write all of mjData", callbacks},
      {"numbers of the model that are not finite or whose absolute value is above 1e10",
       "computations with such numbers may overflow", excess}};
  return list;
}

#define MJENV_FUNCTION(name) \
  { #name }
#define MJENV_COMPUTE(name) \
  { #name, &Code::name }
#define MJENV_SHOW(name) \
  { #name, &Code::name, true }

const std::vector<Stage>& stages() {
  static const std::vector<Stage> list{
      {"kinematics, centres of mass",
       "all joints, mocap bodies",
       "",
       {MJENV_FUNCTION(adopt), MJENV_SHOW(kinematics), MJENV_SHOW(comPos)},
       always,
       never,
       never,
       compute_places,
       kPlaces},
      {"inertia",
       "all",
       "",
       {MJENV_COMPUTE(crb), MJENV_COMPUTE(factorM)},
       always,
       never,
       never,
       compute_inertia,
       kInertia},
      {"velocities, bias forces",
       "all",
       "",
       {MJENV_SHOW(comVel), MJENV_SHOW(rne)},
       always,
       never,
       never,
       compute_velocities,
       kVelocities},
      {"tendons",
       "along joints and sites",
       "all, if a tendon wraps a geom or has a pulley, or if contacts, passive forces or actuators are computed row by "
       "row",
       {MJENV_SHOW(tendon)},
       [](const Model& model) { return model.get()->ntendon > 0; },
       tendons,
       never,
       compute_tendons,
       kMiddle},
      {"contacts, constraints",
       "contacts of planes with spheres, capsules and cylinders, of spheres and capsules, and of spheres with boxes; "
       "limits, friction, equality constraints",
       "all constraints of rows that the solver does not solve, and of models with several trees that have equality "
       "constraints, friction or elliptic cones; all contacts where other shapes are near each other, in models with "
       "actuators that act on bodies, if lanes cannot list the pairs of geoms, or if the solver is computed row by "
       "row; those of a step's last evaluation if more than the state is read after it",
       {MJENV_FUNCTION(instantiateLimit), MJENV_FUNCTION(collision), MJENV_FUNCTION(makeConstraint)},
       always,
       contacts,
       never,
       compute_contacts,
       kContacts},
      {"passive forces",
       "linear springs of slides, hinges and tendons, linear dampers; the fluid model of boxes; compensation of "
       "gravity",
       "all, if the model has other springs or dampers, the fluid model of ellipsoids, adhesion, or compensation of "
       "gravity by actuators",
       {MJENV_SHOW(passive)},
       always,
       passive,
       never,
       compute_passive,
       kPassive},
      {"actuators",
       "on slides, hinges and tendons, with constant or affine gains and biases",
       "all, if an actuator is another one or has states, or a tendon limits the forces of actuators",
       {MJENV_SHOW(transmission), MJENV_COMPUTE(fwdActuation)},
       has_actuators,
       actuation,
       never,
       compute_actuation,
       kActuation},
      {"accelerations without constraints",
       "without forces in `qfrc_applied` and `xfrc_applied`",
       "rows with such forces are stepped alone",
       {MJENV_COMPUTE(fwdAcceleration)},
       always,
       never,
       never,
       compute_acceleration,
       kAcceleration},
      {"solver",
       "Newton; PGS for limits and contacts with pyramidal cones; up to 64 constraints of a row (PGS: 200)",
       "CG and noslip, sparse Jacobians, islands that are disabled; rows with islands whose dofs do not follow each "
       "other; PGS with elliptic cones, and rows with equalities, friction or several islands",
       {MJENV_FUNCTION(warmstart), MJENV_FUNCTION(begin_island), MJENV_FUNCTION(solNewton),
        MJENV_FUNCTION(projectConstraint), MJENV_FUNCTION(solPGS), MJENV_FUNCTION(dualFinish)},
       always,
       other_solvers,
       never,
       compute_constraints,
       kConstraints},
      {"integration",
       "Euler, RK4 and implicitfast",
       "implicit; all, if actuators have states; implicitfast with fluids, dampers or actuators of tendons, free "
       "bodies without other joints, or actuators that are computed row by row",
       {MJENV_FUNCTION(Euler), MJENV_FUNCTION(implicitfast), MJENV_FUNCTION(RungeKutta)},
       always,
       integration,
       never,
       nullptr,
       kIntegration},
      {"sensors",
       "those of motion and of actuators' forces, if not all of mjData is read after the step",
       "touch; all, if there are others",
       {MJENV_FUNCTION(sensors)},
       [](const Model& model) { return model.get()->nsensor > 0; },
       [](const Model& model) { return other_sensors(*model.get()); },
       [](const Model& model) {
         const mjModel& m = *model.get();
         return text_if(std::find(m.sensor_type, m.sensor_type + m.nsensor, mjSENS_TOUCH) != m.sensor_type + m.nsensor,
                        "touch");
       }}};
  return list;
}

}  // namespace mjenv::core::lanes
