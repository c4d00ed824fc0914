// Which geoms are near, and their contacts.
#include "lanes/harness.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#define MJENV_LANES_WIDTH 2
#include "engine/lanes/frame/version_code.hpp"
#include "engine/lanes/mujoco2/model_tables.hpp"

namespace mjenv::core::lanes_tests {
namespace {

// Limits and contacts of all kinds, with each solver
TEST(test_contacts) {
  const struct {
    std::string from, to;
    bool are_made;
    const char* cone = "pyramidal";
  } cases[] = {
      {"", "", true},
      {"<option", "<option integrator=\"RK4\"", true},
      {"<option", "<option impratio=\"3\"", true},
      {"<option", "<option jacobian=\"dense\" iterations=\"1\"", true},
      {"<option", "<option tolerance=\"0\" iterations=\"20\"", true},
      {"<geom conaffinity", "<geom condim=\"1\" conaffinity", true},
      {"<geom conaffinity", "<geom condim=\"4\" conaffinity", true},
      {"<geom conaffinity", "<geom condim=\"6\" conaffinity", true},
      {"<geom conaffinity", "<geom margin=\"0.05\" gap=\"0.03\" conaffinity", true},
      {"<geom conaffinity", "<geom solref=\"-500 -20\" conaffinity", true},
      {"<geom conaffinity", "<geom solref=\"0.005 1\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0.8 0.95 0.02 0.3 3\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0.8 0.95 0.02 0.7 1\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0.9 0.9 0.02\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0.8 0.9 0\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0 1 0.02 0 2\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0 0.9 0.02 1 2\" conaffinity", true},
      {"<geom conaffinity", "<geom solimp=\"0.8 0.95 0.02 0.5 0.5\" conaffinity", true},
      {"<geom conaffinity", "<geom solref=\"0.02 -1\" conaffinity", false},
      {"friction=\"0.8", "friction=\"0", true},
      {"name=\"other\" type=\"sphere\" size=\"0.1\"", "type=\"box\" size=\"0.1 0.1 0.1\"", true},
      {"name=\"x\"", "name=\"x\" frictionloss=\"0.1\"", true},
      {"type=\"ball\"", "type=\"ball\" limited=\"true\" range=\"0 10\"", true},
      {"<option", "<option collision=\"dynamic\"><flag limit=\"disable\"/></option><option", true},
      {"<option", "<option><flag refsafe=\"disable\"/></option><option", true},
      {"<option", "<option><flag contact=\"disable\"/></option><option", false},
      {"<option", "<option cone=\"elliptic\"", true},
      {"<option", "<option cone=\"elliptic\" impratio=\"100\" integrator=\"RK4\"", true},
      {"<option", "<option cone=\"elliptic\" iterations=\"2\"><flag refsafe=\"disable\"/></option><option", true},
      {"<geom conaffinity", "<geom condim=\"1\" conaffinity", true, "elliptic"},
      {"<geom conaffinity", "<geom condim=\"4\" conaffinity", true, "elliptic"},
      {"<geom conaffinity", "<geom condim=\"6\" conaffinity", true, "elliptic"},
      {"<geom conaffinity", "<geom margin=\"0.05\" gap=\"0.03\" condim=\"6\" conaffinity", true, "elliptic"},
      {"friction=\"0.8", "friction=\"0", true, "elliptic"},
      {"name=\"x\"", "name=\"x\" frictionloss=\"0.1\"", true, "elliptic"},
      {"<option", "<size nconmax=\"3\"/><option", true},
      {"<option", "<size njmax=\"12\"/><option", true}};
  failures.clear();
  for (const auto& c : cases)
    for (const char* solver : {"Newton", "PGS", "CG"}) {
      const bool is_elliptic = c.cone == std::string("elliptic") || c.to.find("elliptic") != std::string::npos;
      const std::string cone = std::string("<option cone=\"") + (is_elliptic ? "elliptic" : "pyramidal") + "\"/>";
      const std::string text = in_front_of_body(
          cone, with("<option", std::string("<option solver=\"") + solver + '"', odd_model("contacts.xml")));
      const auto model = Model::parse("contacts.xml", with(c.from, c.to, text));
      assert_string_equal(lanes::obstacle(*model).c_str(), "");
      const std::string found = compare(model, kFewRows);
      if (!found.empty()) failures += std::string(solver) + ", " + c.to + ": " + found + "\n";
      if ((made_of_contacts > 0) != c.are_made)
        failures +=
            std::string(solver) + ", " + c.to + ": made in lanes " + std::to_string(made_of_contacts) + " times\n";
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Parameters of contacts at which MuJoCo's comparisons change their result; and no room for constraints. The ball
// touches the floor so slightly that accelerations stay finite even if the contact is very stiff.
TEST(test_parameters_at_limits) {
  const struct {
    const char *attribute, *size;
    bool are_made;
  } cases[] = {{"solimp='0.8 0.9 1e-15'", "", true}, {"solref='0 0'", "", true}, {"", "<size njmax='0'/>", false}};
  for (const auto& c : cases) {
    const auto model = Model::parse("ball", std::string("<mujoco>") + c.size + "<default><geom " + c.attribute +
                                                "/></default><worldbody><geom type='plane' size='1 1 1'/>"
                                                "<body pos='0 0 0.0999999999'><freejoint/><geom size='0.1'/></body>"
                                                "</worldbody></mujoco>");
    assert_string_equal(compare(model, kFewRows).c_str(), "");
    assert_int_equal(made_of_contacts > 0, c.are_made);
  }
}

// Actuators whose moments depend on contacts, also on those in the gap
TEST(test_adhesion) {
  const std::string sticky =
      with("</mujoco>",
           "<actuator><adhesion body='ball' ctrlrange='0 3' gain='20'/><motor joint='knee' gear='2'/>"
           "<adhesion body='leg' ctrlrange='0 1' gain='50' forcelimited='true' forcerange='0 30'/></actuator></mujoco>",
           with("<body pos=\"0.3 0.1 0.3\">", "<body name='ball' pos='0.3 0.1 0.3'>",
                with("<body pos=\"0.3 0 0\">", "<body name='leg' pos='0.3 0 0'>", odd_model("contacts.xml"))));
  failures.clear();
  for (const char* option :
       {"<option/>", "<option cone='elliptic' integrator='RK4'/>", "<option solver='PGS' integrator='implicit'/>",
        "<option noslip_iterations='2'/>", "<option collision='dynamic'><flag actuation='disable'/></option>"}) {
    const auto model = Model::parse("contacts.xml", in_front_of_body(option, sticky));
    assert_string_equal(lanes::obstacle(*model).c_str(), "");
    const std::string found = compare(model, kFewRows);
    if (!found.empty()) failures += option + (": " + found) + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Radii of bounding spheres that MuJoCo's compiler does not write: of a plane, which is then bounded, and 0 of other
// shapes, which are then unbounded.
TEST(test_odd_radii) {
  const ErrorTrap trap;
  const auto geom = [](const char* body, const char* attributes) {
    return std::string("<body pos='") + body + "'><freejoint/><geom " + attributes + " contype='0'/></body>";
  };
  const auto model = Model::parse(
      "radii", "<mujoco><worldbody><geom type='plane' size='1 1 1'/><geom size='0.2' pos='5 0 0.5'/>" +
                   geom("0.2 0 0.09", "size='0.1'") + geom("2 0 0.09", "size='0.1'") + geom("3 0 0.09", "size='0.1'") +
                   geom("5 0 0.75", "type='capsule' size='0.1 0.1'") + "</worldbody></mujoco>");
  const mjModel& m = *model->get();
  assert_non_null(model->pairs());
  const OwnArrays none(*model);
  for (const bool is_bounded : {true, false}) {
    // The model's memory is not constant.
    m.geom_rbound[0] = is_bounded ? 1 : 0;
    for (const int odd : {4, 5}) m.geom_rbound[odd] = 0;
    const auto stepper = lanes::make_stepper(*model, *lanes::code_of(2));
    assert_string_equal(compare(model, 2, *stepper, none, kFewRows).c_str(), "");
  }
}

// MuJoCo tests the pairs of geoms that lanes have not rejected: of three pairs with 1, 3 and 6 friction dimensions, the
// last two.
TEST(test_dimensions_of_near_pairs) {
  const auto model = Model::parse("pairs", R"(<mujoco><default><geom conaffinity='0'/></default><worldbody>
    <geom type='plane' size='5 5 1' conaffinity='1' condim='1'/>
    <body pos='0 0 2'><freejoint/><geom size='0.1' condim='1'/></body>
    <body pos='1 0 0.09'><freejoint/><geom size='0.1' condim='3'/></body>
    <body pos='2 0 0.09'><freejoint/><geom size='0.1' condim='6'/></body></worldbody></mujoco>)");
  assert_non_null(model->pairs());
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 1, Kind::at_rest).c_str(), "");
}

// Values of odd rows that decide whether geoms touch. In the other rows, the boxes are apart, and the ball touches the
// floor, or is above it, with or without a margin that reaches the floor.
TEST(test_own_contacts) {
  const auto ball = [](const char* height, const char* attributes) {
    return std::string("<mujoco><worldbody><geom type='plane' size='1 1 1' ") + attributes + "/><body pos='0 0 " +
           height + "'><freejoint/><geom size='0.1' " + attributes + "/></body></worldbody></mujoco>";
  };
  const std::string boxes = R"(<mujoco><worldbody><geom type='box' size='.1 .1 .1'/><body pos='.3 0 0'>
    <joint type='slide' axis='1 0 0'/><geom type='box' size='.1 .1 .1'/></body></worldbody></mujoco>)",
                    hills = R"(<mujoco><asset><hfield name='hills' nrow='5' ncol='5' size='.5 .5 1 .1'/></asset>
    <worldbody><geom type='hfield' hfield='hills'/><body pos='0 0 .3'>
    <joint type='slide' axis='0 0 1'/><geom type='box' size='.1 .1 .1'/></body></worldbody></mujoco>)";
  const struct {
    std::string text;
    const char* array;
    double value;
    std::ptrdiff_t count = 0;  // of the last values of the array; 0: all
    std::uint32_t left = 0;
  } cases[] = {{boxes, "geom_size", 0.17},
               {boxes, "geom_margin", 0.15},
               {hills, "hfield_size", 2.5},
               {hills, "hfield_data", 0.25},
               {ball("0.15", "margin='0.1'"), "geom_gap", 0.1},
               {ball("0.15", ""), "geom_margin", 0.1},
               {ball("0.09", ""), "geom_rbound", 0.01, 1},
               {ball("0.09", ""), "geom_contype", 0},
               {ball("0.09", ""), "geom_conaffinity", 0},
               {ball("0.09", ""), "geom_margin", -0.01, 1, kOddRows}};
  const ErrorTrap trap;
  failures.clear();
  for (const auto& c : cases) {
    const auto model = Model::parse("contacts", c.text);
    const mjModel& m = *model->get();
    std::fill_n(m.hfield_data, m.nhfielddata, 0.1F);  // the model's memory is not constant
    const std::string found = compare_own(model, c.array, in_odd_rows(c.value, c.count), c.left, 2, Kind::at_rest);
    if (!found.empty()) failures += std::string(c.array) + ": " + found + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Lanes make the constraints of two bodies in deep contact, also if rows have their own margins of geoms.
TEST(test_own_margins_of_deep_contacts) {
  const auto model = Model::parse("deep", R"(<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body>
    <body pos='0.1 0 0'><freejoint/><geom size='0.1'/></body></worldbody></mujoco>)");
  assert_string_equal(compare_own(model, "geom_margin", in_odd_rows(0.01), 0, 2, Kind::at_rest).c_str(), "");
  assert_int_equal(made_of_contacts, 2);
}

// MuJoCo's search for pairs misses contacts that are shallower than its float32 numbers are precise. Rows with such
// contacts are left to it.
TEST(test_missed_contacts) {
  std::vector<std::shared_ptr<const Model>> models;
  int missed = 0;
  for (int i = 0; i < 60; ++i) {
    std::array<char, 32> place{};
    std::snprintf(place.data(), place.size(), "%.17g", 3.2 - 1e-8 * i);
    models.push_back(Model::parse("spheres",
                                  "<mujoco><worldbody><body pos='3 0.1 0.2'><freejoint/><geom size='0.1'/></body>"
                                  "<body pos='" +
                                      std::string(place.data()) +
                                      " 0.1 0.2'><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"));
    Work work(models.back());
    work.forward();
    missed += i > 0 && work.data()->ncon == 0;
    step_from(models.back(), {keep_state});
  }
  assert_in_range(missed, 1, 58);
  failures.clear();
  for (std::size_t i = 0; i < models.size(); ++i) {
    const std::string found = compare(models[i], 16 * share);
    if (!found.empty()) failures += std::to_string(i) + ": " + found + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// If only contype and conaffinity keep too many pairs of geoms apart for a list, rows with their own ones are left to MuJoCo.
TEST(test_many_kept_apart) {
  std::string geoms;
  for (int i = 0; i < 65; ++i) geoms += "<geom size='0.1' contype='1' conaffinity='2'/>";
  const auto model = Model::parse("apart", "<mujoco><worldbody><body><joint/>" + geoms + "</body><body><joint/>" +
                                               geoms + "</body></worldbody></mujoco>");
  assert_string_equal(compare_own(model, "geom_contype", other_values, ~0U).c_str(), "");
  assert_string_equal(compare_own(model, "geom_size", other_values).c_str(), "");
}

// A box on a height field, of which MuJoCo's function finds as many contacts as it may
TEST(test_many_single_contacts) {
  const auto model =
      Model::parse("field", R"(<mujoco><asset><hfield name='flat' nrow='20' ncol='20' size='1 1 0.1 0.1'/>
    </asset><default><geom conaffinity='0' condim='1'/></default><worldbody>
    <geom type='hfield' hfield='flat' conaffinity='1'/>
    <body pos='0 0 0.098'><joint type='slide'/><joint axis='1 0 0'/><joint axis='0 1 0'/>
    <geom type='box' size='0.4 0.4 0.1'/></body></worldbody></mujoco>)");
  Work work(model);
  work.forward();
  assert_in_range(work.data()->ncon, 30, mjMAXCONPAIR);
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 2, Kind::at_rest).c_str(), "");
  assert_true(made_of_contacts > 0);
}

// MuJoCo searches for pairs in rows with sizes of their own. They are left to it where its stack is too small for that.
TEST(test_small_stack_of_search) {
  std::string bodies;
  for (int i = 0; i < 70; ++i) bodies += "<body/>";
  const auto model = Model::parse("search",
                                  "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body pos='0 0 0.09'>"
                                  "<joint type='slide'/><geom size='0.1'/></body>" +
                                      bodies + "</worldbody></mujoco>");
  assert_non_null(model->pairs());
  const_cast<int&>(model->get()->nstack) = 1500;  // the model's memory is not constant
  assert_string_equal(compare(model, 16 * share).c_str(), "");
}

// More contacts than nconmax, of which MuJoCo uses the first ones
TEST(test_too_many_contacts) {
  const auto model = Model::parse("full", R"(<mujoco><size nconmax='1'/><worldbody><geom type='plane' size='9 9 1'/>
    <body pos='0 0 0.09'><joint type='slide'/><geom size='0.1'/></body>
    <body pos='1 0 0.09'><joint type='slide'/><geom size='0.1'/></body></worldbody></mujoco>)");
  step_from(model, {keep_state});
}

// The comparison of squares rejects what the comparison of roots rejects.
TEST(test_largest_square) {
  Noise noise;
  std::vector<double> radii{0, 5e-324, 1e-170, 1e-155, 0.1, 1, 2, 1e10, 1e154, 1.4e154, 1e308};
  for (int i = 0; i < 10000; ++i) radii.push_back(std::exp(20 * noise()));
  for (const double radius : radii) {
    const double square = lanes::largest_square(radius);
    assert_true(std::sqrt(square) <= radius);
    assert_true(std::sqrt(std::nextafter(square, INFINITY)) > radius);
  }
  assert_true(lanes::largest_square(-1e-300) < 0);
  assert_true(std::isinf(lanes::largest_square(INFINITY)));
}

}  // namespace
}  // namespace mjenv::core::lanes_tests
