#include "env/episodes.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "error.hpp"

namespace mjenv::core {

namespace {

// Calls body. If it throws, writes the row's status: that of the error if it is MJENV_E_TASK, MJENV_E_VALUE or
// MJENV_E_MODEL (a draw was refused), else MJENV_E_PHYSICS.
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

// Which of the steps can be advanced together: bit i for element i.
template <typename Begun, std::size_t count>
std::uint32_t bits_of(const std::array<std::optional<Begun>, count>& begun) {
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < count; ++i)
    if (begun[i] && !begun[i]->alone) bits |= 1u << i;
  return bits;
}

}  // namespace

Episodes::Episodes(const Options& options, const Task& task, const Schema& schema, const Randomization& randomization,
                   const Perturbation& perturbation, Rows& rows)
    : task_(task),
      schema_(schema),
      randomization_(randomization),
      perturbation_(perturbation),
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
  for (std::int64_t i = 0; i < action.count; ++i)
    if (!std::isfinite(action[i]))
      fail(MJENV_E_VALUE, in_row(row, element_is("action", static_cast<std::size_t>(i), action[i]) +
                                          ", but must be finite; set the option \"strict\" to 0 to allow it"));
}

void Episodes::begin(Worker& worker, std::int64_t row) const {
  Rows::Head& head = rows_.head(row);
  Rng rng = head.seeded ? head.rng : Rng::from_entropy();
  worker.begin(rows_, row, rng, randomization_);
  head.steps = 0;
  head.ready = true;
  head.ended = false;
  if (rows_.has_perturbation()) perturbation_.begin(rows_.perturbation(row), head.rng);
}

void Episodes::reset(Worker& worker, std::int64_t row, const Place& place) const {
  const mjenv_batch& out = place.out;
  report_failure(place, [&] {
    begin(worker, row);
    place.put_result(0, false, false);
    place.put_status(MJENV_OK);
    place.clear(schema_.fields(MJENV_ROLE_INFO), out.info);
    write_reset(worker, row, place);
  });
}

void Episodes::write_reset(Worker& worker, std::int64_t row, const Place& place) const {
  // Calls adopt even if observe or reset_info fails, because the row has begun the episode by then.
  struct Adoption {
    Worker& worker;
    Rows& rows;
    std::int64_t row;
    ~Adoption() { worker.adopt(rows, row); }
  };
  const Adoption after_outputs{worker, rows_, row};
  const mjenv_batch& out = place.out;
  write_observation(worker, row, out.obs, place);
  place.put<std::uint8_t>(out.was_reset, 1);
  if (out.reset_info && task_.calls->has_reset_info())
    place.put(schema_.fields(MJENV_ROLE_RESET_INFO), task_.calls->reset_info(worker.work()), out.reset_info);
  worker.write_arrays(schema_, place);
}

void Episodes::write_observation(Worker& worker, std::int64_t row, void* to, const Place& place) const {
  if (!is_perturbed(row) || !perturbation_.changes_observations()) return worker.write_observation(to, place);
  Rows::Head& head = rows_.head(row);
  const double* observation = worker.observation();
  worker.write_observation(perturbation_.observe(rows_.perturbation(row), head.steps, observation, head.rng), to,
                           place);
}

void Episodes::step(Worker& worker, const Turn& turn) const {
  if (awaits_reset(turn.row)) return reset(worker, turn.row, turn.place);
  report_failure(turn.place, [&] {
    Begun begun = begin_step(worker, turn);
    advance(worker, turn, begun);
    end_step_and_reset(worker, turn, begun);
  });
}

void Episodes::step(Team& team) const {
  const std::vector<Turn>& turns = team.turns();
  std::array<std::optional<Begun>, Team::kMaxSize> begun;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const Turn& turn = turns[i];
    team[i].attempt(turn.row, [&] {
      if (awaits_reset(turn.row)) return reset(team[i], turn.row, turn.place);
      report_failure(turn.place, [&] { begun[i] = begin_step_in_team(team[i], turn); });
    });
  }
  const std::uint32_t advanced = team.step(bits_of(begun), task_.frame_skip);
  for (std::size_t i = 0; i < turns.size(); ++i) {
    if (!begun[i]) continue;
    const Turn& turn = turns[i];
    team[i].attempt(turn.row, [&] {
      report_failure(turn.place, [&] {
        if (!(advanced >> i & 1)) advance(team[i], turn, *begun[i]);
        end_step_and_reset(team[i], turn, *begun[i]);
      });
    });
  }
  team.gather_failures();
}

Episodes::Begun Episodes::begin_step(Worker& worker, const Turn& turn) const {
  Begun begun{Worker::random(rows_, turn.row), turn.action, nullptr, is_perturbed(turn.row), false};
  if (!begun.perturbed) return begun;
  begun.seen = perturbation_.begin_step(rows_.perturbation(turn.row), rows_.head(turn.row).steps, turn.action,
                                        begun.random.rng(), worker.perturbed);
  begun.forces = &worker.perturbed.forces;
  return begun;
}

Episodes::Begun Episodes::begin_step_in_team(Worker& worker, const Turn& turn) const {
  Begun begun = begin_step(worker, turn);
  begun.alone = rows_.has_forces(turn.row) || (begun.forces && !begun.forces->empty());
  if (!begun.alone) worker.begin_step(rows_, turn.row, begun.seen, begun.forces);  // else advance begins it
  return begun;
}

void Episodes::advance(Worker& worker, const Turn& turn, const Begun& begun) const {
  worker.step(rows_, turn.row, begun.seen, task_.frame_skip, begun.forces);
}

