// The functions of mjenv_task_api do not throw, because their callers may be C.
#include "task/api.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <exception>
#include <new>

#include "error.hpp"
#include "task/builder.hpp"
#include "task/random.hpp"

namespace mjenv::core {
namespace {

// A plain array, because the destructor of a std::string would run when the thread ends, maybe after the library was
// unloaded.
thread_local std::array<char, 1024> message{};

std::int32_t fail_with(const char* text) {
  set_task_message(text ? text : "");
  return 1;
}

// ---- Functions for build ----

std::string required_text(const char* value, const char* what) {
  if (!value) fail(MJENV_E_ARGUMENT, std::string(what) + " is NULL");
  return value;
}

Builder& cast(mjenv_builder* builder) { return *static_cast<Builder*>(builder); }
std::string name_of(const char* option) { return required_text(option, "an option's name"); }

std::int64_t integer(mjenv_builder* builder, const char* option) {
  return cast(builder).attempt(std::int64_t{0}, [&] { return cast(builder).integer(name_of(option)); });
}

void reals(mjenv_builder* builder, const char* option, double* values, std::int64_t count) {
  cast(builder).attempt([&] {
    if (!values) fail(MJENV_E_ARGUMENT, "values is NULL");
    cast(builder).reals(name_of(option), values, count);
  });
}

std::int32_t is_integer(mjenv_builder* builder, const char* option) {
  return cast(builder).attempt(0, [&] { return cast(builder).is_integer(name_of(option)) ? 1 : 0; });
}

const char* text(mjenv_builder* builder, const char* option) {
  return cast(builder).attempt("", [&] { return cast(builder).text(name_of(option)); });
}

std::int32_t index(mjenv_builder* builder, const char* type, const char* name) {
  return cast(builder).attempt(
      0, [&] { return cast(builder).index(required_text(type, "type"), required_text(name, "name")); });
}

std::int32_t option_index(mjenv_builder* builder, const char* option, const char* type) {
  return cast(builder).attempt(
      0, [&] { return cast(builder).option_index(name_of(option), required_text(type, "type")); });
}

std::int32_t norm_is_fused(mjenv_builder* builder) {
  return cast(builder).attempt(0, [&] { return cast(builder).norm().fused() ? 1 : 0; });
}

void need(mjenv_builder* builder, const char* array) {
  cast(builder).attempt([&] { cast(builder).need(required_text(array, "array")); });
}

std::int32_t array(mjenv_builder* builder, const char* name, mjenv_field* field) {
  return cast(builder).attempt(0, [&] { return cast(builder).array(required_text(name, "name"), field); });
}

void field(mjenv_builder* builder, const mjenv_task_field* given) {
  cast(builder).attempt([&] {
    if (!given) fail(MJENV_E_ARGUMENT, "field is NULL");
    cast(builder).describe(*given);
  });
}

void carry(mjenv_builder* builder, std::int64_t count) {
  cast(builder).attempt([&] { cast(builder).carry(count); });
}

void carry_bounds(mjenv_builder* builder, std::int64_t first, std::int64_t count, double low, double high) {
  cast(builder).attempt([&] { cast(builder).carry_bounds({first, count, low, high}); });
}

std::int64_t parameter(mjenv_builder* builder, const char* option) {
  return cast(builder).attempt(std::int64_t{0}, [&] { return cast(builder).parameter(name_of(option)); });
}

void keep(mjenv_builder* builder, std::int64_t first, std::int64_t count) {
  cast(builder).attempt([&] { cast(builder).keep({first, count}); });
}

void current(mjenv_builder* builder) {
  cast(builder).attempt([&] { cast(builder).need_current(); });
}

std::int32_t own(mjenv_builder* builder, const char* name) {
  return cast(builder).attempt(0, [&] { return cast(builder).need_own(required_text(name, "name")); });
}

void action(mjenv_builder* builder, std::int64_t count, const double* low, const double* high) {
  cast(builder).attempt([&] { cast(builder).action(count, low, high); });
}

void random_state(mjenv_builder* builder) {
  cast(builder).attempt([&] { cast(builder).need_random_state(); });
}

// ---- Functions for the random stream ----

Random& cast(mjenv_random* random) { return *static_cast<Random*>(random); }

// Records why a draw or a simulation failed, so that the callback fails. Reasons: NumPy would refuse the arguments,
// MuJoCo failed, the callback must not call the function, or memory or entropy was lacking.
template <typename T>
T refuse_draw(mjenv_random* random, const char* why, T fallback, mjenv_status status = MJENV_E_TASK) {
  if (cast(random).failure == MJENV_OK) {
    set_task_message(why);
    cast(random).failure = status;
  }
  return fallback;
}

// Returns what draw(rng) returns. A draw throws if there is no memory, or no entropy to seed the stream.
template <typename Draw>
auto attempt(mjenv_random* random, const Draw& draw) -> decltype(draw(cast(random).rng())) {
  using T = decltype(draw(cast(random).rng()));
  try {
    return draw(cast(random).rng());
  } catch (const std::bad_alloc&) {
    return refuse_draw(random, "out of memory", T{}, MJENV_E_MEMORY);
  } catch (const std::exception& error) {
    return refuse_draw(random, error.what(), T{});
  }
}

double random_real(mjenv_random* random) {
  return attempt(random, [](Rng& rng) { return rng.random(); });
}

double uniform(mjenv_random* random, double low, double high) {
  if (!std::isfinite(high - low)) return refuse_draw(random, "uniform: high - low is not finite", low);
  // NumPy also refuses a difference of -0, which low = 0 and high = -0 give.
  if (std::signbit(high - low)) return refuse_draw(random, "uniform: high is below low", low);
  return attempt(random, [&](Rng& rng) { return rng.uniform(low, high); });
}

double normal(mjenv_random* random) {
  return attempt(random, [](Rng& rng) { return rng.normal(); });
}

std::int64_t integers(mjenv_random* random, std::int64_t low, std::int64_t high) {
  if (low >= high) return refuse_draw(random, "integers: low is not below high", low);
  return attempt(random, [&](Rng& rng) { return rng.integers(low, high); });
}

// Returns why NumPy would refuse the probabilities p, or null if it accepts them.
const char* bad_probabilities(std::int64_t count, const double* p) {
  double sum = 0, lost = 0;  // as NumPy checks it: Kahan summation, and sqrt(eps) as the tolerance
  for (std::int64_t i = 0; i < count; ++i) {
    if (!(p[i] >= 0)) return "choice: a probability is negative or NaN";
    const double term = p[i] - lost, total = sum + term;
    lost = (total - sum) - term;
    sum = total;
  }
  return std::fabs(sum - 1) <= 0x1p-26 ? nullptr : "choice: the sum of p is not 1";
}

std::int64_t choice(mjenv_random* random, std::int64_t count, const double* p) {
  if (count < 1) return refuse_draw(random, "choice: count is less than 1", std::int64_t{0});
  if (const char* why = p ? bad_probabilities(count, p) : nullptr) return refuse_draw(random, why, std::int64_t{0});
  return attempt(random, [&](Rng& rng) { return rng.choice(count, p); });
}

void sample(mjenv_random* random, std::int64_t count, std::int64_t size, std::int64_t* chosen) {
  if (size < 0 || size > count)
    refuse_draw(random, "sample: size is negative or larger than count", 0);
  else
    attempt(random, [&](Rng& rng) { return rng.sample(count, size, chosen), 0; });
}

void permutation(mjenv_random* random, std::int64_t count, std::int64_t* order) {
  if (count > 0) attempt(random, [&](Rng& rng) { return rng.permutation(count, order), 0; });
}

// ---- RandomState ----

constexpr std::int64_t kMaxChoices = std::int64_t{1} << 32;  // a draw of RandomState has 32 bits

template <typename T, typename Draw>
T attempt_state(mjenv_random* random, T fallback, const Draw& draw) {
  np::RandomState* state = cast(random).state;
  if (!state)
    return refuse_draw(random,
                       "RandomState: only the reset of a task that called mjenv_build_random_state can draw from it",
                       fallback);
  return draw(*state);
}

double state_rand(mjenv_random* random) {
  return attempt_state(random, 0.0, [](auto& state) { return state.rand(); });
}

double state_uniform(mjenv_random* random, double low, double high) {
  if (!std::isfinite(high - low)) return refuse_draw(random, "uniform: Range exceeds valid bounds", low);
  return attempt_state(random, low, [&](auto& state) { return state.uniform(low, high); });
}

double state_randn(mjenv_random* random) {
  return attempt_state(random, 0.0, [](auto& state) { return state.randn(); });
}

std::int64_t state_randint(mjenv_random* random, std::int64_t low, std::int64_t high) {
  if (low >= high) return refuse_draw(random, "randint: low >= high", low);
  if (static_cast<std::uint64_t>(high) - static_cast<std::uint64_t>(low) > kMaxChoices)
    return refuse_draw(random, "randint: high - low is more than 2^32", low);
  return attempt_state(random, low, [&](auto& state) { return state.randint(low, high); });
}

std::int64_t state_choice(mjenv_random* random, std::int64_t count, const double* p) {
  if (count < 1 || count > kMaxChoices) return refuse_draw(random, "choice: count is not 1 to 2^32", std::int64_t{0});
  if (const char* why = p ? bad_probabilities(count, p) : nullptr) return refuse_draw(random, why, std::int64_t{0});
  return attempt_state(random, std::int64_t{0}, [&](auto& state) { return state.choice(count, p); });
}

void state_permutation(mjenv_random* random, std::int64_t count, std::int64_t* order) {
  if (count < 0 || count > kMaxChoices)
    refuse_draw(random, "permutation: count is not 0 to 2^32", 0);
  else
    attempt_state(random, 0, [&](auto& state) { return state.permutation(count, order), 0; });
}

std::int32_t state_is_new(mjenv_random* random) {
  return attempt_state(random, 0, [](auto& state) { return state.is_new() ? 1 : 0; });
}

// ---- Functions for reset ----

// Calls body. If MuJoCo fails, so does the callback.
template <typename Body>
std::int32_t attempt_simulation(mjenv_random* random, const Body& body) {
  try {
    return body(), 0;
  } catch (const std::bad_alloc&) {
    return refuse_draw(random, "out of memory", 1, MJENV_E_MEMORY);
  } catch (const std::exception& error) {
    return refuse_draw(random, error.what(), 1);
  }
}

// Calls body with the simulation in which the reset runs.
template <typename Body>
std::int32_t simulate(mjenv_start* start, const Body& body) {
  ResetSimulation* simulation = static_cast<SimulatingStart*>(start)->simulation;
  if (!simulation)
    return refuse_draw(start->random, "only tasks that call mjenv_build_current can simulate in reset", 1);
  return attempt_simulation(start->random, [&] {
    simulation->take_own();
    body(*simulation);
    simulation->view.complete();
  });
}

std::int32_t forward(mjenv_start* start) {
  return simulate(start, [](auto& simulation) { simulation.work.forward(); });
}

std::int32_t advance(mjenv_start* start, std::int64_t count) {
  if (count < 1) return refuse_draw(start->random, "advance: count is less than 1", 1);
  return simulate(start, [&](auto& simulation) { simulation.work.simulate(count); });
}

std::int32_t restart(mjenv_start* start) {
  return simulate(start, [](auto& simulation) {
    simulation.work.clear();
    simulation.work.forward();
  });
}

std::int64_t contact_count(mjenv_start* start) {
  std::int64_t count = 0;
  simulate(start, [&](auto& simulation) { count = simulation.work.contact_count(); });
  return count;
}

std::int32_t control_forward(mjenv_control* control) {
  Work* work = static_cast<WorkingControl*>(control)->work;
  if (!work)
    return refuse_draw(control->random, "only before_step can call mj_forward, and not of tasks that see the new state",
                       1);
  return attempt_simulation(control->random, [&] { work->forward_first(); });
}

// clang-format off
constexpr mjenv_task_api api{
    sizeof(mjenv_task_api), MJENV_ABI_VERSION, fail_with, integer, reals, is_integer, text, index, option_index,
    norm_is_fused, need, array, field, carry, carry_bounds, random_real, uniform, normal, integers, choice, sample,
    permutation, parameter, keep, current, own, random_state, forward, advance, restart, contact_count, state_rand,
    state_uniform, state_randn, state_randint, state_choice, state_is_new, action,
    state_permutation, control_forward};
// clang-format on

}  // namespace

const mjenv_task_api& task_api() { return api; }
Random::Random(const Rng* stream) : mjenv_random{sizeof(mjenv_random), 0, &task_api()}, stream_(stream) {}

void Random::copy() {
  rng_ = stream_ ? *stream_ : Rng::from_entropy();
  drew_ = true;
}

const char* task_message() { return message.data(); }
void clear_task_message() { message[0] = '\0'; }

void set_task_message(const char* text) {
  const auto continues_character = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; };  // in UTF-8
  std::size_t length = std::min(std::strlen(text), message.size() - 1);
  while (length > 0 && continues_character(text[length])) --length;
  std::memcpy(message.data(), text, length);
  message[length] = '\0';
}

}  // namespace mjenv::core
