#include "env/env.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <optional>
#include <utility>

#include "engine/constants.hpp"
#include "error.hpp"
#include "structs.hpp"
#include "system/cpus.hpp"
#include "system/memory.hpp"
#include "system/platform.hpp"
#include "task/registry.hpp"

namespace mjenv::core {
namespace {

constexpr std::int64_t kMaxThreads = 1024;
constexpr std::int64_t kMaxContacts = 1'000'000;
constexpr const char* kCarried = "carried";  // the name of the numbers that a row carries for its task
constexpr std::int64_t kStateWords = np::RandomState::kStateWords;

int threads_for(const Options& options, const Task& task, std::int64_t rows) {
  const std::int64_t chosen = options.get("num_threads").integer;
  if (chosen > 1 && *platform::no_threads)
    fail(MJENV_E_VALUE,
         "option \"num_threads\" is " + std::to_string(chosen) + ", but " + platform::no_threads + ": set it to 1");
  if (task.caller_thread) {
    if (chosen > 1)
      fail(MJENV_E_VALUE, "option \"num_threads\" is " + std::to_string(chosen) + ", but " + options.id() +
                              " is computed on the thread that calls the library: set it to 1");
    return 1;
  }
  return static_cast<int>(std::min(chosen == 0 ? usable_cpus() : chosen, rows));
}

constexpr std::int64_t kWords = Rng::kWords;

void check_stream(std::int64_t count, bool has_random_state) {
  if (count == 4 || count == 6 || (has_random_state && count == kStateWords)) return;
  fail(MJENV_E_SIZE, "count is " + std::to_string(count) + ", not 4 or 6" +
                         (has_random_state ? ", or " + std::to_string(kStateWords) + " for RandomState" : ""));
}

void check_finite(const std::string& array, const double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite(values[i])) fail(MJENV_E_VALUE, element_is(array, i, values[i]) + ", but must be finite");
}

void check_carried(const Calls& calls, const double* values) {
  if (const std::string found = calls.out_of_bounds(values); !found.empty()) fail(MJENV_E_VALUE, found);
}

[[noreturn]] void refuse_open(std::int64_t row) {
  fail(MJENV_E_PENDING, in_row(row, "its step or reset is not finished: call mjenv_finish first"));
}

bool is_selected(const std::uint8_t* mask, std::int64_t row) { return !mask || mask[row] != 0; }

}  // namespace

void declare_env_options(Options& options) {
  options.flag("strict", true,
               "refuse non-finite actions and steps after the end of an episode, both of which Gymnasium accepts, and "
               "NaN from registered tasks");
  options.text(
      "autoreset_mode", "disabled",
      "what resets a row whose episode has ended: the caller, the row's next step, or the step that ended the episode",
      "disabled next_step same_step");
  options.text("on_divergence", "continue",
               "what happens when MuJoCo finds bad numbers in a row (and resets its simulation, unless the model "
               "disables that): the episode continues, or it terminates",
               "continue terminate");
  options.integer("num_threads", 1, 0, kMaxThreads,
                  "how many threads step rows, at most one per row; 1: only the caller's; 0: one for each CPU that the "
                  "process may use",
                  InIdentity::no);
  Option lanes(MJENV_KIND_STRING_OR_INT, "lanes",
               "how many rows one thread steps at once, in the lanes of the CPU's vector unit, with equal bits; 0: one "
               "by one; auto: as the environment variable MJENV_LANES says, or if it is not set, at most 4; max: "
               "likewise, but as many as the CPU has, which is faster and takes more memory",
               InIdentity::no, 0, static_cast<double>(Team::kMaxSize));
  lanes.text = "auto";
  lanes.choices = "auto max";
  options.add(std::move(lanes));
  options.flag("cpu_affinity", false, "pin each thread of the library to one CPU", InIdentity::no);
  options.text("arrays", "",
               "names of the mjData arrays to export in each step, separated by blanks: \"xpos sensordata\"", "",
               InIdentity::no);
  options.integer(
      "max_contacts", 0, 0, kMaxContacts,
      "how many contacts of a row, from the first on, the exported arrays contact.* can hold; 0: as many as the "
      "model's nconmax, or 500 on MuJoCo 4.0 if that is not set",
      InIdentity::no);
  declare_frame_options(options);
  declare_action_options(options);
}

