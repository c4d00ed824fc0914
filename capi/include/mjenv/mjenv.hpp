/* mjenv.hpp - mjenv.h for C++17: handles that destroy themselves, exceptions, arrays of the right sizes.
 *
 * The header only calls the functions of mjenv.h, whose comments say what each does. handle() returns the handle that
 * they take. A call that fails throws mjenv::Error. This header itself refuses a mask or a list of seeds whose length
 * does not fit the number of rows, and goals of different sizes (MJENV_E_SIZE); a row that a Batch does not have and an
 * integer beyond int64_t (MJENV_E_VALUE); a std::string with a NUL inside (MJENV_E_ARGUMENT); and a library with another
 * MJENV_ABI_VERSION (MJENV_E_INTERNAL). Moved-from objects may only be destroyed or assigned to. */
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

/* Why a call failed. */
class Error : public std::runtime_error {
 public:
  Error(mjenv_status code, const char *reason, std::size_t rows = 0)
      : std::runtime_error(reason), status(code), received(rows) {}
  const mjenv_status status;
  const std::size_t received; /* how many rows Env::recv has received, the failed ones included */
};

/* Throws unless the status is MJENV_OK. */
inline void check(mjenv_status status, std::size_t received = 0) {
  if (status != MJENV_OK) throw Error(status, mjenv_last_error(), received);
}

/* Calls the C function with the text. Refuses a text with a NUL, where C would see the end of the text. */
template <typename Call>
mjenv_status with_text(const std::string &text, const Call &call) {
  if (text.find('\0') != std::string::npos) throw Error(MJENV_E_ARGUMENT, "a text has a NUL character inside");
  const mjenv_status status = call(text.c_str());
  check(status);
  return status;
}

inline std::int64_t int64(std::size_t count) { return static_cast<std::int64_t>(count); }

/* A view of an array of `size` elements at `data`, which somebody else owns, such as a vector. */
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

/* Calls get(values, capacity, count) twice: first for the number of elements, then for the elements. */
template <typename T, typename Get>
std::vector<T> fetch(const Get &get) {
  std::int64_t count = 0;
  get(nullptr, 0, &count);
  std::vector<T> values(static_cast<std::size_t>(count));
  if (count > 0) get(values.data(), count, &count);
  return values;
}

/* Calls get(arguments..., &result), and returns the result: a handle, or a struct that was initialised before. */
template <typename T, typename Get, typename... Arguments>
T obtain(T result, const Get &get, Arguments... arguments) {
  check(get(arguments..., &result));
  return result;
}

template <auto destroy>
struct Destroy {
  template <typename Handle>
  void operator()(Handle *handle) const {
    destroy(handle);
  }
};

/* The options of one environment id. */
class Options {
 public:
  /* The options of an id, with their default values. */
  explicit Options(const std::string &id) {
    if (mjenv_abi_version() != MJENV_ABI_VERSION)
      throw Error(MJENV_E_INTERNAL, "libmjenv has another ABI version than this program was compiled for");
    mjenv_options *made = nullptr;
    with_text(id, [&](const char *text) { return mjenv_options_create(text, &made); });
    handle_.reset(made);
  }
  /* A copy of options that mjenv.h returned, such as an environment's (mjenv_options_of). */
  explicit Options(const mjenv_options *options)
      : handle_(obtain<mjenv_options *>(nullptr, mjenv_options_copy, options)) {}
  Options(const Options &other) : Options(other.handle()) {}
  Options &operator=(const Options &other) { return *this = Options(other); }
  Options(Options &&) = default;
  Options &operator=(Options &&) = default;

  /* Sets a flag, an integer, a single real, or a STRING_OR_INT to an index. */
  template <typename Integer, typename = std::enable_if_t<std::is_integral_v<Integer>>>
  Options &set(const std::string &name, Integer value) {
    if (value > 0 && static_cast<std::uint64_t>(value) > std::numeric_limits<std::int64_t>::max())
      throw Error(MJENV_E_VALUE, "the integer is greater than 2^63 - 1");
    with_text(name, [&](const char *text) {
      return mjenv_options_set_integer(handle(), text, static_cast<std::int64_t>(value));
    });
    return *this;
  }
  Options &set(const std::string &name, double value) { return set(name, Span<const double>(&value, 1)); }
  Options &set(const std::string &name, std::initializer_list<double> values) {
    return set(name, Span<const double>(values.begin(), values.size()));
  }
  Options &set(const std::string &name, Span<const double> values) {
    with_text(name, [&](const char *text) {
      return mjenv_options_set_reals(handle(), text, values.data(), int64(values.size()));
    });
    return *this;
  }
  Options &set(const std::string &name, const std::string &value) {
    with_text(value, [&](const char *set_to) {
      return with_text(name, [&](const char *text) { return mjenv_options_set_string(handle(), text, set_to); });
    });
    return *this;
  }
  Options &set(const std::string &name, const char *value) { return set(name, std::string(value)); }

