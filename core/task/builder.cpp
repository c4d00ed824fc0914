#include "task/builder.hpp"

#include <algorithm>

#include "structs.hpp"
#include "task/api.hpp"

namespace mjenv::core {

Builder::Builder(const Options& options, const Model& model, SimView& view, std::vector<Field> fields,
                 std::int64_t carry_count, const Parameters& parameters)
    : mjenv_builder{sizeof(mjenv_builder), 0, &task_api(), &view.sim(), nullptr, nullptr},
      options_(options),
      model_(model),
      view_(view),
      fields_(std::move(fields)),
      parameters_(parameters) {
  random = &trial_;
  view_.carry(static_cast<std::size_t>(carry_count));
}

void Builder::carry(std::int64_t count) {
  check_range("carry: the count", count, 0, kMaxCarried);
  view_.carry(static_cast<std::size_t>(count));
}

void Builder::carry_bounds(const CarryBounds& bounds) {
  check_range("carry_bounds: first", bounds.first, 0, kMaxCarried);
  check_range("carry_bounds: count", bounds.count, 0, kMaxCarried);
  if (!(bounds.low <= 0 && 0 <= bounds.high))
    fail(MJENV_E_VALUE, "carry_bounds: [" + number(bounds.low) + ", " + number(bounds.high) +
                            "] does not contain 0, which a row carries until its first reset");
  bounds_.push_back(bounds);
}

void Builder::action(std::int64_t count, const double* low, const double* high) {
  constexpr std::int64_t most = std::int64_t{1} << 20;
  check_range("action: the count", count, 1, most);
  ActionBounds bounds;
  for (std::int64_t i = 0; i < count; ++i) {
    const double from = low ? low[i] : -kInfinity, to = high ? high[i] : kInfinity;
    if (!(from <= to))
      fail(MJENV_E_VALUE, "action: the bounds of number " + std::to_string(i) + " are " + number(from) + " and " +
                              number(to) + ", which are NaN or in the wrong order");
    // Rounded to float32, as Gymnasium rounds the bounds of actuators.
    bounds.low.push_back(static_cast<float>(from));
    bounds.high.push_back(static_cast<float>(to));
  }
  view_.need_action(std::move(bounds));
}

void Builder::keep(const KeptNumbers& numbers) {
  check_range("keep: first", numbers.first, 0, kMaxCarried);
  check_range("keep: count", numbers.count, 0, kMaxCarried);
  kept_.push_back(numbers);
}

std::int64_t Builder::parameter(const std::string& option) const {
  if (!option_of(option, MJENV_KIND_REALS).live)
    fail(MJENV_E_TYPE, "option " + quoted(option) + " is no live parameter: set mjenv_task_option.live");
  return parameters_.find(Parameters::name_of(option), options_.id()).offset;
}

void Builder::check() const {
  if (status_ == MJENV_E_MEMORY) throw std::bad_alloc();
  if (status_ != MJENV_OK) fail(status_, message_);
}

const Option& Builder::option_of(const std::string& name, mjenv_kind kind) const {
  const Option& option = options_.get(name);
  if (option.kind != kind)
    fail(MJENV_E_TYPE, "option " + quoted(name) + " is " + kind_name(option.kind) + ", not " + kind_name(kind));
  return option;
}

std::int64_t Builder::integer(const std::string& name) const {
  const bool flag = options_.get(name).kind == MJENV_KIND_FLAG;
  return option_of(name, flag ? MJENV_KIND_FLAG : MJENV_KIND_INTEGER).integer;
}

void Builder::reals(const std::string& name, double* values, std::int64_t count) const {
  const std::vector<double>& set = option_of(name, MJENV_KIND_REALS).reals;
  check_count(("the count of option " + quoted(name)).c_str(), count, static_cast<std::int64_t>(set.size()));
  std::copy(set.begin(), set.end(), values);
}

const char* Builder::text(const std::string& name) const { return option_of(name, MJENV_KIND_STRING).text.c_str(); }

int Builder::index(const std::string& type, const std::string& name) const {
  try {
    return model_.index(type, name);
  } catch (const Error& error) {
    fail(MJENV_E_MODEL, error.what());
  }
}

int Builder::option_index(const std::string& name, const std::string& type) const {
  const Option& option = option_of(name, MJENV_KIND_STRING_OR_INT);
  if (!option.given_as_integer) return index(type, option.text);
  const int count = model_.count(type);
  if (option.integer < 0 || option.integer >= count)
    fail(MJENV_E_MODEL, "option " + quoted(name) + " is " + std::to_string(option.integer) + ", but model " +
                            quoted(model_.label()) + " has " + std::to_string(count) +
                            (type == "body" ? " bodies" : " objects of type " + quoted(type)));
  return static_cast<int>(option.integer);
}

np::Norm Builder::norm() {
  const std::string& choice = options_.get("norm").text;
  norm_ = choice == "auto" ? np::norm_as_numpy_here() : np::Norm(choice == "fused");
  return *norm_;
}

int Builder::array(const std::string& name, mjenv_field* field) {
  const Array& found = view_.share(name);  // now the last of needs().arrays
  if (field) {
    mjenv_field out{};
    out.ndim = static_cast<std::int32_t>(found.shape.size());
    out.name = found.name.c_str();
    out.doc = "";
    std::copy(found.shape.begin(), found.shape.end(), out.shape);
    out.count = static_cast<std::int64_t>(found.count());
    out.dtype = found.type;
    write_struct(field, "field", out);
  }
  return static_cast<int>(view_.needs().arrays.size()) - 1;
}

}  // namespace mjenv::core
