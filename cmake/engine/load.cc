// Loads models with the engine that is compiled in. Unlike mj_loadXML it takes no lock and keeps no model for
// mj_saveLastXML, so threads that load models share nothing.
#include "engine/load.hpp"

#include <cstddef>
#include <memory>
#include <unordered_set>

#include "engine/engine_forward.h"
#include "engine/engine_io.h"
#include "engine/engine_util_errmem.h"
#include "engine/untrusted/limits.hpp"
#include "user/user_model.h"
#include "user/user_util.h"
#include "xml/xml.h"
#include "xml/xml_util.h"

// In guards.c.
extern "C" void mjenv_limit_hulls(double limit);
extern "C" int mjenv_hulls_exceeded();
// In overlaps.c.
extern "C" double mjenv_contact_work(const mjModel* model, mjData* data, double enough);

namespace mjenv::core {
namespace {

// What MuJoCo holds while this thread loads a model, so that all of it is freed if the load fails.
struct Loading {
  mjCModel* parsed = nullptr;  // by mjParseXML, which loses it if an exception of another kind than its own is thrown
  bool is_constructed = false;
  std::unordered_set<void*> blocks;  // of mju_malloc
  const Limits& limits;

  explicit Loading(const Limits& given) : limits(given) { current = this; }
  ~Loading() {
    current = nullptr;
    for (void* block : blocks) mju_free(block);
  }
  Loading(const Loading&) = delete;
  Loading& operator=(const Loading&) = delete;
  static thread_local Loading* current;
};
thread_local Loading* Loading::current = nullptr;

thread_local void (*handler_of_caller)(const char*);

[[noreturn]] void throw_error(const char* message) { throw mjCError(nullptr, "engine error: %s", message); }

mjCModel* parse(const char* path, const mjVFS& vfs, Loading& loading, char (&error)[1000]) {
  try {
    return mjParseXML(path, &vfs, error, sizeof error);
  } catch (...) {
    if (loading.is_constructed) delete loading.parsed;
    throw;
  }
}

// What MuJoCo's parser and compiler pass to mjenv_find_file. They read only the first file of mjVFS.
struct VirtualFiles : mjVFS {
  const Files* files;
};

// mjParseXML makes a locale in its first call. If that call came from another thread during a fork, the child would
// wait for it for ever. So the first call, which gets no file, is made when the library is loaded.
[[maybe_unused]] const mjCModel* const first_call = mjParseXML(nullptr, nullptr, nullptr, 0);

}  // namespace

const bool kLoadLimitsHulls = true;
const bool kLengthRangesEnd = true;  // see guards.c
const bool kCompilesOnThreads = false;

mjModel* load(const std::string& path, const Files& files, const Limits& limits, std::string& reason) {
  mjenv_limit_hulls(static_cast<double>(limits.of(kHullWork)));
  const std::unique_ptr<VirtualFiles> virtual_files(new VirtualFiles);
  virtual_files->files = &files;
  handler_of_caller = _mjPRIVATE__get_tls_error_fn();
  Loading loading(limits);
  char parse_error[1000] = "";
  const std::unique_ptr<mjCModel> parsed(parse(path.c_str(), *virtual_files, loading, parse_error));
  if (!parsed) {
    reason = parse_error;
    return nullptr;
  }
  mjModel* const model = parsed->Compile(virtual_files.get());
  // MuJoCo's mjCopyError would lose the reason: it calls strncpy with the size of the destination. Where gcc 12 inlines
  // this call, gcc assumes that as many bytes of the source are read, and drops the stores into a source that is
  // smaller.
  if (!model)
    reason = mjenv_hulls_exceeded() ? std::string("the convex hulls of the meshes take too much work") + kUnlessTrusted
                                    : std::string(parsed->GetError().message);
  else
    loading.blocks.clear();  // the model's
  return model;
}

}  // namespace mjenv::core

using mjenv::core::Loading;

// MuJoCo's compiler, which ends with a step of the model, calls this in place of mj_step.
extern "C" void mjenv_test_step(const mjModel* model, mjData* data) {
  if (!Loading::current->limits.trusted() &&
      mjenv_contact_work(model, data, mjenv::core::kContactMicroseconds) > mjenv::core::kContactMicroseconds)
    throw mjCError(nullptr, "so many geoms overlap that a step takes too much work%s", mjenv::core::kUnlessTrusted);
  mj_step(model, data);
}

// MuJoCo's loader, engine_io.c and qhull call these in place of mju_malloc and mju_free.
extern "C" void* mjenv_malloc(std::size_t size) {
  void* const block = mju_malloc(size);
  if (!Loading::current) return block;
  try {
    Loading::current->blocks.insert(block);
  } catch (...) {
    mju_free(block);
    throw;
  }
  return block;
}

extern "C" void mjenv_free(void* block) {
  if (Loading::current) Loading::current->blocks.erase(block);
  mju_free(block);
}

// mjCModel's constructor calls this in place of mj_defaultOption.
extern "C" void mjenv_default_option(mjOption* option) {
  if (Loading::current)
    Loading::current->parsed =
        reinterpret_cast<mjCModel*>(reinterpret_cast<char*>(option) - offsetof(mjCModel, option));
  mj_defaultOption(option);
}

// mjParseXML calls this in place of mjuu_getfiledir, after it has constructed the model.
std::string mjenv_getfiledir(const char* path) {
  if (Loading::current) Loading::current->is_constructed = true;
  return mjuu_getfiledir(path);
}

void mjenv_delete(mjXSchema* schema) { delete schema; }

// MuJoCo's compiler calls this in place of _mjPRIVATE__set_tls_error_fn. Its own handler would leave the compiler by
// longjmp, which skips destructors. An exception reaches the same place.
extern "C" void mjenv_set_error_handler(void (*handler)(const char*)) {
  const bool is_callers = handler == mjenv::core::handler_of_caller;
  _mjPRIVATE__set_tls_error_fn(is_callers ? handler : mjenv::core::throw_error);
}

// MuJoCo's parser and compiler call this in place of mj_findFileVFS, which knows files by their names without the
// folders. If the file is there, makes it the first file and returns 0. Otherwise fails, so that MuJoCo never opens a
// file itself.
extern "C" int mjenv_find_file(const mjVFS* vfs, const char* path) {
  const auto& files = *static_cast<const mjenv::core::VirtualFiles*>(vfs)->files;
  const auto found = files.find(path);
  if (found == files.end() || !found->second) mju_error_s("the file '%s' was not read", path);
  auto* first = const_cast<mjVFS*>(vfs);
  first->filedata[0] = const_cast<char*>(found->second->data());
  first->filesize[0] = static_cast<int>(found->second->size());
  return 0;
}
