// Plays three seeded episodes of each id with the C++ header.
//
//   episodes NORM ID...
//
// Prints ID, steps, return, steps per second and a checksum over every bit of every output, separated by tabs.
#include <chrono>
#include <cstdio>
#include <cstring>
#include <mjenv/mjenv.hpp>

namespace {

constexpr int kEpisodes = 3, kSeed = 42;

std::uint64_t mix(std::uint64_t hash, std::uint64_t word) { return (hash ^ word) * 0x100000001b3u; }

std::uint64_t mix(std::uint64_t hash, const std::vector<double>& values) {
  for (const double value : values) {
    std::uint64_t word;
    std::memcpy(&word, &value, sizeof word);
    hash = mix(hash, word);
  }
  return hash;
}

void play(const std::string& id, const std::string& norm) {
  mjenv::Env env(mjenv::Options(id).set("norm", norm));
  mjenv::Batch out = env.batch();
  std::vector<float> action(env.count(MJENV_ROLE_ACTION));
  std::uint64_t hash = 0xcbf29ce484222325u;
  double total = 0;
  long steps = 0;
  const auto start = std::chrono::steady_clock::now();
  env.seed(kSeed);
  env.seed_actions(kSeed);
  for (int episode = 0; episode < kEpisodes; ++episode) {
    env.reset(out);
    hash = mix(mix(hash, out.obs), out.reset_info);
    while (!out.ended(0)) {
      env.sample_actions(action);
      env.step(action, out);
      hash = mix(mix(hash, out.obs), out.reward);
      hash = mix(mix(mix(hash, out.terminated[0]), out.truncated[0]), out.info);
      total += out.reward[0];
      ++steps;
    }
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  std::printf("%s\t%ld\t%a\t%.0f\t%016llx\n", id.c_str(), steps, total, static_cast<double>(steps) / seconds.count(),
              static_cast<unsigned long long>(hash));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s plain|fused ID...\n", argv[0]);
    return 2;
  }
  try {
    for (int i = 2; i < argc; ++i) play(argv[i], argv[1]);
  } catch (const mjenv::Error& error) {
    std::fprintf(stderr, "%s: %s\n", mjenv_status_name(error.status), error.what());
    return 1;
  }
}
