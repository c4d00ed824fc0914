// What the functions return beyond their range, as glibc's math_err.c does, but without raising exceptions.
#include <cstdint>

#include "arithmetic.hpp"

extern "C" {
Real mjenv_overflow(std::uint32_t is_negative) { return is_negative ? -__builtin_inf() : __builtin_inf(); }
Real mjenv_underflow(std::uint32_t is_negative) { return is_negative ? -0.0 : 0.0; }
Real mjenv_divided_by_zero(std::uint32_t is_negative) { return mjenv_overflow(is_negative); }
Real mjenv_invalid(Real x) { return (x - x) / (x - x); }
}
