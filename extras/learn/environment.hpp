// An environment of libmjenv, which is called through the functions that the program has passed (mjenv_learn_calls).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "mjenv/learn.h"

namespace mjenv::learn {

// What a learner needs to know of the observation space and the action space: counts and bounds.
struct Spaces {
  std::size_t observations = 0, actuators = 0;
  std::vector<double> low, high;  // [actuators]

  // Throws if a bound of the action is infinite. name_of: of a number of the action; null: unknown.
  Spaces(const mjenv_space& observation, const mjenv_space& action,
         const std::function<std::string(std::size_t)>& name_of = nullptr);
  bool operator==(const Spaces& other) const {
    return observations == other.observations && low == other.low && high == other.high;
  }
};

// A term of the observation: one of the named parts that stand one after the other.
struct Term {
  std::string name;
  std::size_t count;
};
using Terms = std::vector<Term>;

// The outputs of a step.
struct Outcome {
  const double *obs, *final_obs, *reward;
  const std::uint8_t *terminated, *truncated;
};

class Environment {
 public:
  // autoreset_mode: the value that the environment's option of this name must have.
  Environment(const mjenv_learn_calls& calls, mjenv_env* env, const char* autoreset_mode);

  const Spaces& spaces() const { return spaces_; }
  std::int64_t rows() const { return rows_; }
  Terms terms() const;  // of the observation
  Outcome outcome() const {
    return {obs_.data(), final_obs_.data(), reward_.data(), terminated_.data(), truncated_.data()};
  }

  // Masks are [rows]; null: all rows.
  void seed(const std::vector<std::uint64_t>& seeds, const std::uint8_t* mask = nullptr);
  void reset(const std::uint8_t* mask = nullptr);
  void step(const std::vector<float>& actions, const std::uint8_t* mask = nullptr);

  // The image of a row, or of all rows.
  void save(std::vector<std::byte>& image, std::int64_t row = MJENV_ALL_ROWS) const;
  void restore(const std::byte* image, std::size_t size, std::int64_t row = MJENV_ALL_ROWS);

 private:
  mjenv_learn_calls calls_;
  mjenv_env* env_;
  std::int64_t rows_ = 0;
  Spaces spaces_;
  std::vector<double> obs_, final_obs_, reward_;
  std::vector<std::uint8_t> terminated_, truncated_;
  mjenv_batch batch_;

  void check(mjenv_status status) const;
  // The name of number i of an action.
  std::string action_name(std::size_t i) const;
  mjenv_space space(mjenv_role role) const;
};

}  // namespace mjenv::learn
