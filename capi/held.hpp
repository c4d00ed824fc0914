// The four kinds of handles and what they hold.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "env/env.hpp"
#include "fork_lock.hpp"
#include "handles.hpp"
#include "mjenv/mjenv.h"
#include "render/renderer.hpp"
#include "render/window.hpp"
#include "task/options.hpp"

namespace mjenv::core {

struct HeldEnv;
template <typename Painter>
struct Painting;

}  // namespace mjenv::core

struct mjenv_options : mjenv::core::Slot<mjenv::core::Options> {
  static constexpr const char* kName = "options";
  static constexpr const char* kThing = "options handle";
  static constexpr bool kReadersSeeChanges = true;

  std::atomic<bool> borrowed{false};  // owned by an environment: never changed, never destroyed by the caller
};

struct mjenv_env : mjenv::core::Slot<mjenv::core::HeldEnv> {
  static constexpr const char* kName = "env";
  static constexpr const char* kThing = "environment";
  static constexpr bool kReadersSeeChanges = false;
};

struct mjenv_renderer : mjenv::core::Slot<mjenv::core::Painting<mjenv::core::Renderer>> {
  static constexpr const char* kName = "renderer";
  static constexpr const char* kThing = "renderer";
  static constexpr bool kReadersSeeChanges = false;
};

struct mjenv_window : mjenv::core::Slot<mjenv::core::Painting<mjenv::core::Window>> {
  static constexpr const char* kName = "window";
  static constexpr const char* kThing = "window";
  static constexpr bool kReadersSeeChanges = false;
};

namespace mjenv::core {

// Through a Link, renderers and windows find their environment, which may be destroyed before they are.
struct Link {
  ForkLock lock;             // only one renderer or window at a time reads a row
  mjenv_env* env = nullptr;  // null once the environment is destroyed
};

struct HeldEnv {
  Env env;
  std::shared_ptr<Link> link = std::make_shared<Link>();
  mjenv_options* options;  // those that the environment was built with
  std::optional<std::string> lane_stages;

  HeldEnv(const Options& chosen, std::int64_t rows)
      : env(chosen, rows), options(handles<mjenv_options>.add(std::make_unique<Options>(env.options()))) {
    options->borrowed = true;
  }
  ~HeldEnv() {
    handles<mjenv_options>.destroy(options);
    const std::lock_guard lock(link->lock);
    link->env = nullptr;
  }
  HeldEnv(const HeldEnv&) = delete;
  HeldEnv& operator=(const HeldEnv&) = delete;
};

// A renderer or a window (Painter) that draws the rows of an environment.
template <typename Painter>
struct Painting {
  Painter painter;
  std::shared_ptr<Link> link;

  Painting(const HeldEnv& env, const mjenv_render_settings& settings)
      : painter(env.env.shared_model(), settings), link(env.link) {}
};

}  // namespace mjenv::core
