#include "env/image.hpp"

#include <array>
#include <cstring>

#include "error.hpp"
#include "hash.hpp"

namespace mjenv::core {
namespace {

// An image is a Stamp, and for each row a RowStamp and the row's record.
struct Stamp {
  std::array<char, 8> magic{'m', 'j', 'e', 'n', 'v', 'r', 'o', 'w'};
  std::uint32_t version = 2;
  Identity::Rounding rounding = Identity::Rounding::any;
  std::uint64_t identity = 0;
  std::uint64_t rows = 0;
  std::uint64_t checksum = 0;  // of everything behind the stamp
};

struct RowStamp {
  Rng rng;
  std::int64_t steps = 0;
  std::uint8_t origin = 0, seeded = 0, ready = 0, ended = 0;
  std::array<std::uint8_t, 4> unused{};
};
static_assert(std::is_trivially_copyable_v<RowStamp> && sizeof(RowStamp) == 56, "an image has no padding");
static_assert(sizeof(Stamp) == 40, "an image has no padding");

// Steps of one episode. No episode will have more.
constexpr std::int64_t kMaxSteps = std::int64_t{1} << 62;

std::size_t row_bytes(const Rows& rows) { return sizeof(RowStamp) + rows.record_bytes(); }

// A half-open range of rows.
struct Range {
  std::int64_t first, end;

  Range(const Rows& rows, std::int64_t row)
      : first(row == MJENV_ALL_ROWS ? 0 : row), end(row == MJENV_ALL_ROWS ? rows.count() : row + 1) {}
  std::uint64_t count() const { return static_cast<std::uint64_t>(end - first); }
};

bool is_valid(const RowStamp& stamp) {
  // NumPy's generator needs an odd increment. With an even one a reset might draw for ever.
  const bool endless = stamp.seeded != 0 && stamp.rng.words()[2] % 2 == 0;
  return stamp.origin <= static_cast<std::uint8_t>(Origin::set) && stamp.steps >= 0 && stamp.steps <= kMaxSteps &&
         !endless;
}

void check_rounding(Identity::Rounding of_image, Identity::Rounding here) {
  if (of_image == here) return;
  const auto name = [](Identity::Rounding rounding) {
    return rounding == Identity::Rounding::fused ? "fused" : "plain";
  };
  fail(MJENV_E_SNAPSHOT, std::string("the image was made with ") + name(of_image) +
                             " rounding of norms, but here it is " + name(here) + ": set the option \"norm\" to \"" +
                             name(of_image) + "\"");
}

}  // namespace

Identity identity_of(const Options& options, const Task& task) {
  std::uint64_t value = hash(options.id().data(), options.id().size(), task.model->fingerprint());
  value = hash(&task.revision, sizeof task.revision, value);
  for (const auto& option : options.all()) {
    if (option.scope == Scope::service) continue;
    value = hash(&option.integer, sizeof option.integer, value);
    value = hash(option.reals.data(), option.reals.size() * sizeof(double), value);
    value = hash(option.text.data(), option.text.size(), value);
  }
  using Rounding = Identity::Rounding;
  return {value, !task.norm ? Rounding::any : task.norm->fused() ? Rounding::fused : Rounding::plain};
}

std::size_t image_size(const Rows& rows, std::int64_t row) {
  if (row != MJENV_ALL_ROWS) rows.check(row);
  return sizeof(Stamp) + Range(rows, row).count() * row_bytes(rows);
}

void write_image(const Rows& rows, const Identity& identity, std::int64_t row, void* image) {
  const Range range(rows, row);
  auto* to = static_cast<unsigned char*>(image) + sizeof(Stamp);
  for (std::int64_t i = range.first; i < range.end; ++i) {
    const Rows::Head& head = rows.head(i);
    RowStamp stamp{head.rng, head.steps};
    stamp.origin = static_cast<std::uint8_t>(head.origin);
    stamp.seeded = head.seeded, stamp.ready = head.ready, stamp.ended = head.ended;
    std::memcpy(to, &stamp, sizeof stamp);
    std::memcpy(to + sizeof stamp, rows.state(i), rows.record_bytes());
    to += row_bytes(rows);
  }
  Stamp stamp;
  stamp.identity = identity.hash;
  stamp.rounding = identity.rounding;
  stamp.rows = range.count();
  stamp.checksum = hash(static_cast<unsigned char*>(image) + sizeof stamp, image_size(rows, row) - sizeof stamp);
  std::memcpy(image, &stamp, sizeof stamp);
}

void read_image(Rows& rows, const Identity& identity, const std::string& id, std::int64_t row, const void* image,
                std::size_t size) {
  const std::size_t needed = image_size(rows, row);
  const Stamp expected;
  Stamp stamp;
  if (size < sizeof stamp) fail(MJENV_E_SNAPSHOT, "an image of " + std::to_string(size) + " bytes is too short");
  const auto* from = static_cast<const unsigned char*>(image);
  std::memcpy(&stamp, from, sizeof stamp);
  if (stamp.magic != expected.magic) fail(MJENV_E_SNAPSHOT, "not an image of rows");
  if (stamp.version != expected.version)
    fail(MJENV_E_SNAPSHOT, "the image has version " + std::to_string(stamp.version) +
                               ", but this library reads version " + std::to_string(expected.version));
  if (stamp.identity != identity.hash)
    fail(MJENV_E_SNAPSHOT, "the image is of another id, other options or another model than this " + id);
  const Range range(rows, row);
  if (stamp.rows != range.count())
    fail(MJENV_E_SNAPSHOT,
         "the image holds " + std::to_string(stamp.rows) + " row(s), not " + std::to_string(range.count()));
  bool intact = size == needed && stamp.rounding <= Identity::Rounding::fused &&
                (stamp.rounding == Identity::Rounding::any) == (identity.rounding == Identity::Rounding::any) &&
                stamp.checksum == hash(from + sizeof stamp, size - sizeof stamp);
  const auto record_at = [&](std::int64_t i) {
    return from + sizeof stamp + static_cast<std::size_t>(i - range.first) * row_bytes(rows);
  };
  const auto stamp_at = [&](std::int64_t i) {
    RowStamp row_stamp;
    std::memcpy(&row_stamp, record_at(i), sizeof row_stamp);
    return row_stamp;
  };
  for (std::int64_t i = range.first; intact && i < range.end; ++i) intact = is_valid(stamp_at(i));
  if (!intact) fail(MJENV_E_SNAPSHOT, "the image is damaged");
  check_rounding(stamp.rounding, identity.rounding);

  for (std::int64_t i = range.first; i < range.end; ++i) {
    const RowStamp row_stamp = stamp_at(i);
    std::memcpy(rows.state(i), record_at(i) + sizeof row_stamp, rows.record_bytes());
    rows.head(i) = {
        row_stamp.rng,        row_stamp.steps,     0, static_cast<Origin>(row_stamp.origin), row_stamp.seeded != 0,
        row_stamp.ready != 0, row_stamp.ended != 0};
  }
}

}  // namespace mjenv::core
