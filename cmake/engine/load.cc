// mj_loadXML without the lock and the last model that it keeps for mj_saveLastXML: nothing is shared between threads.
#include <memory>

#include "user/user_model.h"
#include "xml/xml.h"
#include "xml/xml_util.h"

extern "C" {

// In guards.c.
void mjenv_limit_hulls(double limit);
int mjenv_hulls_exceeded();

mjModel* mjenv_load(const char* path, const mjVFS* files, double hull_limit, char* reason, int reason_size) {
  mjenv_limit_hulls(hull_limit);
  const std::unique_ptr<mjCModel> parsed(mjParseXML(path, files, reason, reason_size));
  if (!parsed) return nullptr;
  mjModel* model = parsed->Compile(files);
  if (!model) {
    // A copy, because gcc 12 ends the life of a temporary too early inside a conditional expression.
    const mjCError error = parsed->GetError();
    const char* why = mjenv_hulls_exceeded()
                          ? "the convex hulls of the meshes take too long, unless you trust the model "
                            "and set the option \"trust_xml\""
                          : error.message;
    mjCopyError(reason, why, reason_size);
  }
  return model;
}

}  // extern "C"
