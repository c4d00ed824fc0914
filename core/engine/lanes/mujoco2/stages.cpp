// Which stages of a step, and which models, the lane code computes.
#include "engine/lanes/mujoco2/stages.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "engine/lanes/frame/stepper.hpp"
#include "engine/lanes/mujoco2/arrays.hpp"
#include "engine/lanes/mujoco2/model_tables.hpp"
#include "engine/lanes/mujoco2/sensing.hpp"
#include "engine/lanes/mujoco2/solver.hpp"
#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {
namespace {

std::string text_if(bool condition, const char* text) { return condition ? text : ""; }

// ---- Obstacles ----

// Whether all numbers are finite and at most mjMAXVAL, MuJoCo's limit for the numbers of a state. With such numbers,
// computations do not overflow; if they did, the checks of the lanes' results would find it.
bool is_moderate(const mjtNum* numbers, int count) {
  for (int i = 0; i < count; ++i)
    if (!(std::fabs(numbers[i]) <= mjMAXVAL)) return false;
  return true;
}

// Searches arrays whose numbers lanes multiply even where MuJoCo skips a product with 0. Others, such as jnt_range, may
// hold infinite numbers, because lanes compute with them as MuJoCo does. Returns the name of an array with a number
// that is not moderate; "" if there is none.
std::string excessive_array(const mjModel& m) {
#define MJENV_ARRAY(name, count, limit) \
  if (limit == kModerate && !is_moderate(m.name, count)) return #name;
  MJENV_LANES_OWN(MJENV_ARRAY)
  MJENV_LANES_OWN_FRAMES(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, limit) \
  if (limit == kModerate && !is_moderate(first(m.opt.name), count)) return "opt." #name;
  MJENV_LANES_OWN_OPTIONS(MJENV_ARRAY)
#undef MJENV_ARRAY
  return "";
}

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

const std::vector<Obstacle>& obstacles() {
  static const std::vector<Obstacle> list{
      {"no joints", "nothing moves", no_joints},
      {"`sensornoise`", "all rows draw from one generator, so the results depend on their order", noise},
      {"`fwdinv`", "MuJoCo's comparison of forward and inverse dynamics reads and writes nearly all of mjData",
       comparison},
      {"MuJoCo's callbacks in the process", "they may read and write all of mjData", callbacks},
      {"numbers of the model that are not finite or whose absolute value is above 1e10",
       "computations with such numbers may overflow, and products of zeros and infinity are not zeros", excess}};
  return list;
}

const std::vector<Stage>& stages() {
  static const std::vector<Stage> list{
      {"kinematics, centres of mass, inertia", "all joints, mocap bodies", "",
       "adopt kinematics comPos crb factorM comVel rne", always, never, never},
      {"tendons, actuators",
       "tendons along joints, sites and pulleys and around geoms; actuators of joints, tendons and sites, with all "
       "gains, biases and states",
       "all, if Jacobians of tendons are sparse, an actuator is an adhesion or a slider-crank or has a reference site, "
       "or the model disables actuation",
       "tendon transmission fwdVelocity fwdActuation advanceActivations", has_actuation, actuation, never},
      {"passive forces", "springs and dampers; the fluid models of boxes and ellipsoids",
       "all, if Jacobians of tendons are sparse", "passive", always, passive, never},
      {"contacts",
       "planes with spheres, capsules, ellipsoids, cylinders and boxes; spheres with spheres, capsules and boxes; "
       "capsules with capsules; up to 6 dimensions",
       "other shapes, where bounding spheres and boxes are near each other; all in models with adhesion, or if lanes "
       "cannot list the pairs of geoms",
       "reject collision", has_contacts, contacts, other_shapes},
      {"constraints",
       "all equality constraints, friction and limits of joints, balls and tendons, contacts with pyramidal or "
       "elliptic cones",
       "all in models with adhesion, if lanes cannot list the pairs of geoms, or if the solver is computed row by row; "
       "those of a step's last evaluation if the task or the option `arrays` reads arrays that lanes do not write",
       "instantiateLimit makeConstraint", has_constraints, constraints, never},
      {"solver", "Newton, CG, PGS and noslip; up to 64 constraints of a row",
       "all with sparse Jacobians of tendons, or with sparse Jacobians and PGS or noslip; in models with elliptic "
       "cones, noslip or sparse Jacobians, also the constraints that are made row by row",
       "solNewton solCG solPGS solNoSlip", has_constraints, solver, never},
      {"accelerations, integration",
       "accelerations, with forces in `qfrc_applied` and `xfrc_applied`; the integrators Euler, RK4 and implicit", "",
       "fwdAcceleration Euler implicit RungeKutta", always, never, never},
      {"sensors", "all but those of the next column",
       "rangefinders, frames of cameras; all sensors of a row whose constraints are made row by row, if a sensor reads "
       "constraints",
       "sensors", has_sensors, never, other_sensors},
      {"forces between bodies (`cacc`, `cfrc_int`, `cfrc_ext`), where a task or the option `arrays` names them", "all",
       "those of rows whose constraints are made row by row", "rnePostConstraint", always, never, never},
      {"energies", "", "all, where they are read", "", has_energies, energies, never}};
  return list;
}

std::string how(const Stage& stage, const Model& model) {
  if (!stage.is_there(model)) return "absent";
  if (const std::string why = stage.obstacle(model); !why.empty()) return "row by row: " + why;
  const std::string what = stage.partly(model);
  return what.empty() ? "lanes" : "lanes; row by row: " + what;
}

std::string stage_lines(const Model& model) {
  if (!absence().empty()) return "";
  const std::string all = obstacle(model);
  std::string lines;
  for (const Stage& stage : stages())
    lines += std::string(stage.name) + ": " + (all.empty() ? how(stage, model) : "row by row: " + all) + "\n";
  return lines;
}

std::string obstacle(const Model& model) {
  for (const Obstacle& one : obstacles())
    if (std::string found = one.find(model); !found.empty()) return found;
  return "";
}

}  // namespace mjenv::core::lanes
