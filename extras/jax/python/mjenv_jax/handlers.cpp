// XLA's custom calls (the stable FFI) that reset and step environments of mjenv, without Python between the steps.
#include <xla/ffi/api/ffi.h>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "mjenv/mjenv.h"

namespace ffi = xla::ffi;

namespace {

// An environment that a compiled program can name by a number. The functions are those of the engine that made it.
struct Environment {
  mjenv_env* env;
  std::int64_t rows, obs_count, info_count, action_count;
  decltype(&mjenv_seed) seed;
  decltype(&mjenv_reset) reset;
  decltype(&mjenv_step) step;
  decltype(&mjenv_begin) begin;
  decltype(&mjenv_advance) advance;
  decltype(&mjenv_finish) finish;
  decltype(&mjenv_error_of) error_of;
  std::int64_t arrays_count, qpos_count, qvel_count, given_count;
};

struct Held {
  Environment environment;
  std::int32_t turn = 0;  // how many calls have changed it
  std::mutex busy;
  std::vector<double> reward, info, arrays, given;
  std::vector<std::uint8_t> terminated, truncated, was_reset;
};

std::mutex registry_mutex;
std::map<std::int32_t, std::shared_ptr<Held>> registry;

std::shared_ptr<Held> held(std::int32_t number) {
  const std::lock_guard lock(registry_mutex);
  const auto found = registry.find(number);
  return found == registry.end() ? nullptr : found->second;
}

ffi::Error failed(const Environment& e) {
  std::int64_t size = 0;
  e.error_of(e.env, nullptr, 0, &size);
  std::string text(static_cast<std::size_t>(std::max<std::int64_t>(size, 1)), '\0');
  e.error_of(e.env, text.data(), size, &size);
  return ffi::Error::Internal("mjenv: " + std::string(text.c_str()));
}

bool is_real(ffi::DataType type) { return type == ffi::DataType::F32 || type == ffi::DataType::F64; }
mjenv_dtype dtype_of(ffi::DataType type) {
  return type == ffi::DataType::F32 ? MJENV_DTYPE_FLOAT32 : MJENV_DTYPE_FLOAT64;
}

// Copies doubles into a buffer of float32 or float64.
void put(const std::vector<double>& from, ffi::AnyBuffer to) {
  if (to.element_type() == ffi::DataType::F64)
    std::copy(from.begin(), from.end(), to.typed_data<double>());
  else
    std::transform(from.begin(), from.end(), to.typed_data<float>(), [](double x) { return static_cast<float>(x); });
}

std::vector<double> doubles(ffi::AnyBuffer from) {
  const std::size_t count = from.element_count();
  if (from.element_type() == ffi::DataType::F64) return {from.typed_data<double>(), from.typed_data<double>() + count};
  return {from.typed_data<float>(), from.typed_data<float>() + count};
}

using Handle = ffi::Buffer<ffi::S32>;  // number and turn
using Any = ffi::AnyBuffer;
using ToHandle = ffi::Result<ffi::Buffer<ffi::S32>>;
using To = ffi::Result<ffi::AnyBuffer>;
using ToFlags = ffi::Result<ffi::Buffer<ffi::PRED>>;

mjenv_batch batch_of(Held& h) {
  const Environment& e = h.environment;
  const auto rows = static_cast<std::size_t>(e.rows);
  mjenv_batch batch{};
  batch.struct_size = sizeof batch;
  batch.rows = e.rows, batch.obs_count = e.obs_count, batch.info_count = e.info_count;
  batch.arrays_count = e.arrays_count;
  h.reward.resize(rows), h.info.resize(rows * static_cast<std::size_t>(e.info_count));
  h.terminated.resize(rows), h.truncated.resize(rows), h.was_reset.resize(rows);
  batch.reward = h.reward.data(), batch.info = e.info_count ? h.info.data() : nullptr;
  batch.terminated = h.terminated.data(), batch.truncated = h.truncated.data(), batch.was_reset = h.was_reset.data();
  return batch;
}

// Calls body with the environment of a handle, whose turn it must be, and writes the next handle.
template <typename Body>
ffi::Error with(Handle handle, bool any_turn, ToHandle next, const Body& body) {
  if (handle.element_count() != 2) return ffi::Error::InvalidArgument("mjenv: a handle has 2 numbers");
  const std::int32_t number = handle.typed_data()[0], turn = handle.typed_data()[1];
  const std::shared_ptr<Held> found = held(number);
  if (!found) return ffi::Error::InvalidArgument("mjenv: this environment was closed");
  const std::lock_guard lock(found->busy);
  if (!any_turn && turn != found->turn)
    return ffi::Error::InvalidArgument("mjenv: this handle is that of turn " + std::to_string(turn) +
                                       ", but the environment is at turn " + std::to_string(found->turn) +
                                       ": use the handle that the last call has returned");
  ffi::Error error = body(*found);
  if (error.failure()) return error;
  ++found->turn;
  next->typed_data()[0] = number, next->typed_data()[1] = found->turn;
  return error;
}

bool holds(const Any& buffer, std::int64_t count) {
  return is_real(buffer.element_type()) && buffer.element_count() == static_cast<std::size_t>(count);
}

const char* const kShapes = "mjenv: this program was compiled for another environment: an array has another shape";

ffi::Error reset(Handle handle, ffi::Buffer<ffi::U32> seeds, ToHandle next, To obs) {
  return with(handle, true, next, [&](Held& h) {
    const Environment& e = h.environment;
    if (!holds(*obs, e.rows * e.obs_count) || seeds.element_count() != static_cast<std::size_t>(e.rows))
      return ffi::Error::InvalidArgument(kShapes);
    const std::vector<std::uint64_t> words(seeds.typed_data(), seeds.typed_data() + e.rows);
    mjenv_batch batch = batch_of(h);
    batch.obs_dtype = dtype_of(obs->element_type()), batch.obs = obs->untyped_data();
    if (e.seed(e.env, nullptr, words.data(), e.rows) || e.reset(e.env, nullptr, &batch)) return failed(e);
    return ffi::Error::Success();
  });
}

void put_results(Held& h, To reward, ToFlags terminated, ToFlags truncated, ToFlags was_reset, To info) {
  put(h.reward, *reward);
  put(h.info, *info);
  std::copy(h.terminated.begin(), h.terminated.end(), terminated->typed_data());
  std::copy(h.truncated.begin(), h.truncated.end(), truncated->typed_data());
  std::copy(h.was_reset.begin(), h.was_reset.end(), was_reset->typed_data());
}

ffi::Error step(Handle handle, Any action, ToHandle next, To obs, To reward, ToFlags terminated, ToFlags truncated,
                ToFlags was_reset, To info) {
  return with(handle, false, next, [&](Held& h) {
    const Environment& e = h.environment;
    if (!holds(action, e.rows * e.action_count) || !holds(*obs, e.rows * e.obs_count) || !holds(*reward, e.rows) ||
        !holds(*info, e.rows * e.info_count))
      return ffi::Error::InvalidArgument(kShapes);
    mjenv_batch batch = batch_of(h);
    batch.obs_dtype = dtype_of(obs->element_type()), batch.obs = obs->untyped_data();
    if (e.step(e.env, nullptr, action.untyped_data(), static_cast<std::int64_t>(action.element_count()),
               dtype_of(action.element_type()), &batch))
      return failed(e);
    put_results(h, reward, terminated, truncated, was_reset, info);
    return ffi::Error::Success();
  });
}

// The first half of a reset of rows.
ffi::Error begin(Handle handle, ffi::Buffer<ffi::PRED> mask, Any qpos, Any qvel, ToHandle next, To arrays) {
  return with(handle, false, next, [&](Held& h) {
    const Environment& e = h.environment;
    if (!holds(qpos, e.rows * e.qpos_count) || !holds(qvel, e.rows * e.qvel_count) ||
        !holds(*arrays, e.rows * e.arrays_count) || mask.element_count() != static_cast<std::size_t>(e.rows))
      return ffi::Error::InvalidArgument(kShapes);
    const std::vector<double> q = doubles(qpos), v = doubles(qvel);
    const std::vector<std::uint8_t> rows(mask.typed_data(), mask.typed_data() + e.rows);
    mjenv_batch batch = batch_of(h);
    h.arrays.resize(static_cast<std::size_t>(e.rows * e.arrays_count));
    batch.arrays = e.arrays_count ? h.arrays.data() : nullptr;
    // Without a row to begin, the arrays stay as they are.
    if (std::any_of(rows.begin(), rows.end(), [](std::uint8_t chosen) { return chosen != 0; }) &&
        e.begin(e.env, rows.data(), q.data(), e.rows * e.qpos_count, v.data(), e.rows * e.qvel_count, &batch))
      return failed(e);
    put(h.arrays, *arrays);
    return ffi::Error::Success();
  });
}

// The first half of a step.
ffi::Error advance(Handle handle, Any action, ToHandle next, To arrays, ToFlags was_reset) {
  return with(handle, false, next, [&](Held& h) {
    const Environment& e = h.environment;
    if (!holds(action, e.rows * e.action_count) || !holds(*arrays, e.rows * e.arrays_count) ||
        was_reset->element_count() != static_cast<std::size_t>(e.rows))
      return ffi::Error::InvalidArgument(kShapes);
    mjenv_batch batch = batch_of(h);
    h.arrays.resize(static_cast<std::size_t>(e.rows * e.arrays_count));
    batch.arrays = e.arrays_count ? h.arrays.data() : nullptr;
    if (e.advance(e.env, nullptr, action.untyped_data(), static_cast<std::int64_t>(action.element_count()),
                  dtype_of(action.element_type()), nullptr, 0, &batch))
      return failed(e);
    put(h.arrays, *arrays);
    std::copy(h.was_reset.begin(), h.was_reset.end(), was_reset->typed_data());
    return ffi::Error::Success();
  });
}

// The second half of both.
ffi::Error finish(Handle handle, Any given_obs, Any given_reward, ffi::Buffer<ffi::PRED> given_terminated,
                  ToHandle next, To obs, To reward, ToFlags terminated, ToFlags truncated, ToFlags was_reset, To info) {
  return with(handle, false, next, [&](Held& h) {
    const Environment& e = h.environment;
    if (!holds(given_obs, e.rows * e.given_count) || !holds(given_reward, e.rows) || !holds(*reward, e.rows) ||
        given_terminated.element_count() != static_cast<std::size_t>(e.rows) || !holds(*obs, e.rows * e.obs_count) ||
        !holds(*info, e.rows * e.info_count))
      return ffi::Error::InvalidArgument(kShapes);
    h.given = doubles(given_reward);
    std::vector<std::uint8_t> ended(given_terminated.typed_data(), given_terminated.typed_data() + e.rows);
    mjenv_batch given{};
    given.struct_size = sizeof given;
    given.rows = e.rows, given.obs_count = e.given_count;
    given.obs_dtype = dtype_of(given_obs.element_type()), given.obs = given_obs.untyped_data();
    given.reward = h.given.data(), given.terminated = ended.data();
    mjenv_batch batch = batch_of(h);
    batch.obs_dtype = dtype_of(obs->element_type()), batch.obs = obs->untyped_data();
    if (e.finish(e.env, nullptr, &given, &batch)) return failed(e);
    put_results(h, reward, terminated, truncated, was_reset, info);
    return ffi::Error::Success();
  });
}

}  // namespace

