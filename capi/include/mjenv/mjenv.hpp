/* mjenv.hpp - mjenv.h for C++17: handles that destroy themselves, exceptions, arrays of the right sizes.
 *
 * The header only calls the functions of mjenv.h, so it adds nothing to the binary interface. The comments of mjenv.h
 * say what each function does, with shapes, units, errors and threads. handle() returns the handle that these functions
 * take.
 *
 * Errors
 *   A call that fails throws mjenv::Error, which has the status and the reason. This header itself refuses:
 *     - a mask or a list of seeds whose length is not the number of rows (MJENV_E_SIZE),
 *     - a row that a Batch does not have, and an integer beyond int64_t (MJENV_E_VALUE),
 *     - a std::string with a NUL inside (MJENV_E_ARGUMENT),
 *     - a library with another MJENV_ABI_VERSION, when Options are created (MJENV_E_INTERNAL).
 *   Without exceptions (-fno-exceptions), functions with no other result return the status, and the others return an
 *   empty result when they fail. status() of Options returns the first failure, so that set() can be chained; status()
 *   of the other classes returns the status of the last call of a non-const method.
 * Moved-from objects may only be destroyed or assigned to. */
#ifndef MJENV_MJENV_HPP
#define MJENV_MJENV_HPP

#include <mjenv/mjenv.h>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace mjenv {

#if defined(__cpp_exceptions)

/* Why a call failed. */
class Error : public std::runtime_error {
 public:
  Error(mjenv_status code, const char *reason, std::size_t rows = 0)
      : std::runtime_error(reason), status(code), received(rows) {}
  const mjenv_status status;
  const std::size_t received; /* how many rows Env::recv has received although some of them failed */
};

/* Throws unless the status is MJENV_OK, which it returns. received: of the Error. */
inline mjenv_status check(mjenv_status status, std::size_t received = 0) {
  if (status != MJENV_OK) throw Error(status, mjenv_last_error(), received);
  return status;
}
inline mjenv_status refuse(mjenv_status status, const char *reason) { throw Error(status, reason); }

#else

inline mjenv_status check(mjenv_status status, std::size_t = 0) { return status; }
inline mjenv_status refuse(mjenv_status status, const char *) { return status; }

#endif

/* Calls the C function with the text. Refuses a NUL inside, because C would take it for the end of the text. */
template <typename Call>
mjenv_status with_text(const std::string &text, const Call &call) {
  if (text.find('\0') != std::string::npos) return refuse(MJENV_E_ARGUMENT, "a text has a NUL character inside");
  return check(call(text.c_str()));
}

/* A view of an array that somebody else owns, such as a vector: `size` elements at `data`. */
template <typename T>
class Span {
 public:
  Span(T *data, std::size_t size) : data_(data), size_(size) {}
  template <typename Container,
            typename Element = std::remove_pointer_t<decltype(std::data(std::declval<Container &>()))>,
            typename = std::enable_if_t<std::is_convertible_v<Element (*)[], T (*)[]>>>
  Span(Container &&container) : data_(std::data(container)), size_(std::size(container)) {}

  T *data() const { return data_; }
  std::size_t size() const { return size_; }
  T *begin() const { return data_; }
  T *end() const { return data_ + size_; }
  T &operator[](std::size_t i) const { return data_[i]; }

 private:
  T *data_;
  std::size_t size_;
};

/* The options of one environment id. */
class Options {
 public:
  /* The options of an id, with their default values. */
  explicit Options(const std::string &id) {
    status_ = mjenv_abi_version() == MJENV_ABI_VERSION
                  ? make([&](mjenv_options **made) {
                      return with_text(id, [&](const char *text) { return mjenv_options_create(text, made); });
                    })
                  : refuse(MJENV_E_INTERNAL, "libmjenv has another ABI version than this program was compiled for");
  }
  /* A copy of options that mjenv.h returned, such as an environment's (mjenv_options_of). */
  explicit Options(const mjenv_options *options) {
    status_ = make([&](mjenv_options **made) { return check(mjenv_options_copy(options, made)); });
  }
  Options(const Options &other) : status_(other.status_) {
    if (other.handle_)
      status_ = make([&](mjenv_options **made) { return check(mjenv_options_copy(other.handle(), made)); });
    if (status_ == MJENV_OK) status_ = other.status_;
  }
  Options &operator=(const Options &other) { return *this = Options(other); }
  Options(Options &&) = default;
  Options &operator=(Options &&) = default;

