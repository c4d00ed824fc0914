#include "env.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "error.hpp"
#include "hash.hpp"
#include "registry.hpp"

namespace mjenv {
namespace {

std::int64_t total(const std::vector<Field>& fields) {
  return fields.empty() ? 0 : fields.back().offset + fields.back().count;
}

void append(std::vector<Field>& fields, std::string name, std::int64_t count) {
  fields.push_back({std::move(name), "", MJENV_NUMPY_FLOAT64, {count}, total(fields), count});
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

}  // namespace

Env::Env(const Options& options, std::int64_t rows)
    : options_(options),
      task_(build_task(options_)),
      work_(task_.model, task_.frame_skip),
      max_episode_steps_(options_.get("max_episode_steps").integer),
      strict_(options_.get("strict").integer != 0) {
  const ErrorTrap trap;
  const auto& layout = work_.layout();
  record_size_ = 2 * layout.size + static_cast<std::size_t>(task_.carry_count);
  describe();
  scratch_.resize(std::max(layout.size, static_cast<std::size_t>(observation_count_)));
  work_.clear();
  heads_.resize(static_cast<std::size_t>(rows));
  records_.resize(static_cast<std::size_t>(rows) * record_size_);
  for (std::int64_t row = 0; row < rows; ++row) work_.save(state(row));
}

// Learns the fields from a first reset and a first step.
void Env::describe() {
  const Model& m = *task_.model;
  const Sim& sim = work_.sim();
  std::vector<double> before(work_.layout().size), carried(static_cast<std::size_t>(task_.carry_count));
  work_.begin();
  work_.forward();
  if (task_.reset_info) {
    Info learn(reset_info_);
    task_.reset_info(sim, learn);
  }
  if (task_.carry) task_.carry(sim, carried.data());

  if (task_.has_structure && task_.skipped_qpos >= 0) append(structure_, "skipped_qpos", task_.skipped_qpos);
  for (const auto& term : task_.terms) {
    const std::int64_t count = term.write(sim, nullptr);
    if (count > 0) append(observation_, term.name, count);
    if (task_.has_structure) append(structure_, term.name, count);
  }
  observation_count_ = total(observation_);
  observation_space_.low.assign(static_cast<std::size_t>(observation_count_), -kInfinity);
  observation_space_.high.assign(static_cast<std::size_t>(observation_count_), kInfinity);

  for (int i = 0; i < m.nu(); ++i) action_.push_back({m.actuator_label(i), "", MJENV_ACTION_DTYPE, {}, i, 1});
  action_space_ = {m.action_low(), m.action_high()};

  const std::vector<double> zeros(static_cast<std::size_t>(m.nu()));
  work_.step({zeros.data(), MJENV_FLOAT64, m.nu()}, task_.frame_skip, before.data());
  Info learn(info_);
  task_.step(sim, Carried(carried.data(), task_.carry_count), learn);
  reward_ = {{"reward", "", task_.reward_type, {}, 0, 1}};

  data_arrays_ = work_.arrays();
  data_ = fields_of(data_arrays_);
  model_fields_ = fields_of(m.arrays());
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
  }
  fail(MJENV_E_ARGUMENT, "no role " + std::to_string(role));
}

void Env::check_row(std::int64_t row) const {
  if (row < 0 || row >= rows())
    fail(MJENV_E_VALUE, "row " + std::to_string(row) + " is outside 0.." + std::to_string(rows() - 1));
}

void Env::check(const mjenv_batch& out, const std::vector<Field>& info) const {
  check_count("rows", out.rows, rows());
  if (out.obs) check_count("obs_count", out.obs_count, observation_count_);
  if (out.info) check_count("info_count", out.info_count, total(info));
  if (out.obs_dtype != MJENV_FLOAT64 && out.obs_dtype != MJENV_FLOAT32)
    fail(MJENV_E_ARGUMENT, "obs_dtype is " + std::to_string(out.obs_dtype) + ", not MJENV_FLOAT64 or MJENV_FLOAT32");
}

void Env::seed(const std::uint64_t* seeds, const std::uint8_t* mask) {
  for (std::int64_t row = 0; row < rows(); ++row) {
    if (!wanted(mask, row)) continue;
    heads_[row].rng = Rng::from_seed(seeds[row]);
    heads_[row].seeded = true;
  }
}

void Env::seed(std::int64_t row, const std::uint32_t* digits, std::size_t count) {
  check_row(row);
  if (count == 0) fail(MJENV_E_SIZE, "a seed has at least one digit");
  while (count > 1 && digits[count - 1] == 0) --count;
  heads_[row].rng = Rng::from_digits(digits, count);
  heads_[row].seeded = true;
}

void Env::get_stream(std::int64_t row, std::uint64_t* words, std::size_t count) const {
  check_row(row);
  check_count("count", static_cast<std::int64_t>(count), 4);
  if (!heads_[row].seeded) fail(MJENV_E_STATE, in_row(row, "it was never seeded or reset, so it has no random stream"));
  const auto stream = heads_[row].rng.words();
  std::copy(stream.begin(), stream.end(), words);
}

void Env::set_stream(std::int64_t row, const std::uint64_t* words, std::size_t count) {
  check_row(row);
  check_count("count", static_cast<std::int64_t>(count), 4);
  if (words[2] % 2 == 0) fail(MJENV_E_VALUE, "the increment " + std::to_string(words[2]) + " is even");
  heads_[row].rng = Rng::from_words({words[0], words[1], words[2], words[3]});
  heads_[row].seeded = true;
}

void Env::write_observation(std::int64_t row, const mjenv_batch& out) {
  if (!out.obs) return;
  const bool narrow = out.obs_dtype == MJENV_FLOAT32;
  const std::int64_t start = row * observation_count_;
  double* to = narrow ? scratch_.data() : static_cast<double*>(out.obs) + start;
  Eigen::Index offset = 0;
  for (const auto& term : task_.terms) offset += term.write(work_.sim(), to + offset);
  if (narrow)
    std::transform(to, to + observation_count_, static_cast<float*>(out.obs) + start,
                   [](double x) { return static_cast<float>(x); });
}

// Makes what the work space holds the row's state; scratch_ holds the state before the last evaluation.
void Env::commit(std::int64_t row, Origin origin) {
  std::copy_n(scratch_.data(), work_.layout().size, before(row));
  work_.save(state(row));
  if (task_.carry) task_.carry(work_.sim(), carried(row));
  heads_[row].origin = origin;
  resident_ = row;
}

void Env::reset(const std::uint8_t* mask, const mjenv_batch* out) {
  if (out) check(*out, reset_info_);
  for (std::int64_t row = 0; row < rows(); ++row)
    if (wanted(mask, row)) reset_row(row, out);
}

void Env::reset_row(std::int64_t row, const mjenv_batch* out) {
  const auto& layout = work_.layout();
  const Sim& sim = work_.sim();
  Rng rng = heads_[row].seeded ? heads_[row].rng : Rng::from_entropy();
  double* start = scratch_.data();
  resident_ = -1;
  work_.begin();
  work_.save(start);
  Start drawn{{layout.qpos(start), static_cast<Eigen::Index>(layout.nq)},
              {layout.qvel(start), static_cast<Eigen::Index>(layout.nv)}};
  task_.reset(drawn, rng);
  work_.load(start);
  work_.forward();

  commit(row, Origin::forward);
  heads_[row] = {rng, 0, Origin::forward, true, true, false};
  if (!out) return;
  write_observation(row, *out);
  if (out->reward) out->reward[row] = 0;
  if (out->terminated) out->terminated[row] = 0;
  if (out->truncated) out->truncated[row] = 0;
  if (out->status) out->status[row] = MJENV_OK;
  if (out->info && task_.reset_info) {
    Info info(reset_info_, out->info, rows(), row);
    task_.reset_info(sim, info);
  }
}

void Env::check_actions(const void* action, mjenv_dtype dtype) const {
  const std::int64_t nu = task_.model->nu();
  const Action all{action, dtype, rows() * nu};
  for (Eigen::Index i = 0; i < all.count; ++i)
    if (!std::isfinite(all[i]))
      fail(MJENV_E_VALUE, in_row(i / nu, "action[" + std::to_string(i % nu) + "] is " + number(all[i]) +
                                             "; set the option \"strict\" to 0 to let it pass"));
}

void Env::step(const void* action, std::size_t count, mjenv_dtype dtype, const mjenv_batch* out) {
  const std::int64_t nu = task_.model->nu();
  if (dtype != MJENV_FLOAT64 && dtype != MJENV_FLOAT32)
    fail(MJENV_E_ARGUMENT, "dtype is " + std::to_string(dtype) + ", not MJENV_FLOAT64 or MJENV_FLOAT32");
  check_count("the action's count", static_cast<std::int64_t>(count), rows() * nu);
  if (out) check(*out, info_);
  for (std::int64_t row = 0; row < rows(); ++row) {
    if (!heads_[row].ready) fail(MJENV_E_STATE, in_row(row, "reset it before the first step"));
    if (strict_ && heads_[row].ended)
      fail(MJENV_E_STATE, in_row(row, "its episode has ended: reset it, or set the option \"strict\" to 0 to go on"));
  }
  if (strict_) check_actions(action, dtype);

  const std::size_t width = dtype == MJENV_FLOAT32 ? sizeof(float) : sizeof(double);
  std::string failures;
  for (std::int64_t row = 0; row < rows(); ++row) {
    const auto offset = static_cast<std::size_t>(row * nu) * width;
    try {
      step_row(row, {static_cast<const char*>(action) + offset, dtype, nu}, out);
    } catch (const Error& error) {
      work_.clear();  // MuJoCo left its stack unwound
      if (out && out->status) out->status[row] = MJENV_E_PHYSICS;
      failures += (failures.empty() ? "" : "; ") + in_row(row, error.what());
    }
  }
  if (!failures.empty()) fail(MJENV_E_PHYSICS, failures);
}

void Env::step_row(std::int64_t row, const Action& action, const mjenv_batch* out) {
  const Sim& sim = work_.sim();
  Head& head = heads_[row];
  resident_ = -1;
  work_.load(state(row));
  work_.step(action, task_.frame_skip, scratch_.data());

  Info info(info_, out ? out->info : nullptr, rows(), row);
  const Outcome outcome = task_.step(sim, Carried(carried(row), task_.carry_count), info);
  commit(row, Origin::step);
  ++head.steps;
  const bool truncated = max_episode_steps_ > 0 && head.steps >= max_episode_steps_;
  head.ended = outcome.terminated || truncated;
  if (!out) return;
  write_observation(row, *out);
  if (out->reward) out->reward[row] = outcome.reward;
  if (out->terminated) out->terminated[row] = outcome.terminated;
  if (out->truncated) out->truncated[row] = truncated;
  if (out->status) out->status[row] = work_.diverged() ? MJENV_E_PHYSICS : MJENV_OK;
}

void Env::observe(const mjenv_batch& out) {
  check(out, info_);
  for (std::int64_t row = 0; row < rows(); ++row) {
    make_resident(row);
    write_observation(row, out);
  }
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

// Derived arrays belong to the row that was computed last; another row's follow from the state before its last
// evaluation.
void Env::make_resident(std::int64_t row) {
  if (resident_ == row) return;
  resident_ = -1;
  switch (heads_[row].origin) {
    case Origin::cleared: work_.clear(); break;
    case Origin::forward:
      work_.begin();
      work_.load(before(row));
      work_.forward();
      break;
    case Origin::step:
      work_.load(before(row));
      work_.repeat_step();
      break;
  }
  resident_ = row;
}

const Array& Env::array(std::int64_t row, const std::string& name) {
  check_row(row);
  for (const auto& a : task_.model->arrays())
    if (a.name == name) return a;
  for (const auto& a : data_arrays_) {
    if (a.name != name) continue;
    make_resident(row);
    work_.complete();
    return a;
  }
  std::vector<std::string> names;
  for (const auto& a : data_arrays_) names.push_back(a.name);
  for (const auto& a : task_.model->arrays()) names.push_back(a.name);
  fail(MJENV_E_NAME, "no array " + quoted(name) + "; there are " + listed(names));
}

void Env::set_state(std::int64_t row, const double* qpos, std::size_t nq, const double* qvel, std::size_t nv) {
  const auto& layout = work_.layout();
  check_row(row);
  check_count("nq", static_cast<std::int64_t>(nq), static_cast<std::int64_t>(layout.nq));
  check_count("nv", static_cast<std::int64_t>(nv), static_cast<std::int64_t>(layout.nv));
  for (std::size_t i = 0; i < nq + nv; ++i) {
    const double x = i < nq ? qpos[i] : qvel[i - nq];
    if (!std::isfinite(x))
      fail(MJENV_E_VALUE,
           (i < nq ? "qpos[" + std::to_string(i) : "qvel[" + std::to_string(i - nq)) + "] is " + number(x));
  }
  double* start = scratch_.data();
  std::copy_n(state(row), layout.size, start);
  std::copy_n(qpos, nq, layout.qpos(start));
  std::copy_n(qvel, nv, layout.qvel(start));
  resident_ = -1;
  work_.begin();
  work_.load(start);
  work_.forward();

  commit(row, Origin::forward);
  heads_[row].ready = true;
  heads_[row].ended = false;
}

void Env::simulate(std::int64_t row, const double* ctrl, std::size_t count, std::int64_t frames) {
  check_row(row);
  check_count("count", static_cast<std::int64_t>(count), task_.model->nu());
  if (frames < 1) fail(MJENV_E_VALUE, "frames is " + std::to_string(frames) + ", less than 1");
  resident_ = -1;
  work_.load(state(row));
  work_.step({ctrl, MJENV_FLOAT64, task_.model->nu()}, frames, scratch_.data());
  commit(row, Origin::step);
}

// What precedes a row's record in its image.
struct Env::Stamp {
  std::array<char, 8> magic{'m', 'j', 'e', 'n', 'v', 'r', 'o', 'w'};
  std::uint64_t version = 1;
  std::uint64_t owner = 0;     // id, options and model
  std::uint64_t size = 0;      // bytes of the image
  std::uint64_t checksum = 0;  // of everything behind it
  Rng rng;
  std::int64_t steps = 0;
  std::array<std::uint8_t, 8> flags{};  // origin, seeded, ready, ended
};

Env::Stamp Env::stamp() const {
  Stamp stamp;
  if (owner_ == 0) {
    owner_ = hash(options_.id().data(), options_.id().size(), task_.model->fingerprint());
    for (const auto& option : options_.all()) {
      if (option.name == "xml_file" || option.name == "xml_string") continue;  // the model speaks for itself
      owner_ = hash(&option.integer, sizeof option.integer, owner_);
      owner_ = hash(option.reals.data(), option.reals.size() * sizeof(double), owner_);
      owner_ = hash(option.text.data(), option.text.size(), owner_);
    }
  }
  stamp.owner = owner_;
  stamp.size = snapshot_size();
  return stamp;
}

std::size_t Env::snapshot_size() const { return sizeof(Stamp) + record_size_ * sizeof(double); }

namespace {
std::uint64_t checksum_of(const std::vector<unsigned char>& image, std::size_t from) {
  return hash(image.data() + from, image.size() - from);
}
}  // namespace

void Env::snapshot(std::int64_t row, void* image) const {
  check_row(row);
  static_assert(std::is_trivially_copyable_v<Stamp> && sizeof(Stamp) == 40 + 32 + 8 + 8, "an image has no padding");
  const Head& head = heads_[row];
  Stamp s = stamp();
  s.rng = head.rng;
  s.steps = head.steps;
  s.flags = {static_cast<std::uint8_t>(head.origin), head.seeded, head.ready, head.ended};
  std::vector<unsigned char> bytes(snapshot_size());
  std::memcpy(bytes.data(), &s, sizeof s);
  std::memcpy(bytes.data() + sizeof s, record(row), record_size_ * sizeof(double));
  s.checksum = checksum_of(bytes, offsetof(Stamp, rng));
  std::memcpy(bytes.data(), &s, sizeof s);
  std::memcpy(image, bytes.data(), bytes.size());
}

void Env::restore(std::int64_t row, const void* image, std::size_t size) {
  check_row(row);
  const Stamp mine = stamp();
  Stamp s;
  if (size < sizeof s) fail(MJENV_E_SNAPSHOT, "an image of " + std::to_string(size) + " bytes is too short");
  const auto* first = static_cast<const unsigned char*>(image);
  const std::vector<unsigned char> bytes(first, first + size);
  std::memcpy(&s, bytes.data(), sizeof s);
  if (s.magic != mine.magic) fail(MJENV_E_SNAPSHOT, "not an image of a row");
  if (s.version != mine.version)
    fail(MJENV_E_SNAPSHOT,
         "an image of version " + std::to_string(s.version) + "; this library reads " + std::to_string(mine.version));
  if (s.owner != mine.owner)
    fail(MJENV_E_SNAPSHOT, "the image is of another id, other options or another model than this " + options_.id());
  if (s.size != size || size != mine.size || s.checksum != checksum_of(bytes, offsetof(Stamp, rng)) ||
      s.flags[0] > static_cast<std::uint8_t>(Origin::step))
    fail(MJENV_E_SNAPSHOT, "the image is damaged");

  heads_[row] = {s.rng, s.steps, static_cast<Origin>(s.flags[0]), s.flags[1] != 0, s.flags[2] != 0, s.flags[3] != 0};
  std::memcpy(state(row), bytes.data() + sizeof s, record_size_ * sizeof(double));
  if (resident_ == row) resident_ = -1;
}

}  // namespace mjenv