// Writes the step's reward, flags, status and info.
Episodes::Ends Episodes::end_step(Worker& worker, const Turn& turn, Begun& begun) const {
  const std::int64_t row = turn.row;
  const Place& place = turn.place;
  Rows::Head& head = rows_.head(row);
  const mjenv_outcome outcome = task_.calls->step(worker.work(), begun.seen, begun.random);
  place.put(schema_.fields(MJENV_ROLE_INFO), outcome.info, place.out.info);
  const bool diverged = worker.work().diverged();
  worker.commit(rows_, row, begun.random);
  if (begun.perturbed) perturbation_.end_step(rows_.perturbation(row), head.steps, turn.action, worker.perturbed);

  ++head.steps;
  const bool terminated = outcome.terminated != 0 || (diverged && ends_on_divergence_);
  const bool truncated = max_episode_steps_ > 0 && head.steps >= max_episode_steps_;
  head.ended = terminated || truncated;
  place.put_result(outcome.reward, terminated, truncated);
  place.put_status(diverged ? MJENV_E_PHYSICS : MJENV_OK);
  return {terminated, truncated};
}

void Episodes::end_step_and_reset(Worker& worker, const Turn& turn, Begun& begun) const {
  const Place& place = turn.place;
  const mjenv_batch& out = place.out;
  const Ends ends = end_step(worker, turn, begun);
  const bool resets = autoresets_in_same_step() && ends.any();
  write_observation(worker, turn.row, resets ? out.final_obs : out.obs, place);
  if (!resets) {
    place.put<std::uint8_t>(out.was_reset, 0);
    return worker.write_arrays(schema_, place);
  }
  place.copy(schema_.fields(MJENV_ROLE_INFO), out.info, out.final_info);
  place.clear(schema_.fields(MJENV_ROLE_INFO), out.info);
  begin(worker, turn.row);
  write_reset(worker, turn.row, place);
}

Turn Episodes::rollout_turn(std::int64_t row, const Action& actions, std::int64_t steps, std::int64_t t,
                            const mjenv_batch& out) const {
  const std::int64_t element = row * steps + t, nu = task_.model->nu();
  return {row, actions.part(element * nu, nu), {out, rows_.count() * steps, element}};
}

Episodes::Ends Episodes::end_step_in_rollout(Worker& worker, const Turn& turn, Begun& begun) const {
  const Ends ends = end_step(worker, turn, begun);
  write_observation(worker, turn.row, turn.place.out.obs, turn.place);
  worker.write_arrays(schema_, turn.place);
  return ends;
}

void Episodes::stay(Worker& worker, const Turn& turn, Ends ends) const {
  const Place& place = turn.place;
  place.put_result(0, ends.terminated, ends.truncated);
  place.put_status(MJENV_OK);
  place.clear(schema_.fields(MJENV_ROLE_INFO), place.out.info);
  observe(worker, turn.row, place);
}

void Episodes::rollout(Worker& worker, std::int64_t row, const Action& actions, std::int64_t steps,
                       const mjenv_batch& out) const {
  Ends ends{};
  for (std::int64_t t = 0; t < steps; ++t) {
    const Turn turn = rollout_turn(row, actions, steps, t, out);
    report_failure(turn.place, [&] {
      turn.place.put<std::uint8_t>(out.was_reset, 0);
      if (ends.any()) return stay(worker, turn, ends);
      Begun begun = begin_step(worker, turn);
      advance(worker, turn, begun);
      ends = end_step_in_rollout(worker, turn, begun);
    });
  }
}

void Episodes::rollout(Team& team, std::int64_t first, std::int64_t last, const Action& actions, std::int64_t steps,
                       const mjenv_batch& out) const {
  const auto count = static_cast<std::size_t>(last - first);
  std::array<Ends, Team::kMaxSize> ends{};
  std::uint32_t playing = (1u << count) - 1;  // the rows, as bits, that have not failed
  for (std::int64_t t = 0; t < steps; ++t) {
    std::vector<Turn>& turns = team.turns();
    turns.clear();
    for (std::int64_t row = first; row < last; ++row) turns.push_back(rollout_turn(row, actions, steps, t, out));
    const auto for_playing = [&](const auto& body) {
      for (std::size_t i = 0; i < count; ++i) {
        if (!(playing >> i & 1)) continue;
        const bool is_well =
            team[i].attempt(turns[i].row, [&] { report_failure(turns[i].place, [&] { body(i, team[i], turns[i]); }); });
        if (!is_well) playing &= ~(1u << i);
      }
    };
    std::array<std::optional<Begun>, Team::kMaxSize> begun;
    for_playing([&](std::size_t i, Worker& worker, const Turn& turn) {
      turn.place.put<std::uint8_t>(out.was_reset, 0);
      if (!ends[i].any()) begun[i] = begin_step_in_team(worker, turn);
    });
    const std::uint32_t advanced = team.step(bits_of(begun), task_.frame_skip);
    for_playing([&](std::size_t i, Worker& worker, const Turn& turn) {
      if (!begun[i]) return stay(worker, turn, ends[i]);
      if (!(advanced >> i & 1)) advance(worker, turn, *begun[i]);
      ends[i] = end_step_in_rollout(worker, turn, *begun[i]);
    });
  }
  team.gather_failures();
}

void Episodes::observe(Worker& worker, std::int64_t row, const Place& place) const {
  worker.hold(rows_, row);
  const double* last = is_perturbed(row) ? perturbation_.last_observation(rows_.perturbation(row)) : nullptr;
  if (last)
    worker.write_observation(last, place.out.obs, place);
  else
    worker.write_observation(place.out.obs, place);
  worker.write_arrays(schema_, place);
}

}  // namespace mjenv::core