  /* Sets a flag, an integer, a single real, or a STRING_OR_INT to an index. The other overloads set real numbers and
   * texts. */
  template <typename Integer, typename = std::enable_if_t<std::is_integral_v<Integer>>>
  Options &set(const std::string &name, Integer value) {
    if (value > 0 && static_cast<std::uint64_t>(value) > std::numeric_limits<std::int64_t>::max())
      return keep(refuse(MJENV_E_VALUE, "an integer is at most 2^63 - 1"));
    return keep(with_text(name, [&](const char *text) {
      return mjenv_options_set_integer(handle(), text, static_cast<std::int64_t>(value));
    }));
  }
  Options &set(const std::string &name, double value) { return set(name, Span<const double>(&value, 1)); }
  Options &set(const std::string &name, std::initializer_list<double> values) {
    return set(name, Span<const double>(values.begin(), values.size()));
  }
  Options &set(const std::string &name, Span<const double> values) {
    return keep(with_text(
        name, [&](const char *text) { return mjenv_options_set_reals(handle(), text, values.data(), values.size()); }));
  }
  Options &set(const std::string &name, const std::string &value) {
    return keep(with_text(value, [&](const char *set_to) {
      return with_text(name, [&](const char *text) { return mjenv_options_set_string(handle(), text, set_to); });
    }));
  }
  Options &set(const std::string &name, const char *value) { return set(name, std::string(value)); }

  /* get_integer reads a flag, an integer, or an index; get_reals all numbers of an option; get_string a text. */
  std::int64_t get_integer(const std::string &name) {
    std::int64_t value = 0;
    keep(with_text(name, [&](const char *text) { return mjenv_options_get_integer(handle(), text, &value); }));
    return value;
  }
  std::vector<double> get_reals(const std::string &name) {
    std::vector<double> values;
    std::size_t count = 0;
    const auto get = [&](const char *text) {
      return mjenv_options_get_reals(handle(), text, values.data(), values.size(), &count);
    };
    keep(with_text(name, get));
    values.resize(count);
    if (count > 0) keep(with_text(name, get));
    return values;
  }
  std::string get_string(const std::string &name) {
    const char *value = "";
    keep(with_text(name, [&](const char *text) { return mjenv_options_get_string(handle(), text, &value); }));
    return value;
  }
  /* Describes all options. The texts in the result belong to these options. */
  std::vector<mjenv_option> describe() const {
    std::vector<mjenv_option> found(static_cast<std::size_t>(mjenv_options_count(handle())));
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i].struct_size = sizeof(mjenv_option);
      check(mjenv_options_at(handle(), static_cast<std::int64_t>(i), &found[i]));
    }
    return found;
  }

  mjenv_status status() const { return status_; }
  mjenv_options *handle() const { return handle_.get(); }

 private:
  struct Destroy {
    void operator()(mjenv_options *options) const { mjenv_options_destroy(options); }
  };
  std::unique_ptr<mjenv_options, Destroy> handle_;
  mjenv_status status_ = MJENV_OK;

  template <typename Create>
  mjenv_status make(const Create &create) {
    mjenv_options *made = nullptr;
    const mjenv_status result = create(&made);
    handle_.reset(made);
    return result;
  }
  Options &keep(mjenv_status result) {
    if (status_ == MJENV_OK) status_ = result;
    return *this;
  }
};

/* The arrays for the outputs of an environment, with the elements of mjenv_batch. Env::batch makes one for reset, step,
 * recv and observe; Env::rollout_batch makes one for rollout. */
struct Batch {
  std::size_t rows = 0;
  /* How many elements one row has. */
  std::size_t obs_count = 0, info_count = 0, reset_info_count = 0, arrays_count = 0;

  std::vector<double> obs, reward, info, reset_info, arrays;
  std::vector<double> final_obs, final_info; /* empty unless the option "autoreset_mode" is same_step */
  std::vector<std::uint8_t> terminated, truncated, was_reset;
  std::vector<std::int32_t> status;

  bool ended(std::size_t row) const { return has(row) && (terminated[row] || truncated[row]); }
  Span<const double> obs_of(std::size_t row) const { return part(obs, row); }
  Span<const double> final_obs_of(std::size_t row) const { return part(final_obs, row); }

