// Computes rows in a work space (an mjData), one row at a time.
#pragma once

#include <cstdint>
#include <functional>
#include <new>
#include <string>
#include <vector>

#include "engine/work.hpp"
#include "env/draws.hpp"
#include "env/failures.hpp"
#include "env/perturbation.hpp"
#include "env/row_constants.hpp"
#include "env/rows.hpp"
#include "env/writer.hpp"
#include "error.hpp"
#include "task/task.hpp"

namespace mjenv::core {

// The initial state that the caller gives to an episode: positions, velocities, or neither (null).
struct Initial {
  const double *qpos = nullptr, *qvel = nullptr;

  void copy_to(double* to_qpos, double* to_qvel, const StateLayout& layout) const {
    if (qpos) std::copy_n(qpos, layout.nq, to_qpos);
    if (qvel) std::copy_n(qvel, layout.nv, to_qvel);
  }
};

// Rows do not store the derived arrays of mjData (xpos, contacts, ...). These stay in the work space of the worker that
// last computed the row. If they are needed after that worker has computed another row, a worker computes them again.
class Worker {
 public:
  Worker(std::int32_t index, const Task& task);

  const std::int32_t index;
  Failures failures;

  Work& work() { return work_; }
  SimView& view() { return view_; }
  Writer& writer() { return writer_; }
  void prepare(const Schema& schema, const Frames& frames) {
    writer_.prepare(schema, frames, arrays_);
    transformed.resize(static_cast<std::size_t>(task_.action_count()));
  }

  // Whether the work space holds the row's derived arrays.
  bool holds(const Rows& rows, std::int64_t row) const { return resident_ == row && rows.worker(row) == index; }
  // Makes the work space hold the row's derived arrays, by computing them again if necessary.
  void hold(Rows& rows, std::int64_t row);
  // Does the same, and makes sure that Work::complete can compute the forces.
  void hold_forces(Rows& rows, std::int64_t row);
  // Records that the work space holds no row.
  void release() { resident_ = kNone; }
  // Call this when the row was changed without this worker: the work space no longer agrees with the row.
  void forget(std::int64_t row) {
    if (resident_ == row) release();
  }

  // Sets all rows to the state after mj_resetData; or one, whose own values stay.
  void clear(Rows& rows);
  void clear(Rows& rows, std::int64_t row);
  // Begins an episode: the task draws the initial state from rng, the randomisation draws its values, and mj_forward
  // computes the derived arrays. As with a wrapper around Gymnasium's environment, which draws after the reset, this
  // reset still has the row's old values; `adopt` gives it the drawn ones.
  // initial: replaces what the task has drawn.
  void begin(Rows& rows, std::int64_t row, const Rng& rng, const Randomization& randomization = {},
             const Initial& initial = {});
  void adopt(Rows& rows, std::int64_t row) noexcept;
  // Makes the work space ready for a step: loads the row's state and the action. If the caller has written the state or
  // own values since the last computation, first calls the callback carry. pushes: must live until commit has returned.
  void load(Rows& rows, std::int64_t row, const Action& action, const Work::Pushes* pushes = nullptr);
  // Does the same as load for a task that has before_step or before_substep, and calls before_step. random: the stream
  // for the task; it must live until the step ends.
  void begin_step(Rows& rows, std::int64_t row, const Action& action, const Work::Pushes* pushes, Random& random);
  // Calls mj_step `frames` times. The new state reaches the row in commit.
  void advance(std::int64_t frames) {
    work_.step(frames, before(), random_ && has_before_substep() ? &before_substep_ : nullptr);
  }
  // Calls the task's before_substep before an mj_step. Only after begin_step.
  void before_substep(std::int64_t substep);
  bool has_before_substep() const { return task_.calls->has_before_substep(); }
  // Where advance writes the state before the last mj_step.
  double* before() { return before_.data(); }
  // The row's stream, for a step of the task. commit saves it.
  static Random random(const Rows& rows, std::int64_t row);
  // Calls the task's step. commit saves what it writes.
  mjenv_outcome step(Rows& rows, std::int64_t row, const Action& action, Random& random);
  // Saves the state after `step` to the row.
  void commit(Rows& rows, std::int64_t row);
  void commit(Rows& rows, std::int64_t row, Random& random);
  // Allocates what begin and load need if rows have arrays of their own; they allocate nothing themselves.
  void prepare(const OwnArrays& arrays);
  // Call this when the layout of the rows' arrays has changed. If `prepare` is not called afterwards, or throws, the
  // next reset or step calls it.
  void forget_layout() { is_prepared_ = false; }
  // Call its prepare() if mj_setConst was called for a row, and its prepare_draw() if resets call mj_setConst.
  RowConstants& constants() { return constants_; }
  // Scratch memory for one step of a perturbed row (Perturbation::make_step).
  Perturbation::Step perturbed;
  // Scratch memory for an action (ActionTransform::apply).
  std::vector<double> transformed;

