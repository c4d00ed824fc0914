// Random models over the features of MJCF: lanes step each as MuJoCo does, bit for bit.
//
// test_core random-models runs the kept seeds and the first new ones, "random-models FIRST COUNT" others, and
// "random-models print SEED" prints a model.
#include "error.hpp"  // before cmocka's macro fail

#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

#include "engine/lanes/frame/stepper.hpp"
#include "engine/model.hpp"
#include "noise.hpp"
#include "run.hpp"

namespace mjenv::core {
namespace {

constexpr int kSeeds = 24, kRows = 8;
// Seeds of models that lanes once stepped otherwise.
const std::vector<std::uint64_t> kKept{};

// Joins texts. Unlike those of +, its operands are computed in their order, so that a seed gives one model.
std::string operator<<(std::string text, const std::string& more) { return text += more; }
std::string operator<<(const char* text, const std::string& more) { return text + more; }

class Generator {
 public:
  explicit Generator(std::uint64_t seed) : noise_(seed * 2 + 1) {
    for (int i = 0; i < 10; ++i) noise_();  // neighbouring seeds begin alike
  }

  std::string text() {
    std::string bodies;
    const int roots = 1 + below(3);
    for (int i = 0; i < roots; ++i) bodies += body(0);
    if (chance(4))
      bodies += "<body name='mocap' mocap='true' pos='0.2 0.1 0.3'>" << geom() << site() << "</body>", mocap_ = true;
    if (joints_.empty()) bodies += "<body pos='0 0 0.2'>" << joint("hinge") << geom() << "</body>";
    const std::string surroundings = world();
    // All that names other elements comes after them.
    const std::string tendons = tendon_section(), actuators = actuator_section(), equality = equality_section(),
                      sensors = sensor_section(), contact = contact_section();
    return "<mujoco><compiler angle='radian' autolimits='false'/>"
           << option() << "<size njmax='400' nconmax='150'/>" << defaults() << assets() << "<worldbody>" << surroundings
           << bodies << "</worldbody>" << tendons << actuators << equality << sensors << contact << "</mujoco>";
  }

 private:
  struct Joint {
    std::string name;
    bool is_scalar, is_limited;
  };
  Noise noise_;
  std::vector<Joint> joints_;
  std::vector<std::string> bodies_, geoms_, sites_, round_geoms_, fixed_, spatial_, actuators_;
  std::set<std::string> limited_;  // tendons
  int next_ = 0;
  bool mocap_ = false, has_ground_ = false;

  int below(int count) { return static_cast<int>(noise_.below(static_cast<std::uint64_t>(count))); }
  bool chance(int of) { return below(of) == 0; }
  double in(double low, double high) { return low + (high - low) * (noise_() + 1) / 2; }
  template <typename List>
  auto& one_of(List& list) {
    return list[static_cast<std::size_t>(below(static_cast<int>(std::size(list))))];
  }
  std::string pick(const std::vector<const char*>& words) { return one_of(words); }
  std::string name(const char* kind) { return kind + std::to_string(next_++); }
  static std::string number(double x) {
    char text[40];
    std::snprintf(text, sizeof text, "%.17g", x);
    return text;
  }
  std::string numbers(int count, double low, double high) {
    std::string text;
    for (int i = 0; i < count; ++i) text += number(chance(5) ? low : in(low, high)) << " ";
    return text;
  }
  std::string attribute(const char* key, const std::string& value) {
    return std::string(" ") + key + "='" + value + "'";
  }
  // An attribute that is there in one of so many cases.
  std::string perhaps(int of, const char* key, const std::string& value) {
    return chance(of) ? attribute(key, value) : "";
  }

