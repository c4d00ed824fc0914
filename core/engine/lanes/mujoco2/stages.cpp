// Which stages of a step, and which models, the lane code computes.
#include "engine/lanes/frame/stages.hpp"

#include <algorithm>
#include <set>

#include "engine/lanes/frame/lane_arrays.hpp"
#include "engine/lanes/frame/stepper.hpp"
#include "engine/lanes/mujoco2/model_tables.hpp"
#include "engine/lanes/mujoco2/sensing.hpp"
#include "engine/lanes/mujoco2/solver.hpp"
#include "engine/lanes/mujoco2/unlisted.hpp"
#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {
namespace {

std::string text_if(bool condition, const char* text) { return condition ? text : ""; }

// ---- Obstacles ----

std::string excess(const Model& model) {
  const std::string array = excessive_array(*model.get());
  return array.empty() ? "" : "a number in " + array + " that is not finite or whose absolute value is above 1e10";
}

std::string no_joints(const Model& model) { return text_if(model.get()->nv == 0, "no joints"); }

std::string noise(const Model& model) {
  return text_if(model.get()->opt.enableflags & mjENBL_SENSORNOISE, "noise of sensors (opt.enableflags)");
}

std::string comparison(const Model& model) {
  return text_if(model.get()->opt.enableflags & mjENBL_FWDINV,
                 "the comparison of forward and inverse dynamics (opt.enableflags)");
}

std::string callbacks(const Model& /*model*/) {
  return text_if(mjcb_passive || mjcb_control || mjcb_contactfilter || mjcb_sensor || mjcb_time || mjcb_act_dyn ||
                     mjcb_act_gain || mjcb_act_bias,
                 "the process's MuJoCo callbacks");
}

// ---- Stages ----

bool always(const Model& /*model*/) { return true; }
std::string never(const Model& /*model*/) { return ""; }

bool has_actuation(const Model& model) { return model.get()->nu > 0 || model.get()->ntendon > 0; }
std::string actuation(const Model& model) { return actuation_obstacle(*model.get()); }
std::string passive(const Model& model) { return passive_obstacle(*model.get()); }
std::string solver(const Model& model) { return Solver::unsupported_feature(*model.get()); }

// MuJoCo's functions for tendons and actuators. The moments of adhesion depend on contacts and constraints, so these come
// first.
void compute_actuation(Work& work, const mjModel& m, mjData& d) {
  mj_tendon(&m, &d);
  if (has_adhesion(m)) {
    for (int geom = 0; geom < m.ngeom; ++geom) update_frame(m, d, geom);
    mjenv_collision(&work.stepped(), &d);
    mj_makeConstraint(&m, &d);
  }
  mj_transmission(&m, &d);
  if (mj_isSparse(&m))
    mju_mulMatVecSparse(d.ten_velocity, d.ten_J, d.qvel, m.ntendon, d.ten_J_rownnz, d.ten_J_rowadr, d.ten_J_colind,
                        nullptr);
  else
    mju_mulMatVec(d.ten_velocity, d.ten_J, d.qvel, m.ntendon, m.nv);
  mju_mulMatVec(d.actuator_velocity, d.actuator_moment, d.qvel, m.nu, m.nv);
  mj_fwdActuation(&m, &d);
}

void compute_passive(Work& /*work*/, const mjModel& m, mjData& d) { mj_passive(&m, &d); }

bool has_contacts(const Model& model) {
  const ModelTables tables(model);
  return !tables.knows_pairs || !tables.pairs.empty();
}

// If lanes have no list of pairs of geoms, MuJoCo searches for them row by row.
std::string contacts(const Model& model) {
  if (has_adhesion(*model.get())) return "adhesion reads them";
  return text_if(!ModelTables(model).knows_pairs, "the search for pairs of geoms");
}

const char* shape(const mjModel& m, int geom) {
  static const char* const names[] = {"plane",     "height field", "sphere", "capsule",
                                      "ellipsoid", "cylinder",     "box",    "mesh"};
  return names[m.geom_type[geom]];
}

// The pairs of shapes in the model for which MuJoCo's functions find the contacts.
std::string other_shapes(const Model& model) {
  std::set<std::string> found;
  for (const ContactPair& pair : ModelTables(model).contact_pairs)
    if (pair.shapes == Shapes::others)
      found.insert(std::string(shape(*model.get(), pair.geom1)) + " and " + shape(*model.get(), pair.geom2));
  std::string text;
  for (const std::string& one : found) text += (text.empty() ? "" : ", ") + one;
  return text.empty() ? "" : text + ", where they are near";
}

bool has_constraints(const Model& model) {
  const mjModel& m = *model.get();
  const auto any = [](const auto* values, int count) {
    return std::any_of(values, values + count, [](auto x) { return x > 0; });
  };
  return (m.opt.disableflags & mjDSBL_CONSTRAINT) == 0 &&
         (has_contacts(model) || m.neq > 0 || any(m.jnt_limited, m.njnt) || any(m.tendon_limited, m.ntendon) ||
          any(m.dof_frictionloss, m.nv) || any(m.tendon_frictionloss, m.ntendon));
}

std::string constraints(const Model& model) {
  if (std::string why = solver(model); !why.empty()) return "the solver is computed row by row";
  return contacts(model);
}

bool has_sensors(const Model& model) { return sensor_needs(*model.get()) != SensorNeeds::nothing; }
std::string other_sensors(const Model& model) {
  const mjModel& m = *model.get();
  const std::string rays = text_if(has_rangefinders(m), "rangefinders"),
                    cameras = text_if(sees_from_cameras(m), "frames of cameras");
  return rays.empty() || cameras.empty() ? rays + cameras : rays + " and " + cameras;
}

bool has_energies(const Model& model) { return (model.get()->opt.enableflags & mjENBL_ENERGY) != 0; }
std::string energies(const Model& /*model*/) { return "only where they are read"; }

}  // namespace

