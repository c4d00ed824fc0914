// Measures what mjenv_step costs beyond its physics. Compares one row with a bare loop of mj_step (and
// mj_rnePostConstraint where the task reads its outputs) on the same engine, from the same state and with the same
// actions; both take turns.
//
//   overhead [ID...]    prints CSV: id, steps a block, blocks, median steps/s of both, median of the paired ratios
#include <mujoco/mujoco.h>

#include "engine/model.hpp"
#include "measure.hpp"

namespace {

using measure::check;
using measure::cpu;
using measure::median;
using measure::read;
using measure::seconds;
using measure::sum_of_counts;

struct Case {
  const char *id, *model;
  int frame_skip;
  bool reads_contact_forces;
};

constexpr Case cases[] = {
    {"Humanoid-v5", "humanoid.xml", 5, true},
    {"Ant-v4", "ant.xml", 5, false},
    {"Pusher-v5", "pusher_v5.xml", 5, false},
    {"HalfCheetah-v5", "half_cheetah.xml", 5, false},
    {"Reacher-v5", "reacher.xml", 2, false},
    {"Ant-v5", "ant.xml", 5, true},
    {"Hopper-v5", "hopper.xml", 4, false},
    {"HumanoidStandup-v5", "humanoidstandup.xml", 5, true},
    {"InvertedDoublePendulum-v5", "inverted_double_pendulum.xml", 5, false},
    {"InvertedPendulum-v5", "inverted_pendulum.xml", 2, false},
    {"Swimmer-v5", "swimmer.xml", 4, false},
    {"Walker2d-v5", "walker2d_v5.xml", 4, false},
};

constexpr int kBlocks = 41;
constexpr double kBlockSeconds = 0.02;

void run(const Case& c) {
  mjenv_options* options = nullptr;
  mjenv_env* env = nullptr;
  check(mjenv_options_create(c.id, &options));
  check(mjenv_options_set_integer(options, "max_episode_steps", 0));
  check(mjenv_options_set_integer(options, "strict", 0));  // the trajectory runs through, as the bare loop's
  check(mjenv_create(options, 1, &env));
  mjenv_options_destroy(options);
  const std::uint64_t seed = 1;
  check(mjenv_seed(env, nullptr, &seed, 1));
  check(mjenv_seed_actions(env, seed));
  check(mjenv_reset(env, nullptr, nullptr));

  const auto model = mjenv::core::Model::open(c.model);
  const mjModel* m = model->get();
  mjData* d = mj_makeData(m);
  const auto qpos = read(env, "qpos"), qvel = read(env, "qvel");
  std::copy(qpos.begin(), qpos.end(), d->qpos);
  std::copy(qvel.begin(), qvel.end(), d->qvel);
  mj_forward(m, d);

  mjenv_batch out = MJENV_BATCH_INIT;
  std::vector<double> obs(static_cast<std::size_t>(sum_of_counts(env, MJENV_ROLE_OBSERVATION)));
  std::vector<double> info(static_cast<std::size_t>(sum_of_counts(env, MJENV_ROLE_INFO)));
  double reward = 0;
  std::uint8_t terminated = 0, truncated = 0;
  out.rows = 1;
  out.obs_count = static_cast<std::int64_t>(obs.size());
  out.info_count = static_cast<std::int64_t>(info.size());
  out.obs = obs.data();
  out.info = info.data();
  out.reward = &reward;
  out.terminated = &terminated;
  out.truncated = &truncated;

  const auto nu = static_cast<std::size_t>(m->nu);
  std::vector<float> actions;
  const auto draw = [&](std::size_t steps) {
    actions.resize(steps * nu);
    for (std::size_t i = 0; i < steps; ++i) check(mjenv_sample_actions(env, actions.data() + i * nu, nu));
  };
  const auto whole = [&] {
    for (std::size_t i = 0; i < actions.size(); i += nu)
      check(mjenv_step(env, nullptr, actions.data() + i, nu, MJENV_DTYPE_FLOAT32, &out));
  };
  const auto bare = [&] {
    for (std::size_t i = 0; i < actions.size(); i += nu) {
      std::copy_n(actions.data() + i, nu, d->ctrl);
      for (int k = 0; k < c.frame_skip; ++k) mj_step(m, d);
      if (c.reads_contact_forces) mj_rnePostConstraint(m, d);
    }
  };

  draw(100);
  const double warm = seconds(whole);
  bare();
  const auto steps = static_cast<std::size_t>(std::max(20.0, 100 * kBlockSeconds / warm));
  std::vector<double> whole_rate, bare_rate, ratio;
  for (int block = 0; block < kBlocks; ++block) {
    draw(steps);
    const bool whole_first = block % 2 == 0;
    const double first = seconds(whole_first ? std::function<void()>(whole) : bare);
    const double second = seconds(whole_first ? std::function<void()>(bare) : whole);
    const double t_whole = whole_first ? first : second, t_bare = whole_first ? second : first;
    whole_rate.push_back(static_cast<double>(steps) / t_whole);
    bare_rate.push_back(static_cast<double>(steps) / t_bare);
    ratio.push_back(t_bare / t_whole);
  }
  if (read(env, "qpos") != std::vector<double>(d->qpos, d->qpos + m->nq)) {
    std::fprintf(stderr, "overhead: %s: the two loops went apart\n", c.id);
    std::exit(1);
  }
  std::printf("%s,%zu,%d,%.0f,%.0f,%.3f\n", c.id, steps, kBlocks, median(whole_rate), median(bare_rate), median(ratio));
  std::fflush(stdout);
  mj_deleteData(d);
  mjenv_destroy(env);
}

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::string> wanted(argv + 1, argv + argc);
  std::printf("# mjenv %s, %s\n", mjenv_version(), cpu().c_str());
  std::printf("id,steps,blocks,mjenv_steps_per_second,bare_steps_per_second,ratio\n");
  for (const auto& c : cases)
    if (wanted.empty() || std::find(wanted.begin(), wanted.end(), c.id) != wanted.end()) run(c);
}
