// Lists the arrays whose values may differ from row to row in lanes.
#include <algorithm>
#include <string>
#include <vector>

#include "engine/lanes/stepper.hpp"

namespace mjenv::core::lanes {
namespace {

using Names = std::vector<const char*>;

// The struct Lanes holds each row's own values of these arrays.
const Names kInLanes{"body_pos",         "body_quat",      "geom_pos",     "geom_quat",           "site_pos",
                     "site_quat",        "wrap_prm",       "jnt_range",    "jnt_margin",          "tendon_range",
                     "tendon_margin",    "tendon_length0", "eq_data",      "sensor_cutoff",       "body_subtreemass",
                     "actuator_acc0",    "body_mass",      "body_inertia", "body_ipos",           "jnt_stiffness",
                     "dof_armature",     "dof_damping",    "dof_M0",       "tendon_lengthspring", "actuator_gainprm",
                     "actuator_biasprm", "opt.gravity",    "qfrc_applied", "xfrc_applied",        "geom_size"};
// No step reads these arrays, or only computations that are done row by row: collisions and the parameters of
// constraints and solvers.
const Names kRowByRow{"geom_friction",     "geom_solref",       "geom_solimp",
                      "geom_solmix",       "geom_rgba",         "hfield_data",
                      "jnt_solref",        "jnt_solimp",        "dof_solref",
                      "dof_solimp",        "dof_frictionloss",  "dof_invweight0",
                      "body_invweight0",   "tendon_invweight0", "opt.impratio",
                      "opt.tolerance",     "actuator_length0",  "opt.iterations",
                      "stat.meaninertia",  "stat.meanmass",     "stat.meansize",
                      "stat.extent",       "stat.center",       "cam_pos0",
                      "cam_poscom0",       "cam_mat0",          "light_pos0",
                      "light_poscom0",     "light_dir0",        "light_pos",
                      "light_dir",         "cam_pos",           "cam_quat",
                      "cam_fovy",          "site_rgba",         "mat_rgba",
                      "tendon_rgba",       "userdata",          "mocap_pos",
                      "eq_solref",         "eq_solimp",         "tendon_frictionloss",
                      "tendon_solref_lim", "tendon_solimp_lim", "tendon_solref_fri",
                      "tendon_solimp_fri"};

bool is_in(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

bool computes_own(const std::string& array) { return is_in(kInLanes, array) || is_in(kRowByRow, array); }

}  // namespace mjenv::core::lanes
