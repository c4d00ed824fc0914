// Actions, states and controls with every bit pattern, for every id.
#include <map>

#include "target.hpp"

namespace {

// As many as step together in lanes, and one more.
constexpr std::int64_t kRows = 5;

mjenv_env* env_of(std::size_t id, bool strict) {
  static std::map<std::pair<std::size_t, bool>, EnvHandle> envs;
  EnvHandle& env = envs[{id, strict}];
  if (!env) {
    const OptionsHandle options = options_of(mjenv_id_at(static_cast<std::int64_t>(id)));
    REQUIRE(mjenv_options_set_integer(options.get(), "strict", strict) == MJENV_OK);
    REQUIRE(mjenv_options_set_string(options.get(), "autoreset_mode", strict ? "same_step" : "next_step") == MJENV_OK);
    env = create(options, kRows);
    REQUIRE(env);
  }
  return env.get();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  const std::size_t id = bytes.below(static_cast<std::size_t>(mjenv_id_count()));
  mjenv_env* env = env_of(id, bytes.flag());
  Outputs out(env, kRows);
  const std::uint64_t seeds[kRows] = {7, 8, 9, 10, 11};
  REQUIRE(mjenv_seed(env, nullptr, seeds, kRows) == MJENV_OK);
  REQUIRE(mjenv_reset(env, nullptr, &out.batch) == MJENV_OK);
  const auto nu = static_cast<std::size_t>(mjenv_field_count(env, MJENV_ROLE_ACTION)), count = kRows * nu;
  for (int calls = 0; calls < 12 && bytes.left() > 0; ++calls) {
    switch (bytes.below(5)) {
      case 0:
        check(mjenv_step(env, nullptr, bytes.list<float>(count).data(), count, MJENV_DTYPE_FLOAT32, &out.batch));
        break;
      case 1:
        check(mjenv_step(env, nullptr, bytes.list<double>(count).data(), count, MJENV_DTYPE_FLOAT64, &out.batch));
        break;
      case 2: {
        const std::size_t nq = number(env, "nq"), nv = number(env, "nv");
        const auto qpos = bytes.list<double>(nq), qvel = bytes.list<double>(nv);
        check(mjenv_set_state(env, 0, qpos.data(), nq, qvel.data(), nv));
        break;
      }
      case 3: check(mjenv_simulate(env, 1, bytes.list<double>(nu).data(), nu, 2)); break;
      default: {
        const auto action = bytes.list<double>(count * 2);
        Outputs steps(env, 2 * kRows);
        check(mjenv_rollout(env, action.data(), count * 2, MJENV_DTYPE_FLOAT64, 2, &steps.batch));
      }
    }
  }
  return 0;
}