  std::string option() {
    std::string flags;
    for (const char* flag : {"energy", "override"})
      if (chance(12)) flags += attribute(flag, "enable");
    for (const char* flag : {"limit", "frictionloss", "contact", "equality", "warmstart", "filterparent", "clampctrl",
                             "actuation", "passive", "gravity", "refsafe", "sensor", "constraint"})
      if (chance(25)) flags += attribute(flag, "disable");
    return "<option" << attribute("timestep", number(in(0.001, 0.006)))
                     << perhaps(3, "integrator", pick({"RK4", "implicit"})) << perhaps(3, "cone", "elliptic")
                     << attribute("solver", pick({"Newton", "Newton", "Newton", "PGS", "PGS", "CG", "CG"}))
                     << perhaps(3, "jacobian", pick({"dense", "sparse", "sparse"}))
                     << perhaps(4, "iterations", std::to_string(1 + below(30)))
                     << perhaps(6, "tolerance", pick({"0", "1e-4", "1e-12"}))
                     << perhaps(4, "impratio", pick({"3", "0.5", "100"})) << perhaps(8, "noslip_iterations", "2")
                     << perhaps(5, "gravity", numbers(3, -10, 3)) << perhaps(5, "density", number(in(0.5, 1000)))
                     << perhaps(6, "viscosity", number(in(0.001, 1))) << perhaps(6, "wind", numbers(3, -2, 2))
                     << perhaps(12, "collision", pick({"predefined", "dynamic"})) << perhaps(12, "o_margin", "0.02")
                     << "><flag" << flags << "/></option>";
  }

  std::string solver(const char* what) {
    return perhaps(4, (std::string("solref") + what).c_str(), pick({"0.01 1", "0.05 0.7", "-500 -20", "0.001 1"}))
           << perhaps(
                  4, (std::string("solimp") + what).c_str(),
                  pick({"0.8 0.95 0.02 0.3 3", "0.9 0.9 0.01", "0 1 0.02", "0.5 0.9 0 0.5 1", "0.8 0.95 0.02 0.7 1"}));
  }

  std::string defaults() {
    return "<default><geom" << perhaps(3, "conaffinity", "0") << perhaps(3, "condim", pick({"1", "3", "4", "6"}))
                            << perhaps(4, "margin", "0.02") << perhaps(5, "gap", "0.01")
                            << perhaps(3, "friction", numbers(3, 0, 1)) << solver("") << "/></default>";
  }

  std::string assets() {
    return "<asset><mesh name='wedge' vertex='0 0 0  0.2 0 0  0 0.2 0  0 0 0.2  0.2 0.2 0'/>"
           "<hfield name='ground' nrow='4' ncol='5' size='2 2 0.1 0.1'/></asset>";
  }

  std::string world() {
    std::string text = site();
    if (!chance(4))
      text += "<geom name='floor' type='plane' size='5 5 0.1' conaffinity='1'/>", geoms_.push_back("floor");
    if (chance(4)) text += "<geom type='plane' size='5 5 0.1' euler='0.3 0.1 0' conaffinity='1'/>";
    if (chance(6)) text += "<geom type='hfield' hfield='ground' pos='0 0 -0.1' conaffinity='1'/>";
    for (int i = below(3); i > 0; --i) text += geom();
    return text;
  }

  std::string geom() {
    const std::string own = name("g"), type = pick({"sphere", "sphere", "capsule", "capsule", "ellipsoid", "cylinder",
                                                    "box", "box", "mesh"});
    geoms_.push_back(own);
    if (type == "sphere" || type == "cylinder") round_geoms_.push_back(own);
    return "<geom" << attribute("name", own) << attribute("type", type)
                   << (type == "mesh" ? attribute("mesh", "wedge") : attribute("size", numbers(3, 0.04, 0.15)))
                   << perhaps(2, "pos", numbers(3, -0.1, 0.1)) << perhaps(3, "euler", numbers(3, -1.5, 1.5))
                   << perhaps(6, "condim", pick({"1", "3", "4", "6"})) << perhaps(6, "priority", "1")
                   << perhaps(6, "solmix", pick({"0", "2"})) << perhaps(6, "margin", "0.03")
                   << perhaps(6, "friction", numbers(3, 0, 1)) << perhaps(6, "fluidshape", "ellipsoid")
                   << perhaps(10, "fluidcoef", numbers(5, 0, 2)) << perhaps(8, "contype", "2")
                   << perhaps(4, "conaffinity", "1") << "/>";
  }

  std::string site() {
    sites_.push_back(name("s"));
    return "<site" << attribute("name", sites_.back()) << attribute("type", pick({"sphere", "box", "capsule"}))
                   << attribute("size", "0.05 0.05 0.05") << perhaps(2, "pos", numbers(3, -0.1, 0.1))
                   << perhaps(3, "euler", numbers(3, -1.5, 1.5)) << "/>";
  }

