#include "task/parameters.hpp"

#include <algorithm>

#include "error.hpp"

namespace mjenv::core {
namespace {

const std::string kPrefix = "parameters.";

}  // namespace

void Parameters::add(const Option& option) {
  const auto count = static_cast<std::int64_t>(option.reals.size());
  const std::vector<std::int64_t> shape = count == 1 ? std::vector<std::int64_t>{} : std::vector<std::int64_t>{count};
  fields_.push_back({MJENV_ROLE_PARAMETERS, name_of(option.name), option.doc, MJENV_DTYPE_FLOAT64, shape,
                     static_cast<std::int64_t>(defaults_.size()), count});
  bounds_.push_back({option.low, option.high});
  defaults_.insert(defaults_.end(), option.reals.begin(), option.reals.end());
}

std::string Parameters::name_of(const std::string& option) { return kPrefix + option; }

bool Parameters::is_name(const std::string& array) { return array.compare(0, kPrefix.size(), kPrefix) == 0; }

const Field& Parameters::find(const std::string& array, const std::string& id) const {
  std::vector<std::string> names;
  for (const Field& field : fields_) {
    if (field.name == array) return field;
    names.push_back(field.name);
  }
  fail(MJENV_E_NAME, id + " has no live parameter " + quoted(array) +
                         choices(array, names, "mjenv_field_at with MJENV_ROLE_PARAMETERS"));
}

void Parameters::check(const Field& field, const double* values) const {
  const auto index = static_cast<std::size_t>(&field - fields_.data());
  for (std::size_t i = 0; i < static_cast<std::size_t>(field.count); ++i)
    if (!is_within(index, values[i]))
      fail(MJENV_E_VALUE, element_is(field.name, i, values[i]) + ", but must lie in [" + number(bounds_[index].low) +
                              ", " + number(bounds_[index].high) + "]");
}

bool Parameters::is_valid(const double* numbers) const {
  for (std::size_t i = 0; i < fields_.size(); ++i)
    for (std::int64_t k = 0; k < fields_[i].count; ++k)
      if (!is_within(i, numbers[fields_[i].offset + k])) return false;
  return true;
}

}  // namespace mjenv::core
