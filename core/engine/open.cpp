// Loads models from MJCF files and texts.
#include <atomic>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <new>
#include <string>

#include "engine/assets.hpp"
#include "engine/compile.hpp"
#include "engine/load.hpp"
#include "engine/model.hpp"
#include "engine/mujoco.hpp"
#include "engine/untrusted/files.hpp"
#include "engine/untrusted/limits.hpp"
#include "engine/untrusted/mjcf.hpp"
#include "error.hpp"
#include "system/platform.hpp"

namespace mjenv::core {
namespace {

// How much stack MuJoCo's parser needs for the deepest model that is accepted (docs/reliability.md). Built-in models
// need a tenth of it.
constexpr std::size_t kStack = 512 << 10;

// The models in use, so that environments with the same model share it. While one thread is inside the cache, the calls
// of others do nothing instead of waiting, because in a forked child the thread inside may not exist. A model is then
// compiled once more, or its entry is dropped later.
class Cache {
 public:
  // Returns the model that was added with this key, or null.
  std::shared_ptr<const Model> find(const std::string& key) {
    std::shared_ptr<const Model> found;
    alone([&] {
      if (!models_) return;
      const auto entry = models_->find(key);
      if (entry != models_->end()) found = entry->second.lock();
    });
    return found;
  }

  void add(const std::string& key, const std::shared_ptr<const Model>& model) {
    alone([&] {
      if (!models_) models_ = new Models;
      (*models_)[key] = model;
    });
  }

  // Drops the entries of models that are no longer in use.
  void tidy() {
    alone([&] {
      if (!models_) return;
      for (auto entry = models_->begin(); entry != models_->end();)
        entry = entry->second.expired() ? models_->erase(entry) : std::next(entry);
      if (!models_->empty()) return;
      delete models_;
      models_ = nullptr;
    });
  }

 private:
  using Models = std::map<std::string, std::weak_ptr<const Model>>;
  std::atomic<bool> busy_{false};
  Models* models_ = nullptr;  // not freed with this object, because environments may outlive it

  // Calls the body, unless another thread is inside.
  template <typename F>
  void alone(const F& body) {
    if (busy_.exchange(true, std::memory_order_acquire)) return;
    struct Leave {
      std::atomic<bool>& busy;
      ~Leave() { busy.store(false, std::memory_order_release); }
    } leave{busy_};
    body();
  }
};

Cache cache;

// Runs body on this thread if `bytes` of its stack are left. Otherwise runs body on a new thread and waits for its end.
void run_with_stack(std::size_t bytes, const std::function<void()>& body) {
  if (platform::stack_left() >= bytes) return body();
  std::exception_ptr thrown;
  const bool ran = platform::run_on_thread(bytes, [&] {
    try {
      body();
    } catch (...) {
      thrown = std::current_exception();
    }
  });
  if (!ran)
    fail(MJENV_E_MEMORY, "this thread has less than " + std::to_string(bytes / 1024) +
                             " KB of stack left, and the system does not give this process a thread with more");
  if (thrown) std::rethrow_exception(thrown);
}

std::string expanded(const std::string& path) {
  if (path[0] != '~' || (path.size() > 1 && path[1] != '/')) return path;
  return platform::home_folder() + path.substr(1);
}

// The text of a built-in model, which MuJoCo compiles on this thread alone.
std::string without_threads(std::string text) {
  if (kCompilesOnThreads) text.insert(text.rfind("</mujoco>"), "<compiler usethread='false'/>");
  return text;
}

std::string folder_of(const std::string& path) { return path.substr(0, path.find_last_of("/\\") + 1); }

// Calls body, and adds the model's name to the message of an error that it throws.
template <typename F>
auto about(const std::string& label, const F& body) {
  const std::string model = "model " + quoted(label) + ": ";
  try {
    return body();
  } catch (const Error& error) {
    const bool physics = error.status() == MJENV_E_PHYSICS;  // MuJoCo's own errors
    fail(physics ? MJENV_E_MODEL : error.status(), model + error.what());
  } catch (const std::bad_alloc&) {
    fail(MJENV_E_MEMORY, model + "out of memory");
  } catch (const std::exception& error) {  // thrown by MuJoCo's C++ code
    fail(MJENV_E_MODEL, model + error.what());
  }
}

}  // namespace

std::shared_ptr<const Model> Model::open(const std::string& xml_file, bool trusted) {
  if (xml_file.empty()) fail(MJENV_E_VALUE, "no model: set the option \"xml_file\" or \"xml_string\"");
  if (platform::begins_path(xml_file)) {
    const std::string path = expanded(xml_file);
    return open({xml_file, path, read_file(path, max_text(trusted), "model file ", MJENV_E_FILE),
                 trusted ? Origin::trusted : Origin::untrusted});
  }
  std::vector<std::string> names;
  for (std::size_t i = 0; i < asset_count; ++i) {
    if (xml_file == assets[i].name) return open({xml_file, "", assets[i].text, Origin::built_in});
    names.emplace_back(assets[i].name);
  }
  fail(MJENV_E_FILE, "no built-in model " + quoted(xml_file) + choices(xml_file, names, "the folder assets of mjenv") +
                         "; a path starts with \".\", \"/\" or \"~\"");
}

std::shared_ptr<const Model> Model::parse(const std::string& label, const std::string& xml, bool trusted) {
  return open({label, "", xml, trusted ? Origin::trusted : Origin::untrusted});
}

std::shared_ptr<const Model> Model::open(const Source& source) {
  const std::string key = std::to_string(static_cast<int>(source.origin)) + source.label + '\0' + source.text;
  if (auto found = cache.find(key)) return found;
  open_mujoco();  // not inside the call below, because an error here is not about the model
  bool refers_to_files = false;
  Compiled compiled;
  about(source.label, [&] {
    run_with_stack(kStack, [&] {
      const platform::ClassicLocale locale;
      const bool built_in = source.origin == Origin::built_in;
      const Limits limits(source.origin != Origin::untrusted);
      const Mjcf given =
          built_in ? Mjcf{without_threads(source.text), {}} : checked(source.path, source.text, limits.trusted());
      refers_to_files = !given.files.empty();
      compiled.reset(compile(folder_of(source.path), given.text, given.files, limits));
      if (given.must_state_ranges) check_length_ranges(*compiled);
      if (!(compiled->opt.timestep >= mjMINVAL))  // MuJoCo's smallest divisor; NaN, too
        fail(MJENV_E_MODEL, "the timestep is " + number(compiled->opt.timestep) + " s, less than " + number(mjMINVAL));
    });
  });
  std::shared_ptr<const Model> model(new Model(source.label, std::move(compiled), source.origin), [](auto* unused) {
    delete unused;
    cache.tidy();
  });
  if (!refers_to_files) cache.add(key, model);
  return model;
}

}  // namespace mjenv::core