Env::Env(const Options& options, std::int64_t rows)
    : options_(options),
      task_(task_of(id_of(options_.id()))->build(options_)),
      threads_(threads_for(options_, task_, rows)),
      lanes_(choose_lanes(options_, task_, rows, threads_)),
      frames_(options_, task_.fields[MJENV_ROLE_OBSERVATION], rows, threads_ * std::max<std::int64_t>(lanes_.width, 1)),
      transform_(options_, task_),
      rows_(task_, frames_.record_count(), rows),
      workers_(task_, rows_, threads_, lanes_.width, options_.get("cpu_affinity").integer != 0),
      schema_(task_, frames_, transform_, options_, workers_.first().work()),
      order_(workers_.team_size() > 1 ? rows : 0, rows / static_cast<std::int64_t>(workers_.threads())),
      episodes_(options_, task_, schema_, randomization_, perturbation_, frames_, transform_, rows_),
      pipeline_(std::make_unique<Pipeline>(schema_, rows_, episodes_, workers_)) {
  workers_.prepare(schema_, frames_);
  if (!task_.needs.own.empty()) make_own(task_.needs.own);
  workers_.first().clear();
}

Env::~Env() {
  if (workers_.pool().here()) return;
  // In a forked child, these are leaked, because their destructors would wait for threads that the child does not have.
  static_cast<void>(pipeline_.release());
  workers_.abandon();
}

const Identity& Env::identity() const {
  if (!identity_) identity_ = identity_of(options_, task_, frames_);
  identity_->randomization = randomization_.fingerprint();
  identity_->perturbation = perturbation_.fingerprint();
  return *identity_;
}

void Env::check_received() const {
  if (pipeline_->count() == 0) return;
  workers_.pool().check_here();  // in a forked child, rows that the parent's threads step can never be received
  fail(MJENV_E_PENDING, std::to_string(pipeline_->count()) + " row(s) are under way: receive them first");
}

void Env::check_settled() const {
  check_received();
  check_finished();
}

void Env::check_finished() const {
  if (const std::int64_t row = rows_.first_open(); row >= 0) refuse_open(row);
}

void Env::check_actions(const Action& actions, std::int64_t actions_per_row) const {
  check_count("the action's count", actions.count, rows() * actions_per_row * task_.action_count());
}

// ---- Random streams ----

void Env::seed(const Selection& selected, const std::uint64_t* seeds, std::int64_t count) {
  check_received();
  if (count < 1 || count % selected.count != 0)
    fail(MJENV_E_SIZE, "the count of the seeds' words is " + std::to_string(count) + ", no positive multiple of the " +
                           std::to_string(selected.count) + " row(s)");
  const std::int64_t words = count / selected.count;
  selected.for_each([&](std::int64_t row, std::int64_t place) {
    const std::uint64_t* seed = seeds + place * words;
    if (rows_.has_random_state())
      rows_.set_random_state(row, np::RandomState::from_seed(seed, static_cast<std::size_t>(words)));
    rows_.head(row).rng = Rng::from_seed(seed, static_cast<std::size_t>(words));
    rows_.head(row).seeded = true;
  });
}

void Env::get_stream(std::int64_t row, std::uint64_t* words, std::int64_t count) const {
  check_received();
  if (row == MJENV_ALL_ROWS) {
    check_count("count", count, rows() * kWords);
    for (std::int64_t r = 0; r < rows(); ++r) {
      const Rows::Head& head = rows_.head(r);
      const Rng::Words stream = head.seeded ? head.rng.words() : Rng::Words{};
      std::copy(stream.begin(), stream.end(), words + r * kWords);
    }
    return;
  }
  rows_.check(row);
  check_stream(count, rows_.has_random_state());
  const Rows::Head& head = rows_.head(row);
  if (!head.seeded) fail(MJENV_E_NOT_RESET, in_row(row, "it was never seeded or reset, so it has no random stream"));
  if (count == kStateWords) return rows_.random_state(row).save(words);
  const auto stream = head.rng.words();
  std::copy_n(stream.begin(), count, words);
}

void Env::set_stream(std::int64_t row, const std::uint64_t* words, std::int64_t count) {
  check_received();
  if (row == MJENV_ALL_ROWS) {
    check_count("count", count, rows() * kWords);
    const auto is_given = [&](std::int64_t r) {
      const std::uint64_t* of_row = words + r * kWords;
      return std::any_of(of_row, of_row + kWords, [](std::uint64_t word) { return word != 0; });
    };
    for (std::int64_t r = 0; r < rows(); ++r)
      if (is_given(r)) Rng::check_increment(words[r * kWords + 2]);
    for (std::int64_t r = 0; r < rows(); ++r)
      if (is_given(r)) set_stream(r, words + r * kWords, kWords);
    return;
  }
  rows_.check(row);
  check_stream(count, rows_.has_random_state());
  if (count == kStateWords) {
    np::RandomState state = rows_.random_state(row);
    if (!state.load(words))
      fail(MJENV_E_VALUE, "words are no state of RandomState that mjenv_get_stream could have read");
    rows_.set_random_state(row, state);
    rows_.head(row).seeded = true;
    return;
  }
  Rng::check_increment(words[2]);
  rows_.head(row).rng =
      Rng::from_words({words[0], words[1], words[2], words[3], count == 6 ? words[4] : 0, count == 6 ? words[5] : 0});
  rows_.head(row).seeded = true;
}

