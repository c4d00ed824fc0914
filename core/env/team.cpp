#include "env/team.hpp"

#include <algorithm>
#include <array>

namespace mjenv::core {

std::size_t Team::bytes(const Model& model, int lanes) {
  const std::size_t work_spaces = model.work_bytes() * static_cast<std::size_t>(std::max(lanes, 1));
  return lanes > 0 ? work_spaces + lanes::stepper_bytes(model, lanes) : work_spaces;
}

Team::Team(std::int32_t index, const Task& task, Rows& rows, int lanes) {
  for (std::int32_t i = 0; i < std::max(lanes, 1); ++i)
    workers_.push_back(std::make_unique<Worker>(index + i, task, rows));
  if (lanes > 0) stepper_ = lanes::make_stepper(*task.model, *lanes::code_of(lanes));
  turns_.reserve(size());
}

template <typename Step>
std::uint32_t Team::together(std::uint32_t ready, const Step& step) {
  std::array<Work*, kMaxSize> works{};
  std::array<Worker*, kMaxSize> workers{};
  int count = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    if (!(ready >> i & 1)) continue;
    works[count] = &workers_[i]->work();
    workers[count++] = workers_[i].get();
  }
  if (count < 2) return 0;  // load has failed for the other rows, and a single row is faster without lanes
  const std::uint32_t done = step(works.data(), workers, count);
  std::uint32_t all = 0;
  for (int i = 0; i < count; ++i)
    if (done >> i & 1) all |= 1u << (workers[i]->index - workers_[0]->index);
  return all;
}

std::uint32_t Team::step_together(std::uint32_t ready, std::int64_t frames) {
  return together(ready, [&](Work* const* works, const auto& workers, int count) {
    std::array<double*, kMaxSize> before{};
    for (int i = 0; i < count; ++i) before[i] = workers[i]->before();
    const lanes::Stepper::BeforeSubstep before_substep = [&](int i, std::int64_t substep) {
      workers[i]->step.before_substep(substep);
    };
    return stepper_->step(works, count, frames, before.data(),
                          first().step.has_before_substep() ? &before_substep : nullptr);
  });
}

void Team::set_state(std::int64_t first, std::int64_t last, const double* qpos, const double* qvel,
                     const std::function<void(std::int64_t)>& note) {
  const StateLayout& layout = workers_[0]->work().layout();
  std::uint32_t left = (1u << (last - first)) - 1, done = 0;
  const auto for_left = [&](const auto& body) {
    for (std::int64_t i = 0; i < last - first; ++i) {
      const std::int64_t row = first + i;
      const double *of_qpos = qpos + row * layout.nq, *of_qvel = qvel + row * layout.nv;
      Worker& worker = *workers_[static_cast<std::size_t>(i)];
      if ((left >> i & 1) != 0 && !worker.attempt(row, [&] { body(worker, row, of_qpos, of_qvel); }))
        left &= ~(1u << i);
    }
  };
  if (steps_together() && last - first > 1 && workers_[0]->can_forward_elsewhere()) {
    for_left(
        [](Worker& worker, std::int64_t row, const double* q, const double* v) { worker.begin_set_state(row, q, v); });
    done = together(
        left, [&](Work* const* works, const auto& /*workers*/, int count) { return stepper_->forward(works, count); });
  }
  for_left([&](Worker& worker, std::int64_t row, const double* q, const double* v) {
    (done >> (row - first) & 1) != 0 ? worker.end_set_state(row) : worker.set_state(row, q, v);
    note(row);
  });
  gather_failures();
}

void Team::gather_failures() {
  for (std::size_t i = 1; i < size(); ++i) first().failures.take(workers_[i]->failures);
}

}  // namespace mjenv::core
