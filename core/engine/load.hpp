// MuJoCo's loader of models: cmake/engine/load.cc if it is compiled in, shared/load_shared.cpp for a shared library.
#pragma once

#include <cstdint>
#include <string>

// NOLINTBEGIN(bugprone-reserved-identifier): MuJoCo's names
struct mjModel_;
struct mjVFS_;
// NOLINTEND(bugprone-reserved-identifier)

namespace mjenv::core {

// Whether load() limits the work on convex hulls. If not, the hulls' vertices are counted before the model is loaded.
extern const bool kLoadLimitsHulls;
// Whether MuJoCo's search for the length ranges of muscles always ends. If not, untrusted models must state them.
extern const bool kLengthRangesEnd;

// Parses and compiles the model of this path, which may be one of the files in memory. Returns null with MuJoCo's
// reason if MuJoCo refuses the model. The unit of hull_limit is described at kHullWork.
mjModel_* load(const std::string& path, const mjVFS_& files, std::int64_t hull_limit, std::string& reason);

}  // namespace mjenv::core
