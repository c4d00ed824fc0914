/* numpy.hpp - Sums, norms and scalars that round as NumPy's do, for tasks that must return the same bits as an original
 * in Python. Do not use Eigen's reductions for that, because they add in another order. Compile with -ffp-contract=off,
 * because a fused multiply-add rounds once where NumPy rounds twice. */
#ifndef MJENV_NUMPY_HPP
#define MJENV_NUMPY_HPP

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>

namespace mjenv {
namespace np {

// numpy.sum of term(0) ... term(n - 1). NumPy adds fewer than 8 terms one after the other, and up to 128 in eight
// accumulators. It splits longer arrays into halves.
template <typename Term>
auto sum(Eigen::Index n, const Term &term, Eigen::Index first = 0) -> decltype(term(0)) {
  using T = decltype(term(0));
  constexpr Eigen::Index lanes = 8, block = 128;
  if (n < lanes) {
    T total = 0;
    for (Eigen::Index i = 0; i < n; ++i) total += term(first + i);
    return total;
  }
  if (n > block) {
    const Eigen::Index half = n / 2 - n / 2 % lanes;
    return sum(half, term, first) + sum(n - half, term, first + half);
  }
  std::array<T, lanes> r;
  for (Eigen::Index k = 0; k < lanes; ++k) r[k] = term(first + k);
  Eigen::Index i = lanes;
  for (; i + lanes <= n; i += lanes)
    for (Eigen::Index k = 0; k < lanes; ++k) r[k] += term(first + i + k);
  T total = ((r[0] + r[1]) + (r[2] + r[3])) + ((r[4] + r[5]) + (r[6] + r[7]));
  for (; i < n; ++i) total += term(first + i);
  return total;
}

// numpy.sum(x)
template <typename Derived>
double sum(const Eigen::DenseBase<Derived> &x) {
  return sum(x.size(), [&](Eigen::Index i) { return x.derived().coeff(i); });
}

// numpy.sum(numpy.square(x))
template <typename Derived>
double sum_square(const Eigen::DenseBase<Derived> &x) {
  return sum(x.size(), [&](Eigen::Index i) {
    const double v = x.derived().coeff(i);
    return v * v;
  });
}

// numpy.clip of one number. NaN stays NaN; if low is above high, the result is high.
inline double clip(double x, double low, double high) {
  const double raised = x < low ? low : x;
  return raised > high ? high : raised;
}

// numpy.clip of each element, as an Eigen expression.
template <typename Derived>
auto clip(const Eigen::DenseBase<Derived> &x, std::array<double, 2> range) {
  return x.derived().unaryExpr([range](double v) { return clip(v, range[0], range[1]); });
}

// x ** 2 of a Python float. Python calls the C library's pow, whose last bit can differ from x * x.
inline double power2(double x) {
  volatile double two = 2;  // volatile, as compilers turn pow(x, 2) into x * x
  return std::pow(x, two);
}

// numpy.linalg.norm of a vector of at most 10000 numbers, as OpenBLAS computes it. (It divides longer ones among
// threads.) The kernel of OpenBLAS for AVX-512 (fused) fuses each multiplication with an addition, and so rounds
// once instead of twice. Its kernel for AVX2 (plain) does so only in whole blocks of 16 numbers. docs/fidelity.md has
// the other CPUs.
class Norm {
 public:
  explicit Norm(bool fused) : fused_(fused) {}

  bool fused() const { return fused_; }
  double operator()(double x, double y) const { return std::sqrt(add_square(x * x, y)); }
  double operator()(double x, double y, double z) const { return std::sqrt(add_square(add_square(x * x, y), z)); }
  template <typename Derived>
  double operator()(const Eigen::DenseBase<Derived> &v) const {
    const auto &x = v.derived();
    const Eigen::Index n = x.size(), whole = n - n % block;
    const auto at = [&](Eigen::Index i) -> double { return x.coeff(i); };
    double total = whole == 0 ? 0 : fused_ ? fused_blocks(whole, at) : plain_blocks(whole, at);
    for (Eigen::Index i = whole; i < n; ++i) total = add_square(total, at(i));
    return std::sqrt(total);
  }

 private:
  bool fused_;
  static constexpr Eigen::Index block = 16;
  using Sums = std::array<double, block>;  // four vectors of AVX2

  double add_square(double total, double x) const { return fused_ ? std::fma(x, x, total) : total + x * x; }

  // Adds the squares of n numbers, beginning with number `first`, to the `count` sums in turn.
  template <std::size_t count, typename At>
  static void add_squares(std::array<double, count> &sums, Eigen::Index first, Eigen::Index n, const At &at) {
    for (Eigen::Index i = 0; i < n; ++i) {
      double &sum = sums[static_cast<std::size_t>(i) % count];
      const double value = at(first + i);
      sum = std::fma(value, value, sum);
    }
  }

  // As with AVX-512: adds two blocks at once, in vectors of 8 sums, and then the two halves of each vector. If a block
  // is left, adds it as with AVX2.
  template <typename At>
  static double fused_blocks(Eigen::Index n, const At &at) {
    std::array<double, 2 * block> wide{};
    const Eigen::Index pairs = n - n % (2 * block);
    add_squares(wide, 0, pairs, at);
    Sums sums{};
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const std::size_t low = i / 4 * 8 + i % 4;
      sums[i] = wide[low] + wide[low + 4];
    }
    add_squares(sums, pairs, n - pairs, at);
    const auto add = [&](std::size_t i) { return ((sums[i] + sums[i + 4]) + sums[i + 8]) + sums[i + 12]; };
    return (add(0) + add(2)) + (add(1) + add(3));
  }

  template <typename At>
  static double plain_blocks(Eigen::Index n, const At &at) {
    Sums sums{};
    add_squares(sums, 0, n, at);
    const auto half = [&](std::size_t i) { return sums[i] + sums[i + 2]; };
    const auto add = [&](std::size_t i) { return (half(i) + half(i + 4)) + (half(i + 8) + half(i + 12)); };
    return add(0) + add(1);
  }
};

// A NumPy scalar of the action's dtype. In a product with a Python float, NumPy first rounds the float to that dtype.
class Scalar {
 public:
  explicit Scalar(float value) : value_(value), narrow_(true) {}
  explicit Scalar(double value) : value_(value), narrow_(false) {}

  operator double() const { return value_; }
  Scalar operator-() const { return {-value_, narrow_}; }
  friend Scalar operator*(double weight, Scalar s) {
    return s.narrow_ ? Scalar(static_cast<float>(weight) * static_cast<float>(s.value_)) : Scalar(weight * s.value_);
  }
  friend Scalar operator*(Scalar s, double weight) { return weight * s; }

 private:
  double value_;  // holds a float32 exactly
  bool narrow_;
  Scalar(double value, bool narrow) : value_(value), narrow_(narrow) {}
};

}  // namespace np
}  // namespace mjenv

#endif