void Env::seed_actions(std::uint64_t seed) {
  action_rng_ = Rng::from_seed(seed);
  actions_seeded_ = true;
}

void Env::sample_actions(float* action, std::int64_t count) {
  const std::vector<double>&low = schema_.space(MJENV_ROLE_ACTION).low, &high = schema_.space(MJENV_ROLE_ACTION).high;
  check_count("the action's count", count, rows() * task_.action_count());
  for (std::size_t i = 0; i < low.size(); ++i)
    if (!std::isfinite(low[i]) || !std::isfinite(high[i]))
      fail(MJENV_E_MODEL, (task_.has_own_actions() ? "action " : "actuator ") + std::to_string(i) + " (" +
                              task_.action_label(static_cast<std::int64_t>(i)) + ") has infinite bounds" +
                              (transform_.empty() ? "" : " with the option \"clip_actions\"") +
                              ", so no action can be drawn" +
                              (task_.has_own_actions() ? "" : ": give it a ctrlrange in the model"));
  if (!actions_seeded_) action_rng_ = Rng::from_entropy();
  actions_seeded_ = true;
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
    action[i] = static_cast<float>(action_rng_.uniform(low[i % low.size()], high[i % low.size()]));
}

// ---- Episodes ----

void Env::reset(const std::uint8_t* mask, const mjenv_batch& out) {
  check_settled();
  schema_.check(out, rows());
  workers_.for_rows(masked(mask), [&](Worker& worker, std::int64_t row) {
    episodes_.reset(worker, row, {out, rows(), row});
  });
}

void Env::step(const std::uint8_t* mask, const Action& actions, const mjenv_batch& out) {
  check_settled();
  check_whole();
  check_actions(actions, 1);
  schema_.check(out, rows());
  check_steppable(mask, actions);
  for_teams(mask, actions, {}, out, [&](Team& team) { episodes_.step(team); });
}

void Env::check_steppable(const std::uint8_t* mask, const Action& actions) const {
  const std::int64_t width = task_.action_count();
  masked(mask).for_each([&](std::int64_t row, std::int64_t /*place*/) {
    episodes_.check_steppable(row, episodes_.autoresets());
    episodes_.check_finite(row, actions.part(row * width, width));
  });
}

template <typename Body>
void Env::for_teams(const std::uint8_t* mask, const Action& actions, const Action& ctrl, const mjenv_batch& out,
                    const Body& body) {
  const std::int64_t width = task_.action_count(), nu = task_.model->nu();
  order_.arrange();
  workers_.for_groups(rows(), [&](Team& team, std::int64_t first, std::int64_t last) {
    std::vector<Turn>& turns = team.turns();
    turns.clear();
    for (std::int64_t place = first; place < last; ++place)
      if (const std::int64_t row = order_.row(place); is_selected(mask, row))
        turns.push_back({row,
                         actions.part(row * width, width),
                         {out, rows(), row},
                         ctrl.values ? ctrl.part(row * nu, nu) : Action{}});
    for (const Turn& turn : turns) turn.place.forget();
    body(team);
    for (std::size_t i = 0; i < turns.size(); ++i) order_.note(turns[i].row, team[i].work().constraint_count());
  });
}

// ---- Steps and resets whose outputs the caller computes ----

void Env::check_halves() const {
  if (!task_.physics_only)
    fail(MJENV_E_TASK, options_.id() + " computes its own observations and rewards: use mjenv_reset and mjenv_step");
  check_received();
}

void Env::check_whole() const {
  if (task_.physics_only && task_.has_own_actions())
    fail(MJENV_E_TASK, options_.id() + ": only the program can turn actions into ctrl: use mjenv_advance");
}

void Env::begin(const std::uint8_t* mask, const double* qpos, std::int64_t nq, const double* qvel, std::int64_t nv,
                const mjenv_batch& out) {
  check_halves();
  const std::int64_t width = task_.model->nq(), height = task_.model->nv();
  if (qpos) check_count("nq", nq, rows() * width);
  if (qvel) check_count("nv", nv, rows() * height);
  schema_.check(out, rows());
  const auto initial = [&](std::int64_t row) {
    return Initial{qpos ? qpos + row * width : nullptr, qvel ? qvel + row * height : nullptr};
  };
  const Selection selected = masked(mask);
  selected.for_each([&](std::int64_t row, std::int64_t /*place*/) {
    if (qpos) episodes_.check_given("reset: qpos", row, initial(row).qpos, width);
    if (qvel) episodes_.check_given("reset: qvel", row, initial(row).qvel, height);
  });
  workers_.for_rows(selected, [&](Worker& worker, std::int64_t row) {
    episodes_.begin_given(worker, row, initial(row), {out, rows(), row});
  });
}

