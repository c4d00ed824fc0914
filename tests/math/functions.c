// The portable functions: in a million arguments each, the bits of glibc's functions on CPUs with FMA. And glibc's fma.
#include <inttypes.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// After the headers that it needs.
#include <cmocka.h>

// The first arguments of each function are also compared with recorded results, and computed without instructions for
// FMA, which is slow.
enum { ARGUMENTS = 1000000, RECORDED = 20000 };

// ---- Functions ----

#if defined(__x86_64__)
#define WITHOUT_FMA(name) mjenv_##name##_soft
#else
#define WITHOUT_FMA(name) mjenv_##name
#endif

// Those with one argument leave y out.
typedef double function(double x, double y);

#define DEFINE_ONE(adapter, called) \
  static double adapter(double x, double y) { return (void)y, called(x); }
#define DEFINE_TWO(adapter, called) \
  static double adapter(double x, double y) { return called(x, y); }

#define DEFINE(count, name, ...)                                                          \
  double mjenv_##name(__VA_ARGS__), WITHOUT_FMA(name)(__VA_ARGS__);                       \
  DEFINE_##count(our_##name, mjenv_##name) DEFINE_##count(soft_##name, WITHOUT_FMA(name)) \
      DEFINE_##count(system_##name, name)

DEFINE(ONE, sin, double)
DEFINE(ONE, cos, double)
DEFINE(ONE, tan, double)
DEFINE(ONE, asin, double)
DEFINE(ONE, acos, double)
DEFINE(ONE, exp, double)
DEFINE(ONE, log, double)
DEFINE(ONE, expm1, double)
DEFINE(ONE, log1p, double)
DEFINE(TWO, atan2, double, double)
DEFINE(TWO, pow, double, double)

// A function, and the arguments from low - range to low + range.
struct part {
  const char* name;
  double low, range;
  function *ours, *soft, *system;
};

