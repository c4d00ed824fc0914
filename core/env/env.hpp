// An environment: rows of state, and the workers that step them.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <vector>

#include "engine/work.hpp"
#include "error.hpp"
#include "task/options.hpp"
#include "system/pool.hpp"
#include "task/robot.hpp"

namespace mjenv::core {

// Where a call writes one row's outputs: element `index` of arrays laid out for `rows`.
struct Place {
  const mjenv_batch* out;  // null: nowhere
  std::int64_t rows, index;
};

class Env {
 public:
  Env(const Options& options, std::int64_t rows);
  ~Env();

  std::int64_t rows() const { return static_cast<std::int64_t>(heads_.size()); }
  std::int64_t frame_skip() const { return task_.frame_skip; }
  const Options& options() const { return options_; }
  const Model& model() const { return *task_.model; }
  const std::shared_ptr<const Model>& shared_model() const { return task_.model; }
  const Camera& camera() const { return task_.camera; }
  const std::vector<Field>& fields(mjenv_role role) const;
  const std::vector<double>& low(mjenv_role role) const { return space(role).low; }
  const std::vector<double>& high(mjenv_role role) const { return space(role).high; }

  void seed(const std::uint64_t* seeds, const std::uint8_t* mask);
  void seed(std::int64_t row, const std::uint32_t* digits, std::size_t count);
  void get_stream(std::int64_t row, std::uint64_t* words, std::size_t count) const;
  void set_stream(std::int64_t row, const std::uint64_t* words, std::size_t count);

  void reset(const std::uint8_t* mask, const mjenv_batch* out);
  void step(const void* action, std::size_t count, mjenv_dtype dtype, const mjenv_batch* out);
  void rollout(const void* action, std::int64_t steps, std::size_t count, mjenv_dtype dtype, const mjenv_batch* out);
  void observe(const mjenv_batch& out);

  void send(const std::int64_t* rows, std::size_t row_count, const void* action, std::size_t count, mjenv_dtype dtype,
            const mjenv_batch* out);
  // Reports the rows before it fails for those that MuJoCo failed in.
  void receive(std::size_t least, std::int64_t* rows, std::size_t capacity, std::size_t* count);

  void seed_actions(std::uint64_t seed);
  void sample_actions(float* action, std::size_t count);

  // The array under MuJoCo's name, ready to be read for that row.
  const Array& array(std::int64_t row, const std::string& name);
  // Calls look(mjData) with the row's mjData as Gymnasium has it after the last step; look changes nothing in it.
  void show(std::int64_t row, const std::function<void(mjData_*)>& look);
  void set_state(std::int64_t row, const double* qpos, std::size_t nq, const double* qvel, std::size_t nv);
  void simulate(std::int64_t row, const double* ctrl, std::size_t count, std::int64_t frames);

  void copy_row(std::int64_t from, const std::uint8_t* to_mask);
  std::size_t snapshot_size(std::int64_t row) const;
  void snapshot(std::int64_t row, void* image) const;
  void restore(std::int64_t row, const void* image, std::size_t size);

 private:
  enum class Autoreset { disabled, next_step, same_step };
  // How the derived arrays that belong to a row came about. After `set`, a forward in mid-episode, forces are still
  // those of the step before it.
  enum class Origin : std::uint8_t { cleared, forward, step, set };
  // A row is its head and a record of doubles: the state, the state before the last evaluation (after `set` the last
  // step), what the task carries, and after `set` the qpos and qacc_warmstart that the forward changed.
  struct Head {
    Rng rng;
    std::int64_t steps = 0;
    std::int32_t worker = 0;  // that computed it last
    Origin origin = Origin::cleared;
    bool seeded = false, ready = false, ended = false;
  };
  // What went wrong in rows that were worked on together.
  struct Failures {
    mjenv_status status = MJENV_OK;  // memory before physics
    std::string text;

