// What __builtin_cpu_supports asks for, where the compiler's own library lacks it (zig's): which instructions the CPU and
// the system have. Only what mjenv asks for is found out: SSE2, AVX2, FMA and parts of AVX-512.
#include <cpuid.h>

// The numbers of these bits are part of the compiler's interface.
enum { kSse2 = 4, kAvx2 = 10, kFma = 14, kAvx512f = 15, kAvx512vl = 20, kAvx512dq = 22 };

__attribute__((visibility("hidden"))) struct { unsigned vendor, type, subtype, features[1]; } __cpu_model;
__attribute__((visibility("hidden"))) unsigned __cpu_features2[3];

// Runs before the constructors of C++, which may call __builtin_cpu_supports.
__attribute__((constructor(101))) static void find_features(void) {
  unsigned a, b, c, d;
  __cpu_model.features[0] = 1u << kSse2;  // all CPUs with 64 bits have it
  if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_OSXSAVE) || !(c & bit_AVX)) return;
  unsigned saved, upper;
  __asm__("xgetbv" : "=a"(saved), "=d"(upper) : "c"(0));
  if ((saved & 6) != 6) return;  // the system does not save AVX's registers
  unsigned found = __cpu_model.features[0];
  found |= c & bit_FMA ? 1u << kFma : 0;
  if (__get_cpuid_count(7, 0, &a, &b, &c, &d)) {
    found |= b & bit_AVX2 ? 1u << kAvx2 : 0;
    // macOS saves AVX-512's registers from their first use on, and says so only then.
    found |= b & bit_AVX512F ? 1u << kAvx512f : 0;
    found |= b & bit_AVX512VL ? 1u << kAvx512vl : 0;
    found |= b & bit_AVX512DQ ? 1u << kAvx512dq : 0;
  }
  __cpu_model.features[0] = found;
}
