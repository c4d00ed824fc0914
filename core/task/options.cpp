#include "task/options.hpp"

#include <algorithm>
#include <iterator>
#include <sstream>

#include "error.hpp"

namespace mjenv::core {

std::vector<std::string> Option::list_of_choices() const {
  std::istringstream words(choices);
  return {std::istream_iterator<std::string>(words), {}};
}

bool Option::allows(const std::string& given) const {
  const std::vector<std::string> list = list_of_choices();
  return list.empty() || std::find(list.begin(), list.end(), given) != list.end();
}

const char* kind_name(mjenv_kind kind) {
  switch (kind) {
    case MJENV_KIND_FLAG: return "a flag (0 or 1)";
    case MJENV_KIND_INTEGER: return "an integer";
    case MJENV_KIND_REALS: return "real numbers";
    case MJENV_KIND_STRING: return "a text";
    case MJENV_KIND_STRING_OR_INT: return "a text or an integer";
  }
  return "unknown";
}

const Option& Options::flag(const char* name, bool value, const char* doc, InIdentity in_identity) {
  Option option(MJENV_KIND_FLAG, name, doc, in_identity, 0, 1);
  option.integer = value;
  return declare(std::move(option));
}

const Option& Options::integer(const char* name, std::int64_t value, std::int64_t low, std::int64_t high,
                               const char* doc, InIdentity in_identity) {
  Option option(MJENV_KIND_INTEGER, name, doc, in_identity, static_cast<double>(low), static_cast<double>(high));
  option.integer = value;
  return declare(std::move(option));
}

const Option& Options::reals(const char* name, std::vector<double> values, const char* doc, double low, double high) {
  Option option(MJENV_KIND_REALS, name, doc, InIdentity::yes, low, high);
  option.reals = std::move(values);
  return declare(std::move(option));
}

const Option& Options::text(const char* name, const char* value, const char* doc, const char* choices,
                            InIdentity in_identity) {
  Option option(MJENV_KIND_STRING, name, doc, in_identity);
  option.text = value;
  option.choices = choices;
  return declare(std::move(option));
}

const Option& Options::text_or_index(const char* name, std::int64_t value, const char* doc) {
  Option option(MJENV_KIND_STRING_OR_INT, name, doc, InIdentity::yes, 0, std::numeric_limits<int>::max());
  option.integer = value;
  option.given_as_integer = true;
  return declare(std::move(option));
}

const Option& Options::declare(Option option) {
  const auto same = [&](const Option& o) { return o.name == option.name; };
  const auto found = std::find_if(options_.begin(), options_.end(), same);
  return found != options_.end() ? *found : options_.emplace_back(std::move(option));
}

Option& Options::find(const std::string& name) { return const_cast<Option&>(get(name)); }

const Option& Options::get(const std::string& name) const {
  for (const auto& option : options_)
    if (option.name == name) return option;
  std::vector<std::string> names;
  for (const auto& option : options_) names.push_back(option.name);
  fail(MJENV_E_NAME, id_ + " has no option " + quoted(name) + choices(name, names, "mjenv_options_at"));
}

void Options::refuse_type(const Option& option, const char* given) const {
  fail(MJENV_E_TYPE,
       "option " + quoted(option.name) + " of " + id_ + " is " + kind_name(option.kind) + ", not " + given);
}

void Options::check_bounds(const Option& option, double value) {
  if (option.low <= value && value <= option.high) return;
  fail(MJENV_E_VALUE, "option " + quoted(option.name) + " must lie in [" + number(option.low) + ", " +
                          number(option.high) + "], not " + number(value));
}

void Options::set_integer(const std::string& name, std::int64_t value) {
  Option& option = find(name);
  const auto real = static_cast<double>(value);
  if (option.kind == MJENV_KIND_STRING || (option.kind == MJENV_KIND_REALS && option.reals.size() != 1))
    refuse_type(option, "an integer");
  check_bounds(option, real);
  option.given_as_integer = true;
  option.text.clear();
  if (option.kind == MJENV_KIND_REALS)
    option.reals[0] = real;
  else
    option.integer = value;
}

void Options::set_reals(const std::string& name, const double* values, std::size_t count) {
  Option& option = find(name);
  if (option.kind != MJENV_KIND_REALS) refuse_type(option, "real numbers");
  if (count != option.reals.size())
    fail(MJENV_E_SIZE, "option " + quoted(name) + " holds " + std::to_string(option.reals.size()) + " number(s), not " +
                           std::to_string(count));
  for (std::size_t i = 0; i < count; ++i) check_bounds(option, values[i]);
  option.reals.assign(values, values + count);
  option.given_as_integer = false;
}

void Options::set_string(const std::string& name, const std::string& value) {
  Option& option = find(name);
  if (option.kind != MJENV_KIND_STRING && option.kind != MJENV_KIND_STRING_OR_INT) refuse_type(option, "a text");
  if (!option.allows(value))
    fail(MJENV_E_VALUE,
         "option " + quoted(name) + " must be one of " + listed(option.list_of_choices()) + ", not " + quoted(value));
  option.text = value;
  option.integer = 0;
  option.given_as_integer = false;
}

}  // namespace mjenv::core
