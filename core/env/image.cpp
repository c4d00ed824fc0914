#include "env/image.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/model.hpp"
#include "error.hpp"
#include "hash.hpp"

namespace mjenv::core {
namespace {

// An image consists of
//   - an ImageHeader
//   - an Item for each part that some row of the image has, in the order of kParts, with the part's size in one row
//   - an Item for each array in which some row has own values that are not the model's, in alphabetical order, with
//     its size in a block of own values, where the arrays follow each other at multiples of 8 bytes
//   - each row's parts, one after the other. Head::kept says which of the kept parts the row has
// Rows in equal states have equal images, whatever calls led to the states. So an image leaves out arrays whose values
// equal the model's, and an entry's own values if the same values would apply without them (Entry).
struct ImageHeader {
  std::array<char, 8> magic{'m', 'j', 'e', 'n', 'v', 'r', 'o', 'w'};
  std::uint16_t version = 6;
  std::uint16_t engine = 0;  // the version of MuJoCo: 10000 * major + 100 * minor + patch
  Identity::Rounding rounding = Identity::Rounding::any;
  std::uint16_t has_portable_math = 0;
  std::uint64_t identity = 0;
  std::uint64_t rows = 0;
  std::uint64_t randomization = 0, perturbation = 0;
  std::uint32_t parts = 0, arrays = 0;  // how many entries there are
  std::uint64_t checksum = 0;           // of everything after the header
};
static_assert(sizeof(ImageHeader) == 64, "padding would put undefined bytes into an image");

struct Item {
  std::array<char, 36> name{};  // ends with 0 bytes
  std::uint32_t kept = 0;       // the bit of Head::kept that says whether a row has this part; 0: all rows have it
  std::uint64_t bytes = 0;
};
static_assert(sizeof(Item) == 48, "padding would put undefined bytes into an image");

using Head = Rows::Head;
static_assert(std::is_trivially_copyable_v<Head> && std::is_standard_layout_v<Head> && sizeof(Head) == 56,
              "padding would put undefined bytes into an image");

Item item_of(const std::string& name, std::uint32_t kept, std::size_t bytes) {
  Item item{{}, kept, bytes};
  if (name.size() >= item.name.size()) fail(MJENV_E_INTERNAL, "the name " + quoted(name) + " is too long for an image");
  std::copy(name.begin(), name.end(), item.name.begin());
  return item;
}

// A half-open range of rows.
struct Range {
  std::int64_t first, end;

  Range(const Rows& rows, std::int64_t row)
      : first(row == MJENV_ALL_ROWS ? 0 : row), end(row == MJENV_ALL_ROWS ? rows.count() : row + 1) {}
  std::int64_t count() const { return end - first; }
};

// How many bytes a part has in an image whose rows have own values of these arrays.
std::size_t bytes_of(const PartKind& kind, const Rows& rows, const OwnArrays& arrays) {
  return kind.content == Content::values ? arrays.block_bytes() : rows.bytes_of(kind.content);
}

// What an image of these rows contains.
class Plan {
 public:
  Plan(const Rows& rows, const Range& range) : rows_(rows), arrays_(rows.arrays().empty_layout()) {
    if (!rows.arrays().empty()) choose_arrays(range);
    size_ = sizeof(ImageHeader) + arrays_.list().size() * sizeof(Item);
    std::uint16_t present = 0;
    for (std::int64_t row = range.first; row < range.end; ++row) {
      const std::uint16_t kept = kept_of(row);
      present |= kept;
      for (const PartKind& kind : kParts)
        if (is_in(kind, kept)) size_ += bytes_of(kind, rows_, arrays_);
    }
    for (const PartKind& kind : kParts)
      if (is_in(kind, present)) parts_.push_back(&kind);
    size_ += parts_.size() * sizeof(Item);
  }

  std::size_t size() const { return size_; }
  const OwnArrays& arrays() const { return arrays_; }
  const std::vector<const PartKind*>& parts() const { return parts_; }
  bool is_in(const PartKind& kind, std::uint16_t kept) const {
    return bytes_of(kind, rows_, arrays_) > 0 && kind.is_in(kept);
  }
  // The row's Head::kept, without the bits of own values that equal those that would apply in their place (Entry).
  std::uint16_t kept_of(std::int64_t row) const {
    std::uint16_t kept = rows_.head(row).kept;
    for (const Entry entry : {Entry::first, Entry::set_state, Entry::set_constants})
      if ((kept & kept_bit(values_of(entry))) != 0 &&
          std::memcmp(rows_.values(row, entry), rows_.values(row, next(entry)), rows_.block_bytes()) == 0)
        kept &= static_cast<std::uint16_t>(~kept_bit(values_of(entry)));
    return kept;
  }

