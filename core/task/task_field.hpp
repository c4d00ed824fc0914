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
// "observation", for messages. Null for a role that a task cannot describe.
const char* role_name(mjenv_role role);
// Returns the name of `what` ("a field"). Throws if it is missing or too long, or has blanks or quotes.
std::string checked_name(const char* name, const std::string& what);

// Copies the field, whose lengths may be -1. Throws if the field is invalid.
Field field_of(const mjenv_task_field& given);
// Replaces the field of this role and name (a reward: any name), or adds it. Without a doc, it takes the old one's.
void replace_or_add(std::vector<Field>& fields, Field field);
// The fields of a role, with their offsets. An observation does not list empty terms.
std::vector<Field> with_offsets(const std::vector<Field>& fields, mjenv_role role);
// The keys of an observation with these terms as a Gymnasium Dict: its groups, and the terms without a group. Throws if
// the terms of a group do not stand one after the other, or two keys have the same name.
std::vector<Field> keys_of(const std::vector<Field>& terms);

}  // namespace mjenv::core
