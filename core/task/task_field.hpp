// The fields that a task describes with mjenv_task_field.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mjenv/task.h"
#include "task/task.hpp"

namespace mjenv::core {

// The largest carry_count.
constexpr std::int64_t kMaxCarried = 1 << 24;

// The documentation, with the unit, of a name that many tasks have. "" for an unknown name.
const char* meaning(const std::string& name);
// The name of a role in messages, such as "observation". Null for a role that a task cannot describe.
const char* role_name(mjenv_role role);
// Returns the name of `what` ("a field"). Throws if it is missing or too long, or has blanks or quotes.
std::string checked_name(const char* name, const std::string& what);

// Copies a field, whose lengths may still be -1 (build sets them later). Throws if the field is invalid.
Field field_of(const mjenv_task_field& given);
// Replaces the field that has the same role and name, or adds the field if there is none. A reward replaces the earlier
// reward whatever its name. If the new field has no doc or group, it keeps that of the replaced one.
void replace_or_add(std::vector<Field>& fields, Field field);
// The names of fields and of their groups, each once.
std::vector<std::string> names_of(const std::vector<Field>& fields);
// Whether this is the name of the field or of its group.
bool is_called(const Field& field, const std::string& name);
// The fields of a role, with their offsets. An observation does not list empty terms.
std::vector<Field> with_offsets(const std::vector<Field>& fields, mjenv_role role);
// The keys of an observation with these terms as a Gymnasium Dict: its groups, and the terms without a group. Throws if
// the terms of a group do not stand one after the other, or two keys have the same name.
std::vector<Field> keys_of(const std::vector<Field>& terms);

}  // namespace mjenv::core
