#include "env.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>
#include <utility>

#include "cpus.hpp"
#include "error.hpp"
#include "registry.hpp"

namespace mjenv {
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

bool wanted(const std::uint8_t* mask, std::int64_t row) { return !mask || mask[row]; }

std::string in_row(std::int64_t row, const std::string& what) { return "row " + std::to_string(row) + ": " + what; }

void check_count(const char* what, std::int64_t given, std::int64_t needed) {
  if (given != needed)
    fail(MJENV_E_SIZE, std::string(what) + " is " + std::to_string(given) + ", not " + std::to_string(needed));
}

int threads_for(const Options& options, std::int64_t rows) {
  const std::int64_t chosen = options.get("num_threads").integer;
  return static_cast<int>(std::min(chosen == 0 ? usable_cpus() : chosen, rows));
}

template <typename T>
void put(T* array, const Place& place, T value) {
  if (array) array[place.index] = value;
}

// One row of arrays that are laid out by fields.
void copy_fields(const std::vector<Field>& fields, const double* from, double* to, const Place& place) {
  for (const auto& f : fields) {
    const auto start = f.offset * place.rows + place.index * f.count;
    if (from)
      std::copy_n(from + start, f.count, to + start);
    else
      std::fill_n(to + start, f.count, 0.0);
  }
}

}  // namespace

void declare_env_options(Options& options) {
  const auto declare = [&](mjenv_kind kind, const char* name, const char* doc, double low, double high,
                           std::int64_t integer, const char* text = "", const char* choices = "") {
    Option option;
    option.kind = kind;
    option.name = name;
    option.doc = doc;
    option.low = low;
    option.high = high;
    option.integer = integer;
    option.text = text;
    option.choices = choices;
    options.declare(std::move(option));
  };
  declare(MJENV_FLAG, "strict", "refuse a non-finite action and a step after the end; Gymnasium lets them pass", 0, 1,
          1);
  declare(MJENV_STRING, "autoreset_mode", "when a finished row is reset: never, in its next step, in the same step", 0,
          0, 0, "disabled", "disabled next_step same_step");
  declare(MJENV_STRING, "on_divergence", "a row whose state diverged goes on from MuJoCo's restart, or terminates", 0,
          0, 0, "continue", "continue terminate");
  declare(MJENV_INTEGER, "num_threads", "threads that step rows; 1: the caller's; 0: the CPUs this process may use", 0,
          kMostThreads, 1);
  declare(MJENV_FLAG, "cpu_affinity", "keep each thread of the library on a CPU of its own", 0, 1, 0);
  declare(MJENV_STRING, "arrays", "mjData arrays to export with each step, separated by blanks: \"xpos sensordata\"", 0,
          0, 0);
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
  record_size_ = 2 * layout_.size + static_cast<std::size_t>(task_.carry_count);
  const int threads = threads_for(options_, rows);
  for (int i = 0; i < threads; ++i) workers_.push_back(std::make_unique<Worker>(i, task_.model, task_.frame_skip));
  describe(*workers_[0]);
  for (auto& worker : workers_) {
    worker->scratch.resize(std::max(layout_.size, static_cast<std::size_t>(observation_count_)));
    worker->arrays = worker->work.arrays();
    export_arrays(*worker);
  }

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
    async_->waiting.clear();
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
    completes_ = completes_ || name == "cacc" || name == "cfrc_int" || name == "cfrc_ext";
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
  if (async_->open) fail(MJENV_E_STATE, std::to_string(async_->count) + " row(s) are under way: mjenv_recv them first");
}

void Env::check_out(const mjenv_batch* out, std::int64_t rows, const std::vector<Field>& info) const {
  if (!out) return;
  check_count("rows", out->rows, rows);
  if (out->obs || out->final_obs) check_count("obs_count", out->obs_count, observation_count_);
  if (out->info || out->final_info) check_count("info_count", out->info_count, total(info));
  if (out->obs_dtype != MJENV_FLOAT64 && out->obs_dtype != MJENV_FLOAT32)
    fail(MJENV_E_ARGUMENT, "obs_dtype is " + std::to_string(out->obs_dtype) + ", not MJENV_FLOAT64 or MJENV_FLOAT32");
}