  /* The same arrays as a mjenv_batch, for the functions of mjenv.h. Its pointers are valid until a vector is resized.
   */
  mjenv_batch raw() {
    mjenv_batch batch{};
    batch.struct_size = sizeof batch;
    batch.obs_dtype = MJENV_DTYPE_FLOAT64;
    batch.rows = static_cast<std::int64_t>(rows);
    batch.obs_count = static_cast<std::int64_t>(obs_count);
    batch.info_count = static_cast<std::int64_t>(info_count);
    batch.reset_info_count = static_cast<std::int64_t>(reset_info_count);
    batch.arrays_count = static_cast<std::int64_t>(arrays_count);
    batch.obs = obs.data();
    batch.reward = reward.data();
    batch.terminated = terminated.data();
    batch.truncated = truncated.data();
    batch.info = info.data();
    batch.status = status.data();
    batch.arrays = arrays.data();
    batch.was_reset = was_reset.data();
    batch.reset_info = reset_info.data();
    batch.final_obs = final_obs.data();
    batch.final_info = final_info.data();
    return batch;
  }

 private:
  bool has(std::size_t row) const {
    return row < rows || refuse(MJENV_E_VALUE, "the batch does not have this row") == MJENV_OK;
  }
  Span<const double> part(const std::vector<double> &from, std::size_t row) const {
    if (!has(row) || from.empty()) return {nullptr, 0};
    return {from.data() + row * obs_count, obs_count};
  }
};

/* An environment of one or many rows. */
class Env {
 public:
  explicit Env(const Options &options, std::int64_t rows = 1) : status_(options.status()) {
    mjenv_env *made = nullptr;
    if (status_ == MJENV_OK) status_ = check(mjenv_create(options.handle(), rows, &made));
    handle_.reset(made);
  }
  explicit Env(const std::string &id, std::int64_t rows = 1) : Env(Options(id), rows) {}

  /* ---- What it is ---- */

  std::size_t rows() const { return static_cast<std::size_t>(mjenv_rows(handle())); }
  std::size_t frame_skip() const { return static_cast<std::size_t>(mjenv_frame_skip(handle())); }
  /* How many rows each thread steps together; 0: each row is stepped alone. reason: why rows are stepped alone, "" if
   * none is. See mjenv_lanes. */
  struct Lanes {
    std::size_t count = 0;
    std::string reason;
  };
  Lanes lanes() {
    std::int64_t found = 0;
    const char *reason = "";
    keep(check(mjenv_lanes(handle(), &found, &reason)));
    return {static_cast<std::size_t>(found), reason};
  }
  /* A copy of the options that the environment was built with. */
  Options options() const { return Options(mjenv_options_of(handle())); }
  mjenv_space space(mjenv_role role) const {
    mjenv_space found{};
    found.struct_size = sizeof found;
    check(mjenv_space_of(handle(), role, &found));
    return found;
  }
  std::vector<mjenv_field> fields(mjenv_role role) const {
    std::vector<mjenv_field> found(static_cast<std::size_t>(mjenv_field_count(handle(), role)));
    for (std::size_t i = 0; i < found.size(); ++i) {
      found[i].struct_size = sizeof(mjenv_field);
      check(mjenv_field_at(handle(), role, static_cast<std::int64_t>(i), &found[i]));
    }
    return found;
  }
  /* The sum of the counts of a role's fields: how many elements one row has. */
  std::size_t count(mjenv_role role) const {
    std::int64_t total = 0;
    for (const mjenv_field &field : fields(role)) total += field.count;
    return static_cast<std::size_t>(total);
  }
  std::int64_t object_count(const std::string &type) {
    std::int64_t found = 0;
    keep(with_text(type, [&](const char *text) { return mjenv_object_count(handle(), text, &found); }));
    return found;
  }
  std::int64_t object_index(const std::string &type, const std::string &name) {
    std::int64_t found = -1;
    keep(with_text(type, [&](const char *kind) {
      return with_text(name, [&](const char *text) { return mjenv_object_index(handle(), kind, text, &found); });
    }));
    return found;
  }
  std::string object_name(const std::string &type, std::int64_t index) {
    const char *found = "";
    keep(with_text(type, [&](const char *text) { return mjenv_object_name(handle(), text, index, &found); }));
    return found;
  }

  /* ---- Episodes ---- */

  /* The arrays for the outputs of all rows. */
  Batch batch() const { return batch_of(rows()); }
  /* The arrays for the outputs of a rollout of `steps` steps. */
  Batch rollout_batch(std::size_t steps) const { return batch_of(rows() * steps); }

