// Checkpoints of a learner: damaged anywhere, and with a checksum that fits the damage.
#include <array>
#include <cstring>
#include <string>
#include <vector>

#include "folder.hpp"
#include "mjenv/learn.h"
#include "target.hpp"

namespace {

constexpr std::int64_t kRows = 2, kSteps = 3;
constexpr std::size_t kObservations = 3, kObs = kRows * kObservations;

mjenv_status learn_check(mjenv_status status) {
  REQUIRE(status <= MJENV_OK && status >= MJENV_E_TASK);
  REQUIRE(status != MJENV_E_INTERNAL);
  REQUIRE(status == MJENV_OK || *mjenv_learn_last_error());
  return status;
}

class Learner {
 public:
  Learner() {
    constexpr const char* kSettings =
        "rows=2 rollout_steps=3 minibatch_size=4 hidden=4 window=2 scale_actions=false steps=1000000";
    const double low = -1, high = 1;
    mjenv_space observation = MJENV_SPACE_INIT, action = MJENV_SPACE_INIT;
    observation.count = kObservations;
    action.count = 1;
    action.low = &low;
    action.high = &high;
    REQUIRE(mjenv_learner_create_apart(&observation, &action, "Some-v0", kSettings, obs_.data(), kObs, &learner_) ==
            MJENV_OK);
  }
  ~Learner() { mjenv_learner_destroy(learner_); }
  Learner(const Learner&) = delete;
  Learner& operator=(const Learner&) = delete;

  // Plays a rollout in which each step ends an episode of one row. Its observations and rewards follow from the actions.
  mjenv_status train() {
    for (std::int64_t step = 0; step < kSteps; ++step) {
      std::array<float, kRows> actions{};
      if (const auto status = learn_check(mjenv_learner_act(learner_, actions.data(), kRows))) return status;
      std::array<double, kRows> rewards{};
      std::array<std::uint8_t, kRows> terminated{}, truncated{};
      for (std::size_t row = 0; row < kRows; ++row) {
        rewards[row] = actions[row];
        obs_[row * kObservations] = actions[row] / 2;
      }
      (step % 2 == 0 ? terminated : truncated)[static_cast<std::size_t>(step) % kRows] = 1;
      mjenv_batch batch = MJENV_BATCH_INIT;
      batch.rows = kRows;
      batch.obs_count = kObservations;
      batch.obs = batch.final_obs = obs_.data();
      batch.reward = rewards.data();
      batch.terminated = terminated.data();
      batch.truncated = truncated.data();
      if (const auto status = learn_check(mjenv_learner_feed(learner_, &batch))) return status;
    }
    return MJENV_OK;
  }

  // Reads the policy's text, which is always that of a policy.
  std::string policy(mjenv_learned which) const {
    std::int64_t size = 0;
    REQUIRE(mjenv_learner_policy(learner_, which, nullptr, 0, &size) == MJENV_OK);
    std::string text(static_cast<std::size_t>(size), '\0');
    REQUIRE(mjenv_learner_policy(learner_, which, text.data(), size, &size) == MJENV_OK);
    mjenv_policy* policy = nullptr;
    REQUIRE(mjenv_policy_parse(text.data(), size - 1, &policy) == MJENV_OK);
    mjenv_policy_destroy(policy);
    return text;
  }

  mjenv_status save(const std::string& path) { return learn_check(mjenv_learner_save(learner_, path.c_str(), "note")); }
  mjenv_status load(const std::string& path) { return learn_check(mjenv_learner_load(learner_, path.c_str())); }

 private:
  mjenv_learner* learner_ = nullptr;
  std::array<double, kObs> obs_{};
};

struct Sample {
  Folder folder;
  std::string good = folder.path / "good", bad = folder.path / "bad", policy;
  Learner learner;
  std::vector<char> content;
  std::size_t sum;  // where the checksum is

  Sample() {
    REQUIRE(learner.train() == MJENV_OK && learner.train() == MJENV_OK);
    REQUIRE(learner.save(good) == MJENV_OK);
    policy = learner.policy(MJENV_LEARNED_LAST);
    std::ifstream file(good, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    content.assign(text.begin(), text.end());
    sum = text.find("\n\n") + 2;
  }
};

void put_sum(std::vector<char>& content, std::size_t at) {
  if (content.size() < at + 8) return;
  const std::uint64_t sum = mjenv::core::hash(content.data() + at + 8, content.size() - at - 8);
  std::memcpy(&content[at], &sum, sizeof sum);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Sample sample;
  Bytes bytes(data, size);
  const bool fits = bytes.flag();
  std::vector<char> content = sample.content;
  content.resize(bytes.flag() ? content.size() : bytes.take<std::uint16_t>());
  bytes.damage(content);
  if (fits) put_sum(content, sample.sum);
  write(sample.bad, {content.begin(), content.end()});
  std::int64_t note = 0;
  learn_check(mjenv_checkpoint_note(sample.bad.c_str(), nullptr, 0, &note));
  if (sample.learner.load(sample.bad) == MJENV_OK)
    sample.learner.train();
  else
    REQUIRE(sample.learner.policy(MJENV_LEARNED_LAST) == sample.policy);
  sample.learner.policy(MJENV_LEARNED_LAST);
  sample.learner.policy(MJENV_LEARNED_BEST);
  // Whatever it was, the learner takes a good checkpoint.
  REQUIRE(sample.learner.load(sample.good) == MJENV_OK);
  REQUIRE(sample.learner.policy(MJENV_LEARNED_LAST) == sample.policy);
  return 0;
}
