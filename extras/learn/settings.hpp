// A checked copy of mjenv_learn_settings that owns its arrays; and the default settings for each id.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "mjenv/learn.h"

// The sizes of the structs in the first release, with pointers of 64 bits, which never change. Every caller's struct is
// at least as long. core/structs.hpp finds these functions.
constexpr std::size_t oldest_size(const mjenv_learn_calls*) { return 88; }
constexpr std::size_t oldest_size(const mjenv_learn_settings*) { return 248; }
constexpr std::size_t oldest_size(const mjenv_learn_report*) { return 128; }
constexpr std::size_t oldest_size(const mjenv_policy_spec*) { return 56; }
constexpr std::size_t oldest_size(const mjenv_policy_layer*) { return 48; }

namespace mjenv::learn {

class Settings {
 public:
  // Throws if a setting is out of range. observations: how many elements the masks must have.
  Settings(const mjenv_learn_settings& given, std::int64_t observations);

  // The values. Pointers in them are null; the arrays are in the members below.
  const mjenv_learn_settings& operator*() const { return values_; }
  const mjenv_learn_settings* operator->() const { return &values_; }

  std::string id;
  std::vector<int> hidden;
  std::vector<std::uint8_t> actor_obs, critic_obs;  // empty: all

  // How many steps all rows together play between two updates.
  std::int64_t batch() const { return values_.rows * values_.rollout_steps; }

  // Takes other values. Throws if a value differs that cannot change after a learner was created.
  void replace(const Settings& other);

 private:
  mjenv_learn_settings values_;
};

// Whether a text can be the id of an environment: printable ASCII, at most 1000 bytes.
bool is_id(std::string_view text);

// The settings for an id. The arrays are static, and `id` is null.
mjenv_learn_settings defaults_of(const std::string& id);

}  // namespace mjenv::learn
