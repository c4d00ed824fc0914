#include "twins/models.hpp"

#include <cmath>
#include <cstddef>

namespace mjenv::core::twins {
namespace {

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

}  // namespace

std::shared_ptr<const Model> with_sensors(const std::string& option, const std::string& flag, const std::string& more) {
  std::string text = kSensors;
  for (const std::string& part : {option, flag, more}) text.replace(text.find("%s"), 2, part);
  text.replace(text.find("size='0.2'/>"), 0, "name='g' ");
  return Model::parse("sensors", text);
}

std::string listed(std::string text) {
  if (const std::size_t at = text.find("<geom type='plane'"); at != std::string::npos)
    text.insert(at + 18, " conaffinity='1'");
  const std::size_t at = text.find("<default><geom");
  return at != std::string::npos ? text.insert(at + 14, " conaffinity='0'")
                                 : text.insert(text.find("<worldbody>"), "<default><geom conaffinity='0'/></default>");
}

std::string limits(const std::string& option, bool has_friction) {
  std::string text = kLimits;
  if (has_friction) text.insert(text.find("<joint name='h'") + 6, " frictionloss='0.3'");
  return text.replace(text.find("%s"), 2, option);
}

std::string without(std::string text, const std::string& begin, const std::string& end) {
  const std::size_t from = text.find(begin);
  return text.erase(from, text.find(end, from + begin.size()) + end.size() - from);
}

std::string hedgehog(const std::string& option, int spikes, const std::string& more) {
  std::string text = "<mujoco><option " + option + "/>" + more +
                     "<worldbody><geom type='plane' size='9 9 1'/><body pos='0 0 0.9'><freejoint/>";
  for (int i = 0; i < spikes; ++i) {
    const double z = 1 - (2 * i + 1.0) / spikes, radius = std::sqrt(1 - z * z), angle = 2.4 * i;
    text += "<geom size='0.1' pos='" + std::to_string(radius * std::cos(angle)) + " " +
            std::to_string(radius * std::sin(angle)) + " " + std::to_string(z) + "'/>";
  }
  return text + "</body></worldbody></mujoco>";
}

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
  const std::string pyramids = without(alone, "cone='", "' "), free = without(robot, "<equality", "</equality>");
  found.emplace_back("one robot with pyramids", Model::parse("robot", pyramids));
  found.emplace_back("robot", Model::parse("robot", robot));
  found.emplace_back("one robot", Model::parse("robot", alone));
  found.emplace_back("robot without equality", Model::parse("robot", free));
  found.emplace_back("robot without equality, with pyramids", Model::parse("robot", without(free, "cone='", "' ")));
  found.emplace_back("robot with Euler", Model::parse("robot", without(robot, " integrator='", "'")));
  for (const char* equality :
       {"<connect body1='arm' anchor='0.1 0 0.1'/>", "<weld body1='arm' torquescale='0.3'/>",
        "<weld body1='hand' body2='arm'/>", "<connect site1='tip' site2='tail'/>", "<weld site1='tail' site2='tip'/>"})
    for (std::string held : {robot, pyramids})
      found.emplace_back(equality, Model::parse("robot", held.insert(held.find("</equality>"), equality)));
  std::string joined = robot;  // two trees
  joined.insert(joined.find("</equality>"), "<connect body1='arm' body2='d' anchor='0 0 0'/>");
  found.emplace_back("joined robots", Model::parse("robot", joined));
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
  const std::string tendons = kTendons;
  const std::string on_one = without(without(tendons, "<body name='other'", "</body>"), "<fixed name='v'", "</fixed>");
  std::string sensed = on_one;
  sensed.insert(sensed.find("</mujoco>"),
                "<sensor><tendonpos tendon='t'/><tendonvel tendon='t'/><tendonlimitfrc tendon='t'/></sensor>");
  std::string pulled = tendons;
  pulled.insert(pulled.find("</mujoco>"), R"(<actuator><motor tendon='t' gear='-3' ctrlrange='-0.5 0.4'/>
    <position tendon='u' kp='40' forcerange='-3 5'/><velocity tendon='v' kv='2' gear='-0.5'/><motor joint='b'/>
    <general tendon='t' gaintype='affine' gainprm='1 2 3' biastype='affine' biasprm='0.1 -2 -0.3'/></actuator>)");
  std::string sprung = tendons;
  sprung.insert(sprung.find("name='t'"), "stiffness='90' springlength='0.1 0.3' damping='0.7' ");
  sprung.insert(sprung.find("name='u'"), "stiffness='5' damping='-0' ");
  sprung.insert(sprung.find("name='v'"), "stiffness='-0' damping='-0.4' ");
  sprung.insert(sprung.find("name='g'"), "stiffness='3' ");
  for (const std::string& text : {tendons, on_one, without(on_one, "frictionloss", "0.4'"), sensed, pulled, sprung})
    for (const char* option :
         {" integrator='RK4'", " solver='PGS'", " integrator='implicitfast' cone='elliptic'", " solver='CG'"}) {
      std::string with = text;
      with.insert(with.find("<option") + 7, option);
      found.emplace_back("tendons with" + std::string(option), Model::parse("tendons", with));
    }
  for (const char* option : {" integrator='RK4'", " solver='PGS'", " solver='CG'"}) {
    std::string with = kStrings;
    with.insert(with.find("<option") + 7, option);
    found.emplace_back("strings with" + std::string(option), Model::parse("strings", with));
  }
  for (const std::string kind : {"spring", "damper"}) {
    std::string without_some = sprung;
    without_some.replace(without_some.find("<option/>"), 9, "<option><flag " + kind + "='disable'/></option>");
    found.emplace_back("tendons without a " + kind, Model::parse("tendons", without_some));
  }
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

}  // namespace mjenv::core::twins
