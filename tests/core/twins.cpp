// Each stage of the lanes for MuJoCo 4.0 computes the bits of the opened library's own functions, from the library's own
// inputs; and so do whole steps.
#include "engine/mujoco.hpp"  // before cmocka's macro fail
#include "error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

// Sanitizers have allocators of their own, whose memory mallinfo2 does not count.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#if __GLIBC_PREREQ(2, 33)
#define COUNTS_MEMORY
#include <malloc.h>
#endif
#endif

#include "engine/errors.hpp"
#include "engine/lanes/frame/lane_arrays.hpp"
#include "engine/lanes/frame/stages.hpp"
#include "engine/lanes/frame/stepper.hpp"
#include "engine/lanes/mujoco4/collider.hpp"
#include "engine/lanes/mujoco4/solver.hpp"
#include "engine/model.hpp"
#include "engine/own_arrays.hpp"
#include "engine/work.hpp"
#include "noise.hpp"
#include "run.hpp"

namespace mjenv::core {
namespace {

constexpr int kRounds = 12;  // with each number of lanes

const char* const kRobots[] = {"ant.xml",
                               "half_cheetah.xml",
                               "hopper.xml",
                               "humanoid.xml",
                               "humanoidstandup.xml",
                               "inverted_double_pendulum.xml",
                               "inverted_pendulum.xml",
                               "pusher_v5.xml",
                               "reacher.xml",
                               "swimmer.xml",
                               "walker2d_v5.xml"};

// All joints, two of them in one body, a body whose frame has negative zeros, all kinds of frames, and a long tree.
constexpr const char* kOdd =
    R"(<mujoco><option integrator='RK4'><flag energy='enable'/></option><worldbody><geom type='plane' size='9 9 1'/>
    <body pos='0 0 2'><freejoint/><geom size='0.1'/><site name='s' pos='0.1 0 0' euler='10 20 30'/><site name='r'/>
    <body pos='0.3 -0 0' euler='30 0 -0'><joint type='ball' pos='0 0.1 -0'/><geom type='box' size='0.1 0.2 0.3' pos='0.1 0 0'/>
    <body pos='0.3 0 0'><joint axis='0 1 0'/><joint axis='1 -0 0' pos='0.1 0 0'/><joint type='slide' axis='0 0 1'/>
    <geom type='capsule' size='0.05' fromto='0 0 0 0.2 0.1 0'/><geom size='0.02' pos='-0.1 0 0' euler='0 45 0'/>
    <body pos='0.2 0.1 0'><joint axis='1 1 1'/><geom size='0.05' pos='0.1 0 0'/></body></body></body></body>
    <body pos='0 1 1'><joint axis='-0 1 0' pos='0.1 0 -0' damping='0.3'/><geom size='0.1' pos='0.2 0 0'/></body>
    </worldbody></mujoco>)";

// Springs, dampers, a fluid with wind, and actuators with constant and affine gains whose controls and forces have limits.
constexpr const char* kForces = R"(<mujoco><option density='900' viscosity='0.3' wind='0.3 -1 0.2'/>
    <default><geom size='0.1'/></default><worldbody><body pos='0 0 1'><freejoint/><geom/>
    <body pos='0.3 0 0'><joint name='a' axis='0 1 0' stiffness='3' springref='20' damping='0.4'/><geom type='capsule' size='0.05' fromto='0 0 0 0.3 0 0'/>
    <body pos='0.3 0 0'><joint name='b' type='slide' axis='1 0 0' stiffness='7' damping='0.2' actuatorfrcrange='-2 1'/><geom type='box' size='0.1 0.05 0.02'/></body></body></body>
    <body pos='0 1 0'><joint name='c' axis='0 0 1' damping='0.1'/><geom pos='0.2 0 0'/></body></worldbody>
    <actuator><motor joint='a' gear='30' ctrlrange='-0.5 0.4'/><position joint='b' kp='40' forcerange='-3 5'/><velocity joint='c' kv='2' gear='-0.5'/>
    <general joint='c' gaintype='affine' gainprm='1 2 3' biastype='affine' biasprm='0.1 -2 -0.3' gear='0'/><motor joint='b' gear='2'/></actuator>
    </mujoco>)";

// Two trees on a plane, whose islands differ from row to row.
constexpr const char* kTrees = R"(<mujoco><worldbody><geom type='plane' size='9 9 1'/>
    <body pos='0 0 0.2'><joint type='slide' axis='0 0 1'/><joint axis='0 1 0' range='-30 30'/><geom size='0.2' condim='1'/>
    <body pos='0.3 0 0'><joint axis='1 0 0' range='-20 20'/><geom type='capsule' size='0.1 0.2'/></body></body>
    <body pos='2 0 0.1'><joint type='slide' axis='0 0 1'/><joint type='slide' axis='1 0 0'/><geom size='0.1'/></body>
    </worldbody></mujoco>)";

// Of three trees, two that do not follow each other touch: lanes do not solve such islands.
constexpr const char* kApart =
    R"(<mujoco><default><geom size='0.1'/></default><worldbody><geom type='plane' size='9 9 1'/>
    <body pos='0 0 0.1'><joint type='slide' axis='0 0 1'/><joint type='slide' axis='1 0 0'/><geom/></body>
    <body pos='5 0 0.1'><joint type='slide' axis='0 0 1'/><geom/></body>
    <body pos='0.2 0 0.1'><joint type='slide' axis='0 0 1'/><joint type='slide' axis='1 0 0'/><geom/></body></worldbody></mujoco>)";

// A robot with friction, contacts of all dimensions, an equality, and gravity that is compensated for a body. Actuators,
// some of whose forces reach their limits, are damped.
constexpr const char* kRobot =
    R"(<mujoco><option cone='elliptic' impratio='4' integrator='implicitfast'/><default><geom size='0.1'/>
    <joint damping='0.2' frictionloss='0.3' armature='0.01' range='-40 40'/></default><worldbody><geom type='plane' size='9 9 1' condim='1'/>
    <body pos='0 0 0.15' gravcomp='0.4'><freejoint/><geom/><geom pos='0.3 0 -0.1' condim='1'/>
    <body name='arm' pos='0.3 0 0'><joint name='a' axis='0 1 0'/><geom type='capsule' size='0.05 0.2' condim='4' euler='90 0 0'/>
    <body pos='0 0.3 0'><joint name='b' axis='1 0 0' frictionloss='0'/><geom condim='6' friction='0.7 0.1 0.05'/></body></body>
    <body pos='-0.3 0 0'><joint name='c' type='slide' axis='0 0 1' actuatorfrcrange='-9 9' range='-0.2 0.1'/><geom condim='6'/></body></body>
    <body name='d' pos='2 0 0.1'><joint type='slide' axis='0 0 1' limited='false'/><joint name='e' type='slide' axis='1 0 0' range='-0.1 0.3'/><geom/></body>
    </worldbody><equality><joint joint1='a' joint2='b' polycoef='0.1 0.5 0 0 0'/></equality>
    <actuator><position joint='a' kp='20' kv='3' forcerange='-4 3'/><velocity joint='c' kv='8' gear='2'/><motor joint='b'/>
    <general joint='b' gaintype='affine' gainprm='1 0.2 0.7' biastype='affine' biasprm='0 -1 -0.6' gear='-3'/></actuator></mujoco>)";

// Limits of all kinds and contacts of all dimensions, with impedances of all shapes; %s stands for a solver.
constexpr const char* kLimits = R"(<mujoco><option impratio='3' %s/><default><geom size='0.1'/></default><worldbody>
    <geom type='plane' size='9 9 1' contype='3' condim='1' solimp='0.8 0.95 0.02 0.4 3'/>
    <body pos='0 0 0.2'><freejoint/><geom condim='4' friction='0.7 0.02 0.001'/><geom type='cylinder' size='0.1 0.1' pos='0 0.1 0' contype='0' conaffinity='2'/>
    <body pos='0.3 0 0'><joint type='ball' range='0 20' solreflimit='-300 -20'/><geom condim='6' friction='1.1 0.02 0.003'/>
    <body pos='0.3 0 0'><joint name='h' axis='0 1 0' range='-10 20' margin='0.1' solimplimit='0.7 0.9 0.3 0.5 1'/><geom condim='3' gap='0.01' margin='0.03'/>
    <body pos='0.3 0 0'><joint name='s' type='slide' range='-0.1 0.05' solimplimit='0.6 0.6 0.1'/>
    <geom type='capsule' size='0.05 0.1' solimp='0.2 0.9 0.4 0.7 2'/></body></body></body></body></worldbody><tendon>
    <fixed range='-0.2 0.3' margin='0.05' solimplimit='0.3 0.9 1 0.2 4'><joint joint='h' coef='1.5'/><joint joint='s' coef='-2'/></fixed>
    </tendon></mujoco>)";

// Balls among boxes, which they touch from without and from within.
constexpr const char* kBoxes =
    R"(<mujoco><default><geom type='box' size='0.2 0.3 0.1' gap='0.01' margin='0.03'/></default>
    <worldbody><geom/><geom size='0.05 0.02 0.4'/><geom size='0.3 0.3 0.3' condim='1'/>
    <body><freejoint/><geom type='sphere' size='0.1'/><geom type='sphere' size='0.02' condim='4'/></body>
    </worldbody></mujoco>)";

// Spheres and capsules, two of which are nearly spheres, among others.
constexpr const char* kRound = R"(<mujoco><default><geom size='0.2 0.1'/></default>
    <worldbody><geom/><geom type='capsule'/><geom type='capsule' size='0.2 1e-9'/>
    <body><freejoint/><geom/><geom type='capsule'/><geom type='capsule' size='0.1 1e-9'/></body></worldbody></mujoco>)";

