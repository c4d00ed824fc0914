// Sensors.
#include "lanes/harness.hpp"

namespace mjenv::core::lanes_tests {
namespace {

// Cameras that only a reference names; rangefinders, which MuJoCo computes, beside a sensor that lanes compute; and a
// sensor that alone reads constraints before there are forces
TEST(test_lone_sensors) {
  const auto text = [](const char* sensor) {
    return std::string(R"(<mujoco><worldbody><geom type='plane' size='5 5 1'/>
    <body name='a' pos='0 0 0.3'><joint name='a' axis='0 1 0'/><geom size='0.1' pos='0.2 0 0'/><site pos='0.1 0 0'/>
    <camera pos='0.1 0 0'/><body name='b' pos='0.3 0 0'><joint axis='1 0 0'/><geom name='b' size='0.1' pos='0 0.1 0'/>
    <site name='down' pos='0 0.1 -0.1' euler='170 20 0'/>
    <camera name='eye' pos='0 0 0.1' euler='10 20 30' mode='track'/></body></body></worldbody>
    <tendon><fixed name='t' limited='true' range='-0.1 0.1' margin='0.1'><joint joint='a' coef='1'/></fixed></tendon>
    <sensor>)") +
           sensor + "</sensor></mujoco>";
  };
  failures.clear();
  for (const char* sensor :
       {"<framepos objtype='xbody' objname='a' reftype='camera' refname='eye'/>",
        "<framequat objtype='xbody' objname='a' reftype='camera' refname='eye'/>",
        "<rangefinder site='down'/><rangefinder site='down' cutoff='0.2'/><framequat objtype='geom' objname='b'/>",
        "<tendonlimitvel tendon='t'/>", "<force site='down'/><torque site='down'/>"}) {
    const std::string found = compare(Model::parse("sensor", text(sensor)), kFewRows);
    if (!found.empty()) failures += sensor + (": " + found) + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Frames of geoms and cameras, rays, and the quaternion of a ball, without sensors that read constraints. With RK4,
// MuJoCo computes the energies of its last stage.
TEST(test_sensors_of_frames) {
  const std::string scene = R"(<mujoco><default><geom contype='0' conaffinity='0'/></default><worldbody>
    <geom type='plane' size='5 5 1'/>
    <body pos='0 0 1'><joint axis='0 1 0' stiffness='2' springref='30'/>
    <geom type='capsule' size='0.05 0.2'/><site name='a' pos='0.3 0 0' euler='180 10 0'/>
    <body pos='0.2 0 0.1' euler='10 20 30'><joint name='ball' type='ball' stiffness='3'/>
    <geom name='b' type='box' size='0.1 0.2 0.05'/><site name='b' pos='0.1 0 0' euler='150 0 30'/>
    <body pos='0 0.3 0'><joint axis='1 0 0' damping='0.1'/>
    <geom name='c' type='box' size='0.4 0.1 0.2' euler='0 10 0'/><site name='c' pos='0 0.2 -0.3' euler='200 0 0'/>
    <camera name='fixed' pos='0.1 0 0.2' euler='10 20 30'/><camera name='tracking' pos='0 0.1 0' mode='trackcom'/>
    </body></body></body></worldbody><sensor>
    <framexaxis objtype='geom' objname='b'/><frameyaxis objtype='geom' objname='c'/>
    <framepos objtype='geom' objname='c'/><framepos objtype='camera' objname='fixed'/>
    <framepos objtype='camera' objname='tracking'/><frameyaxis objtype='camera' objname='fixed'/>
    <rangefinder site='a'/><rangefinder site='b'/><rangefinder site='c'/><ballquat joint='ball'/>
    </sensor></mujoco>)";
  const ErrorTrap trap;
  for (const char* option : {"", "<option integrator='RK4'><flag energy='enable'/></option>"}) {
    const auto model = Model::parse("frames", in_front_of_body(option, scene));
    const auto stepper = lanes::make_stepper(*model, *lanes::code_of(2));
    const std::string found = compare(model, 2, *stepper, OwnArrays(*model), 12 * share);
    if (!found.empty()) fail_msg("%s: %s", option, found.c_str());
  }
}

// Without a callback, MuJoCo leaves user sensors at 0, beside sensors of motion and beside those that read constraints.
TEST(test_user_sensors) {
  const std::string user = "<user objtype='joint' objname='knee' datatype='real' needstage='acc' dim='2' cutoff='1'/>",
                    motion = "<sensor><jointvel joint='knee'/>" + user + "</sensor></mujoco>",
                    limits = "<sensor><jointlimitfrc joint='knee'/>" + user + "</sensor></mujoco>";
  for (const std::string& sensors : {motion, limits})
    assert_string_equal(
        compare(Model::parse("contacts.xml", with("</mujoco>", sensors, odd_model("contacts.xml"))), 16).c_str(), "");
}

// Touch sensors with zones of different shapes, on the first and on the second body of contacts; rows touch with
// different forces or not at all. The last body has so little weight that its force must be normalized.
TEST(test_touch) {
  const auto model = Model::parse("touch", R"(<mujoco><worldbody><geom type='plane' size='2 2 1'/>
    <body pos='0 0 0.099'><joint type='slide' axis='0 0 1'/><joint type='slide' axis='1 0 0'/><geom size='0.1'/>
    <site name='foot' size='0.03 0.03 0.03' pos='0.03 0 -0.08'/><site name='around' type='box' size='0.2 0.15 0.11'/>
    <site name='over' size='0.03' pos='0.02 0 -0.06'/><site name='under' size='0.03' pos='0.02 0 -0.14'/></body>
    <body pos='0 0 0.296'><joint type='slide' axis='0 0 1'/><geom size='0.1'/>
    <site name='below' type='ellipsoid' size='0.05 0.08 0.11' pos='0.01 0 0' euler='0 10 0'/></body>
    <body pos='1 0 0.0999'><joint type='slide' axis='0 0 1'/><geom size='0.1'/><site name='light' size='0.2'/>
    <inertial pos='0 0 0' mass='1e-9' diaginertia='1e-12 1e-12 1e-12'/></body></worldbody>
    <sensor><touch site='foot'/><touch site='around' cutoff='30'/><touch site='around'/><touch site='below'/>
    <touch site='over'/><touch site='under'/><touch site='light'/></sensor>
    </mujoco>)");
  const auto move = [](std::size_t row, const RowState& state) {
    const auto number = static_cast<double>(row);
    state.qpos[0] = row % 4 == 3 ? 0.01 : 0;
    state.qpos[1] = row % 3 == 1 ? 0.1 : 0;
    state.qvel[0] = 0.1 - 0.1 * number;
    state.qvel[2] = -0.2 * number;
  };
  assert_int_equal(step_from(model, {move}) + 1, 1U << lanes::widths().back());
}

}  // namespace
}  // namespace mjenv::core::lanes_tests