  // Calls RowConstants::set for a row, which this worker need not hold.
  std::vector<std::string> set_constants(Rows& rows, std::int64_t row);
  // Replaces qpos and qvel as Gymnasium's set_state does.
  void set_state(Rows& rows, std::int64_t row, const double* qpos, const double* qvel);

  // Calls body(). If it throws, adds the error to the failures and returns false.
  template <typename Body>
  bool attempt(std::int64_t row, const Body& body) noexcept;

  // The row's mjData array with this name, up to date. Null if mjData has no such array.
  const Array* array(Rows& rows, std::int64_t row, const std::string& name);
  // Calls draw with the mjModel and mjData that Gymnasium would have in the row's present state. draw must not change
  // them.
  void show(Rows& rows, std::int64_t row, const std::function<void(const mjModel_&, mjData_*)>& draw);

 private:
  static constexpr std::int64_t kNone = -1;

  const Task& task_;
  Work work_;
  SimView view_;
  std::int64_t resident_ = kNone;
  // The state before the mj_step or mj_forward whose result save() stores.
  std::vector<double> before_;
  Writer writer_;
  Draws draws_;
  RowConstants constants_;
  // Own values that the work space uses instead of the row's in `begin`: those with cleared inputs.
  std::vector<std::byte> inputs_;
  std::vector<double*> written_;          // mjenv_start.own
  const Work::Pushes* pushes_ = nullptr;  // those of the last step, for commit
  bool is_kicked_ = false;                // the task's step has changed the velocities
  // The stream of the current step, if it began with begin_step; otherwise null.
  Random* random_ = nullptr;
  Action action_;
  // A row's own array that the task writes. before: the values with which the last mj_step has computed.
  struct OwnValues {
    const OwnArray* array;
    bool is_force;
    // Whether MuJoCo's array is float32, so that what the task writes to `values` is converted. Otherwise, if the
    // array is of mjModel, a reset writes directly to the block that MuJoCo reads.
    bool is_converted;
    std::vector<double> values, before;
  };
  std::vector<OwnValues> own_values_;
  // False if there was no memory for own_values_, or if they belong to an older layout of the rows' arrays.
  bool is_prepared_ = true;
  std::vector<double*> controlled_, forces_of_task_;  // mjenv_outcome.own, mjenv_control.own
  const std::function<void()> take_own_ = [this] { take_own(); };
  const Work::BeforeSubstep before_substep_ = [this](std::int64_t substep) { before_substep(substep); };
  const std::vector<Array> arrays_;

  // Shows to a reset what the row keeps from older episodes: the carried numbers that stay after resets, and the live
  // parameters.
  void show_kept(Rows& rows, std::int64_t row);
  // `begin` for a task with Needs::current, whose reset can simulate.
  void begin_simulating(Rows& rows, std::int64_t row, const Rng& rng, const Randomization& randomization,
                        const Initial& initial);
  // Copies to inputs_ the float32 numbers that a reset has written. Throws if MuJoCo cannot compute with them.
  void take_own();
  // Copies to mjData the forces that the task has written. Throws if MuJoCo cannot compute with them.
  void apply_own_forces();
  void load_carried(Rows& rows, std::int64_t row) {
    std::copy_n(rows.carried(row), task_.carry_count, view_.carried());
  }
  void save(Rows& rows, std::int64_t row, Origin origin);
  // Saves a step to the row, also the own values that the task has written.
  void commit_step(Rows& rows, std::int64_t row);
  // Saves the work space to the row, without calling the callback carry: as the beginning of a new recipe, or as an
  // entry that the recipe already has.
  void store(Rows& rows, std::int64_t row, Origin origin);
  void store(Rows& rows, std::int64_t row, Entry entry);
  // Saves the inputs with which the last mj_step of a step has computed.
  void store_inputs(Rows& rows, std::int64_t row);
  // Computes an entry of the row's recipe again. The work space must hold the entries before it.
  void run(Rows& rows, std::int64_t row, Entry entry);
  // Makes the work space use the row's own values, if it has any.
  void use(Rows& rows, std::int64_t row, Entry entry = Entry::now);
  void use(const OwnArrays& arrays, const std::byte* block);
  // The row's own values, for writing, which the work space is using: it also uses the copy that a row gets by its
  // first write.
  std::byte* own_values(Rows& rows, std::int64_t row);
  // Saves an input of mjData to the row. offset: in the row's block of own values.
  void save_input(Rows& rows, std::int64_t row, std::size_t offset, const double* values, std::size_t bytes);
  void fail_row(std::int64_t row, mjenv_status status, const char* what) noexcept;
};

template <typename Body>
bool Worker::attempt(std::int64_t row, const Body& body) noexcept {
  try {
    body();
    return true;
  } catch (const std::bad_alloc&) {
    fail_row(row, MJENV_E_MEMORY, "out of memory");
  } catch (const Error& error) {
    fail_row(row, error.status(), error.what());
  } catch (const std::exception& error) {
    fail_row(row, MJENV_E_INTERNAL, error.what());
  }
  return false;
}

}  // namespace mjenv::core
