#include "env/outputs.hpp"

#include "system/memory.hpp"

namespace mjenv::core {

Outputs::Outputs(const Schema& schema, const Episodes& episodes, std::int64_t rows) {
  const std::int64_t obs = schema.observation_count(), info = schema.count(MJENV_ROLE_INFO);
  const std::int64_t reset_info = schema.count(MJENV_ROLE_RESET_INFO), arrays = schema.count(MJENV_ROLE_ARRAYS);
  check_memory(rows, " rows under way",
               static_cast<std::size_t>(2 * (obs + info) + reset_info + arrays + 2) * sizeof(double));
  const auto allocate = [rows](auto& array, std::int64_t count) {
    array.resize(static_cast<std::size_t>(rows * count));
    return array.data();
  };
  batch_.struct_size = sizeof batch_;
  batch_.obs_dtype = MJENV_DTYPE_FLOAT64;
  batch_.rows = rows;
  batch_.obs = allocate(obs_, obs);
  batch_.reward = allocate(reward_, 1);
  batch_.terminated = allocate(terminated_, 1);
  batch_.truncated = allocate(truncated_, 1);
  batch_.was_reset = allocate(was_reset_, 1);
  batch_.status = allocate(status_, 1);
  batch_.info = allocate(info_, info);
  batch_.arrays = allocate(arrays_, arrays);
  if (episodes.autoresets()) batch_.reset_info = allocate(reset_info_, reset_info);
  if (!episodes.autoresets_in_same_step()) return;
  batch_.final_obs = allocate(final_obs_, obs);
  batch_.final_info = allocate(final_info_, info);
}

void Outputs::deliver(const Schema& schema, std::int64_t row, const mjenv_batch& out) const {
  const Place from = at(row), to{out, batch_.rows, row};
  to.put(out.status, from.get(batch_.status));
  to.put(out.was_reset, from.get(batch_.was_reset));
  to.put_result(from.get(batch_.reward), from.get(batch_.terminated) != 0, from.get(batch_.truncated) != 0);
  const std::int64_t obs = schema.observation_count();
  to.put_observation(obs_.data() + row * obs, obs, out.obs);
  to.copy(schema.fields(MJENV_ROLE_INFO), batch_.info, out.info);
  to.copy(schema.fields(MJENV_ROLE_ARRAYS), batch_.arrays, out.arrays);
  if (!from.get(batch_.was_reset)) return;
  to.copy(schema.fields(MJENV_ROLE_RESET_INFO), batch_.reset_info, out.reset_info);
  // final_obs and final_info were written only if a step ended an episode. If a reset replaced the step, both flags are
  // 0.
  if (!batch_.final_obs || (!from.get(batch_.terminated) && !from.get(batch_.truncated))) return;
  to.put_observation(final_obs_.data() + row * obs, obs, out.final_obs);
  to.copy(schema.fields(MJENV_ROLE_INFO), batch_.final_info, out.final_info);
}

}  // namespace mjenv::core