void Env::act(const std::uint8_t* mask, const Action& actions, void* seen) {
  check_halves();
  check_actions(actions, 1);
  check_steppable(mask, actions);
  const std::int64_t width = task_.action_count();
  masked(mask).for_each([&](std::int64_t row, std::int64_t /*place*/) {
    episodes_.act(workers_.first(), row, actions.part(row * width, width), seen);
  });
}

void Env::advance(const std::uint8_t* mask, const Action& actions, const double* ctrl, std::int64_t ctrl_count,
                  const mjenv_batch& out) {
  check_halves();
  check_actions(actions, 1);
  const std::int64_t nu = task_.model->nu();
  if (ctrl) check_count("ctrl_count", ctrl_count, rows() * nu);
  if (!ctrl) check_whole();
  schema_.check(out, rows());
  check_steppable(mask, actions);
  masked(mask).for_each([&](std::int64_t row, std::int64_t /*place*/) {
    if (rows_.is_open(row)) refuse_open(row);
    if (ctrl && !episodes_.awaits_reset(row)) episodes_.check_given("before_step: ctrl", row, ctrl + row * nu, nu);
  });
  for_teams(mask, actions, {ctrl, MJENV_DTYPE_FLOAT64, ctrl_count}, out,
            [&](Team& team) { episodes_.advance_given(team); });
}

void Env::finish(const std::uint8_t* mask, const mjenv_batch* given, const mjenv_batch& out) {
  check_halves();
  workers_.pool().check_here();
  schema_.check(out, rows());
  const Selection selected = masked(mask);
  if (!given)
    return selected.for_each([&](std::int64_t row, std::int64_t /*place*/) {
      if (!rows_.is_open(row)) return;
      episodes_.give_up(row);
      forget_observation(row);
    });
  schema_.check(*given, rows(), static_cast<std::int64_t>(frames_.task_count()));
  Writer& writer = workers_.first().writer;
  selected.for_each([&](std::int64_t row, std::int64_t /*place*/) {
    if (rows_.is_open(row)) episodes_.check_given(writer, row, {*given, rows(), row});
  });
  selected.for_each([&](std::int64_t row, std::int64_t /*place*/) {
    episodes_.finish(writer, row, {*given, rows(), row}, {out, rows(), row});
  });
}

void Env::rollout(const Action& actions, std::int64_t steps, const mjenv_batch& out) {
  const std::int64_t width = task_.action_count();
  check_settled();
  check_whole();
  if (steps < 1 || steps > std::numeric_limits<std::int64_t>::max() / (rows() * std::max<std::int64_t>(width, 1)))
    fail(MJENV_E_VALUE, "steps is " + std::to_string(steps) + ", which is less than 1 or too large");
  check_actions(actions, steps);
  schema_.check(out, rows() * steps);
  for (std::int64_t row = 0; row < rows(); ++row) {
    episodes_.check_steppable(row, false);
    episodes_.check_finite(row, actions.part(row * steps * width, steps * width));
  }
  workers_.for_groups(rows(), [&](Team& team, std::int64_t first, std::int64_t last) {
    episodes_.rollout(team, first, last, actions, steps, out);
  });
}

void Env::observe(const mjenv_batch& out) {
  check_received();
  workers_.pool().check_here();
  schema_.check(out, rows());
  for_held_rows_first([&](Worker& worker, std::int64_t row) { episodes_.observe(worker, row, {out, rows(), row}); });
}

void Env::observe(std::int64_t row, const mjenv_batch& out) {
  check_received();
  workers_.pool().check_here();
  rows_.check(row);
  schema_.check(out, rows());
  Worker& worker = workers_.of(row);
  worker.attempt(row, [&] { episodes_.observe(worker, row, {out, rows(), row}); });
  workers_.raise();
}

template <typename Body>
void Env::for_held_rows_first(const Body& body) {
  std::vector<std::uint8_t> done(static_cast<std::size_t>(rows()));
  for (std::int64_t row = 0; row < rows(); ++row) {
    Worker& holder = workers_.of(row);
    if (!holder.holds(row)) continue;
    holder.attempt(row, [&] { body(holder, row); });
    done[static_cast<std::size_t>(row)] = 1;
  }
  workers_.for_rows(masked(nullptr), [&](Worker& worker, std::int64_t row) {
    if (done[static_cast<std::size_t>(row)] == 0) body(worker, row);
  });
}

// ---- Send and receive ----

void Env::send(const std::int64_t* rows_sent, std::int64_t row_count, const Action& actions) {
  check_whole();
  check_finished();
  if (!rows_sent) row_count = rows();
  if (row_count < 0 || row_count > rows())  // checked here so that the product below cannot overflow
    fail(MJENV_E_SIZE,
         "row_count is " + std::to_string(row_count) + ", but there are " + std::to_string(rows()) + " row(s)");
  check_count("the action's count", actions.count, row_count * task_.action_count());
  pipeline_->send(rows_sent, row_count, actions);
}

