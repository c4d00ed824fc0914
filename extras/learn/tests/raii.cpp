// learn.hpp: a training, its checkpoint and its policy, and what is refused. learner.c tests what the functions do.
#include <unistd.h>

#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <mjenv/learn.hpp>
#include <string>

// After the headers that it needs; it does not say itself that it is C.
#include <csetjmp>
extern "C" {
#include <cmocka.h>
}

namespace {

static_assert(std::is_nothrow_move_constructible_v<mjenv::Learner> && !std::is_copy_constructible_v<mjenv::Learner>);
static_assert(std::is_nothrow_move_constructible_v<mjenv::Policy> && !std::is_copy_constructible_v<mjenv::Policy>);

// Whether the call throws an Error with that status and a message that contains the words.
bool refused(mjenv_status status, const char* words, const std::function<void()>& call) {
  try {
    call();
  } catch (const mjenv::Error& error) {
    return error.status == status && std::strstr(error.what(), words);
  }
  return false;
}

mjenv::Env env_of(const char* id, const char* autoreset_mode) {
  return mjenv::Env(mjenv::Options(id).set("autoreset_mode", autoreset_mode), 8);
}

// Returns what is wrong: cmocka leaves a failing test by longjmp, across which nothing with a destructor may live.
#define EXPECT(condition) \
  if (!(condition)) return #condition

// A folder that is removed with its files.
struct Folder {
  char path[32] = "/tmp/mjenv_raii_XXXXXX";

  Folder() {
    if (!mkdtemp(path)) path[0] = '\0';
  }
  ~Folder() { std::filesystem::remove_all(path); }
};

const char* train() {
  const Folder folder;
  const std::string checkpoint = folder.path + std::string("/checkpoint"), file = folder.path + std::string("/policy");
  const char* const id = "InvertedPendulum-v5";
  EXPECT(mjenv::learn_settings(id, "gamma=0.5").at("rows") == "8");
  EXPECT(mjenv::learn_settings(id, "gamma=0.5").at("gamma") == "0.5");
  mjenv::Env env = env_of(id, "same_step");
  mjenv::Learner learner(env, id);
  learner.train(20'000);
  learner.save(checkpoint, "speed=2");
  EXPECT(mjenv::checkpoint_note(checkpoint) == "speed=2");
  learner.train(40'000);
  EXPECT(learner.report().mean_return == 1000);
  const auto curve = learner.curve();
  EXPECT(curve.size() == 30 && curve.front().steps == 2048 && curve.back().updates == 30);

  mjenv::Env other_env = env_of(id, "same_step");
  mjenv::Learner other(other_env, id);
  other.load(checkpoint);
  EXPECT(other.report().steps == 20'480);
  other.train(40'000);
  EXPECT(other.policy_text() == learner.policy_text());

  learner.save_policy(file);
  const mjenv::Policy policy = mjenv::Policy::load(file);
  EXPECT(policy.id() == id);
  mjenv::Env played_env = env_of(id, "disabled");
  const mjenv::Evaluation played = mjenv::evaluate(played_env, policy, 10, 100);
  EXPECT(played.returns == std::vector<double>(10, 1000.0) && played.lengths == std::vector<std::int64_t>(10, 1000));

  EXPECT(policy.observations() == 4 && policy.actuators() == 1);
  EXPECT((policy.places(played_env) == std::vector<std::int64_t>{0, 1, 2, 3}));
  const std::vector<double> obs(2 * policy.observations(), 0.5);
  std::vector<float> action(2 * policy.actuators());
  policy.act(2, obs, action);
  EXPECT(action[0] == action[1] && action[0] != 0);
  EXPECT(refused(MJENV_E_SIZE, "obs_count", [&] { policy.act(3, obs, action); }));
  return nullptr;
}

const char* refuse() {
  const char* const id = "Hopper-v5";
  mjenv::Env env = env_of(id, "same_step");
  mjenv::Learner learner(env, id);
  EXPECT(refused(MJENV_E_VALUE, "steps is -1", [&] { learner.train(-1); }));
  EXPECT(refused(MJENV_E_FILE, "No such file", [&] { learner.load("/nowhere/missing"); }));
  EXPECT(refused(MJENV_E_ARGUMENT, "NUL", [&] { learner.save(std::string("a\0b", 3)); }));
  EXPECT(refused(MJENV_E_ARGUMENT, "NUL", [&] { learner.save("/nowhere/missing", std::string("a\0b", 3)); }));
  EXPECT(refused(MJENV_E_VALUE, "line 1", [] { mjenv::Policy::parse("no policy"); }));
  EXPECT(refused(MJENV_E_VALUE, "hidden", [&] { learner.set("hidden=32"); }));
  EXPECT(refused(MJENV_E_NAME, "gama", [&] { mjenv::Learner(env, id, "gama=1"); }));
  EXPECT(refused(MJENV_E_ARGUMENT, "NUL", [&] { learner.set(std::string("a\0b", 3)); }));
  learner.set("learning_rate=1e-4");
  learner.train(1);
  EXPECT(learner.report().learning_rate == 1e-4);
  mjenv::Env disabled = env_of(id, "disabled");
  EXPECT(refused(MJENV_E_VALUE, "autoreset_mode", [&] { learner.set_env(disabled); }));
  return nullptr;
}

// Calls the body, and fails if it returns what is wrong or throws.
void run(const std::function<const char*()>& body) {
  const char* wrong = nullptr;
  try {
    wrong = body();
  } catch (const mjenv::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    wrong = "an exception";
  }
  if (wrong) fail_msg("%s", wrong);
}

void test_train(void**) { run(train); }

void test_refuse(void**) { run(refuse); }

}  // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_train), cmocka_unit_test(test_refuse)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
