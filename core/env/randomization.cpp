#include "env/randomization.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "error.hpp"
#include "hash.hpp"

namespace mjenv::core {
namespace {

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
    case Distribution::log_uniform: return std::exp(rng.uniform(std::log(p[0]), std::log(p[1])));
    case Distribution::normal: return p[0] + p[1] * rng.normal();
    case Distribution::truncated_normal:
      for (;;) {
        const double drawn = p[0] + p[1] * rng.normal();
        if (p[2] <= drawn && drawn <= p[3]) return drawn;
      }
    case Distribution::choice:
      return choices[static_cast<std::size_t>(rng.integers(0, static_cast<std::int64_t>(choices.size())))];
    default: return rng.uniform(p[0], p[1]);
  }
}

double Randomization::Item::value(std::size_t i, double drawn) const {
  drawn *= factor;
  switch (effect) {
    case Effect::scale: return originals[i] * drawn;
    case Effect::offset: return originals[i] + drawn;
    default: return drawn;
  }
}

Randomization::Randomization(const std::vector<DrawSettings>& items) {
  for (const DrawSettings& given : items) {
    try {
      add(given);
    } catch (const Error& error) {
      fail(error.status(), given.place + ": " + error.what());
    }
  }
}

void Randomization::add(const DrawSettings& given) {
  Item item = item_of(given);
  if (item.repeats) {
    const auto drawn = std::find_if(items_.rbegin(), items_.rend(), [](const Item& one) { return !one.repeats; });
    if (!drawn->shared) item.per_draw = per_draw(item, drawn->elements.size());
    if (!is_real(item.array)) refuse("it holds integers, which can only be drawn by choices");
    item.is_checked = item.is_checked || drawn->distribution == Distribution::normal;
    if (item.array.checks_elements_alone()) check_ends(item, *drawn, ranges_.data() + drawn->first);
  } else {
    if (item.distribution == Distribution::choice) {
      item.choices = given.parameters;
    } else {
      item.first = ranges_.size();
      item.count = given.parameters.size();
      ranges_.insert(ranges_.end(), given.parameters.begin(), given.parameters.end());
    }
    check_parameters(item, given.parameters.data());
    if (item.array.checks_elements_alone()) check_ends(item, item, given.parameters.data());
    fingerprint_ = hash_of(given.parameters, fingerprint_);
  }
  const std::vector<std::int32_t> kinds{static_cast<std::int32_t>(item.distribution),
                                        static_cast<std::int32_t>(item.effect), item.shared, given.constants,
                                        item.repeats};
  const std::string& name = item.array.original.name;
  fingerprint_ = hash(name.data(), name.size(), hash_of(kinds, fingerprint_));
  fingerprint_ = hash(&item.factor, sizeof item.factor, hash_of(item.elements, fingerprint_));
  computes_constants_ = computes_constants_ || (given.constants && !item.elements.empty());
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
    fail(MJENV_E_SIZE, std::to_string(elements.size()) + " elements, not " + std::to_string(draws) +
                           ", as many as the item before draws, nor as many elements of one row of the array for each");
  return each;
}

Randomization::Item Randomization::item_of(const DrawSettings& given) {
  Item item{};
  item.array = given.array;
  item.distribution = given.distribution;
  item.effect = given.effect;
  item.repeats = given.repeats;
  item.shared = given.shared;
  item.factor = given.factor;
  item.elements = given.elements;
  std::vector<double> all(item.array.original.count());
  item.array.original.read(all.data());
  for (const std::size_t element : item.elements) item.originals.push_back(all[element]);
  item.is_checked = item.distribution == Distribution::normal || !item.array.checks_elements_alone() ||
                    item.array.refuses_originals();
  return item;
}

void Randomization::check_parameters(const Item& item, const double* p) {
  const bool is_choice = item.distribution == Distribution::choice;
  for (std::size_t i = 0; i < (is_choice ? item.choices.size() : item.count); ++i)
    if (!std::isfinite(p[i])) refuse("a parameter is " + number(p[i]));
  const auto check_range = [](double low, double high) {
    if (std::signbit(high - low)) refuse("low (" + number(low) + ") is above high (" + number(high) + ")");
    if (!std::isfinite(high - low)) refuse("high - low is not finite");
  };
  switch (item.distribution) {
    case Distribution::log_uniform:
      if (p[0] <= 0) refuse("low is " + number(p[0]) + ", but must be positive for its logarithm");
      [[fallthrough]];
    case Distribution::uniform: check_range(p[0], p[1]); break;
    case Distribution::truncated_normal: check_range(p[2], p[3]); [[fallthrough]];
    case Distribution::normal:
      if (p[1] < 0) refuse("the standard deviation is " + number(p[1]) + ", but must not be negative");
      break;
    default: break;
  }
  if (item.distribution == Distribution::truncated_normal && mass_within(p[0], p[1], p[2], p[3]) < kLeastMass)
    refuse("less than a thousandth of the draws of normal(" + number(p[0]) + ", " + number(p[1]) + ") lie in " +
           number(p[2]) + " to " + number(p[3]));
  if (!is_real(item.array) && !is_choice) refuse("it holds integers, which can only be drawn by choices");
}

// Throws if MuJoCo cannot compute with the smallest or the largest value that can be drawn, or with a value of a
// choice. A normal distribution has no smallest or largest value, so its mean is checked. drawn: the item that `item`
// repeats, or `item` itself.
void Randomization::check_ends(const Item& item, const Item& drawn, const double* p) {
  std::vector<double> ends;
  switch (drawn.distribution) {
    case Distribution::normal: ends = {p[0]}; break;
    case Distribution::truncated_normal: ends = {p[2], p[3]}; break;
    case Distribution::log_uniform: ends = {std::exp(std::log(p[0])), std::exp(std::log(p[1]))}; break;
    case Distribution::choice: ends = drawn.choices; break;
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
