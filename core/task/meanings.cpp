#include "task/task_field.hpp"

#include <algorithm>
#include <iterator>

namespace mjenv::core {
namespace {

struct Meaning {
  const char *name, *text;
};

// Sorted by name, for the binary search. A field described as "cost of ..." holds the negative of the cost.
constexpr Meaning kMeanings[] = {
    {"cart", "position of the cart, m"},
    {"cfrc_ext", "external torque and force on each body, N m, N: 6 per body"},
    {"cinert", "inertia and mass of each body about the centre of mass of its tree, kg m^2, kg m, kg: 10 per body"},
    {"cos", "cosines of the angles of the hinges"},
    {"cvel", "angular and linear velocity of each body about the centre of mass of its tree, rad/s, m/s: 6 per body"},
    {"distance_from_origin", "distance from the origin in the plane, m"},
    {"distance_penalty", "cost of the tip's distance from its upright position"},
    {"forward_reward", "reward for the velocity along x"},
    {"goal", "position of the goal, m"},
    {"object", "position of the object, m"},
    {"qfrc_actuator", "forces of the actuators on the degrees of freedom, N, N m"},
    {"qfrc_constraint", "forces of the constraints on the degrees of freedom, N, N m"},
    {"qpos", "positions of the joints, m, rad"},
    {"qvel", "velocities of the joints, m/s, rad/s"},
    {"reward", "the sum of all rewards and costs"},
    {"reward_alive", "reward for being healthy"},
    {"reward_contact", "cost of the squared contact forces"},
    {"reward_ctrl", "cost of the squared action"},
    {"reward_dist", "cost of the distance to the target, or in Pusher of the object's distance from its goal"},
    {"reward_forward", "reward for the velocity along x"},
    {"reward_fwd", "reward for the velocity along x"},
    {"reward_impact", "cost of the squared contact forces"},
    {"reward_linup", "reward for the height of the torso"},
    {"reward_linvel", "reward for the velocity along x"},
    {"reward_near", "cost of the distance of the fingertip from the object"},
    {"reward_quadctrl", "cost of the squared action"},
    {"reward_run", "reward for the velocity along x"},
    {"reward_survive", "reward for being healthy"},
    {"sin", "sines of the angles of the hinges"},
    {"skipped_qpos", "positions that are left out"},
    {"target", "position of the target, m"},
    {"ten_length", "lengths of the tendons"},
    {"ten_velocity", "velocities of the tendons"},
    {"tendon_length", "lengths of the tendons"},
    {"tendon_velocity", "velocities of the tendons"},
    {"tips_arm", "position of the fingertip, m"},
    {"to_target", "vector from the target to the fingertip, m"},
    {"velocity_penalty", "cost of the angular velocities of the poles"},
    {"x_position", "position along x, m"},
    {"x_velocity", "velocity along x, m/s"},
    {"y_position", "position along y, m"},
    {"y_velocity", "velocity along y, m/s"},
    {"z_distance_from_origin", "height above the start, m"},
};

}  // namespace

const char* meaning(const std::string& name) {
  const auto* found = std::lower_bound(std::begin(kMeanings), std::end(kMeanings), name,
                                       [](const Meaning& m, const std::string& wanted) { return m.name < wanted; });
  return found != std::end(kMeanings) && found->name == name ? found->text : "";
}

}  // namespace mjenv::core
