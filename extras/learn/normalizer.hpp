#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "archive.hpp"

namespace mjenv::learn {

// The running mean and variance of each of `size` numbers, by the parallel algorithm of Chan, Golub and LeVeque.
class Moments {
 public:
  explicit Moments(std::size_t size) : mean_(size, 0.0), variance_(size, 1.0), batch_mean_(size), squares_(size) {}

  const std::vector<double>& mean() const { return mean_; }
  double scale(std::size_t index) const { return std::sqrt(variance_[index] + 1e-8); }

  // Adds a batch: [rows][size].
  void add(const double* batch, std::size_t rows) {
    const std::size_t size = mean_.size();
    const auto n = static_cast<double>(rows);
    std::fill(batch_mean_.begin(), batch_mean_.end(), 0.0);
    std::fill(squares_.begin(), squares_.end(), 0.0);
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t j = 0; j < size; ++j) batch_mean_[j] += batch[i * size + j];
    for (double& mean : batch_mean_) mean /= n;
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t j = 0; j < size; ++j) {
        const double distance = batch[i * size + j] - batch_mean_[j];
        squares_[j] += distance * distance;
      }
    const double total = count_ + n, share = n / total, spread = count_ * n / total;
    for (std::size_t j = 0; j < size; ++j) {
      const double delta = batch_mean_[j] - mean_[j];
      variance_[j] = (variance_[j] * count_ + squares_[j] + delta * delta * spread) / total;
      mean_[j] += delta * share;
    }
    count_ = total;
  }

  template <typename Archive>
  void archive(Archive& a) {
    a(mean_, kSum);
    a(variance_, kVariance);
    a(count_, {kFirstCount, kCount.high});
  }

 private:
  static constexpr double kFirstCount = 1e-4;
  std::vector<double> mean_, variance_;
  double count_ = kFirstCount;
  std::vector<double> batch_mean_, squares_;  // scratch memory of add()
};

// Turns observations into inputs of the networks.
class ObservationNormalizer {
 public:
  ObservationNormalizer(std::size_t size, int stride, bool enabled, double clip)
      : moments_(size),
        inverse_(size, 1.0),
        stride_(static_cast<std::size_t>(stride)),
        enabled_(enabled),
        clip_(clip) {}

  const Moments& moments() const { return moments_; }
  bool enabled() const { return enabled_; }
  double clip() const { return clip_; }
  void set_clip(double clip) { clip_ = clip; }

  void add(const double* observations, std::size_t rows) {
    if (!enabled_) return;
    moments_.add(observations, rows);
    update_inverse();
  }

  // (observation - mean) / scale, clipped and rounded to float32. to: [rows][stride].
  void normalize(const double* observations, std::size_t rows, float* to) const {
    const std::size_t size = inverse_.size();
    const double* mean = moments_.mean().data();
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t j = 0; j < size; ++j) {
        const double x = (observations[i * size + j] - mean[j]) * inverse_[j];
        to[i * stride_ + j] = static_cast<float>(std::min(clip_, std::max(-clip_, x)));
      }
  }

  template <typename Archive>
  void archive(Archive& a) {
    moments_.archive(a);
    if (enabled_) update_inverse();
  }

 private:
  Moments moments_;
  std::vector<double> inverse_;  // 1 / scale
  std::size_t stride_;
  bool enabled_;
  double clip_;

  void update_inverse() {
    for (std::size_t j = 0; j < inverse_.size(); ++j) inverse_[j] = 1 / moments_.scale(j);
  }
};

// Divides rewards by the standard deviation of the rows' discounted returns.
class RewardNormalizer {
 public:
  explicit RewardNormalizer(std::size_t rows) : moments_(1), returns_(rows, 0.0) {}

  // to[rows] receives the scaled and clipped rewards. ended: 1 for rows whose episode ended with this step.
  void add(const double* rewards, const std::vector<unsigned char>& ended, double gamma, double clip, bool enabled,
           float* to) {
    if (enabled) {
      for (std::size_t i = 0; i < returns_.size(); ++i) returns_[i] = returns_[i] * gamma + rewards[i];
      moments_.add(returns_.data(), returns_.size());
    }
    const double scale = enabled ? moments_.scale(0) : 1.0;
    for (std::size_t i = 0; i < returns_.size(); ++i) {
      to[i] = static_cast<float>(std::min(clip, std::max(-clip, rewards[i] / scale)));
      if (ended[i] != 0) returns_[i] = 0;
    }
  }

  void forget_returns() { std::fill(returns_.begin(), returns_.end(), 0.0); }

  template <typename Archive>
  void archive(Archive& a) {
    moments_.archive(a);
    a(returns_, kSum);
  }

 private:
  Moments moments_;  // of the discounted returns
  std::vector<double> returns_;
};

}  // namespace mjenv::learn
