#include "task/own_build.hpp"

#include <algorithm>

#include "error.hpp"
#include "structs.hpp"

namespace mjenv::core {

OwnBuild::OwnBuild(const Options& options, const Model& model, Work& work, std::vector<OwnField> fields,
                   std::int64_t carry_count)
    : mjenv_builder{sizeof(mjenv_builder), 0, &task_api(), &work.sim().c(), nullptr},
      options_(options),
      model_(model),
      work_(work),
      fields_(std::move(fields)) {
  random = &trial_;
  work_.carry(static_cast<std::size_t>(carry_count));
}

void OwnBuild::carry(std::int64_t count) {
  if (count < 0 || count > kMaxCarried)
    fail(MJENV_E_VALUE, "carry: the count is " + std::to_string(count) + ", not 0 to " + std::to_string(kMaxCarried));
  work_.carry(static_cast<std::size_t>(count));
}

void OwnBuild::check() const {
  if (status_ != MJENV_OK) fail(status_, message_);
}

const Option& OwnBuild::option_of(const std::string& name, mjenv_kind kind) const {
  const Option& option = options_.get(name);
  if (option.kind != kind)
    fail(MJENV_E_TYPE, "option " + quoted(name) + " is " + kind_name(option.kind) + ", not " + kind_name(kind));
  return option;
}

std::int64_t OwnBuild::integer(const std::string& name) const {
  const bool flag = options_.get(name).kind == MJENV_KIND_FLAG;
  return option_of(name, flag ? MJENV_KIND_FLAG : MJENV_KIND_INTEGER).integer;
}

void OwnBuild::reals(const std::string& name, double* values, std::int64_t count) const {
  const std::vector<double>& set = option_of(name, MJENV_KIND_REALS).reals;
  check_count(("the count of option " + quoted(name)).c_str(), count, static_cast<std::int64_t>(set.size()));
  std::copy(set.begin(), set.end(), values);
}

const char* OwnBuild::text(const std::string& name) const { return option_of(name, MJENV_KIND_STRING).text.c_str(); }

int OwnBuild::index(const std::string& type, const std::string& name) const {
  try {
    return model_.index(type, name);
  } catch (const Error& error) {
    fail(MJENV_E_MODEL, error.what());
  }
}

int OwnBuild::option_index(const std::string& name, const std::string& type) const {
  const Option& option = option_of(name, MJENV_KIND_STRING_OR_INT);
  if (!option.given_as_integer) return index(type, option.text);
  const int count = model_.count(type);
  if (option.integer >= count)
    fail(MJENV_E_MODEL, "option " + quoted(name) + " is " + std::to_string(option.integer) + ", but model " +
                            quoted(model_.label()) + " has " + std::to_string(count) + " objects of type " +
                            quoted(type));
  return static_cast<int>(option.integer);
}

np::Norm OwnBuild::norm() {
  const std::string& choice = options_.get("norm").text;
  norm_ = choice == "auto" ? np::norm_as_numpy_here() : np::Norm(choice == "fused");
  return *norm_;
}

int OwnBuild::array(const std::string& name, mjenv_field* field) {
  const Array& found = work_.share(name);
  if (field) {
    mjenv_field out{};
    out.ndim = static_cast<std::int32_t>(found.shape.size());
    out.name = found.name.c_str();
    out.doc = "";
    std::copy(found.shape.begin(), found.shape.end(), out.shape);
    out.count = static_cast<std::int64_t>(found.count());
    out.type = found.type;
    write_struct(field, "field", out);
  }
  return static_cast<int>(work_.needs().arrays.size()) - 1;
}

}  // namespace mjenv::core