// Sensors of motion; %s stands for others.
constexpr const char* kSensors =
    R"(<mujoco><option %s><flag %s/></option><worldbody><light pos='0 0 3' mode='trackcom'/>
    <camera name='c' pos='0 -2 1' mode='trackcom'/><geom type='plane' size='9 9 1'/>
    <body name='a' pos='0 0 0.2'><freejoint/><geom size='0.2'/><site name='s' pos='0.1 0 0' size='0.2'/>
    <body name='b' pos='0.3 0 0'><joint name='j' axis='0 1 0' range='-20 20'/><geom type='capsule' size='0.1 0.2'/><site name='t' size='0.2'/></body></body>
    </worldbody><actuator><motor name='m' joint='j' gear='3'/></actuator><sensor><subtreelinvel body='a'/><subtreecom body='a'/><gyro site='s'/>
    <velocimeter site='t'/><framepos objtype='camera' objname='c'/><jointpos joint='j'/><jointvel joint='j'/><actuatorpos actuator='m'/>
    <actuatorvel actuator='m'/><framequat objtype='geom' objname='g'/><framequat objtype='body' objname='b' reftype='site' refname='s'/>
    <framelinvel objtype='site' objname='t' reftype='body' refname='a'/>
    <frameangvel objtype='site' objname='t' reftype='body' refname='a'/><frameangvel objtype='xbody' objname='b' cutoff='0.5'/><subtreeangmom body='a'/>
    <framezaxis objtype='site' objname='s'/><framexaxis objtype='body' objname='a' reftype='camera' refname='c'/><magnetometer site='t'/>
    <framepos objtype='body' objname='b' reftype='geom' refname='g'/><clock cutoff='0.003'/>%s</sensor></mujoco>)";

std::shared_ptr<const Model> with_sensors(const std::string& option, const std::string& flag, const std::string& more) {
  std::string text = kSensors;
  for (const std::string& part : {option, flag, more}) text.replace(text.find("%s"), 2, part);
  text.replace(text.find("size='0.2'/>"), 0, "name='g' ");
  return Model::parse("sensors", text);
}

// The same model, but its bodies touch only the world. So the pairs of its geoms can be listed, and lanes make its constraints.
std::string listed(std::string text) {
  if (const std::size_t at = text.find("<geom type='plane'"); at != std::string::npos)
    text.insert(at + 18, " conaffinity='1'");
  const std::size_t at = text.find("<default><geom");
  return at != std::string::npos ? text.insert(at + 14, " conaffinity='0'")
                                 : text.insert(text.find("<worldbody>"), "<default><geom conaffinity='0'/></default>");
}

std::string limits(const std::string& option, bool has_friction = false) {
  std::string text = kLimits;
  if (has_friction) text.insert(text.find("<joint name='h'") + 6, " frictionloss='0.3'");
  return text.replace(text.find("%s"), 2, option);
}

std::string without(std::string text, const std::string& begin, const std::string& end) {
  const std::size_t from = text.find(begin);
  return text.erase(from, text.find(end, from + begin.size()) + end.size() - from);
}

using Named = std::pair<std::string, std::shared_ptr<const Model>>;

