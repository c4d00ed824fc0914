// Which models the lane code computes.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "engine/lanes/stepper.hpp"
#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {
namespace {

bool has_callbacks() {
  return mjcb_passive || mjcb_control || mjcb_contactfilter || mjcb_sensor || mjcb_time || mjcb_act_dyn ||
         mjcb_act_gain || mjcb_act_bias;
}

// Numbers that are not greater than those that MuJoCo allows in states cannot make finite states overflow. Where one
// did, the lanes' results would still be checked.
bool is_moderate(const mjtNum* numbers, int count) {
  for (int i = 0; i < count; ++i)
    if (!(std::fabs(numbers[i]) <= mjMAXVAL)) return false;
  return true;
}

// The name of an array with a number that is not moderate, "" if there is none. Only arrays that lanes compute with.
std::string excessive_array(const mjModel& m) {
  const struct {
    const char* name;
    const mjtNum* numbers;
    int count;
  } arrays[] = {{"qpos0", m.qpos0, m.nq},
                {"qpos_spring", m.qpos_spring, m.nq},
                {"body_pos", m.body_pos, 3 * m.nbody},
                {"body_quat", m.body_quat, 4 * m.nbody},
                {"body_ipos", m.body_ipos, 3 * m.nbody},
                {"body_iquat", m.body_iquat, 4 * m.nbody},
                {"body_mass", m.body_mass, m.nbody},
                {"body_inertia", m.body_inertia, 3 * m.nbody},
                {"jnt_pos", m.jnt_pos, 3 * m.njnt},
                {"jnt_axis", m.jnt_axis, 3 * m.njnt},
                {"jnt_stiffness", m.jnt_stiffness, m.njnt},
                {"dof_armature", m.dof_armature, m.nv},
                {"dof_damping", m.dof_damping, m.nv},
                {"dof_M0", m.dof_M0, m.nv},
                {"geom_pos", m.geom_pos, 3 * m.ngeom},
                {"geom_quat", m.geom_quat, 4 * m.ngeom},
                {"site_pos", m.site_pos, 3 * m.nsite},
                {"site_quat", m.site_quat, 4 * m.nsite},
                {"tendon_stiffness", m.tendon_stiffness, m.ntendon},
                {"tendon_damping", m.tendon_damping, m.ntendon},
                {"tendon_lengthspring", m.tendon_lengthspring, m.ntendon},
                {"wrap_prm", m.wrap_prm, m.nwrap},
                {"actuator_gear", m.actuator_gear, 6 * m.nu},
                {"actuator_ctrlrange", m.actuator_ctrlrange, 2 * m.nu},
                {"actuator_gainprm", m.actuator_gainprm, mjNGAIN * m.nu},
                {"actuator_biasprm", m.actuator_biasprm, mjNBIAS * m.nu},
                {"opt.timestep", &m.opt.timestep, 1},
                {"opt.gravity", m.opt.gravity, 3},
                {"opt.wind", m.opt.wind, 3},
                {"opt.density", &m.opt.density, 1},
                {"opt.viscosity", &m.opt.viscosity, 1}};
  for (const auto& array : arrays)
    if (!is_moderate(array.numbers, array.count)) return array.name;
  return "";
}

// Their moments depend on contacts, which are found after all else.
bool has_adhesion(const mjModel& m) {
  return std::any_of(m.actuator_trntype, m.actuator_trntype + m.nu, [](int type) { return type == mjTRN_BODY; });
}

using Names = std::vector<const char*>;

// Of these, Lanes holds each row's numbers.
const Names kInLanes{"body_pos",         "body_quat",      "geom_pos",     "geom_quat",           "site_pos",
                     "site_quat",        "wrap_prm",       "jnt_range",    "jnt_margin",          "tendon_range",
                     "tendon_margin",    "tendon_length0", "eq_data",      "sensor_cutoff",       "body_subtreemass",
                     "actuator_acc0",    "body_mass",      "body_inertia", "body_ipos",           "jnt_stiffness",
                     "dof_armature",     "dof_damping",    "dof_M0",       "tendon_lengthspring", "actuator_gainprm",
                     "actuator_biasprm", "opt.gravity",    "qfrc_applied", "xfrc_applied"};
// These are used by what is computed row by row: the making of constraints, and the numbers of a solver for each row; or
// by no step.
const Names kRowByRow{"geom_friction",
                      "geom_solref",
                      "geom_solimp",
                      "geom_solmix",
                      "geom_rgba",
                      "jnt_solref",
                      "jnt_solimp",
                      "dof_solref",
                      "dof_solimp",
                      "dof_frictionloss",
                      "dof_invweight0",
                      "body_invweight0",
                      "tendon_invweight0",
                      "opt.impratio",
                      "opt.tolerance",
                      "actuator_length0",
                      "opt.iterations",
                      "stat.meaninertia",
                      "stat.meanmass",
                      "stat.meansize",
                      "stat.extent",
                      "stat.center",
                      "cam_pos0",
                      "cam_poscom0",
                      "cam_mat0",
                      "light_pos0",
                      "light_poscom0",
                      "light_dir0",
                      "light_pos",
                      "light_dir",
                      "cam_pos",
                      "cam_quat",
                      "cam_fovy",
                      "site_rgba",
                      "mat_rgba",
                      "tendon_rgba",
                      "userdata",
                      "mocap_pos",
                      "eq_solref",
                      "eq_solimp",
                      "tendon_frictionloss",
                      "tendon_solref_lim",
                      "tendon_solimp_lim",
                      "tendon_solref_fri",
                      "tendon_solimp_fri"};

bool is_in(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

bool computes_own(const std::string& array) { return is_in(kInLanes, array) || is_in(kRowByRow, array); }

std::string obstacle(const Model& model) {
  const mjModel& m = *model.get();
  if (m.nv == 0) return "no joints";
  if (m.opt.integrator != mjINT_EULER && m.opt.integrator != mjINT_RK4) return "the integrator";
  if (m.opt.enableflags & mjENBL_FWDINV) return "the comparison of forward and inverse dynamics (opt.enableflags)";
  if (m.opt.enableflags & mjENBL_SENSORNOISE) return "noise of sensors (opt.enableflags)";
  if (has_adhesion(m)) return "adhesion";
  if (m.ntendon > 0 && mj_isSparse(&m)) return "sparse Jacobians of tendons";
  if (has_callbacks()) return "the process's MuJoCo callbacks";
  const std::string array = excessive_array(m);
  return array.empty() ? "" : "a number in " + array + " that is not finite or greater than 1e10";
}

}  // namespace mjenv::core::lanes
