#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "engine/load.hpp"

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core {

// Parses and compiles a model's text. The host's locale and random numbers have no effect on the result. folder: that
// of the model, "" or a path that ends in "/"; it need not exist. files: those to which the text refers. Fails with MJENV_E_MODEL and MuJoCo's reason if
// MuJoCo refuses the model. Other errors of MuJoCo are passed on.
mjModel_* compile(const std::string& folder, const std::string& text, Files files, const Limits& limits);

// Returns how many vertices the convex hull of the mesh in one of the files has, or `at_most` if it has more, because MuJoCo then
// stops. Returns no value if MuJoCo finds no hull. Needs a MuJoCo with the attribute "maxhullvert".
std::optional<std::int64_t> hull_vertices(const std::string& mesh_file, const Files& files, std::int64_t at_most);

}  // namespace mjenv::core