std::vector<Named> models() {
  std::vector<Named> found;
  for (const char* name : kRobots) found.emplace_back(name, Model::open(name));
  found.emplace_back("trees", Model::parse("trees", kTrees));
  found.emplace_back("trees apart", Model::parse("apart", kApart));
  found.emplace_back("odd", Model::parse("odd", kOdd));
  for (const char* joint : {"axis='-0 1 0'", "axis='0 1 0' pos='0.1 0 -0'"})  // the last of four
    found.emplace_back("zeros", Model::parse("zeros", std::string(R"(<mujoco><default><geom size='0.1' pos='0.2 0 0'/>
    </default><worldbody><body><joint axis='1 0.5 1'/><geom/><body><joint axis='1 2 3'/><geom/><body><joint axis='1 1 2'/>
    <geom/></body></body></body><body pos='3 0 -0'><joint )") +
                                                          joint + "/><geom/></body></worldbody></mujoco>"));
  found.emplace_back("mocap", Model::parse("mocap", R"(<mujoco><default><geom size='0.1'/></default><worldbody>
    <geom type='plane' size='9 9 1'/><body mocap='true' pos='0 0 0.3' euler='10 20 30'><geom type='capsule' size='0.1 0.2'/>
    <body pos='0.2 0 0' euler='0 30 0'><geom/><body pos='0 0.1 0'><joint axis='1 0 0'/><geom pos='0.3 0 0'/></body></body></body>
    <body mocap='true' pos='0.5 0 0.1'><geom/></body><body pos='0.1 0.1 0.5'><freejoint/><geom/><geom pos='0 0 0.2'/></body>
    </worldbody></mujoco>)"));
  std::string euler = kOdd;
  euler.replace(euler.find("RK4"), 3, "Euler");
  found.emplace_back("odd with Euler", Model::parse("odd", euler));
  found.emplace_back("forces", Model::parse("forces", kForces));
  std::string loose = kForces;  // without contacts
  loose.replace(loose.find("/>"), 2, "><flag contact='disable'/></option>");
  found.emplace_back("forces without contacts", Model::parse("forces", loose));
  std::string springs = loose;  // an actuator with a state, and forces that are computed row by row
  springs.replace(springs.find("</actuator>"), 0, "<intvelocity joint='a' actrange='-1 1'/>");
  springs.replace(springs.find("</worldbody>"), 0,
                  "<body pos='0 2 0'><joint type='ball' stiffness='3'/><geom/></body>");
  found.emplace_back("springs and states", Model::parse("forces", springs));
  const std::string robot = kRobot;
  const std::string alone = without(robot, "<body name='d'", "</body>");  // one tree
  const std::string free = without(robot, "<equality", "</equality>");
  found.emplace_back("robot", Model::parse("robot", robot));
  found.emplace_back("one robot", Model::parse("robot", alone));
  found.emplace_back("one robot with pyramids", Model::parse("robot", without(alone, "cone='", "' ")));
  found.emplace_back("robot without equality", Model::parse("robot", free));
  found.emplace_back("robot without equality, with pyramids", Model::parse("robot", without(free, "cone='", "' ")));
  found.emplace_back("robot with Euler", Model::parse("robot", without(robot, " integrator='", "'")));
  for (const char* equality : {"<connect body1='arm' anchor='0.1 0 0.1'/>", "<weld body1='arm'/>"}) {
    std::string held = robot;
    found.emplace_back(equality, Model::parse("robot", held.insert(held.find("</equality>"), equality)));
  }
  std::string lifted = robot;  // by actuators
  for (const std::string name : {"a", "c"})
    lifted.insert(lifted.find("<joint name='" + name) + 6, " actuatorgravcomp='true'");
  lifted.replace(lifted.find("<body pos='-0.3 0 0'"), 5, "<body gravcomp='0.7'");
  found.emplace_back("robot whose actuators compensate gravity", Model::parse("robot", lifted));
  for (const char* solver : {"", "solver='PGS'"})
    for (const bool has_friction : {false, true}) {
      found.emplace_back("limits", Model::parse("limits", limits(solver, has_friction)));
      found.emplace_back("listed limits", Model::parse("limits", listed(limits(solver, has_friction))));
    }
  const std::string free_alone = without(alone, "<equality", "</equality>");
  for (const std::string& text : {free, without(free, "cone='", "' "), free_alone, without(free_alone, "cone='", "' "),
                                  std::string(kTrees), std::string(kOdd)})
    found.emplace_back("listed", Model::parse("listed", listed(text)));
  std::string slow = listed(limits("integrator='RK4'"));  // states of actuators with RK4, and contacts
  slow.insert(slow.find("</mujoco>"), "<actuator><intvelocity joint='h' actrange='-1 1'/></actuator>");
  found.emplace_back("listed states with RK4", Model::parse("slow", slow));
  std::string implicit = listed(kForces);
  implicit.insert(implicit.find("density="), "integrator='implicit' ");
  found.emplace_back("listed with implicit", Model::parse("slow", implicit));
  for (const std::string tolerance :
       {"tolerance='0.3' ", "tolerance='0.01' ",
        "tolerance='0.001' ls_tolerance='0.5' ls_iterations='3' "}) {  // with which the solver ends early
    found.emplace_back("listed limits, " + tolerance, Model::parse("limits", listed(limits(tolerance))));
    std::string text = free_alone;
    text.insert(text.find("cone="), tolerance);
    found.emplace_back("listed robot, " + tolerance, Model::parse("robot", listed(text)));
  }
  std::string passive = loose;
  found.emplace_back(
      "listed without springs",
      Model::parse("forces", listed(passive.insert(passive.find("contact="), "spring='disable' damper='disable' "))));
  found.emplace_back("sensors", with_sensors("", "", ""));
  found.emplace_back("sensors with RK4", with_sensors("integrator='RK4'", "contact='disable'", "<force site='t'/>"));
  found.emplace_back("sensors of rays", with_sensors("", "", "<rangefinder site='s'/><touch site='t'/>"));
  const std::string forces =
      "<accelerometer site='s'/><jointactuatorfrc joint='j'/><actuatorfrc actuator='m' cutoff='1'/>"
      "<framelinacc objtype='geom' objname='g'/><frameangacc objtype='body' objname='b'/>";
  found.emplace_back("sensors of forces", with_sensors("", "", forces));
  found.emplace_back("sensors of touch",
                     with_sensors("cone='elliptic'", "", forces + "<touch site='t' cutoff='50'/><touch site='s'/>"));
  found.emplace_back("touch of a light body, whose force is nearly 0", Model::parse("light", R"(<mujoco><worldbody>
    <geom type='plane' size='9 9 1'/><body pos='0 0 0.1'><joint type='slide' axis='0 0 1'/><geom size='0.1' mass='1e-10'/>
    <site name='s' size='0.2'/></body></worldbody><sensor><touch site='s'/></sensor></mujoco>)"));
  for (const std::string sensors :
       {"<framepos objtype='camera' objname='c'/><framequat objtype='camera' objname='c'/>",
        "<framepos objtype='xbody' objname='b' reftype='camera' refname='c'/>",
        "<ballquat joint='j'/><framepos objtype='xbody' objname='b'/><framezaxis objtype='xbody' objname='b'/>"
        "<framequat objtype='xbody' objname='b'/>"})
    found.emplace_back(sensors, Model::parse("frames", R"(<mujoco><worldbody><body pos='0 0 1'><joint axis='0 1 0'/>
    <geom size='0.1' pos='0.2 0 0'/><camera name='c' pos='0.1 0 0' euler='10 20 30'/><body name='b' pos='0.3 0 0'>
    <joint name='j' type='ball'/><geom size='0.1' pos='0.1 0 0'/></body></body></worldbody><sensor>)" +
                                                           sensors + "</sensor></mujoco>"));
  found.emplace_back("sensors of limits", with_sensors("", "constraint='disable'", "<jointlimitpos joint='j'/>"));
  found.emplace_back("sensors of reached limits", with_sensors("", "", "<jointlimitvel joint='j'/>"));
  return found;
}

// A state in which joints move, sometimes so fast that they turn more than once in a timestep, and some are exactly where the
// model has them. Contacts occur in some states.
void set_random(const mjModel& m, Work& work, Noise& noise) {
  work.clear();
  mjData& d = *work.data();
  const double spread = noise.below(4) == 0 ? 0.0 : noise.below(2) ? 0.1 : 1.0;
  const double speed = noise.below(6) == 0 ? 3000 : 3;
  for (int i = 0; i < m.nq; ++i) d.qpos[i] = m.qpos0[i] + spread * noise();
  for (int i = 0; i < m.njnt; ++i) {  // quaternions that turn nothing, some of them zeros
    if ((m.jnt_type[i] != mjJNT_FREE && m.jnt_type[i] != mjJNT_BALL) || noise.below(6)) continue;
    mjtNum* const quat = d.qpos + m.jnt_qposadr[i] + (m.jnt_type[i] == mjJNT_FREE ? 3 : 0);
    quat[0] = noise.below(2) ? 1 : 0;
    for (int k = 1; k < 4; ++k) quat[k] = noise.below(2) ? 0.0 : -0.0;
  }
  for (int i = 0; i < m.nv; ++i) d.qvel[i] = noise.below(5) == 0 ? noise.odd() : speed * spread * noise();
  for (int i = 0; i < m.nu; ++i) d.ctrl[i] = noise();
  for (int i = 0; i < m.nv; ++i) d.qacc_warmstart[i] = 30 * spread * noise();
}

// What mj_step computes with the model itself, instead of a view of it.
class Original {
 public:
  explicit Original(const Model& model) : m_(*model.get()), d_(mj_makeData(&m_)) {}
  void load(const mjData& from) {
    mj_resetData(&m_, d_.get());
    std::copy_n(from.qpos, m_.nq, d_->qpos);
    std::copy_n(from.qvel, m_.nv, d_->qvel);
    std::copy_n(from.act, m_.na, d_->act);
    std::copy_n(from.ctrl, m_.nu, d_->ctrl);
    std::copy_n(from.qacc_warmstart, m_.nv, d_->qacc_warmstart);
  }
  void step(std::int64_t frames = 1) {
    for (std::int64_t i = 0; i < frames; ++i) mj_step(&m_, d_.get());
  }
  bool has_state_of(const mjData& other) const {
    return std::memcmp(other.qpos, d_->qpos, sizeof(mjtNum) * m_.nq) == 0 &&
           std::memcmp(other.qvel, d_->qvel, sizeof(mjtNum) * m_.nv) == 0;
  }
  int contacts() const { return d_->ncon; }

 private:
  const mjModel& m_;
  const std::unique_ptr<mjData, DeleteData> d_;
};

// The arrays of lanes, and those of the rows' mjData.
class Twins : public lanes::LaneArrays {
 public:
  int solved = 0, unsolved = 0;  // how many rows' constraints lanes have solved, and how many they have left to MuJoCo
  int made = 0;                  // how many constraints lanes have made
  int makings = 0, rounds = 0;   // how often, and how often they could have

  Twins(const std::shared_ptr<const Model>& model, const lanes::Code& code)
      : LaneArrays(*model->stepped()),
        model_(model),
        code_(code),
        memory_(lanes_, code.width, counts_),
        solver_(lanes::Solver::make(code, m_)),
        collider_(lanes::Collider::obstacle(*model).empty() ? std::make_unique<lanes::Collider>(*model, code)
                                                            : nullptr) {
    if (collider_) collider_->list_pairs(lanes_);
    for (int row = 0; row < code.width; ++row) works_.push_back(std::make_unique<Work>(model));
    lanes_.model = &m_;
    lanes_.has_negative_zeros = true;
    std::fill_n(lanes_.xquat, code.width, 1.0);
    for (double* matrix : {lanes_.xmat, lanes_.ximat})
      for (const int i : {0, 4, 8}) std::fill_n(matrix + i * code.width, code.width, 1.0);
    for (const auto& own : own_) {
      std::array<const double*, lanes::kMaxWidth> from{};
      from.fill(own.of(m_));
      code.gather(lanes_.*own.numbers, from.data(), own.count);
    }
    for (const auto& own : flags_)
      for (int i = 0; i < own.count * code.width; ++i) (lanes_.*own.numbers)[i] = own.of(m_)[i / code.width];
    code.adopt(lanes_);
  }

  // Says whether lanes find other contacts than MuJoCo where geoms lie at random, some of them parallel.
  bool finds_other_contacts(Noise& noise) {
    // The boxes of bodies are elsewhere than their geoms, so MuJoCo cannot search.
    Pairs pairs = *searched_pairs(*model_->get());
    exclude_bodies(pairs, m_);
    mjModel view = m_;
    set_pairs(view, pairs);
    for (const auto& work : works_) {
      set_random(m_, *work, noise);
      mjData& d = *work->data();
      for (int i = 0; i < m_.ngeom; ++i) {
        const double a = noise.below(3) ? 3 * noise() : 1, b = noise.below(3) ? 3 * noise() : 1;
        const double x = std::sin(a), z = std::cos(a), s = std::sin(b), c = std::cos(b);
        const double mat[] = {z * c, -s, x * c, z * s, c, x * s, -x, 0, z};
        std::copy_n(mat, 9, d.geom_xmat + 9 * i);
        const bool is_centred = m_.ngeom < 8 && noise.below(5) == 0;
        for (int k = 0; k < 3; ++k) d.geom_xpos[3 * i + k] = is_centred || noise.below(20) == 0 ? 0 : 0.5 * noise();
      }
      mj_collision(&view, &d);
    }
    gather(lanes::kPlaces);
    if (!collider_->find_contacts(lanes_, (1U << works_.size()) - 1)) return false;  // MuJoCo might miss one
    for (std::size_t row = 0; row < works_.size(); ++row) {
      mjData& d = *works_[row]->data();
      const std::vector<mjContact> wanted(d.contact, d.contact + d.ncon);
      contacts_ += d.ncon;
      collider_->write(static_cast<int>(row), m_, d);
      if (static_cast<std::size_t>(d.ncon) != wanted.size()) return true;
      for (std::size_t i = 0; i < wanted.size(); ++i)  // padding follows the last member
        if (std::memcmp(&d.contact[i], &wanted[i], offsetof(mjContact, efc_address) + sizeof(int)) != 0) return true;
    }
    return false;
  }
  int contacts() const { return contacts_; }

  // Says which array a stage computes in another way than MuJoCo, "" if none.
  std::string compare(Noise& noise) {
    for (const auto& work : works_) {
      set_random(m_, *work, noise);
      mjData& d = *work->data();
      for (int i = 0; i < 3 * m_.nmocap; ++i) d.mocap_pos[i] += noise();
      for (int i = 0; i < 4 * m_.nmocap; ++i) d.mocap_quat[i] = noise.below(4) ? noise() : noise.below(2) ? 0.0 : -0.0;
    }
    gather(lanes::kState);
    for (const lanes::Stage& stage : lanes::stages()) {
      if (!stage.compute) continue;
      const bool is_in_lanes = stage.obstacle(*model_).empty();
      for (const lanes::Function& function : stage.functions)
        if (function.compute && is_in_lanes) (code_.*function.compute)(lanes_);
      const bool is_solver = stage.party == lanes::kConstraints;
      if (is_solver && solver_ && collider_)
        if (const std::string found = make(); !found.empty()) return "constraints: " + found;
      if (is_solver && solver_) solve();
      for (const auto& work : works_) stage.compute(*work, m_, *work->data());
      if (is_solver && solver_)
        if (const std::string found = difference_of_forces(); !found.empty()) return "solver: " + found;
      if (!stage.functions.empty() && is_in_lanes)
        if (const std::string found = difference(stage.party); !found.empty())
          return std::string(stage.name) + ": " + found;
      gather(stage.party);
    }
    if (m_.na > 0 || m_.opt.integrator == mjINT_RK4 || m_.opt.integrator == mjINT_IMPLICIT) return "";
    return m_.opt.integrator == mjINT_EULER ? compare_integrators(code_.Euler, mj_Euler)
                                            : compare_integrators(code_.implicitfast, mj_implicit);
  }

 private:
  const std::shared_ptr<const Model> model_;
  const lanes::Code& code_;
  lanes::Lanes lanes_{};
  lanes::Memory<lanes::Lanes> memory_;
  std::vector<std::unique_ptr<Work>> works_;
  std::unique_ptr<lanes::Solver> solver_;
  std::unique_ptr<lanes::Collider> collider_;
  int contacts_ = 0;
  std::uint32_t solved_ = 0, unsolved_ = 0;  // the rows whose constraints lanes have solved, and those that they leave
  std::vector<double> forces_;               // what lanes have written to the rows that they have solved

  static std::size_t index(unsigned party) { return static_cast<std::size_t>(__builtin_ctz(party)); }

  void gather(unsigned party) {
    for (const lanes::LaneArray& array : written_[index(party)])
      for (int lane = 0; lane < code_.width; ++lane)
        for (int i = 0; i < array.count; ++i)
          (lanes_.*array.numbers)[i * code_.width + lane] =
              (works_[static_cast<std::size_t>(lane)]->data()->*array.data)[i];
  }

  // Makes the constraints that MuJoCo has made for the rows, and solves them. Says what differs: their
  // number, D or J.
  std::string make() {
    lanes::RowModels models{};
    lanes::RowData data{};
    for (std::size_t row = 0; row < works_.size(); ++row) {
      models[row] = &m_;
      data[row] = works_[row]->data();
    }
    const int count = static_cast<int>(works_.size());
    lanes_.left_to_mujoco = 0;
    ++rounds;
    if (!collider_->makes(models, count) || !solver_->follows(m_) || !collider_->find(lanes_, (1U << count) - 1) ||
        !solver_->can_solve(collider_->found(), data))
      return "";
    ++makings;
    std::vector<int> counts;
    for (const auto& work : works_) {
      counts.push_back(work->data()->nefc);
      work->data()->nefc = -1;
    }
    solver_->solve(lanes_, collider_->found(), models, data);
    const lanes::Constraints& c = solver_->constraints();
    for (int row = 0; row < count; ++row) {
      const mjData& d = *data[static_cast<std::size_t>(row)];
      if (d.nefc != counts[static_cast<std::size_t>(row)]) return "their number";
      made += d.nefc;
      const auto differ = [&](const double* found, const mjtNum* wanted, int numbers) {
        for (int i = 0; i < numbers; ++i)
          if (std::memcmp(&found[i * count + row], &wanted[i], sizeof(double))) return true;
        return false;
      };
      // The solver has overwritten those of islands, and contacts with elliptic cones have the same places in all lanes.
      if (m_.ntree > 1 || m_.opt.cone == mjCONE_ELLIPTIC) continue;
      if (differ(c.D, d.efc_D, d.nefc)) return "D";
      if (differ(c.J, d.efc_J, d.nefc * static_cast<int>(m_.nv))) return "J";
    }
    return "";
  }

  // Solves the constraints that MuJoCo has made for the rows.
  void solve() {
    lanes::RowModels models{};
    lanes::RowData data{};
    solved_ = unsolved_ = lanes_.left_to_mujoco = 0;
    for (std::size_t row = 0; row < works_.size(); ++row) {
      models[row] = &m_;
      data[row] = works_[row]->data();
      if (data[row]->nefc > 0) (lanes::Solver::prepare(m_, *data[row]) ? solved_ : unsolved_) |= 1U << row;
    }
    solver_->solve(lanes_, solved_, models, data, true);
    unsolved_ |= lanes_.left_to_mujoco;
    solved_ &= ~unsolved_;
    forces_ = forces();
    solved += __builtin_popcount(solved_);
    unsolved += __builtin_popcount(unsolved_);
  }

  std::vector<double> forces() const {
    std::vector<double> found;
    for (std::size_t row = 0; row < works_.size(); ++row) {
      if (!(solved_ >> row & 1)) continue;
      const mjData& d = *works_[row]->data();
      found.insert(found.end(), d.efc_force, d.efc_force + d.nefc);
      found.insert(found.end(), d.efc_aref, d.efc_aref + d.nefc);
      found.push_back(d.solver_niter[0]);
    }
    return found;
  }

  std::string difference_of_forces() const {
    const std::vector<double> wanted = forces();
    return std::memcmp(forces_.data(), wanted.data(), wanted.size() * sizeof(double)) ? "forces" : "";
  }

  bool differs(const lanes::LaneArray& array, int lane) const {
    const mjtNum* const wanted = works_[static_cast<std::size_t>(lane)]->data()->*array.data;
    for (int i = 0; i < array.count; ++i)
      if (std::memcmp(&wanted[i], &(lanes_.*array.numbers)[i * code_.width + lane], sizeof(double))) return true;
    return false;
  }

  std::string difference(unsigned party) const {
    for (const lanes::LaneArray& array : written_[index(party)])
      for (int lane = 0; lane < code_.width; ++lane)
        if (!(party == lanes::kConstraints && unsolved_ >> lane & 1) && differs(array, lane)) return name_of(array);
    return "";
  }

  static std::string name_of(const lanes::LaneArray& array) {
#define MJENV_ARRAY(name, count, writers, readers) \
  if (array.data == &mjData::name) return #name;
    MJENV_LANES_DATA(MJENV_ARRAY)
#undef MJENV_ARRAY
    return "?";
  }

  template <typename InLanes, typename OfMuJoCo>
  std::string compare_integrators(const InLanes& in_lanes, const OfMuJoCo& of_mujoco) {
    in_lanes(lanes_);
    for (const auto& work : works_) of_mujoco(&m_, work->data());
    if (std::string found = difference(lanes::kIntegration); !found.empty()) return "integration: " + found;
    for (const lanes::LaneArray& array : read_[index(lanes::kFactor)])
      for (int lane = 0; lane < code_.width && (lanes_.damped != 0 || m_.opt.integrator != mjINT_EULER); ++lane)
        if (differs(array, lane)) return "integration: " + name_of(array);
    return "";
  }
};

void test_stages(void** /*state*/) {
  int solved = 0, unsolved = 0, made = 0;
  for (const auto& [name, model] : models())
    for (const int width : lanes::widths()) {
      Noise noise;
      Twins twins(model, *lanes::code_of(width));
      const int rounds = name == "one robot" ? 10 * kRounds : kRounds;  // some cases of elliptic cones are rare
      for (int round = 0; round < rounds; ++round)
        if (const std::string found = twins.compare(noise); !found.empty())
          fail_msg("%s, %d lanes, %s", name.c_str(), width, found.c_str());
      solved += twins.solved;
      unsolved += twins.unsolved;
      made += twins.made;
    }
  assert_true(solved > 4 * unsolved);
  assert_true(made > 10000);
}

void test_contacts(void** /*state*/) {
  std::vector<Named> found{{"boxes", Model::parse("boxes", kBoxes)},
                           {"round", Model::parse("round", kRound)},
                           {"limits", Model::parse("limits", listed(limits("")))}};
  for (const char* name : {"ant.xml", "hopper.xml", "humanoid.xml"}) found.emplace_back(name, Model::open(name));
  for (const auto& [name, model] : found)
    for (const int width : lanes::widths()) {
      assert_string_equal(lanes::Collider::obstacle(*model).c_str(), "");
      Noise noise;
      Twins twins(model, *lanes::code_of(width));
      for (int round = 0; round < 100; ++round)
        if (twins.finds_other_contacts(noise)) fail_msg("%s, %d lanes", name.c_str(), width);
      assert_true(twins.contacts() > 100);
    }
}

// The name of an array in which two work spaces differ, "" if there is none. Of a step that is not whole, compares the
// arrays that can be read after every step.
std::string difference(Work& found, Work& wanted) {
  for (Work* work : {&found, &wanted}) work->complete();
  const std::vector<Array> a = found.arrays(), b = wanted.arrays();
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (found.lag() & part_of(a[i].name)) continue;
    std::vector<double> x(a[i].count()), y(x.size());
    a[i].read(x.data());
    b[i].read(y.data());
    if (std::memcmp(x.data(), y.data(), x.size() * sizeof(double))) return a[i].name;
  }
  return "";
}

