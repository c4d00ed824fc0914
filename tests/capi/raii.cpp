// mjenv.hpp: handles, exceptions, buffers. Its numbers are compared with Gymnasium's by examples/run.
#include <array>
#include <cstdarg>
#include <cstring>
#include <functional>
#include <mjenv/mjenv.hpp>
#include <set>

// After the headers that it needs; it does not say itself that it is C.
#include <csetjmp>
extern "C" {
#include <cmocka.h>
}

namespace {

// cmocka leaves a failing test by longjmp, across which nothing with a destructor may live: each body tells its
// verdict.
#define TEST(name)                                  \
  std::string name##_body();                        \
  void name(void**) {                               \
    static std::string why; /* outlives the jump */ \
    why = name##_body();                            \
    if (!why.empty()) fail_msg("%s", why.c_str());  \
  }                                                 \
  std::string name##_body()
#define EXPECT(condition) \
  if (!(condition)) return #condition

static_assert(std::is_nothrow_move_constructible_v<mjenv::Env> && !std::is_copy_constructible_v<mjenv::Env>);
static_assert(std::is_nothrow_move_assignable_v<mjenv::Options> && std::is_copy_assignable_v<mjenv::Options>);
static_assert(!std::is_convertible_v<std::vector<float>&, mjenv::Span<const double>>);
static_assert(!std::is_convertible_v<const std::vector<float>&, mjenv::Span<float>>);

// Whether the call throws an Error with that status and a message that contains the words.
bool refused(mjenv_status status, const char* words, const std::function<void()>& call) {
  try {
    call();
  } catch (const mjenv::Error& error) {
    return error.status == status && std::strstr(error.what(), words);
  }
  return false;
}

bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

TEST(sizes_and_descriptions) {
  mjenv::Env env("Ant-v5", 3);
  const mjenv::Batch batch = env.batch();
  EXPECT(env.rows() == 3);
  EXPECT(env.count(MJENV_ROLE_ACTION) == 8);
  EXPECT(batch.obs.size() == 3 * 105 && batch.reward.size() == 3 && batch.was_reset.size() == 3);
  EXPECT(batch.info.size() == 3 * env.count(MJENV_ROLE_INFO) && batch.info_count == env.count(MJENV_ROLE_INFO));
  EXPECT(batch.obs_of(2).data() == &batch.obs[210] && batch.obs_of(2).size() == 105);
  // 105 times the last is 314 in 64 bits.
  for (const std::size_t row : {std::size_t{3}, std::size_t{8081430737053708330U}})
    EXPECT(refused(MJENV_E_VALUE, "row", [&] { batch.obs_of(row); }));
  EXPECT(env.space(MJENV_ROLE_ACTION).count == 8 && env.space(MJENV_ROLE_ACTION).high[7] == 1.0);
  EXPECT(std::string(env.fields(MJENV_ROLE_RESET_INFO).at(0).name) == "x_position");
  return "";
}

TEST(options_of_every_kind) {
  const double range[] = {0.3, 0.9};
  mjenv::Options options("Ant-v5");
  options.set("frame_skip", 3).set("terminate_when_unhealthy", false).set("ctrl_cost_weight", 0.25);
  options.set("healthy_z_range", {0.1, 2.0}).set("healthy_z_range", range);
  options.set("main_body", "torso").set("norm", std::string("plain"));
  double values[2];
  std::int64_t count;
  mjenv::check(mjenv_options_get_reals(options.handle(), "healthy_z_range", values, 2, &count));
  EXPECT(count == 2 && values[0] == 0.3 && values[1] == 0.9);
  mjenv::check(mjenv_options_get_reals(options.handle(), "ctrl_cost_weight", values, 2, &count));
  EXPECT(count == 1 && values[0] == 0.25);
  std::int64_t skip;
  mjenv::check(mjenv_options_get_integer(options.handle(), "frame_skip", &skip));
  EXPECT(skip == 3);
  EXPECT(refused(MJENV_E_VALUE, "2^63", [&] { options.set("ctrl_cost_weight", std::uint64_t{1} << 63); }));
  EXPECT(mjenv::Env(options).info().frame_skip == 3);
  return "";
}

TEST(errors_are_thrown) {
  EXPECT(refused(MJENV_E_NAME, "Cow-v5", [] { mjenv::Env env("Cow-v5"); }));
  EXPECT(refused(MJENV_E_VALUE, "rows", [] { mjenv::Env env("Ant-v5", 0); }));
  EXPECT(refused(MJENV_E_VALUE, "frame_skip", [] { mjenv::Options("Ant-v5").set("frame_skip", 0); }));
  mjenv::Env env("Reacher-v5");
  mjenv::Batch out = env.batch();
  EXPECT(refused(MJENV_E_NOT_RESET, "", [&] { env.step(std::vector<float>(2), out); }));
  env.reset(out);
  EXPECT(refused(MJENV_E_SIZE, "3", [&] { env.step(std::vector<float>(3), out); }));
  mjenv::Batch other = mjenv::Env("Reacher-v5", 2).batch();
  EXPECT(refused(MJENV_E_SIZE, "rows", [&] { env.reset(other); }));
  EXPECT(refused(MJENV_E_SIZE, "mask", [&] { env.reset(std::vector<std::uint8_t>(2), out); }));
  EXPECT(refused(MJENV_E_ARGUMENT, "NUL", [] { mjenv::Options(std::string("Ant-v5\0x", 8)); }));
  EXPECT(refused(MJENV_E_ARGUMENT, "NUL", [] { mjenv::Options("Ant-v5").set(std::string("norm\0", 5), "plain"); }));
  EXPECT(refused(MJENV_E_ARGUMENT, "NUL", [] { mjenv::Options("Ant-v5").set("norm", std::string("plain\0", 6)); }));
  EXPECT(refused(MJENV_E_ARGUMENT, "NUL", [&] { env.read(0, std::string("qpos\0", 5)); }));
  return "";
}

TEST(options_are_copied_and_read) {
  mjenv::Options options("Ant-v5");
  options.set("frame_skip", 3).set("healthy_z_range", {0.1, 2.0}).set("norm", "plain").set("ctrl_cost_weight", 2);
  mjenv::Options copy(options);
  copy.set("frame_skip", 4);
  EXPECT(options.get_integer("frame_skip") == 3 && copy.get_integer("frame_skip") == 4);
  EXPECT(copy.get_reals("healthy_z_range") == (std::vector<double>{0.1, 2.0}) && copy.get_string("norm") == "plain");
  options = copy;
  EXPECT(options.get_integer("frame_skip") == 4 && options.describe().size() == copy.describe().size());
  // An integer given to a real stays one in the copy, as the infos that follow from it tell.
  mjenv::Env env(copy);
  const auto cost = [](const mjenv::Env& e) {
    for (const mjenv_field& field : e.fields(MJENV_ROLE_INFO))
      if (std::strcmp(field.name, "reward_ctrl") == 0) return field.dtype;
    return mjenv_dtype{0};
  };
  EXPECT(cost(env) == cost(mjenv::Env(mjenv::Options("Ant-v5").set("ctrl_cost_weight", 2))));
  EXPECT(env.options().get_integer("frame_skip") == 4 && env.info().frame_skip == 4);
  EXPECT(refused(MJENV_E_TYPE, "frame_skip", [&] { options.get_string("frame_skip"); }));
  return "";
}

TEST(batches_are_assigned_and_serve_resets_and_steps) {
  mjenv::Env env(
      mjenv::Options("Hopper-v5").set("autoreset_mode", "same_step").set("max_episode_steps", 2).set("arrays", "qpos"),
      2);
  mjenv::Batch out = env.batch(), kept;
  env.seed(3);
  env.reset(out);
  EXPECT(out.arrays_count == 6 && out.arrays.size() == 12 && out.final_obs.size() == 22);
  kept = out;
  EXPECT(same_bits(kept.obs, out.obs) && kept.rows == 2);
  const std::vector<float> action(6);
  env.step(action, out);
  EXPECT(out.info != std::vector<double>(out.info.size()));
  env.step(action, out);
  EXPECT(out.ended(0) && out.was_reset[0] && out.final_obs_of(1).size() == 11);
  EXPECT(out.final_info != std::vector<double>(out.final_info.size()));
  env.step(action, out);
  env.reset(out);
  EXPECT(out.info == std::vector<double>(out.info.size()));
  return "";
}

// A box that slides and turns above a floor, in a MuJoCo whose stack is too small for contacts.
std::string box() {
  const std::string size = MUJOCO[0] == '4' ? "memory='5400'" : "nstack='120'";
  return "<mujoco><size " + size +
         "/><option timestep='0.01'/><worldbody><geom type='plane' size='9 9 1'/><body pos='0 0 3'>"
         "<joint name='x' type='slide' axis='1 0 0'/><joint type='slide' axis='0 0 1'/><joint type='hinge' axis='0 1 "
         "0'/>"
         "<geom type='box' size='.3 .3 .3'/></body></worldbody><actuator><motor joint='x'/></actuator></mujoco>";
}

TEST(rows_are_received_although_one_fails) {
  mjenv::Options options("HalfCheetah-v5");
  options.set("xml_string", box());
  mjenv::Env env(options, 4), whole(options, 4);
  mjenv::Batch out = env.batch(), want = whole.batch();
  env.seed(1), whole.seed(1);
  env.reset(out), whole.reset(want);
  env.set_state(1, std::array<double, 3>{0, -2.6, 0}, std::array<double, 3>{0, -10, 0});
  const std::vector<double> action(4, 1.0);
  whole.step(action, want);
  std::array<std::int64_t, 4> rows{};
  env.send(action);
  std::size_t received = 0;
  EXPECT(refused(MJENV_E_PHYSICS, "row 1", [&] {
    try {
      env.recv(4, rows, out);
    } catch (const mjenv::Error& error) {
      received = error.received;
      throw;
    }
  }));
  EXPECT(received == 4);
  EXPECT((std::set<std::int64_t>(rows.begin(), rows.end()) == std::set<std::int64_t>{0, 1, 2, 3}));
  EXPECT((out.status == std::vector<std::int32_t>{MJENV_OK, MJENV_E_PHYSICS, MJENV_OK, MJENV_OK}));
  for (const std::size_t row : {0U, 2U, 3U}) {
    EXPECT(out.reward[row] == want.reward[row]);
    const auto of = [row](const mjenv::Batch& batch) {
      return std::vector<double>(batch.obs_of(row).begin(), batch.obs_of(row).end());
    };
    EXPECT(same_bits(of(out), of(want)));
  }
  try {
    env.recv(1, rows, out);
  } catch (const mjenv::Error& error) {
    EXPECT(error.status == MJENV_E_NOT_PENDING && error.received == 0);
  }
  return "";
}

TEST(rows_are_sent_received_masked_and_rolled_out) {
  mjenv::Env env("Hopper-v5", 3), twin("Hopper-v5", 3);
  mjenv::Batch out = env.batch(), want = twin.batch();
  env.seed(5), twin.seed(5);
  env.reset(out), twin.reset(want);
  const std::vector<double> action{0.1, 0.2, 0.3, -0.1, -0.2, -0.3, 0.5, 0.6, 0.7};
  twin.step(action, want);
  env.send(action);
  std::array<std::int64_t, 3> rows{};
  EXPECT(refused(MJENV_E_PENDING, "", [&] { env.step(action, out); }));
  EXPECT(env.recv(3, rows, out) == 3 && same_bits(out.obs, want.obs));
  EXPECT(refused(MJENV_E_NOT_PENDING, "", [&] { env.recv(0, rows, out); }));
  env.send(std::array<std::int64_t, 1>{2}, mjenv::Span<const double>(action.data() + 6, 3));
  EXPECT(env.recv(1, rows, out, 100) == 1 && rows[0] == 2);
  twin.step(std::array<std::uint8_t, 3>{0, 0, 1}, action, want);
  EXPECT(same_bits(out.obs, want.obs));
  mjenv::Batch plan = env.rollout_batch(2);
  std::vector<double> twice;
  for (int row = 0; row < 3; ++row)
    for (int step = 0; step < 2; ++step)
      twice.insert(twice.end(), action.begin() + 3 * row, action.begin() + 3 * row + 3);
  env.rollout(twice, 2, plan);
  twin.step(action, want), twin.step(action, want);
  env.observe(out);
  EXPECT(same_bits(out.obs, want.obs));
  EXPECT(same_bits({plan.obs_of(1).begin(), plan.obs_of(1).end()}, {plan.obs.begin() + 11, plan.obs.begin() + 22}));
  EXPECT(same_bits({plan.obs.begin() + 55, plan.obs.end()}, {want.obs.begin() + 22, want.obs.end()}));
  EXPECT(env.object_name("body", env.object_index("body", "torso")) == "torso" && env.object_count("joint") == 6);
  EXPECT(env.stream(0) == twin.stream(0));
  return "";
}

// The state of np.random.default_rng(42) in NumPy after integers(0, 10), which has used half of a draw.
TEST(streams_with_half_a_draw) {
  const std::vector<std::uint64_t> words{
      0xb05a'c563'5702'c3e7, 0x47c0'e8d1'1a13'4fa4, 0x66ca'f2e2'8d25'abff, 0xfa50'5436'c9a8'416e, 1, 3324115917};
  mjenv::Env env("Hopper-v5", 2);
  env.set_stream(0, words);
  EXPECT(env.stream(0) == words);
  env.set_stream(1, env.stream(0));
  EXPECT(env.stream(1) == words);
  env.set_stream(1, {words.data(), 4});
  EXPECT((env.stream(1) == std::vector<std::uint64_t>{words[0], words[1], words[2], words[3], 0, 0}));
  return "";
}

TEST(handles_move) {
  mjenv::Env first("Hopper-v5"), second("Reacher-v5");
  mjenv_env* const handle = first.handle();
  second = std::move(first);
  EXPECT(second.handle() == handle && first.handle() == nullptr);
  const mjenv::Env third(std::move(second));
  EXPECT(third.handle() == handle && third.count(MJENV_ROLE_ACTION) == 3);
  return "";
}

TEST(rows_are_copied_and_continued) {
  mjenv::Env env("Hopper-v5", 3);
  mjenv::Batch out = env.batch();
  env.seed(7);
  env.reset(out);
  EXPECT(!same_bits({out.obs.begin(), out.obs.begin() + 11}, {out.obs.begin() + 11, out.obs.begin() + 22}));
  std::vector<double> action(9, 0.5);
  env.step(action, out);
  const std::vector<std::byte> all = env.snapshot(), one = env.snapshot(1);
  env.step(action, out);
  const std::vector<double> after = out.obs;
  env.restore(all);
  env.copy_row(std::array<std::uint8_t, 3>{1, 0, 0}, 1);
  env.restore(one, 2);
  env.step(action, out);
  const std::vector<double> middle(after.begin() + 11, after.begin() + 22);
  for (int row = 0; row < 3; ++row)
    EXPECT(same_bits(middle, {out.obs.begin() + 11 * row, out.obs.begin() + 11 * (row + 1)}));
  return "";
}

TEST(masks_choose_rows) {
  mjenv::Env env("Reacher-v5", 2);
  mjenv::Batch out = env.batch();
  env.seed(1);
  env.reset(out);
  const std::vector<double> before = out.obs;
  env.reset(std::vector<std::uint8_t>{0, 1}, out);
  EXPECT(same_bits({before.begin(), before.begin() + 10}, {out.obs.begin(), out.obs.begin() + 10}));
  EXPECT(!same_bits({before.begin() + 10, before.end()}, {out.obs.begin() + 10, out.obs.end()}));
  return "";
}

TEST(state_is_read_and_set) {
  mjenv::Env env("Reacher-v5");
  mjenv::Batch out = env.batch();
  env.reset(out);
  const std::vector<double> qpos{0.1, -0.2, 0.05, 0.1}, qvel{1, 2, 0, 0};
  env.set_state(0, qpos, qvel);
  EXPECT(same_bits(env.read(0, "qpos"), qpos));
  EXPECT(same_bits(env.read(0, "qvel"), qvel));
  EXPECT(refused(MJENV_E_NAME, "no_such", [&] { env.read(0, "no_such"); }));
  return "";
}

TEST(rows_are_written) {
  mjenv::Env env("Reacher-v5", 2);
  const std::vector<double> mass = env.read(0, "body_mass");
  std::vector<double> heavy = mass;
  for (double& each : heavy) each *= 2;
  std::vector<double> both = mass;
  both.insert(both.end(), heavy.begin(), heavy.end());
  const std::array<std::uint8_t, 2> first{1, 0}, second{0, 1};
  env.write(second, "body_mass", heavy);
  EXPECT(same_bits(env.read(0, "body_mass"), mass) && same_bits(env.read(1, "body_mass"), heavy));
  env.write("body_mass", mass);
  EXPECT(same_bits(env.read(1, "body_mass"), mass));
  env.write("body_mass", both);
  EXPECT(same_bits(env.read(0, "body_mass"), mass) && same_bits(env.read(1, "body_mass"), heavy));
  const std::vector<double> light_weight = env.read(0, "dof_invweight0");
  env.set_constants(second);
  EXPECT(same_bits(env.read(0, "dof_invweight0"), light_weight));
  EXPECT(env.read(1, "body_subtreemass")[0] > env.read(0, "body_subtreemass")[0]);
  env.write(first, "body_mass", std::vector<double>(2 * mass.size(), 0.5));
  EXPECT(env.read(0, "body_mass")[1] == 0.5 && same_bits(env.read(1, "body_mass"), heavy));
  env.write(1, "body_mass", mass);
  env.set_constants(1);
  EXPECT(same_bits(env.read(1, "dof_invweight0"), light_weight) && env.read(0, "body_mass")[1] == 0.5);
  env.seed_row(1, std::vector<std::uint64_t>{5});
  env.seed(std::array<std::uint8_t, 2>{1, 0}, std::array<std::uint64_t, 2>{5, 0});
  EXPECT(env.stream(0) == env.stream(1));
  EXPECT(refused(MJENV_E_NAME, "no_such", [&] { env.write("no_such", mass); }));
  EXPECT(refused(MJENV_E_SIZE, "body_mass", [&] { env.write("body_mass", std::vector<double>(3 * mass.size())); }));
  EXPECT(refused(MJENV_E_VALUE, "body_mass", [&] { env.write("body_mass", std::vector<double>(mass.size(), -1)); }));
  return "";
}

TEST(says_whether_there_are_lanes) {
  mjenv::Options options("Hopper-v5");
  options.set("lanes", std::int64_t{0});
  mjenv::Env env(options, 4);
  const mjenv_info info = env.info();
  EXPECT(info.rows == 4 && info.threads == 1 && info.frame_skip == 4);
  EXPECT(info.lanes == 0 && std::string(info.lanes_reason) == "the option \"lanes\" is 0");
  return "";
}

TEST(resets_draw) {
  mjenv::Env env("Reacher-v5", 2);
  mjenv::Batch out = env.batch();
  env.randomize(R"({"randomize": {"body_mass": {"kind": "scale", "low": 0.5, "high": 1.5}}})");
  env.randomize(R"({"noise": {"observation": 0.1}})");
  env.reset(out);
  const std::vector<double> mass = env.read(0, "body_mass");
  EXPECT(!same_bits(mass, env.read(1, "body_mass")));
  EXPECT(env.randomization().find("\"observation\":0.1") != std::string::npos);
  env.randomize(R"({"randomize": null, "noise": null})");
  env.reset(out);
  EXPECT(same_bits(env.read(0, "body_mass"), mass));
  EXPECT(refused(MJENV_E_NAME, "no_such", [&] { env.randomize(R"({"randomize": {"no_such": {}}})"); }));
  return "";
}

TEST(automatic_resets_are_told) {
  mjenv::Env env(mjenv::Options("Reacher-v5").set("autoreset_mode", "same_step").set("max_episode_steps", 2), 2);
  mjenv::Batch out = env.batch();
  env.reset(out);
  const std::array<float, 4> action{};
  env.step(action, out);
  EXPECT(!out.ended(0) && !out.was_reset[0]);
  env.step(action, out);
  EXPECT(out.ended(1) && out.was_reset[1]);
  env.step(action, out);
  EXPECT(!out.was_reset[1]);
  env.reset(std::array<std::uint8_t, 2>{0, 1}, out);
  EXPECT(!out.was_reset[0] && out.was_reset[1]);
  return "";
}

}  // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(sizes_and_descriptions),
      cmocka_unit_test(options_of_every_kind),
      cmocka_unit_test(errors_are_thrown),
      cmocka_unit_test(options_are_copied_and_read),
      cmocka_unit_test(batches_are_assigned_and_serve_resets_and_steps),
      cmocka_unit_test(rows_are_received_although_one_fails),
      cmocka_unit_test(rows_are_sent_received_masked_and_rolled_out),
      cmocka_unit_test(streams_with_half_a_draw),
      cmocka_unit_test(handles_move),
      cmocka_unit_test(rows_are_copied_and_continued),
      cmocka_unit_test(masks_choose_rows),
      cmocka_unit_test(state_is_read_and_set),
      cmocka_unit_test(rows_are_written),
      cmocka_unit_test(says_whether_there_are_lanes),
      cmocka_unit_test(resets_draw),
      cmocka_unit_test(automatic_resets_are_told),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
