#include "task/draws.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "error.hpp"
#include "numpy/random.hpp"

namespace mjenv::core {
namespace {

constexpr std::int64_t kWords = np::Generator::kWords;
constexpr double kWhole = 0x1p53;  // up to here, a double holds each integer

void check(const std::uint64_t* words, std::int64_t streams, mjenv_distribution kind, double low, double high,
           std::int64_t count) {
  if (streams < 1) fail(MJENV_E_VALUE, "streams is " + std::to_string(streams) + ", but must be at least 1");
  if (count < 0 || count % streams != 0)
    fail(MJENV_E_SIZE,
         "count is " + std::to_string(count) + ", no multiple of the " + std::to_string(streams) + " stream(s)");
  for (std::int64_t i = 0; i < streams; ++i)
    np::Generator::check_increment(words[i * kWords + 2], "stream " + std::to_string(i) + ": ");
  const auto given = [&] { return "low " + std::to_string(low) + " and high " + std::to_string(high); };
  if (kind == MJENV_DISTRIBUTION_UNIFORM) {
    // NumPy also refuses a difference of -0.
    if (!std::isfinite(high - low) || std::signbit(high - low))
      fail(MJENV_E_VALUE, "uniform: " + given() + ": high - low must be finite and not below 0");
  } else if (kind == MJENV_DISTRIBUTION_INTEGERS) {
    const auto is_whole = [](double x) { return std::fabs(x) <= kWhole && std::trunc(x) == x; };
    if (!is_whole(low) || !is_whole(high) || !(low < high))
      fail(MJENV_E_VALUE, "integers: " + given() + " must be integers within 2^53, low below high");
  } else if (kind != MJENV_DISTRIBUTION_NORMAL) {
    fail(MJENV_E_ARGUMENT, "kind is " + std::to_string(kind) + ", which is not an mjenv_distribution");
  }
}

}  // namespace

void draw(std::uint64_t* words, std::int64_t streams, mjenv_distribution kind, double low, double high, double* values,
          std::int64_t count) {
  check(words, streams, kind, low, high, count);
  const std::int64_t each = count / streams;
  for (std::int64_t i = 0; i < streams; ++i, words += kWords) {
    np::Generator::Words state;
    std::copy_n(words, kWords, state.begin());
    np::Generator stream = np::Generator::from_words(state);
    for (std::int64_t k = 0; k < each; ++k)
      *values++ =
          kind == MJENV_DISTRIBUTION_UNIFORM ? stream.uniform(low, high)
          : kind == MJENV_DISTRIBUTION_NORMAL
              ? stream.normal()
              : static_cast<double>(stream.integers(static_cast<std::int64_t>(low), static_cast<std::int64_t>(high)));
    state = stream.words();
    std::copy(state.begin(), state.end(), words);
  }
}

}  // namespace mjenv::core
