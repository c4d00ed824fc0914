// Calls MuJoCo's loader of models. Defined in cmake/engine/load.cc if MuJoCo is compiled in, and in
// shared/load_shared.cpp if it is a shared library.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core {

class Limits;

// The files that MuJoCo reads, by their paths. Null: MuJoCo finds no file at that path.
using Files = std::map<std::string, std::shared_ptr<const std::string>>;

// The last part of a path, in lower case.
inline std::string name_of(const std::string& path) {
  std::string name = path.substr(path.find_last_of("/\\") + 1);
  for (char& letter : name)
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  return name;
}

// Whether load() limits the work on convex hulls. If not, the vertices of the hulls must be counted before the model is
// loaded.
extern const bool kLoadLimitsHulls;
// Whether MuJoCo's search for the length ranges of muscles always ends. If not, untrusted models must contain these
// ranges.
extern const bool kLengthRangesEnd;

// Whether MuJoCo starts threads to compile any model. If the system refused it a thread, the process would end.
extern const bool kCompilesOnThreads;

// Parses and compiles the model at this path, which is one of the files. If MuJoCo refuses the model, returns null and
// sets `reason`. Only a MuJoCo that is compiled in obeys the limits on work.
mjModel_* load(const std::string& path, const Files& files, const Limits& limits, std::string& reason);

}  // namespace mjenv::core
