// What the lane code calls in a copy that tests/mutants/rewrite.py has rewritten. Each call carries the number of a
// mutant, and computes what the original computes unless that mutant is chosen. rewrite.py defines MJENV_MUTANTS.
//
// MJENV_MUTANT=NUMBER chooses a mutant. MJENV_MUTANTS_FELT=FILE chooses none, and writes for each mutant a byte to this
// file: 0 if the program did not come to its place, 1 if the mutant would have computed the same bits each time, 2 if
// it would have computed others.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <type_traits>

#define MJENV_FAST inline __attribute__((always_inline))
#define MJENV_SLOW __attribute__((noinline, cold))

namespace mutants {

constexpr int kCount = MJENV_MUTANTS;

enum State : unsigned char { kOff, kWatched, kChosen };
inline unsigned char states[kCount];
inline unsigned char* felt = nullptr;  // memory of the file, so that forked and killed processes count too

struct Start {
  Start() {
    if (const char* number = std::getenv("MJENV_MUTANT")) states[std::atoi(number)] = kChosen;
    const char* path = std::getenv("MJENV_MUTANTS_FELT");
    if (!path) return;
    const int file = open(path, O_RDWR | O_CLOEXEC);
    if (file < 0) std::abort();
    felt = static_cast<unsigned char*>(mmap(nullptr, kCount, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0));
    close(file);
    if (felt == MAP_FAILED) std::abort();
    std::memset(states, kWatched, kCount);
  }
};
inline const Start start;

// Each instruction set compiles these functions with its own flags, so they must not be merged.
namespace {

// Whether the mutant is chosen. differs: whether it computes here other bits than the original.
inline bool decide(int id, bool differs) {
  if (states[id] == kChosen) return true;
  if (felt[id] < 2) felt[id] = differs ? 2 : 1;
  if (differs) states[id] = kOff;  // no more need to watch it
  return false;
}

template <typename T>
MJENV_SLOW T choose(int id, T original, T other) {
  return decide(id, std::memcmp(&original, &other, sizeof original) != 0) ? other : original;
}

#define MJENV_OPERATOR(name, op, other)                                      \
  template <typename L, typename R>                                          \
  MJENV_SLOW auto slow_##name(int id, L l, R r) {                            \
    return choose(id, l op r, l other r);                                    \
  }                                                                          \
  template <typename L, typename R>                                          \
  MJENV_FAST constexpr auto name(int id, L l, R r) {                         \
    if (__builtin_is_constant_evaluated()) return l op r;                    \
    return __builtin_expect(states[id], 0) ? slow_##name(id, l, r) : l op r; \
  }
MJENV_OPERATOR(plus, +, -)
MJENV_OPERATOR(minus, -, +)
MJENV_OPERATOR(times, *, +)
MJENV_OPERATOR(over, /, *)
MJENV_OPERATOR(modulo, %, /)
MJENV_OPERATOR(both, &, |)
MJENV_OPERATOR(either, |, &)
MJENV_OPERATOR(unlike, ^, &)
MJENV_OPERATOR(left, <<, >>)
MJENV_OPERATOR(right, >>, <<)
MJENV_OPERATOR(less, <, <=)
MJENV_OPERATOR(less_equal, <=, <)
MJENV_OPERATOR(greater, >, >=)
MJENV_OPERATOR(greater_equal, >=, >)

// The mutant with a minus before a number
template <typename T>
MJENV_FAST constexpr auto opposite(int id, T x) {
  if (__builtin_is_constant_evaluated()) return +x;
  return __builtin_expect(states[id], 0) ? choose<decltype(+x)>(id, +x, -x) : +x;
}

// The mutant whose condition is the other way round: of a number, or of the numbers of a vector
template <typename T>
MJENV_FAST constexpr auto inverse(int id, const T& x) {
  if constexpr (std::is_constructible_v<bool, T>) {
    if (__builtin_is_constant_evaluated()) return static_cast<bool>(x);
    return __builtin_expect(states[id], 0) && decide(id, true) ? !x : static_cast<bool>(x);
  } else {
    return __builtin_expect(states[id], 0) && decide(id, true) ? ~x : T{x};
  }
}
// The mutant in which all bits are the other way round
template <typename T>
MJENV_FAST constexpr auto complement(int id, T x) {
  if constexpr (std::is_same_v<T, bool>)
    return inverse(id, x);
  else
    return __builtin_expect(states[id], 0) && decide(id, true) ? ~x : x;
}
// The mutants in which a condition always holds, or never
template <typename T>
MJENV_FAST constexpr bool yes(int id, const T& x) {
  if (__builtin_is_constant_evaluated()) return static_cast<bool>(x);
  return (__builtin_expect(states[id], 0) && decide(id, !x)) || static_cast<bool>(x);
}
template <typename T>
MJENV_FAST constexpr bool no(int id, const T& x) {
  if (__builtin_is_constant_evaluated()) return static_cast<bool>(x);
  return !(__builtin_expect(states[id], 0) && decide(id, static_cast<bool>(x))) && static_cast<bool>(x);
}
// The mutant without a statement
MJENV_FAST constexpr bool drop(int id) {
  return !__builtin_is_constant_evaluated() && __builtin_expect(states[id], 0) && decide(id, true);
}

}  // namespace
}  // namespace mutants
