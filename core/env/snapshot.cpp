// Images of rows: a stamp that says whose they are, then row after row its head and its record.
#include <array>
#include <cstring>

#include "env/env.hpp"
#include "error.hpp"
#include "hash.hpp"

namespace mjenv::core {
namespace {

// Of an episode; more than any will have.
constexpr std::int64_t kMostSteps = std::int64_t{1} << 62;

}  // namespace

struct Env::Stamp {
  std::array<char, 8> magic{'m', 'j', 'e', 'n', 'v', 'r', 'o', 'w'};
  std::uint64_t version = 1;
  std::uint64_t owner = 0;  // id, options and model
  std::uint64_t rows = 0;
  std::uint64_t checksum = 0;  // of everything behind it
};

struct Env::RowStamp {
  Rng rng;
  std::int64_t steps = 0;
  std::array<std::uint8_t, 8> flags{};  // origin, seeded, ready, ended
};

// Options that only say how rows are served leave their images alike; the model speaks for xml_file and xml_string.
std::uint64_t Env::owner() const {
  if (owner_ != 0) return owner_;
  owner_ = hash(options_.id().data(), options_.id().size(), task_.model->fingerprint());
  for (const auto& option : options_.all()) {
    bool serves = false;
    for (const char* name : {"xml_file", "xml_string", "trust_xml", "num_threads", "cpu_affinity", "arrays"})
      serves = serves || option.name == name;
    if (serves) continue;
    owner_ = hash(&option.integer, sizeof option.integer, owner_);
    owner_ = hash(option.reals.data(), option.reals.size() * sizeof(double), owner_);
    owner_ = hash(option.text.data(), option.text.size(), owner_);
  }
  return owner_;
}

Env::RowStamp Env::stamp_of(std::int64_t row) const {
  const Head& head = heads_[row];
  return {head.rng, head.steps, {static_cast<std::uint8_t>(head.origin), head.seeded, head.ready, head.ended}};
}

std::size_t Env::snapshot_size(std::int64_t row) const {
  if (row != MJENV_ALL_ROWS) check_row(row);
  const auto count = static_cast<std::size_t>(row == MJENV_ALL_ROWS ? rows() : 1);
  return sizeof(Stamp) + count * (sizeof(RowStamp) + record_size_ * sizeof(double));
}

void Env::snapshot(std::int64_t row, void* image) const {
  check_settled();
  static_assert(std::is_trivially_copyable_v<RowStamp> && sizeof(RowStamp) == 48, "an image has no padding");
  const bool all = row == MJENV_ALL_ROWS;
  auto* to = static_cast<unsigned char*>(image) + sizeof(Stamp);
  const auto put = [&](const void* from, std::size_t size) {
    std::memcpy(to, from, size);
    to += size;
  };
  for (std::int64_t i = all ? 0 : row; i < (all ? rows() : row + 1); ++i) {
    const RowStamp head = stamp_of(i);
    put(&head, sizeof head);
    put(record(i), record_size_ * sizeof(double));
  }
  Stamp stamp;
  stamp.owner = owner();
  stamp.rows = static_cast<std::uint64_t>(all ? rows() : 1);
  stamp.checksum = hash(static_cast<unsigned char*>(image) + sizeof stamp, snapshot_size(row) - sizeof stamp);
  std::memcpy(image, &stamp, sizeof stamp);
}

void Env::restore(std::int64_t row, const void* image, std::size_t size) {
  check_settled();
  const std::size_t needed = snapshot_size(row);
  Stamp stamp;
  const Stamp mine;
  if (size < sizeof stamp) fail(MJENV_E_SNAPSHOT, "an image of " + std::to_string(size) + " bytes is too short");
  const auto* from = static_cast<const unsigned char*>(image);
  std::memcpy(&stamp, from, sizeof stamp);
  if (stamp.magic != mine.magic) fail(MJENV_E_SNAPSHOT, "not an image of rows");
  if (stamp.version != mine.version)
    fail(MJENV_E_SNAPSHOT, "an image of version " + std::to_string(stamp.version) + "; this library reads " +
                               std::to_string(mine.version));
  if (stamp.owner != owner())
    fail(MJENV_E_SNAPSHOT, "the image is of another id, other options or another model than this " + options_.id());
  const bool all = row == MJENV_ALL_ROWS;
  const auto count = static_cast<std::uint64_t>(all ? rows() : 1);
  if (stamp.rows != count)
    fail(MJENV_E_SNAPSHOT,
         "the image is of " + std::to_string(stamp.rows) + " row(s), not of " + std::to_string(count));
  const std::size_t row_size = sizeof(RowStamp) + record_size_ * sizeof(double);
  bool damaged = size != needed || stamp.checksum != hash(from + sizeof stamp, size - sizeof stamp);
  const auto head_at = [&](std::uint64_t i) {
    RowStamp head;
    std::memcpy(&head, from + sizeof stamp + i * row_size, sizeof head);
    return head;
  };
  for (std::uint64_t i = 0; !damaged && i < count; ++i) {
    const RowStamp head = head_at(i);
    const bool constant = head.flags[1] != 0 && head.rng.words()[2] % 2 == 0;  // a reset might draw from it for ever
    damaged =
        head.flags[0] > static_cast<std::uint8_t>(Origin::set) || head.steps < 0 || head.steps > kMostSteps || constant;
  }
  if (damaged) fail(MJENV_E_SNAPSHOT, "the image is damaged");

  for (std::uint64_t i = 0; i < count; ++i) {
    const std::int64_t to = all ? static_cast<std::int64_t>(i) : row;
    const RowStamp head = head_at(i);
    std::memcpy(state(to), from + sizeof stamp + i * row_size + sizeof head, record_size_ * sizeof(double));
    heads_[to] = {head.rng,           head.steps,        0, static_cast<Origin>(head.flags[0]), head.flags[1] != 0,
                  head.flags[2] != 0, head.flags[3] != 0};
    for (auto& worker : workers_)
      if (worker->resident == to) worker->resident = -1;
  }
}

void Env::copy_row(std::int64_t from, const std::uint8_t* to_mask) {
  check_settled();
  check_row(from);
  for (std::int64_t to = 0; to < rows(); ++to) {
    if (!to_mask[to] || to == from) continue;
    std::memcpy(state(to), state(from), record_size_ * sizeof(double));
    heads_[to] = heads_[from];
    for (auto& worker : workers_)
      if (worker->resident == to) worker->resident = -1;
  }
}

}  // namespace mjenv::core