  std::string joint(const std::string& type) {
    joints_.push_back({name("j"), type == "hinge" || type == "slide", false});
    std::string text = "<joint" << attribute("name", joints_.back().name) << attribute("type", type);
    text += perhaps(2, "damping", number(in(0, 1)))
            << perhaps(2, "armature", number(in(0, 0.05))) << perhaps(4, "frictionloss", number(in(0, 0.3)))
            << solver("friction");
    if (type == "free") return text << perhaps(6, "stiffness", number(in(0, 3))) << "/>";
    text += perhaps(2, "pos", numbers(3, -0.1, 0.1)) << perhaps(3, "stiffness", number(in(0, 5)));
    if (type != "ball")
      text += attribute("axis", pick({"1 0 0", "0 1 0", "0 0 1", "1 -1 0.5", "0 -0 -1"}))
              << perhaps(4, "springref", number(in(-0.3, 0.3))) << perhaps(4, "ref", number(in(-0.3, 0.3)));
    joints_.back().is_limited = chance(2);
    if (joints_.back().is_limited)
      text += " limited='true'" << attribute("range", type == "ball" ? "0 0.5" : "-0.2 0.3")
                                << perhaps(3, "margin", "0.05") << solver("limit");
    return text << "/>";
  }

  std::string body(int depth) {
    const std::string own = name("b");
    bodies_.push_back(own);
    std::string text = "<body" << attribute("name", own)
                               << attribute("pos", depth ? numbers(3, -0.2, 0.2)
                                                         : number(in(-0.5, 0.5)) << " " << number(in(-0.5, 0.5)) << " "
                                                                                 << number(in(0, 0.4)))
                               << perhaps(3, "euler", numbers(3, -1, 1)) << ">";
    const int kind = below(depth == 0 ? 8 : 6);
    if (kind > 5)
      text += joint("free");
    else if (kind == 0)
      text += joint("ball");
    else if (kind == 1)
      text += joint("slide") << joint("ball");
    else if (kind < 5)
      for (int i = 1 + below(3); i > 0; --i) text += joint(pick({"hinge", "hinge", "slide"}));
    text += "<inertial pos='0.01 0 0.02'" << attribute("mass", number(in(0.2, 3)))
                                          << attribute("diaginertia", "0.02 0.03 0.025") << "/>";
    for (int i = below(3); i >= 0; --i) text += geom();
    if (chance(2)) text += site();
    if (depth < 3)
      for (int i = below(depth == 0 ? 3 : 2); i > 0; --i) text += body(depth + 1);
    return text << "</body>";
  }

  std::vector<std::string> scalars() const {
    std::vector<std::string> found;
    for (const Joint& one : joints_)
      if (one.is_scalar) found.push_back(one.name);
    return found;
  }

  std::string tendon_section() {
    std::string text;
    auto scalar = scalars();
    for (int i = below(3); i > 0 && !scalar.empty(); --i) {
      fixed_.push_back(name("t"));
      std::string path = "<joint" << attribute("joint", scalar[0]) << attribute("coef", number(in(-1, 1))) << "/>";
      for (std::size_t k = 1; k < scalar.size(); ++k)
        if (chance(2))
          path += "<joint" << attribute("joint", scalar[k]) << attribute("coef", number(in(-1, 1))) << "/>";
      text += "<fixed" << tendon_attributes(fixed_.back()) << ">" << path << "</fixed>";
    }
    if (chance(3) && sites_.size() > 1) {
      spatial_.push_back(name("t"));
      std::string path = "<site" << attribute("site", sites_[0]) << "/>";
      if (!round_geoms_.empty() && chance(2))
        path += "<geom" << attribute("geom", one_of(round_geoms_)) << perhaps(3, "sidesite", sites_[0]) << "/>";
      path += "<site" << attribute("site", sites_[1]) << "/>";
      if (sites_.size() > 2 && chance(2))
        path += "<pulley divisor='2'/><site" << attribute("site", sites_[1]) << "/><site"
                                             << attribute("site", sites_[2]) << "/>";
      text += "<spatial" << tendon_attributes(spatial_.back()) << ">" << path << "</spatial>";
    }
    return "<tendon>" << text << "</tendon>";
  }

  std::string tendon_attributes(const std::string& own) {
    const bool is_limited = chance(3);
    if (is_limited) limited_.insert(own);
    return attribute("name", own) << perhaps(2, "stiffness", number(in(0, 5)))
                                  << perhaps(2, "damping", number(in(0, 1))) << perhaps(4, "springlength", "0.1")
                                  << perhaps(4, "frictionloss", number(in(0, 0.2)))
                                  << (is_limited ? " limited='true' range='-0.1 0.2'" << perhaps(3, "margin", "0.03")
                                                 : "")
                                  << solver("limit");
  }

