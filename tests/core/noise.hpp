// Random numbers for tests.
#pragma once

#include <cstdint>
#include <iterator>

namespace mjenv::core {

class Noise {
 public:
  explicit Noise(std::uint64_t seed = 42) : state_(seed) {}
  // In [-1, 1), the same on every machine.
  double operator()() {
    next();
    return static_cast<double>(state_ >> 11) * 0x1p-52 - 1;
  }
  std::uint64_t below(std::uint64_t count) { return (next() >> 33) % count; }
  // One of the values on which code branches.
  double odd() {
    const double values[] = {0.0, -0.0, 1, -1, 1e-16, -1e-16, 5e-324, -5e-324, 1e-310, 0.5};
    return values[below(std::size(values))];
  }

 private:
  std::uint64_t state_;
  std::uint64_t next() { return state_ = state_ * 6364136223846793005u + 1442695040888963407u; }
};

}  // namespace mjenv::core
