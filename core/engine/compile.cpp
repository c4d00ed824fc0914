#include "engine/compile.hpp"

#include <tinyxml2.h>

#include <memory>
#include <new>

#include "engine/errors.hpp"
#include "engine/load.hpp"
#include "engine/mujoco.hpp"
#include "engine/untrusted/limits.hpp"
#include "error.hpp"
#include "system/platform.hpp"

namespace mjenv::core {
namespace {

// If MuJoCo refuses a model because of the schema of MJCF, appends MuJoCo's version, on which the schema depends. A
// newer MuJoCo may know an unknown element or attribute, so this then also says where to get one.
std::string with_version(std::string reason) {
  if (reason.find("Schema violation") == std::string::npos) return reason;
  while (reason.back() == '\n') reason.pop_back();
  const bool is_unknown = reason.find("unrecognized") != std::string::npos;
  return reason + "; this is MuJoCo " + mj_versionString() + (is_unknown ? kNewerEngine : "");
}

}  // namespace

mjModel* compile(const std::string& folder, const std::string& text, Files files, const Limits& limits) {
  const platform::ClassicLocale locale;
  const ErrorTrap trap;
  if (text.empty()) fail(MJENV_E_MODEL, "it is empty");
  const std::string path = folder + "<model>";
  files[path] = std::make_shared<const std::string>(text);
  std::string reason;
  if (mjModel* model = load(path, files, limits, reason)) {
    std::unique_ptr<mjModel, void (*)(mjModel*)> owned(model, mj_deleteModel);
    check_supported(*owned);
    return owned.release();
  }
  if (lacks_memory(reason.c_str())) throw std::bad_alloc();
  fail(MJENV_E_MODEL, with_version(reason));
}

std::optional<std::int64_t> hull_vertices(const std::string& mesh_file, const Files& files, std::int64_t at_most) {
  tinyxml2::XMLDocument document;
  auto* root = document.NewElement("mujoco");
  document.InsertEndChild(root);
  // MuJoCo must not start threads of its own, because an error in one of them would end the process.
  root->InsertNewChildElement("compiler")->SetAttribute("usethread", "false");
  auto* mesh = root->InsertNewChildElement("asset")->InsertNewChildElement("mesh");
  mesh->SetAttribute("name", "mesh");
  mesh->SetAttribute("file", mesh_file.c_str());
  mesh->SetAttribute("maxhullvert", at_most);
  mesh->SetAttribute("inertia", "shell");
  auto* geom = root->InsertNewChildElement("worldbody")->InsertNewChildElement("geom");
  geom->SetAttribute("type", "mesh");
  geom->SetAttribute("mesh", "mesh");
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  try {
    const std::unique_ptr<mjModel, void (*)(mjModel*)> model(
        compile("", printer.CStr(), {{mesh_file, files.at(mesh_file)}}, Limits(true)), mj_deleteModel);
    return model->mesh_graph[model->mesh_graphadr[0]];
  } catch (const Error&) {
    return std::nullopt;
  }
}

}  // namespace mjenv::core
