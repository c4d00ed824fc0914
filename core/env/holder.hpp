// Makes a row's mjData again, in a work space that holds one row at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/constants.hpp"
#include "engine/work.hpp"
#include "env/rows.hpp"
#include "task/task.hpp"

namespace mjenv::core {

// The derived arrays in mjData (xpos, contacts, ...) are the row's from `hold` or `store` until `release`; those
// that lag (Work::lag) only after Work::complete. Rows do not store them, but a recipe that makes them (parts.hpp).
class Holder {
 public:
  Holder(std::int32_t index, const Task& task, Rows& rows);

  const std::int32_t index;  // that of the worker

  Work& work() { return work_; }
  SimView& view() { return view_; }
  Rows& rows() { return rows_; }
  const Task& task() const { return task_; }

  // Whether the work space holds the row's derived arrays.
  bool holds(std::int64_t row) const { return resident_ == row && rows_.worker(row) == index; }
  // Makes the work space hold the row's derived arrays, by running the row's recipe if necessary.
  void hold(std::int64_t row);
  // Does the same, and makes sure that Work::complete can compute these parts (Lag).
  void hold(std::int64_t row, unsigned parts);
  // Records that the work space holds no row.
  void release() { resident_ = kNone; }
  // Call this when the row was changed without this worker: the work space no longer agrees with the row.
  void forget(std::int64_t row) {
    if (resident_ == row) release();
  }
  // Call these before and after the row's state or own values are written without this worker. If the work space holds
  // the row, it still does.
  void expect_write(std::int64_t row) {
    if (holds(row)) work_.lose();
  }
  void note_write(std::int64_t row) {
    if (holds(row)) run_last(row);
  }
  // The row's mjData array with this name, up to date. Null if mjData has no such array.
  const Array* array(std::int64_t row, const std::string& name);
  const std::vector<Array>& arrays() const { return arrays_; }
  // The array at this place in arrays(), up to date. part: part_of its name.
  const Array& array(std::int64_t row, std::size_t place, unsigned part);
  // Calls draw with the mjModel and mjData that Gymnasium would have in the row's present state. draw must not change
  // them.
  void show(std::int64_t row, const std::function<void(const mjModel_&, mjData_*)>& draw);

  // Sets all rows to the state after mj_resetData; or one, whose own values stay.
  void clear();
  void clear(std::int64_t row);
  // Replaces qpos and qvel as Gymnasium's set_state does.
  void set_state(std::int64_t row, const double* qpos, const double* qvel);
  // Does the same, but another one calls mj_forward between these two calls. Not if the callback carry may read what
  // lanes do not compute, or what mj_forward leaves of the last step.
  bool can_forward_elsewhere() const;
  void begin_set_state(std::int64_t row, const double* qpos, const double* qvel);
  void end_set_state(std::int64_t row);
  // Calls mj_setConst. Saves the constants to the row's own values, and what mj_setConst leaves in mjData (the position
  // qpos_spring) to the row's state. But if mj_setConst changes arrays that rows still share, saves nothing and returns
  // the names of these arrays. Then give each row its own, and call this again.
  std::vector<std::string> set_constants(std::int64_t row);
  // What calls mj_setConst; made when it is first needed.
  Constants& constants();

  // For resets and steps. The state before the mj_step or mj_forward whose result is stored next:
  double* before() { return before_.data(); }
  // Makes the work space use the row's own values, if it has any; or those of a block.
  void use(std::int64_t row, Entry entry = Entry::now);
  void use(const std::byte* block);
  // The row's own values, for writing, which the work space is using: it also uses the copy that a row gets by its
  // first write.
  std::byte* own_values(std::int64_t row);
  void load_carried(std::int64_t row) { std::copy_n(rows_.carried(row), task_.carry_count, view_.carried()); }
  // Saves the work space to the row, as the beginning of a new recipe. `save` first calls the callback carry.
  void save(std::int64_t row, Origin origin);
  void store(std::int64_t row, Origin origin);

 private:
  static constexpr std::int64_t kNone = -1;

  bool carries_from_last_step() const;

  const Task& task_;
  Rows& rows_;
  Work work_;
  SimView view_;
  std::int64_t resident_ = kNone;
  std::vector<double> before_;
  std::unique_ptr<Constants> constants_;
  const std::vector<Array> arrays_;

  // Computes an entry of the row's recipe again. The work space must hold the entries before it.
  void run(std::int64_t row, Entry entry);
  // Does the same for what was written after the last entry.
  void run_last(std::int64_t row);
  // Saves the work space to the row, as an entry that the recipe already has.
  void store(std::int64_t row, Entry entry);
};

}  // namespace mjenv::core
