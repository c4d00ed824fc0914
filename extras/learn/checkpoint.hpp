#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "environment.hpp"
#include "settings.hpp"

namespace mjenv::learn {

// Writes a learner's state and the caller's note to a file, after a description of the learners that the state fits and
// a checksum.
void write_checkpoint(const std::string& path, const Settings& settings, const Spaces& spaces, const std::string& note,
                      const std::vector<std::byte>& state);

// Reads a file of write_checkpoint. Throws if it is damaged, or if its learner differs in one of the described values.
std::vector<std::byte> read_checkpoint(const std::string& path, const Settings& settings, const Spaces& spaces);

// Returns the note in a file of write_checkpoint. Throws if the file is damaged.
std::string read_note(const std::string& path);

}  // namespace mjenv::learn
