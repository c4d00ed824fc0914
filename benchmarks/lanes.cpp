// Measures what lanes gain: the same steps of 64 rows on one thread, one row after the other and in the lanes of each
// instruction set, in turns.
//
//   lanes [ID...]    prints CSV: id, microseconds for a step of one row without lanes, then for each number of lanes how
//                    many times as fast it is
#include <memory>
#include <string>
#include <vector>

#include "engine/lanes/stepper.hpp"
#include "measure.hpp"

namespace {

using measure::check;
using measure::median;
using measure::seconds;

constexpr std::int64_t kRows = 64;
constexpr int kSteps = 10;
constexpr int kRounds = 9;

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
    check(mjenv_seed(env_, seeds.data(), nullptr));
    check(mjenv_seed_actions(env_, 1));
    check(mjenv_reset(env_, nullptr, nullptr));
    mjenv_space space{};
    space.struct_size = sizeof space;
    check(mjenv_space_of(env_, MJENV_ROLE_OBSERVATION, &space));
    observations_.resize(static_cast<std::size_t>(kRows * space.count));
    rewards_.resize(kRows);
    batch_.struct_size = sizeof batch_;
    batch_.obs_dtype = MJENV_DTYPE_FLOAT64;
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
        check(mjenv_sample_actions(env_, actions_.data(), actions_.size()));
        check(mjenv_step(env_, nullptr, actions_.data(), actions_.size(), MJENV_DTYPE_FLOAT32, &batch_));
      }
    });
    return 1e6 * time / (kSteps * static_cast<double>(kRows));
  }

 private:
  mjenv_env* env_ = nullptr;
  mjenv_batch batch_{};
  std::vector<double> observations_, rewards_;
  std::vector<float> actions_;
};

void measure_id(const char* id, const std::vector<int>& widths) {
  std::vector<std::unique_ptr<Player>> players;
  players.push_back(std::make_unique<Player>(id, 0));
  for (const int width : widths) players.push_back(std::make_unique<Player>(id, width));
  std::vector<double> alone;
  std::vector<std::vector<double>> gains(widths.size());
  for (int round = 0; round <= kRounds; ++round) {
    const double time = players[0]->play();
    std::vector<double> round_gains;
    for (std::size_t i = 0; i < widths.size(); ++i) round_gains.push_back(time / players[i + 1]->play());
    if (round == 0) continue;  // warms up
    alone.push_back(time);
    for (std::size_t i = 0; i < widths.size(); ++i) gains[i].push_back(round_gains[i]);
  }
  std::printf("%s,%.2f", id, median(alone));
  for (const auto& gain : gains) std::printf(",%.2f", median(gain));
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<int> widths = mjenv::core::lanes::widths();
  std::printf("id,us");
  for (const int width : widths) std::printf(",%d lanes", width);
  std::printf("\n");
  std::vector<std::string> ids(argv + 1, argv + argc);
  if (ids.empty())
    for (std::int64_t i = 0; i < mjenv_id_count(); ++i) {
      const std::string id = mjenv_id_at(i);
      if (id.substr(id.size() - 3) == "-v5") ids.push_back(id);
    }
  for (const std::string& id : ids) measure_id(id.c_str(), widths);
}