// How rows are read after a step.
struct Reading {
  const char* array;                                    // one that is announced
  bool is_current;                                      // Work::keep_current
  std::int64_t frames;                                  // 0: mj_forward
  const char* own = nullptr;                            // an array of which rows have their own values
  const char* bad = nullptr;                            // a part of the state that has bad numbers in some rows
  void (*place)(std::size_t row, mjData& d) = nullptr;  // changes the random state of a row
  bool has_callback = false;                            // controls change before each mj_step, and some are bad
  bool returns = false;                                 // rows stay in lanes where their own values are the model's
};

// Whether the array of geoms or bodies decides which of them touch.
bool decides_touch(const std::string& array) {
  return array.find("_contype") != std::string::npos || array.find("_conaffinity") != std::string::npos;
}

// Writes other values of an array to a row's block.
void change(const OwnArray& array, std::byte* block, Noise& noise) {
  std::vector<double> values(array.original.count());
  array.read(block, values.data());
  for (double& value : values)
    if (array.original.name.find("sameframe") != std::string::npos)
      value = noise.below(3) ? value : static_cast<double>(noise.below(5));
    else if (decides_touch(array.original.name))
      value = 1;
    else if (array.original.name == "opt.enableflags")
      value = static_cast<double>(noise.below(2) * mjENBL_ENERGY);
    else if (array.original.name == "opt.disableflags")
      value = static_cast<double>(noise.below(2) * mjDSBL_ACTUATION);
    else if (value *= 1 + 0.3 * noise(); noise.below(8) == 0)
      value += 0.1;
  array.write(values.data(), block);
}

