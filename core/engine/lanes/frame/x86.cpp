// Tells which instruction sets this CPU has. So this file is compiled for every x86-64 CPU, without further flags.
#include "engine/lanes/frame/version.hpp"

namespace mjenv::core::lanes {

std::vector<const Code*> codes() {
  std::vector<const Code*> found{&sse2};
  if (__builtin_cpu_supports("avx2")) found.push_back(&avx2);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) found.push_back(&avx512);
  return found;
}

}  // namespace mjenv::core::lanes
