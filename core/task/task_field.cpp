#include "task/task_field.hpp"

#include <algorithm>
#include <utility>

#include "error.hpp"
#include "structs.hpp"

namespace mjenv::core {
namespace {

constexpr std::size_t kMaxName = 200;
constexpr std::int64_t kMaxNumbers = 1 << 24;  // in all fields of a role

}  // namespace

std::string checked_name(const char* name, const std::string& what) {
  if (!name || !*name) fail(MJENV_E_ARGUMENT, what + " has no name");
  std::string text = name;
  if (text.size() > kMaxName)
    fail(MJENV_E_VALUE, "the name of " + what + " has more than " + std::to_string(kMaxName) + " bytes");
  if (std::any_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) <= ' ' || c == '"'; }))
    fail(MJENV_E_VALUE, what + " is called " + quoted(text) + ", but a name must have no blanks and no quotes");
  return text;
}

const char* role_name(mjenv_role role) {
  switch (role) {
    case MJENV_ROLE_OBSERVATION: return "observation";
    case MJENV_ROLE_INFO: return "info";
    case MJENV_ROLE_RESET_INFO: return "reset info";
    case MJENV_ROLE_REWARD: return "reward";
    case MJENV_ROLE_STRUCTURE: return "structure";
    default: return nullptr;
  }
}

Field field_of(const mjenv_task_field& given) {
  const auto from = read_struct(&given, "field");
  Field field{from.role, checked_name(from.name, "a field"), from.doc ? from.doc : "", from.dtype, {}};
  const std::string what = "field " + quoted(field.name);
  if (!role_name(field.role))
    fail(MJENV_E_TYPE, what + " has role " + std::to_string(field.role) + ", which a task cannot describe");
  if (field.type == 0) field.type = MJENV_DTYPE_FLOAT64;
  if (field.type < MJENV_DTYPE_FLOAT64 || field.type > MJENV_DTYPE_NATIVE_INT)
    fail(MJENV_E_TYPE, what + " has dtype " + std::to_string(field.type) + ", which does not exist");
  if (from.ndim < 0 || from.ndim > 4)
    fail(MJENV_E_VALUE, what + " has " + std::to_string(from.ndim) + " dimensions, not 0 to 4");
  const bool term = field.role == MJENV_ROLE_OBSERVATION;
  if (term && from.ndim > 1)
    fail(MJENV_E_VALUE, what + " has " + std::to_string(from.ndim) + " dimensions: an observation's terms are vectors");
  if (term && field.type != MJENV_DTYPE_FLOAT64)
    fail(MJENV_E_TYPE, what + ": an observation is of MJENV_DTYPE_FLOAT64");
  if (field.role == MJENV_ROLE_REWARD && from.ndim != 0) fail(MJENV_E_VALUE, what + ": a reward is one number");
  std::int64_t count = 1;
  for (std::int32_t i = 0; i < from.ndim; ++i) {
    if (from.shape[i] < -1 || from.shape[i] > kMaxNumbers ||
        count * std::max<std::int64_t>(from.shape[i], 1) > kMaxNumbers)
      fail(MJENV_E_VALUE, what + " has the length " + std::to_string(from.shape[i]) + ", but a length must be -1 to " +
                              std::to_string(kMaxNumbers) + ", and the product of all lengths at most that");
    field.shape.push_back(from.shape[i]);
    count *= std::max<std::int64_t>(from.shape[i], 1);
  }
  if (term && field.shape.empty()) field.shape = {1};
  if (!from.group || !*from.group) return field;
  if (!term) fail(MJENV_E_TYPE, what + " has a group, but only terms of the observation have one");
  field.group = checked_name(from.group, "the group of " + what);
  return field;
}

void replace_or_add(std::vector<Field>& fields, Field field) {
  const auto found = std::find_if(fields.begin(), fields.end(), [&](const Field& f) {
    return f.role == field.role && (f.name == field.name || f.role == MJENV_ROLE_REWARD);
  });
  if (found == fields.end()) return fields.push_back(std::move(field));
  if (field.doc.empty()) field.doc = found->doc;
  if (field.group.empty()) field.group = found->group;
  *found = std::move(field);
}

std::vector<std::string> names_of(const std::vector<Field>& fields) {
  std::vector<std::string> names;
  for (const Field& field : fields) {
    names.push_back(field.name);
    if (!field.group.empty() && std::find(names.begin(), names.end(), field.group) == names.end())
      names.push_back(field.group);
  }
  return names;
}

bool is_called(const Field& field, const std::string& name) {
  return !name.empty() && (field.name == name || field.group == name);
}

std::vector<Field> with_offsets(const std::vector<Field>& fields, mjenv_role role) {
  std::vector<Field> list;
  const std::string role_text = role_name(role);
  for (Field field : fields) {
    if (field.role != role) continue;
    if (std::find(field.shape.begin(), field.shape.end(), -1) != field.shape.end())
      fail(MJENV_E_TASK, "build did not set the length of the " + role_text + " " + quoted(field.name));
    for (const auto extent : field.shape) field.count *= extent;
    if (role == MJENV_ROLE_OBSERVATION && field.count == 0) continue;
    if (field.doc.empty()) field.doc = meaning(field.name);
    field.offset = total(list);
    list.push_back(std::move(field));
    if (total(list) > kMaxNumbers)
      fail(MJENV_E_VALUE, "the " + role_text + " has more than " + std::to_string(kMaxNumbers) + " numbers");
  }
  return list;
}

std::vector<Field> keys_of(const std::vector<Field>& terms) {
  std::vector<Field> keys;
  const std::string* group = nullptr;  // of the last key
  for (const Field& term : terms) {
    if (group && !term.group.empty() && *group == term.group) {
      keys.back().count += term.count;
      keys.back().shape = {keys.back().count};
      continue;
    }
    Field key = term;
    key.role = MJENV_ROLE_GROUPS;
    if (!term.group.empty()) key.name = term.group, key.doc = "", key.shape = {term.count};
    if (std::any_of(keys.begin(), keys.end(), [&](const Field& other) { return other.name == key.name; }))
      fail(MJENV_E_VALUE, "the observation has two keys " + quoted(key.name) +
                              ": a group and a term without a group must have different names, and the terms of a "
                              "group must stand one after the other");
    keys.push_back(std::move(key));
    group = &term.group;
  }
  return keys;
}

}  // namespace mjenv::core