// Steps leave the bits of mj_step, and lanes leave few rows.
void test_steps(const Named& named, const lanes::Code& code, const Reading& reading, int& rows, int& left) {
  const auto& [name, model] = named;
  const ErrorTrap trap;
  Noise noise;
  const int width = code.width;
  const auto stepper = lanes::make_stepper(*model, code);
  std::vector<std::unique_ptr<Work>> works, plain;
  std::vector<Work*> all;
  std::vector<std::vector<double>> states, befores(static_cast<std::size_t>(width));
  std::vector<double*> before;
  for (int row = 0; row < width; ++row) {
    for (auto* list : {&works, &plain}) {
      list->push_back(std::make_unique<Work>(model));
      list->back()->expect(part_of(reading.array));
      if (reading.is_current) list->back()->keep_current();
    }
    all.push_back(works.back().get());
    befores[static_cast<std::size_t>(row)].resize(works[0]->layout().size);
    before.push_back(befores[static_cast<std::size_t>(row)].data());
  }
  OwnArrays own(*model);
  if (reading.own) own.add(reading.own);
  if (reading.own && decides_touch(reading.own)) own.add("body" + std::string(reading.own).substr(4));
  std::vector<std::vector<double>> blocks(all.size(), std::vector<double>(own.block_bytes() / sizeof(double) + 1));
  std::vector<double> last(works[0]->layout().size);
  states.assign(all.size(), last);
  Original original(*model);
  const bool is_original = reading.frames > 0 && !reading.own && !reading.has_callback && !reading.is_current;
  int usual_stepped = 0;
  const auto controls = static_cast<int>(model->get()->nu);
  for (int round = 0; round < kRounds; ++round) {
    const bool is_usual = round % 4 == 2;  // rows have the model's values
    const auto begin = [&](Work& work, std::size_t row) {
      if (reading.own) work.use(own, reinterpret_cast<std::byte*>(blocks[row].data()));
      work.load(states[row].data());
      work.act({});
    };
    const auto call_back = [&](Work& work, std::size_t row, std::int64_t frame) {
      for (int i = 0; i < controls; ++i)
        work.data()->ctrl[i] = round % 4 == 3 && row % 2 == 1 ? 2 * mjMAXVAL : 0.1 * (1.0 + row + frame + i);
    };
    const auto step_alone = [&](Work& work, std::size_t row) {
      const Work::BeforeSubstep of_row = [&](std::int64_t frame) { call_back(work, row, frame); };
      try {
        if (reading.frames == 0)
          work.forward();
        else
          work.step(reading.frames, last.data(), reading.has_callback ? &of_row : nullptr);
      } catch (const std::exception&) {
        return false;  // because MuJoCo's memory is too small
      }
      return true;
    };
    for (std::size_t row = 0; row < all.size(); ++row) {
      auto* const block = reinterpret_cast<std::byte*>(blocks[row].data());
      own.fill(0, block);
      for (const OwnArray& array : own.list())
        if (!is_usual) change(array, block, noise);
      set_random(*model->get(), *plain[row], noise);
      if (reading.place) reading.place(row, *plain[row]->data());
      std::vector<double>& state = states[row];
      plain[row]->save(state.data());
      if (reading.bad && noise.below(3) == 0) {
        const auto part = works[0]->layout().part(reading.bad);
        if (part->count > 0)
          state[static_cast<std::size_t>(part->offset) + noise.below(static_cast<std::uint64_t>(part->count))] =
              noise.below(2) ? std::nan("") : 2 * mjMAXVAL;
      }
      for (Work* work : {works[row].get(), plain[row].get()}) begin(*work, row);
    }
    const int count = std::max(2, width - round % 3);
    const lanes::Stepper::BeforeSubstep of_rows = [&](int row, std::int64_t frame) {
      const auto index = static_cast<std::size_t>(row);
      call_back(*works[index], index, frame);
    };
    const std::uint32_t stepped = reading.frames == 0 ? stepper->forward(all.data(), count)
                                                      : stepper->step(all.data(), count, reading.frames, before.data(),
                                                                      reading.has_callback ? &of_rows : nullptr);
    if (is_usual) usual_stepped += __builtin_popcount(stepped);
    for (std::size_t row = 0; row < static_cast<std::size_t>(count); ++row) {
      original.load(*plain[row]->data());
      const bool is_alone = !(stepped >> row & 1), fails = !step_alone(*plain[row], row);
      if (is_original && !fails) original.step(reading.frames);
      if (is_original && !fails && !original.has_state_of(*plain[row]->data()))
        fail_msg("%s: the step is not that of the model itself", name.c_str());
      ++rows;
      left += is_alone;
      if (is_alone) {
        begin(*works[row], row);
        if (step_alone(*works[row], row) == fails) fail_msg("%s, %d lanes: a row alone", name.c_str(), width);
        if (fails) continue;
      }
      if (fails) fail_msg("%s, %d lanes: lanes do not fail", name.c_str(), width);
      if (const std::string found = difference(*works[row], *plain[row]); !found.empty())
        fail_msg("%s, %d lanes, %s is read%s: %s", name.c_str(), width, reading.array,
                 reading.is_current ? ", new states are shown" : "", found.c_str());
    }
  }
  if (reading.returns && usual_stepped == 0) fail_msg("%s, %d lanes: usual rows are left", name.c_str(), width);
}

void test_steps(void** /*state*/) {
  int rows = 0, left = 0;
  for (const Named& named : models())
    for (const int width : lanes::widths())
      for (const Reading& reading : {Reading{"qM", false, 3},
                                     {"qpos", false, 3},
                                     {"qpos", false, 0},
                                     {"qpos", true, 2},
                                     {"cfrc_ext", true, 1},
                                     {"qpos", false, 2, "geom_friction"},
                                     {"qpos", false, 0, "geom_friction"},
                                     {"qpos", false, 1, "body_quat"},
                                     {"qpos", false, 2, "mocap_quat"},
                                     {"qpos", false, 1, "mocap_pos"}})
        if (!reading.own || OwnArray::of(*named.second, reading.own).bytes > 0)
          test_steps(named, *lanes::code_of(width), reading, rows, left);
  assert_true(left < rows / 10);
}

// Rows whose own values lanes do not compute with are left to MuJoCo.
void test_rows_left(void** /*state*/) {
  std::string fast = kForces;
  fast.insert(fast.find("density"), "integrator='implicitfast' ")
      .replace(fast.find("density='900' viscosity='0.3'"), 29, "");
  const std::string of_tendon = limits("");
  for (const auto& [text, array] : {std::pair<std::string, const char*>{kForces, "jnt_stiffness"},
                                    {fast, "opt.density"},
                                    {fast, "opt.viscosity"},
                                    {kForces, "jnt_stiffnesspoly"},
                                    {kForces, "dof_dampingpoly"},
                                    {of_tendon, "tendon_stiffness"},
                                    {of_tendon, "tendon_damping"},
                                    {of_tendon, "tendon_armature"},
                                    {of_tendon, "tendon_stiffnesspoly"},
                                    {of_tendon, "tendon_dampingpoly"},
                                    {listed(limits("solver='PGS' iterations='90'")), "opt.iterations"},
                                    {fast, "dof_damping"}}) {
    const Named named(array, Model::parse("forces", text));
    int rows = 0, left = 0;
    for (const int width : lanes::widths())
      test_steps(named, *lanes::code_of(width), {"qpos", false, 1, array, nullptr, nullptr, false, true}, rows, left);
    const bool is_usual = std::strcmp(array, "dof_damping") == 0 || std::strcmp(array, "opt.iterations") == 0;
    if (is_usual ? left >= rows / 10 : left == 0) fail_msg("%s: %d of %d rows left", array, left, rows);
  }
}

