// Rows with more constraints than lanes have places for.
#include "twins/harness.hpp"

#include <array>

namespace mjenv::core::twins {
namespace {

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

// Rows with more constraints than lanes have places for step with MuJoCo's bits, as do others beside them.
TEST(test_many_constraints) {
  for (const std::string option : {"", "cone='elliptic'", "solver='PGS'"}) {
    const Named named("hedgehog " + option, Model::parse("hedgehog", hedgehog(option, 60)));
    for (const int width : lanes::widths()) {
      int rows = 0, left = 0;
      for (const bool is_current : {false, true})
        compare_steps(named, *lanes::code_of(width), {"qpos", is_current, 2}, rows, left);
    }
  }
}

// Rows lie on different edges. The places of their contacts are too many for lanes: if these make the constraints, only
// where all contacts have places of their own; if MuJoCo does, only where contacts of different kinds have. Of two beams,
// those of the first one alone: beside those of the second, more of them share a place.
TEST(test_many_places) {
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
        compare_steps(named, *lanes::code_of(width), {array, false, 1, nullptr, nullptr, c.place}, rows, left);
        assert_int_equal(left > 0, !c.has_room && width > 2);
      }
  }
  // Limits have places, too: without them, those of the contacts would be few enough.
  std::string joints;
  for (int i = 0; i < 4; ++i) joints += "<joint type='slide' axis='0 1 0' range='2 3' armature='1'/>";
  const Named limited = beams(beam({{{{11, 3}}, {{10, 3}}, {{10, 3}}, {{11, 3}}}}, joints));
  int rows = 0, left = 0;
  for (const int width : lanes::widths())
    compare_steps(limited, *lanes::code_of(width), {"qpos", false, 1, nullptr, nullptr, roll}, rows, left);
  assert_int_equal(left, 0);
}

// Rows reach other limits, so that lanes cannot list all of them.
TEST(test_many_limits) {
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
    compare_steps(named, *lanes::code_of(width), {"qpos", false, 1, nullptr, nullptr, reach}, rows, left);
  assert_int_equal(left, 0);
}

}  // namespace
}  // namespace mjenv::core::twins
