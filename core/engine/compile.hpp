#pragma once

#include <cstdint>
#include <optional>
#include <string>

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core {

// Parses and compiles a model's text, untouched by the host's locale and random numbers. The folder of the files that
// it refers to is "" or ends in "/". Fails with MJENV_E_MODEL and MuJoCo's reason; MuJoCo's other errors pass through.
mjModel_* compile(const std::string& folder, const std::string& text, std::int64_t hull_limit);

// Returns how many vertices the convex hull of a mesh's file has, but at most this number, at which MuJoCo stops.
// Returns no value if MuJoCo finds no hull. For engines that know the attribute "maxhullvert".
std::optional<std::int64_t> hull_vertices(const std::string& mesh_file, std::int64_t at_most);

}  // namespace mjenv::core