 private:
  const Rows& rows_;
  OwnArrays arrays_;
  std::vector<const PartKind*> parts_;
  std::size_t size_ = 0;

  void choose_arrays(const Range& range) {
    std::vector<const OwnArray*> chosen;
    for (const OwnArray& array : rows_.arrays().list())
      if (differs(array, range)) chosen.push_back(&array);
    std::sort(chosen.begin(), chosen.end(),
              [](const OwnArray* a, const OwnArray* b) { return a->original.name < b->original.name; });
    for (const OwnArray* array : chosen) arrays_.append(*array);
  }

  // Whether the array differs from the model's in any entry of any row.
  bool differs(const OwnArray& array, const Range& range) const {
    const std::byte* model = rows_.model_values();
    const auto is_other = [&](const std::byte* block) {
      return block != model && std::memcmp(block + array.offset, model + array.offset, array.bytes) != 0;
    };
    for (std::int64_t row = range.first; row < range.end; ++row)
      for (const PartKind& kind : kParts)
        if (kind.content == Content::values && rows_.has(row, kind) && is_other(rows_.bytes(kind.part, row)))
          return true;
    return false;
  }
};

// Checks the parts of an image, which may come from an untrusted source and may be misaligned.
class Checks {
 public:
  Checks(const Rows& rows, const OwnArrays& arrays, const Task& task, const Randomization& randomization,
         const Perturbation& perturbation, const Frames& frames)
      : rows_(rows),
        arrays_(arrays),
        task_(task),
        randomization_(randomization),
        perturbation_(perturbation),
        frames_(frames) {}

  // Whether MuJoCo and the library can compute with this part.
  bool is_valid(const PartKind& kind, const std::byte* part) {
    const StateLayout& layout = rows_.layout();
    switch (kind.content) {
      case Content::head: return is_valid_head(part);
      // MuJoCo can compute with any numbers in a state, although the results may be infinite. But indices in it must be
      // valid.
      case Content::state: return is_valid_rest(part + (layout.size - layout.more) * sizeof(double));
      case Content::rest: return is_valid_rest(part);
      case Content::values: return is_valid_block(part);
      case Content::perturbation: return perturbation_.is_valid(aligned(part, rows_.bytes_of(kind.content)));
      case Content::ranges: return randomization_.is_valid(aligned(part, rows_.bytes_of(kind.content)));
      case Content::parameters: return task_.parameters.is_valid(aligned(part, rows_.bytes_of(kind.content)));
      case Content::history: return frames_.is_valid(aligned(part, rows_.bytes_of(kind.content)));
      case Content::random_state: {
        np::RandomState stream;
        std::memcpy(static_cast<void*>(&stream), part, sizeof stream);
        return stream.is_valid();
      }
      case Content::carried: break;
    }
    if (const std::string why = task_.calls->out_of_bounds(part); !why.empty())
      fail(MJENV_E_SNAPSHOT, "the image is damaged: " + why);
    return true;
  }

 private:
  // No episode has so many steps. A larger count would mean that the image is damaged, and might overflow.
  static constexpr std::int64_t kMaxSteps = std::int64_t{1} << 62;

  const Rows& rows_;
  const OwnArrays& arrays_;
  const Task& task_;
  const Randomization& randomization_;
  const Perturbation& perturbation_;
  const Frames& frames_;
  std::vector<double> numbers_;

  const double* aligned(const std::byte* part, std::size_t size) {
    numbers_.resize(size / sizeof(double));
    if (size > 0) std::memcpy(numbers_.data(), part, size);
    return numbers_.data();
  }

  bool is_valid_head(const std::byte* part) const {
    for (const std::size_t flag : {offsetof(Head, seeded), offsetof(Head, ready), offsetof(Head, ended)})
      if (part[flag] > std::byte{1}) return false;  // no bool
    if (part[offsetof(Head, written)] > static_cast<std::byte>(Written::by_caller)) return false;
    Head head;
    std::memcpy(&head, part, sizeof head);
    std::uint16_t possible = 0;
    for (const PartKind& kind : kParts)
      if (kind.content != Content::values || arrays_.block_bytes() > 0) possible |= kind.kept;
    // The increment of NumPy's generator must be odd. With an even one, a reset that draws until a condition holds
    // might never end.
    const bool is_even = head.seeded && head.rng.words()[2] % 2 == 0;
    // Own values of an entry that the row does not have would be shared by the entries before it.
    for (const Entry entry : {Entry::set_state, Entry::set_constants})
      if ((head.kept & kept_bit(state_of(entry))) == 0)
        possible &= static_cast<std::uint16_t>(~kept_bit(values_of(entry)));
    return (head.kept & ~possible) == 0 && head.origin <= Origin::step && head.steps >= 0 && head.steps <= kMaxSteps &&
           Work::are_warnings(head.warnings) && !is_even;
  }

