// The spaces, fields and exported arrays of an environment. They never change.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/work.hpp"
#include "env/action_transform.hpp"
#include "env/frames.hpp"
#include "task/task.hpp"

namespace mjenv::core {

class Schema {
 public:
  // The options "arrays" and "max_contacts" say which arrays of mjData are exported.
  Schema(const Task& task, const Frames& frames, const ActionTransform& transform, const Options& options,
         const Work& work);

  // Throws if there is no such role.
  const std::vector<Field>& fields(mjenv_role role) const;
  // How many numbers the role's fields have in one row. Not for MJENV_ROLE_DATA and _MODEL, which have no offsets.
  std::int64_t count(mjenv_role role) const;
  const Space& space(mjenv_role role) const { return role == MJENV_ROLE_ACTION ? action_space_ : frames_.space(); }
  std::int64_t observation_count() const { return observation_count_; }
  // The indices of the exported arrays in Work::arrays().
  const std::vector<std::size_t>& exported() const { return exported_; }
  // How many contacts the exported arrays can hold; 0: as many as core::max_contacts says.
  std::int64_t max_contacts() const { return max_contacts_; }
  // True if some exported arrays are up to date only after Work::complete.
  bool exports_on_demand() const { return exports_on_demand_; }
  // Throws unless the batch has exactly `rows` elements, its dtype and the counts of its arrays fit this environment,
  // and info is given if final_info is. A batch whose struct_size is 0 has no arrays, and passes.
  void check(const mjenv_batch& out, std::int64_t rows) const { check(out, rows, observation_count_); }
  // The same for a batch whose observations have this count.
  void check(const mjenv_batch& out, std::int64_t rows, std::int64_t observation_count) const;

 private:
  const Frames& frames_;  // has the fields and the space of the observation
  Fields fields_;
  Space action_space_;
  std::int64_t observation_count_ = 0, max_contacts_ = 0;
  std::vector<std::size_t> exported_;
  bool exports_on_demand_ = false;

  void choose_exported(const std::string& names, const std::vector<Array>& arrays);
};

}  // namespace mjenv::core