  std::string actuator_section() {
    std::string text, stateful;
    const auto scalar = scalars();
    for (int i = below(5); i > 0; --i) {
      std::string target;
      if (chance(12)) {
        actuators_.push_back(name("a"));
        text += "<adhesion" << attribute("name", actuators_.back()) << attribute("body", one_of(bodies_))
                            << " ctrlrange='0 2'" << attribute("gain", number(in(0, 30))) << "/>";
        continue;
      }
      const int kind = below(8);
      if (kind < 4 && !scalar.empty())
        target = attribute(kind == 0 ? "jointinparent" : "joint",
                           scalar[static_cast<std::size_t>(below(static_cast<int>(scalar.size())))]);
      else if (kind == 4 && !joints_.empty())
        target = attribute("joint", one_of(joints_).name) << attribute("gear", numbers(6, -1, 1));
      else if (kind == 5 && !fixed_.empty())
        target = attribute("tendon", one_of(fixed_));
      else if (kind == 6 && !spatial_.empty())
        target = attribute("tendon", one_of(spatial_));
      else if (kind == 7 && sites_.size() > 2)
        target = attribute("site", sites_[1])
                 << perhaps(2, "refsite", sites_[2]) << attribute("gear", numbers(6, -1, 1));
      if (target.empty()) continue;
      const bool has_gear = target.find("gear") != std::string::npos;
      const std::string common = attribute("name", name("a"))
                                 << target << (has_gear ? "" : perhaps(2, "gear", number(in(-3, 3))))
                                 << (chance(2) ? " ctrllimited='true' ctrlrange='-0.5 1'" : "")
                                 << (chance(4) ? " forcelimited='true' forcerange='-2 1'" : "");
      actuators_.push_back(common.substr(7, common.find('\'', 7) - 7));
      switch (below(7)) {
        case 0: text += "<motor" << common << "/>"; break;
        case 1: text += "<position" << common << attribute("kp", number(in(0, 20))) << "/>"; break;
        case 2: text += "<velocity" << common << attribute("kv", number(in(0, 3))) << "/>"; break;
        case 3:
          text += "<general" << common
                             << " gaintype='affine' gainprm='1 0.2 0.1' biastype='affine' biasprm='0.1 -2 -0.3'/>";
          break;
        case 4:
          stateful +=
              "<general" << common
                         << " dyntype='filter' dynprm='0.05' gainprm='3' biastype='affine' biasprm='0 -1 -0.1'/>";
          break;
        case 5:
          stateful += "<general" << common << " dyntype='integrator' actlimited='true' actrange='-0.5 0.8'/>";
          break;
        default:
          if (target.find(" site") != std::string::npos)
            text += "<motor" << common << "/>";
          else
            stateful += "<muscle" << common << " lengthrange='-1 1'/>";
      }
    }
    return "<actuator>" << text << stateful << "</actuator>";
  }

  std::string equality_section() {
    std::string text;
    const std::string end = solver("") << perhaps(8, "active", "false") << "/>";
    const auto scalar = scalars();
    if (chance(8) && bodies_.size() > 1)
      text += "<connect anchor='0.05 0 0.1'" << attribute("body1", bodies_.front())
                                             << attribute("body2", bodies_.back()) << end;
    if (chance(8) && !bodies_.empty())
      text += "<weld" << attribute("body1", bodies_.back()) << (mocap_ ? " body2='mocap'" : "")
                      << perhaps(2, "torquescale", "0.5") << end;
    if (chance(8) && !scalar.empty())
      text += "<joint" << attribute("joint1", scalar.front())
                       << (scalar.size() > 1 && chance(2) ? attribute("joint2", scalar.back()) : "")
                       << " polycoef='0.1 0.5 0.2 0 0.1'" << end;
    if (chance(8) && !fixed_.empty())
      text += "<tendon" << attribute("tendon1", fixed_.front())
                        << (fixed_.size() > 1 ? attribute("tendon2", fixed_.back()) : "") << end;
    return "<equality>" << text << "</equality>";
  }

