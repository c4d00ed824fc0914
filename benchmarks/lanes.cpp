// Measures what lanes gain, and where the limit is: the same steps of 64 rows on one thread, one row after the other
// and in the lanes of each instruction set, in turns.
//
// All times are CPU times.
//
//   lanes [ID...]    prints CSV: id, microseconds for a step of one row without lanes, then for each number of lanes
//     gain           how many times as fast it is
//     computing      the share of the time of the physics that passes in lane code
//     copying        the share that passes in copying between lanes and mjData; the rest is mostly MuJoCo's own
//                    functions, row by row
//     solving        the share of a solver's work in lanes that is of use. Lanes wait for the row with the most
//                    constraints and for the row with the most iterations.
//   lanes stages [ID...]    prints CSV: id, number of lanes, stage, how it is computed for this model, and the share of the
//     time of the physics that its functions take in lanes. Then what belongs to no stage: copying, and `row by row`, which
//     is the rest.
//   lanes play ID LANES STEPS    steps the 64 rows and measures nothing; benchmarks/instructions/run counts
//     from outside
//
// Instead of an ID, FILE.xml or FILE.xml:FRAME_SKIP steps a model without a task, whose rows are reset after 50 steps.
// After differing: as in differing:Ant-v5, the rows have masses, frictions and gains of their own, and pushes.
#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/lanes/frame/stages.hpp"
#include "engine/lanes/frame/stepper.hpp"
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
using mjenv::core::lanes::Lanes;

constexpr std::int64_t kRows = 64;
constexpr int kSteps = 10;
constexpr int kRounds = 9;

struct Case {
  std::string id, model;
  bool needs_forces = false;    // the task observes cfrc_ext
  std::int64_t frame_skip = 0;  // of a model without a task
  bool differs = false;         // rows have numbers of their own, and are pushed
};

