#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "environment.hpp"
#include "settings.hpp"

namespace mjenv::learn {

// Writes a learner's state to a file, behind what says which learners it fits and a checksum.
void write_checkpoint(const std::string& path, const Settings& settings, const Spaces& spaces,
                      const std::vector<std::byte>& state);

// Reads such a file. Throws if it is damaged, or of a learner with another id or other sizes.
std::vector<std::byte> read_checkpoint(const std::string& path, const Settings& settings, const Spaces& spaces);

}  // namespace mjenv::learn
