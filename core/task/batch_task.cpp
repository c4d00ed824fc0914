#include "task/batch_task.hpp"

#include <charconv>
#include <exception>
#include <iterator>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

namespace mjenv::core {
namespace {

constexpr double kMostNumbers = 1 << 20;

mjenv_task_option option(mjenv_kind kind, const char* name, const char* doc, double value, double low, double high) {
  mjenv_task_option made = MJENV_TASK_OPTION_INIT;
  made.kind = kind;
  made.name = name;
  made.doc = doc;
  made.value = value;
  made.low = low;
  made.high = high;
  return made;
}

// Adds a scalar for each of the names, which blanks separate.
void add_fields(mjenv_builder* builder, mjenv_role role, const char* option) {
  std::istringstream words(mjenv_build_text(builder, option));
  std::set<std::string> names;
  for (std::string name; words >> name;) {
    if (!names.insert(name).second) throw std::invalid_argument(option + (": the name " + name) + " occurs twice");
    mjenv_task_field field = MJENV_TASK_FIELD_INIT;
    field.role = role;
    field.name = name.c_str();
    mjenv_build_field(builder, &field);
  }
}

// Adds the terms of the observation, GROUP/NAME=COUNT or NAME=COUNT.
void add_terms(mjenv_builder* builder, const std::string& terms) {
  std::istringstream words(terms);
  for (std::string word; words >> word;) {
    const std::size_t slash = word.find('/'), equals = word.find('=');
    const std::size_t begin = slash == std::string::npos ? 0 : slash + 1;
    std::int64_t length = -1;
    if (equals != std::string::npos && equals > begin)
      std::from_chars(word.data() + equals + 1, word.data() + word.size(), length);
    if (length < 0 || length > kMostNumbers)
      throw std::invalid_argument("terms: " + word + " is not GROUP/NAME=COUNT or NAME=COUNT");
    const std::string name = word.substr(begin, equals - begin), group = word.substr(0, begin > 0 ? begin - 1 : 0);
    mjenv_task_field field = MJENV_TASK_FIELD_INIT;
    field.role = MJENV_ROLE_OBSERVATION;
    field.name = name.c_str();
    field.group = group.c_str();
    field.ndim = 1;
    field.shape[0] = length;
    mjenv_build_field(builder, &field);
  }
}

std::int32_t build(mjenv_builder* builder, void* /*user*/, void** /*self*/) {
  try {
    if (const std::string terms = mjenv_build_text(builder, "terms"); !terms.empty())
      add_terms(builder, terms);
    else
      mjenv_build_length(builder, MJENV_ROLE_OBSERVATION, "observation", mjenv_build_integer(builder, "observations"));
    add_fields(builder, MJENV_ROLE_INFO, "infos");
    add_fields(builder, MJENV_ROLE_RESET_INFO, "reset_infos");
    mjenv_build_carry(builder, mjenv_build_integer(builder, "carried"));
    if (const std::int64_t actions = mjenv_build_integer(builder, "actions"); actions > 0)
      mjenv_build_action(builder, actions, nullptr, nullptr);
    return 0;
  } catch (const std::exception& error) {
    return mjenv_task_fail(builder->api, error.what());
  }
}

}  // namespace

mjenv_task batch_task() {
  static const mjenv_task_option options[] = {
      option(MJENV_KIND_INTEGER, "observations", "how many numbers an observation has", 1, 0, kMostNumbers),
      option(MJENV_KIND_STRING, "terms",
             "in place of observations: GROUP/NAME=COUNT or NAME=COUNT for each term, separated by blanks", 0, 0, 0),
      option(MJENV_KIND_STRING, "infos", "names of the numbers in the info of a step, separated by blanks", 0, 0, 0),
      option(MJENV_KIND_STRING, "reset_infos", "names of the numbers in the info of a reset, separated by blanks", 0, 0,
             0),
      option(MJENV_KIND_INTEGER, "carried", "how many numbers a row carries for the task", 0, 0, kMostNumbers),
      option(MJENV_KIND_INTEGER, "actions", "how many numbers an action has; 0: the action is ctrl", 0, 0,
             kMostNumbers),
  };
  mjenv_task task = MJENV_TASK_INIT;
  task.id = "Batch-v0";
  task.model = "";  // no default, so the caller must give a model
  task.options = options;
  task.option_count = static_cast<std::int64_t>(std::size(options));
  task.build = build;
  task.physics_only = 1;
  return task;
}

}  // namespace mjenv::core