// Rows with forces, numbers of contacts and friction of their own, and rows with bad numbers, which MuJoCo resets.
void test_odd_rows(void** /*state*/) {
  int rows = 0, left = 0;
  for (const Named& named : models()) {
    if (named.first.find(".xml") != std::string::npos && named.first != "hopper.xml" && named.first != "ant.xml")
      continue;
    for (const int width : lanes::widths()) {
      const lanes::Code& code = *lanes::code_of(width);
      for (const char* own : {"qfrc_applied", "xfrc_applied", "dof_frictionloss", "dof_solref", "geom_solimp",
                              "geom_margin", "geom_size", "jnt_range", "jnt_axis", "jnt_pos", "geom_quat", "site_quat"})
        test_steps(named, code, {"qpos", false, 2, own}, rows, left);
      for (const char* bad : {"qpos", "qvel", "act", "ctrl", "qacc_warmstart"})
        test_steps(named, code, {"qpos", false, 2, nullptr, bad}, rows, left);
      test_steps(named, code, {"qpos", false, 3, nullptr, nullptr, nullptr, true}, rows, left);
    }
  }
  const Named forces("forces", Model::parse("forces", kForces));
  std::string text = kForces;
  const Named still("forces", Model::parse("forces", without(text, "density='900' viscosity='0.3'", " ")));
  text.insert(text.find("<default>"), "<option><flag actuation='disable'/></option>");
  const Named passive("forces", Model::parse("forces", text)), odd("odd", Model::parse("odd", kOdd)),
      deep("limits", Model::parse("limits", listed(limits(""))));
  const auto apart = [](const std::string& flag) {
    return Named("apart",
                 Model::parse("apart", "<mujoco><default><geom size='0.5' " + flag + R"(='0'/></default><worldbody>
      <body><joint type='slide'/><geom/></body><body pos='0.5 0 0'><joint type='slide'/><geom/></body></worldbody></mujoco>)"));
  };
  const Named untyped = apart("contype"), unaffected = apart("conaffinity");  // geoms that touch in some rows alone
  for (const int width : lanes::widths()) {
    const lanes::Code& code = *lanes::code_of(width);
    test_steps(forces, code, {"energy", false, 1, "opt.enableflags"}, rows, left);
    test_steps(passive, code, {"qpos", false, 1, "opt.disableflags"}, rows, left);
    for (const char* own : {"opt.density", "opt.viscosity"})
      test_steps(still, code, {"qpos", false, 1, own}, rows, left);
    test_steps(odd, code, {"qM", false, 1, "site_sameframe"}, rows, left);
    test_steps(untyped, code, {"qpos", false, 2, "geom_contype"}, rows, left);
    test_steps(unaffected, code, {"qpos", false, 2, "geom_conaffinity"}, rows, left);
    for (const char* own : {"geom_sameframe", "geom_margin"}) test_steps(deep, code, {"qM", false, 1, own}, rows, left);
  }
  assert_true(left > 0);
}

// A hedgehog on a plane: the constraints of some rows are too many for lanes, and rows that lie on other spikes have contacts
// at other places.
std::string hedgehog(const std::string& option, int spikes, const std::string& more = "") {
  std::string text = "<mujoco><option " + option + "/>" + more +
                     "<worldbody><geom type='plane' size='9 9 1'/><body pos='0 0 0.9'><freejoint/>";
  for (int i = 0; i < spikes; ++i) {
    const double z = 1 - (2 * i + 1.0) / spikes, radius = std::sqrt(1 - z * z), angle = 2.4 * i;
    text += "<geom size='0.1' pos='" + std::to_string(radius * std::cos(angle)) + " " +
            std::to_string(radius * std::sin(angle)) + " " + std::to_string(z) + "'/>";
  }
  return text + "</body></worldbody></mujoco>";
}

// Rows with more constraints than lanes have places for step with MuJoCo's bits, as do others beside them.
void test_many_constraints(void** /*state*/) {
  for (const std::string option : {"", "cone='elliptic'", "solver='PGS'"}) {
    const Named named("hedgehog " + option, Model::parse("hedgehog", hedgehog(option, 60)));
    for (const int width : lanes::widths()) {
      int rows = 0, left = 0;
      for (const bool is_current : {false, true})
        test_steps(named, *lanes::code_of(width), {"qpos", is_current, 2}, rows, left);
    }
  }
}

// The edges of a beam that rolls on a floor: each has geoms in a line, so many of one condim after so many of another.
using Edges = std::array<std::vector<std::pair<int, int>>, 4>;
std::string beam(const Edges& edges, const std::string& joints = "") {
  std::string text = "<body pos='0 0 1.04'><joint type='slide' axis='0 0 1'/><joint axis='1 0 0'/>" + joints;
  constexpr std::pair<int, int> kCorners[] = {{0, -1}, {1, 0}, {0, 1}, {-1, 0}};
  for (std::size_t edge = 0; edge < 4; ++edge) {
    int at = 0;
    for (const auto& [count, condim] : edges[edge])
      for (int i = 0; i < count; ++i)
        text += "<geom pos='" + std::to_string(0.1 * at++) + " " + std::to_string(kCorners[edge].first) + " " +
                std::to_string(kCorners[edge].second) + "' condim='" + std::to_string(condim) + "'/>";
  }
  return text + "</body>";
}

Named beams(const std::string& bodies) {
  return {"beam", Model::parse("beam", R"(<mujoco><option cone='elliptic'/><default><geom size='0.05' conaffinity='0'/>
    </default><worldbody><geom type='plane' size='9 9 1' condim='1' conaffinity='1'/>)" +
                                           bodies + "</worldbody></mujoco>")};
}

// Rows lie on different edges. The places of their contacts are too many for lanes: if these make the constraints, only
// where all contacts have places of their own; if MuJoCo does, only where contacts of different kinds have. Of two beams,
// those of the first one alone: beside those of the second, more of them share a place.
void test_many_places(void** /*state*/) {
  const auto roll = [](std::size_t row, mjData& d) {
    d.qpos[0] = 0;
    d.qpos[1] = 0.5 * mjPI * static_cast<double>(row);
  };
  const auto roll_both = [](std::size_t row, mjData& d) {
    d.qpos[0] = d.qpos[2] = 0;
    d.qpos[1] = d.qpos[3] = 0.5 * mjPI * static_cast<double>(row);
  };
  const std::string alike = beam({{{{15, 3}}, {{15, 3}}, {{15, 3}}, {{15, 3}}}}),
                    unlike = beam({{{{20, 3}}, {{15, 4}}, {{10, 6}}, {{20, 3}}}}),
                    mixed = beam({{{}, {{8, 4}, {4, 3}}, {{6, 6}}, {{13, 3}, {4, 4}}}}),
                    beside = "<body pos='0 5 0.04'><joint type='slide' axis='0 0 1'/><geom/></body>";
  const struct {
    std::string bodies;
    void (*place)(std::size_t, mjData&);
    bool has_room;
  } cases[] = {{alike, roll, true},
               {alike + beside, roll, true},
               {unlike, roll, false},
               {unlike + beside, roll, false},
               {mixed + beam({{{}, {{4, 4}}, {}, {}}}), roll_both, false}};
  for (const auto& c : cases) {
    const Named named = beams(c.bodies);
    for (const int width : lanes::widths())
      for (const char* array : {"qpos", "qM"}) {
        int rows = 0, left = 0;
        test_steps(named, *lanes::code_of(width), {array, false, 1, nullptr, nullptr, c.place}, rows, left);
        assert_int_equal(left > 0, !c.has_room && width > 2);
      }
  }
  // Limits have places, too: without them, those of the contacts would be few enough.
  std::string joints;
  for (int i = 0; i < 4; ++i) joints += "<joint type='slide' axis='0 1 0' range='2 3' armature='1'/>";
  const Named limited = beams(beam({{{{11, 3}}, {{10, 3}}, {{10, 3}}, {{11, 3}}}}, joints));
  int rows = 0, left = 0;
  for (const int width : lanes::widths())
    test_steps(limited, *lanes::code_of(width), {"qpos", false, 1, nullptr, nullptr, roll}, rows, left);
  assert_int_equal(left, 0);
}

// Rows reach other limits, so that lanes cannot list all of them.
void test_many_limits(void** /*state*/) {
  std::string joints;
  std::string ends;
  for (int i = 0; i < 52; ++i) {
    if (i % 4 == 0) joints += "<body><geom size='0.1'/>", ends += "</body>";
    joints += "<joint type='slide' range='-1 1' armature='1'/>";
  }
  const Named named("limits", Model::parse("limits", "<mujoco><option><flag contact='disable'/></option><worldbody>" +
                                                         joints + ends + "</worldbody></mujoco>"));
  const auto reach = [](std::size_t row, mjData& d) {
    for (std::size_t i = 0; i < 52; ++i) d.qpos[i] = i % 2 == row % 2 ? 0 : row / 2 % 2 ? 1.01 : -1.01;
  };
  int rows = 0, left = 0;
  for (const int width : lanes::widths())
    test_steps(named, *lanes::code_of(width), {"qpos", false, 1, nullptr, nullptr, reach}, rows, left);
  assert_int_equal(left, 0);
}

// Whether lanes make the constraints of all rows, or of none, and whether they solve all of those that MuJoCo makes, or
// none.
void test_what_is_solved(void** /*state*/) {
  const std::string robot = without(kRobot, "<equality", "</equality>"), trees = listed(kTrees), pgs = "solver='PGS' ";
  const std::string alone = listed(without(robot, "<body name='d'", "</body>"));
  std::string dual = trees, tied = trees;
  dual.insert(8, "<option solver='PGS'/>");
  tied.insert(tied.find("<joint axis='1 0 0'") + 6, " name='a'");
  tied.insert(tied.find("<joint type='slide' axis='1 0 0'") + 6, " name='b'");
  tied.insert(tied.find("</mujoco>"),
              "<tendon><fixed range='5 6'><joint joint='a' coef='1'/><joint joint='b' coef='1'/></fixed></tendon>");
  const struct {
    std::string text;
    bool makes, solves;
  } cases[] = {{trees, true, true},
               {dual, false, false},
               {tied, false, true},
               {alone, true, true},
               {listed(robot), false, true},
               {listed(without(robot, "cone='", "' ")), false, true},
               {listed(limits("")), true, true},
               {listed(limits(pgs)), true, true},
               {listed(limits(pgs + "iterations='101'")), false, false},
               {listed(limits(pgs, true)), false, false}};
  for (const auto& c : cases) {
    Noise noise;
    Twins twins(Model::parse("solved", c.text), *lanes::code_of(lanes::widths().back()));
    for (int round = 0; round < kRounds; ++round) assert_string_equal(twins.compare(noise).c_str(), "");
    if (twins.makings != (c.makes ? twins.rounds : 0) || (c.solves ? twins.unsolved : twins.solved) > 0)
      fail_msg("%s: made %d of %d, solved %d, not %d", c.text.c_str(), twins.makings, twins.rounds, twins.solved,
               twins.unsolved);
  }
}

// Rows in the initial state, for the widest lanes.
struct Rows {
  std::vector<std::unique_ptr<Work>> works;
  std::vector<Work*> all;
  std::vector<std::vector<double>> states, befores;
  std::vector<double*> before;

  explicit Rows(const std::shared_ptr<const Model>& model)
      : states(static_cast<std::size_t>(lanes::widths().back()), std::vector<double>(StateLayout(*model).size)),
        befores(states) {
    for (std::size_t row = 0; row < states.size(); ++row) {
      works.push_back(std::make_unique<Work>(model));
      works.back()->clear();
      all.push_back(works.back().get());
      before.push_back(befores[row].data());
    }
  }
  std::uint32_t step(lanes::Stepper& stepper) {
    for (std::size_t row = 0; row < states.size(); ++row) works[row]->load(states[row].data());
    return stepper.step(all.data(), static_cast<int>(all.size()), 1, before.data());
  }
};