  /* A flag, an integer, or an index. */
  std::int64_t get_integer(const std::string &name) const {
    std::int64_t value = 0;
    with_text(name, [&](const char *text) { return mjenv_options_get_integer(handle(), text, &value); });
    return value;
  }
  std::vector<double> get_reals(const std::string &name) const {
    return fetch<double>([&](double *values, std::int64_t capacity, std::int64_t *count) {
      with_text(name,
                [&](const char *text) { return mjenv_options_get_reals(handle(), text, values, capacity, count); });
    });
  }
  std::string get_string(const std::string &name) const {
    const char *value = "";
    with_text(name, [&](const char *text) { return mjenv_options_get_string(handle(), text, &value); });
    return value;
  }
  /* Describes all options. The texts in the result belong to these options. */
  std::vector<mjenv_option> describe() const {
    std::vector<mjenv_option> found(static_cast<std::size_t>(mjenv_options_count(handle())), MJENV_OPTION_INIT);
    for (std::size_t i = 0; i < found.size(); ++i) check(mjenv_options_at(handle(), int64(i), &found[i]));
    return found;
  }

  mjenv_options *handle() const { return handle_.get(); }

 private:
  std::unique_ptr<mjenv_options, Destroy<mjenv_options_destroy>> handle_;
};

/* The arrays of a mjenv_batch. Env::batch makes those for steps and resets, Env::rollout_batch those for a rollout. */
struct Batch {
  std::size_t rows = 0;
  std::size_t obs_count = 0, info_count = 0, reset_info_count = 0, arrays_count = 0;

  std::vector<double> obs, reward, info, reset_info, arrays;
  std::vector<double> final_obs, final_info; /* empty unless the option "autoreset_mode" is same_step */
  std::vector<std::uint8_t> terminated, truncated, was_reset;
  std::vector<std::int32_t> status;

  bool ended(std::size_t row) const {
    check_row(row);
    return terminated[row] || truncated[row];
  }
  Span<const double> obs_of(std::size_t row) const { return part(obs, row); }
  Span<const double> final_obs_of(std::size_t row) const { return part(final_obs, row); }

  /* Returns the mjenv_batch, whose pointers are valid until one of the vectors is resized. */
  mjenv_batch raw() {
    mjenv_batch batch = MJENV_BATCH_INIT;
    batch.rows = int64(rows);
    batch.obs_count = int64(obs_count);
    batch.info_count = int64(info_count);
    batch.reset_info_count = int64(reset_info_count);
    batch.arrays_count = int64(arrays_count);
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
  void check_row(std::size_t row) const {
    if (row >= rows) throw Error(MJENV_E_VALUE, "the batch does not have this row");
  }
  Span<const double> part(const std::vector<double> &from, std::size_t row) const {
    check_row(row);
    if (from.empty()) return {nullptr, 0};
    return {from.data() + row * obs_count, obs_count};
  }
};

/* An environment of one or many rows. */
class Env {
 public:
  explicit Env(const Options &options, std::int64_t rows = 1)
      : handle_(obtain<mjenv_env *>(nullptr, mjenv_create, options.handle(), rows)),
        rows_(static_cast<std::size_t>(rows)) {}
  explicit Env(const std::string &id, std::int64_t rows = 1) : Env(Options(id), rows) {}

  /* ---- What it is ---- */

  std::size_t rows() const { return rows_; }
  mjenv_info info() { return obtain<mjenv_info>(MJENV_INFO_INIT, mjenv_info_of, handle()); }

