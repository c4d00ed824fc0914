#include "env/rows.hpp"

#include <cstring>
#include <utility>

#include "error.hpp"
#include "system/memory.hpp"

namespace mjenv::core {

Rows::Rows(const Model& model, std::int64_t carry_count, std::int64_t count)
    : layout_(model),
      state_size_(layout_.size),
      carry_count_(static_cast<std::size_t>(carry_count)),
      record_size_(2 * state_size_ + carry_count_ + layout_.nq + layout_.nv + 2 * layout_.more),
      own_(model, count, state_size_) {
  check_memory(count, " rows", sizeof(Head) + record_bytes());
  heads_.resize(static_cast<std::size_t>(count));
  records_.resize(static_cast<std::size_t>(count) * record_size_);
}

void Rows::check(std::int64_t row) const {
  if (row < 0 || row >= count())
    fail(MJENV_E_VALUE, "row " + std::to_string(row) + " is outside 0.." + std::to_string(count() - 1));
}

void Rows::keep(std::int64_t row) {
  if (head(row).origin == Origin::cleared) return;
  if (!own_.empty()) own_.keep(row);
  // Derived arrays of `set` are computed from this state; those of other origins from before(row), which no write
  // changes.
  if (head(row).origin == Origin::set) own_.keep_state(row, state(row));
}

std::vector<double> Rows::make_perturbed(std::size_t size) const {
  check_memory(count(), " rows with noise, delays or pushes", size * sizeof(double));
  return std::vector<double>(heads_.size() * size);
}

void Rows::set_perturbed(std::vector<double> records, std::size_t size) noexcept {
  perturbed_ = std::move(records);
  perturbed_size_ = size;
}

void Rows::copy(std::int64_t from, std::int64_t to, OwnValues::Past kept) {
  own_.copy(from, to, std::move(kept));
  std::memcpy(state(to), state(from), record_bytes());
  if (has_perturbed()) std::memcpy(perturbed(to), perturbed(from), perturbed_bytes());
  head(to) = head(from);
}

}  // namespace mjenv::core
