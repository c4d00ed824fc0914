// An environment: rows of state, and the one work space in which they are simulated.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/work.hpp"
#include "options.hpp"
#include "robot.hpp"

namespace mjenv {

class Env {
 public:
  Env(const Options& options, std::int64_t rows);

  std::int64_t rows() const { return static_cast<std::int64_t>(heads_.size()); }
  std::int64_t frame_skip() const { return task_.frame_skip; }
  const Options& options() const { return options_; }
  const Model& model() const { return *task_.model; }
  const std::vector<Field>& fields(mjenv_role role) const;
  const std::vector<double>& low(mjenv_role role) const { return space(role).low; }
  const std::vector<double>& high(mjenv_role role) const { return space(role).high; }

  void seed(const std::uint64_t* seeds, const std::uint8_t* mask);
  void seed(std::int64_t row, const std::uint32_t* digits, std::size_t count);
  void get_stream(std::int64_t row, std::uint64_t* words, std::size_t count) const;
  void set_stream(std::int64_t row, const std::uint64_t* words, std::size_t count);
  void reset(const std::uint8_t* mask, const mjenv_batch* out);
  void step(const void* action, std::size_t count, mjenv_dtype dtype, const mjenv_batch* out);
  void observe(const mjenv_batch& out);

  void seed_actions(std::uint64_t seed) { action_rng_ = Rng::from_seed(seed), actions_seeded_ = true; }
  void sample_actions(float* action, std::size_t count);

  // The array under MuJoCo's name, ready to be read for that row.
  const Array& array(std::int64_t row, const std::string& name);
  void set_state(std::int64_t row, const double* qpos, std::size_t nq, const double* qvel, std::size_t nv);

  void simulate(std::int64_t row, const double* ctrl, std::size_t count, std::int64_t frames);

  void check_row(std::int64_t row) const;
  std::size_t snapshot_size() const;
  void snapshot(std::int64_t row, void* image) const;
  void restore(std::int64_t row, const void* image, std::size_t size);

 private:
  // How the derived arrays that belong to a row came about.
  enum class Origin : std::uint8_t { cleared, forward, step };
  struct Head {
    Rng rng;
    std::int64_t steps = 0;
    Origin origin = Origin::cleared;
    bool seeded = false, ready = false, ended = false;
  };
  struct Space {
    std::vector<double> low, high;
  };
  struct Stamp;

  Options options_;
  Task task_;
  Work work_;
  std::int64_t max_episode_steps_;
  bool strict_;
  std::vector<Array> data_arrays_;
  std::vector<Field> observation_, action_, info_, reset_info_, reward_, structure_, data_, model_fields_;
  Space observation_space_, action_space_;
  std::int64_t observation_count_ = 0;

  // A row: its head, and a record of doubles: the state, the state before the last evaluation, what the task carries.
  std::vector<Head> heads_;
  std::vector<double> records_;
  std::size_t record_size_ = 0;
  std::int64_t resident_ = -1;       // the row whose derived arrays the work space holds; -1: none
  std::vector<double> scratch_;      // a record or an observation in the making
  mutable std::uint64_t owner_ = 0;  // of images; computed once
  Rng action_rng_;
  bool actions_seeded_ = false;

  void describe();
  const Space& space(mjenv_role role) const { return role == MJENV_ACTION ? action_space_ : observation_space_; }
  double* state(std::int64_t row) { return records_.data() + static_cast<std::size_t>(row) * record_size_; }
  double* before(std::int64_t row) { return state(row) + work_.layout().size; }
  double* carried(std::int64_t row) { return before(row) + work_.layout().size; }
  const double* record(std::int64_t row) const {
    return records_.data() + static_cast<std::size_t>(row) * record_size_;
  }

  void check(const mjenv_batch& out, const std::vector<Field>& info) const;
  void check_actions(const void* action, mjenv_dtype dtype) const;
  void make_resident(std::int64_t row);
  void commit(std::int64_t row, Origin origin);
  void reset_row(std::int64_t row, const mjenv_batch* out);
  void step_row(std::int64_t row, const Action& action, const mjenv_batch* out);
  void write_observation(std::int64_t row, const mjenv_batch& out);
  Stamp stamp() const;
};

}  // namespace mjenv
