// Numbers whose products are rounded late. glibc's functions are compiled with Real in place of double: where a product
// is added to something, both operations become one fma, as in the build of glibc for CPUs with FMA. So each fused
// operation is one that this header asks for, whatever the compiler and its options.
#pragma once

// Always inlined: otherwise the linker could keep one variant's copy of a function and use it for the other variant.
#define MJENV_INLINE inline __attribute__((always_inline))

// Not yet rounded.
struct Product {
  double a, b;
};

MJENV_INLINE Product operator-(Product p) { return {-p.a, p.b}; }

struct Real {
  double value;

  Real() = default;
  MJENV_INLINE constexpr Real(double given) : value(given) {}
  MJENV_INLINE constexpr Real(Product p) : value(p.a * p.b) {}
  MJENV_INLINE explicit operator int() const { return static_cast<int>(value); }
  MJENV_INLINE explicit operator bool() const { return value != 0; }

  MJENV_INLINE Real& operator+=(Real other);
  MJENV_INLINE Real& operator+=(Product p);
  MJENV_INLINE Real& operator-=(Real other);
  MJENV_INLINE Real& operator-=(Product p);
  MJENV_INLINE Real& operator*=(Real other);
  MJENV_INLINE Real& operator/=(Real other);
};

extern "C" double mjenv_fma_soft(double a, double b, double c);  // fma.cpp

#if defined(__FMA__) || defined(__aarch64__)
MJENV_INLINE Real fused(Real a, Real b, Real c) { return __builtin_fma(a.value, b.value, c.value); }
#else
MJENV_INLINE Real fused(Real a, Real b, Real c) { return mjenv_fma_soft(a.value, b.value, c.value); }
#endif

MJENV_INLINE Real operator-(Real x) { return -x.value; }
MJENV_INLINE Product operator*(Real a, Real b) { return {a.value, b.value}; }
MJENV_INLINE Real operator/(Real a, Real b) { return a.value / b.value; }

MJENV_INLINE Real operator+(Real a, Real b) { return a.value + b.value; }
MJENV_INLINE Real operator+(Product p, Real c) { return fused(p.a, p.b, c); }
MJENV_INLINE Real operator+(Real c, Product p) { return fused(p.a, p.b, c); }
MJENV_INLINE Real operator+(Product p, Product q) { return fused(p.a, p.b, q); }  // of two products the first is fused

MJENV_INLINE Real operator-(Real a, Real b) { return a.value - b.value; }
MJENV_INLINE Real operator-(Product p, Real c) { return fused(p.a, p.b, -c); }
MJENV_INLINE Real operator-(Real c, Product p) { return fused(-p.a, p.b, c); }
MJENV_INLINE Real operator-(Product p, Product q) { return fused(p.a, p.b, -Real(q)); }

MJENV_INLINE Real& Real::operator+=(Real other) { return *this = *this + other; }
MJENV_INLINE Real& Real::operator+=(Product p) { return *this = *this + p; }
MJENV_INLINE Real& Real::operator-=(Real other) { return *this = *this - other; }
MJENV_INLINE Real& Real::operator-=(Product p) { return *this = *this - p; }
MJENV_INLINE Real& Real::operator*=(Real other) { return *this = *this * other; }
MJENV_INLINE Real& Real::operator/=(Real other) { return *this = *this / other; }

MJENV_INLINE bool operator<(Real a, Real b) { return a.value < b.value; }
MJENV_INLINE bool operator>(Real a, Real b) { return a.value > b.value; }
MJENV_INLINE bool operator<=(Real a, Real b) { return a.value <= b.value; }
MJENV_INLINE bool operator>=(Real a, Real b) { return a.value >= b.value; }
MJENV_INLINE bool operator==(Real a, Real b) { return a.value == b.value; }
MJENV_INLINE bool operator!=(Real a, Real b) { return a.value != b.value; }

MJENV_INLINE Real fabs(Real x) { return __builtin_fabs(x.value); }
MJENV_INLINE Real copysign(Real x, Real sign) { return __builtin_copysign(x.value, sign.value); }

MJENV_INLINE bool isinf(Real x) { return __builtin_isinf(x.value); }

// The name of a function in this variant: for CPUs with FMA, for others, or for all.
#define MJENV_JOINED(name, variant) mjenv_##name##variant
#define MJENV_EXPANDED(name, variant) MJENV_JOINED(name, variant)
#define MJENV_NAME(name) MJENV_EXPANDED(name, MJENV_VARIANT)

extern "C" int mjenv_branred(double x, double* high, double* low);  // glibc's, which fuses nothing
