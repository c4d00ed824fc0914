// An environment: its task, its rows, and the workers that step the rows.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/lanes/frame/stepper.hpp"
#include "env/episodes.hpp"
#include "env/image.hpp"
#include "env/lane_choice.hpp"
#include "env/order.hpp"
#include "env/pipeline.hpp"
#include "env/rows.hpp"
#include "env/schema.hpp"
#include "env/selection.hpp"
#include "env/workers.hpp"
#include "task/options.hpp"
#include "task/task.hpp"

namespace mjenv::core {

// What an mjenv_env handle holds. An Env checks the arguments of a call, and its members below do the work.
class Env {
 public:
  Env(const Options& options, std::int64_t rows);
  ~Env();
  Env(const Env&) = delete;
  Env& operator=(const Env&) = delete;

  std::int64_t rows() const { return rows_.count(); }
  int threads() const { return static_cast<int>(workers_.threads()); }
  std::int64_t frame_skip() const { return task_.frame_skip; }
  const Options& options() const { return options_; }
  const Schema& schema() const { return schema_; }
  const Model& model() const { return *task_.model; }
  const std::shared_ptr<const Model>& shared_model() const { return task_.model; }
  const mjenv_task_camera& camera() const { return task_.camera; }
  // How many rows each thread steps together. This does not change while the environment lives.
  const LaneChoice& lanes() const { return lanes_; }
  std::string lane_stages() const { return lanes::stage_lines(*task_.model); }

  Selection masked(const std::uint8_t* mask) const { return {mask, 0, rows()}; }
  Selection only(std::int64_t row) const { return rows_.check(row), Selection{nullptr, row, 1}; }

  // seeds: for each row, the words of an integer, the least significant first. count: of the words of all seeds.
  void seed(const Selection& selected, const std::uint64_t* seeds, std::int64_t count);
  void compute_reward(const double* achieved, const double* desired, std::int64_t count, double* rewards,
                      std::int64_t reward_count) const;
  // count: 4, 6, or 627 for RandomState. words: as mjenv_get_stream lays them out.
  void get_stream(std::int64_t row, std::uint64_t* words, std::int64_t count) const;
  void set_stream(std::int64_t row, const std::uint64_t* words, std::int64_t count);

  // A null mask selects all rows.
  void reset(const std::uint8_t* mask, const mjenv_batch& out);
  void step(const std::uint8_t* mask, const Action& actions, const mjenv_batch& out);
  void rollout(const Action& actions, std::int64_t steps, const mjenv_batch& out);
  void observe(const mjenv_batch& out);
  void observe(std::int64_t row, const mjenv_batch& out);

  // The parts of resets and steps of a physics_only task, whose outputs the caller computes. ctrl: null, or
  // what the caller has made of the actions. given: what the caller has computed; null: nothing.
  void begin(const std::uint8_t* mask, const double* qpos, std::int64_t nq, const double* qvel, std::int64_t nv,
             const mjenv_batch& out);
  void act(const std::uint8_t* mask, const Action& actions, void* seen);
  void advance(const std::uint8_t* mask, const Action& actions, const double* ctrl, std::int64_t ctrl_count,
               const mjenv_batch& out);
  void finish(const std::uint8_t* mask, const mjenv_batch* given, const mjenv_batch& out);

  void send(const std::int64_t* rows, std::int64_t row_count, const Action& actions);
  void receive(std::int64_t least, double timeout, std::int64_t* rows, std::int64_t capacity, std::int64_t* count,
               const mjenv_batch& out);

  void seed_actions(std::uint64_t seed);
  void sample_actions(float* action, std::int64_t count);

  // The array with this name: of the row's mjModel or mjData (MuJoCo's name), a live parameter ("parameters.speed") or
  // the parameters of a draw ("draws[0]"). The result is valid until the next call.
  const Array& array(std::int64_t row, const std::string& name);
  // Reads the array of all rows: values[rows][each], where each is the array's size.
  void read(const std::string& name, double* values, std::size_t each);
  // Keeps the array in the caller's memory, in place of memory that it had; null: no longer.
  void mirror(std::int64_t row, const std::string& name, std::byte* values, std::int64_t bytes);
  // Calls body. First takes over what the caller has written in that memory; at the end brings it up to date.
  template <typename Body>
  void with_mirrors(const Body& body);
  // Calls draw with the mjModel and mjData that Gymnasium would have in the row's present state. draw must not change
  // them.
  void show(std::int64_t row, const std::function<void(const mjModel_&, mjData_*)>& draw);
  void set_state(std::int64_t row, const double* qpos, std::int64_t nq, const double* qvel, std::int64_t nv);
  // Calls mj_resetData.
  void reset_data(const Selection& selected);
  // Writes an array of the row's state or mjModel, an input of its mjData (engine/own_array.hpp), a live parameter or
  // the parameters of a draw. count: the array's size, for the same values in every selected row, or this size times
  // the number of rows of the selection, whether its mask selects them or not.
  void write(const Selection& selected, const std::string& array, const double* values, std::int64_t count);
  // Calls mj_setConst.
  void set_constants(const Selection& selected);
  void simulate(std::int64_t row, const Action& ctrl, std::int64_t frames);

