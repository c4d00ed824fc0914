#include "env/env.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "system/cpus.hpp"
#include "error.hpp"
#include "task/registry.hpp"

namespace mjenv::core {
namespace {

constexpr std::int64_t kMostThreads = 1024;

std::int64_t total(const std::vector<Field>& fields) {
  return fields.empty() ? 0 : fields.back().offset + fields.back().count;
}

void append(std::vector<Field>& fields, const std::string& name, mjenv_type type, std::vector<std::int64_t> shape,
            std::int64_t count) {
  fields.push_back({name, "", type, std::move(shape), total(fields), count});
}

std::vector<Field> fields_of(const std::vector<Array>& arrays) {
  std::vector<Field> fields;
  for (const auto& a : arrays) fields.push_back({a.name, "", a.type, a.shape, 0, static_cast<std::int64_t>(a.count())});
  return fields;
}

// Refuses what would have the system kill the process instead of failing an allocation.
void check_memory(std::int64_t count, const char* what, std::size_t bytes_of_one) {
  const double needed = static_cast<double>(count) * static_cast<double>(bytes_of_one);
  const double present = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  if (needed > present)
    fail(MJENV_E_MEMORY, std::to_string(count) + what + " need " + number(std::ceil(needed / 1e9)) +
                             " GB; this machine has " + number(std::floor(present / 1e9)));
}

int threads_for(const Options& options, std::int64_t rows) {
  const std::int64_t chosen = options.get("num_threads").integer;
  return static_cast<int>(std::min(chosen == 0 ? usable_cpus() : chosen, rows));
}

}  // namespace

void declare_env_options(Options& options) {
  options.flag("strict", true, "refuse a non-finite action and a step after the end; Gymnasium lets them pass");
  options.text("autoreset_mode", "disabled", "when a finished row is reset: never, in its next step, in the same step",
               "disabled next_step same_step");
  options.text("on_divergence", "continue", "a row whose state diverged goes on from MuJoCo's restart, or terminates",
               "continue terminate");
  options.integer("num_threads", 1, 0, kMostThreads,
                  "threads that step rows; 1: the caller's; 0: the CPUs this process may use");
  options.flag("cpu_affinity", false, "keep each thread of the library on a CPU of its own");
  options.text("arrays", "", "mjData arrays to export with each step, separated by blanks: \"xpos sensordata\"");
}

Env::Env(const Options& options, std::int64_t rows)
    : options_(options),
      task_(build_task(options_)),
      max_episode_steps_(options_.get("max_episode_steps").integer),
      strict_(options_.get("strict").integer != 0),
      ends_on_divergence_(options_.get("on_divergence").text == "terminate"),
      autoreset_(options_.get("autoreset_mode").text == "next_step"   ? Autoreset::next_step
                 : options_.get("autoreset_mode").text == "same_step" ? Autoreset::same_step
                                                                      : Autoreset::disabled),
      layout_(*task_.model) {
  const ErrorTrap trap;
  record_size_ = 2 * layout_.size + static_cast<std::size_t>(task_.carry_count) + layout_.nq + layout_.nv;
  const int threads = threads_for(options_, rows);
  check_memory(threads, " thread(s)", task_.model->work_bytes());
  for (int i = 0; i < threads; ++i) workers_.push_back(std::make_unique<Worker>(i, task_.model, task_.frame_skip));
  describe(*workers_[0]);
  for (auto& worker : workers_) {
    worker->scratch.resize(std::max(layout_.size, static_cast<std::size_t>(observation_count_)));
    worker->arrays = worker->work.arrays();
    export_arrays(*worker);
  }

  check_memory(rows, " rows", sizeof(Head) + record_size_ * sizeof(double));
  heads_.resize(static_cast<std::size_t>(rows));
  records_.resize(static_cast<std::size_t>(rows) * record_size_);
  workers_[0]->work.clear();
  for (std::int64_t row = 0; row < rows; ++row) workers_[0]->work.save(state(row));
  pool_ = std::make_unique<Pool>(threads, options_.get("cpu_affinity").integer != 0);
}

Env::~Env() {
  if (!pool_->here()) {  // after a fork: nobody will ever leave these
    static_cast<void>(async_.release());
    static_cast<void>(pool_.release());
    return;
  }
  {
    const std::lock_guard lock(async_->mutex);
    async_->waiting_count = 0;
    async_->open = false;
  }
  async_->sent.notify_all();
}

// Learns the fields from a first reset and a first step.
void Env::describe(Worker& worker) {
  const Model& m = *task_.model;
  Work& work = worker.work;
  const Sim& sim = work.sim();
  std::vector<double> before(layout_.size), carried(static_cast<std::size_t>(task_.carry_count));
  work.begin();
  work.forward();
  if (task_.reset_info) {
    Info learn(reset_info_);
    task_.reset_info(sim, learn);
  }
  if (task_.carry) task_.carry(sim, carried.data());

  const auto list = [](std::vector<Field>& fields, const char* name, std::int64_t count) {
    append(fields, name, MJENV_NUMPY_FLOAT64, {count}, count);
  };
  if (task_.has_structure && task_.skipped_qpos >= 0) list(structure_, "skipped_qpos", task_.skipped_qpos);
  for (const auto& term : task_.terms) {
    const std::int64_t count = term.write(sim, nullptr);
    if (count > 0) list(observation_, term.name, count);
    if (task_.has_structure) list(structure_, term.name, count);
  }
  observation_count_ = total(observation_);
  observation_space_.low.assign(static_cast<std::size_t>(observation_count_), -kInfinity);
  observation_space_.high.assign(static_cast<std::size_t>(observation_count_), kInfinity);

  for (int i = 0; i < m.nu(); ++i) action_.push_back({m.actuator_label(i), "", MJENV_ACTION_DTYPE, {}, i, 1});
  action_space_ = {m.action_low(), m.action_high()};

  const std::vector<double> zeros(static_cast<std::size_t>(m.nu()));
  work.step({zeros.data(), MJENV_FLOAT64, m.nu()}, task_.frame_skip, before.data());
  Info learn(info_);
  task_.step(sim, Carried(carried.data(), task_.carry_count), learn);
  reward_ = {{"reward", "", task_.reward_type, {}, 0, 1}};
  for (auto* fields : {&observation_, &info_, &reset_info_, &reward_, &structure_})
    for (Field& field : *fields) field.doc = meaning(field.name);
  data_ = fields_of(work.arrays());
  model_fields_ = fields_of(m.arrays());
}

void Env::export_arrays(Worker& worker) {
  arrays_.clear();
  std::istringstream names(options_.get("arrays").text);
  for (std::string name; names >> name;) {
    const auto found =
        std::find_if(worker.arrays.begin(), worker.arrays.end(), [&](const Array& a) { return a.name == name; });
    if (found == worker.arrays.end()) {
      std::vector<std::string> known;
      for (const auto& a : worker.arrays) known.push_back(a.name);
      fail(MJENV_E_NAME, "option \"arrays\": no array " + quoted(name) + "; there are " + listed(known));
    }
    worker.exported.push_back(&*found);
    append(arrays_, name, found->type, found->shape, static_cast<std::int64_t>(found->count()));
    completes_ = completes_ || Work::on_demand(name);
  }
}

const std::vector<Field>& Env::fields(mjenv_role role) const {
  switch (role) {
    case MJENV_OBSERVATION: return observation_;
    case MJENV_ACTION: return action_;
    case MJENV_INFO: return info_;
    case MJENV_RESET_INFO: return reset_info_;
    case MJENV_REWARD: return reward_;
    case MJENV_STRUCTURE: return structure_;
    case MJENV_DATA: return data_;
    case MJENV_MODEL: return model_fields_;
    case MJENV_ARRAYS: return arrays_;
  }
  fail(MJENV_E_ARGUMENT, "no role " + std::to_string(role));
}

// ---- what callers may pass ----

void Env::check_row(std::int64_t row) const {
  if (row < 0 || row >= rows())
    fail(MJENV_E_VALUE, "row " + std::to_string(row) + " is outside 0.." + std::to_string(rows() - 1));
}

void Env::check_settled() const {
  if (!async_->open) return;
  pool_->check_here();
  fail(MJENV_E_STATE, std::to_string(async_->count) + " row(s) are under way: mjenv_recv them first");
}

void Env::check_out(const mjenv_batch* out, std::int64_t rows, const std::vector<Field>& info) const {
  if (!out) return;
  check_count("rows", out->rows, rows);
  if (out->obs || out->final_obs) check_count("obs_count", out->obs_count, observation_count_);
  if (out->info || out->final_info) check_count("info_count", out->info_count, total(info));
  if (out->reset_info) check_count("reset_info_count", out->reset_info_count, total(reset_info_));
  if (out->arrays) check_count("arrays_count", out->arrays_count, total(arrays_));
  if (out->obs_dtype != MJENV_FLOAT64 && out->obs_dtype != MJENV_FLOAT32)
    fail(MJENV_E_ARGUMENT, "obs_dtype is " + std::to_string(out->obs_dtype) + ", not MJENV_FLOAT64 or MJENV_FLOAT32");
}

void Env::check_steppable(std::int64_t row, bool resets) const {
  if (!heads_[row].ready) fail(MJENV_E_STATE, in_row(row, "reset it before the first step"));
  if (strict_ && heads_[row].ended && !resets)
    fail(MJENV_E_STATE, in_row(row, "its episode has ended: reset it, or set the option \"strict\" to 0 to go on"));
}

void Env::check_finite(std::int64_t row, const Action& action) const {
  if (!strict_ || awaits_reset(row)) return;
  for (Eigen::Index i = 0; i < action.count; ++i)
    if (!std::isfinite(action[i]))
      fail(MJENV_E_VALUE, in_row(row, "action[" + std::to_string(i) + "] is " + number(action[i]) +
                                          "; set the option \"strict\" to 0 to let it pass"));
}

// ---- random streams ----

void Env::seed(const std::uint64_t* seeds, const std::uint8_t* mask) {
  check_settled();
  for (std::int64_t row = 0; row < rows(); ++row) {
    if (mask && !mask[row]) continue;
    heads_[row].rng = Rng::from_seed(seeds[row]);
    heads_[row].seeded = true;
  }
}

void Env::seed(std::int64_t row, const std::uint32_t* digits, std::size_t count) {
  check_settled();
  check_row(row);
  if (count == 0) fail(MJENV_E_SIZE, "a seed has at least one digit");
  while (count > 1 && digits[count - 1] == 0) --count;
  heads_[row].rng = Rng::from_digits(digits, count);
  heads_[row].seeded = true;
}

void Env::get_stream(std::int64_t row, std::uint64_t* words, std::size_t count) const {
  check_settled();
  check_row(row);
  check_count("count", static_cast<std::int64_t>(count), 4);
  if (!heads_[row].seeded) fail(MJENV_E_STATE, in_row(row, "it was never seeded or reset, so it has no random stream"));
  const auto stream = heads_[row].rng.words();
  std::copy(stream.begin(), stream.end(), words);
}

void Env::set_stream(std::int64_t row, const std::uint64_t* words, std::size_t count) {
  check_settled();
  check_row(row);
  check_count("count", static_cast<std::int64_t>(count), 4);
  if (words[2] % 2 == 0) fail(MJENV_E_VALUE, "the increment " + std::to_string(words[2]) + " is even");
  heads_[row].rng = Rng::from_words({words[0], words[1], words[2], words[3]});
  heads_[row].seeded = true;
}

void Env::seed_actions(std::uint64_t seed) {
  action_rng_ = Rng::from_seed(seed);
  actions_seeded_ = true;
}

void Env::sample_actions(float* action, std::size_t count) {
  const auto& [low, high] = action_space_;
  check_count("the action's count", static_cast<std::int64_t>(count), rows() * task_.model->nu());
  for (std::size_t i = 0; i < low.size(); ++i)
    if (!std::isfinite(low[i]) || !std::isfinite(high[i]))
      fail(MJENV_E_STATE, "actuator " + std::to_string(i) + " has no bounds to draw between");
  if (!actions_seeded_) action_rng_ = Rng::from_entropy();
  actions_seeded_ = true;
  for (std::size_t i = 0; i < count; ++i)
    action[i] = static_cast<float>(action_rng_.uniform(low[i % low.size()], high[i % low.size()]));
}

}  // namespace mjenv::core
