#pragma once

#include <cstdint>
#include <string>

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core {

// Parses and compiles the text of a model. The folder holds the files that the text refers to; it is "" or ends in "/".
// The host's locale and random numbers do not change the model, and compiling changes neither. Fails with MJENV_E_MODEL
// and MuJoCo's reason; other errors of MuJoCo and its libraries pass through.
mjModel_* compile(const std::string& folder, const std::string& text, std::int64_t hull_limit);

}  // namespace mjenv::core
