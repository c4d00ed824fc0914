#include "env/image.hpp"

#include <array>
#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

#include "engine/model.hpp"
#include "error.hpp"
#include "hash.hpp"

namespace mjenv::core {
namespace {

// An image consists of
//   - an ImageHeader
//   - the names of the arrays that rows have of their own, each followed by a 0 byte; then 0 bytes to a multiple of 8
//   - for each row, a RowHeader, the row's record and its own values; then, if ImageHeader::has_past, what OwnValues
//     keeps: three blocks of values and a state, which hold zeros where RowHeader::kept says that nothing was kept;
//     then the row's record of noise, delays and pushes.
struct ImageHeader {
  std::array<char, 8> magic{'m', 'j', 'e', 'n', 'v', 'r', 'o', 'w'};
  std::uint16_t version = 4;
  std::uint16_t engine = 0;  // the version of MuJoCo: 10000 * major + 100 * minor + patch
  Identity::Rounding rounding = Identity::Rounding::any;
  std::uint16_t has_portable_math = 0;
  std::uint64_t identity = 0;
  std::uint64_t rows = 0;
  std::uint32_t names_bytes = 0, has_past = 0;
  std::uint64_t randomization = 0, perturbation = 0, perturbed_bytes = 0;
  std::uint64_t checksum = 0;  // of everything after the header
};

struct RowHeader {
  Rng rng;
  std::int64_t steps = 0;
  std::uint8_t origin = 0, seeded = 0, ready = 0, ended = 0, written = 0, has_constants = 0;
  std::uint8_t kept = 0;  // bits of Kept
  std::uint8_t unused = 0;
};
static_assert(std::is_trivially_copyable_v<RowHeader> && sizeof(RowHeader) == 56,
              "padding would put undefined bytes into an image");
static_assert(sizeof(ImageHeader) == 72, "padding would put undefined bytes into an image");

enum Kept : std::uint8_t { kept_computed = 1, kept_stepped = 2, kept_constants = 4, kept_state = 8 };

// More steps than any episode has. A larger count means that the image is damaged, and could overflow.
constexpr std::int64_t kMaxSteps = std::int64_t{1} << 62;

// A half-open range of rows.
struct Range {
  std::int64_t first, end;

  Range(const Rows& rows, std::int64_t row)
      : first(row == MJENV_ALL_ROWS ? 0 : row), end(row == MJENV_ALL_ROWS ? rows.count() : row + 1) {}
  std::uint64_t count() const { return static_cast<std::uint64_t>(end - first); }
};

// Where the parts of an image lie.
struct Layout {
  std::size_t names, record, block, state, perturbed;  // bytes
  bool has_past;