// Steps rows whose states `set` has changed. Compares those that lanes do not leave to MuJoCo, and returns them, as bits.
std::uint32_t step_rows(const std::shared_ptr<const Model>& model,
                        const std::function<void(std::size_t, mjData&)>& set) {
  const ErrorTrap trap;
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(lanes::widths().back()));
  Rows rows(model);
  for (std::size_t row = 0; row < rows.all.size(); ++row) {
    set(row, *rows.all[row]->data());
    rows.all[row]->save(rows.states[row].data());
  }
  const std::uint32_t done = rows.step(*stepper);
  Work plain(model);
  Original original(*model);
  std::vector<double> last(rows.states[0].size());
  for (std::size_t row = 0; row < rows.all.size(); ++row) {
    plain.load(rows.states[row].data());
    original.load(*plain.data());
    original.step();
    plain.step(1, last.data());
    assert_true(original.has_state_of(*plain.data()));
    if (done >> row & 1) assert_string_equal(difference(*rows.all[row], plain).c_str(), "");
  }
  return done;
}

// What lanes say of models, and how many lanes a thread uses.
void test_choices(void** /*state*/) {
  const auto hopper = Model::open("hopper.xml");
  const auto parse = [](const std::string& text) { return Model::parse("choices", text); };
  const auto still = parse("<mujoco><worldbody><body mocap='true'/></worldbody></mujoco>");
  const std::vector<int> widths = lanes::widths();
  assert_int_equal(lanes::best_width(*hopper, 1, 8), 0);
  assert_int_equal(lanes::best_width(*hopper, 3, 8), 2);
  assert_int_equal(lanes::best_width(*hopper, 64, 2), 2);
  assert_int_equal(lanes::best_width(*hopper, 64, 8), widths.back());
  assert_int_equal(lanes::best_width(*still, 64, 8), 0);
  const auto fast = [&](const std::string& option, const std::string& body, const std::string& more) {
    return parse("<mujoco><option integrator='implicitfast' " + option + "/><worldbody>" + body +
                 "<body><freejoint/><geom size='0.1'/><body><joint name='j'/><joint name='b' type='ball' pos='1 0 0'/>"
                 "<geom size='0.1'/></body></body></worldbody>" +
                 more + "</mujoco>");
  };
  const auto assert_is_obstacle = [&](auto* callback, auto function) {
    *callback = function;
    const std::string found = lanes::obstacle(*hopper);
    *callback = nullptr;
    assert_string_equal(found.c_str(), "the process's MuJoCo callbacks");
  };
  const auto act = [](const mjModel*, const mjData*, int) -> mjtNum { return 0; };
  assert_is_obstacle(mjcb_passive, [](const mjModel*, mjData*) {});
  assert_is_obstacle(mjcb_control, [](const mjModel*, mjData*) {});
  assert_is_obstacle(mjcb_contactfilter, [](const mjModel*, mjData*, int, int) { return 0; });
  assert_is_obstacle(mjcb_sensor, [](const mjModel*, mjData*, int) {});
  assert_is_obstacle(mjcb_act_dyn, act);
  assert_is_obstacle(mjcb_act_gain, act);
  assert_is_obstacle(mjcb_act_bias, act);
  std::string states = kForces;
  states.insert(states.find("</actuator>"), "<intvelocity joint='a' actrange='-1 1'/>");
  for (const auto& [model, line] :
       {std::pair{hopper, "actuators: lanes"},
        {hopper, "tendons: absent"},
        {hopper, "sensors: absent"},
        {still, "actuators: row by row: no joints"},
        {parse(kTrees), "actuators: absent"},
        {parse(limits("")), "tendons: row by row: not written yet"},
        {parse(states), "actuators: row by row: states of actuators"},
        {with_sensors("", "", "<touch site='t'/>"), "sensors: lanes; row by row: touch"},
        {with_sensors("", "", ""), "sensors: lanes"},
        {parse("<mujoco><worldbody><body><joint/><geom size='0.1' adhesion='1'/></body></worldbody></mujoco>"),
         "passive forces: row by row: adhesion"},
        {fast("density='1'", "", ""), "integration: row by row: implicitfast with a fluid"},
        {fast("viscosity='1'", "", ""), "integration: row by row: implicitfast with a fluid"},
        {fast("", "", "<tendon><fixed damping='1'><joint joint='j' coef='1'/></fixed></tendon>"),
         "integration: row by row: implicitfast with dampers of tendons"},
        {fast("", "", "<actuator><motor joint='b'/></actuator>"),
         "integration: row by row: implicitfast with actuators that are computed row by row"},
        {fast("", "<body><freejoint/><geom size='0.1'/></body>", ""),
         "integration: row by row: implicitfast with free bodies that have no other joints"},
        {fast("", "", "<actuator><motor joint='j'/></actuator>"), "integration: lanes"}})
    if (const std::string lines = "\n" + lanes::stage_lines(*model);
        lines.find("\n" + std::string(line) + "\n") == std::string::npos)
      fail_msg("%s has no line %s", lines.c_str(), line);
}

#ifdef COUNTS_MEMORY
std::size_t allocated_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

// What an environment counts before it is created is at least half of what its steppers then allocate, and without lists of
// contacts nearly all. Steps allocate nothing.
void test_memory(void** /*state*/) {
  for (const auto& [name, model] : models()) {
    const lanes::Code& code = *lanes::code_of(lanes::widths().back());
    lanes::make_stepper(*model, code);  // the first one with PGS makes a table for all
    const std::size_t counted = lanes::stepper_bytes(*model, code.width), before = allocated_bytes();
    auto stepper = lanes::make_stepper(*model, code);
    const std::size_t taken = allocated_bytes() - before;
    const double most = lanes::Collider::obstacle(*model).empty() ? 2 : 1.2;
    if (counted > taken || most * static_cast<double>(counted) < static_cast<double>(taken))
      fail_msg("%s: %zu of %zu bytes", name.c_str(), counted, taken);
    stepper.reset();
    if (allocated_bytes() > before + counted / 2) fail_msg("%s: memory is not freed", name.c_str());

    const ErrorTrap trap;
    stepper = lanes::make_stepper(*model, code);
    Rows rows(model);
    for (std::size_t row = 0; row < rows.all.size(); ++row) rows.all[row]->save(rows.states[row].data());
    const std::size_t at_first = allocated_bytes();
    for (int i = 0; i < 100; ++i) rows.step(*stepper);
    if (allocated_bytes() != at_first) fail_msg("%s: steps allocate memory", name.c_str());
  }
}
#endif

// Lanes leave rows in which a number is above MuJoCo's limit within a step: a position or velocity of a stage of RK4, an
// acceleration that a constraint takes away, and one that a constraint causes, for which MuJoCo resets the simulation.
void test_numbers_within_steps(void** /*state*/) {
  const struct {
    const char *option, *joint;
    double qpos, qvel, ctrl;
  } cases[] = {{"integrator='RK4' timestep='1'", "damping='3'", 9.9e9, 3e8, 0},
               {"integrator='RK4' timestep='1'", "stiffness='0.3'", -1e9, 9.9e9, 0},
               {"", "range='-1 1' solimplimit='0.9999 0.9999'", 1.01, 0, 1e10},
               {"", "range='-1 1' solreflimit='-1e14 -1'", 1.01, 0, 0}};
  for (const auto& c : cases) {
    const auto model = Model::parse("slide", std::string("<mujoco><option ") + c.option + R"(/><worldbody>
      <body><joint name='j' type='slide' axis='1 0 0' )" +
                                                 c.joint + R"(/><geom size='0.1' mass='1'/></body></worldbody>
      <actuator><motor joint='j' gear='20'/></actuator></mujoco>)");
    const std::uint32_t done = step_rows(model, [&](std::size_t row, mjData& d) {
      if (row % 2 == 1) d.qpos[0] = c.qpos, d.qvel[0] = c.qvel, d.ctrl[0] = c.ctrl;
    });
    assert_int_equal(done, ((1U << lanes::widths().back()) - 1) & 0x55);
  }
}

// States around the greatest numbers that MuJoCo allows: it resets rows with greater ones, also if they would be smaller
// after the step.
void test_states_at_limit(void** /*state*/) {
  const auto model = Model::parse("limit", R"(<mujoco><option timestep='0.1'/><worldbody>
    <body><joint type='slide' damping='0.2'/><geom size='0.1' mass='1'/></body>
    <body pos='1 0 0'><joint type='slide'/><geom size='0.1' mass='1'/></body></worldbody></mujoco>)");
  Noise noise;
  const double values[] = {0, 9e9, 9.99e9, 1e10, std::nextafter(1e10, 2e10), 1.001e10, 1.01e10};
  const auto any = [&] { return (noise.below(2) ? 1 : -1) * values[noise.below(std::size(values))]; };
  int done = 0;
  for (int round = 0; round < 100; ++round)
    done += __builtin_popcount(step_rows(model, [&](std::size_t /*row*/, mjData& d) {
      for (int i = 0; i < 2; ++i) d.qpos[i] = any(), d.qvel[i] = any();
    }));
  assert_true(done > 20);
}

// Geoms that overlap by little. MuJoCo misses some of these contacts, because it compares boxes with rounded numbers.
void test_small_overlaps(void** /*state*/) {
  const std::string plane = "<geom type='plane' size='9 9 1' ", two = "<geom pos='0 0 0.4' size='0.01'/></body>";
  const struct {
    std::string world, more;
    double at;  // the position in which the geoms begin to touch
    int digits;
  } cases[] = {{plane + "pos='0 0 0.3'/>", two, 0.3 + 0.07, 9},
               {plane + "pos='0 0 0.15'/><geom pos='0 0 9'/>", "</body>", 0.15 + 0.07, 9},
               {"<geom type='box' size='1 1 0.3' pos='0 0 0.35'/>", two, 0.35 + 0.3 + 0.07, 17},
               {"<body pos='0 0 100'><joint type='slide' axis='0 0 1'/><geom/></body>", "</body>", 100.14, 17}};
  for (const auto& c : cases) {
    const auto model = Model::parse("small overlaps", "<mujoco><default><geom size='0.07'/></default><worldbody>" +
                                                          c.world + "<body><joint type='slide' axis='0 0 1'/><geom/>" +
                                                          c.more + "</worldbody></mujoco>");
    Noise noise;
    Original original(*model);
    int missed = 0;
    for (int round = 0; round < 40; ++round)
      step_rows(model, [&](std::size_t /*row*/, mjData& d) {
        const double overlap = std::pow(10, -5 - (c.digits - 5) * std::abs(noise()));
        d.qpos[model->get()->nq - 1] = c.at - overlap;
        original.load(d);
        original.step();
        missed += original.contacts() == 0;
      });
    if (missed == 0) fail_msg("%s: nothing is missed", c.world.c_str());
  }
}

