// Whole models: the built-in robots, and odd models with all options.
#include "lanes/harness.hpp"

#include "engine/assets.hpp"

namespace mjenv::core::lanes_tests {
namespace {

TEST(test_built_in) {
  assert_true(!lanes::widths().empty());
  failures.clear();
  for (std::size_t i = 0; i < asset_count; ++i) {
    const auto model = Model::open(assets[i].name);
    assert_string_equal(lanes::obstacle(*model).c_str(), "");
    const std::string found = compare(model);
    if (!found.empty()) failures += std::string(assets[i].name) + ": " + found + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

std::string without(const std::string& word, std::string text) {
  for (std::size_t at; (at = text.find(word)) != std::string::npos;)
    text.erase(at, text.find('"', at + word.size()) + 1 - at);
  return text;
}

// What the robots lack: MuJoCo's search for pairs of geoms beside their list, both integrators, other options.
// Lanes solve constraints only if joints and tendons have no friction, and only with two solvers and one kind of cone.
TEST(test_odd) {
  failures.clear();
  const std::string text = odd_model("lanes.xml");
  // With these affinities, geoms touch the floor alone, so their pairs can be listed.
  const std::string listed = with("<worldbody>", "<default><geom conaffinity=\"0\"/></default><worldbody>", text);
  const std::string smooth = without(" frictionloss=\"", text), smooth_listed = without(" frictionloss=\"", listed);
  // Zeros that are negative in axes alone, in positions alone, and nowhere.
  const std::string of_axes = with("pos=\"0.02 -0 0.01\"", "pos=\"0.02 0 0.01\"", smooth_listed);
  const auto without_axes = [](const std::string& from) {
    return with("axis=\"1 -0 0\"", "axis=\"1 0 0\"", with("axis=\"-0 0 1\"", "axis=\"0 0 1\"", from));
  };
  const std::string thin = with("density=\"30\" ", "", smooth_listed),
                    slick = with("viscosity=\"0.2\" ", "", smooth_listed);
  const std::string of_positions = without_axes(smooth_listed), of_none = without_axes(of_axes);
  const std::vector<std::string> one{"<option"}, few{"<option", "<option integrator=\"RK4\"", "<option solver=\"PGS\""},
      all{"<option",
          "<option integrator=\"RK4\"",
          "<option solver=\"PGS\"",
          "<option iterations=\"2\"",
          "<option iterations=\"1\"",
          "<option iterations=\"0\"",
          "<option iterations=\"-1\"",
          "<option tolerance=\"0\"",
          "<option impratio=\"3\"",
          "<option solver=\"PGS\" iterations=\"2\"",
          "<option solver=\"PGS\" iterations=\"0\"",
          "<option solver=\"PGS\" iterations=\"-1\" tolerance=\"0\"",
          "<option cone=\"elliptic\"",
          "<option noslip_iterations=\"3\"",
          "<option><flag gravity=\"disable\"/></option><option",
          "<option><flag clampctrl=\"disable\"/></option><option",
          "<option><flag constraint=\"disable\"/></option><option",
          "<option><flag warmstart=\"disable\"/></option><option",
          "<option solver=\"CG\""};
  for (const auto& [base, options] : {std::pair{&text, &few},
                                      {&listed, &few},
                                      {&smooth, &few},
                                      {&smooth_listed, &all},
                                      {&of_axes, &one},
                                      {&of_positions, &one},
                                      {&of_none, &one},
                                      {&thin, &one},
                                      {&slick, &one}})
    for (const std::string& option : *options) {
      const auto model = Model::parse("lanes.xml", with("<option", option, *base));
      assert_string_equal(lanes::obstacle(*model).c_str(), "");
      assert_int_equal(model->pairs() != nullptr, base != &text && base != &smooth);
      const std::string found = compare(model);
      if (!found.empty()) failures += option + ": " + found + "\n";
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Sensors and energies, which MuJoCo's functions compute row by row; mocap bodies, equality constraints, friction; and contacts
// of all shapes, also of moving bodies with each other.
TEST(test_stages) {
  const std::string quadruped = odd_model("quadruped.xml");
  const std::string touching =
      with("<clock/>", "<clock/><touch site='fl'/><force site='fr'/><jointlimitfrc joint='fl3'/>", quadruped);
  const std::string lanes = odd_model("lanes.xml");
  const std::string actuated = with("</actuator>",
                                    "<motor site='tip' refsite='base' gear='1 0 2 0 0.1 0'/>"
                                    "<general joint='x' dyntype='integrator' actlimited='true' actrange='0 0.8'/>"
                                    "<muscle joint='knee' lengthrange='-1 1'/></actuator>",
                                    with("<site name=\"tip\"", "<site name=\"base\"/><site name=\"tip\"", lanes));
  const std::string passive = with("type=\"ellipsoid\"", "type=\"ellipsoid\" fluidshape=\"ellipsoid\"",
                                   with("<joint type=\"ball\"", "<joint type=\"ball\" stiffness=\"2\"", lanes));
  const std::string disabled =
      with("<option", "<option><flag passive=\"disable\" actuation=\"disable\"/></option><option", lanes);
  const struct {
    const char* name;
    std::string text;
    bool are_made;  // whether lanes make the constraints
  } models[] = {{"quadruped.xml", quadruped, true},
                {"quadruped.xml, touch", touching, true},
                {"shapes.xml", odd_model("shapes.xml"), true},
                {"sensors.xml", odd_model("sensors.xml"), true},
                {"mocap.xml", odd_model("mocap.xml"), false},
                {"tendons.xml", odd_model("tendons.xml"), true},
                {"terrain.xml", odd_model("terrain.xml"), false},
                {"lanes.xml, actuators", actuated, true},
                {"lanes.xml, passive", passive, true},
                {"lanes.xml, disabled", disabled, true},
                {"tethered_pair.xml", odd_model("tethered_pair.xml"), true},
                {"equalities.xml", odd_model("equalities.xml"), true},
                {"actuators.xml", odd_model("actuators.xml"), true},
                {"sensing.xml", odd_model("sensing.xml"), true}};
  failures.clear();
  for (const auto& m : models)
    for (const char* option :
         {"", "<option solver='PGS'/>", "<option integrator='RK4'><flag energy='enable'/></option>",
          "<option solver='CG'/>", "<option solver='CG' cone='elliptic' iterations='30'/>",
          "<option solver='PGS' cone='elliptic' noslip_iterations='2'/>", "<option integrator='implicit'/>",
          "<option integrator='implicit' jacobian='sparse'/>", "<option solver='Newton' cone='pyramidal'/>",
          "<option solver='Newton' cone='elliptic'/>",
          "<option><flag equality='disable' frictionloss='disable' warmstart='disable' "
          "sensor='disable'/></option>"}) {
      const auto model = Model::parse(m.name, in_front_of_body(option, m.text));
      assert_string_equal(lanes::obstacle(*model).c_str(), "");
      const std::string found = compare(model, kFewRows), which = std::string(m.name) + ", " + option + ": ";
      if (!found.empty()) failures += which + found + "\n";
      if (m.are_made && made == 0 && !mj_isSparse(model->get())) failures += which + "no constraints made in lanes\n";
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// At 60 dofs MuJoCo's own choice is sparse matrices.
TEST(test_many_dofs) {
  std::string bodies;
  for (int i = 0; i < 11; ++i)
    bodies += "<body pos='" + std::to_string(i) +
              " 0 0.2'><freejoint/><geom type='capsule' size='0.1 0.2' conaffinity='0'/>" +
              (i % 4 ? "" : "<body pos='0 0 0.3'><joint axis='0 1 0'/><geom size='0.1' conaffinity='0'/></body>") +
              "</body>";
  failures.clear();
  for (const char* option : {"", "solver='PGS'", "integrator='RK4'"})
    for (const bool is_dense : {true, false}) {
      const auto model = Model::parse(
          "many dofs", std::string("<mujoco><option ") + option + (is_dense ? " jacobian='dense'" : "") +
                           "/><worldbody><geom type='plane' size='9 9 1'/>" + bodies + "</worldbody></mujoco>");
      assert_true(model->get()->nv >= 60);
      const std::string found = compare(model, kFewRows);
      if (!found.empty()) failures += option + (": " + found) + "\n";
      assert_int_equal(made_of_contacts > 0, is_dense || std::string(option) != "solver='PGS'");
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Many limits and contacts, for which the lanes' memory must be large enough: 36 balls have limits, and 36 geoms of one
// body touch the floor.
TEST(test_many_entries) {
  std::string balls, geoms;
  for (int i = 0; i < 36; ++i) {
    const std::string x = std::to_string(i);
    balls += "<body pos='" + x + " 0 0.2'><joint type='ball' limited='true' range='0 10'/><geom size='0.1'/></body>";
    geoms += "<geom size='0.1' pos='" + x + " 0.2 0'/>";
  }
  const std::string slides =
      "<body pos='0 5 0.09'><joint type='slide' limited='true' range='-0.01 0.01'/><geom size='0.1'/></body>";
  for (const std::string& bodies :
       {balls + slides, "<body pos='0 0 0.099'><joint type='slide'/><joint axis='1 0 0'/>" + geoms + "</body>"}) {
    const auto model = Model::parse("entries",
                                    "<mujoco><option jacobian='dense'/><default><geom conaffinity='0' condim='1'/>"
                                    "</default><worldbody><geom type='plane' size='9 9 1' conaffinity='1'/>" +
                                        bodies + "</worldbody></mujoco>");
    const bool are_limits = model->get()->njnt > 2;
    const std::string found =
        compare_own(model, "body_mass", other_values, 0, 2, are_limits ? Kind::tame : Kind::at_rest);
    assert_string_equal(found.c_str(), "");
    assert_true((are_limits ? made : made_of_contacts) > 0);
    assert_true(made_of_shared > 0 && made > made_of_shared);
  }
}

}  // namespace
}  // namespace mjenv::core::lanes_tests
