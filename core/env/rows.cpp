#include "env/rows.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "error.hpp"
#include "system/memory.hpp"

namespace mjenv::core {

Rows::Rows(const Task& task, std::size_t history_count, std::int64_t count)
    : layout_(*task.model),
      carry_count_(static_cast<std::size_t>(task.carry_count)),
      parameter_count_(task.parameters.defaults().size()),
      history_count_(history_count),
      has_random_state_(task.needs.random_state),
      arrays_(*task.model) {
  std::size_t each = sizeof(Head) + sizeof workers_[0] + sizeof owns_values_[0];
  for (const PartKind& kind : kParts)
    if (kind.kept == 0 && kind.part != Part::head) {
      sizes_[index_of(kind.part)] = bytes_of(kind.content) / sizeof(double);
      each += bytes_of(kind.content);
    }
  check_memory(count, " rows", each);
  const auto rows = static_cast<std::size_t>(count);
  heads_.resize(rows);
  workers_.resize(rows);
  if (task.physics_only) phases_.resize(rows);
  owns_values_.resize(rows);
  for (std::size_t part = 0; part < kPartCount; ++part) numbers_[part] = Zeros(rows * sizes_[part]);
  const std::vector<double>& defaults = task.parameters.defaults();
  for (std::int64_t row = 0; row < count; ++row) std::copy(defaults.begin(), defaults.end(), parameters(row));
}

void Rows::check(std::int64_t row) const { check_index("row", row, static_cast<std::size_t>(count())); }

std::int64_t Rows::first_open() const {
  const auto found = std::find_if(phases_.begin(), phases_.end(), [](Phase phase) { return phase > Phase::ended; });
  return found == phases_.end() ? -1 : found - phases_.begin();
}

std::size_t Rows::bytes_of(Content content) const {
  switch (content) {
    case Content::head: return sizeof(Head);
    case Content::state: return layout_.size * sizeof(double);
    case Content::rest: return layout_.more * sizeof(double);
    case Content::carried: return carry_count_ * sizeof(double);
    case Content::parameters: return parameter_count_ * sizeof(double);
    case Content::values: return arrays_.block_bytes();
    case Content::history: return history_count_ * sizeof(double);
    case Content::random_state: return has_random_state_ ? sizeof(np::RandomState) : 0;
    case Content::ranges: return sizes_[index_of(Part::ranges)] * sizeof(double);
    case Content::perturbation: break;
  }
  return sizes_[index_of(Part::perturbation)] * sizeof(double);
}

np::RandomState Rows::random_state(std::int64_t row) const {
  np::RandomState stream;
  std::memcpy(static_cast<void*>(&stream), numbers(Part::random_state, row), sizeof stream);
  return stream;
}

void Rows::set_random_state(std::int64_t row, const np::RandomState& stream) {
  std::memcpy(numbers(Part::random_state, row), &stream, sizeof stream);
}

const std::byte* Rows::bytes(Part part, std::int64_t row) const {
  if (part == Part::values && shares_model_values(row)) return model_values();
  return part == Part::head ? reinterpret_cast<const std::byte*>(&head(row))
                            : reinterpret_cast<const std::byte*>(numbers(part, row));
}

std::byte* Rows::room(Part part, std::int64_t row) {
  if (part == Part::values) owns_values_[static_cast<std::size_t>(row)] = 1;
  return const_cast<std::byte*>(bytes(part, row));
}

std::byte* Rows::own_values(std::int64_t row) {
  const bool is_new = shares_model_values(row);
  std::byte* own = room(Part::values, row);
  if (is_new) std::memcpy(own, model_values(), block_bytes());
  return own;
}

void Rows::set_values(std::int64_t row, const std::byte* block) {
  if (shares_model_values(row) && std::memcmp(block, model_values(), block_bytes()) == 0) return;
  std::memcpy(room(Part::values, row), block, block_bytes());
}

const std::byte* Rows::values(std::int64_t row, Entry entry) const {
  while (entry != Entry::now && !is_kept(row, values_of(entry))) entry = next(entry);
  return bytes(values_of(entry), row);
}

void Rows::add_arrays(const std::vector<std::string>& names) {
  OwnArrays arrays = arrays_;
  for (const std::string& name : names) arrays.add(name);
  const std::size_t first = arrays_.list().size(), old_bytes = arrays_.block_bytes();
  if (arrays.list().size() == first) return;
  const std::size_t size = arrays.block_bytes() / sizeof(double);
  // Rows::keep, which threads call while they step rows, must not allocate. So the room for what it may keep is
  // allocated here.
  const auto grows = [&](const PartKind& kind) {
    for (const Entry entry : {Entry::first, Entry::set_state, Entry::set_constants, Entry::now})
      if (kind.part == values_of(entry)) return any_has(entry);
    return false;
  };
  check_memory(count(), " rows with arrays of their own",
               static_cast<std::size_t>(std::count_if(kParts.begin(), kParts.end(), grows)) * arrays.block_bytes());
  std::vector<double> model_values(size);
  arrays.fill(0, reinterpret_cast<std::byte*>(model_values.data()));
  std::vector<std::pair<std::size_t, Zeros>> wider;  // parts, by index
  for (const PartKind& kind : kParts) {
    if (!grows(kind)) continue;
    Zeros numbers(heads_.size() * size);
    for (std::int64_t row = 0; row < count(); ++row) {
      if (kind.part == Part::values ? shares_model_values(row) : !is_kept(row, kind.part)) continue;
      auto* to = reinterpret_cast<std::byte*>(numbers.data() + static_cast<std::size_t>(row) * size);
      std::memcpy(to, bytes(kind.part, row), old_bytes);
      arrays.fill(first, to);
    }
    wider.emplace_back(index_of(kind.part), std::move(numbers));
  }
  for (auto& [part, numbers] : wider) {
    numbers_[part] = std::move(numbers);
    sizes_[part] = size;
  }
  model_values_ = std::move(model_values);
  arrays_ = std::move(arrays);
}

void Rows::clear_inputs(std::int64_t row) {
  if (!shares_model_values(row)) arrays_.clear_inputs(own_values(row));
}

bool Rows::any_has(Entry entry) const {
  const std::uint16_t bit = kept_bit(state_of(entry));
  return bit == 0 || std::any_of(heads_.begin(), heads_.end(), [&](const Head& head) { return head.kept & bit; });
}

Entry Rows::last_before(std::int64_t row, Entry entry) const {
  do entry = static_cast<Entry>(static_cast<std::uint8_t>(entry) - 1);
  while (!has(row, entry));
  return entry;
}

void Rows::make_room(Entry entry) {
  for (const Part part : {state_of(entry), values_of(entry)}) {
    const std::size_t size = bytes_of(kParts[index_of(part)].content) / sizeof(double);
    if (sizes_[index_of(part)] == size) continue;
    check_memory(count(), " rows with room for mjenv_set_state or mjenv_set_constants", size * sizeof(double));
    numbers_[index_of(part)] = Zeros(heads_.size() * size);
    sizes_[index_of(part)] = size;
  }
}

void Rows::begin(std::int64_t row, Origin origin) {
  head(row).origin = origin;
  head(row).kept = 0;
  head(row).written = Written::no;
}

void Rows::append(std::int64_t row, Entry entry) {
  const Entry last = last_before(row, entry);
  const std::byte* of_last = values(row, last);
  if (of_last != values(row)) keep_values(row, last, of_last);  // before the entry that has kept them is dropped
  for (Entry dropped = entry; dropped != Entry::now; dropped = next(dropped))
    head(row).kept &= static_cast<std::uint16_t>(~(kept_bit(state_of(dropped)) | kept_bit(values_of(dropped))));
  head(row).kept |= kept_bit(state_of(entry));
  head(row).written = Written::no;
}

void Rows::keep(std::int64_t row) {
  const Entry entry = last(row);
  if (!is_kept(row, values_of(entry))) keep_values(row, entry, values(row));
}

void Rows::keep_values(std::int64_t row, Entry entry, const std::byte* block) {
  const bool is_cleared = entry == Entry::first && head(row).origin == Origin::cleared;
  if (is_cleared || block_bytes() == 0) return;  // mj_resetData computes nothing from own values
  std::memmove(numbers(values_of(entry), row), block, block_bytes());
  head(row).kept |= kept_bit(values_of(entry));
}

void Rows::copy(std::int64_t from, std::int64_t to) {
  set_phase(to, phase(from));
  for (const PartKind& kind : kParts) {
    const std::size_t size = bytes_of(kind.content);
    if (size == 0 || !has(from, kind)) continue;
    if (kind.part == Part::values && shares_model_values(from))
      share_model_values(to);
    else
      std::memcpy(room(kind.part, to), bytes(kind.part, from), size);
  }
}

Zeros Rows::make_perturbation(std::uint64_t size) const {
  check_memory(count(), " rows with noise, delays or pushes", size * sizeof(double));
  return Zeros(heads_.size() * static_cast<std::size_t>(size));
}

Zeros Rows::make_ranges(const std::vector<double>& ranges) const {
  check_memory(count(), " rows with the parameters of their own draws (mjenv_randomize)",
               ranges.size() * sizeof(double));
  Zeros of_rows(heads_.size() * ranges.size());
  for (std::size_t row = 0; row < heads_.size(); ++row)
    std::copy(ranges.begin(), ranges.end(), of_rows.data() + row * ranges.size());
  return of_rows;
}

void Rows::set_ranges(Zeros of_rows, std::size_t size) noexcept {
  numbers_[index_of(Part::ranges)] = std::move(of_rows);
  sizes_[index_of(Part::ranges)] = size;
}

void Rows::set_perturbation(Zeros records, std::size_t size) noexcept {
  numbers_[index_of(Part::perturbation)] = std::move(records);
  sizes_[index_of(Part::perturbation)] = size;
}

}  // namespace mjenv::core
