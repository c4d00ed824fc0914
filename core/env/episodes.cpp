// Episodes: reset, step and rollout, and what they write.
#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "env/env.hpp"
#include "error.hpp"

namespace mjenv::core {
namespace {

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

void Env::Failures::add(mjenv_status kind, const std::string& what) noexcept {
  if (status != MJENV_E_MEMORY) status = kind;
  try {
    text += (text.empty() ? "" : "; ") + what;
  } catch (const std::exception&) {  // the failure stays known, its text is lost
    status = MJENV_E_MEMORY;
  }
}

void Env::Failures::raise() {
  if (status == MJENV_OK) return;
  Failures all = std::exchange(*this, {});
  fail(all.status, std::move(all.text));
}

template <typename Body>
void Env::for_rows(const Body& body) {
  const auto threads = static_cast<std::int64_t>(workers_.size());
  const auto first = [&](std::int64_t index) { return rows() * index / threads; };
  // How many rows a worker takes at once: the larger, the more it waits at the end for those that others took.
  const std::int64_t taken = threads == 1 ? rows() : std::clamp<std::int64_t>(rows() / (128 * threads), 1, 64);
  for (std::int64_t i = 0; i < threads; ++i) workers_[i]->next.store(first(i), std::memory_order_relaxed);
  const auto block = [&](int index) {
    const ErrorTrap trap;
    for (std::int64_t i = 0; i < threads; ++i) {
      const std::int64_t other = (index + i) % threads, end = first(other + 1);
      auto& next = workers_[other]->next;
      for (std::int64_t row; (row = next.fetch_add(taken, std::memory_order_relaxed)) < end;)
        for (const std::int64_t last = std::min(row + taken, end); row < last; ++row)
          attempt(*workers_[index], row, body);
    }
  };
  pool_->run(std::cref(block));
  Failures failures;
  for (auto& worker : workers_) {
    const Failures own = std::exchange(worker->failures, {});
    if (own.status != MJENV_OK) failures.add(own.status, own.text);
  }
  failures.raise();
}

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
  Head& head = heads_[row];
  head.rng = rng;  // even if MuJoCo fails now: else every further try would begin, and fail, alike
  head.seeded = true;
  work.load(start);
  work.forward();
  commit(worker, row, Origin::forward);
  head.steps = 0;
  head.ready = true;
  head.ended = false;
}

void Env::reset(const std::uint8_t* mask, const mjenv_batch* out) {
  check_settled();
  check_out(out, rows(), reset_info_);
  for_rows([&](Worker& worker, std::int64_t row) {
    if (mask && !mask[row]) return;
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
    if (out) put<std::int32_t>(out->status, place, MJENV_E_PHYSICS);  // until it has gone well
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
  std::int32_t status = MJENV_OK;  // of the step; the row's is also that of the reset
  if (out && out->status) status = std::exchange(out->status[place.index], MJENV_E_PHYSICS);
  begin_episode(worker, row);
  if (!out) return;
  put<std::int32_t>(out->status, place, status);
  write_reset(worker, out->reset_info, place);
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

}  // namespace mjenv::core
