// What each file tests; 0 if all is well.
#pragma once

#include <memory>
#include <string>

namespace mjenv::core {
class Model;
}

// Steps random states of a model in lanes and one by one: so many of each kind, with each number of lanes. Says where they
// part, "" if nowhere.
std::string compare_in_lanes(const std::shared_ptr<const mjenv::core::Model>& model, int rows);

// The text of a model in tests/core/odd.
std::string odd_model(const std::string& name);

int run_chars();
int run_collisions();
int run_cpus();
int run_failures();
int run_forces();
int run_forks();
int run_implicit();
int run_info();
int run_lanes(bool few);  // few: with a fifth of the states, for emulators
int run_levers();
int run_numpy();
int run_random_models(int argc, char** argv);
int run_rays();
int run_search();
int run_stages();
int run_twins();
int run_worker();
