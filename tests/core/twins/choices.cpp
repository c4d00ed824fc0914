// What lanes say of models, what they leave to MuJoCo's functions, and how much memory they take.
#include "twins/harness.hpp"

// Sanitizers have allocators of their own, whose memory mallinfo2 does not count.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#if __GLIBC_PREREQ(2, 33)
#define COUNTS_MEMORY
#include <malloc.h>
#endif
#endif

#include "engine/errors.hpp"
#include "engine/lanes/frame/stages.hpp"
#include "engine/lanes/mujoco4/collider.hpp"

namespace mjenv::core::twins {
namespace {

// What lanes say of models, and how many lanes a thread uses.
TEST(test_choices) {
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
        {parse(limits("")), "tendons: lanes"},
        {parse(states), "actuators: row by row: states of actuators"},
        {with_sensors("", "", "<touch site='t'/>"), "sensors: lanes; row by row: touch"},
        {with_sensors("", "", ""), "sensors: lanes"},
        {parse("<mujoco><worldbody><body><joint/><geom size='0.1' adhesion='1'/></body></worldbody></mujoco>"),
         "passive forces: row by row: adhesion"},
        {fast("density='1'", "", ""), "integration: row by row: implicitfast with a fluid"},
        {fast("viscosity='1'", "", ""), "integration: row by row: implicitfast with a fluid"},
        {fast("", "", "<tendon><fixed damping='1'><joint joint='j' coef='1'/></fixed></tendon>"),
         "integration: row by row: implicitfast with dampers of tendons"},
        {fast("", "",
              "<tendon><fixed name='t'><joint joint='j' coef='1'/></fixed></tendon><actuator><motor "
              "tendon='t'/></actuator>"),
         "integration: row by row: implicitfast with actuators of tendons"},
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
TEST(test_memory) {
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
     "actuators that act on something other than slides, hinges and tendons"},
    {"</mujoco>",
     "<tendon><fixed name='t' actuatorfrcrange='-1 1'><joint joint='a' coef='2'/></fixed></tendon>"
     "<actuator><motor tendon='t' gear='9'/></actuator>",
     "actuators", "tendons that limit the forces of actuators"},
    {"<default>", "<option><flag actuation='disable'/></option>", "actuators", "disabled actuators"},
    {"</mujoco>", "<tendon><fixed stiffness='0 1'><joint joint='a' coef='2'/></fixed></tendon>", "passive forces",
     "springs and dampers of tendons that are not linear"},
    {"</mujoco>", "<tendon><fixed damping='3 1'><joint joint='a' coef='2'/></fixed></tendon>", "passive forces",
     "springs and dampers of tendons that are not linear"},
    {"</mujoco>", "<tendon><fixed damping='3 1'><joint joint='a' coef='2'/></fixed></tendon>", "tendons",
     "a later stage is computed row by row"},
    {"</mujoco>",
     "<tendon><spatial><site site='s'/><site site='r'/><pulley divisor='2'/><site site='s'/><site site='r'/></spatial>"
     "</tendon>",
     "tendons", "tendons around geoms or over pulleys"},
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
TEST(test_obstacles) {
  for (const Kept& kept : kKept) {
    std::string text = kForces;
    text.replace(text.find("<freejoint"), 10, "<freejoint name='f'")
        .insert(text.find("<body pos='0 1 0'") + 5, " name='d'");
    text.insert(text.find("</worldbody>"), "<site name='s'/><site name='r' pos='0 0 1'/>")
        .insert(text.find(kept.before), kept.feature);
    const auto model = Model::parse("kept", text);
    std::string found = lanes::obstacle(*model);
    for (const lanes::Stage& stage : lanes::stages())
      if (stage.name == std::string(kept.stage)) found = stage.obstacle(*model);
    if (found != kept.why) fail_msg("%s: %s", kept.feature, found.c_str());
    int rows = 0, left = 0;
    for (const int width : lanes::widths())
      if (*kept.stage) compare_steps({kept.feature, model}, *lanes::code_of(width), {"qpos", false, 2}, rows, left);
  }
}

}  // namespace
}  // namespace mjenv::core::twins
