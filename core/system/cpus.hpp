#pragma once

#include <vector>

namespace mjenv::core {

// The CPUs in this process's affinity mask; CPU 0 alone if they are unknown.
std::vector<int> allowed_cpus();

// How many CPUs this process may use at once: as many as its affinity mask has, but not more than its quota, rounded up.
int usable_cpus();

// Whether this is an x86-64 CPU without AVX-512's short vectors (AVX512VL).
bool cpu_lacks_avx512();

}  // namespace mjenv::core
