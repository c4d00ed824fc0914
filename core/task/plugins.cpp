#include "task/plugins.hpp"

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <sstream>
#include <thread>
#include <utility>
#include <vector>

#include "error.hpp"
#include "mjenv/task.h"
#include "structs.hpp"
#include "system/floats.hpp"
#include "system/platform.hpp"
#include "task/api.hpp"
#include "task/registered_task.hpp"
#include "task/registry.hpp"

namespace mjenv::core {
namespace {

constexpr const char* kEntry = "mjenv_tasks";

[[noreturn]] void refuse_plugin(const std::string& why) { fail(MJENV_E_TASK, why); }

struct Close {
  void operator()(void* handle) const { platform::close_library(handle); }
};
using Handle = std::unique_ptr<void, Close>;

Handle open(const std::string& path) {
  const std::string file = platform::real_path(path);
  if (file.empty()) refuse_plugin(std::strerror(errno));
  std::string reason;
  Handle handle(platform::open_library(file.c_str(), reason));
  if (!handle) refuse_plugin(reason);
  return handle;
}

mjenv_plugin call_entry(void* handle) {
  mjenv_tasks_function* entry = nullptr;
  *reinterpret_cast<void**>(&entry) = platform::symbol_of(handle, kEntry);
  if (!entry)
    refuse_plugin("it is not a plug-in for mjenv, because it does not export the function " + quoted(kEntry) +
                  " (MJENV_PLUGIN)");
  clear_task_message();
  const mjenv_plugin* plugin = nullptr;
  try {
    const KeptFloats floats;
    plugin = entry(&task_api());
  } catch (const std::exception& error) {
    refuse_plugin(std::string("it threw an exception: ") + error.what());
  } catch (...) {
    refuse_plugin("it threw an exception");
  }
  const std::string why = task_message();
  if (!plugin) refuse_plugin(why.empty() ? "it returned no tasks and gave no reason" : why);
  const mjenv_plugin held = read_struct(plugin, "plugin");
  if (held.abi_version != MJENV_ABI_VERSION)
    refuse_plugin("it was built for version " + std::to_string(held.abi_version) +
                  " of mjenv's ABI; this library has " + std::to_string(MJENV_ABI_VERSION) +
                  ": build it again with this library's headers");
  if (held.task_count < 1 || !held.tasks) refuse_plugin("it contains no task");
  return held;
}

// ---- MJENV_TASKS ----

// While MJENV_TASKS is being read, `tasks_read` holds the id of the reading process (upper half) and of the reading
// thread. If the process forks meanwhile, the child sees that the process id is not its own, and reads again.
constexpr std::uint64_t unread = 0, done = 1;
std::atomic<std::uint64_t> tasks_read{unread};
std::atomic<const std::string*> failure{nullptr};  // never freed, like the lists of ids in registry.cpp

std::uint64_t this_reader() { return static_cast<std::uint64_t>(platform::process_id()) << 32 | platform::thread_id(); }

void read_environment() {
  const auto paths = platform::trusted_environment("MJENV_TASKS");
  if (!paths) return;
  std::string failed;
  std::istringstream list(*paths);
  for (std::string path; std::getline(list, path, platform::path_separator);) {
    if (path.empty()) continue;
    try {
      load_tasks(path);
    } catch (const std::bad_alloc&) {
      throw;
    } catch (const std::exception& error) {
      failed += (failed.empty() ? "" : "; ") + std::string(error.what());
    }
  }
  if (!failed.empty()) failure = new std::string(failed);
}

}  // namespace

void load_tasks(const std::string& path) {
  try {
    Handle handle = open(path);
    const mjenv_plugin plugin = call_entry(handle.get());
    std::vector<std::unique_ptr<RegisteredTask>> tasks;
    for (std::int64_t i = 0; i < plugin.task_count; ++i) {
      if (!plugin.tasks[i]) refuse_plugin("tasks[" + std::to_string(i) + "] is NULL");
      tasks.push_back(users_task(plugin.tasks[i], handle.get()));
    }
    add_tasks(std::move(tasks));
    static_cast<void>(handle.release());  // the plug-in stays loaded, because it contains the callbacks
  } catch (const Error& error) {
    fail(error.status(), "plug-in " + quoted(path) + ": " + error.what());
  }
}

void load_tasks_of_environment() {
  if (tasks_read == done) return;
  const std::uint64_t me = this_reader();
  for (std::uint64_t seen = unread; !tasks_read.compare_exchange_strong(seen, me);) {
    if (seen == done || seen == me) return;  // seen == me: this thread is loading a plug-in, which looks up an id
    // If `seen` names a thread of this process, that thread is reading, so wait for it. If it names another process,
    // this process is a forked child whose parent was reading, so read here.
    if (seen >> 32 == me >> 32) {
      std::this_thread::yield();
      seen = unread;
    }
  }
  try {
    read_environment();
  } catch (const std::exception&) {  // there was no memory: the next call tries again
    tasks_read = unread;
    throw;
  }
  tasks_read = done;
}

std::string environment_failure() {
  const std::string* text = failure;
  return text ? *text : "";
}

}  // namespace mjenv::core
