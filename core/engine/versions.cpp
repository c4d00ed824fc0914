#include "engine/versions.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>

#include "engine/mujoco.hpp"

namespace mjenv::core {
namespace {

struct Release {
  const char *number, *elements, *attributes;
};

// The elements and attributes that each version from 2.3 to 4.0 added to MJCF's schema, as far as 2.2.2 meets them: it
// does not come to the attributes of elements that it does not know. "*" stands for any element.
constexpr Release kVersions[] = {
    {"2.3.0", "config extension instance plugin required",
     "compiler.assetdir composite.curve composite.flat composite.initial composite.size composite.vertex "
     "global.realtime size.memory"},
    {"2.3.1", "", "body.gravcomp general.actdim"},
    {"2.3.3", "", "lengthrange.interval"},
    {"2.3.4", "", "global.ellipsoidinertia"},
    {"2.3.6", "", "muscle.tausmooth pair.solreffriction"},
    {"2.3.7", "jointactuatorfrc",
     "hfield.content_type joint.actuatorforcelimited joint.actuatorforcerange mesh.content_type "
     "texture.content_type"},
    {"3.0.0", "camprojection deformable edge flex flexcomp",
     "camera.focal camera.focalpixel camera.principal camera.principalpixel camera.resolution "
     "camera.sensorsize composite.face flag.eulerdamp flag.invdiscrete flag.island flag.midphase "
     "general.actearly joint.actuatorfrclimited joint.actuatorfrcrange option.ls_iterations "
     "option.ls_tolerance option.o_friction option.sdf_initpoints option.sdf_iterations"},
    {"3.0.1", "", "option.actuatorgroupdisable rgba.frustum scale.frustum"},
    {"3.1.0", "frame", "intvelocity.kv position.kv"},
    {"3.1.2", "", "global.bvactive hfield.elevation rgba.bv rgba.bvactive"},
    {"3.1.3", "", "intvelocity.inheritrange position.inheritrange"},
    {"3.1.4", "", "joint.actuatorgravcomp"},
    {"3.1.5", "replicate", "light.bulbradius material.metallic material.roughness"},
    {"3.1.6", "distance fromto normal",
     "intvelocity.dampratio "
     "position.dampratio position.timeconst"},
    {"3.2.0", "attach model", "camera.orthographic global.orthographic mesh.maxhullvert"},
    {"3.2.1", "emissive metallic occlusion opacity orm rgb roughness", "flag.autoreset rgba.texture texture.nchannel"},
    {"3.2.3", "elasticity",
     "compiler.alignfree connect.site1 connect.site2 flag.nativeccd freejoint.align option.ccd_iterations "
     "option.ccd_tolerance weld.site1 weld.site2"},
    {"3.2.5", "layer", "mesh.inertia"},
    {"3.3.0", "e_kinetic e_potential", ""},
    {"3.3.1", "tendonactuatorfrc",
     "compiler.saveinertial composite.quat fixed.actuatorfrclimited fixed.actuatorfrcrange fixed.armature "
     "spatial.actuatorfrclimited spatial.actuatorfrcrange spatial.armature"},
    {"3.3.3", "", "light.intensity light.range light.texture light.type texture.colorspace"},
    {"3.3.4", "", "global.cameraid"},
    {"3.3.5", "insidesite tactile", "mesh.builtin mesh.params"},
    {"3.3.6", "", "flag.damper flag.spring mesh.material"},
    {"3.4.0", "", "body.sleep flag.sleep option.sleep_tolerance"},
    {"3.5.0", "flexvert",
     "*.delay *.interp *.interval *.nsample camera.output camera.projection rangefinder.camera "
     "rangefinder.data"},
    {"3.6.0", "flexstrain", ""},
    {"3.7.0", "dcmotor",
     "cylinder.armature cylinder.damping damper.armature damper.damping general.armature general.damping "
     "intvelocity.armature intvelocity.damping motor.armature motor.damping muscle.armature muscle.damping "
     "position.armature position.damping velocity.armature velocity.damping"},
    {"3.9.0", "", "flag.diagexact"},
    {"3.10.0", "local", "compiler.conflict"},
    {"3.11.0", "orientation",
     "body.simple general.input geom.adhesion geom.surfacevel intvelocity.actlimited pair.adhesion"},
    {"3.12.0", "pid", "general.ffrange general.velrange light.softness"},
    {"3.13.0", "", "site.mesh"},
    {"3.14.0", "", "flag.ipc"},
    {"3.16.0", "", "body.fuse compiler.savecanonical compiler.savecompiled general.inheritrange"},
    {"3.17.0", "", "compiler.passthrough texture.class texture.embed"},
    {"4.0.0", "",
     "fixed.springyield flag.speculative geom.castshadow joint.springyield key.plastic spatial.springyield "
     "tendon.actuatorfrclimited tendon.actuatorfrcrange tendon.armature tendon.springyield"},
};

constexpr const char* kNewerEngine =
    "load the model with the engine 4.0, which is engine=\"4.0\" in Python and Julia, the feature \"mujoco4\" in Rust "
    "and "
    "libmjenv-mujoco4 in C and C++";

bool has_word(std::string_view words, std::string_view word) {
  for (std::size_t at = words.find(word); at != std::string_view::npos; at = words.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || words[at - 1] == ' ') && (end == words.size() || words[end] == ' ')) return true;
  }
  return false;
}

bool is_newer(const char* version, const char* than) {
  std::array<int, 3> a{}, b{};
  std::sscanf(version, "%d.%d.%d", &a[0], &a[1], &a[2]);
  std::sscanf(than, "%d.%d.%d", &b[0], &b[1], &b[2]);
  return a > b;
}

// Returns the text from the end of the phrase to the next quote.
std::string quoted_after(const std::string& text, const std::string& phrase) {
  const std::size_t at = text.find(phrase);
  if (at == std::string::npos) return "";
  const std::size_t start = at + phrase.size();
  return text.substr(start, text.find('\'', start) - start);
}

}  // namespace

std::string with_version(std::string reason) {
  if (reason.find("Schema violation") == std::string::npos) return reason;
  const std::string attribute = quoted_after(reason, "unrecognized attribute: '");
  const bool is_element = reason.find("unrecognized element") != std::string::npos;
  const std::string element = quoted_after(reason, "Element '");
  const std::string engine = mj_versionString();
  const std::string own = std::string(element).append(".").append(attribute);  // of this element
  const std::string any = std::string("*.").append(attribute);                 // of every element
  while (!reason.empty() && reason.back() == '\n') reason.pop_back();
  reason += "; this is MuJoCo " + engine;
  for (const Release& version : kVersions) {
    if (!is_newer(version.number, engine.c_str())) continue;
    const bool found =
        is_element ? has_word(version.elements, element)
                   : !attribute.empty() && (has_word(version.attributes, own) || has_word(version.attributes, any));
    if (found) return reason + ", and MuJoCo " + version.number + " is the first that knows it: " + kNewerEngine;
  }
  return reason;
}

}  // namespace mjenv::core