  std::string sensor_section() {
    std::string text;
    for (int i = below(8); i > 0; --i) {
      const int kind = below(6);
      if (kind == 0)
        text += "<" << pick({"touch", "accelerometer", "velocimeter", "gyro", "force", "torque", "magnetometer",
                             "rangefinder"})
                    << attribute("site", one_of(sites_)) << "/>";
      else if (kind == 1 && !scalars().empty())
        text +=
            "<" << pick(joints_.back().is_limited && joints_.back().is_scalar
                            ? std::vector<const char*>{"jointpos", "jointlimitpos", "jointlimitvel", "jointlimitfrc"}
                            : std::vector<const char*>{"jointpos", "jointvel"})
                << attribute("joint", joints_.back().is_scalar ? joints_.back().name : scalars().front())
                << perhaps(3, "cutoff", "0.1") << "/>";
      else if (kind == 2 && !fixed_.empty())
        text +=
            "<" << pick(limited_.count(fixed_.front()) ? std::vector<const char*>{"tendonpos", "tendonlimitpos",
                                                                                  "tendonlimitvel", "tendonlimitfrc"}
                                                       : std::vector<const char*>{"tendonpos", "tendonvel"})
                << attribute("tendon", fixed_.front()) << "/>";
      else if (kind == 3 && !actuators_.empty())
        text += "<" << pick({"actuatorpos", "actuatorvel", "actuatorfrc"}) << attribute("actuator", actuators_.front())
                    << "/>";
      else if (kind == 4)
        text += "<" << pick({"framepos", "framequat", "framexaxis", "framelinvel", "frameangvel"}) << " objtype='site'"
                    << attribute("objname", one_of(sites_))
                    << (chance(2) ? " reftype='body'" << attribute("refname", bodies_.front()) : "") << "/>";
      else
        text += "<" << pick({"subtreecom", "subtreelinvel", "subtreeangmom"}) << attribute("body", one_of(bodies_))
                    << "/><clock/><framelinacc objtype='xbody'" << attribute("objname", one_of(bodies_)) << "/>";
    }
    return "<sensor>" << text << "</sensor>";
  }

  std::string contact_section() {
    std::string text;
    if (chance(8) && geoms_.size() > 1 && geoms_.front() != geoms_.back())
      text += "<pair" << attribute("geom1", geoms_.front()) << attribute("geom2", geoms_.back())
                      << perhaps(2, "condim", pick({"1", "3", "4", "6"})) << " friction='1 0.5 0.01 0.001 0.002'/>";
    if (chance(5) && bodies_.size() > 1)
      text += "<exclude" << attribute("body1", bodies_.front()) << attribute("body2", bodies_.back()) << "/>";
    return "<contact>" << text << "</contact>";
  }
};

struct Results {
  int models = 0, refused = 0, obstacles = 0;
  std::string failures;
};

void compare(std::uint64_t seed, Results& results) {
  const std::string label = "seed " + std::to_string(seed);
  ++results.models;
  std::shared_ptr<const Model> model;
  try {
    model = Model::parse(label, Generator(seed).text());
  } catch (const Error& error) {
    std::printf("%s: %s\n", label.c_str(), error.what());
    ++results.refused;
    return;
  }
  if (!lanes::obstacle(*model).empty()) {
    ++results.obstacles;
    return;
  }
  std::string found;
  try {
    found = compare_in_lanes(model, kRows);
  } catch (const Error& error) {
    found = error.what();
  }
  if (!found.empty()) results.failures += label + ": " + found + "\n";
}

std::uint64_t first = 0;
int seed_count = kSeeds;

void test_seeds(void** /*state*/) {
  Results results;
  for (const std::uint64_t seed : kKept) compare(seed, results);
  for (int i = 0; i < seed_count; ++i) compare(first + static_cast<std::uint64_t>(i), results);
  std::printf("%d models, MuJoCo refuses %d, %d have obstacles\n", results.models, results.refused, results.obstacles);
  if (!results.failures.empty()) fail_msg("%s", results.failures.c_str());
  assert_true(10 * (results.refused + results.obstacles) < 3 * results.models);
}

}  // namespace
}  // namespace mjenv::core

int run_random_models(int argc, char** argv) {
  using namespace mjenv::core;
  if (argc == 4 && argv[2] == std::string_view("print")) {
    std::puts(Generator(std::strtoull(argv[3], nullptr, 10)).text().c_str());
    return 0;
  }
  if (argc == 4) {
    first = std::strtoull(argv[2], nullptr, 10);
    seed_count = std::atoi(argv[3]);
  }
  const CMUnitTest tests[] = {cmocka_unit_test(test_seeds)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