#define PART(name, low, range) \
  { #name, low, range, our_##name, soft_##name, system_##name }
static struct part parts[] = {
    PART(sin, 0, 10),      PART(sin, 0, 1e9),  PART(cos, 0, 10),    PART(cos, 0, 1e9),   PART(tan, 0, 10),
    PART(tan, 0, 1e9),     PART(asin, 0, 1),   PART(acos, 0, 1),    PART(exp, 0, 10),    PART(exp, 0, 750),
    PART(expm1, 0, 1),     PART(expm1, 0, 50), PART(log, 1, 1),     PART(log, 1e6, 1e6), PART(log1p, 0, 1),
    PART(log1p, 1e6, 1e6), PART(atan2, 0, 1),  PART(atan2, 0, 1e6), PART(pow, 1, 1),     PART(pow, 100, 100),
};
enum { PARTS = sizeof parts / sizeof *parts };

// ---- Arguments ----

// Marsaglia's xorshift.
static uint64_t next(uint64_t* random) {
  *random ^= *random << 13;
  *random ^= *random >> 7;
  return *random ^= *random << 17;
}
static const uint64_t seed = 88172645463325252u;

static double of_bits(uint64_t bits) {
  double x;
  memcpy(&x, &bits, sizeof x);
  return x;
}

static const double special[] = {
    0.0,         -0.0,   1.0,     -1.0,     0.5,       -0.5, 2.0,   1e300,  -1e300, 5e-324,
    -5e-324,     1e-310, 0x1p-27, INFINITY, -INFINITY, NAN,  710.0, -745.2, -720.5, 3.141592653589793,
    105414357.85};
enum { SPECIAL = sizeof special / sizeof *special };

// One of all doubles in every eighth place, else one from low - range to low + range.
static double argument(int place, double low, double range, uint64_t* random) {
  if (place % 8 == 0) return of_bits(next(random));
  return low + range * ((double)(next(random) >> 10) * 0x1p-53 - 1);
}

// Pairs of special arguments come first.
static void choose(const struct part* p, int i, uint64_t* random, double* x, double* y) {
  const bool is_special = i < SPECIAL * SPECIAL;
  *x = is_special ? special[i % SPECIAL] : argument(i, p->low, p->range, random);
  *y = is_special ? special[i / SPECIAL] : argument(i / 2, p->low, p->range, random);
}

// ---- Results ----

// Those of a NaN differ between CPUs.
static uint64_t bits_of(double x) {
  uint64_t bits = 0x7ff8000000000000;
  if (!isnan(x)) memcpy(&bits, &x, sizeof bits);
  return bits;
}

static uint64_t hash_of(const struct part* p, function* f) {
  uint64_t random = seed, hash = 0xcbf29ce484222325;
  for (int i = 0; i < RECORDED; ++i) {
    double x, y;
    choose(p, i, &random, &x, &y);
    hash = (hash ^ bits_of(f(x, y))) * 0x100000001b3;
  }
  return hash;
}

// sin(692) differs between the C library's variants.
static bool system_fuses(void) {
  volatile double angle = 692;
  return sin(angle) == 0x1.80869e3fad89ap-1;
}

// ---- Tests ----

static void test_as_recorded(void** state) {
  (void)state;
  FILE* file = fopen(PROJECT_FOLDER "/tests/math/recorded.txt", "r");
  assert_non_null(file);
  assert_int_equal(fscanf(file, "#%*[^\n]"), 0);
  for (int i = 0; i < PARTS; ++i) {
    char name[16];
    double low, range;
    uint64_t recorded;
    assert_int_equal(fscanf(file, "%15s %lf %lf %" SCNx64, name, &low, &range, &recorded), 4);
    assert_string_equal(name, parts[i].name);
    assert_true(low == parts[i].low && range == parts[i].range);
    if (hash_of(&parts[i], parts[i].ours) != recorded) fail_msg("%s(%g +- %g) is not as recorded", name, low, range);
    if (hash_of(&parts[i], parts[i].soft) != recorded) fail_msg("%s(%g +- %g) differs without FMA", name, low, range);
  }
  fclose(file);
}

#if !defined(_WIN32)  // which has a C library of its own

// Where the C library has other functions than those that were recorded, it says nothing.
static void test_as_in_the_c_library(void** state) {
  (void)state;
  if (!system_fuses()) return;
  for (const struct part* p = parts; p < parts + PARTS; ++p) {
    uint64_t random = seed;
    for (int i = 0; i < ARGUMENTS; ++i) {
      double x, y;
      choose(p, i, &random, &x, &y);
      const double result = p->ours(x, y), expected = p->system(x, y);
      if (bits_of(result) != bits_of(expected)) fail_msg("%s(%a, %a) is %a, not %a", p->name, x, y, result, expected);
    }
  }
}

// Doubles of all kinds, or with a sum that cancels, is subnormal, or lies just beside the middle of two doubles.
static void choose_for_fma(int i, uint64_t* random, double* a, double* b, double* c) {
  const double x = (double)next(random), y = (double)next(random), z = (double)(int64_t)next(random);
  switch (i % 5) {
    case 0: *a = of_bits(next(random)), *b = of_bits(next(random)), *c = of_bits(next(random)); return;
    case 1: *a = x, *b = y, *c = nextafter(-x * y, z); return;
    case 2: *a = x, *b = y, *c = -x * y + ldexp(z, (int)(next(random) % 130) - 65); return;
    case 3:
      *a = ldexp(x, -500), *b = ldexp(y, -600 - (int)(next(random) % 100)),
      *c = ldexp(z, -1100 - (int)(next(random) % 40));
      return;
    default: *a = ldexp(1, (int)(next(random) % 80) - 40), *b = x, *c = z;
  }
}

double mjenv_fma(double, double, double);
#if defined(__x86_64__)
double mjenv_fma_soft(double, double, double);
#else
#define mjenv_fma_soft mjenv_fma
#endif

static void test_fma_as_in_the_c_library(void** state) {
  (void)state;
  uint64_t random = seed;
  for (int i = 0; i < SPECIAL * SPECIAL * SPECIAL + ARGUMENTS; ++i) {
    const int k = i - SPECIAL * SPECIAL * SPECIAL;
    double a = special[i % SPECIAL], b = special[i / SPECIAL % SPECIAL], c = special[i / SPECIAL / SPECIAL % SPECIAL];
    if (k >= 0) choose_for_fma(k, &random, &a, &b, &c);
    const double expected = fma(a, b, c), ours[] = {mjenv_fma(a, b, c), mjenv_fma_soft(a, b, c)};
    for (int soft = 0; soft < 2; ++soft)
      if (bits_of(ours[soft]) != bits_of(expected))
        fail_msg("fma(%a, %a, %a) is %a, not %a", a, b, c, ours[soft], expected);
  }
}

#endif

void mjenv_qsort_r(void*, size_t, size_t, int (*)(const void*, const void*, void*), void*);
void mjenv_qsort(void*, size_t, size_t, int (*)(const void*, const void*));

struct item {
  int key, place;
};

static int by_key(const void* a, const void* b) { return ((const struct item*)a)->key - ((const struct item*)b)->key; }

static int by_key_times(const void* a, const void* b, void* sign) { return *(int*)sign * by_key(a, b); }

static void test_stable_sorting(void** state) {
  (void)state;
  uint64_t random = seed;
  struct item items[1000];
  for (int count = 0; count < 1000; count = count < 40 ? count + 1 : count + 97)
    for (int sign = -1; sign <= 1; ++sign) {
      for (int i = 0; i < count; ++i) items[i] = (struct item){(int)(next(&random) % 10), i};
      if (sign == 0)
        mjenv_qsort(items, (size_t)count, sizeof *items, by_key);
      else
        mjenv_qsort_r(items, (size_t)count, sizeof *items, by_key_times, &sign);
      for (int i = 1; i < count; ++i) {
        const int order = (sign < 0 ? -1 : 1) * (items[i].key - items[i - 1].key);
        assert_true(order > 0 || (order == 0 && items[i].place > items[i - 1].place));
      }
    }
}

// Prints recorded.txt: what the C library's functions give.
static int record(void) {
  if (!system_fuses()) return 1;
  puts("# FUNCTION LOW RANGE HASH: of glibc 2.36 on a CPU with FMA; test_math record prints this");
  for (const struct part* p = parts; p < parts + PARTS; ++p)
    printf("%s %g %g %016" PRIx64 "\n", p->name, p->low, p->range, hash_of(p, p->system));
  return 0;
}

int main(int argc, char** argv) {
  if (argc == 2 && strcmp(argv[1], "record") == 0) return record();
  const struct CMUnitTest tests[] = {
    cmocka_unit_test(test_as_recorded),
    cmocka_unit_test(test_stable_sorting),
#if !defined(_WIN32)
    cmocka_unit_test(test_as_in_the_c_library),
    cmocka_unit_test(test_fma_as_in_the_c_library),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
