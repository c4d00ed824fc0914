// An instruction set's functions. The version of MuJoCo has listed its own in MJENV_LANES_FUNCTIONS before this is
// included.
#pragma once

#include <vector>

namespace mjenv::core::lanes {

// FUNCTION(result, name, parameters): the functions of vector.hpp, which every version has.
#define MJENV_LANES_COPIES(FUNCTION)                                                          \
  /* The lanes, as bits, in which one of the numbers is bad in MuJoCo's sense (mju_isBad). */ \
  FUNCTION(unsigned, bad, (const double* numbers, int count))                                 \
  /* Copy `count` numbers of each lane. */                                                    \
  FUNCTION(void, gather, (double* to, const double* const* from, int count))                  \
  FUNCTION(void, scatter, (double* const* to, const double* from, int count))

// An instruction set: how many lanes it has, and pointers to its functions.
struct Code {
  int width;
#define MJENV_POINTER(result, name, parameters) result(*name) parameters;
  MJENV_LANES_FUNCTIONS(MJENV_POINTER)
  MJENV_LANES_COPIES(MJENV_POINTER)
#undef MJENV_POINTER
};

extern const Code sse2, avx2, avx512, neon;

// The instruction sets that this CPU has, in ascending order of their lanes. Defined in a file that is compiled for
// every CPU.
std::vector<const Code*> codes();

}  // namespace mjenv::core::lanes
