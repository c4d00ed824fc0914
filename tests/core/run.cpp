// Usage: test_core TOPIC. One program, since each that holds the core is optimised as a whole when it is linked.
#include "run.hpp"

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string_view>

std::string odd_model(const std::string& name) {
  std::ifstream file(PROJECT_FOLDER "/tests/core/odd/" + name);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

int main(int argc, char** argv) {
  const std::string_view topic = argc == 2 ? argv[1] : "";
  if (topic == "chars") return run_chars();
  if (topic == "cpus") return run_cpus();
  if (topic == "failures") return run_failures();
  if (topic == "forks") return run_forks();
  if (topic == "info") return run_info();
#ifdef LANES
  if (topic == "lanes") return run_lanes(false);
  if (topic == "few-lanes") return run_lanes(true);
#endif
  if (topic == "levers") return run_levers();
  if (topic == "numpy") return run_numpy();
  if (topic == "worker") return run_worker();
  std::fputs("usage: test_core chars|cpus|failures|forks|info|lanes|few-lanes|levers|numpy|worker\n", stderr);
  return 2;
}
