// The files that a model refers to: meshes, skins, heights and textures.
#include <array>

#include "folder.hpp"
#include "target.hpp"

namespace {

struct Kind {
  const char *name, *asset, *geom;
};

constexpr const char* mesh = "<geom type='mesh' mesh='a' mass='1'/>";
constexpr std::array<Kind, 8> kinds{{
    {"a.obj", "<mesh name='a' file='a.obj'/>", mesh},
    {"a.stl", "<mesh name='a' file='a.stl'/>", mesh},
    {"a.msh", "<mesh name='a' file='a.msh' scale='1 -1 1'/>", mesh},
    {"a.skn", "<skin name='a' file='a.skn'/>", ""},
    {"a.png", "<texture name='a' type='2d' file='a.png'/>", ""},
    {"a.bin", "<texture name='a' file='a.bin' gridsize='1 2'/>", ""},
    {"h.png", "<hfield name='a' size='1 1 1 1' file='h.png'/>", ""},
    {"h.bin", "<hfield name='a' size='1 1 1 1' file='h.bin'/>", ""},
}};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  Bytes bytes(data, size);
  const Kind& kind = kinds[bytes.below(kinds.size())];
  const std::string floor = kind.name[0] == 'h' ? "<geom type='hfield' hfield='a'/>" : "";
  write(folder.path / kind.name, bytes.rest());
  write(folder.path / "model.xml", std::string("<mujoco><asset>") + kind.asset + "</asset><worldbody>" + floor +
                                       "<body name='torso' pos='0 0 .5'><joint type='slide'/><joint type='slide'/>"
                                       "<joint/><geom size='.5'/>" +
                                       kind.geom + "</body></worldbody></mujoco>");
  const OptionsHandle options = options_of("InvertedPendulum-v5");
  const std::string path = folder.path / "model.xml";
  REQUIRE(mjenv_options_set_string(options.get(), "xml_file", path.c_str()) == MJENV_OK);
  REQUIRE(mjenv_options_set_string(options.get(), "trust_xml", "no") == MJENV_OK);
  const EnvHandle env = create(options, 1);
  if (!env) return 0;
  check(mjenv_reset(env.get(), nullptr, nullptr));
  check(mjenv_step(env.get(), nullptr, nullptr, 0, MJENV_DTYPE_FLOAT64, nullptr));
  draw_all(env);
  return 0;
}