  /* Seeds row i with first + i, as Gymnasium does. */
  mjenv_status seed(std::uint64_t first) {
    std::vector<std::uint64_t> seeds(rows());
    for (std::uint64_t &each : seeds) each = first++;
    return keep(check(mjenv_seed(handle(), seeds.data(), nullptr)));
  }
  mjenv_status seed(Span<const std::uint64_t> seeds) {
    if (!is_per_row(seeds.size())) return status_;
    return keep(check(mjenv_seed(handle(), seeds.data(), nullptr)));
  }
  mjenv_status reset(Batch &out) { return reset_rows(nullptr, out); }
  /* Resets the rows where mask[rows] is not 0. The outputs of the other rows stay as they are. */
  mjenv_status reset(Span<const std::uint8_t> mask, Batch &out) {
    return is_per_row(mask.size()) ? reset_rows(mask.data(), out) : status_;
  }
  mjenv_status step(Span<const float> action, Batch &out) { return step_rows(nullptr, action, out); }
  mjenv_status step(Span<const double> action, Batch &out) { return step_rows(nullptr, action, out); }
  mjenv_status step(Span<const std::uint8_t> mask, Span<const float> action, Batch &out) {
    return is_per_row(mask.size()) ? step_rows(mask.data(), action, out) : status_;
  }
  mjenv_status step(Span<const std::uint8_t> mask, Span<const double> action, Batch &out) {
    return is_per_row(mask.size()) ? step_rows(mask.data(), action, out) : status_;
  }
  mjenv_status rollout(Span<const float> action, std::size_t steps, Batch &out) { return play(action, steps, out); }
  mjenv_status rollout(Span<const double> action, std::size_t steps, Batch &out) { return play(action, steps, out); }
  mjenv_status observe(Batch &out) {
    const mjenv_batch written = out.raw();
    return keep(check(mjenv_observe(handle(), &written)));
  }

  /* Starts a step of all rows, or of the listed rows. */
  mjenv_status send(Span<const float> action) { return send_rows(nullptr, 0, action); }
  mjenv_status send(Span<const double> action) { return send_rows(nullptr, 0, action); }
  mjenv_status send(Span<const std::int64_t> rows, Span<const float> action) {
    return send_rows(rows.data(), rows.size(), action);
  }
  mjenv_status send(Span<const std::int64_t> rows, Span<const double> action) {
    return send_rows(rows.data(), rows.size(), action);
  }
  /* Waits until `least` rows are done, at most `timeout` seconds (a negative number: no limit). Writes the numbers of
   * the rows that are done to the first elements of `rows`, writes their outputs to `out`, and returns how many rows
   * these are. If some of them failed, it has written all that, too, and throws an Error whose `received` is their
   * number; status[row] of the Batch tells which rows failed. */
  std::size_t recv(std::size_t least, Span<std::int64_t> rows, Batch &out, double timeout = -1) {
    std::size_t count = 0;
    const mjenv_batch written = out.raw();
    const mjenv_status result = mjenv_recv(handle(), least, timeout, rows.data(), rows.size(), &count, &written);
    keep(check(result, count));
    return count;
  }

  mjenv_status seed_actions(std::uint64_t seed) { return keep(check(mjenv_seed_actions(handle(), seed))); }
  mjenv_status sample_actions(Span<float> action) {
    return keep(check(mjenv_sample_actions(handle(), action.data(), action.size())));
  }

  /* ---- State of rows ---- */