const std::array<Case, 11> cases{{{"Ant-v5", "ant.xml", true},
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
std::map<std::string, double> stages;  // seconds in each function

// The CPU time that reading the clock takes, which is a system call.
const double cost_of_clock = [] {
  constexpr int kReads = 20000;
  const double start = measure::cpu_time();
  for (int i = 0; i < kReads; ++i) measure::cpu_time();
  return (measure::cpu_time() - start) / kReads;
}();

// Adds the CPU time of a scope to sums. Takes off what reading the clock costs: one read in the scope itself, and two
// for each timer within it.
class Timer {
 public:
  explicit Timer(double& sum, double* other = nullptr) : sum_(sum), other_(other) {}
  ~Timer() {
    const double time = measure::cpu_time() - start_ - cost_of_clock * (1 + 2 * (ended_ - ended_before_));
    ++ended_;
    sum_ += time;
    if (other_) *other_ += time;
  }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  static inline int ended_ = 0;  // how many timers have ended
  double &sum_, *const other_;
  const int ended_before_ = ended_;
  const double start_ = measure::cpu_time();
};

const Code* counted = nullptr;  // whose functions are called

// Adds what a solver has done, at the end of a scope. A place with a constraint has a number in D that is not 0.
struct Solved {
  const Constraints* const constraints;  // null: of no solver
  ~Solved() {
    if (!constraints) return;
    const Constraints& c = *constraints;
    const int width = counted->width;
    int most = 0;
    for (int lane = 0; lane < width; ++lane) {
      if (!(c.rows >> lane & 1)) continue;
      int count = 0;
      for (int i = 0; i < c.size; ++i) count += c.D[i * width + lane] != 0;
      shares.solving += count * c.iterations[lane];
      most = std::max(most, c.iterations[lane]);
    }
    shares.solving_at_most += static_cast<double>(c.size) * most * width;
  }
};
// The constraints among the arguments of a solver. PGS on MuJoCo 4.0 has none: its rows do not wait for each other.
inline const Constraints* constraints_of(const Lanes& /*lanes*/, const Constraints& c) { return &c; }
template <typename... Arguments>
const Constraints* constraints_of(const Arguments&... /*arguments*/) {
  return nullptr;
}

// A function of Code whose time is added to a sum.
template <auto Function, auto Sum, typename Type>
struct Counted;
template <auto Function, auto Sum, typename Result, typename... Arguments>
struct Counted<Function, Sum, Result (*)(Arguments...)> {
  static inline double* stage = nullptr;
  static inline bool solves = false;
  static Result call(Arguments... arguments) {
    const Solved solved{solves ? constraints_of(arguments...) : nullptr};
    const Timer timer(shares.*Sum, stage);
    return (counted->*Function)(arguments...);
  }
};

template <auto Function, auto Sum = &Shares::computing>
void count(Code& code, const std::string& name) {
  using Function_ = Counted<Function, Sum, std::decay_t<decltype(code.*Function)>>;
  Function_::stage = &stages[name];
  Function_::solves = name.rfind("sol", 0) == 0;
  code.*Function = Function_::call;
}

Code count(const Code& code) {
  Code result = code;
#define COUNT(type, name, parameters) count<&Code::name>(result, #name);
  MJENV_LANES_FUNCTIONS(COUNT)
#undef COUNT
  count<&Code::bad>(result, "bad");
  count<&Code::gather, &Shares::copying>(result, "gather");
  count<&Code::scatter, &Shares::copying>(result, "scatter");
  return result;
}

// An environment that plays random actions. All play the same.
class Player {
 public:
  Player(const Case& c, int lanes) {
    mjenv_options* options = nullptr;
    const std::string id = c.differs ? c.id.substr(c.id.find(':') + 1) : c.id;
    check(mjenv_options_create(c.frame_skip > 0 ? "Model-v0" : id.c_str(), &options));
    if (c.frame_skip > 0) {
      check(mjenv_options_set_string(options, "xml_file", c.model.c_str()));
      check(mjenv_options_set_integer(options, "frame_skip", c.frame_skip));
      check(mjenv_options_set_integer(options, "max_episode_steps", 50));
    }
    check(mjenv_options_set_integer(options, "lanes", lanes));
    check(mjenv_options_set_string(options, "autoreset_mode", "same_step"));
    check(mjenv_create(options, kRows, &env_));
    mjenv_options_destroy(options);
    if (c.differs) make_differ();
    std::vector<std::uint64_t> seeds(kRows);
    for (std::size_t row = 0; row < seeds.size(); ++row) seeds[row] = row;
    check(mjenv_seed(env_, nullptr, seeds.data(), kRows));
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
    for (const char* array : {"qpos", "qvel", "act", "qacc_warmstart"}) {
      const auto part = work.layout().part(array);
      if (part->count == 0) continue;
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

  // Resets draw masses, frictions and gains, and the first moving body is pushed every 4 to 8 steps.
  void make_differ() {
    check(mjenv_randomize(env_, R"({
        "randomize": {"body_mass": {"kind": "scale", "low": 0.8, "high": 1.2},
                      "geom_friction": {"kind": "scale", "low": 0.8, "high": 1.2},
                      "actuator_gainprm": {"kind": "scale", "low": 0.8, "high": 1.2}},
        "push": {"body": 1, "every": [4, 8], "force": [[-5, 5], [-5, 5], [-5, 5]]}})"));
  }
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
      if (c.needs_forces) works_.back()->expect(mjenv::core::part_of("cfrc_ext"));
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
  players.push_back(std::make_unique<Player>(c, 0));
  for (const int width : widths) players.push_back(std::make_unique<Player>(c, width));
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
  stages.clear();
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

  std::printf("%s,%.2f", c.id.c_str(), median(alone));
  for (const Columns& column : columns) column.print();
  std::printf("\n");
  std::fflush(stdout);
}

// The share of each stage, for each number of lanes.
void print_stages(const Case& c, const std::vector<int>& widths) {
  Player player(c, 0);
  for (int step = 0; step < kSteps; ++step) {
    player.sample();
    player.step();
  }
  const auto model = mjenv::core::Model::open(c.model);
  for (const int width : widths) {
    stages.clear();
    Shadow shadow(c, model, width);
    shares = {};
    for (int step = 0; step < kSteps * kRounds; ++step) {
      player.sample();
      shadow.step(player);
      player.step();
    }
    double rest = shares.all;
    const auto print = [&](const std::string& stage, const std::string& how, double time) {
      std::printf("%s,%d,\"%s\",\"%s\",%.3f\n", c.id.c_str(), width, stage.c_str(), how.c_str(), time / shares.all);
    };
    for (const mjenv::core::lanes::Stage& stage : mjenv::core::lanes::stages()) {
      double time = 0;
      for (const mjenv::core::lanes::Function& function : stage.functions) {
        time += stages[function.name];
        stages.erase(function.name);
      }
      print(stage.name, how(stage, *model), time);
      rest -= time;
    }
    for (const auto& [name, time] : stages) {
      if (time > 0) print(name, "", time);
      rest -= time;
    }
    print("row by row", "", rest);
    std::fflush(stdout);
  }
}

// The robot with this id, or the model of a file
Case case_of(const std::string& name) {
  const std::string differing = "differing:";
  if (name.rfind(differing, 0) == 0) {
    Case c = case_of(name.substr(differing.size()));
    c.id = name;
    c.differs = true;
    return c;
  }
  const auto found = std::find_if(cases.begin(), cases.end(), [&](const Case& c) { return c.id == name; });
  if (found != cases.end()) return *found;
  const std::size_t end = name.rfind(".xml");
  if (end == std::string::npos) {
    std::fprintf(stderr, "%s is neither an id of a robot nor a file .xml\n", name.c_str());
    std::exit(1);
  }
  const std::string file = name.substr(0, end + 4), frames = name.substr(end + 4);
  return {name, file, false, frames.empty() ? 1 : std::stoi(frames.substr(1))};
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> names(argv + 1, argv + argc);
  const std::vector<int> widths = mjenv::core::lanes::widths();
  if (names.size() == 4 && names[0] == "play") {
    Player player(case_of(names[1]), std::stoi(names[2]));
    for (int step = 0; step < std::stoi(names[3]); ++step) {
      player.sample();
      player.step();
    }
    return 0;
  }
  const bool only_stages = !names.empty() && names[0] == "stages";
  if (only_stages) names.erase(names.begin());
  std::vector<Case> chosen(cases.begin(), cases.end());
  if (!names.empty()) {
    chosen.clear();
    for (const std::string& name : names) chosen.push_back(case_of(name));
  }
  std::printf(only_stages ? "id,lanes,stage,how,share" : "id,us");
  for (const int width : widths)
    for (const char* column : {"gain", "computing", "copying", "solving"})
      if (!only_stages) std::printf(",%d lanes: %s", width, column);
  std::printf("\n");
  for (const Case& c : chosen) only_stages ? print_stages(c, widths) : measure_case(c, widths);
}
