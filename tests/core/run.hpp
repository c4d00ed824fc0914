// What each file tests; 0 if all is well.
#pragma once

#include <string>

// The text of a model in tests/core/odd.
std::string odd_model(const std::string& name);

int run_chars();
int run_collisions();
int run_cpus();
int run_failures();
int run_forks();
int run_info();
int run_lanes(bool few);  // few: with a fifth of the states, for emulators
int run_levers();
int run_numpy();
int run_worker();