    void add(mjenv_status kind, const std::string& what) noexcept;
    // Fails if there are any, and forgets them.
    void raise();
  };
  struct Worker {
    Worker(std::int32_t i, std::shared_ptr<const Model> model, int frame_skip)
        : index(i), work(std::move(model), frame_skip) {}
    const std::int32_t index;
    Work work;
    std::atomic<std::int64_t> next{0};  // of the worker's block: the first row that nobody has taken
    std::int64_t resident = -1;         // the row whose derived arrays the work space holds; -1: none
    std::vector<double> scratch;        // a state or an observation in the making
    std::vector<Array> arrays;          // of its mjData
    std::vector<const Array*> exported;
    Failures failures;
  };
  struct Flags {
    bool terminated, truncated;
  };
  struct Space {
    std::vector<double> low, high;
  };
  // Rows between send and receive.
  struct Async {
    std::mutex mutex;
    std::condition_variable sent, done;
    std::vector<std::int64_t> waiting;  // to be stepped: a ring with room for all rows, from next on
    std::size_t next = 0, waiting_count = 0;
    std::vector<std::int64_t> ready;  // stepped, not yet reported
    std::vector<std::uint8_t> under_way;
    std::vector<double> action;  // [rows][nu], wide enough for either dtype
    std::vector<mjenv_dtype> dtype;
    std::size_t count = 0;  // under way
    bool open = false;
    mjenv_batch out{};
    Failures failures;
  };
  struct Stamp;
  struct RowStamp;

  Options options_;
  Task task_;
  std::int64_t max_episode_steps_;
  bool strict_, ends_on_divergence_, completes_ = false;
  Autoreset autoreset_;
  StateLayout layout_;
  std::vector<Field> observation_, action_, info_, reset_info_, reward_, structure_, data_, model_fields_, arrays_;
  Space observation_space_, action_space_;
  std::int64_t observation_count_ = 0;

  std::vector<Head> heads_;
  std::vector<double> records_;
  std::size_t record_size_ = 0;
  mutable std::uint64_t owner_ = 0;  // of images; computed once
  Rng action_rng_;
  bool actions_seeded_ = false;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::unique_ptr<Async> async_ = std::make_unique<Async>();
  std::unique_ptr<Pool> pool_;

  void describe(Worker& worker);
  void export_arrays(Worker& worker);
  const Space& space(mjenv_role role) const { return role == MJENV_ACTION ? action_space_ : observation_space_; }
  double* state(std::int64_t row) { return records_.data() + static_cast<std::size_t>(row) * record_size_; }
  double* before(std::int64_t row) { return state(row) + layout_.size; }
  double* carried(std::int64_t row) { return before(row) + layout_.size; }
  double* changed(std::int64_t row) { return carried(row) + task_.carry_count; }
  const double* record(std::int64_t row) const {
    return records_.data() + static_cast<std::size_t>(row) * record_size_;
  }

  void check_row(std::int64_t row) const;
  void check_settled() const;
  void check_out(const mjenv_batch* out, std::int64_t rows, const std::vector<Field>& info) const;
  void check_steppable(std::int64_t row, bool resets) const;
  void check_finite(std::int64_t row, const Action& action) const;
  // In same_step a row that could not be reset, or that a rollout ended.
  bool awaits_reset(std::int64_t row) const { return autoreset_ != Autoreset::disabled && heads_[row].ended; }

  // Calls body(worker, row) for all rows: each worker for a block of its own, then for what is left of the others'
  // blocks. A failing row does not stop the others.
  template <typename Body>
  void for_rows(const Body& body);
  template <typename Body>
  void attempt(Worker& worker, std::int64_t row, const Body& body) noexcept;

  void begin_episode(Worker& worker, std::int64_t row);
  void step_row(Worker& worker, std::int64_t row, const Action& action, const Place& place);
  Flags play(Worker& worker, std::int64_t row, const Action& action, const Place& place);
  void stay(const Flags& flags, const Place& place) const;
  void commit(Worker& worker, std::int64_t row, Origin origin);
  Worker& resident_worker(std::int64_t row);
  void serve(Worker& worker, const std::function<bool()>& enough);

  void write_observation(Worker& worker, void* to, const Place& place);
  void write_reset(Worker& worker, double* info, const Place& place);
  void write_arrays(Worker& worker, const Place& place);
  std::uint64_t owner() const;
  RowStamp stamp_of(std::int64_t row) const;
};

template <typename Body>
void Env::attempt(Worker& worker, std::int64_t row, const Body& body) noexcept {
  const auto failed = [&](mjenv_status status, const char* what) {
    worker.resident = -1;
    try {
      worker.failures.add(status, in_row(row, what));
    } catch (const std::exception&) {  // no memory for the text
      worker.failures.add(MJENV_E_MEMORY, "");
    }
  };
  try {
    body(worker, row);
  } catch (const std::bad_alloc&) {
    failed(MJENV_E_MEMORY, "out of memory");
  } catch (const std::exception& error) {
    failed(MJENV_E_PHYSICS, error.what());
  }
}

}  // namespace mjenv::core