  /* Reads an array of a row's mjData or of the mjModel by its MuJoCo name. */
  std::vector<double> read(std::int64_t row, const std::string &array) {
    std::vector<double> values;
    std::size_t length = 0;
    const auto get = [&](const char *text) {
      return mjenv_read(handle(), row, text, values.data(), values.size(), &length);
    };
    if (keep(with_text(array, get)) != MJENV_OK || length == 0) return values;
    values.resize(length);
    if (keep(with_text(array, get)) != MJENV_OK) values.clear();
    return values;
  }
  mjenv_status set_state(std::int64_t row, Span<const double> qpos, Span<const double> qvel) {
    return keep(check(mjenv_set_state(handle(), row, qpos.data(), qpos.size(), qvel.data(), qvel.size())));
  }
  /* Writes all elements of an array of a row's mjModel or mjData, or of all rows. */
  mjenv_status write(std::int64_t row, const std::string &array, Span<const double> values) {
    return keep(with_text(
        array, [&](const char *text) { return mjenv_write(handle(), row, text, values.data(), values.size()); }));
  }
  /* Writes values[rows][elements of the array]: to all rows, or to those where mask[rows] is not 0. */
  mjenv_status write_rows(const std::string &array, Span<const double> values) {
    return write_masked(nullptr, array, values);
  }
  mjenv_status write_rows(Span<const std::uint8_t> mask, const std::string &array, Span<const double> values) {
    return is_per_row(mask.size()) ? write_masked(mask.data(), array, values) : status_;
  }
  /* Calls mj_setConst. */
  mjenv_status set_constants(std::int64_t row = MJENV_ALL_ROWS) {
    return keep(check(mjenv_set_constants(handle(), row)));
  }
  /* Replaces what resets draw; an empty list draws nothing. */
  mjenv_status randomize(Span<const mjenv_randomization> items) {
    return keep(check(mjenv_randomize(handle(), items.data(), items.size())));
  }
  /* Replaces noise, delays and pushes; without an argument there are none. */
  mjenv_status perturb(const mjenv_perturbation &perturbation) {
    return keep(check(mjenv_perturb(handle(), &perturbation)));
  }
  mjenv_status perturb() { return keep(check(mjenv_perturb(handle(), nullptr))); }
  mjenv_status simulate(std::int64_t row, Span<const double> ctrl, std::int64_t frames) {
    return keep(check(mjenv_simulate(handle(), row, ctrl.data(), ctrl.size(), frames)));
  }
  /* All six words of mjenv_get_stream. */
  std::vector<std::uint64_t> stream(std::int64_t row) {
    std::vector<std::uint64_t> words(6);
    if (keep(check(mjenv_get_stream(handle(), row, words.data(), words.size()))) != MJENV_OK) words.clear();
    return words;
  }
  /* words: four or six. */
  mjenv_status set_stream(std::int64_t row, Span<const std::uint64_t> words) {
    return keep(check(mjenv_set_stream(handle(), row, words.data(), words.size())));
  }
  mjenv_status copy_row(std::int64_t from, Span<const std::uint8_t> to_mask) {
    return is_per_row(to_mask.size()) ? keep(check(mjenv_copy_row(handle(), from, to_mask.data()))) : status_;
  }
  std::vector<std::byte> snapshot(std::int64_t row = MJENV_ALL_ROWS) {
    std::vector<std::byte> image;
    std::size_t size = 0;
    if (keep(check(mjenv_snapshot(handle(), row, nullptr, 0, &size))) != MJENV_OK) return image;
    image.resize(size);
    if (keep(check(mjenv_snapshot(handle(), row, image.data(), size, &size))) != MJENV_OK) image.clear();
    return image;
  }
  mjenv_status restore(Span<const std::byte> image, std::int64_t row = MJENV_ALL_ROWS) {
    return keep(check(mjenv_restore(handle(), row, image.data(), image.size())));
  }

  mjenv_status status() const { return status_; }
  mjenv_env *handle() const { return handle_.get(); }

 private:
  struct Destroy {
    void operator()(mjenv_env *env) const { mjenv_destroy(env); }
  };
  std::unique_ptr<mjenv_env, Destroy> handle_;
  mjenv_status status_ = MJENV_OK;

  mjenv_status keep(mjenv_status result) { return status_ = result; }
  /* The C functions take the bare pointer of an array with one element for each row. */
  bool is_per_row(std::size_t size) {
    if (size == rows()) return true;
    keep(refuse(MJENV_E_SIZE, "a mask and a list of seeds have one element for each row"));
    return false;
  }
  static mjenv_dtype dtype_of(Span<const float>) { return MJENV_DTYPE_FLOAT32; }
  static mjenv_dtype dtype_of(Span<const double>) { return MJENV_DTYPE_FLOAT64; }