  /* How lanes compute each stage of a step of the model, one line for each (mjenv_lane_stages_of). */
  std::string lane_stages() {
    const char *text = mjenv_lane_stages_of(handle());
    if (!text) throw Error(MJENV_E_ARGUMENT, mjenv_last_error());
    return text;
  }
  /* A copy of the options that the environment was built with. */
  Options options() const { return Options(mjenv_options_of(handle())); }
  mjenv_space space(mjenv_role role) const {
    return obtain<mjenv_space>(MJENV_SPACE_INIT, mjenv_space_of, handle(), role);
  }
  std::vector<mjenv_field> fields(mjenv_role role) const {
    std::vector<mjenv_field> found(static_cast<std::size_t>(mjenv_field_count(handle(), role)), MJENV_FIELD_INIT);
    for (std::size_t i = 0; i < found.size(); ++i) check(mjenv_field_at(handle(), role, int64(i), &found[i]));
    return found;
  }
  /* How many elements all fields of a role have in one row. */
  std::size_t count(mjenv_role role) const {
    std::int64_t total = 0;
    for (const mjenv_field &field : fields(role)) total += field.count;
    return static_cast<std::size_t>(total);
  }
  std::int64_t object_count(const std::string &type) const {
    std::int64_t found = 0;
    with_text(type, [&](const char *text) { return mjenv_object_count(handle(), text, &found); });
    return found;
  }
  std::int64_t object_index(const std::string &type, const std::string &name) const {
    std::int64_t found = -1;
    with_text(type, [&](const char *kind) {
      return with_text(name, [&](const char *text) { return mjenv_object_index(handle(), kind, text, &found); });
    });
    return found;
  }
  std::string object_name(const std::string &type, std::int64_t index) const {
    const char *found = "";
    with_text(type, [&](const char *text) { return mjenv_object_name(handle(), text, index, &found); });
    return found;
  }

  /* ---- Episodes ---- */

  Batch batch() const { return batch_of(rows()); }
  Batch rollout_batch(std::size_t steps) const { return batch_of(rows() * steps); }

  /* Seeds row i with first + i, as Gymnasium does. */
  void seed(std::uint64_t first) {
    std::vector<std::uint64_t> seeds(rows());
    for (std::uint64_t &each : seeds) each = first++;
    seed(seeds);
  }
  /* seeds[rows][words]; the functions with a mask[rows] act on the rows where it is not 0. */
  void seed(Span<const std::uint64_t> seeds, std::size_t words = 1) { seed_rows(nullptr, seeds, words); }
  void seed(Span<const std::uint8_t> mask, Span<const std::uint64_t> seeds, std::size_t words = 1) {
    seed_rows(of(mask), seeds, words);
  }
  void seed_row(std::int64_t row, Span<const std::uint64_t> words) {
    check(mjenv_seed_row(handle(), row, words.data(), int64(words.size())));
  }
  void reset(Batch &out) { reset_rows(nullptr, out); }
  void reset(Span<const std::uint8_t> mask, Batch &out) { reset_rows(of(mask), out); }
  void step(Span<const float> action, Batch &out) { step_rows(nullptr, action, out); }
  void step(Span<const double> action, Batch &out) { step_rows(nullptr, action, out); }
  void step(Span<const std::uint8_t> mask, Span<const float> action, Batch &out) { step_rows(of(mask), action, out); }
  void step(Span<const std::uint8_t> mask, Span<const double> action, Batch &out) { step_rows(of(mask), action, out); }
  void rollout(Span<const float> action, std::size_t steps, Batch &out) { play(action, steps, out); }
  void rollout(Span<const double> action, std::size_t steps, Batch &out) { play(action, steps, out); }
  void observe(Batch &out) {
    const mjenv_batch written = out.raw();
    check(mjenv_observe(handle(), &written));
  }

  /* Starts a step of all rows, or of the listed rows. */
  void send(Span<const float> action) { send_rows(nullptr, 0, action); }
  void send(Span<const double> action) { send_rows(nullptr, 0, action); }
  void send(Span<const std::int64_t> rows, Span<const float> action) { send_rows(rows.data(), rows.size(), action); }
  void send(Span<const std::int64_t> rows, Span<const double> action) { send_rows(rows.data(), rows.size(), action); }
  /* Waits until `least` rows are done, at most `timeout` seconds (a negative number: no limit). Writes the numbers of
   * the rows that are done to the first elements of `rows`, their outputs to `out`, and returns how many they are. If
   * some of them failed (status[row] of the Batch), it throws an Error whose `received` is that number. */
  std::size_t recv(std::size_t least, Span<std::int64_t> rows, Batch &out, double timeout = -1) {
    std::int64_t count = 0;
    const mjenv_batch written = out.raw();
    const mjenv_status result =
        mjenv_recv(handle(), int64(least), timeout, rows.data(), int64(rows.size()), &count, &written);
    check(result, static_cast<std::size_t>(count));
    return static_cast<std::size_t>(count);
  }