  std::size_t row() const { return sizeof(RowHeader) + record + (has_past ? 4 * block + state : block) + perturbed; }
  std::size_t rows_start() const { return sizeof(ImageHeader) + names; }
};

std::string names_of(const OwnArrays& arrays) {
  std::string names;
  for (const OwnArray& array : arrays.list()) names += array.original.name + '\0';
  names.resize((names.size() + 7) / 8 * 8);
  return names;
}

Layout layout_of(const Rows& rows, const Range& range) {
  bool has_past = false;
  for (std::int64_t i = range.first; i < range.end && !has_past; ++i) {
    const OwnValues::Past* past = rows.own().past(i);
    has_past = past && (past->computed || past->stepped || past->constants || past->state);
  }
  return {names_of(rows.own().arrays()).size(), rows.record_bytes(),    rows.own().block_bytes(),
          rows.layout().size * sizeof(double),  rows.perturbed_bytes(), has_past};
}

// Adds the arrays that an image names. Returns false if rows cannot have one of them as their own, or if names_of would
// not give exactly these bytes (a name stands twice, or the padding is wrong).
bool read_names(const char* from, std::size_t size, OwnArrays& arrays) {
  try {
    for (std::size_t start = 0; start < size;) {
      const std::string name(from + start, strnlen(from + start, size - start));
      if (!name.empty()) arrays.add(name);
      start += name.size() + 1;
    }
  } catch (const Error&) {
    return false;
  }
  const std::string names = names_of(arrays);
  return names.size() == size && std::memcmp(names.data(), from, size) == 0;
}

// Whether MuJoCo can compute with these values. The block may lie at any address.
bool are_valid(const OwnArrays& arrays, const std::byte* block) {
  std::vector<double> values, aligned(arrays.block_bytes() / sizeof(double));
  if (!aligned.empty()) std::memcpy(aligned.data(), block, arrays.block_bytes());
  try {
    for (const OwnArray& array : arrays.list()) {
      values.resize(array.original.count());
      OwnArrays::read(array, reinterpret_cast<const std::byte*>(aligned.data()), values.data());
      OwnArrays::check(array, values.data());
    }
  } catch (const Error&) {
    return false;
  }
  return true;
}

// Whether MuJoCo can compute with this StateLayout::rest, of which it uses some numbers as indices. It can compute with
// any other numbers in a state, even if the results are not finite.
bool is_valid_rest(const Model& model, const StateLayout& layout, const std::byte* rest) {
  if (layout.more == 0) return true;
  std::vector<double> numbers(layout.more);
  std::memcpy(numbers.data(), rest, layout.more * sizeof(double));
  return model.is_valid_more(numbers.data());
}

bool is_valid(const RowHeader& header) {
  // NumPy's generator needs an odd increment. With an even one, a reset that draws until a condition holds might never
  // end.
  const bool even = header.seeded != 0 && header.rng.words()[2] % 2 == 0;
  return header.origin <= static_cast<std::uint8_t>(Origin::set) && header.steps >= 0 && header.steps <= kMaxSteps &&
         header.written <= 1 && header.has_constants <= 1 && header.kept < 16 && !even;
}

std::uint16_t engine_number() {
  int major = 0, minor = 0, patch = 0;
  std::sscanf(mujoco_version(), "%d.%d.%d", &major, &minor, &patch);
  return static_cast<std::uint16_t>(10000 * major + 100 * minor + patch);
}

void check_engine(int engine) {
  if (engine == engine_number()) return;
  const auto part = [engine](int unit) { return std::to_string(engine / unit % 100); };
  const std::string made_on = part(10000) + "." + part(100) + "." + part(1);
  fail(MJENV_E_SNAPSHOT, "the image was made on MuJoCo " + made_on + ", but this environment uses MuJoCo " +
                             mujoco_version() + ": restore it in an environment on MuJoCo " + made_on);
}

// Throws unless the fingerprints are equal; 0: nothing was set. For the message, `what` names the setting and
// `function` the function that sets it.
void check_settings(const char* what, const char* function, std::uint64_t of_image, std::uint64_t here) {
  if (of_image == here) return;
  const std::string difference = of_image == 0 ? std::string("without ") + what + ", but this environment has some"
                                 : here == 0   ? std::string("with ") + what + ", but this environment has none"
                                               : std::string("with other ") + what + " than this environment has";
  fail(MJENV_E_SNAPSHOT, "the image was made " + difference + ": set the same with " + function);
}

void check_math(bool is_portable) {
  if (is_portable == math_is_portable()) return;
  const auto name = [](bool portable) { return portable ? "the portable math" : "the math of the C library"; };
  fail(MJENV_E_SNAPSHOT,
       std::string("the image was made with ") + name(is_portable) + ", but this library uses " + name(!is_portable) +
           ": restore it with a library built with MJENV_MATH=" + (is_portable ? "portable" : "system"));
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
  const Range range(rows, row);
  const Layout layout = layout_of(rows, range);
  return layout.rows_start() + range.count() * layout.row();
}

void write_image(const Rows& rows, const Identity& identity, std::int64_t row, void* image) {
  const Range range(rows, row);
  const Layout layout = layout_of(rows, range);
  const OwnValues& own = rows.own();
  auto* to = static_cast<unsigned char*>(image) + sizeof(ImageHeader);
  const auto append = [&](const void* from, std::size_t size) {
    if (size > 0 && from)
      std::memcpy(to, from, size);
    else
      std::memset(to, 0, size);
    to += size;
  };
  append(names_of(own.arrays()).data(), layout.names);
  for (std::int64_t i = range.first; i < range.end; ++i) {
    const Rows::Head& head = rows.head(i);
    RowHeader header{head.rng, head.steps};
    header.origin = static_cast<std::uint8_t>(head.origin);
    header.seeded = head.seeded, header.ready = head.ready, header.ended = head.ended;
    header.written = head.written, header.has_constants = head.has_constants;
    const OwnValues::Past* past = own.past(i);
    if (past)
      header.kept =
          static_cast<std::uint8_t>((past->computed ? kept_computed : 0) | (past->stepped ? kept_stepped : 0) |
                                    (past->constants ? kept_constants : 0) | (past->state ? kept_state : 0));
    append(&header, sizeof header);
    append(rows.state(i), layout.record);
    append(own.empty() ? nullptr : own.present(i), layout.block);
    if (layout.has_past) {
      append(past ? past->computed.get() : nullptr, layout.block);
      append(past ? past->stepped.get() : nullptr, layout.block);
      append(past ? past->constants.get() : nullptr, layout.block);
      append(past ? past->state.get() : nullptr, layout.state);
    }
    append(rows.perturbed(i), layout.perturbed);
  }
  ImageHeader header;
  header.engine = engine_number();
  header.identity = identity.hash;
  header.rounding = identity.rounding;
  header.has_portable_math = math_is_portable();
  header.rows = range.count();
  header.names_bytes = static_cast<std::uint32_t>(layout.names);
  header.has_past = layout.has_past;
  header.randomization = identity.randomization;
  header.perturbation = identity.perturbation;
  header.perturbed_bytes = layout.perturbed;
  header.checksum = hash(static_cast<unsigned char*>(image) + sizeof header, image_size(rows, row) - sizeof header);
  std::memcpy(image, &header, sizeof header);
}

void read_image(Rows& rows, const Model& model, const Perturbation& perturbation, const Identity& identity,
                const std::string& id, std::int64_t row, const void* image, std::size_t size) {
  if (row != MJENV_ALL_ROWS) rows.check(row);
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
  check_math(header.has_portable_math != 0);
  if (header.identity != identity.hash)
    fail(MJENV_E_SNAPSHOT,
         "the image was made with another id, model, task revision or other options than this environment, " + id);
  check_settings("randomisation", "mjenv_randomize", header.randomization, identity.randomization);
  check_settings("noise, delays or pushes", "mjenv_perturb", header.perturbation, identity.perturbation);
  const Range range(rows, row);
  if (header.rows != range.count())
    fail(MJENV_E_SNAPSHOT,
         "the image holds " + std::to_string(header.rows) + " row(s), not " + std::to_string(range.count()));
  const auto damaged = [] { fail(MJENV_E_SNAPSHOT, "the image is damaged, or size_bytes is not its size"); };
  OwnArrays arrays(model);
  if (header.has_portable_math > 1 || header.has_past > 1 || header.names_bytes > size - sizeof header ||
      !read_names(reinterpret_cast<const char*>(from) + sizeof header, header.names_bytes, arrays))
    damaged();
  const Layout layout{header.names_bytes,     rows.record_bytes(),
                      arrays.block_bytes(),   rows.layout().size * sizeof(double),
                      rows.perturbed_bytes(), header.has_past != 0};
  if (header.perturbed_bytes != layout.perturbed || size != layout.rows_start() + range.count() * layout.row() ||
      header.rounding > Identity::Rounding::fused ||
      (header.rounding == Identity::Rounding::any) != (identity.rounding == Identity::Rounding::any) ||
      header.checksum != hash(from + sizeof header, size - sizeof header))
    damaged();

  struct RowImage {
    RowHeader header;
    const std::byte *record, *present, *computed, *stepped, *constants, *state, *perturbed;
  };
  const auto row_image = [&](std::int64_t i) {
    RowImage r{};
    const auto* start = reinterpret_cast<const std::byte*>(from) + layout.rows_start() +
                        static_cast<std::size_t>(i - range.first) * layout.row();
    std::memcpy(&r.header, start, sizeof r.header);
    r.record = start + sizeof r.header;
    r.present = r.record + layout.record;
    r.computed = r.present + layout.block;
    r.stepped = r.computed + layout.block;
    r.constants = r.stepped + layout.block;
    r.state = r.constants + layout.block;
    r.perturbed = start + layout.row() - layout.perturbed;
    return r;
  };
  // All of the image is checked, and all memory is allocated, before any row changes.
  std::vector<double> record(layout.perturbed / sizeof(double));  // aligned
  for (std::int64_t i = range.first; i < range.end; ++i) {
    const RowImage r = row_image(i);
    const unsigned kept = r.header.kept;
    const std::size_t rest = rows.layout().more * sizeof(double);
    const auto is_valid_before = [&](const std::byte* end) { return is_valid_rest(model, rows.layout(), end - rest); };
    const auto is_valid_state = [&](const std::byte* state) { return is_valid_before(state + layout.state); };
    const std::byte* record_end = r.record + layout.record;  // a record ends with two more StateLayout::rest
    if (!is_valid(r.header) || (kept != 0 && !layout.has_past) || !is_valid_state(r.record) ||
        !is_valid_state(r.record + layout.state) || !is_valid_before(record_end) ||
        !is_valid_before(record_end - rest) || !are_valid(arrays, r.present) ||
        (kept & kept_computed && !are_valid(arrays, r.computed)) ||
        (kept & kept_stepped && !are_valid(arrays, r.stepped)) ||
        (kept & kept_constants && !are_valid(arrays, r.constants)) || (kept & kept_state && !is_valid_state(r.state)))
      damaged();
    if (record.empty()) continue;
    std::memcpy(record.data(), r.perturbed, layout.perturbed);
    if (!perturbation.is_valid(record.data())) damaged();
  }
  check_rounding(header.rounding, identity.rounding);
  OwnValues& own = rows.own();
  std::vector<std::string> names;
  for (const OwnArray& array : arrays.list()) names.push_back(array.original.name);
  own.add(names);
  if (layout.has_past) own.make_pasts();
  std::vector<OwnValues::Past> pasts(layout.has_past ? range.count() : 0);
  for (std::int64_t i = range.first; i < range.end && layout.has_past; ++i) {
    const RowImage r = row_image(i);
    OwnValues::Past& past = pasts[static_cast<std::size_t>(i - range.first)];
    if (r.header.kept & kept_computed) past.computed = own.translated(arrays, r.computed);
    if (r.header.kept & kept_stepped) past.stepped = own.translated(arrays, r.stepped);
    if (r.header.kept & kept_constants) past.constants = own.translated(arrays, r.constants);
    if (r.header.kept & kept_state) {
      past.state = std::make_unique<double[]>(layout.state / sizeof(double));
      std::memcpy(past.state.get(), r.state, layout.state);
    }
  }
  for (std::int64_t i = range.first; i < range.end; ++i) {
    const RowImage r = row_image(i);
    std::memcpy(rows.state(i), r.record, layout.record);
    if (layout.perturbed > 0) std::memcpy(rows.perturbed(i), r.perturbed, layout.perturbed);
    OwnValues::Past past;
    if (layout.has_past) past = std::move(pasts[static_cast<std::size_t>(i - range.first)]);
    own.set(i, arrays, r.present, std::move(past));
    Rows::Head& head = rows.head(i);
    head = {};
    head.rng = r.header.rng;
    head.steps = r.header.steps;
    head.origin = static_cast<Origin>(r.header.origin);
    head.seeded = r.header.seeded != 0, head.ready = r.header.ready != 0, head.ended = r.header.ended != 0;
    head.written = r.header.written != 0, head.has_constants = r.header.has_constants != 0;
  }
}

}  // namespace mjenv::core
