#include "env/image.hpp"

#include <array>
#include <cstdio>
#include <cstring>

#include "engine/model.hpp"
#include "error.hpp"
#include "hash.hpp"

namespace mjenv::core {
namespace {

// An image consists of an ImageHeader and, for each row, a RowHeader and the row's record.
struct ImageHeader {
  std::array<char, 8> magic{'m', 'j', 'e', 'n', 'v', 'r', 'o', 'w'};
  std::uint16_t version = 3;
  std::uint16_t engine = 0;  // the version of MuJoCo: 10000 * major + 100 * minor + patch
  Identity::Rounding rounding = Identity::Rounding::any;
  std::uint64_t identity = 0;
  std::uint64_t rows = 0;
  std::uint64_t checksum = 0;  // of everything after the header
};

struct RowHeader {
  Rng rng;
  std::int64_t steps = 0;
  std::uint8_t origin = 0, seeded = 0, ready = 0, ended = 0;
  std::array<std::uint8_t, 4> unused{};
};
static_assert(std::is_trivially_copyable_v<RowHeader> && sizeof(RowHeader) == 56, "an image has no padding");
static_assert(sizeof(ImageHeader) == 40, "an image has no padding");

// More steps than any episode has. A larger count means that the image is damaged, and could overflow.
constexpr std::int64_t kMaxSteps = std::int64_t{1} << 62;

std::size_t row_bytes(const Rows& rows) { return sizeof(RowHeader) + rows.record_bytes(); }

// A half-open range of rows.
struct Range {
  std::int64_t first, end;

  Range(const Rows& rows, std::int64_t row)
      : first(row == MJENV_ALL_ROWS ? 0 : row), end(row == MJENV_ALL_ROWS ? rows.count() : row + 1) {}
  std::uint64_t count() const { return static_cast<std::uint64_t>(end - first); }
};

bool is_valid(const RowHeader& header) {
  // NumPy's generator needs an odd increment. With an even one, a reset that draws until a condition holds might never
  // end.
  const bool even = header.seeded != 0 && header.rng.words()[2] % 2 == 0;
  return header.origin <= static_cast<std::uint8_t>(Origin::set) && header.steps >= 0 && header.steps <= kMaxSteps &&
         !even;
}

std::uint16_t engine_number() {
  int major = 0, minor = 0, patch = 0;
  std::sscanf(mujoco_version(), "%d.%d.%d", &major, &minor, &patch);
  return static_cast<std::uint16_t>(10000 * major + 100 * minor + patch);
}

void check_engine(int engine) {
  if (engine == engine_number()) return;
  const auto part = [engine](int unit) { return std::to_string(engine / unit % 100); };
  fail(MJENV_E_SNAPSHOT, "the image was made on MuJoCo " + part(10000) + "." + part(100) + "." + part(1) +
                             ", but this environment uses MuJoCo " + mujoco_version() +
                             ": restore it on the engine of that version");
}

void check_rounding(Identity::Rounding of_image, Identity::Rounding here) {
  if (of_image == here) return;
  const auto name = [](Identity::Rounding rounding) {
    return rounding == Identity::Rounding::fused ? "fused" : "plain";
  };
  fail(MJENV_E_SNAPSHOT, std::string("the image was made with ") + name(of_image) +
                             " rounding of norms, but this environment uses " + name(here) +
                             " rounding: set the option \"norm\" to \"" + name(of_image) + "\"");
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
  return sizeof(ImageHeader) + Range(rows, row).count() * row_bytes(rows);
}

void write_image(const Rows& rows, const Identity& identity, std::int64_t row, void* image) {
  const Range range(rows, row);
  auto* to = static_cast<unsigned char*>(image) + sizeof(ImageHeader);
  for (std::int64_t i = range.first; i < range.end; ++i) {
    const Rows::Head& head = rows.head(i);
    RowHeader header{head.rng, head.steps};
    header.origin = static_cast<std::uint8_t>(head.origin);
    header.seeded = head.seeded, header.ready = head.ready, header.ended = head.ended;
    std::memcpy(to, &header, sizeof header);
    std::memcpy(to + sizeof header, rows.state(i), rows.record_bytes());
    to += row_bytes(rows);
  }
  ImageHeader header;
  header.engine = engine_number();
  header.identity = identity.hash;
  header.rounding = identity.rounding;
  header.rows = range.count();
  header.checksum = hash(static_cast<unsigned char*>(image) + sizeof header, image_size(rows, row) - sizeof header);
  std::memcpy(image, &header, sizeof header);
}

void read_image(Rows& rows, const Identity& identity, const std::string& id, std::int64_t row, const void* image,
                std::size_t size) {
  const std::size_t needed = image_size(rows, row);
  const ImageHeader expected;
  ImageHeader header;
  if (size < sizeof header) fail(MJENV_E_SNAPSHOT, "an image of " + std::to_string(size) + " bytes is too short");
  const auto* from = static_cast<const unsigned char*>(image);
  std::memcpy(&header, from, sizeof header);
  if (header.magic != expected.magic) fail(MJENV_E_SNAPSHOT, "this is not an image that mjenv_snapshot wrote");
  if (header.version != expected.version)
    fail(MJENV_E_SNAPSHOT, "the image has version " + std::to_string(header.version) +
                               ", but this library reads version " + std::to_string(expected.version));
  check_engine(header.engine);
  if (header.identity != identity.hash)
    fail(MJENV_E_SNAPSHOT,
         "the image was made with another id, model, task revision or other options than this environment, " + id);
  const Range range(rows, row);
  if (header.rows != range.count())
    fail(MJENV_E_SNAPSHOT,
         "the image holds " + std::to_string(header.rows) + " row(s), not " + std::to_string(range.count()));
  bool intact = size == needed && header.rounding <= Identity::Rounding::fused &&
                (header.rounding == Identity::Rounding::any) == (identity.rounding == Identity::Rounding::any) &&
                header.checksum == hash(from + sizeof header, size - sizeof header);
  const auto record_at = [&](std::int64_t i) {
    return from + sizeof header + static_cast<std::size_t>(i - range.first) * row_bytes(rows);
  };
  const auto row_header_at = [&](std::int64_t i) {
    RowHeader row_header;
    std::memcpy(&row_header, record_at(i), sizeof row_header);
    return row_header;
  };
  for (std::int64_t i = range.first; intact && i < range.end; ++i) intact = is_valid(row_header_at(i));
  if (!intact) fail(MJENV_E_SNAPSHOT, "the image is damaged, or size_bytes is not its size");
  check_rounding(header.rounding, identity.rounding);

  for (std::int64_t i = range.first; i < range.end; ++i) {
    const RowHeader row_header = row_header_at(i);
    std::memcpy(rows.state(i), record_at(i) + sizeof row_header, rows.record_bytes());
    rows.head(i) = {
        row_header.rng,        row_header.steps,     0, static_cast<Origin>(row_header.origin), row_header.seeded != 0,
        row_header.ready != 0, row_header.ended != 0};
  }
}

}  // namespace mjenv::core