void Env::receive(std::int64_t least, double timeout, std::int64_t* rows_done, std::int64_t capacity,
                  std::int64_t* count, const mjenv_batch& out) {
  pipeline_->receive(least, timeout, rows_done, capacity, count, out);
}

// ---- State of single rows ----

std::optional<Env::Numbers> Env::numbers(const std::string& name) const {
  const auto found = [&](Part part, std::size_t first, std::size_t count) {
    return Numbers{{name, MJENV_DTYPE_FLOAT64, {static_cast<std::int64_t>(count)}, nullptr}, part, first};
  };
  if (Parameters::is_name(name)) {
    const Field& field = task_.parameters.find(name, options_.id());
    return Numbers{{name, field.type, field.shape, nullptr}, Part::parameters, static_cast<std::size_t>(field.offset)};
  }
  if (Randomization::is_name(name)) {
    const Randomization::Range range = randomization_.find(name);
    return found(Part::ranges, range.first, range.count);
  }
  if (name == kCarried) return found(Part::carried, 0, static_cast<std::size_t>(task_.carry_count));
  if (const auto part = rows_.layout().part(name)) return found(Part::state, part->offset, part->count);
  return std::nullopt;
}

std::optional<Env::Numbers> Env::shown_numbers(const std::string& name) const {
  // With mjenv_build_current, readers see another qpos than the state has (Holder::hold).
  return task_.needs.current && rows_.layout().part(name) ? std::nullopt : numbers(name);
}

void Env::check(const Numbers& numbers, const double* values) const {
  const std::string& name = numbers.array.name;
  switch (numbers.part) {
    case Part::parameters: return task_.parameters.check(task_.parameters.find(name, options_.id()), values);
    case Part::ranges: return randomization_.check(randomization_.find(name), values);
    case Part::carried: return check_carried(*task_.calls, values);
    default: return check_finite(name, values, numbers.array.count());
  }
}

const Array* Env::stored(std::int64_t row, const std::string& name) {
  if (const auto found = shown_numbers(name)) {
    own_array_ = found->array;
    own_array_.data = at(*found, row);
    return &own_array_;
  }
  // Own values of mjModel are read from the row. original.data is null for inputs of mjData, which are read from a work
  // space.
  if (const OwnArray* own = rows_.arrays().find(name); own && own->original.data) {
    own_array_ = own->original;
    own_array_.data = rows_.values(row) + own->offset;
    if (own->shared > 0) {
      own_array_ = *find(task_.model->arrays(), name);
      whole_array_.resize(own->bytes + own->shared);
      own_array_.data = own->complete(rows_.values(row), whole_array_.data());
    }
    return &own_array_;
  }
  return find(task_.model->arrays(), name);
}

const Array& Env::array(std::int64_t row, const std::string& name) {
  check_received();
  rows_.check(row);
  if (const Array* found = stored(row, name)) return *found;
  if (const Array* found = workers_.of(row).array(row, name)) return *found;
  std::vector<std::string> names;
  for (const auto role : {MJENV_ROLE_DATA, MJENV_ROLE_MODEL})
    for (const auto& field : schema_.fields(role)) names.push_back(field.name);
  fail(MJENV_E_NAME,
       "no array " + quoted(name) + choices(name, names, "mjenv_field_at with MJENV_ROLE_DATA and MJENV_ROLE_MODEL"));
}

void Env::read(const std::string& name, double* values, std::size_t each) {
  check_received();
  if (const auto found = shown_numbers(name)) {
    for (std::int64_t row = 0; row < rows(); ++row, values += each) std::copy_n(at(*found, row), each, values);
  } else if (const Array* const of_model = stored(0, name)) {
    of_model->read(values);
    const bool is_own = rows_.arrays().find(name) != nullptr;
    for (std::int64_t row = 1; row < rows(); ++row)
      if (double* const to = values + static_cast<std::size_t>(row) * each; is_own)
        stored(row, name)->read(to);
      else
        std::copy_n(values, each, to);
  } else {
    workers_.pool().check_here();
    for_held_rows_first([&](Worker& worker, std::int64_t row) {
      worker.array(row, name)->read(values + static_cast<std::size_t>(row) * each);
    });
  }
}

void Env::mirror(std::int64_t row, const std::string& name, std::byte* values, std::int64_t bytes) {
  const Array& found = array(row, name);
  Mirror mirror{row, name, found.type, values, {}, shown_numbers(name), {}, part_of(name)};
  const std::vector<Array>& of_data = workers_.of(row).arrays();
  if (const Array* computed = find(of_data, name)) mirror.index = static_cast<std::size_t>(computed - of_data.data());
  if (values) {
    check_count("bytes", bytes, static_cast<std::int64_t>(found.bytes()));
    mirror.shown.resize(found.bytes());
    found.copy(mirror.shown.data());
  }
  const auto is_same = [&](const Mirror& other) { return other.row == row && other.name == name; };
  mirrors_.erase(std::remove_if(mirrors_.begin(), mirrors_.end(), is_same), mirrors_.end());
  if (!values || mirror.shown.empty()) return;
  mirrors_.push_back(std::move(mirror));
  std::memcpy(values, mirrors_.back().shown.data(), mirrors_.back().shown.size());
}

