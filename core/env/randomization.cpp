#include "env/randomization.hpp"

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
constexpr double kLeastMass = 1e-3;  // of a truncated normal distribution: a draw then takes 1000 attempts on average

// The fraction of the draws of a normal distribution that lie in [low, high].
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

double Randomization::Item::next(np::Generator& rng) const {
  const double* p = parameters.data();
  switch (distribution) {
    case MJENV_DISTRIBUTION_LOG_UNIFORM: return std::exp(rng.uniform(p[0], p[1]));
    case MJENV_DISTRIBUTION_NORMAL: return p[0] + p[1] * rng.normal();
    case MJENV_DISTRIBUTION_TRUNCATED_NORMAL:
      for (;;) {
        const double drawn = p[0] + p[1] * rng.normal();
        if (p[2] <= drawn && drawn <= p[3]) return drawn;
      }
    case MJENV_DISTRIBUTION_CHOICE: return p[rng.integers(0, static_cast<std::int64_t>(parameters.size()))];
    default: return rng.uniform(p[0], p[1]);
  }
}

double Randomization::Item::value(std::size_t i, double drawn) const {
  switch (effect) {
    case MJENV_EFFECT_SCALE: return originals[i] * drawn;
    case MJENV_EFFECT_OFFSET: return originals[i] + drawn;
    default: return drawn;
  }
}

Randomization::Randomization(const mjenv_randomization* items, std::int64_t count, const Model& model) {
  const auto add = [&](const mjenv_randomization& given) {
    Item item = item_of(given, model);
    const std::vector<std::int32_t> kinds{item.distribution, item.effect, item.shared, given.constants != 0};
    const std::vector<double> parameters(given.parameters, given.parameters + given.parameter_count);
    fingerprint_ = hash(given.array, item.array.original.name.size(), hash_of(kinds, fingerprint_));
    fingerprint_ = hash_of(item.elements, hash_of(parameters, fingerprint_));
    if (item.elements.empty()) return;
    computes_constants_ = computes_constants_ || given.constants != 0;
    items_.push_back(std::move(item));
  };
  std::size_t index = 0;
  for_each_struct(items, count, kMaxItems, "count", "items", [&](const mjenv_randomization& given) {
    const std::string name = "items[" + std::to_string(index++) + "]";
    if (!given.array) fail(MJENV_E_ARGUMENT, name + ".array is NULL");
    try {
      add(given);
    } catch (const Error& error) {
      fail(error.status(), name + ", " + quoted(given.array) + ": " + error.what());
    }
  });
}

Randomization::Item Randomization::item_of(const mjenv_randomization& given, const Model& model) {
  Item item{};
  if (StateLayout(model).part(given.array))
    fail(MJENV_E_NAME, "it is part of the state, but only arrays of the mjModel are drawn");
  if (!find(model.arrays(), given.array)) {
    const std::vector<std::string> all = writable_names(model), likely = nearest(given.array, all);
    fail(MJENV_E_NAME, "mjModel has no array of this name, and only its arrays can be drawn; " +
                           (likely.empty() ? "those that can be drawn are " + listed(all)
                                           : "is one of these meant? " + listed(likely)));
  }
  item.array = OwnArray::of(model, given.array);
  if (given.distribution < MJENV_DISTRIBUTION_UNIFORM || given.distribution > MJENV_DISTRIBUTION_CHOICE)
    fail(MJENV_E_ARGUMENT, "no distribution " + std::to_string(given.distribution));
  if (given.effect < MJENV_EFFECT_VALUE || given.effect > MJENV_EFFECT_OFFSET)
    fail(MJENV_E_ARGUMENT, "no effect " + std::to_string(given.effect));
  item.distribution = given.distribution;
  item.effect = given.effect;
  item.shared = given.shared != 0;
  take_elements(item, given);
  take_parameters(item, given);
  item.is_checked = item.distribution == MJENV_DISTRIBUTION_NORMAL || !item.array.checks_elements_alone() ||
                    item.array.refuses_originals();
  if (item.distribution == MJENV_DISTRIBUTION_LOG_UNIFORM)
    for (double& parameter : item.parameters) parameter = std::log(parameter);
  if (item.array.checks_elements_alone()) check_ends(item);
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
    if (given.element_count < 0 || given.element_count > static_cast<std::int64_t>(count))
      fail(MJENV_E_SIZE,
           "element_count is " + std::to_string(given.element_count) + ", not 0 to " + std::to_string(count));
    for (std::int64_t i = 0; i < given.element_count; ++i) {
      const std::int64_t element = given.elements[i];
      if (element < 0 || element >= static_cast<std::int64_t>(count))
        refuse("element " + std::to_string(element) + " is outside 0.." +
               std::to_string(static_cast<std::int64_t>(count) - 1));
      item.elements.push_back(static_cast<std::size_t>(element));
    }
  }
  for (const std::size_t element : item.elements) item.originals.push_back(all[element]);
}

