// What the lane code calls in a copy that tests/mutants/rewrite.py has rewritten. Each call carries the number of a
// mutant, and computes what the original computes unless that mutant is chosen. rewrite.py defines the macro
// MJENV_MUTANTS as the number of mutants.
//
// The environment variable MJENV_MUTANT=NUMBER chooses a mutant. The environment variable MJENV_MUTANTS=FILE lets the
// program judge all mutants whose verdict is open: where it first comes to a place at which a mutant computes other
// bits, it forks, and the copy goes on with the mutant. If the copy fails, the test kills the mutant. The file has a
// byte for each mutant, its Verdict. MJENV_MUTANTS_SECONDS says how many seconds of the CPU a copy has.
#pragma once

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <cstring>
#include <type_traits>

#define MJENV_FAST inline __attribute__((always_inline))
#define MJENV_SLOW __attribute__((noinline, cold))

namespace mutants {

constexpr int kCount = MJENV_MUTANTS;

// As in run.py. The first three are open.
enum Verdict : unsigned char {
  kUnreached,   // the program did not come to the mutant's place
  kSame,        // the mutant would have computed the same bits each time, or others only where no copy can be judged
  kUnfinished,  // a copy with the mutant needed more seconds of the CPU than MJENV_MUTANTS_SECONDS
  kSurvived,    // a copy with the mutant passed
  kKilled,      // a copy with the mutant failed
  kSkipped,     // not to be judged
};

enum State : unsigned char { kOff, kWatched, kChosen };
inline unsigned char states[kCount];
inline unsigned char* verdicts = nullptr;  // memory of the file, so that it is written however the process ends
inline pid_t judge_id = 0;
inline double seconds = 0;
inline bool is_checked = false;  // whether a copy without a mutant has passed

inline itimerval timer_of(double time) {
  itimerval timer = {};
  timer.it_value.tv_sec = static_cast<time_t>(time);
  timer.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (time - static_cast<double>(timer.it_value.tv_sec)));
  timer.it_interval = timer.it_value;
  return timer;
}

// Has mutants judged again whose copy ran out of time. A timer calls this, because by then the test may step another
// model, in which the mutant's other bits make the copy fail in time.
inline void watch_unfinished(int /*signal*/) {
  for (int id = 0; id < kCount; ++id)
    if (verdicts[id] == kUnfinished) states[id] = kWatched;
}

struct Start {
  Start() {
    if (const char* number = std::getenv("MJENV_MUTANT")) states[std::atoi(number)] = kChosen;
    const char* path = std::getenv("MJENV_MUTANTS");
    if (!path) return;
    const int file = open(path, O_RDWR | O_CLOEXEC);
    if (file < 0) std::abort();
    verdicts = static_cast<unsigned char*>(mmap(nullptr, kCount, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0));
    close(file);
    if (verdicts == MAP_FAILED) std::abort();
    judge_id = getpid();
    seconds = std::atof(std::getenv("MJENV_MUTANTS_SECONDS"));
    for (int id = 0; id < kCount; ++id) states[id] = verdicts[id] <= kUnfinished ? kWatched : kOff;
    struct sigaction action = {};
    action.sa_handler = watch_unfinished;
    action.sa_flags = SA_RESTART;
    sigaction(SIGVTALRM, &action, nullptr);
    const itimerval timer = timer_of(10 * seconds);
    setitimer(ITIMER_VIRTUAL, &timer, nullptr);
  }
};
inline const Start start;

// Each instruction set compiles these functions with its own flags, so they must not be merged.
namespace {

// Forks. Returns true in the copy, which is ended after `seconds` of the CPU's time, or of a clock if it only waits.
inline bool is_copy(int* status) {
  const pid_t copy = fork();
  if (copy < 0) std::abort();
  if (copy == 0) {
    std::memset(states, kOff, kCount);
    const itimerval limit = timer_of(seconds);
    setitimer(ITIMER_PROF, &limit, nullptr);
    alarm(10 + static_cast<unsigned>(10 * seconds));
    return true;
  }
  if (waitpid(copy, status, 0) != copy) std::abort();
  return false;
}

inline bool is_unfinished(int status) {
  return WIFSIGNALED(status) && (WTERMSIG(status) == SIGPROF || WTERMSIG(status) == SIGALRM);
}

// Judges a mutant that computes other bits here. Returns true in the copy that goes on with the mutant.
inline bool judge(int id) {
  // A copy has only the thread that forks, so it cannot go on without the others. A process that the test has forked
  // does not know what the test expects. The folder of a process with one thread has three links.
  struct stat tasks;
  if (getpid() != judge_id || stat("/proc/self/task", &tasks) != 0 || tasks.st_nlink != 3) {
    verdicts[id] = kSame;
    return false;
  }
  states[id] = kOff;
  int status = 0;
  if (!is_checked) {
    if (is_copy(&status)) return false;
    if (status != 0 && !is_unfinished(status)) std::abort();
    is_checked = true;
  }
  if (is_copy(&status)) {
    states[id] = kChosen;
    return true;
  }
  verdicts[id] = is_unfinished(status) ? kUnfinished : status == 0 ? kSurvived : kKilled;
  return false;
}

// Whether the mutant is chosen. differs: whether it computes here other bits than the original.
inline bool decide(int id, bool differs) {
  if (states[id] == kChosen) return true;
  if (differs) return judge(id);
  if (verdicts[id] == kUnreached) verdicts[id] = kSame;
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
