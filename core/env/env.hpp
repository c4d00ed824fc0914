// An environment: its task, its rows, and the workers that step the rows.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "env/episodes.hpp"
#include "env/image.hpp"
#include "env/lane_choice.hpp"
#include "env/order.hpp"
#include "env/pipeline.hpp"
#include "env/rows.hpp"
#include "env/schema.hpp"
#include "env/workers.hpp"
#include "task/options.hpp"
#include "task/task.hpp"

namespace mjenv::core {

// Each mjenv_env handle holds an Env. It checks the arguments of a call, then lets its members below do the work.
class Env {
 public:
  Env(const Options& options, std::int64_t rows);
  ~Env();
  Env(const Env&) = delete;
  Env& operator=(const Env&) = delete;

  std::int64_t rows() const { return rows_.count(); }
  std::int64_t frame_skip() const { return task_.frame_skip; }
  const Options& options() const { return options_; }
  const Schema& schema() const { return schema_; }
  const Model& model() const { return *task_.model; }
  const std::shared_ptr<const Model>& shared_model() const { return task_.model; }
  const mjenv_task_camera& camera() const { return task_.camera; }
  // How many rows each thread steps together, with the values and forces that rows have now.
  LaneChoice lanes() const;

  // A mask selects the rows whose element is not 0; a null mask selects all rows.
  void seed(const std::uint64_t* seeds, const std::uint8_t* mask);
  // digits: 32-bit digits of the seed, the least significant first.
  void seed(std::int64_t row, const std::uint32_t* digits, std::size_t count);
  // words: 4 or 6, as mjenv_get_stream lays them out.
  void get_stream(std::int64_t row, std::uint64_t* words, std::size_t count) const;
  void set_stream(std::int64_t row, const std::uint64_t* words, std::size_t count);

  void reset(const std::uint8_t* mask, const mjenv_batch& out);
  void step(const std::uint8_t* mask, const Action& actions, const mjenv_batch& out);
  void rollout(const Action& actions, std::int64_t steps, const mjenv_batch& out);
  void observe(const mjenv_batch& out);

  void send(const std::int64_t* rows, std::size_t row_count, const Action& actions);
  void receive(std::size_t least, double timeout, std::int64_t* rows, std::size_t capacity, std::size_t* count,
               const mjenv_batch& out);

  void seed_actions(std::uint64_t seed);
  void sample_actions(float* action, std::size_t count);

  // The array of mjModel, or of the row's mjData, with this MuJoCo name. It is valid until the next call.
  const Array& array(std::int64_t row, const std::string& name);
  // Calls draw with an mjModel and an mjData that equal Gymnasium's in the row's present state. draw must not change
  // them.
  void show(std::int64_t row, const std::function<void(const mjModel_&, mjData_*)>& draw);
  void set_state(std::int64_t row, const double* qpos, std::size_t nq, const double* qvel, std::size_t nv);
  // Writes an array of the row's state or mjModel, or an input of its mjData (qfrc_applied, mocap_pos, ...:
  // engine/own_arrays.hpp). row may be MJENV_ALL_ROWS: then all rows get the same values. With a mask, values has a
  // part for each row, and the parts of rows that are not selected are not read. count: how many numbers values has,
  // all parts together.
  void write(std::int64_t row, const std::string& array, const double* values, std::size_t count);
  void write(const std::uint8_t* mask, const std::string& array, const double* values, std::size_t count);
  // Calls mj_setConst. row may be MJENV_ALL_ROWS.
  void set_constants(std::int64_t row);
  void simulate(std::int64_t row, const Action& ctrl, std::int64_t frames);

  // These replace what resets draw, and the noise, delays and pushes. perturbation: null for none.
  void randomize(const mjenv_randomization* items, std::size_t count);
  void perturb(const mjenv_perturbation* perturbation);

  void copy_row(std::int64_t from, const std::uint8_t* to_mask);
  std::size_t snapshot_size(std::int64_t row) const;
  void snapshot(std::int64_t row, void* image) const;
  void restore(std::int64_t row, const void* image, std::size_t size);

 private:
  Options options_;
  Task task_;
  LaneChoice lanes_;
  Workers workers_;
  Schema schema_;
  Rows rows_;
  Order order_;
  Randomization randomization_;
  Perturbation perturbation_;
  Episodes episodes_;
  std::unique_ptr<Pipeline> pipeline_;
  mutable std::optional<Identity> identity_;  // computed when it is first needed
  Rng action_rng_;
  bool actions_seeded_ = false;
  Array own_array_;  // what array() returned last, if it is a row's own

  const Identity& identity() const;
  void forget_observation(std::int64_t row);
  void end_pushes();
  // Throws while rows are under way between send and receive.
  void check_settled() const;
  // Writes to each row the values that values_of(row) points to; null: none. count: how many each row gets.
  void write(const std::string& array, std::size_t count, const std::function<const double*(std::int64_t)>& values_of);
  template <typename Body>
  void for_each_written(const std::function<const double*(std::int64_t)>& values_of, const Body& body) const;
  // Gives each row its own copy of these arrays.
  void make_own(const std::vector<std::string>& arrays);
  void prepare_workers();
  void prepare_constants();
  void check_actions(const Action& actions, std::int64_t actions_per_row) const;
};

}  // namespace mjenv::core