  void seed_actions(std::uint64_t seed) { check(mjenv_seed_actions(handle(), seed)); }
  void sample_actions(Span<float> action) {
    check(mjenv_sample_actions(handle(), action.data(), int64(action.size())));
  }

  /* ---- State of rows ---- */

  std::vector<double> read(std::int64_t row, const std::string &array) {
    return fetch<double>([&](double *values, std::int64_t capacity, std::int64_t *count) {
      with_text(array, [&](const char *text) { return mjenv_read(handle(), row, text, values, capacity, count); });
    });
  }
  void set_state(std::int64_t row, Span<const double> qpos, Span<const double> qvel) {
    check(mjenv_set_state(handle(), row, qpos.data(), int64(qpos.size()), qvel.data(), int64(qvel.size())));
  }
  /* values: one array for all rows, or one for each row, one after the other. */
  void write(const std::string &array, Span<const double> values) { write_rows(nullptr, array, values); }
  void write(Span<const std::uint8_t> mask, const std::string &array, Span<const double> values) {
    write_rows(of(mask), array, values);
  }
  void write(std::int64_t row, const std::string &array, Span<const double> values) {
    with_text(array, [&](const char *text) {
      return mjenv_write_row(handle(), row, text, values.data(), int64(values.size()));
    });
  }
  void set_constants() { check(mjenv_set_constants(handle(), nullptr)); }
  void set_constants(Span<const std::uint8_t> mask) { check(mjenv_set_constants(handle(), of(mask))); }
  void set_constants(std::int64_t row) { check(mjenv_set_constants_row(handle(), row)); }
  /* Replaces the parts of the document of draws, noise, delays and pushes that this one has. */
  void randomize(const std::string &document) {
    with_text(document, [&](const char *text) { return mjenv_randomize(handle(), text); });
  }
  std::string randomization() const {
    const char *document = nullptr;
    check(mjenv_randomization(handle(), &document));
    return document;
  }
  void simulate(std::int64_t row, Span<const double> ctrl, std::int64_t frames) {
    check(mjenv_simulate(handle(), row, ctrl.data(), int64(ctrl.size()), frames));
  }
  /* The rewards of pairs of goals (mjenv_compute_reward). rewards: one number for each pair. */
  void compute_reward(Span<const double> achieved, Span<const double> desired, Span<double> rewards) {
    if (achieved.size() != desired.size()) throw Error(MJENV_E_SIZE, "the goals have different sizes");
    check(mjenv_compute_reward(handle(), achieved.data(), desired.data(), int64(achieved.size()), rewards.data(),
                               int64(rewards.size())));
  }
  /* All six words of mjenv_get_stream. */
  std::vector<std::uint64_t> stream(std::int64_t row) {
    std::vector<std::uint64_t> words(6);
    check(mjenv_get_stream(handle(), row, words.data(), int64(words.size())));
    return words;
  }
  /* words: four or six. */
  void set_stream(std::int64_t row, Span<const std::uint64_t> words) {
    check(mjenv_set_stream(handle(), row, words.data(), int64(words.size())));
  }
  void copy_row(Span<const std::uint8_t> mask, std::int64_t from) { check(mjenv_copy_row(handle(), of(mask), from)); }
  std::vector<std::byte> snapshot(std::int64_t row = MJENV_ALL_ROWS) {
    return fetch<std::byte>([&](std::byte *image, std::int64_t capacity, std::int64_t *size) {
      check(mjenv_snapshot(handle(), row, image, capacity, size));
    });
  }
  void restore(Span<const std::byte> image, std::int64_t row = MJENV_ALL_ROWS) {
    check(mjenv_restore(handle(), row, image.data(), int64(image.size())));
  }

  mjenv_env *handle() const { return handle_.get(); }

