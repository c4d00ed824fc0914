// Usage: test_core TOPIC [TESTS]: a topic, or those of its tests whose names fit a pattern such as test_o*. One program, since each that holds the core is optimised as a whole when it is linked.
#include "run.hpp"

#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string_view>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

std::string odd_model(const std::string& name) {
  std::ifstream file(PROJECT_FOLDER "/tests/core/odd/" + name);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

int main(int argc, char** argv) {
  const std::string_view topic = argc > 1 ? argv[1] : "";
#ifdef LANES
  if (topic == "random-models") return run_random_models(argc, argv);
#endif
  if (argc == 3) cmocka_set_test_filter(argv[2]);
  if (topic == "chars") return run_chars();
  if (topic == "cpus") return run_cpus();
  if (topic == "failures") return run_failures();
  if (topic == "forks") return run_forks();
  if (topic == "info") return run_info();
#ifdef LANES
  if (topic == "collisions") return run_collisions();
  if (topic == "forces") return run_forces();
  if (topic == "implicit") return run_implicit();
  if (topic == "lanes") return run_lanes(false);
  if (topic == "few-lanes") return run_lanes(true);
  if (topic == "rays") return run_rays();
  if (topic == "search") return run_search();
  if (topic == "stages") return run_stages();
#endif
#ifdef TWINS
  if (topic == "twins") return run_twins();
#endif
  if (topic == "levers") return run_levers();
  if (topic == "numpy") return run_numpy();
  if (topic == "worker") return run_worker();
  std::fputs(
      "usage: test_core TOPIC [TESTS], where TOPIC is chars, collisions, cpus, failures, forces, forks, implicit,\n"
      "       info, lanes, few-lanes, levers, numpy, rays, search, stages, twins or worker\n"
      "       test_core random-models [FIRST COUNT | print SEED]\n",
      stderr);
  return 2;
}
