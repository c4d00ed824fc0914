// What the fuzz targets share.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>

#include "bytes.hpp"
#include "hash.hpp"
#include "mjenv/mjenv.h"

// Ends the process, which the fuzzer takes for a find.
#define REQUIRE(condition)                                                 \
  do {                                                                     \
    if (!(condition)) {                                                    \
      std::fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                        \
    }                                                                      \
  } while (0)

// A status of the header, and with a failure its reason; never a defect of the library.
inline mjenv_status check(mjenv_status status) {
  REQUIRE(status <= MJENV_OK && status >= MJENV_E_TASK);
  REQUIRE(status != MJENV_E_INTERNAL);
  REQUIRE(status == MJENV_OK || *mjenv_last_error());
  return status;
}

struct DestroyOptions {
  void operator()(mjenv_options* options) const { mjenv_options_destroy(options); }
};
struct DestroyEnv {
  void operator()(mjenv_env* env) const { mjenv_destroy(env); }
};
struct DestroyRenderer {
  void operator()(mjenv_renderer* renderer) const { mjenv_renderer_destroy(renderer); }
};
using OptionsHandle = std::unique_ptr<mjenv_options, DestroyOptions>;
using EnvHandle = std::unique_ptr<mjenv_env, DestroyEnv>;
using RendererHandle = std::unique_ptr<mjenv_renderer, DestroyRenderer>;

inline OptionsHandle options_of(const char* id) {
  mjenv_options* options = nullptr;
  REQUIRE(mjenv_options_create(id, &options) == MJENV_OK);
  return OptionsHandle(options);
}

// Null when the library refuses.
inline EnvHandle create(const OptionsHandle& options, std::int64_t rows) {
  mjenv_env* env = nullptr;
  const mjenv_status status = check(mjenv_create(options.get(), rows, &env));
  REQUIRE((status == MJENV_OK) == (env != nullptr));
  return EnvHandle(env);
}

// A number of the model: "nq", "nv".
inline std::size_t number(mjenv_env* env, const char* name) {
  double value = 0;
  std::int64_t one = 0;
  REQUIRE(mjenv_read(env, 0, name, &value, 1, &one) == MJENV_OK);
  return static_cast<std::size_t>(value);
}

// 0 if the library refuses.
inline std::int64_t rows_of(mjenv_env* env) {
  mjenv_info info = MJENV_INFO_INIT;
  mjenv_info_of(env, &info);
  return info.rows;
}

inline std::vector<unsigned char> image_of(mjenv_env* env, std::int64_t row) {
  std::int64_t size = 0;
  REQUIRE(mjenv_snapshot(env, row, nullptr, 0, &size) == MJENV_OK);
  std::vector<unsigned char> image(size);
  REQUIRE(mjenv_snapshot(env, row, image.data(), size, &size) == MJENV_OK);
  return image;
}

// Gives a damaged image the checksum of what it now holds.
inline void put_checksum(std::vector<unsigned char>& image) {
  constexpr std::size_t kHeader = 64, kChecksum = 56;
  if (image.size() < kHeader) return;
  const std::uint64_t sum = mjenv::core::hash(image.data() + kHeader, image.size() - kHeader);
  std::memcpy(&image[kChecksum], &sum, sizeof sum);
}

inline std::int64_t total(const mjenv_env* env, mjenv_role role) {
  std::int64_t count = 0;
  for (std::int64_t i = 0; i < mjenv_field_count(env, role); ++i) {
    mjenv_field field = MJENV_FIELD_INIT;
    REQUIRE(mjenv_field_at(env, role, i, &field) == MJENV_OK);
    REQUIRE(field.offset == count || role == MJENV_ROLE_DATA || role == MJENV_ROLE_MODEL);
    count += field.count;
  }
  return count;
}

inline mjenv_render_settings render_defaults(const EnvHandle& env) {
  mjenv_render_settings settings = MJENV_RENDER_SETTINGS_INIT;
  REQUIRE(mjenv_render_defaults(env.get(), &settings) == MJENV_OK);
  return settings;
}

// Null when the library refuses.
inline RendererHandle renderer(const EnvHandle& env, const mjenv_render_settings& settings) {
  mjenv_renderer* made = nullptr;
  const mjenv_status status = check(mjenv_renderer_create(env.get(), &settings, &made));
  REQUIRE((status == MJENV_OK) == (made != nullptr));
  return RendererHandle(made);
}

// A small picture of the first row, with everything in it that MuJoCo can show.
inline void draw_all(const EnvHandle& env) {
  constexpr int kSide = 16;
  mjenv_render_settings settings = render_defaults(env);
  settings.width = settings.height = kSide;
  std::fill(std::begin(settings.visual), std::end(settings.visual), std::uint8_t{1});
  for (auto* groups : {&settings.geomgroup, &settings.sitegroup, &settings.jointgroup, &settings.tendongroup,
                       &settings.actuatorgroup, &settings.skingroup})
    std::fill(std::begin(*groups), std::end(*groups), std::uint8_t{1});
  const RendererHandle drawing = renderer(env, settings);
  std::vector<std::uint8_t> rgb(3 * kSide * kSide);
  std::vector<float> depth(kSide * kSide);
  if (drawing) check(mjenv_render(drawing.get(), 0, rgb.data(), rgb.size(), depth.data(), depth.size()));
}

// Arrays for all outputs, as long as the library may write and no longer.
struct Outputs {
  Outputs(const mjenv_env* env, std::int64_t elements)
      : obs_count(total(env, MJENV_ROLE_OBSERVATION)),
        info_count(total(env, MJENV_ROLE_INFO)),
        reset_info_count(total(env, MJENV_ROLE_RESET_INFO)),
        arrays_count(total(env, MJENV_ROLE_ARRAYS)),
        obs(static_cast<std::size_t>(elements * obs_count)),
        final_obs(obs),
        reward(static_cast<std::size_t>(elements)),
        info(static_cast<std::size_t>(elements * info_count)),
        final_info(info),
        reset_info(static_cast<std::size_t>(elements * reset_info_count)),
        arrays(static_cast<std::size_t>(elements * arrays_count)),
        terminated(static_cast<std::size_t>(elements)),
        truncated(terminated),
        was_reset(terminated),
        status(static_cast<std::size_t>(elements)) {
    batch.rows = elements;
    batch.obs_count = obs_count;
    batch.info_count = info_count;
    batch.reset_info_count = reset_info_count;
    batch.arrays_count = arrays_count;
    batch.obs = obs.data();
    batch.reward = reward.data();
    batch.terminated = terminated.data();
    batch.truncated = truncated.data();
    batch.info = info.data();
    batch.status = status.data();
    batch.was_reset = was_reset.data();
    batch.reset_info = reset_info.data();
    batch.final_obs = final_obs.data();
    batch.final_info = final_info.data();
    batch.arrays = arrays.data();
  }
  Outputs(const Outputs&) = delete;
  Outputs& operator=(const Outputs&) = delete;

  std::int64_t obs_count, info_count, reset_info_count, arrays_count;
  std::vector<double> obs, final_obs, reward, info, final_info, reset_info, arrays;
  std::vector<std::uint8_t> terminated, truncated, was_reset;
  std::vector<std::int32_t> status;
  mjenv_batch batch = MJENV_BATCH_INIT;
};
