// The tables of stages and obstacles: docs/lanes.md shows them, and they say how the stages of a model are computed.
#include "engine/mujoco.hpp"  // before cmocka's macro fail

#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

#include "engine/lanes/frame/stages.hpp"
#include "engine/lanes/frame/stepper.hpp"
#include "engine/model.hpp"
#include "run.hpp"

namespace mjenv::core {
namespace {

std::string row(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const std::string& cell : cells) text += (cell.empty() ? "" : " " + cell) + " |";
  return text;
}

// The rows of the table of a document under this heading
std::vector<std::string> table_under(const std::string& heading) {
  std::ifstream file(PROJECT_FOLDER "/docs/lanes.md");
  std::vector<std::string> rows;
  bool is_inside = false;
  for (std::string line; std::getline(file, line);) {
    if (line == heading)
      is_inside = true;
    else if (is_inside && line.empty())
      break;
    else if (is_inside && line.rfind("|---", 0) != 0)
      rows.push_back(line);
  }
  return rows;
}

void assert_same(const std::vector<std::string>& found, const std::vector<std::string>& wanted) {
  for (std::size_t i = 0; i < wanted.size(); ++i)
    if (i >= found.size() || found[i] != wanted[i]) fail_msg("docs/lanes.md lacks the row\n%s", wanted[i].c_str());
  assert_int_equal(found.size(), wanted.size());
}

void test_document(void** /*state*/) {
  std::vector<std::string> stages, obstacles;
  for (const lanes::Stage& stage : lanes::stages())
    stages.push_back(row({stage.name, stage.in_lanes, stage.row_by_row}));
  for (const lanes::Obstacle& one : lanes::obstacles()) obstacles.push_back(row({one.name, one.reason}));
  assert_same(table_under("| stage | in lanes | row by row |"), stages);
  assert_same(table_under("| obstacle | reason |"), obstacles);
}

// Each function of lanes belongs to one stage.
void test_functions(void** /*state*/) {
  std::map<std::string, int> stages_of;
  std::size_t count = 0;
  for (const lanes::Stage& stage : lanes::stages())
    for (const lanes::Function& function : stage.functions) ++stages_of[function.name];
#define MJENV_CHECK(result, name, parameters) count += stages_of[#name] == 1;
  MJENV_LANES_FUNCTIONS(MJENV_CHECK)
#undef MJENV_CHECK
  assert_int_equal(count, stages_of.size());
}

// The first word of each stage, and how the stage of a model is computed.
std::map<std::string, std::string> stages_of(const std::string& text) {
  std::istringstream lines(lanes::stage_lines(*Model::parse("stages", text)));
  std::map<std::string, std::string> found;
  for (std::string line; std::getline(lines, line);)
    found[line.substr(0, line.find_first_of(", :"))] = line.substr(line.find(": ") + 2);
  return found;
}

void test_models(void** /*state*/) {
  const auto with = [](const std::string& before, const std::string& geoms, const std::string& after) {
    return "<mujoco>" + before + "<worldbody><geom type='plane' size='1 1 1'/><site name='s'/>" +
           "<body name='b'><joint name='j'/><geom size='0.1'/><site name='t'/>" + geoms + "</body></worldbody>" +
           after + "</mujoco>";
  };
  auto found = stages_of(with("", "", ""));
  assert_int_equal(found.size(), lanes::stages().size());
  for (const char* stage :
       {"kinematics", "passive", "contacts", "constraints", "solver", "accelerations", "integration", "forces"})
    assert_string_equal(found[stage].c_str(), "lanes");
  for (const char* stage : {"tendons", "sensors", "energies"}) assert_string_equal(found[stage].c_str(), "absent");

  const auto without_contacts = [&](const std::string& before, const std::string& after) {
    return with("<option><flag contact='disable'/></option>" + before, "", after);
  };
  const auto tendon_with = [](const std::string& attributes) {
    return "<tendon><fixed " + attributes + "><joint joint='j' coef='1'/></fixed></tendon>";
  };
  const std::string tendon = tendon_with(""), limited = "<default><joint limited='true' range='0 1'/></default>";
  const struct {
    std::string text, stage, how;
  } cases[] = {
      {with("<option><flag contact='disable'/></option>", "", ""), "contacts", "absent"},
      {with("<option><flag contact='disable'/></option>", "", ""), "solver", "absent"},
      {with("<option><flag constraint='disable'/></option>", "", ""), "contacts", "absent"},
      {with("<option><flag constraint='disable'/></option>" + limited, "", ""), "constraints", "absent"},
      {without_contacts("", "<equality><joint joint1='j'/></equality>"), "constraints", "lanes"},
      {without_contacts(limited, ""), "constraints", "lanes"},
      {without_contacts("<default><joint frictionloss='1'/></default>", ""), "constraints", "lanes"},
      {without_contacts("", tendon_with("limited='true' range='0 1'")), "constraints", "lanes"},
      {without_contacts("", tendon_with("frictionloss='1'")), "constraints", "lanes"},
      {with("<option collision='predefined'/>", "", ""), "contacts", "row by row: the search for pairs of geoms"},
      {with("<size nconmax='0'/>", "", ""), "contacts", "absent"},
      {with("", "<geom type='ellipsoid' size='0.1 0.1 0.1'/><geom type='box' size='.1 .1 .1'/>", ""), "contacts",
       "lanes"},
      {with("<asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset>", "<geom type='mesh' mesh='m'/>", ""),
       "contacts", "lanes; row by row: plane and mesh, where they are near"},
      {with("<option solver='CG'/>", "", ""), "solver", "lanes"},
      {with("<option noslip_iterations='1'/>", "", ""), "solver", "lanes"},
      {with("<option solver='PGS' cone='elliptic'/>", "", ""), "solver", "lanes"},
      {with("<option jacobian='sparse'/>", "", ""), "solver", "lanes"},
      {with("<option jacobian='sparse' solver='PGS'/>", "", ""), "constraints",
       "row by row: the solver is computed row by row"},
      {with("<option jacobian='sparse' solver='PGS'/>", "", ""), "solver", "row by row: PGS with sparse Jacobians"},
      {with("<option jacobian='sparse' noslip_iterations='1'/>", "", ""), "solver",
       "row by row: noslip with sparse Jacobians"},
      {with("<option jacobian='sparse'/>", "", tendon), "solver", "row by row: sparse Jacobians of tendons"},
      {with("<option density='1'/>", "<geom size='0.1' fluidshape='ellipsoid'/>", ""), "passive", "lanes"},
      {with("", "", "<actuator><motor joint='j'/></actuator>"), "tendons", "lanes"},
      {with("<option><flag actuation='disable'/></option>", "", "<actuator><motor joint='j'/></actuator>"), "tendons",
       "row by row: the model disables actuation"},
      {with("", "", "<actuator><general cranksite='t' slidersite='s' cranklength='1'/></actuator>"), "tendons",
       "row by row: slider-cranks or reference sites"},
      {with("", "", "<actuator><adhesion body='b' ctrlrange='0 1'/></actuator>"), "tendons", "row by row: adhesion"},
      {with("", "", "<actuator><adhesion body='b' ctrlrange='0 1'/></actuator>"), "constraints",
       "row by row: adhesion reads them"},
      {with("", "", "<sensor><gyro site='t'/></sensor>"), "sensors", "lanes"},
      {with("", "", "<sensor><rangefinder site='t'/></sensor>"), "sensors", "lanes; row by row: rangefinders"},
      {with("", "", "<sensor><user objtype='site' objname='t' datatype='real' needstage='acc' dim='1'/></sensor>"),
       "sensors", "lanes"},
      {with("<option><flag energy='enable'/></option>", "", ""), "energies", "row by row: only where they are read"},
      {with("<option integrator='implicit'/>", "", tendon), "integration", "lanes"},
      {with("<option integrator='implicit' jacobian='sparse'/>", "", tendon), "integration", "lanes"},
      {with("<option jacobian='sparse'/>", "", tendon), "tendons", "row by row: sparse Jacobians of tendons"},
      {with("<option jacobian='sparse'/>", "", tendon), "passive", "row by row: sparse Jacobians of tendons"},
      {with("<option><flag fwdinv='enable'/></option>", "", ""), "kinematics",
       "row by row: the comparison of forward and inverse dynamics (opt.enableflags)"}};
  for (const auto& c : cases) assert_string_equal(stages_of(c.text)[c.stage].c_str(), c.how.c_str());
}

}  // namespace
}  // namespace mjenv::core

int run_stages() {
  using namespace mjenv::core;
  const CMUnitTest tests[] = {cmocka_unit_test(test_document), cmocka_unit_test(test_functions),
                              cmocka_unit_test(test_models)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
