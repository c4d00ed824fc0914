// Measures what lanes gain, and where the limit is: the same steps of 64 rows on one thread, one row after the other
// and in the lanes of each instruction set, in turns.
//
//   lanes [ID...]    prints CSV: id, microseconds for a step of one row without lanes, then for each number of lanes
//     gain           how many times as fast it is
//     computing      the share of the time of the physics that passes in lane code
//     copying        the share that passes in copying between lanes and mjData; the rest is mostly MuJoCo's own
//                    functions, row by row
//     solving        the share of a solver's work in lanes that is of use. Lanes wait for the row with the most
//                    constraints and for the row with the most iterations.
//   lanes play ID LANES STEPS    steps the 64 rows and measures nothing; benchmarks/instructions/run counts from outside
#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "engine/lanes/lanes.hpp"
#include "engine/lanes/stepper.hpp"
#include "engine/model.hpp"
#include "engine/work.hpp"
#include "measure.hpp"

namespace {

using measure::check;
using measure::median;
using measure::seconds;
using mjenv::core::Work;
using mjenv::core::lanes::Code;
using mjenv::core::lanes::Constraints;

constexpr std::int64_t kRows = 64;
constexpr int kSteps = 10;
constexpr int kRounds = 9;

struct Case {
  const char *id, *model;
  bool needs_forces = false;  // the task observes cfrc_ext
};

constexpr std::array<Case, 11> cases{{{"Ant-v5", "ant.xml", true},
                                      {"HalfCheetah-v5", "half_cheetah.xml"},
                                      {"Hopper-v5", "hopper.xml"},
                                      {"Humanoid-v5", "humanoid.xml", true},
                                      {"HumanoidStandup-v5", "humanoidstandup.xml", true},
                                      {"InvertedDoublePendulum-v5", "inverted_double_pendulum.xml"},
                                      {"InvertedPendulum-v5", "inverted_pendulum.xml"},
                                      {"Pusher-v5", "pusher_v5.xml"},
                                      {"Reacher-v5", "reacher.xml"},
                                      {"Swimmer-v5", "swimmer.xml"},
                                      {"Walker2d-v5", "walker2d_v5.xml"}}};

// What Counted adds up.
struct Shares {
  double all, computing, copying;  // seconds
  double solving, solving_at_most;
} shares;

class Timer {
 public:
  explicit Timer(double& sum) : sum_(sum) {}
  ~Timer() { sum_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  double& sum_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

const Code* counted = nullptr;  // whose functions are called

// A function of Code whose time is added to a sum.
template <auto Function, auto Sum, typename Type>
struct Counted;
template <auto Function, auto Sum, typename Result, typename... Arguments>
struct Counted<Function, Sum, Result (*)(Arguments...)> {
  static Result call(Arguments... arguments) {
    const Timer timer(shares.*Sum);
    return (counted->*Function)(arguments...);
  }
};

template <auto Function, auto Sum = &Shares::computing>
void count(Code& code) {
  code.*Function = Counted<Function, Sum, std::decay_t<decltype(code.*Function)>>::call;
}

// Calls a solver. A place with a constraint has a number in D that is not 0.
template <auto Solver>
void solve(mjenv::core::lanes::Lanes& lanes, Constraints& c) {
  {
    const Timer timer(shares.computing);
    (counted->*Solver)(lanes, c);
  }
  const int width = counted->width;
  int most = 0;
  for (int lane = 0; lane < width; ++lane) {
    if (!(c.rows >> lane & 1)) continue;
    int constraints = 0;
    for (int i = 0; i < c.size; ++i) constraints += c.D[i * width + lane] != 0;
    shares.solving += constraints * c.iterations[lane];
    most = std::max(most, c.iterations[lane]);
  }
  shares.solving_at_most += static_cast<double>(c.size) * most * width;
}

Code count(const Code& code) {
  Code result = code;
  count<&Code::adopt>(result);
  count<&Code::kinematics>(result);
  count<&Code::comPos>(result);
  count<&Code::tendon>(result);
  count<&Code::crb>(result);
  count<&Code::factorM>(result);
  count<&Code::transmission>(result);
  count<&Code::reject>(result);
  count<&Code::fwdVelocity>(result);
  count<&Code::comVel>(result);
  count<&Code::passive>(result);
  count<&Code::rne>(result);
  count<&Code::fwdActuation>(result);
  count<&Code::fwdAcceleration>(result);
  count<&Code::Euler>(result);
  count<&Code::RungeKutta>(result);
  count<&Code::bad>(result);
  count<&Code::gather, &Shares::copying>(result);
  count<&Code::scatter, &Shares::copying>(result);
  result.solPGS = solve<&Code::solPGS>;
  result.solNewton = solve<&Code::solNewton>;
  return result;
}

// An environment that plays random actions. All play the same.
class Player {
 public:
  Player(const char* id, int lanes) {
    mjenv_options* options = nullptr;
    check(mjenv_options_create(id, &options));
    check(mjenv_options_set_integer(options, "lanes", lanes));
    check(mjenv_options_set_string(options, "autoreset_mode", "same_step"));
    check(mjenv_create(options, kRows, &env_));
    mjenv_options_destroy(options);
    std::vector<std::uint64_t> seeds(kRows);
    for (std::size_t row = 0; row < seeds.size(); ++row) seeds[row] = row;
    check(mjenv_seed(env_, nullptr, seeds.data(), 1));
    check(mjenv_seed_actions(env_, 1));
    check(mjenv_reset(env_, nullptr, nullptr));
    mjenv_space space = MJENV_SPACE_INIT;
    check(mjenv_space_of(env_, MJENV_ROLE_OBSERVATION, &space));
    observations_.resize(static_cast<std::size_t>(kRows * space.count));
    rewards_.resize(kRows);
    batch_.rows = kRows;
    batch_.obs_count = space.count;
    batch_.obs = observations_.data();
    batch_.reward = rewards_.data();
    check(mjenv_space_of(env_, MJENV_ROLE_ACTION, &space));
    actions_.resize(static_cast<std::size_t>(kRows * space.count));
  }
  ~Player() { mjenv_destroy(env_); }
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  // Microseconds for a step of one row.
  double play() {
    const double time = seconds([&] {
      for (int step = 0; step < kSteps; ++step) {
        sample();
        this->step();
      }
    });
    return 1e6 * time / (kSteps * static_cast<double>(kRows));
  }

  void sample() { check(mjenv_sample_actions(env_, actions_.data(), actions_.size())); }
  void step() { check(mjenv_step(env_, nullptr, actions_.data(), actions_.size(), MJENV_DTYPE_FLOAT32, &batch_)); }
  std::int64_t frame_skip() const {
    mjenv_info info = MJENV_INFO_INIT;
    check(mjenv_info_of(env_, &info));
    return info.frame_skip;
  }

  // Begins the step of a row in a work space that steps it in the environment's place.
  void begin(std::int64_t row, Work& work) {
    std::vector<double> state(work.layout().size);
    for (const char* array : {"qpos", "qvel", "qacc_warmstart"}) {
      const auto part = work.layout().part(array);
      std::int64_t count = 0;
      check(mjenv_read(env_, row, array, state.data() + part->offset, part->count, &count));
    }
    const std::size_t count = actions_.size() / kRows;
    work.load(state.data());
    work.act({actions_.data() + static_cast<std::size_t>(row) * count, MJENV_DTYPE_FLOAT32, static_cast<int>(count)});
  }

 private:
  mjenv_env* env_ = nullptr;
  mjenv_batch batch_ = MJENV_BATCH_INIT;
  std::vector<double> observations_, rewards_;
  std::vector<float> actions_;
};

// Steps the rows of an environment in the lanes of one instruction set, beside it, and counts shares of the time.
class Shadow {
 public:
  Shadow(const Case& c, const std::shared_ptr<const mjenv::core::Model>& model, int width)
      : code_(*mjenv::core::lanes::code_of(width)),
        counting_(count(code_)),
        stepper_(mjenv::core::lanes::make_stepper(*model, counting_)) {
    for (int i = 0; i < width; ++i) {
      works_.push_back(std::make_unique<Work>(model));
      if (c.needs_forces) works_.back()->expect("cfrc_ext");
      all_.push_back(works_.back().get());
      states_.emplace_back(works_.back()->layout().size);
      before_.push_back(states_.back().data());
    }
  }

  void step(Player& player) {
    counted = &code_;
    for (std::int64_t row = 0; row < kRows; row += code_.width) {
      for (int i = 0; i < code_.width; ++i) player.begin(row + i, *works_[static_cast<std::size_t>(i)]);
      const Timer timer(shares.all);
      stepper_->step(all_.data(), code_.width, player.frame_skip(), before_.data());
    }
  }

 private:
  const Code code_, counting_;
  std::unique_ptr<mjenv::core::lanes::Stepper> stepper_;
  std::vector<std::unique_ptr<Work>> works_;
  std::vector<Work*> all_;
  std::vector<std::vector<double>> states_;
  std::vector<double*> before_;
};

// Each column: the median over steps.
struct Columns {
  std::vector<double> gain, computing, copying;
  double solving = 0, solving_at_most = 0;

  void print() const {
    std::printf(",%.2f,%.2f,%.2f,", median(gain), median(computing), median(copying));
    if (solving_at_most > 0) std::printf("%.2f", solving / solving_at_most);
  }
};

void measure_case(const Case& c, const std::vector<int>& widths) {
  std::vector<std::unique_ptr<Player>> players;
  players.push_back(std::make_unique<Player>(c.id, 0));
  for (const int width : widths) players.push_back(std::make_unique<Player>(c.id, width));
  std::vector<double> alone;
  std::vector<Columns> columns(widths.size());
  for (int round = 0; round <= kRounds; ++round) {
    const double time = players[0]->play();
    std::vector<double> gains;
    for (std::size_t i = 0; i < widths.size(); ++i) gains.push_back(time / players[i + 1]->play());
    if (round == 0) continue;  // warms up
    alone.push_back(time);
    for (std::size_t i = 0; i < widths.size(); ++i) columns[i].gain.push_back(gains[i]);
  }

  const auto model = mjenv::core::Model::open(c.model);
  std::vector<std::unique_ptr<Shadow>> shadows;
  for (const int width : widths) shadows.push_back(std::make_unique<Shadow>(c, model, width));
  for (int step = 0; step < kSteps * kRounds; ++step) {
    players[0]->sample();
    for (std::size_t i = 0; i < widths.size(); ++i) {
      shares = {};
      shadows[i]->step(*players[0]);
      columns[i].computing.push_back(shares.computing / shares.all);
      columns[i].copying.push_back(shares.copying / shares.all);
      columns[i].solving += shares.solving;
      columns[i].solving_at_most += shares.solving_at_most;
    }
    players[0]->step();
  }

  std::printf("%s,%.2f", c.id, median(alone));
  for (const Columns& column : columns) column.print();
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 5 && std::string(argv[1]) == "play") {
    Player player(argv[2], std::stoi(argv[3]));
    for (int step = 0; step < std::stoi(argv[4]); ++step) {
      player.sample();
      player.step();
    }
    return 0;
  }
  const std::vector<int> widths = mjenv::core::lanes::widths();
  std::printf("id,us");
  for (const int width : widths)
    for (const char* column : {"gain", "computing", "copying", "solving"}) std::printf(",%d lanes: %s", width, column);
  std::printf("\n");
  const std::vector<std::string> ids(argv + 1, argv + argc);
  for (const Case& c : cases)
    if (ids.empty() || std::count(ids.begin(), ids.end(), c.id)) measure_case(c, widths);
}
