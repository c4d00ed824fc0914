// Each stage of the lanes computes the bits of the opened library's own functions, from the library's own inputs.
#include "twins/harness.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "engine/lanes/frame/lane_arrays.hpp"
#include "engine/lanes/frame/stages.hpp"
#include "engine/lanes/mujoco4/collider.hpp"
#include "engine/lanes/mujoco4/solver.hpp"

namespace mjenv::core::twins {
namespace {

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
    bool integrates = false;
    for (const lanes::Stage& stage : lanes::stages()) {
      const bool is_in_lanes = stage.obstacle(*model_).empty();
      if (stage.party == lanes::kIntegration) integrates = is_in_lanes;
      if (!stage.compute) continue;
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
    if (!integrates || m_.opt.integrator == mjINT_RK4) return "";
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
  // number, D, J or aref.
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
    if (!collider_->follow(models, data, count) || !solver_->follows(m_) ||
        !collider_->find(lanes_, (1U << count) - 1) || !solver_->can_solve(collider_->found(), data))
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
      mj_referenceConstraint(&m_, data[static_cast<std::size_t>(row)]);
      if (differ(c.aref, d.efc_aref, d.nefc)) return "aref";
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
      found.insert(found.end(), d.efc_vel, d.efc_vel + d.nefc);
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

TEST(test_stages) {
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

TEST(test_contacts) {
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

// Whether lanes make the constraints of all rows, or of none, and whether they solve all of those that MuJoCo makes, or
// none.
TEST(test_what_is_solved) {
  const std::string robot = without(kRobot, "<equality", "</equality>"), trees = listed(kTrees), pgs = "solver='PGS' ";
  const std::string alone = listed(without(robot, "<body name='d'", "</body>"));
  std::string dual = trees, tied = trees, welded = listed(robot), held = alone;
  dual.insert(8, "<option solver='PGS'/>");
  tied.insert(tied.find("<joint axis='1 0 0'") + 6, " name='a'");
  tied.insert(tied.find("<joint type='slide' axis='1 0 0'") + 6, " name='b'");
  tied.insert(tied.find("</mujoco>"),
              "<tendon><fixed range='5 6'><joint joint='a' coef='1'/><joint joint='b' coef='1'/></fixed></tendon>");
  for (std::string* text : {&welded, &held})
    text->insert(text->find("</mujoco>"), "<equality><weld body1='arm'/></equality>");
  const struct {
    std::string text;
    bool makes, solves;
  } cases[] = {{trees, true, true},
               {welded, false, true},
               {held, true, true},
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

}  // namespace
}  // namespace mjenv::core::twins
