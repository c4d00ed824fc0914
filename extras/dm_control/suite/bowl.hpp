// The terrain of quadruped-escape: a bowl whose floor and rim have random bumps.
#pragma once

#include <vector>

#include "suite.hpp"

namespace suite {

// The heights of the terrain, with the bits of NumPy and SciPy: the depth of a smooth bowl, times a surface of bumps.
class Bowl {
 public:
  static constexpr int kSide = 201;  // the terrain has kSide x kSide heights
  static constexpr int kBumps = 30;  // drawn from kBumps x kBumps numbers
  using Bumps = Eigen::Matrix<double, kBumps, kBumps>;

  Bowl() : depth_(kSide * kSide) {
    std::array<double, kSide> at{};  // from -1 to 1
    for (int i = 0; i < kSide; ++i) at[static_cast<std::size_t>(i)] = i * (2.0 / (kSide - 1)) - 1;
    std::size_t next = 0;
    for (const double y : at)
      for (const double x : at) {
        const double radius = std::min(std::max(std::sqrt(x * x + y * y), 0.04), 1.0);
        depth_[next++] = 0.5 - std::cos(2 * kPi * radius) / 2;
      }
    for (int i = 0; i < kSide; ++i) points_[static_cast<std::size_t>(i)] = Point(i);
  }

  // Writes the heights for bumps between 0 and 1, row by row.
  template <typename Heights>
  void write(Bumps bumps, Heights heights) const {
    // scipy.ndimage.zoom: a cubic spline through the bumps, which are mirrored at the edges.
    for (int column = 0; column < kBumps; ++column) to_coefficients(bumps.col(column));
    for (int row = 0; row < kBumps; ++row) to_coefficients(bumps.row(row));
    Eigen::Index next = 0;
    for (const Point& y : points_)
      for (const Point& x : points_) {
        double bump = 0;
        for (std::size_t i = 0; i < 4; ++i)
          for (std::size_t j = 0; j < 4; ++j) bump += bumps(y.knots[i], x.knots[j]) * y.weights[i] * x.weights[j];
        heights[next] = depth_[static_cast<std::size_t>(next)] * bump;
        ++next;
      }
  }

 private:
  // Where a row or column of the terrain lies among the bumps: the knots of the spline around it, and their weights.
  struct Point {
    std::array<int, 4> knots{};
    std::array<double, 4> weights{};

    Point() = default;
    explicit Point(int i) {
      const double at = i * ((kBumps - 1) / static_cast<double>(kSide - 1));
      const int before = static_cast<int>(std::floor(at));
      for (int k = 0; k < 4; ++k) {
        const int knot = std::abs(before - 1 + k);
        knots[static_cast<std::size_t>(k)] = knot < kBumps ? knot : 2 * kBumps - 2 - knot;
      }
      const double x = at - std::floor(at), rest = 1 - x;
      const auto near = [](double distance) { return (distance * distance * (distance - 2) * 3 + 4) / 6; };
      weights = {rest * rest * rest / 6, near(x), near(rest), 0};
      weights[3] = 1 - weights[0] - weights[1] - weights[2];
    }
  };

  std::vector<double> depth_;  // 0 in the middle and at the rim, 1 between them
  std::array<Point, kSide> points_;

  // Replaces numbers by the coefficients of the cubic spline through them, by one pass in each direction.
  template <typename Numbers>
  static void to_coefficients(Numbers c) {
    constexpr double pole = -0.267949192431122706;  // sqrt(3) - 2
    constexpr int last = kBumps - 1;
    c *= (1 - pole) * (1 - 1 / pole);
    const double around = std::pow(pole, last);
    double power = pole;
    c[0] += around * c[last];
    for (int i = 1; i < last; ++i, power *= pole) c[0] += power * (c[i] + around * c[last - i]);
    c[0] /= 1 - around * around;
    for (int i = 1; i <= last; ++i) c[i] += pole * c[i - 1];
    c[last] = (pole * c[last - 1] + c[last]) * pole / (pole * pole - 1);
    for (int i = last; i-- > 0;) c[i] = pole * (c[i + 1] - c[i]);
  }
};

}  // namespace suite
