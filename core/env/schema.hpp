// What an environment says about its rows: spaces, fields and exported arrays. It never changes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/work.hpp"
#include "task/robot.hpp"

namespace mjenv::core {

struct Space {
  std::vector<double> low, high;
};

class Schema {
 public:
  // Learns the fields from a first reset and a first step, played in `work`. exported: names of mjData arrays,
  // separated by blanks.
  Schema(const Task& task, const std::string& exported, Work& work);

  const std::vector<Field>& fields(mjenv_role role) const;
  // Numbers in one row of the role's fields.
  std::int64_t count(mjenv_role role) const;
  const Space& space(mjenv_role role) const { return role == MJENV_ROLE_ACTION ? action_space_ : observation_space_; }
  std::int64_t observation_count() const { return observation_count_; }
  // Indices of the exported arrays in Work::arrays().
  const std::vector<std::size_t>& exported() const { return exported_; }
  // Some exported arrays hold current values only after Work::complete.
  bool exports_on_demand() const { return exports_on_demand_; }
  // Checks the counts and the dtype of a caller's batch that is laid out for `rows`.
  void check(const mjenv_batch& out, std::int64_t rows) const;

 private:
  std::vector<Field> observation_, action_, info_, reset_info_, reward_, structure_, data_, model_, arrays_;
  Space observation_space_, action_space_;
  std::int64_t observation_count_ = 0;
  std::vector<std::size_t> exported_;
  bool exports_on_demand_ = false;

  void learn(const Task& task, Work& work);
  void take(const Described& fields);
  void bound_observation();
  void choose(const std::string& exported, const std::vector<Array>& arrays);
};

}  // namespace mjenv::core