std::string absence() { return ""; }

const std::vector<Obstacle>& obstacles() {
  static const std::vector<Obstacle> list{
      {"no joints", "nothing moves", no_joints},
      {"`sensornoise`", "all rows draw from one generator", noise},
      {"`fwdinv`", "it reads and writes nearly all of mjData", comparison},
      {"MuJoCo's callbacks in the process", "they may read and write all of mjData", callbacks},
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
      {"kinematics, centres of mass, inertia",
       "all joints, mocap bodies",
       "",
       {MJENV_FUNCTION(adopt), MJENV_SHOW(kinematics), MJENV_SHOW(comPos), MJENV_COMPUTE(crb), MJENV_COMPUTE(factorM),
        MJENV_SHOW(comVel), MJENV_SHOW(rne)},
       always,
       never,
       never},
      {"tendons, actuators",
       "tendons along joints, sites and pulleys and around geoms; actuators of joints, tendons and sites, with all "
       "gains, biases and states",
       "all, if Jacobians of tendons are sparse, an actuator is an adhesion or a slider-crank or has a reference site, "
       "or the model disables actuation",
       {MJENV_SHOW(tendon), MJENV_SHOW(transmission), MJENV_SHOW(fwdVelocity), MJENV_COMPUTE(fwdActuation),
        MJENV_FUNCTION(advanceActivations)},
       has_actuation,
       actuation,
       never,
       compute_actuation,
       kActuation},
      {"passive forces",
       "springs and dampers; the fluid models of boxes and ellipsoids",
       "all, if Jacobians of tendons are sparse",
       {MJENV_SHOW(passive)},
       always,
       passive,
       never,
       compute_passive,
       kPassive},
      {"accelerations without constraints",
       "all, with forces in `qfrc_applied` and `xfrc_applied`",
       "",
       {MJENV_COMPUTE(fwdAcceleration)},
       always,
       never,
       never},
      {"contacts",
       "planes with spheres, capsules, ellipsoids, cylinders and boxes; spheres with spheres, capsules and boxes; "
       "capsules with capsules; up to 6 dimensions",
       "other shapes, where bounding spheres and boxes are near each other; all in models with adhesion, or if lanes "
       "cannot list the pairs of geoms",
       {MJENV_FUNCTION(reject), MJENV_FUNCTION(collision)},
       has_contacts,
       contacts,
       other_shapes},
      {"constraints",
       "all equality constraints, friction and limits of joints, balls and tendons, contacts with pyramidal or "
       "elliptic cones",
       "all in models with adhesion, if lanes cannot list the pairs of geoms, or if the solver is computed row by row; "
       "those of a step's last evaluation if the task or the option `arrays` reads arrays that lanes do not write",
       {MJENV_FUNCTION(instantiateLimit), MJENV_FUNCTION(makeConstraint)},
       has_constraints,
       constraints,
       never},
      {"solver",
       "Newton, CG, PGS and noslip; up to 64 constraints of a row",
       "all, if Jacobians of tendons are sparse, or any Jacobians with PGS or noslip; in models with elliptic cones, "
       "noslip or sparse Jacobians, also what the stage before makes row by row",
       {MJENV_FUNCTION(solNewton), MJENV_FUNCTION(solCG), MJENV_FUNCTION(solPGS), MJENV_FUNCTION(solNoSlip)},
       has_constraints,
       solver,
       never},
      {"integration",
       "Euler, RK4 and implicit",
       "",
       {MJENV_FUNCTION(Euler), MJENV_FUNCTION(implicit), MJENV_FUNCTION(RungeKutta)},
       always,
       never,
       never},
      {"sensors",
       "all but those of the next column",
       "rangefinders, frames of cameras; all sensors of a row whose constraints are made row by row, if a sensor reads "
       "constraints",
       {MJENV_FUNCTION(sensors)},
       has_sensors,
       never,
       other_sensors},
      {"forces between bodies (`cacc`, `cfrc_int`, `cfrc_ext`), where a task or the option `arrays` names them",
       "all",
       "those of rows whose constraints are made row by row",
       {MJENV_FUNCTION(rnePostConstraint)},
       always,
       never,
       never},
      {"energies", "", "all, where they are read", {}, has_energies, energies, never}};
  return list;
}

}  // namespace mjenv::core::lanes
