#include "env/pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "error.hpp"

namespace mjenv::core {
namespace {

// Returns the row at index i of the caller's list. A null list means all rows.
std::int64_t row_at(const std::int64_t* rows, std::int64_t i) { return rows ? rows[i] : i; }

}  // namespace

Pipeline::Pipeline(const Schema& schema, const Rows& rows, const Episodes& episodes, Workers& workers)
    : schema_(schema),
      rows_(rows),
      episodes_(episodes),
      workers_(workers),
      action_count_(static_cast<std::int64_t>(schema.fields(MJENV_ROLE_ACTION).size())) {}

Pipeline::~Pipeline() {
  bool serving = false;
  {
    const std::lock_guard lock(mutex_);
    waiting_count_ = 0;
    serving = std::exchange(open_, false);
  }
  sent_.notify_all();
  if (serving && workers_.threads() > 1) workers_.pool().finish();
}

// Allocates memory for all rows at the first send, so that the time of a later call depends only on how many rows it
// sends.
void Pipeline::allocate() {
  if (outputs_) return;
  const auto rows = static_cast<std::size_t>(rows_.count());
  under_way_.resize(rows);
  dtypes_.resize(rows);
  actions_.resize(rows * static_cast<std::size_t>(action_count_));
  ready_.reserve(rows);
  waiting_.resize(rows);
  outputs_.emplace(schema_, episodes_, rows_.count());
}

void Pipeline::check(const std::int64_t* rows, std::int64_t row_count, const Action& actions) {
  std::int64_t marked = 0;
  try {
    for (std::int64_t i = 0; i < row_count; ++i) {
      const std::int64_t row = row_at(rows, i);
      rows_.check(row);
      if (under_way_[row] != 0) fail(MJENV_E_PENDING, in_row(row, "it is already under way, or listed twice"));
      episodes_.check_steppable(row, episodes_.autoresets());
      episodes_.check_finite(row, actions.part(i * action_count_, action_count_));
      under_way_[row] = 1;  // so that a row that is listed twice is refused
      ++marked;
    }
  } catch (...) {
    for (std::int64_t i = 0; i < marked; ++i) under_way_[row_at(rows, i)] = 0;
    throw;
  }
}

void Pipeline::send(const std::int64_t* rows, std::int64_t row_count, const Action& actions) {
  workers_.pool().check_here();
  std::unique_lock lock(mutex_);
  allocate();
  check(rows, row_count, actions);
  if (row_count == 0) return;

  // From here on nothing can fail.
  const std::size_t width = actions.dtype == MJENV_DTYPE_FLOAT32 ? sizeof(float) : sizeof(double);
  for (std::int64_t i = 0; i < row_count; ++i) {
    const std::int64_t row = row_at(rows, i);
    if (action_count_ > 0)
      std::memcpy(&actions_[row * action_count_], actions.part(i * action_count_, action_count_).values,
                  width * action_count_);
    dtypes_[row] = actions.dtype;
    waiting_[(first_ + waiting_count_++) % waiting_.size()] = row;
  }
  count_ += row_count;
  const bool starts = !open_;
  open_ = true;
  lock.unlock();
  if (starts && workers_.threads() > 1)
    workers_.pool().start([this](int index) {
      const ErrorTrap trap;
      serve(workers_.team(static_cast<std::size_t>(index)), {}, [] { return false; });
    });
  else
    sent_.notify_all();
}

// Steps the next waiting rows: several together if the team can, but not so many that other threads would have none.
void Pipeline::step_next(Team& team, std::unique_lock<std::mutex>& lock) {
  const std::size_t share = (waiting_count_ + workers_.threads() - 1) / workers_.threads();
  const std::size_t count = team.steps_together() ? std::min(team.size(), share) : 1;
  std::vector<Turn>& turns = team.turns();
  turns.clear();
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t row = waiting_[first_];
    first_ = (first_ + 1) % waiting_.size();
    --waiting_count_;
    turns.push_back({row, {actions_.data() + row * action_count_, dtypes_[row], action_count_}, outputs_->at(row)});
  }
  lock.unlock();
  for (const Turn& turn : turns) turn.place.forget();
  episodes_.step(team);
  lock.lock();
  failures_.take(team.first().failures);
  for (const Turn& turn : turns) ready_.push_back(turn.row);
  done_.notify_one();
}

void Pipeline::serve(Team& team, Deadline deadline, const std::function<bool()>& enough) {
  const bool caller = team.first().index == 0;
  // If there is a single thread, it steps some rows before it looks at the deadline. Otherwise a timeout of 0 would
  // never step any.
  bool checks_deadline = workers_.threads() > 1;
  std::unique_lock lock(mutex_);
  while (!enough() && !(checks_deadline && deadline.passed())) {
    if (waiting_count_ > 0) {
      step_next(team, lock);
      checks_deadline = true;
    } else if (open_) {
      (caller ? done_ : sent_).wait(lock, deadline);
    } else {
      return;
    }
  }
}

void Pipeline::receive(std::int64_t least, double timeout, std::int64_t* rows, std::int64_t capacity,
                       std::int64_t* count, const mjenv_batch& out) {
  workers_.pool().check_here();
  if (count_ == 0) fail(MJENV_E_NOT_PENDING, "no rows are under way: send some first");
  if (least < 0 || least > count_)
    fail(MJENV_E_SIZE, "least is " + std::to_string(least) + ", not 0 to " + std::to_string(count_) +
                           ", the number of rows under way");
  if (capacity < std::max<std::int64_t>(least, 1))
    fail(MJENV_E_SIZE, "capacity is " + std::to_string(capacity) +
                           ", but must be at least 1, and at least the argument \"least\", which is " +
                           std::to_string(least));
  if (std::isnan(timeout)) fail(MJENV_E_VALUE, "timeout is NaN");
  schema_.check(out, rows_.count());
  // If there are no other threads, this call steps at least one row even if `least` is 0, because nobody else would
  // step it.
  const auto wanted = static_cast<std::size_t>(workers_.threads() == 1 ? std::max<std::int64_t>(least, 1) : least);
  serve(workers_.team(0), Deadline(timeout), [&] { return ready_.size() >= wanted; });

  std::unique_lock lock(mutex_);
  const std::int64_t reported = std::min(capacity, static_cast<std::int64_t>(ready_.size()));
  for (std::int64_t i = 0; i < reported; ++i) {
    rows[i] = ready_[i];
    under_way_[ready_[i]] = 0;
    outputs_->deliver(schema_, ready_[i], out);
  }
  ready_.erase(ready_.begin(), ready_.begin() + reported);
  count_ -= reported;
  *count = reported;
  Failures failures;
  failures.take(failures_);
  if (count_ == 0) {
    open_ = false;
    lock.unlock();
    sent_.notify_all();
    if (workers_.threads() > 1) workers_.pool().finish();
  }
  failures.raise();
}

}  // namespace mjenv::core
