#include "env/randomization.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "engine/work.hpp"
#include "error.hpp"
#include "hash.hpp"
#include "structs.hpp"

namespace mjenv::core {
namespace {

constexpr std::int64_t kMaxItems = 10'000;
constexpr std::int64_t kMaxParameters = 100'000;
// The least part of a normal distribution that truncation may leave. A draw then takes 1000 attempts on average.
constexpr double kLeastMass = 1e-3;

// The probability that a draw from a normal distribution lies in [low, high].
double mass_within(double mean, double std, double low, double high) {
  if (std == 0) return low <= mean && mean <= high ? 1 : 0;
  const auto below = [&](double x) { return std::erfc((mean - x) / std * std::sqrt(0.5)) / 2; };
  const auto above = [&](double x) { return std::erfc((x - mean) / std * std::sqrt(0.5)) / 2; };
  return low > mean ? above(low) - above(high) : below(high) - below(low);
}

[[noreturn]] void refuse(const std::string& why) { fail(MJENV_E_VALUE, why); }

bool is_real(const OwnArray& array) {
  return array.original.type == MJENV_DTYPE_FLOAT64 || array.original.type == MJENV_DTYPE_FLOAT32;
}

template <typename T>
std::uint64_t hash_of(const std::vector<T>& list, std::uint64_t start) {
  const std::size_t count = list.size();
  return hash(list.data(), count * sizeof(T), hash(&count, sizeof count, start));
}

}  // namespace

double Randomization::Item::next(const double* p, np::Generator& rng) const {
  switch (distribution) {
    case MJENV_DISTRIBUTION_LOG_UNIFORM: return std::exp(rng.uniform(std::log(p[0]), std::log(p[1])));
    case MJENV_DISTRIBUTION_NORMAL: return p[0] + p[1] * rng.normal();
    case MJENV_DISTRIBUTION_TRUNCATED_NORMAL:
      for (;;) {
        const double drawn = p[0] + p[1] * rng.normal();
        if (p[2] <= drawn && drawn <= p[3]) return drawn;
      }
    case MJENV_DISTRIBUTION_CHOICE:
      return choices[static_cast<std::size_t>(rng.integers(0, static_cast<std::int64_t>(choices.size())))];
    default: return rng.uniform(p[0], p[1]);
  }
}

double Randomization::Item::value(std::size_t i, double drawn) const {
  drawn *= factor;
  switch (effect) {
    case MJENV_EFFECT_SCALE: return originals[i] * drawn;
    case MJENV_EFFECT_OFFSET: return originals[i] + drawn;
    default: return drawn;
  }
}

Randomization::Randomization(const mjenv_randomization* items, std::int64_t count, const Model& model) {
  std::size_t index = 0;
  for_each_struct(items, count, kMaxItems, "count", "items", [&](const mjenv_randomization& given) {
    const std::string name = "items[" + std::to_string(index++) + "]";
    if (!given.array) fail(MJENV_E_ARGUMENT, name + ".array is NULL");
    try {
      add(given, model);
    } catch (const Error& error) {
      fail(error.status(), name + ", " + quoted(given.array) + ": " + error.what());
    }
  });
}

void Randomization::add(const mjenv_randomization& given, const Model& model) {
  Item item = item_of(given, model);
  if (item.repeats) {
    if (items_.empty()) refuse("it repeats the item before, but there is none");
    const auto drawn = std::find_if(items_.rbegin(), items_.rend(), [](const Item& one) { return !one.repeats; });
    if (!drawn->shared) item.per_draw = per_draw(item, drawn->elements.size());
    if (!is_real(item.array)) refuse("it holds integers, which can only be drawn with MJENV_DISTRIBUTION_CHOICE");
    item.is_checked = item.is_checked || drawn->distribution == MJENV_DISTRIBUTION_NORMAL;
    if (item.array.checks_elements_alone()) check_ends(item, *drawn, ranges_.data() + drawn->first);
  } else {
    check_range("parameter_count", given.parameter_count, 1, kMaxParameters, MJENV_E_SIZE);
    const bool is_choice = item.distribution == MJENV_DISTRIBUTION_CHOICE;
    const std::int64_t needed = item.distribution == MJENV_DISTRIBUTION_TRUNCATED_NORMAL ? 4 : 2;
    if (!is_choice) check_count("parameter_count", given.parameter_count, needed);
    if (!given.parameters) fail(MJENV_E_ARGUMENT, "parameters is NULL");
    const double* const end = given.parameters + given.parameter_count;
    if (is_choice) {
      item.choices.assign(given.parameters, end);
    } else {
      item.first = ranges_.size();
      item.count = static_cast<std::size_t>(given.parameter_count);
      ranges_.insert(ranges_.end(), given.parameters, end);
    }
    check_parameters(item, given.parameters);
    if (item.array.checks_elements_alone()) check_ends(item, item, given.parameters);
    const std::vector<double> parameters(given.parameters, end);
    fingerprint_ = hash_of(parameters, fingerprint_);
  }
  const std::vector<std::int32_t> kinds{item.distribution, item.effect, item.shared, given.constants != 0,
                                        item.repeats};
  fingerprint_ = hash(given.array, item.array.original.name.size(), hash_of(kinds, fingerprint_));
  fingerprint_ = hash(&item.factor, sizeof item.factor, hash_of(item.elements, fingerprint_));
  computes_constants_ = computes_constants_ || (given.constants != 0 && !item.elements.empty());
  items_.push_back(std::move(item));
}

// How many elements of a repeating item use each of so many draws: one, or several of the same row of its array.
std::size_t Randomization::per_draw(const Item& item, std::size_t draws) {
  const std::vector<std::size_t>& elements = item.elements;
  const std::vector<std::int64_t>& shape = item.array.original.shape;
  const std::size_t columns = shape.size() == 2 ? static_cast<std::size_t>(shape[1]) : 1;
  const std::size_t each = draws == 0 ? 0 : elements.size() / draws;
  bool fits = elements.size() == each * draws && (each > 0 || draws == 0);
  for (std::size_t i = 0; fits && each > 0 && i < elements.size(); ++i)
    fits = elements[i] / columns == elements[i - i % each] / columns;
  if (!fits)
    fail(MJENV_E_SIZE, "element_count is " + std::to_string(elements.size()) + ", not " + std::to_string(draws) +
                           ", as many as the item before draws, nor as many elements of one row of the array for each");
  return each;
}

Randomization::Item Randomization::item_of(const mjenv_randomization& given, const Model& model) {
  Item item{};
  if (StateLayout(model).part(given.array))
    fail(MJENV_E_NAME, "it is part of the state, but only arrays of the mjModel are drawn");
  if (!core::find(model.arrays(), given.array)) {
    const std::vector<std::string> all = writable_names(model), likely = nearest(given.array, all);
    fail(MJENV_E_NAME, "mjModel has no array of this name, and only its arrays can be drawn; " +
                           (likely.empty() ? "those that can be drawn are " + listed(all)
                                           : "is one of these meant? " + listed(likely)));
  }
  item.array = OwnArray::written(model, given.array);
  if (given.distribution < MJENV_DISTRIBUTION_UNIFORM || given.distribution > MJENV_DISTRIBUTION_CHOICE)
    fail(MJENV_E_ARGUMENT, "no distribution " + std::to_string(given.distribution));
  if (given.effect < MJENV_EFFECT_VALUE || given.effect > MJENV_EFFECT_OFFSET)
    fail(MJENV_E_ARGUMENT, "no effect " + std::to_string(given.effect));
  item.distribution = given.distribution;
  item.effect = given.effect;
  item.repeats = given.repeats != 0;
  item.shared = given.shared != 0 && !item.repeats;
  item.factor = given.factor == 0 ? 1 : given.factor;
  if (!std::isfinite(item.factor)) refuse("the factor is " + number(item.factor));
  take_elements(item, given);
  item.is_checked = item.distribution == MJENV_DISTRIBUTION_NORMAL || !item.array.checks_elements_alone() ||
                    item.array.refuses_originals();
  return item;
}

void Randomization::take_elements(Item& item, const mjenv_randomization& given) {
  const std::size_t count = item.array.original.count();
  std::vector<double> all(count);
  item.array.original.read(all.data());
  if (!given.elements) {
    check_count("element_count", given.element_count, 0);
    item.elements.resize(count);
    std::iota(item.elements.begin(), item.elements.end(), std::size_t{0});
  } else {
    check_range("element_count", given.element_count, 0, static_cast<std::int64_t>(count), MJENV_E_SIZE);
    for (std::int64_t i = 0; i < given.element_count; ++i) {
      check_index("element", given.elements[i], count);
      item.elements.push_back(static_cast<std::size_t>(given.elements[i]));
    }
  }
  for (const std::size_t element : item.elements) item.originals.push_back(all[element]);
}

void Randomization::check_parameters(const Item& item, const double* p) {
  const bool is_choice = item.distribution == MJENV_DISTRIBUTION_CHOICE;
  for (std::size_t i = 0; i < (is_choice ? item.choices.size() : item.count); ++i)
    if (!std::isfinite(p[i])) refuse("a parameter is " + number(p[i]));
  const auto check_range = [](double low, double high) {
    if (std::signbit(high - low)) refuse("low (" + number(low) + ") is above high (" + number(high) + ")");
    if (!std::isfinite(high - low)) refuse("high - low is not finite");
  };
  switch (item.distribution) {
    case MJENV_DISTRIBUTION_LOG_UNIFORM:
      if (p[0] <= 0) refuse("low is " + number(p[0]) + ", but must be positive for its logarithm");
      [[fallthrough]];
    case MJENV_DISTRIBUTION_UNIFORM: check_range(p[0], p[1]); break;
    case MJENV_DISTRIBUTION_TRUNCATED_NORMAL: check_range(p[2], p[3]); [[fallthrough]];
    case MJENV_DISTRIBUTION_NORMAL:
      if (p[1] < 0) refuse("the standard deviation is " + number(p[1]) + ", but must not be negative");
      break;
    default: break;
  }
  if (item.distribution == MJENV_DISTRIBUTION_TRUNCATED_NORMAL && mass_within(p[0], p[1], p[2], p[3]) < kLeastMass)
    refuse("less than a thousandth of the draws of normal(" + number(p[0]) + ", " + number(p[1]) + ") lie in " +
           number(p[2]) + " to " + number(p[3]));
  if (!is_real(item.array) && !is_choice)
    refuse("it holds integers, which can only be drawn with MJENV_DISTRIBUTION_CHOICE");
}

// Throws if MuJoCo cannot compute with the smallest or the largest value that can be drawn, or with a value of a
// choice. A normal distribution has no smallest or largest value, so its mean is checked. drawn: the item that `item`
// repeats, or `item` itself.
void Randomization::check_ends(const Item& item, const Item& drawn, const double* p) {
  std::vector<double> ends;
  switch (drawn.distribution) {
    case MJENV_DISTRIBUTION_NORMAL: ends = {p[0]}; break;
    case MJENV_DISTRIBUTION_TRUNCATED_NORMAL: ends = {p[2], p[3]}; break;
    case MJENV_DISTRIBUTION_LOG_UNIFORM: ends = {std::exp(std::log(p[0])), std::exp(std::log(p[1]))}; break;
    case MJENV_DISTRIBUTION_CHOICE: ends = drawn.choices; break;
    default: ends = {p[0], p[1]};
  }
  std::vector<double> values(item.array.original.count());
  for (const double end : ends) {
    item.array.original.read(values.data());
    for (std::size_t i = 0; i < item.elements.size(); ++i) values[item.elements[i]] = item.value(i, end);
    item.array.check(values.data());
  }
}

Randomization::Range Randomization::find(const std::string& array) const {
  std::size_t index = 0;
  while (index < items_.size() && array != "draws[" + std::to_string(index) + "]") ++index;
  if (index == items_.size())
    fail(MJENV_E_NAME, "there is no " + quoted(array) + ": resets draw " + std::to_string(items_.size()) + " item(s)");
  if (items_[index].count == 0)
    fail(MJENV_E_NAME, quoted(array) + " of " + quoted(items_[index].array.original.name) +
                           (items_[index].repeats ? " repeats the item before" : " is a choice") +
                           ", so it has no parameters that can be changed");
  return {index, items_[index].first, items_[index].count};
}

void Randomization::check(const Range& range, const double* parameters) const {
  const Item& drawn = items_[range.item];
  try {
    check_parameters(drawn, parameters);
    for (std::size_t i = range.item; i < end_of(range.item); ++i)
      if (items_[i].array.checks_elements_alone()) check_ends(items_[i], drawn, parameters);
  } catch (const Error& error) {
    fail(error.status(),
         "draws[" + std::to_string(range.item) + "] of " + quoted(drawn.array.original.name) + ": " + error.what());
  }
}

bool Randomization::is_valid(const double* ranges) const {
  try {
    for (std::size_t i = 0; i < items_.size(); ++i)
      if (items_[i].count > 0) check({i, items_[i].first, items_[i].count}, ranges + items_[i].first);
  } catch (const Error&) {
    return false;
  }
  return true;
}

std::size_t Randomization::end_of(std::size_t begin) const {
  std::size_t end = begin + 1;
  while (end < items_.size() && items_[end].repeats) ++end;
  return end;
}

std::vector<std::string> Randomization::arrays() const {
  std::vector<std::string> names;
  for (const Item& item : items_)
    if (!item.elements.empty()) names.push_back(item.array.original.name);
  return names;
}

void Randomization::place(const OwnArrays& layout) noexcept {
  for (Item& item : items_)
    if (const OwnArray* placed = layout.find(item.array.original.name)) item.array.offset = placed->offset;
}

void Randomization::draw(np::Generator& rng, const double* ranges, std::byte* block) const {
  for (std::size_t begin = 0, end = 0; begin < items_.size(); begin = end) {
    end = end_of(begin);
    const Item& first = items_[begin];
    const auto for_each_item = [&](const auto& body) {
      for (std::size_t k = begin; k < end; ++k) body(items_[k]);
    };
    std::size_t count = 0;
    for_each_item([&](const Item& item) { count += item.elements.size(); });
    if (count == 0) continue;
    if (first.shared) {
      const double drawn = first.next(ranges + first.first, rng);
      for_each_item([&](const Item& item) {
        for (std::size_t i = 0; i < item.elements.size(); ++i) item.write(i, drawn, block);
      });
    } else {
      for (std::size_t i = 0; i < first.elements.size(); ++i) {
        const double drawn = first.next(ranges + first.first, rng);
        for_each_item([&](const Item& item) {
          for (std::size_t j = 0; j < item.per_draw; ++j) item.write(i * item.per_draw + j, drawn, block);
        });
      }
    }
    for_each_item([&](const Item& item) {
      if (!item.is_checked || item.elements.empty()) return;
      try {
        item.array.check(block);
      } catch (const Error& error) {
        fail(error.status(), std::string("a value was drawn that MuJoCo cannot compute with: ") + error.what());
      }
    });
  }
}

}  // namespace mjenv::core