  // Replaces the parts of the document of draws, noise, delays and pushes that the text has.
  void randomize(const std::string& text);
  const std::string& randomization() const { return document_.text(); }

  void copy_row(const std::uint8_t* mask, std::int64_t from);
  std::int64_t snapshot_size(std::int64_t row) const;
  void snapshot(std::int64_t row, void* image) const;
  void restore(std::int64_t row, const void* image, std::size_t size);

 private:
  // Numbers that each row stores as doubles: those of a part, from the one with the index `first` on.
  struct Numbers {
    Array array;  // without data
    Part part;
    std::size_t first;
  };

  // An array in the caller's memory.
  struct Mirror {
    std::int64_t row;
    std::string name;
    mjenv_dtype type;
    std::byte* values;
    std::vector<std::byte> shown;  // what the caller has not written
    // Where the array is: in the row's state; in mjData, with this index, or else in mjModel.
    std::optional<Numbers> numbers;
    std::optional<std::size_t> index;
    unsigned part;  // of mjData (Lag)
    // Where it is among the rows' own arrays, of which the first `searched` have been searched.
    std::optional<std::size_t> own = {};
    std::size_t searched = 0;
    std::size_t used = std::numeric_limits<std::size_t>::max();  // the bytes of `shown` behind these are 0
  };

  // Those up to pipeline_ are made in this order, each from those before it.
  Options options_;
  Task task_;
  int threads_;
  LaneChoice lanes_;
  Frames frames_;
  ActionTransform transform_;
  Rows rows_;
  Workers workers_;
  Schema schema_;
  Order order_;
  DrawDocument document_;
  Randomization randomization_;
  Perturbation perturbation_;
  Episodes episodes_;
  std::unique_ptr<Pipeline> pipeline_;
  mutable std::optional<Identity> identity_;  // computed when it is first needed
  Rng action_rng_;
  bool actions_seeded_ = false;
  Array own_array_;                     // the last result of array(), if it was an array of the row's own
  std::vector<std::byte> whole_array_;  // its values, if rows own only a part of it
  std::vector<Mirror> mirrors_;

  const Identity& identity() const;
  std::optional<Numbers> numbers(const std::string& name) const;
  // A write that cannot fail any more: rows have room for what they keep, and the workers that hold them have views of
  // their values.
  struct Writing {
    Selection selected;
    std::string array;
    std::optional<Numbers> target;  // or else an own array
    const double* values;
    std::int64_t each, stride;  // stride: from the values of one row to those of the next
  };
  // Throws unless `write` can be done, and changes nothing that can be read.
  Writing prepare(const Selection& selected, const std::string& array, const double* values, std::int64_t count);
  void commit(const Writing& writing);
  // The same, if readers see these numbers.
  std::optional<Numbers> shown_numbers(const std::string& name) const;
  double* at(const Numbers& numbers, std::int64_t row) { return rows_.numbers(numbers.part, row) + numbers.first; }
  // Throws unless a row can have these values.
  void check(const Numbers& numbers, const double* values) const;
  void note_write(std::int64_t row);
  void take_mirrors();
  void show_mirrors() noexcept;
  const OwnArray* own_array(Mirror& mirror) const;
  // The same as array, if no work space is needed; otherwise null.
  const Array* stored(std::int64_t row, const std::string& name);
  // Calls body(worker, row) for all rows on all threads: first with the workers that hold a row's derived arrays,
  // because computing other rows would overwrite these.
  template <typename Body>
  void for_held_rows_first(const Body& body);
  void forget_observation(std::int64_t row);
  void end_pushes();
  // Throws while rows are under way between send and receive.
  void check_received() const;
  // Throws while the caller has to finish a step or reset.
  void check_finished() const;
  // Throws in both cases.
  void check_settled() const;
  // Throws unless the caller computes the outputs of this task, and no rows are under way.
  void check_halves() const;
  // Throws if only the caller can turn actions into ctrl.
  void check_whole() const;
  void check_steppable(const std::uint8_t* mask, const Action& actions) const;
  // Calls body(team) with the turns of the selected rows, on all threads.
  template <typename Body>
  void for_teams(const std::uint8_t* mask, const Action& actions, const Action& ctrl, const mjenv_batch& out,
                 const Body& body);
  // Gives each row its own copy of these arrays.
  void make_own(const std::vector<std::string>& arrays);
  void prepare_workers();
  void prepare_constants();
  void check_actions(const Action& actions, std::int64_t actions_per_row) const;
};

template <typename Body>
void Env::with_mirrors(const Body& body) {
  take_mirrors();
  try {
    body();
  } catch (...) {
    show_mirrors();
    throw;
  }
  show_mirrors();
}

}  // namespace mjenv::core
