// The functions by the names that redirect.h gives them. On x86-64 there are two variants with the same bits: one with
// the instructions of CPUs that have FMA, and one for all CPUs, which is slower.
#if defined(__x86_64__)
#define MJENV_CHOOSE(name, parameters, arguments)                           \
  extern "C" double mjenv_##name##_fma parameters;                          \
  extern "C" double mjenv_##name##_soft parameters;                         \
  extern "C" double mjenv_##name parameters {                               \
    if (__builtin_cpu_supports("fma")) return mjenv_##name##_fma arguments; \
    return mjenv_##name##_soft arguments;                                   \
  }
#else
#define MJENV_CHOOSE(name, parameters, arguments)  \
  extern "C" double mjenv_##name##_all parameters; \
  extern "C" double mjenv_##name parameters { return mjenv_##name##_all arguments; }
#endif

MJENV_CHOOSE(sin, (double x), (x))
MJENV_CHOOSE(cos, (double x), (x))
MJENV_CHOOSE(tan, (double x), (x))
MJENV_CHOOSE(asin, (double x), (x))
MJENV_CHOOSE(acos, (double x), (x))
MJENV_CHOOSE(atan2, (double y, double x), (y, x))
MJENV_CHOOSE(exp, (double x), (x))
MJENV_CHOOSE(log, (double x), (x))
MJENV_CHOOSE(expm1, (double x), (x))
MJENV_CHOOSE(log1p, (double x), (x))
MJENV_CHOOSE(pow, (double x, double y), (x, y))

#if defined(__x86_64__)
extern "C" double mjenv_fma_soft(double a, double b, double c);
namespace {
__attribute__((target("fma"))) double fma_by_instruction(double a, double b, double c) {
  return __builtin_fma(a, b, c);
}
}  // namespace
extern "C" double mjenv_fma(double a, double b, double c) {
  if (__builtin_cpu_supports("fma")) return fma_by_instruction(a, b, c);
  return mjenv_fma_soft(a, b, c);
}
#elif defined(__wasm__)
extern "C" double mjenv_fma_soft(double a, double b, double c);
extern "C" double mjenv_fma(double a, double b, double c) { return mjenv_fma_soft(a, b, c); }
#else
extern "C" double mjenv_fma(double a, double b, double c) { return __builtin_fma(a, b, c); }
#endif
