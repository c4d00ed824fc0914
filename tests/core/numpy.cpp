// NumPy's generator, sums, norms and powers, against what NumPy gave: random.txt and powers.txt in tests/golden.
#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

#include "numpy/math.hpp"
#include "numpy/random.hpp"
#include "run.hpp"

namespace {

using mjenv::core::np::Generator;
using mjenv::core::np::Norm;

// cmocka leaves a failing test by longjmp: everything with a destructor lives in here.
using Words = std::vector<std::string>;
std::vector<Words> lines;

// The folder of the recordings that fit this CPU: the C library chooses variants of its functions by CPU.
const char* recordings() {
  volatile double angle = 692;  // keeps the compiler from computing the sine
  return std::sin(angle) == 0x1.80869e3fad89ap-1 ? PROJECT_FOLDER "/tests/golden/fma/"
                                                 : PROJECT_FOLDER "/tests/golden/sse2/";
}

void read_lines(const std::string& path) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream stream(line);
    Words words;
    for (std::string word; stream >> word;) words.push_back(word);
    if (!words.empty() && words[0][0] != '#') lines.push_back(words);
  }
}

double real(const std::string& word) { return std::strtod(word.c_str(), nullptr); }

std::uint64_t hex(const std::string& word) { return std::strtoull(word.c_str(), nullptr, 16); }

template <typename T>
bool same(T a, T b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}

template <typename T>
void assert_same(const Words& line, T got, T want) {
  if (!same(got, want))
    fail_msg("%s %s: is %a, wanted %a", line[0].c_str(), line[1].c_str(), static_cast<double>(got),
             static_cast<double>(want));
}

// A seed's 64-bit words, least significant first, from its hexadecimal digits.
std::vector<std::uint64_t> words_of(const std::string& seed) {
  std::vector<std::uint64_t> words;
  for (std::size_t end = seed.size(); end > 0; end -= std::min<std::size_t>(end, 16)) {
    const std::size_t begin = end > 16 ? end - 16 : 0;
    words.push_back(hex(seed.substr(begin, end - begin)));
  }
  return words;
}

std::uint64_t low_half(const std::string& word) { return hex(word.substr(word.size() - 16)); }
std::uint64_t high_half(const std::string& word) { return hex(word.substr(0, word.size() - 16)); }

// Calls visit with the generator of the last "seed" line and each line that follows.
int seeds_seen;
template <typename Visit>
void each_seed(const char* key, const Visit& visit) {
  Generator generator{};
  seeds_seen = 0;
  for (const auto& line : lines) {
    if (line[0] == "seed") {
      std::vector<std::uint64_t> words = words_of(line[1]);
      generator = Generator::from_seed(words.data(), words.size());
      words.resize(words.size() + 2);  // leading zeros do not count
      assert_true(Generator::from_seed(words.data(), words.size()).words() == generator.words());
    } else if (line[0] == key) {
      ++seeds_seen;
      visit(generator, line);
    }
  }
  assert_int_equal(seeds_seen, 9);
}

void test_state(void**) {
  each_seed("state", [](const Generator& generator, const Words& line) {
    assert_true(generator.words()[0] == low_half(line[1]));
    assert_true(generator.words()[1] == high_half(line[1]));
  });
  each_seed("inc", [](const Generator& generator, const Words& line) {
    assert_true(generator.words()[2] == low_half(line[1]));
    assert_true(generator.words()[3] == high_half(line[1]));
  });
}

void test_raw(void**) {
  each_seed("raw", [](Generator generator, const Words& line) {
    assert_int_equal(line.size(), 21);
    for (std::size_t i = 1; i < line.size(); ++i) assert_true(generator.next() == hex(line[i]));
  });
}

void test_uniform(void**) {
  each_seed("uniform", [](Generator generator, const Words& line) {
    for (std::size_t i = 1; i < line.size(); ++i) assert_same(line, generator.uniform(-0.1, 0.1), real(line[i]));
  });
}

void test_normal(void**) {
  each_seed("normal", [](Generator generator, const Words& line) {
    for (std::size_t i = 1; i < line.size(); ++i) assert_same(line, generator.normal(), real(line[i]));
  });
}

void test_words_make_the_generator(void**) {
  Generator generator = Generator::from_seed(42);
  generator.next();
  Generator twin = Generator::from_words(generator.words());
  for (int i = 0; i < 100; ++i) assert_true(generator.next() == twin.next());
}

// branch PATH SEED INDEX DRAWS VALUE: each way through the ziggurat, with the raw numbers that it takes.
void test_branches(void**) {
  int seen = 0;
  for (const auto& line : lines) {
    if (line[0] != "branch") continue;
    Generator generator = Generator::from_seed(std::strtoull(line[2].c_str(), nullptr, 10));
    for (long i = std::atol(line[3].c_str()); i > 0; --i) generator.normal();
    Generator counted = generator;
    assert_same(line, generator.normal(), real(line[5]));
    for (int i = std::atoi(line[4].c_str()); i > 0; --i) counted.next();
    if (counted.words() != generator.words()) fail_msg("%s: not %s draws", line[1].c_str(), line[4].c_str());
    ++seen;
  }
  assert_int_equal(seen, 14);
}

