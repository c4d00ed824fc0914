// The models with which lanes for MuJoCo 4.0 are tested, beside those of the robots.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/model.hpp"

namespace mjenv::core::twins {

// All joints, two of them in one body, a body whose frame has negative zeros, all kinds of frames, and a long tree.
inline constexpr const char* kOdd =
    R"(<mujoco><option integrator='RK4'><flag energy='enable'/></option><worldbody><geom type='plane' size='9 9 1'/>
    <body pos='0 0 2'><freejoint/><geom size='0.1'/><site name='s' pos='0.1 0 0' euler='10 20 30'/><site name='r'/>
    <body pos='0.3 -0 0' euler='30 0 -0'><joint type='ball' pos='0 0.1 -0'/><geom type='box' size='0.1 0.2 0.3' pos='0.1 0 0'/>
    <body pos='0.3 0 0'><joint axis='0 1 0'/><joint axis='1 -0 0' pos='0.1 0 0'/><joint type='slide' axis='0 0 1'/>
    <geom type='capsule' size='0.05' fromto='0 0 0 0.2 0.1 0'/><geom size='0.02' pos='-0.1 0 0' euler='0 45 0'/>
    <body pos='0.2 0.1 0'><joint axis='1 1 1'/><geom size='0.05' pos='0.1 0 0'/></body></body></body></body>
    <body pos='0 1 1'><joint axis='-0 1 0' pos='0.1 0 -0' damping='0.3'/><geom size='0.1' pos='0.2 0 0'/></body>
    </worldbody></mujoco>)";

// Springs, dampers, a fluid with wind, and actuators with constant and affine gains whose controls and forces have limits.
inline constexpr const char* kForces = R"(<mujoco><option density='900' viscosity='0.3' wind='0.3 -1 0.2'/>
    <default><geom size='0.1'/></default><worldbody><body pos='0 0 1'><freejoint/><geom/>
    <body pos='0.3 0 0'><joint name='a' axis='0 1 0' stiffness='3' springref='20' damping='0.4'/><geom type='capsule' size='0.05' fromto='0 0 0 0.3 0 0'/>
    <body pos='0.3 0 0'><joint name='b' type='slide' axis='1 0 0' stiffness='7' damping='0.2' actuatorfrcrange='-2 1'/><geom type='box' size='0.1 0.05 0.02'/></body></body></body>
    <body pos='0 1 0'><joint name='c' axis='0 0 1' damping='0.1'/><geom pos='0.2 0 0'/></body></worldbody>
    <actuator><motor joint='a' gear='30' ctrlrange='-0.5 0.4'/><position joint='b' kp='40' forcerange='-3 5'/><velocity joint='c' kv='2' gear='-0.5'/>
    <general joint='c' gaintype='affine' gainprm='1 2 3' biastype='affine' biasprm='0.1 -2 -0.3' gear='0'/><motor joint='b' gear='2'/></actuator>
    </mujoco>)";

// Two trees on a plane, whose islands differ from row to row.
inline constexpr const char* kTrees = R"(<mujoco><worldbody><geom type='plane' size='9 9 1'/>
    <body pos='0 0 0.2'><joint type='slide' axis='0 0 1'/><joint axis='0 1 0' range='-30 30'/><geom size='0.2' condim='1'/>
    <body pos='0.3 0 0'><joint axis='1 0 0' range='-20 20'/><geom type='capsule' size='0.1 0.2'/></body></body>
    <body pos='2 0 0.1'><joint type='slide' axis='0 0 1'/><joint type='slide' axis='1 0 0'/><geom size='0.1'/></body>
    </worldbody></mujoco>)";

// Of three trees, two that do not follow each other touch: lanes do not solve such islands.
inline constexpr const char* kApart =
    R"(<mujoco><default><geom size='0.1'/></default><worldbody><geom type='plane' size='9 9 1'/>
    <body pos='0 0 0.1'><joint type='slide' axis='0 0 1'/><joint type='slide' axis='1 0 0'/><geom/></body>
    <body pos='5 0 0.1'><joint type='slide' axis='0 0 1'/><geom/></body>
    <body pos='0.2 0 0.1'><joint type='slide' axis='0 0 1'/><joint type='slide' axis='1 0 0'/><geom/></body></worldbody></mujoco>)";