// Lanes leave rows whose Jacobians, stiffnesses or costs are so large that products with them may overflow.
void test_huge_numbers(void** /*state*/) {
  for (const auto& [option, geom, mass] : {std::tuple{"impratio='1e152'", "friction='1e76'", "1"},
                                           {"impratio='1e90'", "", "1"},
                                           {"cone='elliptic' impratio='1e90'", "", "1"},
                                           {"", "solref='-1e200 -1'", "1"},
                                           {"solver='PGS' impratio='1e300'", "friction='1e76'", "1e4"},
                                           {"solver='PGS'", "friction='1e60'", "1"},
                                           {"solver='PGS' impratio='1e250'", "friction='1e70'", "1e-12"}}) {
    const auto model = Model::parse(
        "huge", std::string("<mujoco><option ") + option +
                    "/><worldbody><geom type='plane' size='9 9 1' solmix='0'/><body pos='0 0 0.09'><joint type='slide' "
                    "axis='0 0 1'/><joint type='slide' axis='1 0 0'/><geom size='0.1' mass='" +
                    mass + "' " + geom + "/></body></worldbody></mujoco>");
    if (step_rows(model, [](std::size_t /*row*/, mjData& d) { d.qvel[1] = 1; }) != 0)
      fail_msg("%s %s: rows are not left", option, geom);
  }
}

// Where MuJoCo's memory is too small for the contacts or constraints of some rows, it fails or finds fewer of them, so lanes
// leave these rows to it.
void test_little_memory(void** /*state*/) {
  int rows = 0, left = 0;
  const std::string far = "<default><geom gap='3'/></default>";  // contacts without constraints
  for (const int size : {8, 10, 12, 14, 16, 18, 20, 24, 28, 32, 36, 40, 44, 48, 52, 56, 60}) {
    const std::string memory = "<size memory='" + std::to_string(size) + "K'/>";
    std::string apart = kApart;
    for (const std::string& text :
         {hedgehog("", 24, memory), hedgehog("solver='PGS'", 24, memory), hedgehog("", 24, memory + far),
          hedgehog("", 3, memory + far), apart.insert(8, memory)}) {
      const Named named(text.substr(0, 80), Model::parse("memory", text));
      for (const int width : lanes::widths())
        for (const char* array : {"qpos", "warnings"})
          test_steps(named, *lanes::code_of(width), {array, false, 1}, rows, left);
    }
  }
  assert_true(left > 0);
  for (const std::string size : {"<size nconmax='2'/>", "<size njmax='9'/>"}) {
    const Named named(size, Model::parse("size", hedgehog("", 24, size)));
    for (const int width : lanes::widths())
      for (const char* array : {"qpos", "warnings"})
        test_steps(named, *lanes::code_of(width), {array, false, 1}, rows, left);
  }
}

// What a model has, where it begins in kForces, and which stage it keeps out of lanes: all, if that is "".
struct Kept {
  const char *before, *feature, *stage, *why;
};
constexpr Kept kKept[] = {
    {"</actuator>", "<intvelocity joint='a' actrange='-1 1'/>", "actuators", "states of actuators"},
    {"</actuator>", "<pid joint='c' kp='3' kv='1'/>", "actuators", "actuators with several inputs or outputs"},
    {"</actuator>", "<dcmotor joint='c' motorconst='0.5' resistance='1'/>", "actuators",
     "gains and biases that are neither constant nor affine"},
    {"</actuator>", "<motor joint='f' gear='1 2 3 4 5 6'/>", "actuators",
     "actuators that act on something other than slides and hinges"},
    {"</mujoco>",
     "<tendon><fixed name='t'><joint joint='a' coef='2'/></fixed></tendon><actuator><motor tendon='t'/></actuator>",
     "actuators", "actuators that act on something other than slides and hinges"},
    {"<default>", "<option><flag actuation='disable'/></option>", "actuators", "disabled actuators"},
    {"</mujoco>", "<tendon><fixed stiffness='3'><joint joint='a' coef='2'/></fixed></tendon>", "passive forces",
     "springs and dampers of tendons"},
    {"</mujoco>", "<tendon><fixed damping='3'><joint joint='a' coef='2'/></fixed></tendon>", "passive forces",
     "springs and dampers of tendons"},
    {"</mujoco>", "<tendon><fixed damping='3'><joint joint='a' coef='2'/></fixed></tendon>", "tendons",
     "not written yet"},
    {"</worldbody>", "<body><joint type='ball' stiffness='3'/><geom/></body>", "passive forces",
     "springs of free joints and balls"},
    {"</worldbody>", "<body><joint stiffness='3 1'/><geom pos='0.1 0 0'/></body>", "passive forces",
     "springs that are not linear"},
    {"</worldbody>", "<body><joint/><geom pos='0.1 0 0' fluidshape='ellipsoid'/></body>", "passive forces",
     "the fluid model of ellipsoids"},
    {"<default>", "<option integrator='implicit'/>", "integration", "the integrator implicit"},
    {"<default>", "<option integrator='implicitfast'/>", "integration", "implicitfast with a fluid"},
    {"<default>", "<option solver='CG'/>", "solver", "a solver other than Newton and PGS"},
    {"<default>", "<option solver='CG'/>", "contacts, constraints", "the solver is computed row by row"},
    {"<default>", "<option jacobian='sparse'/>", "solver", "sparse Jacobians"},
    {"<default>", "<option solver='PGS' cone='elliptic'/>", "solver", "elliptic cones with PGS"},
    {"<default>", "<option noslip_iterations='2'/>", "solver", "noslip"},
    {"<default>", "<option><flag island='disable'/></option>", "solver", "no islands (opt.disableflags)"},
    {"</actuator>", "<adhesion body='d' ctrlrange='0 1'/>", "contacts, constraints", "actuators that act on bodies"},
    {"</mujoco>", "<sensor><rangefinder site='s'/></sensor>", "sensors",
     "sensors other than those of motion, touch and forces of actuators"},
    {"<default>", "<option><flag fwdinv='enable'/></option>", "",
     "the comparison of forward and inverse dynamics (opt.enableflags)"},
    {"</worldbody>", "<body><joint stiffness='3' springyield='1'/><geom pos='0.1 0 0'/></body>", "",
     "plastic joints or tendons"},
    {"</actuator>", "<motor joint='a' nsample='3'/>", "", "delays or histories"},
    {"</actuator>", "<motor joint='a' armature='1'/>", "", "actuators or tendons with inertia or damping"},
    {"</mujoco>", "<tendon><fixed armature='3'><joint joint='a' coef='2'/></fixed></tendon>", "",
     "actuators or tendons with inertia or damping"},
    {"</mujoco>",
     "<tendon><fixed name='t'><joint joint='a' coef='2'/></fixed></tendon><actuator><motor tendon='t' armature='1'/>"
     "</actuator>",
     "", "actuators or tendons with inertia or damping"},
    {"</mujoco>", "<sensor><e_kinetic/></sensor>", "", "sensors of energies"},
    {"</worldbody>", "<body><joint damping='3 1'/><geom pos='0.1 0 0'/></body>", "", "damping that is not linear"},
    {"<default>", "<option integrator='discrete'/>", "", "the integrator discrete"},
};

// Models with such features say so, and step with MuJoCo's bits.
void test_obstacles(void** /*state*/) {
  for (const Kept& kept : kKept) {
    std::string text = kForces;
    text.replace(text.find("<freejoint"), 10, "<freejoint name='f'")
        .insert(text.find("<body pos='0 1 0'") + 5, " name='d'");
    text.insert(text.find("</worldbody>"), "<site name='s'/>").insert(text.find(kept.before), kept.feature);
    const auto model = Model::parse("kept", text);
    std::string found = lanes::obstacle(*model);
    for (const lanes::Stage& stage : lanes::stages())
      if (stage.name == std::string(kept.stage)) found = stage.obstacle(*model);
    if (found != kept.why) fail_msg("%s: %s", kept.feature, found.c_str());
    int rows = 0, left = 0;
    for (const int width : lanes::widths())
      if (*kept.stage) test_steps({kept.feature, model}, *lanes::code_of(width), {"qpos", false, 2}, rows, left);
  }
}

}  // namespace
}  // namespace mjenv::core

int run_twins() {
  using namespace mjenv::core;
  const CMUnitTest tests[] = {cmocka_unit_test(test_stages),
                              cmocka_unit_test(test_contacts),
                              cmocka_unit_test(test_steps),
                              cmocka_unit_test(test_rows_left),
                              cmocka_unit_test(test_obstacles),
                              cmocka_unit_test(test_many_constraints),
                              cmocka_unit_test(test_many_places),
                              cmocka_unit_test(test_many_limits),
                              cmocka_unit_test(test_what_is_solved),
                              cmocka_unit_test(test_choices),
#ifdef COUNTS_MEMORY
                              cmocka_unit_test(test_memory),
#endif
                              cmocka_unit_test(test_numbers_within_steps),
                              cmocka_unit_test(test_states_at_limit),
                              cmocka_unit_test(test_small_overlaps),
                              cmocka_unit_test(test_huge_numbers),
                              cmocka_unit_test(test_little_memory),
                              cmocka_unit_test(test_odd_rows)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
