#include "task/registry.hpp"

#include <algorithm>
#include <atomic>
#include <iterator>
#include <string_view>

#include "error.hpp"
#include "system/platform.hpp"
#include "task/batch_task.hpp"
#include "task/plugins.hpp"
#include "version.hpp"

namespace mjenv {

namespace robots {
#define ROBOT(name, define) void define(Robot&);
#include "robots/all.def"
#undef ROBOT
void model(Robot&);
}  // namespace robots

namespace core {
namespace {

constexpr Id built_in[] = {
#define VERSION(name, version, define) \
  { name "-v" #version, name, version, {name "-v" #version, robots::define, nullptr}, nullptr }
#define ROBOT(name, define) VERSION(name, 4, define), VERSION(name, 5, define),
#include "robots/all.def"
#undef ROBOT
};
// These are valid ids, but they are not in the list of ids, because they cannot be built with their default options.
constexpr Id unlisted[] = {VERSION("Model", 0, model),
                           {"Batch-v0", "Batch", 0, {"Batch-v0", nullptr, nullptr}, nullptr}};  // see batch_task.hpp
#undef VERSION

const Id* find_unlisted(const std::string& name) {
  const auto found =
      std::find_if(std::begin(unlisted), std::end(unlisted), [&](const Id& id) { return name == id.name; });
  return found == std::end(unlisted) ? nullptr : found;
}

// The list of ids. A registration makes a longer list and publishes it; a published list is never changed or freed. So
// readers need no lock, not even in a forked child or while the process exits.
struct List {
  const Id* const* ids;  // sorted
  std::size_t count;
  const List* older;  // the list that this one replaced; without the pointer, leak checkers would report it
};

// This id exists only in the build for MuJoCo 2, as in Gymnasium.
constexpr std::string_view kOfMujoco2 = "Pusher-v4";

struct Pointers {
  const Id* ids[std::size(built_in)];
  std::size_t count;
};

// Sorts the ids by name, so all.def may list the robots in any order.
constexpr Pointers pointers_to_built_in() {
  Pointers made{};
  for (const Id& id : built_in) {
    if (MJENV_MUJOCO_MAJOR != 2 && id.name == kOfMujoco2) continue;
    std::size_t place = made.count++;
    for (; place > 0 && std::string_view(id.name) < made.ids[place - 1]->name; --place)
      made.ids[place] = made.ids[place - 1];
    made.ids[place] = &id;
  }
  return made;
}

constexpr Pointers first_ids = pointers_to_built_in();
constexpr List first_list{first_ids.ids, first_ids.count, nullptr};
std::atomic<const List*> latest{&first_list};

bool is_before(const Id* a, const std::string& name) { return a->name < name; }

const Id* find(const List& list, const std::string& name) {
  const auto end = list.ids + list.count;
  const auto found = std::lower_bound(list.ids, end, name, is_before);
  return found != end && (*found)->name == name ? *found : nullptr;
}

// An id such as "lab/reach-v0" belongs to the plug-in libmjenv-lab in the folder of this library. The plug-in is loaded when
// a program first asks for one of its ids, so that other programs do not load it. Returns why that failed; "" if it did not
// fail, or if the id has no such prefix.
std::string load_plugin_of(const std::string& id) {
  const std::string prefix = id.substr(0, id.find('/'));
  if (prefix.empty() || prefix.size() == id.size() || prefix.find_first_of("\\.:") != std::string::npos) return "";
  try {
    load_tasks(folder_of(&built_in) + "libmjenv-" + prefix + platform::plugin_suffix);
    return "";
  } catch (const Error& error) {
    return error.what();
  }
}

}  // namespace

std::int64_t id_count() {
  load_tasks_of_environment();
  return static_cast<std::int64_t>(latest.load()->count);
}

const Id& id_at(std::int64_t index) {
  load_tasks_of_environment();
  const List& list = *latest.load();
  check_index("id", index, list.count);
  return *list.ids[index];
}

const Id& id_of(const std::string& name) {
  load_tasks_of_environment();
  if (const Id* found = find(*latest.load(), name)) return *found;
  if (const std::string why = load_plugin_of(name); !why.empty())
    fail(MJENV_E_NAME, "no environment " + quoted(name) + ", because its plug-in cannot be loaded: " + why);
  if (const Id* found = find(*latest.load(), name)) return *found;
  const List& list = *latest.load();
  if (const Id* found = find_unlisted(name)) return *found;
  if (name == kOfMujoco2)
    fail(MJENV_E_NAME, "Pusher-v4 is only supported on mujoco<3, as in Gymnasium, but this library is for MuJoCo " +
                           std::string(MJENV_MUJOCO_TEXT) + ": use Pusher-v5, or mjenv on MuJoCo 2.2.2");
  std::vector<std::string> names;
  for (std::size_t i = 0; i < list.count; ++i) names.emplace_back(list.ids[i]->name);
  for (const Id& id : unlisted) names.emplace_back(id.name);
  const std::string unloaded = environment_failure();
  fail(MJENV_E_NAME, "no environment " + quoted(name) + choices(name, names, "mjenv_id_at") +
                         (unloaded.empty() ? "" : "; MJENV_TASKS: " + unloaded));
}

void add_tasks(std::vector<std::unique_ptr<RegisteredTask>> tasks) {
  auto added = std::make_unique<Id[]>(tasks.size());
  for (std::size_t i = 0; i < tasks.size(); ++i)
    added[i] = {tasks[i]->id().c_str(), tasks[i]->robot().c_str(), tasks[i]->version(), {}, tasks[i].get()};
  for (const List* list = latest;;) {
    std::vector<const Id*> all(list->ids, list->ids + list->count);
    for (std::size_t i = 0; i < tasks.size(); ++i) {
      const std::string& id = tasks[i]->id();
      const Id* known = find_unlisted(id);
      const Id* other = known ? known : find(*list, id);
      if (other) {
        if (!other->registered) fail(MJENV_E_VALUE, "the id " + quoted(id) + " is the id of a built-in task");
        // A plug-in's tasks are registered all together. So if one of its ids is known, all are, and there is nothing
        // to do.
        if (other->registered->plugin() && other->registered->plugin() == tasks[i]->plugin()) return;
      }
      const auto place = std::lower_bound(all.begin(), all.end(), id, is_before);
      if (place != all.end() && (*place)->name == id)
        fail(MJENV_E_VALUE, "the id " + quoted(id) + " is already registered");
      all.insert(place, &added[i]);
    }
    auto ids = std::make_unique<const Id*[]>(all.size());
    std::copy(all.begin(), all.end(), ids.get());
    auto made = std::make_unique<List>(List{ids.get(), all.size(), list});
    if (!latest.compare_exchange_strong(list, made.get())) continue;
    // NOLINTNEXTLINE(clang-analyzer-cplusplus.NewDeleteLeaks): lists and their tasks are never freed
    static_cast<void>(made.release()), static_cast<void>(ids.release()), static_cast<void>(added.release());
    for (auto& task : tasks) static_cast<void>(task.release());
    return platform::keep_loaded(&built_in);  // unloading this library would lose the list
  }
}

std::shared_ptr<const RegisteredTask> task_of(const Id& id) {
  if (id.registered) return {std::shared_ptr<void>(), id.registered};  // lives for ever, so nobody owns it
  const auto made = [](const mjenv_task& task) {
    return std::make_shared<RegisteredTask>(task, RegisteredTask::Origin::built_in);
  };
  return id.built_in.define ? made(Description(id.built_in).task()) : made(batch_task());
}

Options default_options(const Id& id) {
  Options options(id.name);
  task_of(id)->declare(options);
  declare_env_options(options);
  return options;
}

}  // namespace core
}  // namespace mjenv
