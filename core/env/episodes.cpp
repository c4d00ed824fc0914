#include "env/episodes.hpp"

#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "error.hpp"

namespace mjenv::core {

namespace {

// Calls body. If it throws, writes the row's status: the error's own if this is MJENV_E_TASK, MJENV_E_VALUE (a value
// that a reset drew or that the task wrote was refused) or MJENV_E_MODEL (mj_setConst would change an array that all
// rows share), otherwise MJENV_E_PHYSICS.
template <typename Body>
void report_failure(const Place& place, const Body& body) {
  try {
    body();
  } catch (const Error& error) {
    const mjenv_status status = error.status();
    const bool has_own = status == MJENV_E_TASK || status == MJENV_E_VALUE || status == MJENV_E_MODEL;
    place.put_status(has_own ? status : MJENV_E_PHYSICS);
    throw;
  } catch (...) {
    place.put_status(MJENV_E_PHYSICS);
    throw;
  }
}

// Calls adopt in its destructor, because the row has begun the episode even if writing its outputs fails.
struct Adoption {
  Worker& worker;
  std::int64_t row;
  ~Adoption() { worker.reset.adopt(row); }
};

}  // namespace

Episodes::Episodes(const Options& options, const Task& task, const Schema& schema, const Randomization& randomization,
                   const Perturbation& perturbation, const Frames& frames, const ActionTransform& transform, Rows& rows)
    : id_(options.id()),
      task_(task),
      schema_(schema),
      randomization_(randomization),
      perturbation_(perturbation),
      frames_(frames),
      transform_(transform),
      rows_(rows),
      max_episode_steps_(options.get("max_episode_steps").integer),
      strict_(options.get("strict").integer != 0),
      ends_on_divergence_(options.get("on_divergence").text == "terminate"),
      autoreset_(options.get("autoreset_mode").text == "next_step"   ? Autoreset::next_step
                 : options.get("autoreset_mode").text == "same_step" ? Autoreset::same_step
                                                                     : Autoreset::disabled) {}

void Episodes::check_steppable(std::int64_t row, bool resets) const {
  const Rows::Head& head = rows_.head(row);
  if (!head.ready) fail(MJENV_E_NOT_RESET, in_row(row, "reset it before the first step"));
  if (strict_ && head.ended && !resets)
    fail(MJENV_E_EPISODE_ENDED,
         in_row(row, "its episode has ended: reset it, or set the option \"strict\" to 0 to continue"));
}

void Episodes::check_finite(std::int64_t row, const Action& action) const {
  if (!strict_ || awaits_reset(row)) return;
  const bool is_transformed = !transform_.empty();  // clipping then turns infinity into a bound
  for (std::int64_t i = 0; i < action.count; ++i)
    if (!std::isfinite(is_transformed ? transform_.at(action, i) : action[i]))
      fail(MJENV_E_VALUE, in_row(row, element_is("action", static_cast<std::size_t>(i), action[i]) +
                                          ", but must be finite; set the option \"strict\" to 0 to allow it"));
}

void Episodes::begin(Worker& worker, std::int64_t row, const Initial& initial) const {
  Rows::Head& head = rows_.head(row);
  Rng rng = head.seeded ? head.rng : Rng::from_entropy();
  worker.reset.begin(row, rng, randomization_, initial);
  head.steps = 0;
  head.ready = true;
  head.ended = false;
  rows_.set_phase(row, Phase::done);
  if (rows_.has_perturbation()) perturbation_.begin(rows_.perturbation(row), head.rng);
}

void Episodes::reset(Worker& worker, std::int64_t row, const Place& place) const {
  report_failure(place, [&] { reset_row(worker, row, place); });
}

void Episodes::reset_row(Worker& worker, std::int64_t row, const Place& place) const {
  begin(worker, row);
  place.put_result(0, false, false);
  place.put_status(MJENV_OK);
  place.clear(schema_.fields(MJENV_ROLE_INFO), place.out.info);
  write_reset(worker, row, place);
}

void Episodes::write_reset(Worker& worker, std::int64_t row, const Place& place) const {
  const Adoption after_outputs{worker, row};
  const mjenv_batch& out = place.out;
  write_observation(worker, row, out.obs, place);
  place.put<std::uint8_t>(out.was_reset, 1);
  if (out.reset_info && task_.calls->has_reset_info())
    place.put(schema_.fields(MJENV_ROLE_RESET_INFO), task_.calls->reset_info(worker.view()), out.reset_info);
  worker.writer.write_arrays(schema_, place);
}

void Episodes::write_observation(Worker& worker, std::int64_t row, void* to, const Place& place) const {
  Writer& writer = worker.writer;
  const bool is_changed = is_perturbed(row) && perturbation_.changes_observations();
  if (!is_changed && frames_.empty()) return writer.write_observation(to, place);
  writer.write_observation(seen(row, writer.observation(), writer), to, place);
}

const double* Episodes::seen(std::int64_t row, const double* observation, Writer& writer) const {
  Rows::Head& head = rows_.head(row);
  if (is_perturbed(row) && perturbation_.changes_observations())
    observation = perturbation_.observe(rows_.perturbation(row), head.steps, observation, head.rng);
  return frames_.empty() ? observation : frames_.add(rows_.history(row), observation, head.steps, writer.scratch());
}

template <typename Body>
void Episodes::for_turns(Team& team, std::uint32_t& turns, const Body& body) const {
  for (std::size_t i = 0; turns >> i != 0; ++i) {
    if ((turns >> i & 1) == 0) continue;
    const Turn& turn = team.turns()[i];
    if (!team[i].attempt(turn.row, [&] { report_failure(turn.place, [&] { body(i); }); })) turns &= ~(1u << i);
  }
}

void Episodes::step(Team& team) const {
  std::vector<Turn>& turns = team.turns();
  std::uint32_t all = (1u << turns.size()) - 1, moving = 0;
  for_turns(team, all, [&](std::size_t i) {
    if (awaits_reset(turns[i].row)) return reset_row(team[i], turns[i].row, turns[i].place);
    begin_step(team[i], turns[i]);
    moving |= 1u << i;
  });
  advance(team, moving);
  for_turns(team, moving, [&](std::size_t i) {
    try {
      end_step_and_reset(team[i], turns[i]);
    } catch (...) {
      turns[i].place.forget();
      throw;
    }
  });
  team.gather_failures();
}

void Episodes::advance(Team& team, std::uint32_t& moving) const {
  const auto load = [&](std::size_t i) {
    Turn& turn = team.turns()[i];
    if (!task_.calls->has_control()) return team[i].step.load(turn.row, turn.seen, turn.pushes);
    turn.random = turn.begun;  // restored, because the row may be loaded a second time (Team::advance)
    team[i].step.begin(turn.row, turn.seen, turn.pushes, turn.random);
  };
  const auto attempt = [&](std::size_t i, const auto& body) {
    std::uint32_t turn = 1u << i;
    for_turns(team, turn, [&](std::size_t) { body(); });
    return turn != 0;
  };
  team.advance(moving, task_.frame_skip, load, attempt);
}

void Episodes::begin_step(Worker& worker, Turn& turn) const {
  turn.random = worker.step.random(turn.row);
  turn.is_perturbed = is_perturbed(turn.row);
  if (!transform_.empty()) turn.action = transform_.apply(turn.action, worker.transformed);
  turn.seen = turn.action;
  if (turn.is_perturbed) {
    turn.seen = perturbation_.act(rows_.perturbation(turn.row), rows_.head(turn.row).steps, turn.action,
                                  turn.random.rng(), worker.perturbed);
    turn.pushes = &worker.perturbed.done;
  }
  if (task_.calls->has_control()) turn.begun = turn.random;
}

mjenv_outcome Episodes::commit(Worker& worker, Turn& turn) const {
  const std::int64_t row = turn.row;
  const mjenv_outcome outcome = worker.step.call(row, turn.seen, turn.random);
  worker.step.commit(row, &turn.random);
  if (turn.is_perturbed)
    perturbation_.commit(rows_.perturbation(row), rows_.head(row).steps, turn.action, worker.perturbed);
  return outcome;
}

Episodes::Ends Episodes::end_step(Worker& worker, Turn& turn) const {
  const bool diverged = worker.work().diverged();
  const mjenv_outcome outcome = commit(worker, turn);
  turn.place.put(schema_.fields(MJENV_ROLE_INFO), outcome.info, turn.place.out.info);
  return count_step(turn.row, turn.place, outcome.reward, outcome.terminated != 0, diverged);
}

Episodes::Ends Episodes::count_step(std::int64_t row, const Place& place, double reward, bool terminated,
                                    bool diverged) const {
  Rows::Head& head = rows_.head(row);
  ++head.steps;
  const Ends ends{terminated || (diverged && ends_on_divergence_),
                  max_episode_steps_ > 0 && head.steps >= max_episode_steps_};
  head.ended = ends.any();
  place.put_result(reward, ends.terminated, ends.truncated);
  place.put_status(diverged ? MJENV_DIVERGED : MJENV_OK);
  return ends;
}

void Episodes::end_step_and_reset(Worker& worker, Turn& turn) const {
  const Place& place = turn.place;
  const mjenv_batch& out = place.out;
  const Ends ends = end_step(worker, turn);
  const bool resets = autoresets_in_same_step() && ends.any();
  write_observation(worker, turn.row, resets ? out.final_obs : out.obs, place);
  if (!resets) {
    place.put<std::uint8_t>(out.was_reset, 0);
    return worker.writer.write_arrays(schema_, place);
  }
  place.copy(schema_.fields(MJENV_ROLE_INFO), out.info, out.final_info);
  place.clear(schema_.fields(MJENV_ROLE_INFO), out.info);
  begin(worker, turn.row);
  write_reset(worker, turn.row, place);
}

Turn Episodes::rollout_turn(std::int64_t row, const Action& actions, std::int64_t steps, std::int64_t t,
                            const mjenv_batch& out) const {
  const std::int64_t element = row * steps + t, width = task_.action_count();
  return {row, actions.part(element * width, width), {out, rows_.count() * steps, element}};
}

void Episodes::stay(Worker& worker, const Turn& turn, Ends ends) const {
  const Place& place = turn.place;
  place.put_result(0, ends.terminated, ends.truncated);
  place.put_status(MJENV_OK);
  place.clear(schema_.fields(MJENV_ROLE_INFO), place.out.info);
  observe(worker, turn.row, place);
}

void Episodes::rollout(Team& team, std::int64_t first, std::int64_t last, const Action& actions, std::int64_t steps,
                       const mjenv_batch& out) const {
  std::vector<Turn>& turns = team.turns();
  std::array<Ends, Team::kMaxSize> ends{};
  std::uint32_t playing = (1u << (last - first)) - 1;  // the rows, as bits, that have not failed
  for (std::int64_t t = 0; t < steps; ++t) {
    turns.clear();
    for (std::int64_t row = first; row < last; ++row) turns.push_back(rollout_turn(row, actions, steps, t, out));
    std::uint32_t moving = 0;
    for_turns(team, playing, [&](std::size_t i) {
      turns[i].place.put<std::uint8_t>(out.was_reset, 0);
      if (ends[i].any()) return stay(team[i], turns[i], ends[i]);
      begin_step(team[i], turns[i]);
      moving |= 1u << i;
    });
    const std::uint32_t begun = moving;
    advance(team, moving);
    for_turns(team, moving, [&](std::size_t i) {
      ends[i] = end_step(team[i], turns[i]);
      write_observation(team[i], turns[i].row, out.obs, turns[i].place);
      team[i].writer.write_arrays(schema_, turns[i].place);
    });
    playing &= ~(begun & ~moving);
  }
  team.gather_failures();
}

template <typename Observation>
const double* Episodes::present(std::int64_t row, const Observation& observation, Writer& writer) const {
  const double* last = is_perturbed(row) ? perturbation_.last_observation(rows_.perturbation(row)) : nullptr;
  if (frames_.empty()) return last ? last : observation();
  const double* history = rows_.history(row);
  if (const double* whole = frames_.last(history)) return whole;
  return frames_.show(history, last ? last : observation(), rows_.head(row).steps, writer.scratch());
}

void Episodes::observe(Worker& worker, std::int64_t row, const Place& place) const {
  worker.hold(row);
  Writer& writer = worker.writer;
  const auto own = [&] { return writer.observation(); };
  if (place.out.obs) writer.write_observation(present(row, own, writer), place.out.obs, place);
  writer.write_arrays(schema_, place);
}

// ---- Resets and steps whose outputs the caller computes ----

void Episodes::begin_given(Worker& worker, std::int64_t row, const Initial& initial, const Place& place) const {
  report_failure(place, [&] {
    const bool follows_step = rows_.phase(row) == Phase::ended && rows_.head(row).ended;
    begin(worker, row, initial);
    rows_.head(row).ended = true;  // until the reset is finished: a row that is given up must be reset again
    rows_.set_phase(row, follows_step ? Phase::restarted : Phase::begun);
    const Adoption after_outputs{worker, row};
    if (!follows_step) place.put_status(MJENV_OK);
    place.put<std::uint8_t>(place.out.was_reset, 1);
    worker.writer.write_arrays(schema_, place);
  });
}

void Episodes::act(Worker& worker, std::int64_t row, const Action& action, void* seen) const {
  const mjenv_batch none{};
  Turn turn{row, action, {none, rows_.count(), row}};
  begin_step(worker, turn);
  const std::size_t bytes =
      static_cast<std::size_t>(action.count) * (action.dtype == MJENV_DTYPE_FLOAT32 ? sizeof(float) : sizeof(double));
  std::memcpy(static_cast<std::byte*>(seen) + static_cast<std::size_t>(row) * bytes, turn.seen.values, bytes);
}

void Episodes::advance_given(Team& team) const {
  std::vector<Turn>& turns = team.turns();
  std::uint32_t all = (1u << turns.size()) - 1, moving = 0;
  for_turns(team, all, [&](std::size_t i) {
    Turn& turn = turns[i];
    rows_.set_phase(turn.row, Phase::done);
    turn.place.put<std::uint8_t>(turn.place.out.was_reset, awaits_reset(turn.row) ? 1 : 0);
    if (awaits_reset(turn.row)) return turn.place.put_status(MJENV_OK);
    begin_step(team[i], turn);
    if (turn.ctrl.values) turn.seen = turn.ctrl;
    moving |= 1u << i;
  });
  advance(team, moving);
  for_turns(team, moving, [&](std::size_t i) {
    const Turn& turn = turns[i];
    const bool diverged = team[i].work().diverged();
    commit(team[i], turns[i]);
    rows_.set_phase(turn.row, diverged ? Phase::diverged : Phase::advanced);
    turn.place.put_status(diverged ? MJENV_DIVERGED : MJENV_OK);
    team[i].writer.write_arrays(schema_, turn.place);
  });
  team.gather_failures();
}

void Episodes::check_given(Writer& writer, std::int64_t row, const Place& given) const {
  if (!strict_) return;
  const double* observation = writer.given_observation(given);
  for (std::size_t i = 0; i < frames_.task_count(); ++i)
    if (std::isnan(observation[i])) refuse(row, "observe: observation[" + std::to_string(i) + "] is NaN");
  if (given.out.reward && rows_.phase(row) >= Phase::advanced && std::isnan(given.get(given.out.reward)))
    refuse(row, "step: the reward is NaN");
}

void Episodes::check_given(const char* array, std::int64_t row, const double* values, std::int64_t count) const {
  for (std::int64_t i = 0; strict_ && i < count; ++i)
    if (!std::isfinite(values[i])) refuse(row, element_is(array, static_cast<std::size_t>(i), values[i]));
}

void Episodes::refuse(std::int64_t row, const std::string& why) const {
  fail(MJENV_E_TASK, in_row(row, id_ + ": " + why));
}

void Episodes::finish(Writer& writer, std::int64_t row, const Place& given, const Place& place) const {
  const mjenv_batch& out = place.out;
  const std::vector<Field>& infos = schema_.fields(MJENV_ROLE_INFO);
  const auto observation = [&] { return writer.given_observation(given); };
  const auto put = [&](mjenv_role role, const double* from, double* to) {
    from ? place.copy(schema_.fields(role), from, to) : place.clear(schema_.fields(role), to);
  };
  const Phase phase = rows_.phase(row);
  if (!rows_.is_open(row)) {
    if (out.obs) writer.write_observation(present(row, observation, writer), out.obs, place);
    return;
  }
  rows_.set_phase(row, Phase::done);
  if (phase == Phase::begun || phase == Phase::restarted) {
    rows_.head(row).ended = false;
    if (phase == Phase::begun) place.put_result(0, false, false), place.put_status(MJENV_OK);
    place.put<std::uint8_t>(out.was_reset, 1);
    place.clear(infos, out.info);
    put(MJENV_ROLE_RESET_INFO, given.out.reset_info, out.reset_info);
    return writer.write_observation(seen(row, observation(), writer), out.obs, place);
  }
  const double reward = given.out.reward ? given.get(given.out.reward) : 0;
  const bool terminated = given.out.terminated && given.get(given.out.terminated) != 0;
  const Ends ends = count_step(row, place, reward, terminated, phase == Phase::diverged);
  const bool resets = autoresets_in_same_step() && ends.any();
  place.put<std::uint8_t>(out.was_reset, resets ? 1 : 0);
  put(MJENV_ROLE_INFO, given.out.info, out.info);
  const double* what = seen(row, observation(), writer);
  if (resets) {
    rows_.set_phase(row, Phase::ended);
    put(MJENV_ROLE_INFO, given.out.info, out.final_info);
    writer.write_observation(what, out.final_obs, place);
  }
  writer.write_observation(what, out.obs, place);
}

void Episodes::give_up(std::int64_t row) const {
  const Phase phase = rows_.phase(row);
  rows_.set_phase(row, Phase::done);
  const mjenv_batch none{};
  if (phase >= Phase::advanced) count_step(row, {none, rows_.count(), row}, 0, false, phase == Phase::diverged);
}

}  // namespace mjenv::core