void Env::take_mirrors() {
  struct Taken {
    Mirror& mirror;
    std::vector<double> numbers;
    std::optional<Writing> writing;
  };
  std::vector<Taken> list;
  for (Mirror& mirror : mirrors_) {
    const std::size_t size = mirror.shown.size();
    if (std::memcmp(mirror.values, mirror.shown.data(), std::min(mirror.used, size)) == 0) continue;
    try {
      Taken& taken = list.emplace_back(Taken{mirror, {}, {}});
      with_type(mirror.type, [&](auto zero) {
        const auto* values = reinterpret_cast<const decltype(zero)*>(mirror.values);
        taken.numbers.assign(values, values + size / sizeof zero);
      });
      const auto count = static_cast<std::int64_t>(taken.numbers.size());
      taken.writing = prepare(only(mirror.row), mirror.name, taken.numbers.data(), count);
    } catch (...) {
      std::memcpy(mirror.values, mirror.shown.data(), size);
      throw;
    }
  }
  for (const Taken& taken : list) {
    commit(*taken.writing);
    std::memcpy(taken.mirror.shown.data(), taken.mirror.values, taken.mirror.shown.size());
  }
}

const OwnArray* Env::own_array(Mirror& mirror) const {
  const std::vector<OwnArray>& list = rows_.arrays().list();
  for (; mirror.searched < list.size(); ++mirror.searched)
    if (list[mirror.searched].original.name == mirror.name) mirror.own = mirror.searched;
  return mirror.own ? &list[*mirror.own] : nullptr;
}

void Env::show_mirrors() noexcept {
  if (pipeline_->count() > 0) return;
  for (Mirror& mirror : mirrors_) {
    std::byte* const shown = mirror.shown.data();
    try {
      if (mirror.numbers && mirror.numbers->part == Part::state) {
        std::memcpy(shown, at(*mirror.numbers, mirror.row), mirror.shown.size());
      } else if (mirror.index) {
        const Array& found = workers_.of(mirror.row).array(mirror.row, *mirror.index, mirror.part);
        const std::size_t before = std::min(mirror.used, mirror.shown.size());
        mirror.used = found.copy(shown, before);
        std::memcpy(mirror.values, shown, std::max(before, mirror.used));
        continue;
      } else if (const OwnArray* own = own_array(mirror); own && own->shared == 0) {
        std::memcpy(shown, rows_.values(mirror.row) + own->offset, own->bytes);
      } else if (mirror.numbers || own) {
        const Array& found = array(mirror.row, mirror.name);
        if (found.bytes() != mirror.shown.size()) continue;  // mjenv_randomize has given the draw other parameters
        found.copy(shown);
      } else {
        continue;  // the model's array is as it always was
      }
    } catch (const std::exception&) {  // the row is under way, or MuJoCo fails: who asks for the array gets the error
      continue;
    }
    std::memcpy(mirror.values, shown, mirror.shown.size());
  }
}

void Env::show(std::int64_t row, const std::function<void(const mjModel_&, mjData_*)>& draw) {
  check_received();
  rows_.check(row);
  if (!rows_.head(row).ready) fail(MJENV_E_NOT_RESET, in_row(row, "reset it before it is drawn"));
  workers_.of(row).show(row, draw);
}

void Env::set_state(std::int64_t row, const double* qpos, std::int64_t nq, const double* qvel, std::int64_t nv) {
  check_settled();
  const bool all = row == MJENV_ALL_ROWS;
  if (!all) rows_.check(row);
  const std::int64_t count = all ? rows() : 1, each_nq = task_.model->nq(), each_nv = task_.model->nv();
  check_count("nq", nq, count * each_nq);
  check_count("nv", nv, count * each_nv);
  check_finite("qpos", qpos, static_cast<std::size_t>(nq));
  check_finite("qvel", qvel, static_cast<std::size_t>(nv));
  if (!all) {
    workers_.of(row).set_state(row, qpos, qvel);
    return forget_observation(row);
  }
  workers_.pool().check_here();
  rows_.make_room(Entry::set_state);  // here, because it allocates memory for all rows
  const std::function<void(std::int64_t)> note = [&](std::int64_t i) { forget_observation(i); };
  workers_.for_groups(rows(), [&](Team& team, std::int64_t first, std::int64_t last) {
    team.set_state(first, last, qpos, qvel, note);
  });
}

void Env::reset_data(const Selection& selected) {
  check_settled();
  selected.for_each([&](std::int64_t row, std::int64_t /*place*/) {
    workers_.of(row).clear(row);
    forget_observation(row);
  });
}