 private:
  std::unique_ptr<mjenv_env, Destroy<mjenv_destroy>> handle_;
  std::size_t rows_;

  static void check_size(std::size_t size, std::size_t needed) {
    if (size != needed) throw Error(MJENV_E_SIZE, "the mask or list of seeds does not fit the number of rows");
  }
  const std::uint8_t *of(Span<const std::uint8_t> mask) const {
    check_size(mask.size(), rows());
    return mask.data();
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
  void seed_rows(const std::uint8_t *mask, Span<const std::uint64_t> seeds, std::size_t words) {
    check_size(seeds.size(), rows() * words);
    check(mjenv_seed(handle(), mask, seeds.data(), int64(seeds.size())));
  }
  void reset_rows(const std::uint8_t *mask, Batch &out) {
    const mjenv_batch written = out.raw();
    check(mjenv_reset(handle(), mask, &written));
  }
  void write_rows(const std::uint8_t *mask, const std::string &array, Span<const double> values) {
    with_text(array,
              [&](const char *text) { return mjenv_write(handle(), mask, text, values.data(), int64(values.size())); });
  }
  template <typename Real>
  void step_rows(const std::uint8_t *mask, Span<const Real> action, Batch &out) {
    const mjenv_batch written = out.raw();
    check(mjenv_step(handle(), mask, action.data(), int64(action.size()), dtype_of(action), &written));
  }
  template <typename Real>
  void play(Span<const Real> action, std::size_t steps, Batch &out) {
    const mjenv_batch written = out.raw();
    check(mjenv_rollout(handle(), action.data(), int64(action.size()), dtype_of(action), int64(steps), &written));
  }
  template <typename Real>
  void send_rows(const std::int64_t *rows, std::size_t row_count, Span<const Real> action) {
    check(mjenv_send(handle(), rows, int64(row_count), action.data(), int64(action.size()), dtype_of(action)));
  }
};

/* Draws pictures of an environment's rows. */
class Renderer {
 public:
  explicit Renderer(const Env &env)
      : handle_(obtain<mjenv_renderer *>(nullptr, mjenv_renderer_create, env.handle(), nullptr)) {}
  Renderer(const Env &env, const mjenv_render_settings &settings)
      : handle_(obtain<mjenv_renderer *>(nullptr, mjenv_renderer_create, env.handle(), &settings)) {}
  static mjenv_render_settings defaults(const Env &env) {
    return obtain<mjenv_render_settings>(MJENV_RENDER_SETTINGS_INIT, mjenv_render_defaults, env.handle());
  }

  /* Draws a row into rgb[height][width][3] and depth[height][width]. */
  void draw(std::int64_t row, Span<std::uint8_t> rgb) {
    check(mjenv_render(handle(), row, rgb.data(), int64(rgb.size()), nullptr, 0));
  }
  void draw(std::int64_t row, Span<std::uint8_t> rgb, Span<float> depth) {
    check(mjenv_render(handle(), row, rgb.data(), int64(rgb.size()), depth.data(), int64(depth.size())));
  }
  /* Writes the index and the mjtObj of the object that each pixel shows into objects[height][width][2]. */
  void draw_segmentation(std::int64_t row, Span<std::int32_t> objects) {
    check(mjenv_render_segmentation(handle(), row, objects.data(), int64(objects.size())));
  }

  mjenv_renderer *handle() const { return handle_.get(); }

 private:
  std::unique_ptr<mjenv_renderer, Destroy<mjenv_renderer_destroy>> handle_;
};

/* Shows an environment's rows on a display. */
class Window {
 public:
  explicit Window(const Env &env)
      : handle_(obtain<mjenv_window *>(nullptr, mjenv_window_create, env.handle(), nullptr)) {}
  Window(const Env &env, const mjenv_render_settings &settings)
      : handle_(obtain<mjenv_window *>(nullptr, mjenv_window_create, env.handle(), &settings)) {}

  bool is_open() const { return mjenv_window_is_open(handle()) != 0; }
  void draw(std::int64_t row) { check(mjenv_window_draw(handle(), row)); }

  mjenv_window *handle() const { return handle_.get(); }

 private:
  std::unique_ptr<mjenv_window, Destroy<mjenv_window_destroy>> handle_;
};

}  // namespace mjenv

#endif
