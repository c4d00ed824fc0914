/* mjenv.hpp - mjenv.h for C++17: handles that free themselves, exceptions, buffers of the right sizes.
 *
 * Header-only: it calls the C functions and nothing else, so it adds nothing to the ABI. mjenv.h documents shapes,
 * units and errors; handle() gives what its other functions take. What the library refuses throws mjenv::Error; a mask
 * of another length std::length_error, a row that a Batch lacks and an integer that C's int64_t lacks
 * std::out_of_range. Moved-from handles may only be destroyed or assigned to. */
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

/* What a call of the C interface refused or failed at; what() is mjenv_last_error(). */
class Error : public std::runtime_error {
 public:
  explicit Error(mjenv_status code) : std::runtime_error(mjenv_last_error()), status(code) {}
  const mjenv_status status;
};

inline void check(mjenv_status status) {
  if (status != MJENV_OK) throw Error(status);
}

/* size elements at data, which somebody else owns: a vector, an array. */
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

 private:
  T *data_;
  std::size_t size_;
};

/* The options of one environment id. */
class Options {
 public:
  explicit Options(const std::string &id) {
    mjenv_options *made;
    check(mjenv_options_create(id.c_str(), &made));
    handle_.reset(made);
  }

  /* A flag, an integer, or the index in a STRING_OR_INT. */
  template <typename Integer, typename = std::enable_if_t<std::is_integral_v<Integer>>>
  Options &set(const std::string &name, Integer value) {
    if (value > 0 && static_cast<std::uint64_t>(value) > std::numeric_limits<std::int64_t>::max())
      throw std::out_of_range("an integer is at most 2^63 - 1");
    check(mjenv_options_set_integer(handle(), name.c_str(), static_cast<std::int64_t>(value)));
    return *this;
  }
  Options &set(const std::string &name, double value) { return set(name, Span<const double>(&value, 1)); }
  Options &set(const std::string &name, std::initializer_list<double> values) {
    return set(name, Span<const double>(values.begin(), values.size()));
  }
  Options &set(const std::string &name, Span<const double> values) {
    check(mjenv_options_set_reals(handle(), name.c_str(), values.data(), values.size()));
    return *this;
  }
  Options &set(const std::string &name, const std::string &value) { return set(name, value.c_str()); }
  Options &set(const std::string &name, const char *value) {
    check(mjenv_options_set_string(handle(), name.c_str(), value));
    return *this;
  }

  mjenv_options *handle() const { return handle_.get(); }

 private:
  struct Destroy {
    void operator()(mjenv_options *options) const { mjenv_options_destroy(options); }
  };
  std::unique_ptr<mjenv_options, Destroy> handle_;
};

/* Where an environment writes the outputs of rows rows; Env::batch makes it. Elements as in mjenv_batch. */
struct Batch {
  Batch(std::size_t rows, std::size_t obs_each, std::size_t info_each, std::size_t reset_info_each)
      : obs(rows * obs_each),
        reward(rows),
        info(rows * info_each),
        reset_info(rows * reset_info_each),
        terminated(rows),
        truncated(rows),
        was_reset(rows),
        status(rows),
        obs_count(obs_each),
        info_count(info_each),
        reset_info_count(reset_info_each) {}

  std::vector<double> obs, reward, info, reset_info;
  std::vector<std::uint8_t> terminated, truncated, was_reset;
  std::vector<std::int32_t> status;
  const std::size_t obs_count, info_count, reset_info_count; /* elements of one row */

  bool ended(std::size_t row) const { return terminated.at(row) || truncated.at(row); }
  Span<const double> obs_of(std::size_t row) const {
    if (row >= reward.size()) throw std::out_of_range("a row that the batch lacks");
    return {obs.data() + row * obs_count, obs_count};
  }

  /* For the functions of mjenv.h. */
  mjenv_batch as_batch() {
    mjenv_batch batch{};
    batch.struct_size = sizeof batch;
    batch.rows = static_cast<std::int64_t>(reward.size());
    batch.obs_count = static_cast<std::int64_t>(obs_count);
    batch.info_count = static_cast<std::int64_t>(info_count);
    batch.reset_info_count = static_cast<std::int64_t>(reset_info_count);
    batch.obs = obs.data();
    batch.reward = reward.data();
    batch.terminated = terminated.data();
    batch.truncated = truncated.data();
    batch.status = status.data();
    batch.info = info.data();
    batch.was_reset = was_reset.data();
    batch.reset_info = reset_info.data();
    return batch;
  }
};

