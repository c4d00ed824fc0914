// Loads models with the engine that is compiled in. Unlike mj_loadXML it takes no lock and keeps no model for
// mj_saveLastXML, so threads that load models share nothing.
#include "engine/load.hpp"

#include <memory>

#include "engine/engine_util_errmem.h"
#include "engine/untrusted/limits.hpp"
#include "user/user_model.h"
#include "xml/xml.h"

// In guards.c.
extern "C" void mjenv_limit_hulls(double limit);
extern "C" int mjenv_hulls_exceeded();

namespace mjenv::core {
namespace {

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

mjModel* load(const std::string& path, const Files& files, std::int64_t hull_limit, std::string& reason) {
  mjenv_limit_hulls(static_cast<double>(hull_limit));
  const std::unique_ptr<VirtualFiles> virtual_files(new VirtualFiles);
  virtual_files->files = &files;
  char parse_error[1000] = "";
  const std::unique_ptr<mjCModel> parsed(
      mjParseXML(path.c_str(), virtual_files.get(), parse_error, sizeof parse_error));
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
  return model;
}

}  // namespace mjenv::core

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
