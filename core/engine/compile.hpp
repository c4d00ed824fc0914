// MuJoCo's parser and compiler of models, kept apart from the host process: the host's locale and random numbers do not
// change models, and loading a model changes neither.
#pragma once

#include <cstdint>
#include <string>

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core {

// Compiles a text that refers to files in a folder: "", or a path that ends in "/". The work on convex hulls has a
// limit (engine/untrusted/limits.hpp), where the engine heeds one. Fails with MJENV_E_MODEL and MuJoCo's reason; other
// errors of MuJoCo's and its libraries' pass through.
mjModel_* compile(const std::string& folder, const std::string& text, std::int64_t hull_work);

}  // namespace mjenv::core
