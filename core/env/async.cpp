// Rows under way between send and receive.
#include <algorithm>
#include <cstring>
#include <utility>

#include "env/env.hpp"
#include "error.hpp"
#include "system/wait.hpp"

namespace mjenv::core {

void Env::send(const std::int64_t* rows_sent, std::size_t row_count, const void* action, std::size_t count,
               mjenv_dtype dtype, const mjenv_batch* out) {
  pool_->check_here();
  const std::int64_t nu = task_.model->nu();
  if (!rows_sent) row_count = static_cast<std::size_t>(rows());
  const auto row_at = [&](std::size_t i) { return rows_sent ? rows_sent[i] : static_cast<std::int64_t>(i); };
  if (row_count > static_cast<std::size_t>(rows()))  // so that no product of it overflows
    fail(MJENV_E_SIZE,
         "row_count is " + std::to_string(row_count) + ", but there are " + std::to_string(rows()) + " row(s)");
  check_count("the action's count", static_cast<std::int64_t>(count), static_cast<std::int64_t>(row_count) * nu);
  check_out(out, rows(), info_);
  const Action all{action, dtype, static_cast<Eigen::Index>(count)};

  std::unique_lock lock(async_->mutex);
  async_->under_way.resize(static_cast<std::size_t>(rows()));
  async_->dtype.resize(static_cast<std::size_t>(rows()));
  async_->action.resize(static_cast<std::size_t>(rows() * nu));
  async_->ready.reserve(static_cast<std::size_t>(rows()));
  async_->waiting.resize(static_cast<std::size_t>(rows()));
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

  // From here on nothing can fail.
  const std::size_t width = dtype == MJENV_FLOAT32 ? sizeof(float) : sizeof(double);
  for (std::size_t i = 0; i < row_count; ++i) {
    const std::int64_t row = row_at(i);
    if (nu > 0)
      std::memcpy(&async_->action[row * nu], all.part(static_cast<Eigen::Index>(i) * nu, nu).values, width * nu);
    async_->dtype[row] = dtype;
    async_->under_way[row] = 1;
    async_->waiting[(async_->next + async_->waiting_count++) % async_->waiting.size()] = row;
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
    if (async_->waiting_count == 0) {
      if (!async_->open) return;
      wait(caller ? async_->done : async_->sent, lock);
      continue;
    }
    const std::int64_t row = async_->waiting[async_->next];
    async_->next = (async_->next + 1) % async_->waiting.size();
    --async_->waiting_count;
    const mjenv_batch out = async_->out;
    lock.unlock();
    const std::int64_t nu = task_.model->nu();
    attempt(worker, row, [&](Worker& w, std::int64_t r) {
      step_row(w, r, {async_->action.data() + r * nu, async_->dtype[r], nu},
               {out.struct_size ? &out : nullptr, rows(), r});
    });
    lock.lock();
    const Failures failures = std::exchange(worker.failures, {});
    if (failures.status != MJENV_OK) async_->failures.add(failures.status, failures.text);
    async_->ready.push_back(row);
    async_->done.notify_one();
  }
}

void Env::receive(std::size_t least, std::int64_t* rows_done, std::size_t capacity, std::size_t* count) {
  pool_->check_here();
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
  Failures failures = std::exchange(async_->failures, {});
  if (async_->count == 0) {
    async_->open = false;
    lock.unlock();
    async_->sent.notify_all();
    if (pool_->threads() > 1) pool_->finish();
  }
  failures.raise();
}

}  // namespace mjenv::core