/* An environment of one or many rows. */
class Env {
 public:
  explicit Env(const Options &options, std::int64_t rows = 1) {
    mjenv_env *made;
    check(mjenv_create(options.handle(), rows, &made));
    handle_.reset(made);
  }
  explicit Env(const std::string &id, std::int64_t rows = 1) : Env(Options(id), rows) {}

  std::size_t rows() const { return static_cast<std::size_t>(mjenv_rows(handle())); }
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
  /* Elements of one row of a role. */
  std::size_t count(mjenv_role role) const {
    std::int64_t total = 0;
    for (const mjenv_field &field : fields(role)) total += field.count;
    return static_cast<std::size_t>(total);
  }
  Batch batch() const {
    return {rows(), count(MJENV_ROLE_OBSERVATION), count(MJENV_ROLE_INFO), count(MJENV_ROLE_RESET_INFO)};
  }

  /* Row i gets the seed first + i, as in Gymnasium. */
  void seed(std::uint64_t first) {
    std::vector<std::uint64_t> seeds(rows());
    for (std::uint64_t &each : seeds) each = first++;
    check(mjenv_seed(handle(), seeds.data(), nullptr));
  }
  void reset(Batch &out) {
    const mjenv_batch written = out.as_batch();
    check(mjenv_reset(handle(), nullptr, &written));
  }
  /* Where mask[rows] is not 0; the other rows of out stay. */
  void reset(Span<const std::uint8_t> mask, Batch &out) {
    const mjenv_batch written = out.as_batch();
    check(mjenv_reset(handle(), per_row(mask), &written));
  }
  void step(Span<const float> action, Batch &out) { step(action.data(), action.size(), MJENV_DTYPE_FLOAT32, out); }
  void step(Span<const double> action, Batch &out) { step(action.data(), action.size(), MJENV_DTYPE_FLOAT64, out); }

  void seed_actions(std::uint64_t seed) { check(mjenv_seed_actions(handle(), seed)); }
  void sample_actions(Span<float> action) { check(mjenv_sample_actions(handle(), action.data(), action.size())); }

  /* An array of a row's mjData or of the mjModel by its MuJoCo name. */
  std::vector<double> read(std::int64_t row, const std::string &array) {
    std::size_t length;
    check(mjenv_read(handle(), row, array.c_str(), nullptr, 0, &length));
    std::vector<double> values(length);
    check(mjenv_read(handle(), row, array.c_str(), values.data(), length, &length));
    return values;
  }
  void set_state(std::int64_t row, Span<const double> qpos, Span<const double> qvel) {
    check(mjenv_set_state(handle(), row, qpos.data(), qpos.size(), qvel.data(), qvel.size()));
  }
  void copy_row(std::int64_t from, Span<const std::uint8_t> to_mask) {
    check(mjenv_copy_row(handle(), from, per_row(to_mask)));
  }
  std::vector<std::byte> snapshot(std::int64_t row = MJENV_ALL_ROWS) {
    std::size_t size;
    check(mjenv_snapshot(handle(), row, nullptr, 0, &size));
    std::vector<std::byte> image(size);
    check(mjenv_snapshot(handle(), row, image.data(), size, &size));
    return image;
  }
  void restore(Span<const std::byte> image, std::int64_t row = MJENV_ALL_ROWS) {
    check(mjenv_restore(handle(), row, image.data(), image.size()));
  }

  mjenv_env *handle() const { return handle_.get(); }

 private:
  void step(const void *action, std::size_t elements, mjenv_dtype dtype, Batch &out) {
    const mjenv_batch written = out.as_batch();
    check(mjenv_step(handle(), nullptr, action, elements, dtype, &written));
  }
  /* The C function takes a bare pointer. */
  const std::uint8_t *per_row(Span<const std::uint8_t> mask) const {
    if (mask.size() != rows()) throw std::length_error("a mask has one element for each row");
    return mask.data();
  }

  struct Destroy {
    void operator()(mjenv_env *env) const { mjenv_destroy(env); }
  };
  std::unique_ptr<mjenv_env, Destroy> handle_;
};

}  // namespace mjenv

#endif