void Env::check_dtype(mjenv_dtype dtype) const {
  if (dtype != MJENV_FLOAT64 && dtype != MJENV_FLOAT32)
    fail(MJENV_E_ARGUMENT, "dtype is " + std::to_string(dtype) + ", not MJENV_FLOAT64 or MJENV_FLOAT32");
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
    if (!wanted(mask, row)) continue;
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

// ---- workers ----

template <typename Body>
void Env::attempt(Worker& worker, std::int64_t row, const Body& body) noexcept {
  try {
    body(worker, row);
  } catch (const std::exception& error) {
    worker.resident = -1;
    worker.work.clear();  // MuJoCo left its stack unwound
    worker.failed = true;
    try {
      worker.failures += (worker.failures.empty() ? "" : "; ") + in_row(row, error.what());
    } catch (const std::exception&) {  // out of memory: the failure stays known, its text is lost
    }
  }
}

template <typename Body>
void Env::for_rows(const Body& body) {
  const auto block = [&](int index) {
    const ErrorTrap trap;
    const auto threads = static_cast<std::int64_t>(workers_.size());
    const std::int64_t end = rows() * (index + 1) / threads;
    for (std::int64_t row = rows() * index / threads; row < end; ++row) attempt(*workers_[index], row, body);
  };
  pool_->run(std::cref(block));
  bool failed = false;
  std::string failures;
  for (auto& worker : workers_) {
    failed = failed || worker->failed;
    if (!worker->failures.empty()) failures += (failures.empty() ? "" : "; ") + worker->failures;
    worker->failed = false;
    worker->failures.clear();
  }
  if (failed) fail(MJENV_E_PHYSICS, failures);
}

// Makes what the work space holds the row's state; scratch holds the state before the last evaluation.
void Env::commit(Worker& worker, std::int64_t row, Origin origin) {
  std::copy_n(worker.scratch.data(), layout_.size, before(row));
  worker.work.save(state(row));
  if (task_.carry) task_.carry(worker.work.sim(), carried(row));
  heads_[row].origin = origin;
  heads_[row].worker = worker.index;
  worker.resident = row;
}

// Derived arrays belong to the row that a worker computed last; another row's follow from the state before its last
// evaluation.
Env::Worker& Env::resident_worker(std::int64_t row) {
  const Head& head = heads_[row];
  Worker& worker = *workers_[static_cast<std::size_t>(head.worker)];
  if (worker.resident == row) return worker;
  worker.resident = -1;
  switch (head.origin) {
    case Origin::cleared: worker.work.clear(); break;
    case Origin::forward:
      worker.work.begin();
      worker.work.load(before(row));
      worker.work.forward();
      break;
    case Origin::step:
      worker.work.load(before(row));
      worker.work.repeat_step();
      break;
  }
  worker.resident = row;
  return worker;
}

// ---- outputs ----

void Env::write_observation(Worker& worker, void* to, const Place& place) {
  if (!to) return;
  const bool narrow = place.out->obs_dtype == MJENV_FLOAT32;
  const std::int64_t start = place.index * observation_count_;
  double* wide = narrow ? worker.scratch.data() : static_cast<double*>(to) + start;
  Eigen::Index offset = 0;
  for (const auto& term : task_.terms) offset += term.write(worker.work.sim(), wide + offset);
  if (narrow)
    std::transform(wide, wide + observation_count_, static_cast<float*>(to) + start,
                   [](double x) { return static_cast<float>(x); });
}

void Env::write_reset(Worker& worker, double* info, const Place& place) {
  write_observation(worker, place.out->obs, place);
  put<std::uint8_t>(place.out->was_reset, place, 1);
  if (info && task_.reset_info) {
    Info write(reset_info_, info, place.rows, place.index);
    task_.reset_info(worker.work.sim(), write);
  }
  write_arrays(worker, place);
}

void Env::write_arrays(Worker& worker, const Place& place) {
  if (!place.out->arrays) return;
  if (completes_) worker.work.complete();
  for (std::size_t i = 0; i < arrays_.size(); ++i)
    worker.exported[i]->read(place.out->arrays + arrays_[i].offset * place.rows + place.index * arrays_[i].count);
}

// ---- episodes ----

void Env::begin_episode(Worker& worker, std::int64_t row) {
  Work& work = worker.work;
  Rng rng = heads_[row].seeded ? heads_[row].rng : Rng::from_entropy();
  double* start = worker.scratch.data();
  worker.resident = -1;
  work.begin();
  work.save(start);
  Start drawn{{layout_.qpos(start), static_cast<Eigen::Index>(layout_.nq)},
              {layout_.qvel(start), static_cast<Eigen::Index>(layout_.nv)}};
  task_.reset(drawn, rng);
  work.load(start);
  work.forward();
  commit(worker, row, Origin::forward);
  Head& head = heads_[row];
  head.rng = rng;
  head.steps = 0;
  head.seeded = head.ready = true;
  head.ended = false;
}

void Env::reset(const std::uint8_t* mask, const mjenv_batch* out) {
  check_settled();
  check_out(out, rows(), reset_info_);
  for_rows([&](Worker& worker, std::int64_t row) {
    if (!wanted(mask, row)) return;
    begin_episode(worker, row);
    if (!out) return;
    const Place place{out, rows(), row};
    write_reset(worker, out->info, place);
    put<double>(out->reward, place, 0);
    put<std::uint8_t>(out->terminated, place, 0);
    put<std::uint8_t>(out->truncated, place, 0);
    put<std::int32_t>(out->status, place, MJENV_OK);
  });
}

void Env::step(const void* action, std::size_t count, mjenv_dtype dtype, const mjenv_batch* out) {
  const std::int64_t nu = task_.model->nu();
  check_settled();
  check_dtype(dtype);
  check_count("the action's count", static_cast<std::int64_t>(count), rows() * nu);
  check_out(out, rows(), info_);
  const Action all{action, dtype, rows() * nu};
  for (std::int64_t row = 0; row < rows(); ++row) {
    check_steppable(row, autoreset_ != Autoreset::disabled);
    check_finite(row, all.part(row * nu, nu));
  }
  for_rows([&](Worker& worker, std::int64_t row) {
    step_row(worker, row, all.part(row * nu, nu), {out, rows(), row});
  });
}

// One step of a row, automatic reset included.
void Env::step_row(Worker& worker, std::int64_t row, const Action& action, const Place& place) {
  const mjenv_batch* out = place.out;
  if (awaits_reset(row)) {
    begin_episode(worker, row);
    if (!out) return;
    put<double>(out->reward, place, 0);
    put<std::uint8_t>(out->terminated, place, 0);
    put<std::uint8_t>(out->truncated, place, 0);
    put<std::int32_t>(out->status, place, MJENV_OK);
    if (out->info) copy_fields(info_, nullptr, out->info, place);
    write_reset(worker, out->reset_info, place);
    return;
  }
  play(worker, row, action, place);
  const bool resets = autoreset_ == Autoreset::same_step && heads_[row].ended;
  if (out) {
    write_observation(worker, resets ? out->final_obs : out->obs, place);
    put<std::uint8_t>(out->was_reset, place, 0);
  }
  if (!resets) {
    if (out) write_arrays(worker, place);
    return;
  }
  if (out && out->info) {
    if (out->final_info) copy_fields(info_, out->info, out->final_info, place);
    copy_fields(info_, nullptr, out->info, place);
  }
  begin_episode(worker, row);
  if (out) write_reset(worker, out->reset_info, place);
}

// The step itself: reward, flags, status and info.
Env::Flags Env::play(Worker& worker, std::int64_t row, const Action& action, const Place& place) {
  Work& work = worker.work;
  const mjenv_batch* out = place.out;
  Head& head = heads_[row];
  worker.resident = -1;
  if (out) put<std::int32_t>(out->status, place, MJENV_E_PHYSICS);  // until it has gone well
  work.load(state(row));
  work.step(action, task_.frame_skip, worker.scratch.data());

  Info info(info_, out ? out->info : nullptr, place.rows, place.index);
  Outcome outcome = task_.step(work.sim(), Carried(carried(row), task_.carry_count), info);
  const bool diverged = work.diverged();
  commit(worker, row, Origin::step);
  ++head.steps;
  if (diverged && ends_on_divergence_) outcome.terminated = true;
  const bool truncated = max_episode_steps_ > 0 && head.steps >= max_episode_steps_;
  head.ended = outcome.terminated || truncated;
  if (out) {
    put<double>(out->reward, place, outcome.reward);
    put<std::uint8_t>(out->terminated, place, outcome.terminated);
    put<std::uint8_t>(out->truncated, place, truncated);
    put<std::int32_t>(out->status, place, diverged ? MJENV_E_PHYSICS : MJENV_OK);
  }
  return {outcome.terminated, truncated};
}

void Env::rollout(const void* action, std::int64_t steps, std::size_t count, mjenv_dtype dtype,
                  const mjenv_batch* out) {
  const std::int64_t nu = task_.model->nu();
  check_settled();
  check_dtype(dtype);
  if (steps < 1 || steps > std::numeric_limits<std::int64_t>::max() / (rows() * std::max<std::int64_t>(nu, 1)))
    fail(MJENV_E_VALUE, "steps is " + std::to_string(steps) + ": less than 1, or more than can be counted");
  check_count("the action's count", static_cast<std::int64_t>(count), rows() * steps * nu);
  check_out(out, rows() * steps, info_);
  const Action all{action, dtype, rows() * steps * nu};
  for (std::int64_t row = 0; row < rows(); ++row) {
    check_steppable(row, false);
    check_finite(row, all.part(row * steps * nu, steps * nu));
  }
  for_rows([&](Worker& worker, std::int64_t row) {
    Flags flags{};
    for (std::int64_t t = 0; t < steps; ++t) {
      const Place place{out, rows() * steps, row * steps + t};
      if (flags.terminated || flags.truncated)
        stay(flags, place);
      else
        flags = play(worker, row, all.part((row * steps + t) * nu, nu), place);
      if (!out) continue;
      write_observation(worker, out->obs, place);
      put<std::uint8_t>(out->was_reset, place, 0);
      write_arrays(worker, place);
    }
  });
}

// What a rollout writes for a row that has ended.
void Env::stay(const Flags& flags, const Place& place) const {
  const mjenv_batch* out = place.out;
  if (!out) return;
  put<double>(out->reward, place, 0);
  put<std::uint8_t>(out->terminated, place, flags.terminated);
  put<std::uint8_t>(out->truncated, place, flags.truncated);
  put<std::int32_t>(out->status, place, MJENV_OK);
  if (out->info) copy_fields(info_, nullptr, out->info, place);
}

void Env::observe(const mjenv_batch& out) {
  check_settled();
  check_out(&out, rows(), info_);
  for (std::int64_t row = 0; row < rows(); ++row) {
    Worker& worker = resident_worker(row);
    write_observation(worker, out.obs, {&out, rows(), row});
    write_arrays(worker, {&out, rows(), row});
  }
}

// ---- rows under way ----

void Env::send(const std::int64_t* rows_sent, std::size_t row_count, const void* action, std::size_t count,
               mjenv_dtype dtype, const mjenv_batch* out) {
  const std::int64_t nu = task_.model->nu();
  if (!rows_sent) row_count = static_cast<std::size_t>(rows());
  const auto row_at = [&](std::size_t i) { return rows_sent ? rows_sent[i] : static_cast<std::int64_t>(i); };
  check_dtype(dtype);
  check_count("the action's count", static_cast<std::int64_t>(count), static_cast<std::int64_t>(row_count) * nu);
  check_out(out, rows(), info_);
  const Action all{action, dtype, static_cast<Eigen::Index>(count)};

  std::unique_lock lock(async_->mutex);
  async_->under_way.resize(static_cast<std::size_t>(rows()));
  async_->dtype.resize(static_cast<std::size_t>(rows()));
  async_->action.resize(static_cast<std::size_t>(rows() * nu));
  async_->ready.reserve(static_cast<std::size_t>(rows()));
  const mjenv_batch chosen = out ? *out : mjenv_batch{};
  if (async_->open && std::memcmp(&chosen, &async_->out, sizeof chosen) != 0)
    fail(MJENV_E_STATE, "rows are under way with another out");
  std::vector<std::uint8_t> listed(static_cast<std::size_t>(rows()));
  for (std::size_t i = 0; i < row_count; ++i) {
    const std::int64_t row = row_at(i);
    check_row(row);
    if (async_->under_way[row] || listed[row]++) fail(MJENV_E_STATE, in_row(row, "it is under way already"));
    check_steppable(row, autoreset_ != Autoreset::disabled);
    check_finite(row, all.part(static_cast<Eigen::Index>(i) * nu, nu));
  }
  if (row_count == 0) return;

  const std::size_t width = dtype == MJENV_FLOAT32 ? sizeof(float) : sizeof(double);
  for (std::size_t i = 0; i < row_count; ++i) {
    const std::int64_t row = row_at(i);
    if (nu > 0)
      std::memcpy(&async_->action[row * nu], all.part(static_cast<Eigen::Index>(i) * nu, nu).values, width * nu);
    async_->dtype[row] = dtype;
    async_->under_way[row] = 1;
    async_->waiting.push_back(row);
  }
  async_->count += row_count;
  async_->out = chosen;
  const bool starts = !async_->open;
  async_->open = true;
  lock.unlock();
  if (starts && pool_->threads() > 1)
    pool_->start([this](int index) {
      const ErrorTrap trap;
      serve(*workers_[static_cast<std::size_t>(index)], [] { return false; });
    });
  else
    async_->sent.notify_all();
}

// Steps rows that wait until enough() (asked under the lock) or, in the pool, until none are under way any more.
void Env::serve(Worker& worker, const std::function<bool()>& enough) {
  const bool caller = worker.index == 0;
  std::unique_lock lock(async_->mutex);
  while (!enough()) {
    if (async_->waiting.empty()) {
      if (!async_->open) return;
      (caller ? async_->done : async_->sent).wait(lock);
      continue;
    }
    const std::int64_t row = async_->waiting.front();
    async_->waiting.pop_front();
    const mjenv_batch out = async_->out;
    lock.unlock();
    const std::int64_t nu = task_.model->nu();
    attempt(worker, row, [&](Worker& w, std::int64_t r) {
      step_row(w, r, {async_->action.data() + r * nu, async_->dtype[r], nu},
               {out.struct_size ? &out : nullptr, rows(), r});
    });
    lock.lock();
    if (worker.failed) {
      async_->failed = true;
      worker.failed = false;
      async_->failures += (async_->failures.empty() ? "" : "; ") + worker.failures;
      worker.failures.clear();
    }
    async_->ready.push_back(row);
    async_->done.notify_one();
  }
}

void Env::receive(std::size_t least, std::int64_t* rows_done, std::size_t capacity, std::size_t* count) {
  if (!async_->open) fail(MJENV_E_STATE, "no rows are under way: mjenv_send some first");
  if (least > async_->count)
    fail(MJENV_E_SIZE, std::to_string(least) + " row(s) wanted, but " + std::to_string(async_->count) + " under way");
  if (capacity < std::max<std::size_t>(least, 1))
    fail(MJENV_E_SIZE,
         "there is room for " + std::to_string(capacity) + " row(s), but " + std::to_string(least) + " are wanted");
  serve(*workers_[0], [&] { return async_->ready.size() >= least; });

  std::unique_lock lock(async_->mutex);
  const std::size_t reported = std::min(capacity, async_->ready.size());
  std::copy_n(async_->ready.begin(), reported, rows_done);
  for (std::size_t i = 0; i < reported; ++i) async_->under_way[rows_done[i]] = 0;
  async_->ready.erase(async_->ready.begin(), async_->ready.begin() + static_cast<std::ptrdiff_t>(reported));
  async_->count -= reported;
  *count = reported;
  const std::string failures = std::exchange(async_->failures, {});
  const bool failed = std::exchange(async_->failed, false);
  if (async_->count == 0) {
    async_->open = false;
    lock.unlock();
    async_->sent.notify_all();
    if (pool_->threads() > 1) pool_->finish();
  }
  if (failed) fail(MJENV_E_PHYSICS, failures);
}

// ---- one row ----

const Array& Env::array(std::int64_t row, const std::string& name) {
  check_settled();
  check_row(row);
  const auto find = [&](const std::vector<Array>& list) {
    const auto found = std::find_if(list.begin(), list.end(), [&](const Array& a) { return a.name == name; });
    return found == list.end() ? nullptr : &*found;
  };
  if (const Array* found = find(task_.model->arrays())) return *found;
  const auto worker = static_cast<std::size_t>(heads_[row].worker);
  if (const Array* found = find(workers_[worker]->arrays)) {
    resident_worker(row).work.complete();
    return *found;
  }
  std::vector<std::string> names;
  for (const auto& field : data_) names.push_back(field.name);
  for (const auto& field : model_fields_) names.push_back(field.name);
  fail(MJENV_E_NAME, "no array " + quoted(name) + "; there are " + listed(names));
}

void Env::set_state(std::int64_t row, const double* qpos, std::size_t nq, const double* qvel, std::size_t nv) {
  check_settled();
  check_row(row);
  check_count("nq", static_cast<std::int64_t>(nq), static_cast<std::int64_t>(layout_.nq));
  check_count("nv", static_cast<std::int64_t>(nv), static_cast<std::int64_t>(layout_.nv));
  for (std::size_t i = 0; i < nq + nv; ++i) {
    const double x = i < nq ? qpos[i] : qvel[i - nq];
    if (!std::isfinite(x))
      fail(MJENV_E_VALUE,
           (i < nq ? "qpos[" + std::to_string(i) : "qvel[" + std::to_string(i - nq)) + "] is " + number(x));
  }
  Worker& worker = *workers_[0];
  double* start = worker.scratch.data();
  std::copy_n(state(row), layout_.size, start);
  std::copy_n(qpos, nq, layout_.qpos(start));
  std::copy_n(qvel, nv, layout_.qvel(start));
  worker.resident = -1;
  worker.work.begin();
  worker.work.load(start);
  worker.work.forward();
  commit(worker, row, Origin::forward);
  heads_[row].ready = true;
  heads_[row].ended = false;
}

void Env::simulate(std::int64_t row, const double* ctrl, std::size_t count, std::int64_t frames) {
  check_settled();
  check_row(row);
  check_count("count", static_cast<std::int64_t>(count), task_.model->nu());
  if (frames < 1) fail(MJENV_E_VALUE, "frames is " + std::to_string(frames) + ", less than 1");
  Worker& worker = *workers_[0];
  worker.resident = -1;
  worker.work.load(state(row));
  worker.work.step({ctrl, MJENV_FLOAT64, task_.model->nu()}, frames, worker.scratch.data());
  commit(worker, row, Origin::step);
}

}  // namespace mjenv
