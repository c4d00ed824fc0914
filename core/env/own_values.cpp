#include "env/own_values.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "system/memory.hpp"

namespace mjenv::core {
namespace {

std::byte* bytes(double* block) { return reinterpret_cast<std::byte*>(block); }

std::unique_ptr<double[]> copied(const void* block, std::size_t size) {
  auto copy = std::make_unique<double[]>(size / sizeof(double));
  std::memcpy(copy.get(), block, size);
  return copy;
}

}  // namespace

void OwnValues::add(const std::vector<std::string>& names) {
  OwnArrays arrays = arrays_;
  for (const std::string& name : names) arrays.add(name);
  const std::size_t first = arrays_.list().size(), old_bytes = arrays_.block_bytes();
  if (arrays.list().size() == first) return;
  const std::size_t size = arrays.block_bytes() / sizeof(double);
  check_memory(static_cast<std::int64_t>(rows_), " rows with arrays of their own", arrays.block_bytes());
  const auto widen = [&](const void* from, double* to) {
    if (old_bytes > 0) std::memcpy(to, from, old_bytes);
    arrays.fill(first, bytes(to));
  };
  std::vector<double> blocks(rows_ * size);
  for (std::size_t row = 0; row < rows_; ++row)
    widen(blocks_.data() + row * (old_bytes / sizeof(double)), blocks.data() + row * size);
  std::vector<Past> pasts(rows_);  // allocated now, because threads that step rows share it and must not resize it
  for (std::size_t row = 0; row < past_.size(); ++row)
    for (Block Past::*member : {&Past::computed, &Past::stepped, &Past::constants}) {
      if (!(past_[row].*member)) continue;
      pasts[row].*member = std::make_unique<double[]>(size);
      widen((past_[row].*member).get(), (pasts[row].*member).get());
    }
  for (std::size_t row = 0; row < past_.size(); ++row) pasts[row].state = std::move(past_[row].state);
  std::vector<std::uint8_t> forced = forced_;
  if (arrays.has_inputs()) forced.resize(rows_);  // the new arrays have no forces yet
  arrays_ = std::move(arrays);
  blocks_ = std::move(blocks);
  past_ = std::move(pasts);
  forced_ = std::move(forced);
}

void OwnValues::clear_inputs(std::int64_t row) {
  arrays_.clear_inputs(present(row));
  note_forces(row);
}

std::int64_t OwnValues::forced_rows() const {
  return std::count_if(forced_.begin(), forced_.end(), [](std::uint8_t forced) { return forced != 0; });
}

void OwnValues::note_forces(std::int64_t row) {
  if (!forced_.empty()) forced_[static_cast<std::size_t>(row)] = arrays_.has_forces(present(row)) ? 1 : 0;
}

void OwnValues::make_pasts() {
  if (past_.empty()) past_.resize(rows_);
}

OwnValues::Past& OwnValues::make_past(std::int64_t row) {
  make_pasts();
  return *past(row);
}

std::byte* OwnValues::present(std::int64_t row) {
  return bytes(blocks_.data()) + static_cast<std::size_t>(row) * arrays_.block_bytes();
}

std::byte* OwnValues::computed(std::int64_t row) {
  const Past* p = past(row);
  return p && p->computed ? bytes(p->computed.get()) : present(row);
}

std::byte* OwnValues::stepped(std::int64_t row) {
  const Past* p = past(row);
  return p && p->stepped ? bytes(p->stepped.get()) : computed(row);
}

const double* OwnValues::state(std::int64_t row) const {
  return past_.empty() ? nullptr : past_[static_cast<std::size_t>(row)].state.get();
}

void OwnValues::keep(std::int64_t row) {
  Past& p = make_past(row);
  if (!p.computed) p.computed = copied(present(row), block_bytes());
}

void OwnValues::keep(std::int64_t row, Block room) noexcept {
  Past& p = *past(row);
  if (p.computed) return;
  std::memcpy(room.get(), present(row), block_bytes());
  p.computed = std::move(room);
}

void OwnValues::keep_state(std::int64_t row, const double* state) {
  Past& p = make_past(row);
  if (!p.state) p.state = copied(state, state_size_ * sizeof(double));
}

const std::byte* OwnValues::of_constants(std::int64_t row) const {
  const Past* p = past(row);
  return p && p->constants ? bytes(p->constants.get()) : nullptr;
}

void OwnValues::keep_constants(std::int64_t row) { make_past(row).constants = copied(present(row), block_bytes()); }

void OwnValues::computed_all(std::int64_t row) {
  if (Past* p = past(row)) *p = {};
}

void OwnValues::computed_after_step(std::int64_t row) {
  Past* p = past(row);
  if (!p) return;
  if (!p->stepped) p->stepped = std::move(p->computed);
  p->computed.reset();
  p->constants.reset();
  p->state.reset();
}

OwnValues::Past OwnValues::copied_past(std::int64_t row) const {
  const auto copy = [](const Block& block, std::size_t size) { return block ? copied(block.get(), size) : nullptr; };
  const Past& p = *past(row);
  return {copy(p.computed, block_bytes()), copy(p.stepped, block_bytes()), copy(p.constants, block_bytes()),
          copy(p.state, state_size_ * sizeof(double))};
}

void OwnValues::copy(std::int64_t from, std::int64_t to, Past kept) {
  if (!empty()) std::memcpy(present(to), present(from), block_bytes());
  if (!forced_.empty()) forced_[static_cast<std::size_t>(to)] = forced_[static_cast<std::size_t>(from)];
  if (Past* p = past(to)) *p = std::move(kept);
}

void OwnValues::translate(const OwnArrays& layout, const std::byte* block, std::byte* to) const {
  arrays_.fill(0, to);
  for (const OwnArray& array : arrays_.list())
    if (const OwnArray* from = layout.find(array.original.name))
      std::memcpy(to + array.offset, block + from->offset, array.bytes);
}

OwnValues::Block OwnValues::translated(const OwnArrays& layout, const std::byte* block) const {
  Block copy = room();
  translate(layout, block, bytes(copy.get()));
  return copy;
}

void OwnValues::set(std::int64_t row, const OwnArrays& layout, const std::byte* block, Past kept) {
  if (!empty()) translate(layout, block, present(row));
  note_forces(row);
  if (Past* p = past(row)) *p = std::move(kept);
}

}  // namespace mjenv::core
