#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "archive.hpp"

namespace mjenv::learn {

// The returns and lengths of the last episodes.
class EpisodeStatistics {
 public:
  EpisodeStatistics(std::size_t rows, std::size_t window)
      : totals_(rows, 0.0), steps_(rows, 0), returns_(window, 0.0), lengths_(window, 0.0) {}

  void add_step(std::size_t row, double reward, bool ended) {
    totals_[row] += reward;
    ++steps_[row];
    if (!ended) return;
    const std::size_t at = static_cast<std::size_t>(episodes_ % static_cast<std::int64_t>(returns_.size()));
    returns_[at] = totals_[row];
    lengths_[at] = static_cast<double>(steps_[row]);
    ++episodes_;
    totals_[row] = 0;
    steps_[row] = 0;
  }

  // Call this when the episodes under way are given up: forgets their rewards so far.
  void forget_unfinished() {
    std::fill(totals_.begin(), totals_.end(), 0.0);
    std::fill(steps_.begin(), steps_.end(), 0);
  }

  std::int64_t episodes() const { return episodes_; }
  bool is_full() const { return episodes_ >= static_cast<std::int64_t>(returns_.size()); }
  double mean_return() const { return mean(returns_); }
  double mean_length() const { return mean(lengths_); }

  template <typename Archive>
  void archive(Archive& a) {
    a(totals_, kSum);
    a(steps_, kCount);
    a(returns_, kSum);
    a(lengths_, kCount);
    a(episodes_, kCount);
  }

 private:
  std::vector<double> totals_;             // the rewards of each row's episode so far
  std::vector<std::int64_t> steps_;        // how many steps each row's episode has so far
  std::vector<double> returns_, lengths_;  // of the last episodes; a new one replaces the oldest
  std::int64_t episodes_ = 0;

  double mean(const std::vector<double>& values) const {
    const auto count = std::min(static_cast<std::size_t>(episodes_), values.size());
    if (count == 0) return __builtin_nan("");
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += values[i];
    return sum / static_cast<double>(count);
  }
};

}  // namespace mjenv::learn
