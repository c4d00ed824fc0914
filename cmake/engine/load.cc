// Loads models with the engine that is compiled in. Unlike mj_loadXML it takes no lock and keeps no model for
// mj_saveLastXML, so threads that load models share nothing.
#include "engine/load.hpp"

#include <memory>

#include "engine/untrusted/limits.hpp"
#include "user/user_model.h"
#include "xml/xml.h"

// In guards.c.
extern "C" void mjenv_limit_hulls(double limit);
extern "C" int mjenv_hulls_exceeded();

namespace mjenv::core {
namespace {

// mjParseXML makes a locale in its first call. If that call came from another thread during a fork, the child would
// wait for it for ever. So the first call, which gets no file, is made when the library is loaded.
[[maybe_unused]] const mjCModel* const first_call = mjParseXML(nullptr, nullptr, nullptr, 0);

}  // namespace

const bool kLoadLimitsHulls = true;
const bool kLengthRangesEnd = true;  // see guards.c

mjModel* load(const std::string& path, const mjVFS& files, std::int64_t hull_limit, std::string& reason) {
  mjenv_limit_hulls(static_cast<double>(hull_limit));
  char parse_error[1000] = "";
  const std::unique_ptr<mjCModel> parsed(mjParseXML(path.c_str(), &files, parse_error, sizeof parse_error));
  if (!parsed) {
    reason = parse_error;
    return nullptr;
  }
  mjModel* const model = parsed->Compile(&files);
  // MuJoCo's mjCopyError would lose the reason: it calls strncpy with the size of the destination. Where gcc 12 inlines
  // this call, gcc assumes that as many bytes of the source are read, and drops the stores into a source that is
  // smaller.
  if (!model)
    reason = mjenv_hulls_exceeded() ? std::string("the convex hulls of the meshes take too much work") + kUnlessTrusted
                                    : std::string(parsed->GetError().message);
  return model;
}

}  // namespace mjenv::core