void Env::write(const Selection& selected, const std::string& array, const double* values, std::int64_t count) {
  commit(prepare(selected, array, values, count));
}

Env::Writing Env::prepare(const Selection& selected, const std::string& array, const double* values,
                          std::int64_t count) {
  check_received();
  std::optional<Numbers> target;
  if (array != kCarried || task_.physics_only) target = numbers(array);
  std::optional<OwnArray> added;
  const OwnArray* own = target || is_computed(array) ? nullptr : rows_.arrays().find(array);
  if (!target && !own) own = &added.emplace(OwnArray::written(model(), array));
  const auto each = static_cast<std::int64_t>((target ? target->array : own->original).count());
  if (count != each && count != selected.count * each)
    fail(MJENV_E_SIZE,
         "the count of " + quoted(array) + " is " + std::to_string(count) + ", not " + std::to_string(each) +
             (each == 0             ? ": this array is empty in this model"
              : selected.count == 1 ? ""
                                    : " (the same in all rows) or " + std::to_string(selected.count * each) + " (" +
                                          std::to_string(each) + " for each row)"));
  const std::int64_t stride = count == each ? 0 : each;
  const auto of = [&](std::int64_t place) { return values + place * stride; };
  const double* checked = nullptr;  // the values that were checked last; rows may share them
  selected.for_each([&](std::int64_t row, std::int64_t place) {
    if (of(place) == checked) return;
    try {
      target ? check(*target, of(place)) : own->check(of(place));
    } catch (const Error& error) {
      fail(error.status(), in_row(row, error.what()));
    }
    checked = of(place);
  });
  if (!target && each > 0 && !rows_.arrays().find(array)) make_own({array});
  if (!target || target->part == Part::state)
    selected.for_each([&](std::int64_t row, std::int64_t /*place*/) { workers_.of(row).expect_write(row); });
  return {selected, array, std::move(target), values, each, stride};
}

void Env::commit(const Writing& writing) {
  if (writing.each == 0) return;
  writing.selected.for_each([&](std::int64_t row, std::int64_t place) {
    const double* values = writing.values + place * writing.stride;
    const auto& target = writing.target;
    if (target) {
      std::copy_n(values, writing.each, at(*target, row));
      if (target->part == Part::parameters) forget_observation(row);
      if (target->part == Part::state) note_write(row);
      return;
    }
    rows_.keep(row);
    rows_.arrays().find(writing.array)->write(values, rows_.own_values(row));
    note_write(row);
  });
}

// The row's state or own values were written without a worker.
void Env::note_write(std::int64_t row) {
  rows_.head(row).written = Written::by_caller;
  workers_.of(row).note_write(row);
  forget_observation(row);
}

void Env::make_own(const std::vector<std::string>& arrays) {
  workers_.release();  // because add_arrays moves the rows' values, to which work spaces point
  rows_.add_arrays(arrays);
  prepare_workers();
}

// Allocates now what workers need to compute with the rows' own values, because steps and resets must not allocate. If
// memory runs out, the next step or reset tries again.
void Env::prepare_workers() {
  if (rows_.arrays().empty()) return;
  workers_.for_each([](Worker& worker) { worker.forget_layout(); });
  workers_.for_each([&](Worker& worker) { worker.prepare(); });
}

// Prepares all workers, because any of them may compute a row for which mj_setConst was called.
void Env::prepare_constants() {
  workers_.for_each([](Worker& worker) { worker.constants(); });
}

void Env::set_constants(const Selection& selected) {
  check_settled();
  prepare_constants();
  const auto set = [&](Worker& worker, std::int64_t row) {
    const auto names = worker.set_constants(row);
    if (!names.empty()) {
      make_own(names);
      worker.set_constants(row);
    }
    forget_observation(row);
  };
  // On this thread, one row after the other, because make_own moves the values of all rows.
  selected.for_each([&](std::int64_t row, std::int64_t /*place*/) {
    Worker& worker = workers_.of(row);
    worker.attempt(row, [&] { set(worker, row); });
  });
  workers_.raise();
}

void Env::simulate(std::int64_t row, const Action& ctrl, std::int64_t frames) {
  check_settled();
  rows_.check(row);
  check_count("count", ctrl.count, task_.model->nu());
  if (frames < 1) fail(MJENV_E_VALUE, "frames is " + std::to_string(frames) + ", less than 1");
  Worker& worker = workers_.first();
  worker.step.load(row, ctrl);
  worker.step.advance(frames);
  worker.step.commit(row);
  forget_observation(row);
}

void Env::forget_observation(std::int64_t row) {
  if (rows_.has_perturbation()) Perturbation::forget_observation(rows_.perturbation(row));
  if (frames_.record_count() > 0) Frames::forget(rows_.history(row));
}

