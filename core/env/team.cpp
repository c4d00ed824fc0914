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

std::uint32_t Team::step_together(std::uint32_t ready, std::int64_t frames) {
  std::array<Work*, kMaxSize> works{};
  std::array<double*, kMaxSize> before{};
  std::array<std::size_t, kMaxSize> workers{};
  int count = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    if (!(ready >> i & 1)) continue;
    works[count] = &workers_[i]->work();
    before[count] = workers_[i]->before();
    workers[count++] = i;
  }
  if (count < 2) return 0;  // load has failed for the other rows, and a single row is faster without lanes
  const lanes::Stepper::BeforeSubstep before_substep = [&](int i, std::int64_t substep) {
    workers_[workers[static_cast<std::size_t>(i)]]->step.before_substep(substep);
  };
  const std::uint32_t done = stepper_->step(works.data(), count, frames, before.data(),
                                            first().step.has_before_substep() ? &before_substep : nullptr);
  std::uint32_t advanced = 0;
  for (int i = 0; i < count; ++i)
    if (done >> i & 1) advanced |= 1u << workers[i];
  return advanced;
}

void Team::gather_failures() {
  for (std::size_t i = 1; i < size(); ++i) first().failures.take(workers_[i]->failures);
}

}  // namespace mjenv::core