// A robot with friction, contacts of all dimensions, an equality, and gravity that is compensated for a body. Actuators,
// some of whose forces reach their limits, are damped.
inline constexpr const char* kRobot =
    R"(<mujoco><option cone='elliptic' impratio='4' integrator='implicitfast'/><default><geom size='0.1'/>
    <joint damping='0.2' frictionloss='0.3' armature='0.01' range='-40 40'/></default><worldbody><geom type='plane' size='9 9 1' condim='1'/>
    <body pos='0 0 0.15' gravcomp='0.4'><freejoint/><geom/><geom pos='0.3 0 -0.1' condim='1'/>
    <body name='arm' pos='0.3 0 0'><joint name='a' axis='0 1 0'/><geom type='capsule' size='0.05 0.2' condim='4' euler='90 0 0'/>
    <body name='hand' pos='0 0.3 0'><site name='tip' pos='0.1 0 0' euler='10 20 30'/><joint name='b' axis='1 0 0' frictionloss='0'/><geom condim='6' friction='0.7 0.1 0.05'/></body></body>
    <body pos='-0.3 0 0'><site name='tail' euler='0 40 0'/><joint name='c' type='slide' axis='0 0 1' actuatorfrcrange='-9 9' range='-0.2 0.1'/><geom condim='6'/></body></body>
    <body name='d' pos='2 0 0.1'><joint type='slide' axis='0 0 1' limited='false'/><joint name='e' type='slide' axis='1 0 0' range='-0.1 0.3'/><geom/></body>
    </worldbody><equality><joint joint1='a' joint2='b' polycoef='0.1 0.5 0 0 0'/></equality>
    <actuator><position joint='a' kp='20' kv='3' forcerange='-4 3'/><velocity joint='c' kv='8' gear='2'/><motor joint='b'/>
    <general joint='b' gaintype='affine' gainprm='1 0.2 0.7' biastype='affine' biasprm='0 -1 -0.6' gear='-3'
    ctrlrange='-0.4 0.5'/></actuator></mujoco>)";

// Tendons along joints: one along many, in another order than that of their dofs, one with a coefficient of -0,
// and one between two trees.
inline constexpr const char* kTendons =
    R"(<mujoco><option/><default><geom size='0.1'/><joint damping='0.2' armature='0.1'/></default><worldbody>
    <geom type='plane' size='9 9 1'/><body pos='0 0 0.5'><joint name='a' type='slide' axis='0 0 1'/><joint name='b' axis='0 1 0'/><geom/>
    <body pos='0.3 0 0'><joint name='c' axis='1 0 0'/><joint name='d' axis='0 1 0'/><geom type='capsule' size='0.05 0.2'/>
    <body pos='0.3 0 0'><joint name='e' type='slide' axis='1 0 0'/><joint name='f' axis='0 0 1'/><joint name='h' axis='1 0 0'/><geom condim='4'/></body></body></body>
    <body name='other' pos='0 3 0.2'><joint name='g' axis='0 1 0'/><geom type='capsule' size='0.05 0.2'/></body></worldbody><tendon>
    <fixed name='t' range='-0.3 0.4' margin='0.1' frictionloss='0.4'><joint joint='f' coef='-1.5'/><joint joint='b' coef='0.7'/><joint joint='a' coef='2'/>
    <joint joint='e' coef='-3'/><joint joint='d' coef='1'/><joint joint='c' coef='0.3'/></fixed>
    <fixed name='u'><joint joint='c' coef='-0'/><joint joint='h' coef='0.2'/></fixed>
    <fixed name='v' range='-0.2 0.3'><joint joint='g' coef='-2'/><joint joint='a' coef='1'/></fixed></tendon></mujoco>)";

// Tendons along sites, of bodies of all kinds: between trees, within one, to the world and to a body without joints. One
// has a spring and a damper, and one pulls.
inline constexpr const char* kStrings = R"(<mujoco><option/><default><geom size='0.1'/><joint armature='0.1'/></default>
    <worldbody><geom type='plane' size='9 9 1'/><site name='w' pos='0 0 2'/><site name='x' pos='0 1 2'/>
    <body pos='0 0 0.5'><freejoint/><geom/><site name='a' pos='0.1 0 0'/>
    <body pos='0.3 0 0'><joint axis='1 0 0'/><geom type='capsule' size='0.05 0.2'/><site name='b'/>
    <body pos='0.3 0 0'><joint type='ball'/><geom/><site name='c' pos='0 0.1 0'/><body pos='0.1 0 0'><geom/><site name='d'/></body></body></body></body>
    <body name='other' pos='0 3 0.2'><joint axis='0 1 0'/><joint type='slide' axis='0 0 1'/><geom type='capsule' size='0.05 0.2'/><site name='e' pos='0.1 0 0'/>
    <site name='f' pos='0.2 0 0'/></body></worldbody><tendon>
    <spatial name='t' range='0.5 1.2' margin='0.1' frictionloss='0.4'><site site='w'/><site site='a'/><site site='c'/></spatial>
    <spatial name='u' stiffness='9' damping='0.4' springlength='0.1 0.3'><site site='b'/><site site='d'/></spatial>
    <spatial name='v' stiffness='3'><site site='d'/><site site='e'/><site site='f'/><site site='x'/><site site='w'/></spatial></tendon>
    <actuator><motor tendon='v' gear='3'/><position tendon='u' kp='7' kv='1'/></actuator></mujoco>)";

std::shared_ptr<const Model> with_sensors(const std::string& option, const std::string& flag, const std::string& more);

// The same model, but its bodies touch only the world.
std::string listed(std::string text);

// Limits of all kinds and contacts of all dimensions, with impedances of all shapes.
std::string limits(const std::string& option, bool has_friction = false);

// The text without its first part that begins and ends with these.
std::string without(std::string text, const std::string& begin, const std::string& end);

// A hedgehog on a plane: the constraints of some rows are too many for lanes, and rows that lie on other spikes have contacts
// at other places.
std::string hedgehog(const std::string& option, int spikes, const std::string& more = "");

using Named = std::pair<std::string, std::shared_ptr<const Model>>;

// All of these, the robots, and variants of them.
std::vector<Named> models();

}  // namespace mjenv::core::twins
