// Calls MuJoCo's loader of models. Defined in cmake/engine/load.cc if MuJoCo is compiled in, and in
// shared/load_shared.cpp if it is a shared library.
#pragma once

#include <cstdint>
#include <string>

// NOLINTBEGIN(bugprone-reserved-identifier): MuJoCo's names
struct mjModel_;
struct mjVFS_;
// NOLINTEND(bugprone-reserved-identifier)

namespace mjenv::core {

// Whether load() limits the work on convex hulls. If not, the vertices of the hulls must be counted before the model is
// loaded.
extern const bool kLoadLimitsHulls;
// Whether MuJoCo's search for the length ranges of muscles always ends. If not, untrusted models must contain these
// ranges.
extern const bool kLengthRangesEnd;

// Parses and compiles the model at this path, which may be one of the files in memory. If MuJoCo refuses the model,
// returns null and sets `reason`. kHullWork explains the unit of hull_limit.
mjModel_* load(const std::string& path, const mjVFS_& files, std::int64_t hull_limit, std::string& reason);

}  // namespace mjenv::core