void Env::compute_reward(const double* achieved, const double* desired, std::int64_t count, double* rewards,
                         std::int64_t reward_count) const {
  check_settled();
  const std::int64_t size = task_.goal_count;
  if (size == 0) fail(MJENV_E_TASK, options_.id() + " has no compute_reward");
  if (count < 0 || count % size != 0 || count / size != reward_count)
    fail(MJENV_E_SIZE, "the count of the goals is " + std::to_string(count) + ", not " + std::to_string(reward_count) +
                           " times " + std::to_string(size));
  for (std::int64_t i = 0; i < reward_count; ++i)
    rewards[i] = task_.calls->compute_reward(achieved + i * size, desired + i * size, size);
}

// ---- Randomisation ----

void Env::randomize(const std::string& text) {
  check_settled();
  DrawDocument document = document_.with(text);
  // All is read and checked, and all memory allocated, before anything changes.
  Randomization draws;
  Perturbation perturbation;
  if (document.replaces_draws()) draws = Randomization(document.draws(model()));
  if (document.replaces_perturbation()) {
    const auto observations = static_cast<std::int64_t>(frames_.task_count());
    const PerturbationSettings settings =
        document.perturbation(model(), schema_.fields(MJENV_ROLE_ACTION), task_.fields[MJENV_ROLE_OBSERVATION]);
    perturbation = Perturbation(settings, model(), task_.action_count(), observations);
  }
  std::vector<std::string> arrays = draws.arrays();
  if (draws.computes_constants()) {
    for (const std::string& name : constant_arrays(model(), arrays)) arrays.push_back(name);
    check_memory(static_cast<std::int64_t>(workers_.threads()), " thread(s)",
                 model().work_bytes() * workers_.team_size());
    workers_.for_each([](Worker& worker) { worker.constants().make_data(); });
  }
  if (perturbation.applies_forces()) arrays.emplace_back("xfrc_applied");
  Zeros ranges = rows_.make_ranges(draws.ranges()), records = rows_.make_perturbation(perturbation.record_count());
  std::vector<Perturbation::Step> steps;
  workers_.for_each([&](Worker& /*worker*/) { steps.push_back(perturbation.make_step()); });
  if (!arrays.empty()) make_own(arrays);
  if (document.replaces_perturbation()) {
    end_pushes();
    workers_.for_each(
        [&](Worker& worker) { worker.perturbed = std::move(steps[static_cast<std::size_t>(worker.index)]); });
    perturbation.place(rows_.arrays());
    rows_.set_perturbation(std::move(records), static_cast<std::size_t>(perturbation.record_count()));
    perturbation_ = std::move(perturbation);
  }
  if (document.replaces_draws()) {
    draws.place(rows_.arrays());
    rows_.set_ranges(std::move(ranges), draws.ranges().size());
    randomization_ = std::move(draws);
  }
  document_ = std::move(document);
}

// Sets to 0 the forces that the pushes of each row's last step have left in its own values.
void Env::end_pushes() {
  if (!perturbation_.applies_forces()) return;
  for (std::int64_t row = 0; row < rows(); ++row) {
    if (!perturbation_.is_pushed(rows_.perturbation(row))) continue;
    rows_.keep(row);
    perturbation_.end_pushes(rows_.perturbation(row), rows_.own_values(row));
    rows_.head(row).written = Written::by_caller;
    workers_.forget(row);
  }
}

// ---- Images ----

void Env::copy_row(const std::uint8_t* mask, std::int64_t from) {
  check_settled();
  rows_.check(from);
  masked(mask).for_each([&](std::int64_t to, std::int64_t /*place*/) {
    if (to == from) return;
    rows_.copy(from, to);
    workers_.forget(to);
  });
}

std::int64_t Env::snapshot_size(std::int64_t row) const {
  check_settled();
  return static_cast<std::int64_t>(image_size(rows_, row));
}

void Env::snapshot(std::int64_t row, void* image) const {
  check_settled();
  write_image(rows_, identity(), row, image);
}

void Env::restore(std::int64_t row, const void* image, std::size_t size) {
  check_settled();
  // Work spaces and workers point to the rows' own values and arrays. These move if the image brings new arrays, even
  // if memory then runs out.
  if (!rows_.arrays().empty()) workers_.release();
  workers_.for_each([](Worker& worker) { worker.forget_layout(); });
  read_image(rows_, task_, randomization_, perturbation_, frames_, identity(), options_.id(), row, image, size);
  const Selection restored = row == MJENV_ALL_ROWS ? masked(nullptr) : only(row);
  bool set_constants = false;
  restored.for_each([&](std::int64_t i, std::int64_t /*place*/) {
    workers_.forget(i);
    rows_.set_phase(i, Phase::done);
    set_constants = set_constants || rows_.has(i, Entry::set_constants);
  });
  try {
    prepare_workers();
    if (set_constants) prepare_constants();
  } catch (const std::bad_alloc&) {  // the rows are already restored; their first step allocates what is missing
  }
}

}  // namespace mjenv::core
