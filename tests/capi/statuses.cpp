// mjenv.hpp without exceptions: calls return statuses, and objects keep them.
#include <cstdio>

// This program's own, so that the test can pretend to be compiled for another library.
static unsigned abi_version = 1;
#define mjenv_abi_version pretended_abi_version
#include <mjenv/mjenv.hpp>
extern "C" std::uint32_t pretended_abi_version(void) { return abi_version; }

#define EXPECT(condition) \
  if (!(condition)) return std::printf("%s:%d: %s\n", __FILE__, __LINE__, #condition), 1

int main() {
  EXPECT(mjenv::Env("Cow-v5").status() == MJENV_E_NAME);
  mjenv::Options options("Reacher-v5");
  EXPECT(options.set("frame_skip", 0).set("norm", "plain").status() == MJENV_E_VALUE);
  EXPECT(mjenv::Env(options).status() == MJENV_E_VALUE);
  EXPECT(mjenv::Options("Reacher-v5").set(std::string("norm\0", 5), "plain").status() == MJENV_E_ARGUMENT);

  mjenv::Env env("Reacher-v5", 2);
  EXPECT(env.status() == MJENV_OK && env.rows() == 2);
  mjenv::Batch out = env.batch();
  const std::vector<float> action(4);
  EXPECT(env.step(action, out) == MJENV_E_NOT_RESET && env.status() == MJENV_E_NOT_RESET);
  EXPECT(env.reset(std::vector<std::uint8_t>(3), out) == MJENV_E_SIZE);
  EXPECT(env.reset(out) == MJENV_OK && env.step(action, out) == MJENV_OK && env.status() == MJENV_OK);
  EXPECT(env.read(0, "nothing").empty() && env.status() == MJENV_E_NAME);
  EXPECT(env.read(0, "qpos").size() == 4 && env.status() == MJENV_OK);
  EXPECT(env.snapshot(7).empty() && env.status() == MJENV_E_VALUE);
  EXPECT(out.obs_of(2).size() == 0 && out.obs_of(1).size() == 10);

  abi_version = 2;
  EXPECT(mjenv::Options("Reacher-v5").status() == MJENV_E_INTERNAL);
  return 0;
}