// bulk SEED N CHECKSUM: so many normals that the ziggurat's acceptance tests are met from both sides.
void test_bulk(void**) {
  int seen = 0;
  for (const auto& line : lines) {
    if (line[0] != "bulk") continue;
    Generator generator = Generator::from_seed(hex(line[1]));
    std::uint64_t checksum = 0xcbf29ce484222325;
    for (long i = std::atol(line[2].c_str()); i > 0; --i) {
      const double value = generator.normal();
      std::uint64_t word;
      std::memcpy(&word, &value, sizeof word);
      checksum = (checksum ^ word) * 0x100000001b3;
    }
    assert_true(checksum == hex(line[3]));
    ++seen;
  }
  assert_int_equal(seen, 1);
}

// Calls draw(generator, values) with the seed of each line of the key; the line ends with what is then expected.
template <typename Draw>
void each_draw(const char* key, int lines_wanted, const Draw& draw) {
  int seen = 0;
  for (const auto& line : lines) {
    if (line[0] != key) continue;
    Generator generator = Generator::from_seed(hex(line[1]));
    std::vector<std::int64_t> values;
    draw(generator, line, values);
    std::uint64_t checksum = 0xcbf29ce484222325;
    for (const std::int64_t value : values) checksum = (checksum ^ static_cast<std::uint64_t>(value)) * 0x100000001b3;
    const std::size_t end = line.size();
    const auto words = generator.words();
    const bool equal = checksum == hex(line[end - 4]) && words[4] == hex(line[end - 3]) &&
                       words[5] == hex(line[end - 2]) && generator.next() == hex(line[end - 1]);
    if (!equal) fail_msg("%s %s %s ...", key, line[1].c_str(), line[2].c_str());
    ++seen;
  }
  assert_int_equal(seen, lines_wanted);
}

std::int64_t integer(const std::string& word) { return std::strtoll(word.c_str(), nullptr, 10); }

void test_integers(void**) {
  each_draw("integers", 20, [](Generator& generator, const Words& line, std::vector<std::int64_t>& values) {
    for (int i = 0; i < 1000; ++i) values.push_back(generator.integers(integer(line[2]), integer(line[3])));
  });
}

void test_choice(void**) {
  each_draw("choice", 2, [](Generator& generator, const Words& line, std::vector<std::int64_t>& values) {
    for (int i = 0; i < 1000; ++i) values.push_back(generator.choice(integer(line[2]), nullptr));
  });
  each_draw("weighted", 2, [](Generator& generator, const Words& line, std::vector<std::int64_t>& values) {
    double p[5];
    for (int i = 0; i < 5; ++i) p[i] = real(line[2 + static_cast<std::size_t>(i)]);
    for (int i = 0; i < 1000; ++i) values.push_back(generator.choice(5, p));
  });
}

void test_sample(void**) {
  each_draw("sample", 18, [](Generator& generator, const Words& line, std::vector<std::int64_t>& values) {
    values.resize(static_cast<std::size_t>(integer(line[3])));
    generator.sample(integer(line[2]), integer(line[3]), values.data());
  });
}

void test_permutation(void**) {
  each_draw("permutation", 10, [](Generator& generator, const Words& line, std::vector<std::int64_t>& values) {
    values.resize(static_cast<std::size_t>(integer(line[2])));
    generator.permutation(integer(line[2]), values.data());
  });
}

void test_entropy(void**) { assert_true(Generator::from_entropy().words() != Generator::from_entropy().words()); }

// The numbers of the lines `sum` and `norm first`.
double term(Eigen::Index i) { return static_cast<double>((7919 * i + 13) % 1009) / 17.0 - 30.0; }

// sum N F8 F4, of numbers that mix size and sign.
void test_sums(void**) {
  int seen = 0;
  for (const auto& line : lines) {
    if (line[0] != "sum") continue;
    const long n = std::atol(line[1].c_str());
    assert_same(line, mjenv::np::sum(n, term), real(line[2]));
    const float narrow = mjenv::np::sum(n, [&](Eigen::Index i) { return static_cast<float>(term(i)); });
    assert_same(line, narrow, static_cast<float>(real(line[3])));
    ++seen;
  }
  assert_int_equal(seen, 301);
}

void test_power2(void**) {
  int seen = 0, unlike_product = 0;
  for (const auto& line : lines) {
    if (line[0] != "power2") continue;
    const double x = real(line[1]);
    assert_same(line, mjenv::np::power2(x), real(line[2]));
    unlike_product += !same(x * x, real(line[2]));
    ++seen;
  }
  assert_true(seen > 40 && unlike_product > 10);
}

