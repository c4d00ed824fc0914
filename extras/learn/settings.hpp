// The settings of a learner: values with names. settings.def lists them.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mjenv/learn.h"

// The sizes of the structs in the first release, with pointers of 64 bits, which never change. Every caller's struct is
// at least as long. core/structs.hpp finds these functions.
constexpr std::size_t oldest_size(const mjenv_learn_calls*) { return 88; }
constexpr std::size_t oldest_size(const mjenv_learn_report*) { return 128; }
constexpr std::size_t oldest_size(const mjenv_policy_spec*) { return 72; }
constexpr std::size_t oldest_size(const mjenv_policy_input*) { return 40; }
constexpr std::size_t oldest_size(const mjenv_policy_layer*) { return 48; }

namespace mjenv::learn {

using Integers = std::vector<int>;

struct Settings {
  std::string id;
#define SETTING(type, name, value, ...) type name{value};
#include "settings.def"
#undef SETTING

  Settings() = default;
  // The settings for an id, of which `words` replaces some: NAME=VALUE, separated by white space. Throws if there is no
  // such setting, or if its value is not valid.
  Settings(const std::string& env_id, std::string_view words);

  // Changes settings. Throws, and changes none, if one of them is not valid or cannot change any more.
  void change(std::string_view words);

  // Throws unless the masks have a number for each element of an observation, and show at least one.
  void check_masks(std::size_t observations) const;

  // All values as words.
  std::string text() const;
  // Those that a checkpoint depends on, as lines "NAME VALUE".
  std::string saved() const;

  // How many steps all rows together play between two updates.
  std::int64_t batch() const { return rows * rollout_steps; }
};

std::int64_t setting_count();
// Describes a setting. Its texts are static.
mjenv_option setting_at(std::int64_t index);

// Whether a text can be the id of an environment: printable ASCII, at most 1000 bytes.
bool is_id(std::string_view text);

}  // namespace mjenv::learn