  Batch batch_of(std::size_t size) const {
    Batch batch;
    batch.rows = size;
    batch.obs_count = count(MJENV_ROLE_OBSERVATION);
    batch.info_count = count(MJENV_ROLE_INFO);
    batch.reset_info_count = count(MJENV_ROLE_RESET_INFO);
    batch.arrays_count = count(MJENV_ROLE_ARRAYS);
    batch.obs.resize(size * batch.obs_count);
    batch.reward.resize(size);
    batch.info.resize(size * batch.info_count);
    batch.reset_info.resize(size * batch.reset_info_count);
    batch.arrays.resize(size * batch.arrays_count);
    batch.terminated.resize(size);
    batch.truncated.resize(size);
    batch.was_reset.resize(size);
    batch.status.resize(size);
    if (options().get_string("autoreset_mode") != "same_step") return batch;
    batch.final_obs.resize(size * batch.obs_count);
    batch.final_info.resize(size * batch.info_count);
    return batch;
  }
  mjenv_status reset_rows(const std::uint8_t *mask, Batch &out) {
    const mjenv_batch written = out.raw();
    return keep(check(mjenv_reset(handle(), mask, &written)));
  }
  mjenv_status write_masked(const std::uint8_t *mask, const std::string &array, Span<const double> values) {
    return keep(with_text(
        array, [&](const char *text) { return mjenv_write_rows(handle(), mask, text, values.data(), values.size()); }));
  }
  template <typename Real>
  mjenv_status step_rows(const std::uint8_t *mask, Span<const Real> action, Batch &out) {
    const mjenv_batch written = out.raw();
    return keep(check(mjenv_step(handle(), mask, action.data(), action.size(), dtype_of(action), &written)));
  }
  template <typename Real>
  mjenv_status play(Span<const Real> action, std::size_t steps, Batch &out) {
    const mjenv_batch written = out.raw();
    return keep(check(mjenv_rollout(handle(), action.data(), action.size(), dtype_of(action),
                                    static_cast<std::int64_t>(steps), &written)));
  }
  template <typename Real>
  mjenv_status send_rows(const std::int64_t *rows, std::size_t row_count, Span<const Real> action) {
    return keep(check(mjenv_send(handle(), rows, row_count, action.data(), action.size(), dtype_of(action))));
  }
};

/* Draws pictures of an environment's rows. */
class Renderer {
 public:
  /* Without settings, those of mjenv_render_defaults are used. */
  explicit Renderer(const Env &env) { make(env, nullptr); }
  Renderer(const Env &env, const mjenv_render_settings &settings) { make(env, &settings); }
  static mjenv_render_settings defaults(const Env &env) {
    mjenv_render_settings settings{};
    settings.struct_size = sizeof settings;
    check(mjenv_render_defaults(env.handle(), &settings));
    return settings;
  }

  /* Draws a row into rgb[height][width][3] and depth[height][width]. */
  mjenv_status draw(std::int64_t row, Span<std::uint8_t> rgb) {
    return status_ = check(mjenv_render(handle(), row, rgb.data(), rgb.size(), nullptr, 0));
  }
  mjenv_status draw(std::int64_t row, Span<std::uint8_t> rgb, Span<float> depth) {
    return status_ = check(mjenv_render(handle(), row, rgb.data(), rgb.size(), depth.data(), depth.size()));
  }

  mjenv_status status() const { return status_; }
  mjenv_renderer *handle() const { return handle_.get(); }

 private:
  struct Destroy {
    void operator()(mjenv_renderer *renderer) const { mjenv_renderer_destroy(renderer); }
  };
  std::unique_ptr<mjenv_renderer, Destroy> handle_;
  mjenv_status status_ = MJENV_OK;

  void make(const Env &env, const mjenv_render_settings *settings) {
    mjenv_renderer *made = nullptr;
    status_ = check(mjenv_renderer_create(env.handle(), settings, &made));
    handle_.reset(made);
  }
};

/* Shows an environment's rows on a display. */
class Window {
 public:
  explicit Window(const Env &env) { make(env, nullptr); }
  Window(const Env &env, const mjenv_render_settings &settings) { make(env, &settings); }

  bool is_open() const { return mjenv_window_is_open(handle()) != 0; }
  mjenv_status draw(std::int64_t row) { return status_ = check(mjenv_window_draw(handle(), row)); }

  mjenv_status status() const { return status_; }
  mjenv_window *handle() const { return handle_.get(); }

 private:
  struct Destroy {
    void operator()(mjenv_window *window) const { mjenv_window_destroy(window); }
  };
  std::unique_ptr<mjenv_window, Destroy> handle_;
  mjenv_status status_ = MJENV_OK;

  void make(const Env &env, const mjenv_render_settings *settings) {
    mjenv_window *made = nullptr;
    status_ = check(mjenv_window_create(env.handle(), settings, &made));
    handle_.reset(made);
  }
};

}  // namespace mjenv

#endif