void test_norms(void**) {
  int seen = 0, unlike = 0;
  for (const auto& line : lines) {
    if (line[0] != "norm" || line[2] == "first") continue;
    const bool three = line.size() == 6;
    const double x = real(line[2]), y = real(line[3]), z = three ? real(line[4]) : 0, want = real(line.back());
    const Norm norm(line[1] == "fused"), other(line[1] != "fused");
    assert_same(line, three ? norm(x, y, z) : norm(x, y), want);
    const Eigen::Vector3d v3(x, y, z);
    const Eigen::Vector2d v2(x, y);
    assert_same(line, three ? norm(v3) : norm(v2), want);
    unlike += !same(three ? other(x, y, z) : other(x, y), want);
    ++seen;
  }
  assert_int_equal(seen, 400);
  assert_true(unlike > 10);
}

void test_norms_of_any_length(void**) {
  int seen = 0, unlike = 0;
  for (const auto& line : lines) {
    if (line[0] != "norm" || line[2] != "first") continue;
    const long count = std::atol(line[3].c_str());
    Eigen::VectorXd numbers(count + 1);
    for (long i = 0; i < count; ++i) numbers[i] = term(i);
    numbers[count] = std::numeric_limits<double>::quiet_NaN();  // beyond the vector
    const double want = real(line[4]);
    const Norm norm(line[1] == "fused"), other(line[1] != "fused");
    assert_same(line, norm(numbers.head(count)), want);
    unlike += !same(other(numbers.head(count)), want);
    ++seen;
  }
  assert_int_equal(seen, 2 * 205);
  assert_true(unlike > 10);
}

// The kernel that OpenBLAS chooses for this CPU.
std::string kernel_of_this_cpu() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512vl")) return "SkylakeX";
  if (__builtin_cpu_supports("avx2")) return "Haswell";
  if (__builtin_cpu_supports("avx")) return "Sandybridge";
#endif
  return "Nehalem";
}

// As NumPy under the same environment variable, on this kind of CPU.
void test_norm_follows_openblas(void**) {
  const std::string cpu = kernel_of_this_cpu();
  int seen = 0;
  for (const auto& line : lines) {
    if (line[0] != "coretype" || line[1] != cpu) continue;
    setenv("OPENBLAS_CORETYPE", line[2].c_str(), 1);
    const bool fused = mjenv::core::np::norm_as_numpy_here().fused();
    // Else NumPy crashes on this CPU, or rounds as the library cannot.
    if (line[3] == "fused" || line[3] == "plain") {
      if (fused != (line[3] == "fused"))
        fail_msg("not %s under %s on %s", line[3].c_str(), line[2].c_str(), cpu.c_str());
      ++seen;
    }
  }
  unsetenv("OPENBLAS_CORETYPE");
  assert_true(seen > 0);
}

// numpy.clip: NaN passes, the upper bound wins, -0.0 stays.
void test_clip(void**) {
  using mjenv::np::clip;
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  assert_true(std::isnan(clip(nan, -1, 1)));
  assert_true(clip(5, -1, 1) == 1 && clip(-5, -1, 1) == -1 && clip(0.5, -1, 1) == 0.5);
  assert_true(clip(0, 2, 1) == 1 && clip(3, 2, 1) == 1);
  assert_true(clip(inf, -inf, 10) == 10 && clip(-inf, -inf, 10) == -inf);
  assert_true(same(clip(-0.0, 0, 1), -0.0) && same(clip(-0.0, -1, 0), -0.0));
}

// A weight is rounded to float32 before it multiplies a float32.
void test_scalar(void**) {
  using mjenv::np::Scalar;
  const double weight = 0.1;
  const float narrow = 3.3f;
  assert_true(same(static_cast<double>(weight * Scalar(narrow)), static_cast<double>(0.1f * 3.3f)));
  assert_true(same(static_cast<double>(Scalar(narrow) * weight), static_cast<double>(0.1f * 3.3f)));
  assert_true(same(static_cast<double>(weight * Scalar(3.3)), 0.1 * 3.3));
  assert_true(same(static_cast<double>(-Scalar(0.0f)), -0.0));
}

}  // namespace

int run_numpy() {
  read_lines(PROJECT_FOLDER "/tests/golden/random.txt");
  read_lines(recordings() + std::string("powers.txt"));
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_state),
      cmocka_unit_test(test_raw),
      cmocka_unit_test(test_uniform),
      cmocka_unit_test(test_normal),
      cmocka_unit_test(test_words_make_the_generator),
      cmocka_unit_test(test_branches),
      cmocka_unit_test(test_bulk),
      cmocka_unit_test(test_integers),
      cmocka_unit_test(test_choice),
      cmocka_unit_test(test_sample),
      cmocka_unit_test(test_permutation),
      cmocka_unit_test(test_entropy),
      cmocka_unit_test(test_sums),
      cmocka_unit_test(test_power2),
      cmocka_unit_test(test_norms),
      cmocka_unit_test(test_norms_of_any_length),
      cmocka_unit_test(test_norm_follows_openblas),
      cmocka_unit_test(test_clip),
      cmocka_unit_test(test_scalar),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