void Randomization::take_parameters(Item& item, const mjenv_randomization& given) {
  const bool is_choice = item.distribution == MJENV_DISTRIBUTION_CHOICE;
  const std::int64_t needed = item.distribution == MJENV_DISTRIBUTION_TRUNCATED_NORMAL ? 4 : 2;
  if (!is_choice) check_count("parameter_count", given.parameter_count, needed);
  if (given.parameter_count < 1 || given.parameter_count > kMaxParameters)
    fail(MJENV_E_SIZE, "parameter_count is " + std::to_string(given.parameter_count) + ", not 1 to " +
                           std::to_string(kMaxParameters));
  if (!given.parameters) fail(MJENV_E_ARGUMENT, "parameters is NULL");
  item.parameters.assign(given.parameters, given.parameters + given.parameter_count);
  const std::vector<double>& p = item.parameters;
  for (const double parameter : p)
    if (!std::isfinite(parameter)) refuse("a parameter is " + number(parameter));
  const auto check_range = [](double low, double high) {
    if (std::signbit(high - low)) refuse("low is " + number(low) + ", above high, " + number(high));
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

// Throws if MuJoCo cannot compute with the smallest or the largest value, or with a value of a choice. A normal
// distribution has neither a smallest nor a largest value, so this checks its mean.
void Randomization::check_ends(const Item& item) {
  std::vector<double> ends;
  switch (item.distribution) {
    case MJENV_DISTRIBUTION_NORMAL: ends = {item.parameters[0]}; break;
    case MJENV_DISTRIBUTION_TRUNCATED_NORMAL: ends = {item.parameters[2], item.parameters[3]}; break;
    case MJENV_DISTRIBUTION_LOG_UNIFORM: ends = {std::exp(item.parameters[0]), std::exp(item.parameters[1])}; break;
    default: ends = item.parameters;
  }
  std::vector<double> values(item.array.original.count());
  for (const double end : ends) {
    item.array.original.read(values.data());
    for (std::size_t i = 0; i < item.elements.size(); ++i) values[item.elements[i]] = item.value(i, end);
    item.array.check(values.data());
  }
}

std::vector<std::string> Randomization::arrays() const {
  std::vector<std::string> names;
  for (const Item& item : items_) names.push_back(item.array.original.name);
  return names;
}

void Randomization::place(const OwnArrays& layout) noexcept {
  for (Item& item : items_)
    if (const OwnArray* placed = layout.find(item.array.original.name)) item.array.offset = placed->offset;
}

void Randomization::draw(np::Generator& rng, std::byte* block) const {
  for (const Item& item : items_) {
    double drawn = item.shared ? item.next(rng) : 0;
    for (std::size_t i = 0; i < item.elements.size(); ++i) {
      if (!item.shared) drawn = item.next(rng);
      item.array.write(item.elements[i], item.value(i, drawn), block);
    }
    if (!item.is_checked) continue;
    try {
      item.array.check(block);
    } catch (const Error& error) {
      fail(error.status(), std::string("a value was drawn that MuJoCo cannot compute with: ") + error.what());
    }
  }
}

}  // namespace mjenv::core
