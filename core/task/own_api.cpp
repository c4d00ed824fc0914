// The functions that callbacks may call. No exception leaves them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "error.hpp"
#include "task/own_build.hpp"
#include "task/own_task.hpp"

namespace mjenv::core {
namespace {

// Plain memory, so that an unloaded library leaves no destructor behind.
thread_local std::array<char, 1024> message{};

std::int32_t fail_with(const char* text) {
  set_task_message(text ? text : "");
  return 1;
}

// ---- in build ----

std::string text_of(const char* value, const char* what) {
  if (!value) fail(MJENV_E_ARGUMENT, std::string(what) + " is NULL");
  return value;
}

OwnBuild& of(mjenv_builder* builder) { return *static_cast<OwnBuild*>(builder); }

std::int64_t integer(mjenv_builder* builder, const char* option) {
  return of(builder).attempt(std::int64_t{0}, [&] { return of(builder).integer(text_of(option, "an option's name")); });
}

void reals(mjenv_builder* builder, const char* option, double* values, std::int64_t count) {
  of(builder).attempt(0, [&] {
    if (!values) fail(MJENV_E_ARGUMENT, "values is NULL");
    of(builder).reals(text_of(option, "an option's name"), values, count);
    return 0;
  });
}

std::int32_t is_integer(mjenv_builder* builder, const char* option) {
  return of(builder).attempt(0, [&] { return of(builder).is_integer(text_of(option, "an option's name")) ? 1 : 0; });
}

const char* text(mjenv_builder* builder, const char* option) {
  return of(builder).attempt("", [&] { return of(builder).text(text_of(option, "an option's name")); });
}

std::int32_t index(mjenv_builder* builder, const char* type, const char* name) {
  return of(builder).attempt(0, [&] { return of(builder).index(text_of(type, "type"), text_of(name, "name")); });
}

std::int32_t option_index(mjenv_builder* builder, const char* option, const char* type) {
  return of(builder).attempt(
      0, [&] { return of(builder).option_index(text_of(option, "an option's name"), text_of(type, "type")); });
}

std::int32_t norm_is_fused(mjenv_builder* builder) {
  return of(builder).attempt(0, [&] { return of(builder).norm().fused() ? 1 : 0; });
}

void need(mjenv_builder* builder, const char* array) {
  of(builder).attempt(0, [&] {
    of(builder).need(text_of(array, "array"));
    return 0;
  });
}

std::int32_t array(mjenv_builder* builder, const char* name, mjenv_field* field) {
  return of(builder).attempt(0, [&] { return of(builder).array(text_of(name, "name"), field); });
}

void field(mjenv_builder* builder, const mjenv_task_field* given) {
  of(builder).attempt(0, [&] {
    if (!given) fail(MJENV_E_ARGUMENT, "field is NULL");
    of(builder).describe(*given);
    return 0;
  });
}

void carry(mjenv_builder* builder, std::int64_t count) {
  of(builder).attempt(0, [&] {
    of(builder).carry(count);
    return 0;
  });
}

// ---- the random stream ----

OwnRandom& of(mjenv_random* random) { return *static_cast<OwnRandom*>(random); }

// A draw that NumPy refuses fails the callback.
template <typename T>
T impossible(mjenv_random* random, const char* why, T otherwise) {
  if (!of(random).failed) set_task_message(why);
  of(random).failed = true;
  return otherwise;
}

double random_real(mjenv_random* random) { return of(random).rng.random(); }

double uniform(mjenv_random* random, double low, double high) {
  if (!std::isfinite(high - low)) return impossible(random, "uniform: the range is not finite", low);
  return of(random).rng.uniform(low, high);
}

double normal(mjenv_random* random) { return of(random).rng.normal(); }

std::int64_t integers(mjenv_random* random, std::int64_t low, std::int64_t high) {
  if (low >= high) return impossible(random, "integers: low is not below high", low);
  return of(random).rng.integers(low, high);
}

std::int64_t choice(mjenv_random* random, std::int64_t count, const double* p) {
  if (count < 1) return impossible(random, "choice: nothing to choose from", std::int64_t{0});
  if (p) {
    double sum = 0, lost = 0;  // as NumPy: Kahan's sum, to the square root of the precision
    for (std::int64_t i = 0; i < count; ++i) {
      if (!(p[i] >= 0)) return impossible(random, "choice: a probability is negative or NaN", std::int64_t{0});
      const double term = p[i] - lost, total = sum + term;
      lost = (total - sum) - term;
      sum = total;
    }
    if (!(std::fabs(sum - 1) <= 0x1p-26)) return impossible(random, "choice: the sum of p is not 1", std::int64_t{0});
  }
  return of(random).rng.choice(count, p);
}

void sample(mjenv_random* random, std::int64_t count, std::int64_t size, std::int64_t* chosen) {
  if (size < 0 || size > count) {
    impossible(random, "sample: more numbers than there are", 0);
    return;
  }
  try {
    of(random).rng.sample(count, size, chosen);
  } catch (const std::exception&) {
    impossible(random, "sample: out of memory", 0);
  }
}

void permutation(mjenv_random* random, std::int64_t count, std::int64_t* order) {
  if (count > 0) of(random).rng.permutation(count, order);
}

constexpr mjenv_task_api api{sizeof(mjenv_task_api),
                             MJENV_ABI_VERSION,
                             fail_with,
                             integer,
                             reals,
                             is_integer,
                             text,
                             index,
                             option_index,
                             norm_is_fused,
                             need,
                             array,
                             field,
                             carry,
                             random_real,
                             uniform,
                             normal,
                             integers,
                             choice,
                             sample,
                             permutation};

}  // namespace

const mjenv_task_api& task_api() { return api; }

const char* task_message() { return message.data(); }

void set_task_message(const char* text) {
  const std::size_t length = std::min(std::strlen(text), message.size() - 1);
  std::memcpy(message.data(), text, length);
  message[length] = '\0';
}

}  // namespace mjenv::core