  bool is_valid_rest(const std::byte* rest) {
    const std::size_t size = rows_.bytes_of(Content::rest);
    return size == 0 || task_.model->is_valid_more(aligned(rest, size));
  }

  bool is_valid_block(const std::byte* part) {
    const auto* block = reinterpret_cast<const std::byte*>(aligned(part, arrays_.block_bytes()));
    try {
      for (const OwnArray& array : arrays_.list()) array.check(block);
    } catch (const Error&) {
      return false;
    }
    return true;
  }
};

// Appends an array that an image names. Returns false if rows cannot have own values of it, or if its size is not
// `bytes`.
bool append(const Model& model, const std::string& name, std::uint64_t bytes, OwnArrays& arrays) {
  try {
    OwnArray array = OwnArray::of(model, name);
    if (array.bytes == 0 || array.bytes != bytes) return false;
    arrays.append(std::move(array));
    return true;
  } catch (const Error&) {
    return false;
  }
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

// Throws unless the fingerprint of a setting is the same in the image and here. 0 means that nothing was set. what,
// function: the names of the setting and of its function, for the message.
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

Identity identity_of(const Options& options, const Task& task, const Frames& frames) {
  std::uint64_t value = hash(options.id().data(), options.id().size(), task.model->fingerprint());
  value = hash(&task.revision, sizeof task.revision, value);
  for (const auto& option : options.all()) {
    if (option.in_identity == InIdentity::no) continue;
    value = hash(&option.integer, sizeof option.integer, value);
    value = hash(option.reals.data(), option.reals.size() * sizeof(double), value);
    value = hash(option.text.data(), option.text.size(), value);
  }
  if (frames.stacks_keys()) value = hash("keys", 4, value);
  using Rounding = Identity::Rounding;
  return {value, !task.norm ? Rounding::any : task.norm->fused() ? Rounding::fused : Rounding::plain};
}

std::size_t image_size(const Rows& rows, std::int64_t row) {
  if (row != MJENV_ALL_ROWS) rows.check(row);
  return Plan(rows, Range(rows, row)).size();
}

void write_image(const Rows& rows, const Identity& identity, std::int64_t row, void* image) {
  const Range range(rows, row);
  const Plan plan(rows, range);
  auto* to = static_cast<std::byte*>(image) + sizeof(ImageHeader);
  const auto append = [&](const void* from, std::size_t size) {
    std::memcpy(to, from, size);
    to += size;
  };
  const auto append_item = [&](const std::string& name, std::uint32_t kept, std::size_t bytes) {
    const Item item = item_of(name, kept, bytes);
    append(&item, sizeof item);
  };
  for (const PartKind* kind : plan.parts()) append_item(kind->name, kind->kept, bytes_of(*kind, rows, plan.arrays()));
  for (const OwnArray& array : plan.arrays().list()) append_item(array.original.name, 0, array.bytes);
  std::vector<double> block(plan.arrays().block_bytes() / sizeof(double));
  for (std::int64_t i = range.first; i < range.end; ++i) {
    Head head = rows.head(i);
    head.kept = plan.kept_of(i);
    for (const PartKind* kind : plan.parts()) {
      if (!plan.is_in(*kind, head.kept)) continue;
      const void* from = rows.bytes(kind->part, i);
      if (kind->content == Content::head) from = &head;
      if (kind->content == Content::values) {
        plan.arrays().copy(rows.arrays(), rows.bytes(kind->part, i), reinterpret_cast<std::byte*>(block.data()));
        from = block.data();
      }
      append(from, bytes_of(*kind, rows, plan.arrays()));
    }
  }
  ImageHeader header;
  header.engine = engine_number();
  header.rounding = identity.rounding;
  header.has_portable_math = math_is_portable();
  header.identity = identity.hash;
  header.rows = static_cast<std::uint64_t>(range.count());
  header.randomization = identity.randomization;
  header.perturbation = identity.perturbation;
  header.parts = static_cast<std::uint32_t>(plan.parts().size());
  header.arrays = static_cast<std::uint32_t>(plan.arrays().list().size());
  header.checksum = hash(static_cast<const std::byte*>(image) + sizeof header, plan.size() - sizeof header);
  std::memcpy(image, &header, sizeof header);
}

void read_image(Rows& rows, const Task& task, const Randomization& randomization, const Perturbation& perturbation,
                const Frames& frames, const Identity& identity, const std::string& id, std::int64_t row,
                const void* image, std::size_t size) {
  if (row != MJENV_ALL_ROWS) rows.check(row);
  const ImageHeader expected;
  ImageHeader header;
  if (size < sizeof header) fail(MJENV_E_SNAPSHOT, "an image of " + std::to_string(size) + " bytes is too short");
  const auto* from = static_cast<const std::byte*>(image);
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
  check_settings("noise, delays or pushes", "mjenv_randomize", header.perturbation, identity.perturbation);
  const Range range(rows, row);
  if (header.rows != static_cast<std::uint64_t>(range.count()))
    fail(MJENV_E_SNAPSHOT,
         "the image holds " + std::to_string(header.rows) + " row(s), not " + std::to_string(range.count()));
  const auto damaged = [] { fail(MJENV_E_SNAPSHOT, "the image is damaged, or size_bytes is not its size"); };
  if (header.has_portable_math > 1 || header.rounding > Identity::Rounding::fused ||
      (header.rounding == Identity::Rounding::any) != (identity.rounding == Identity::Rounding::any) ||
      header.checksum != hash(from + sizeof header, size - sizeof header))
    damaged();

  // The whole image is checked, and all memory is allocated, before any row changes.
  const std::byte *at = from + sizeof header, *const end = from + size;
  const auto take = [&](std::size_t bytes) {
    if (bytes > static_cast<std::size_t>(end - at)) damaged();
    return std::exchange(at, at + bytes);
  };
  const auto take_item = [&] {
    Item item;
    std::memcpy(&item, take(sizeof item), sizeof item);
    if (item.name.back() != 0) damaged();
    return item;
  };
  std::vector<Item> parts;
  for (std::uint32_t i = 0; i < header.parts; ++i) parts.push_back(take_item());
  OwnArrays arrays = rows.arrays().empty_layout();
  std::vector<std::string> names;
  for (std::uint32_t i = 0; i < header.arrays; ++i) {
    const Item item = take_item();
    names.emplace_back(item.name.data());
    if ((i > 0 && names[i] <= names[i - 1]) || !append(*task.model, names[i], item.bytes, arrays)) damaged();
  }
  std::vector<const PartKind*> kinds;
  for (const PartKind& kind : kParts) {
    if (kinds.size() == parts.size()) break;
    const Item& item = parts[kinds.size()];
    if (item.name.data() == std::string(kind.name) && item.kept == kind.kept &&
        item.bytes == bytes_of(kind, rows, arrays))
      kinds.push_back(&kind);
  }
  if (kinds.size() != parts.size()) damaged();

  struct Found {
    const PartKind* kind;
    std::int64_t row;
    const std::byte* bytes;
  };
  std::vector<Found> found;
  std::uint16_t all_kept = 0;
  Checks checks(rows, arrays, task, randomization, perturbation, frames);
  for (std::int64_t i = range.first; i < range.end; ++i) {
    std::uint16_t kept = 0;
    for (const PartKind& kind : kParts) {
      const std::size_t bytes = bytes_of(kind, rows, arrays);
      if (bytes == 0 || !kind.is_in(kept)) continue;
      if (std::find(kinds.begin(), kinds.end(), &kind) == kinds.end()) damaged();
      const std::byte* const part = take(bytes);
      if (!checks.is_valid(kind, part)) damaged();
      if (kind.part == Part::head) std::memcpy(&kept, part + offsetof(Head, kept), sizeof kept);
      found.push_back({&kind, i, part});
    }
    all_kept |= kept;
  }
  if (at != end) damaged();
  check_rounding(header.rounding, identity.rounding);
  rows.add_arrays(names);
  for (const Entry entry : {Entry::set_state, Entry::set_constants})
    if ((all_kept & kept_bit(state_of(entry))) != 0) rows.make_room(entry);

  std::vector<double> numbers(rows.block_bytes() / sizeof(double));
  auto* const block = reinterpret_cast<std::byte*>(numbers.data());

  for (std::int64_t i = range.first; i < range.end; ++i) rows.share_model_values(i);
  for (const Found& one : found) {
    const bool is_block = one.kind->content == Content::values;
    if (is_block) rows.arrays().copy(arrays, one.bytes, block);
    if (one.kind->part == Part::values)
      rows.set_values(one.row, block);
    else
      std::memcpy(rows.room(one.kind->part, one.row), is_block ? block : one.bytes, rows.bytes_of(one.kind->content));
  }
}

}  // namespace mjenv::core
