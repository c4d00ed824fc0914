// Measures what each way of calling MuJoCo gains. Bare loops play the same episodes in turns, on the engine that this
// library is built with. Each loop adds a lever, which leaves out some work, to the loop before; the bits stay the
// same.
//
//   levers [ID...]    prints CSV: id, steps/s of the plain loop, then each lever's gain over the loop before it
#include <array>
#include <cstring>

#include "engine/model.hpp"
#include "engine/mujoco.hpp"
#include "engine/work.hpp"
#include "measure.hpp"

// Names in this namespace are MuJoCo's functions on every engine, see engine/mujoco4.hpp.
namespace mjenv::core {
namespace {

using measure::check;
using measure::median;
using measure::seconds;

struct Case {
  const char *id, *model;
  int frame_skip;
  bool reads_contact_forces;
};

constexpr Case cases[] = {
    {"Ant-v5", "ant.xml", 5, true},
    {"HalfCheetah-v5", "half_cheetah.xml", 5, false},
    {"Hopper-v5", "hopper.xml", 4, false},
    {"Humanoid-v5", "humanoid.xml", 5, true},
    {"HumanoidStandup-v5", "humanoidstandup.xml", 5, true},
    {"InvertedDoublePendulum-v5", "inverted_double_pendulum.xml", 5, false},
    {"InvertedPendulum-v5", "inverted_pendulum.xml", 2, false},
    {"Pusher-v5", "pusher_v5.xml", 5, false},
    {"Reacher-v5", "reacher.xml", 2, false},
    {"Swimmer-v5", "swimmer.xml", 4, false},
    {"Walker2d-v5", "walker2d_v5.xml", 4, false},
};

// Each lever includes those before it.
constexpr std::array levers{"plain", "row instead of mj_resetData", "mj_rnePostConstraint on demand", "explicit pairs",
                            "frames on demand"};

constexpr int kSteps = 1000;
constexpr int kRounds = 15;

// Recorded episodes: the step and the state where each begins, and every action.
struct Tape {
  std::vector<bool> begins;
  std::vector<std::vector<double>> qpos, qvel;
  std::vector<float> actions;
};

Tape record(const char* id, std::size_t nu) {
  mjenv_options* options = nullptr;
  mjenv_env* env = nullptr;
  check(mjenv_options_create(id, &options));
  check(mjenv_create(options, 1, &env));
  mjenv_options_destroy(options);
  const std::uint64_t seed = 42;
  check(mjenv_seed(env, nullptr, &seed, 1));
  check(mjenv_seed_actions(env, seed));
  mjenv_batch out = MJENV_BATCH_INIT;
  std::uint8_t terminated = 1, truncated = 0;
  out.rows = 1;
  out.terminated = &terminated;
  out.truncated = &truncated;
  Tape tape;
  tape.actions.resize(kSteps * nu);
  for (std::size_t t = 0; t < kSteps; ++t) {
    tape.begins.push_back(terminated || truncated);
    if (tape.begins.back()) {
      check(mjenv_reset(env, nullptr, nullptr));
      tape.qpos.push_back(measure::read(env, "qpos"));
      tape.qvel.push_back(measure::read(env, "qvel"));
    }
    check(mjenv_sample_actions(env, tape.actions.data() + t * nu, nu));
    check(mjenv_step(env, nullptr, tape.actions.data() + t * nu, nu, MJENV_DTYPE_FLOAT32, &out));
  }
  mjenv_destroy(env);
  return tape;
}

void play(const Case& c, const Tape& tape, const Model& model, std::size_t lever, mjData* d) {
  const mjModel* stock = model.get();
  mjModel m = *stock;
  if (lever >= 3) {
    m = *model.stepped();
    m.ngeom = stock->ngeom;
    m.ncam = stock->ncam;
    m.nlight = stock->nlight;
    m.geom_sameframe = stock->geom_sameframe;
  }
  if (lever >= 4) m = *model.stepped();
  std::size_t episode = 0;
  for (std::size_t t = 0; t < kSteps; ++t) {
    if (tape.begins[t]) {
      if (lever == 0) {
        mj_resetData(stock, d);
      } else {
        d->time = 0;
        std::fill_n(d->qacc_warmstart, m.nv, 0.0);
        std::fill_n(d->ctrl, m.nu, 0.0);
      }
      std::copy(tape.qpos[episode].begin(), tape.qpos[episode].end(), d->qpos);
      std::copy(tape.qvel[episode].begin(), tape.qvel[episode].end(), d->qvel);
      mj_forward(&m, d);
      ++episode;
    }
    std::copy_n(tape.actions.data() + t * static_cast<std::size_t>(m.nu), m.nu, d->ctrl);
    for (int k = 0; k < c.frame_skip; ++k) mj_step(&m, d);
    if (lever < 2 || c.reads_contact_forces) mj_rnePostConstraint(&m, d);
  }
}

void run(const Case& c) {
  const auto model = Model::open(c.model);
  const mjModel* m = model->get();
  const Tape tape = record(c.id, static_cast<std::size_t>(m->nu));
  std::array<mjData*, levers.size()> data{};
  std::array<std::vector<double>, levers.size()> taken;
  for (auto& d : data) d = mj_makeData(m);
  for (int round = 0; round <= kRounds; ++round)
    for (std::size_t lever = 0; lever < levers.size(); ++lever) {
      const double time = seconds([&] { play(c, tape, *model, lever, data[lever]); });
      if (round > 0) taken[lever].push_back(time);
      if (std::memcmp(data[lever]->qpos, data[0]->qpos, sizeof(double) * static_cast<std::size_t>(m->nq)) != 0) {
        std::fprintf(stderr, "levers: %s: %s changes the bits\n", c.id, levers[lever]);
        std::exit(1);
      }
    }
  std::printf("%s,%.0f", c.id, kSteps / median(taken[0]));
  for (std::size_t lever = 1; lever < levers.size(); ++lever) {
    std::vector<double> ratios;
    for (std::size_t round = 0; round < kRounds; ++round)
      ratios.push_back(taken[lever - 1][round] / taken[lever][round]);
    std::printf(",%.3f", median(ratios));
  }
  std::printf("\n");
  std::fflush(stdout);
  for (mjData* d : data) mj_deleteData(d);
}

void run_all(const std::vector<std::string>& wanted) {
  std::printf("# mjenv %s, %s\nid,steps_per_second", mjenv_version(), measure::cpu().c_str());
  for (std::size_t lever = 1; lever < levers.size(); ++lever) std::printf(",%s", levers[lever]);
  std::printf("\n");
  for (const auto& c : cases)
    if (wanted.empty() || std::find(wanted.begin(), wanted.end(), c.id) != wanted.end()) run(c);
}

}  // namespace
}  // namespace mjenv::core

int main(int argc, char** argv) { mjenv::core::run_all({argv + 1, argv + argc}); }