#define RESULTS \
  .Ret<ffi::AnyBuffer>().Ret<ffi::AnyBuffer>().Ret<FLAGS>().Ret<FLAGS>().Ret<FLAGS>().Ret<ffi::AnyBuffer>()
#define FLAGS ffi::Buffer<ffi::PRED>
#define HANDLE ffi::Buffer<ffi::S32>
XLA_FFI_DEFINE_HANDLER_SYMBOL(
    mjenv_jax_reset, reset,
    ffi::Ffi::Bind().Arg<HANDLE>().Arg<ffi::Buffer<ffi::U32>>().Ret<HANDLE>().Ret<ffi::AnyBuffer>());
XLA_FFI_DEFINE_HANDLER_SYMBOL(mjenv_jax_step, step,
                              ffi::Ffi::Bind().Arg<HANDLE>().Arg<ffi::AnyBuffer>().Ret<HANDLE>() RESULTS);
XLA_FFI_DEFINE_HANDLER_SYMBOL(mjenv_jax_begin, begin,
                              ffi::Ffi::Bind()
                                  .Arg<HANDLE>()
                                  .Arg<FLAGS>()
                                  .Arg<ffi::AnyBuffer>()
                                  .Arg<ffi::AnyBuffer>()
                                  .Ret<HANDLE>()
                                  .Ret<ffi::AnyBuffer>());
XLA_FFI_DEFINE_HANDLER_SYMBOL(
    mjenv_jax_advance, advance,
    ffi::Ffi::Bind().Arg<HANDLE>().Arg<ffi::AnyBuffer>().Ret<HANDLE>().Ret<ffi::AnyBuffer>().Ret<FLAGS>());
XLA_FFI_DEFINE_HANDLER_SYMBOL(
    mjenv_jax_finish, finish,
    ffi::Ffi::Bind().Arg<HANDLE>().Arg<ffi::AnyBuffer>().Arg<ffi::AnyBuffer>().Arg<FLAGS>().Ret<HANDLE>() RESULTS);

// Gives an environment the next number.
extern "C" std::int32_t mjenv_jax_add(const Environment* environment) {
  static std::int32_t last = 0;
  auto added = std::make_shared<Held>();
  added->environment = *environment;
  const std::lock_guard lock(registry_mutex);
  registry[++last] = std::move(added);
  return last;
}

// Waits for a call under way.
extern "C" void mjenv_jax_remove(std::int32_t number) {
  const std::shared_ptr<Held> found = held(number);
  if (!found) return;
  const std::lock_guard busy(found->busy);
  const std::lock_guard lock(registry_mutex);
  registry.erase(number);
}
