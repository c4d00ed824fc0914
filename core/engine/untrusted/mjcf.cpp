#include "engine/untrusted/mjcf.hpp"

#include <strings.h>
#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/compile.hpp"
#include "engine/load.hpp"
#include "engine/mujoco.hpp"
#include "engine/untrusted/element.hpp"
#include "engine/untrusted/files.hpp"
#include "engine/untrusted/folder.hpp"
#include "engine/untrusted/limits.hpp"
#include "error.hpp"
#include "system/platform.hpp"

namespace mjenv::core {
namespace {

constexpr const char* kStateRanges =
    "MuJoCo's shared library may simulate without end to find the length ranges of the muscles: set each muscle's "
    "lengthrange, or trust the model and set the option \"trust_xml\" to \"yes\"";

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

// The number of objects in the model. MuJoCo counts the world as a body.
struct Counts {
  std::int64_t elements = 0, bodies = 1, joints = 0, geoms = 0, sites = 0, cameras = 0, tendons = 0, actuators = 0,
               sensors = 0, equalities = 0, keys = 0;
};

// The largest value of each attribute that sets a size. The initial values are MuJoCo's defaults.
struct Sizes {
  std::int64_t njmax = 500, nconmax = 100, nstack = 0, nkey = 0, nuserdata = 0, iterations = 100, noslip_iterations = 0;
  // The length of the user data of each body, joint, ...
  std::int64_t nuser_body = 0, nuser_jnt = 0, nuser_geom = 0, nuser_site = 0, nuser_cam = 0, nuser_tendon = 0,
               nuser_actuator = 0, nuser_sensor = 0;
};

// If the model sets one of these attributes several times, the last value applies.
struct Settings {
  std::string mesh_folder, texture_folder, solver = "Newton";
  bool strips_path = false;
  double timestep = 0.002, range_timestep = 0.01, range_total = 10;
};

struct File {
  enum class Kind { mesh, flex, gmsh, skin, heights, texture } kind;
  std::string name;
  int factor;             // of an image: 6 if it is one side of a cube; of a flex: the degrees of freedom of each point
  std::string including;  // the folder of the included file that refers to it; "" for the model's own file
};

bool is_absolute(const std::string& path) {
  return !path.empty() && (path[0] == '/' || path[0] == '\\' || path.find(":/") != std::string::npos ||
                           path.find(":\\") != std::string::npos);
}

// A body or frame that can be attached elsewhere, with its level and its parent.
struct Node {
  const XMLElement* xml;
  std::int64_t level;
  std::string parent;
};

// A model that is being read: the one to load, or one that its <asset> section names.
struct Source {
  explicit Source(const std::string& path) : folder(path.substr(0, path.find_last_of("/\\") + 1)), included{path} {}

  struct Child {
    std::string name, path;
    Node root;
  };
  std::string folder;
  std::string including;                                // the folder of the included file that is being read, or ""
  std::vector<std::string> included;                    // its own path, and those of the files that it includes
  std::vector<std::unique_ptr<XMLDocument>> documents;  // of the included files and the children
  Settings settings;
  std::vector<File> files;
  std::map<std::string, Node> named;             // the bodies and frames that have been read
  std::vector<Child> children;                   // models that can be attached
  std::map<std::string, std::int64_t> attached;  // how often each child is attached
};

// How many attributes the element with the most of them has. If tinyxml2 finds an error, elements after it may count.
std::int64_t most_attributes(std::string_view text) {
  static constexpr std::array<std::string_view, 2> others[] = {
      {"<!--", "-->"}, {"<![CDATA[", "]]>"}, {"<!", ">"}, {"<?", "?>"}};
  std::int64_t most = 0;
  for (std::size_t at = text.find('<'); at < text.size(); at = text.find('<', at)) {
    const auto* other = std::find_if(std::begin(others), std::end(others),
                                     [&](const auto& kind) { return text.compare(at, kind[0].size(), kind[0]) == 0; });
    if (other != std::end(others)) {
      at = text.find((*other)[1], at + (*other)[0].size());
      continue;
    }
    std::int64_t count = 0;
    for (at = text.find_first_of("\"'>", at); at < text.size() && text[at] != '>';
         at = text.find_first_of("\"'>", at + 1)) {
      most = std::max(most, ++count);
      at = text.find(text[at], at + 1);
      if (at == std::string_view::npos) return most;
    }
  }
  return most;
}

// Reads the model element by element, and then checks its files and its total sizes.
class Check {
 public:
  Check(const std::string& path, bool trusted) : limits_(trusted), folder_(path, limits_), source_(path) {}

  Mjcf run(const std::string& text) {
    XMLDocument document;
    parse(document, text);
    XMLElement* root = document.RootElement();
    if (!root) refuse("the XML has no root element");
    if (strcasecmp(root->Value(), "mujoco") != 0)
      refuse("an MJCF model begins with <mujoco>; for URDF, convert it with MuJoCo's own compile program", root);
    read(*root, 1);
    check_sums();
    if (!has_muscles_ && !has_meshes_ && !kCompilesOnThreads) return {text, folder_.files()};
    XMLElement* compiler = root->InsertNewChildElement("compiler");
    // An error in one of MuJoCo's own threads would end the process.
    compiler->SetAttribute("usethread", "false");
    const bool states_ranges = has_muscles_ && must_state_ranges();
    if (states_ranges) compiler->InsertNewChildElement("lengthrange")->SetAttribute("mode", "none");
    tinyxml2::XMLPrinter printer;
    document.Print(&printer);
    return {{printer.CStr(), static_cast<std::size_t>(printer.CStrSize()) - 1}, folder_.files(), states_ranges};
  }

 private:
  const Limits limits_;
  Folder folder_;
  Source source_;
  Counts counts_;
  Sizes sizes_;
  bool has_muscles_ = false, has_meshes_ = false;
  // copies_: how many copies of an element the enclosing replicas make; max_copies_: the most so far. replicas_: how
  // many replicas and attachments there are in all; attachments_: how many of these attach a body or frame of their own
  // model. Each replica and attachment may also copy elements that refer to something in it (references_).
  std::int64_t copies_ = 1, max_copies_ = 1, replicas_ = 0, attachments_ = 0, references_ = 0;
  // wide_samples_: how many samples there are of sensors that have several values for each pixel or vertex.
  std::int64_t wide_samples_ = 0, max_camera_pixels_ = 0, vertices_ = 0, triangles_ = 0;
  // A joint without a type has the type of its default class. Here it counts as the joint with the most dofs of any
  // default class.
  std::int64_t dofs_ = 0, untyped_joints_ = 0, max_default_dofs_ = 1;
  std::string jacobian_;
  std::set<std::string> tendon_joints_;  // those that the present fixed tendon has named so far
  std::optional<std::string> repeated_joint_;
  std::int64_t text_bytes_ = 0, file_bytes_ = 0, pixels_ = 0, numbers_ = 0, hull_cubes_ = 0;

  // A check of all elements with this parent and name.
  struct Rule {
    const char *parent, *name;     // null for any
    std::int64_t Counts::*counts;  // what the element is counted as; may be null
    void (Check::*check)(const Element& element);
  };
  static const Rule kRules[];

  // An attribute that holds one integer of -1 or more.
  struct IntegerRule {
    const char *element, *attribute;
    Limit limit;
    std::int64_t Sizes::*raises;  // may be null
  };
  static const IntegerRule kIntegers[];

  // ---- Reading ----

  void parse(XMLDocument& document, const std::string& text) {
    check_limit("bytes of XML", text_bytes_ += static_cast<std::int64_t>(text.size()), kTextBytes);
    // The number of "<" is limited, because tinyxml2 needs a hundred bytes of memory for each.
    check_limit("elements", std::count(text.begin(), text.end(), '<'), kTags);
    if (text.find('\0') != std::string::npos) refuse("the XML holds a NUL character");
    check_limit("attributes of an element", most_attributes(text), kAttributes);
    document.Parse(text.data(), text.size());
    if (document.Error()) refuse("XML parse error " + std::to_string(document.ErrorID()) + ": " + document.ErrorStr());
  }

  // The root of a file's document, which lives as long as source_.
  const XMLElement& parse_file(const std::string& path, const std::string& name) {
    const std::string& content = folder_.read(path, name, kTextBytes);
    auto document = std::make_unique<XMLDocument>();
    try {
      parse(*document, content);
    } catch (const Error& error) {
      fail(MJENV_E_MODEL, "file " + quoted(path) + ": " + error.what());
    }
    const XMLElement* root = document->RootElement();
    if (!root) refuse("root element missing in file " + quoted(path));
    source_.documents.push_back(std::move(document));
    return *root;
  }

  // Reads a whole model with the files that it includes and the models that it attaches.
  void read(const XMLElement& root, std::int64_t level) {
    enter(root, level, "");
    check_files();
    for (const auto& child : source_.children) {
      const auto found = source_.attached.find(child.name);
      // MuJoCo copies the whole child with each attachment.
      for (std::int64_t i = found == source_.attached.end() ? 1 : found->second; i > 0; --i) read_child(child);
    }
  }

  void read_child(const Source::Child& child) {
    Source parent = std::exchange(source_, Source(child.path));
    read(*child.root.xml, child.root.level);
    source_ = std::move(parent);
  }

  void enter(const XMLElement& xml, std::int64_t level, const std::string& parent) {
    check_limit("levels of elements", level, kLevels, &xml);
    const Element element{xml, xml.Value(), parent};
    if (strcasecmp(xml.Value(), "include") == 0) return include(element, level);
    check(element);
    if (element.name == "replicate") return replicate(element, level);
    if (element.name == "attach") return attach(element, level);
    if (element.name == "model" && parent == "asset") return add_child(element, level);
    if (element.name == "body" || element.name == "frame")
      source_.named[element.name + " " + element.text("name")] = {&xml, level, parent};
    enter_children({&xml, level + 1, element.name});
  }

  void enter_children(const Node& node) {
    for (const XMLElement* e = node.xml->FirstChildElement(); e; e = e->NextSiblingElement())
      enter(*e, node.level, node.parent);
  }

  // The elements of an included file replace <include>.
  void include(const Element& element, std::int64_t level) {
    const std::string name = element.text("file");
    std::string path = source_.folder + name;
    if (name.empty()) refuse("required attribute missing: 'file'", &element.xml);
    if (kIncludesHaveFolders && is_absolute(name))
      path = name;
    else if (kIncludesHaveFolders && !source_.including.empty() && !folder_.has(path))
      path = source_.including + name;
    for (const auto& other : source_.included)
      if (strcasecmp(other.c_str(), path.c_str()) == 0)
        refuse("file " + quoted(path) + " already included", &element.xml);
    source_.included.push_back(path);
    const XMLElement& root = parse_file(path, name);
    const std::string outer = std::exchange(source_.including, path.substr(0, path.find_last_of("/\\") + 1));
    enter_children({&root, level, element.parent});
    source_.including = outer;
  }

  void replicate(const Element& element, std::int64_t level) {
    const std::int64_t count = element.integer("count"), outside = copies_;
    if (count < 1) refuse("count is " + std::to_string(count), &element.xml);
    check_limit("replicas", count, kReplicas, &element.xml);
    check_limit("replicas", replicas_ += count, kReplicas, &element.xml);
    copies_ *= count;
    max_copies_ = std::max(max_copies_, copies_);
    for (std::int64_t i = 0; i < count; ++i) enter_children({&element.xml, level + 1, element.parent});
    copies_ = outside;
  }

  // Attaches a copy of another model, or of a body or a frame that came earlier in this model.
  void attach(const Element& element, std::int64_t level) {
    check_limit("attachments", ++replicas_, kReplicas, &element.xml);
    if (const std::string model = element.text("model"); !model.empty()) {
      ++source_.attached[model];
      return;
    }
    ++attachments_;
    for (const char* kind : {"body", "frame"}) {
      const std::string name = element.text(kind);
      if (name.empty()) continue;
      const auto found = source_.named.find(std::string(kind) + " " + name);
      if (found != source_.named.end()) {
        const Node node = found->second;
        enter(*node.xml, level + 1, node.parent);
      } else if (!limits_.trusted()) {
        refuse("no " + std::string(kind) + " " + quoted(name) +
                   " comes before this element; a copy that a replica or another attachment makes cannot be attached",
               &element.xml);
      }
    }
  }

  // Reads an element <model> of the <asset> section.
  void add_child(const Element& element, std::int64_t level) {
    const std::string file = element.text("file"), path = is_absolute(file) ? file : source_.folder + file;
    if (file.empty()) refuse("required attribute missing: 'file'", &element.xml);
    check_content_type(element, file);
    check_limit("levels of elements", level + 1, kLevels, &element.xml);
    const XMLElement& root = parse_file(path, file);
    if (strcasecmp(root.Value(), "mujoco") != 0)
      refuse("file " + quoted(path) + " is not a model in MJCF", &element.xml);
    std::string name = element.text("name");
    if (name.empty()) name = Element{root, "mujoco", ""}.text("model");
    source_.children.push_back({name, path, {&root, level + 1, ""}});
  }

  void check(const Element& element);

  void check_integer(const IntegerRule& rule, const Element& element) {
    const std::int64_t value = element.integer(rule.attribute);
    if (value < -1) refuse(std::string(rule.attribute) + " is " + std::to_string(value), &element.xml);
    check_limit(rule.attribute, value, rule.limit, &element.xml);
    if (rule.raises) sizes_.*rule.raises = std::max(sizes_.*rule.raises, value);
  }

  // ---- Elements, by their names in MJCF ----

  [[noreturn]] void plugin(const Element& element) { refuse("plugins are not supported", &element.xml); }
  void reference(const Element&) { ++references_; }
  void freejoint(const Element&) { dofs_ += 6; }
  void muscle(const Element&) { has_muscles_ = true; }
  bool must_state_ranges() const { return !kLengthRangesEnd && !limits_.trusted(); }
  void user(const Element& element) { add_numbers(element, "dim"); }
  void numeric(const Element& element) { add_numbers(element, "size"); }

  // Checks every element. Refuses NaN, because MuJoCo would only warn, and the results would be undefined.
  void any(const Element& element) {
    for (const auto* a = element.xml.FirstAttribute(); a; a = a->Next()) {
      std::string_view text = a->Value();
      while (!text.empty()) {
        const std::size_t end = std::min(text.find_first_of(" \t\n\v\f\r"), text.size());
        std::string_view word = text.substr(0, end);
        if (!word.empty() && (word[0] == '-' || word[0] == '+')) word.remove_prefix(1);
        if (word.size() == 3 && strncasecmp(word.data(), "nan", 3) == 0)
          refuse(std::string("attribute '") + a->Name() + "' is not a number", &element.xml);
        text.remove_prefix(std::min(end + 1, text.size()));
      }
    }
    for (const char* attribute : {"name", "class", "prefix"})
      check_limit(std::string("bytes of '") + attribute + "'",
                  static_cast<std::int64_t>(element.text(attribute).size()), kNameBytes, &element.xml);
    for (const char* attribute : {"gaintype", "biastype"})
      if (const auto type = element.text(attribute); type == "muscle" || type == "user") has_muscles_ = true;
  }

  void compiler(const Element& element) {
    Settings& settings = source_.settings;
    if (const char* folder = element.xml.Attribute("assetdir")) settings.mesh_folder = settings.texture_folder = folder;
    if (const char* folder = element.xml.Attribute("meshdir")) settings.mesh_folder = folder;
    if (const char* folder = element.xml.Attribute("texturedir")) settings.texture_folder = folder;
    if (const char* strips = element.xml.Attribute("strippath"))
      settings.strips_path = std::strcmp(strips, "true") == 0;
    if (const auto kept = element.text("passthrough"); !kept.empty() && kept != "none") refuse_late_files(element);
  }

  // Refuses files that are read only when the model is drawn, because they could change after they were checked.
  void refuse_late_files(const Element& element) const {
    if (!limits_.trusted())
      refuse(std::string("textures must be read when the model is loaded, not when it is drawn") + kUnlessTrusted,
             &element.xml);
  }

  // Checks the attribute memory, which limits the memory of the arrays of a step. It is a number of bytes, or of the
  // unit that follows the number.
  void size(const Element& element) {
    const std::string text = element.text("memory");
    if (text.empty()) return;
    constexpr std::string_view kUnits = "KMGTPE";
    const std::int64_t number = element.integer("memory");
    const std::size_t last = text.find_last_not_of(" \t\n\v\f\r");
    const std::size_t unit = last == std::string::npos
                                 ? std::string::npos
                                 : kUnits.find(static_cast<char>(std::toupper(static_cast<unsigned char>(text[last]))));
    const double bytes =
        std::ldexp(static_cast<double>(number), unit == std::string::npos ? 0 : 10 * (static_cast<int>(unit) + 1));
    if (bytes > static_cast<double>(limits_.of(kArenaBytes)))
      refuse("memory is " + text + "; the limit is " + std::to_string(limits_.of(kArenaBytes)) + " bytes",
             &element.xml);
  }

  void lengthrange(const Element& element) {
    has_muscles_ = true;
    Settings& settings = source_.settings;
    settings.range_timestep = real(element, "timestep", settings.range_timestep);
    settings.range_total = real(element, "inttotal", settings.range_total);
    // With these settings, MuJoCo computes the ranges anew even if the model states them.
    const auto mode = element.text("mode");
    const bool computes_stated = mode == "all" || mode == "muscleuser" || element.text("useexisting") == "false" ||
                                 element.text("uselimit") == "true";
    if (must_state_ranges() && computes_stated) refuse(kStateRanges, &element.xml);
  }

  void option(const Element& element) {
    source_.settings.timestep = real(element, "timestep", source_.settings.timestep);
    if (const char* solver = element.xml.Attribute("solver")) source_.settings.solver = solver;
    if (const char* jacobian = element.xml.Attribute("jacobian")) jacobian_ = jacobian;
  }

  void fixed_tendon(const Element&) { tendon_joints_.clear(); }
  void tendon_joint(const Element& element) {
    const std::string joint = element.text("joint");
    if (!tendon_joints_.insert(joint).second) repeated_joint_ = joint;
  }

  void mesh(const Element& element) {
    has_meshes_ = true;
    add_built_in(element);
    surface(element, File::Kind::mesh);
  }

  // Counts the vertices of a mesh that MuJoCo makes from parameters. Its first parameters set its resolution.
  void add_built_in(const Element& element) {
    const std::string type = element.text("builtin");
    std::vector<std::int64_t> counts;
    for (const auto value : values_of<double>(element.text("params"))) {
      if (!(std::abs(value) <= kMaxCoordinate)) refuse("a parameter is too large", &element.xml);
      counts.push_back(std::max(std::int64_t{1}, static_cast<std::int64_t>(value) + 1));
    }
    if (type.empty() || type == "sphere" || type == "hemisphere" || counts.empty()) return;  // these are small
    const bool is_square = type == "supersphere" || type == "supertorus";
    const bool is_flat = type == "wedge" || type == "plate" || type == "square" || type == "disc";
    counts.resize(is_square || type == "cone" ? 1 : is_flat ? 2 : 3, 1);
    std::int64_t vertices = is_square ? counts[0] : 2;
    for (const auto count : counts) check_limit("vertices", vertices *= count, kVertices, &element.xml);
    add_mesh({vertices, 2 * vertices}, "", &element.xml);
  }

  void skin(const Element& element) {
    if (element.parent != "composite") surface(element, File::Kind::skin);
  }

  void hfield(const Element& element) {
    add_pixels(element.integer("nrow") * element.integer("ncol"), &element.xml);
    add_file(element, File::Kind::heights, "file");
  }

  void texture(const Element& element) {
    const std::int64_t width = element.integer("width"), height = element.integer("height");
    const std::int64_t channels = std::max(element.integer("nchannel"), std::int64_t{3});
    add_pixels((element.text("type") == "2d" ? width * height : 6 * width * width) * channels / 3, &element.xml);
    if (element.text("embed") == "false") refuse_late_files(element);
    for (const auto side : values_of<std::int64_t>(element.text("gridsize")))
      if (side < 1 || side > 12) refuse("gridsize is " + std::to_string(side) + ", but must be 1 to 12", &element.xml);
    for (const char* attribute : {"file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback"})
      add_file(element, File::Kind::texture, attribute, element.text("type") == "2d" ? 1 : 6);
  }

  // Counts three objects of each kind for each part of the composite. MuJoCo never makes more.
  void composite(const Element& element) {
    std::int64_t parts = 1, subgrid = 0;
    for (const auto side : values_of<std::int64_t>(element.text("count"))) {
      if (side < 1) refuse("count is " + std::to_string(side), &element.xml);
      check_limit("elements in a row", side, kElements, &element.xml);
      check_limit("elements of a composite", parts *= side, kCompositeParts, &element.xml);
    }
    for (const auto* skin = element.xml.FirstChildElement("skin"); skin; skin = skin->NextSiblingElement("skin")) {
      const std::int64_t value = Element{*skin, "skin", "composite"}.integer("subgrid");
      check_limit("subgrid", value, kSubgrid, skin);
      subgrid = std::max(subgrid, value);
    }
    check_limit("vertices of the skin", 2 * parts * (subgrid + 1) * (subgrid + 1), kVertices, &element.xml);
    for (auto* made : {&counts_.elements, &counts_.bodies, &counts_.joints, &counts_.geoms, &counts_.sites,
                       &counts_.tendons, &counts_.equalities, &dofs_})
      *made += 3 * parts;
  }

  // MuJoCo makes a body with three joints, or up to four in a rod (dim 1), from each point, or from each node of the
  // grid around the points.
  void flexcomp(const Element& element) {
    const auto numbers = [&](const char* attribute, std::vector<std::int64_t> values) {
      const auto given = values_of<std::int64_t>(element.text(attribute));
      std::copy_n(given.begin(), std::min(given.size(), values.size()), values.begin());
      for (const auto value : values) {
        if (value < 1) refuse(std::string(attribute) + " is " + std::to_string(value), &element.xml);
        check_limit(attribute, value, kElements, &element.xml);
      }
      return values;
    };
    const std::string type = element.text("type"), dof = element.text("dof");
    const std::int64_t dim = element.xml.Attribute("dim") ? element.integer("dim") : 2;
    const int dofs_each = dim == 1 ? 4 : 3;  // the edges of a rod can twist
    const bool has_nodes = dof == "trilinear" || dof == "quadratic";
    if (has_nodes) {
      const std::int64_t order = dof == "quadratic" ? 2 : 1;
      std::int64_t nodes = 1;
      for (const auto side : numbers("cellcount", {1, 1, 1}))
        check_limit("nodes of a flexcomp", nodes *= order * side + 1, kCompositeParts, &element.xml);
      add_points(nodes, dofs_each);
    }
    std::int64_t points = 0;
    if (type == "mesh") {
      has_meshes_ = true;
      add_file(element, File::Kind::flex, "file", has_nodes ? 0 : dofs_each);
    } else if (type == "gmsh") {
      if (!limits_.trusted()) refuse(std::string("files of Gmsh are not read") + kUnlessTrusted, &element.xml);
      add_file(element, File::Kind::gmsh, "file");
    } else if (type == "direct") {
      points = static_cast<std::int64_t>(values_of<double>(element.text("point")).size()) / 3;
    } else {
      auto count = numbers("count", {10, 10, 10});
      if (type.empty() || type == "grid") count.resize(static_cast<std::size_t>(std::clamp<std::int64_t>(dim, 1, 3)));
      points = 1;
      for (const auto side : count) check_limit("points of a flexcomp", points *= side, kCompositeParts, &element.xml);
    }
    check_limit("points of a flexcomp", points, kCompositeParts, &element.xml);
    add_points(points, has_nodes ? 0 : dofs_each);
  }

  void camera(const Element& element) {
    const auto sides = values_of<std::int64_t>(element.text("resolution"));
    if (sides.size() < 2) return;
    for (const auto side : sides) check_limit("resolution", side, kPictureSide, &element.xml);
    max_camera_pixels_ = std::max(max_camera_pixels_, sides[0] * sides[1]);
  }

  void actuator(const Element& element) {
    reference(element);
    add_numbers(element, "nsample");
    add_numbers(element, "actdim");
  }

  void sensor(const Element& element) {
    reference(element);
    constexpr std::int64_t kNumbersPerContact = 23;  // at most
    const std::int64_t samples = 1 + count_of(element, "nsample");
    if (element.name == "tactile" || (element.name == "rangefinder" && element.xml.Attribute("camera")))
      wide_samples_ += samples;
    else
      add_numbers(samples * kNumbersPerContact * std::max(count_of(element, "num"), std::int64_t{1}));
  }

  void joint(const Element& element) {
    if (element.parent == "equality" || element.parent == "fixed") return;  // these refer to a joint
    const std::string type = element.text("type");
    const std::int64_t dofs = type == "free" ? 6 : type == "ball" ? 3 : 1;
    ++counts_.joints;
    if (element.parent == "default")
      max_default_dofs_ = std::max(max_default_dofs_, dofs);
    else if (type.empty())
      ++untyped_joints_;
    else
      dofs_ += dofs;
  }

  // Checks a mesh or a skin, whose vertices and faces are in the element or in a file.
  void surface(const Element& element, File::Kind kind) {
    const std::vector<float> coordinates = values_of<float>(element.text("vertex"));
    for (const float x : coordinates)
      if (!(std::abs(x) <= kMaxCoordinate)) refuse("a vertex has a coordinate that is too large", &element.xml);
    const auto vertices = static_cast<std::int64_t>(coordinates.size()) / 3;
    check_limit("vertices", vertices, kVertices, &element.xml);
    for (const auto vertex : values_of<std::int64_t>(element.text("face")))
      if (vertex < 0 || vertex >= vertices)
        refuse("a face has vertex " + std::to_string(vertex) + " of " + std::to_string(vertices), &element.xml);
    if (kind == File::Kind::mesh) add_mesh({vertices, 0}, "", &element.xml);
    if (element.text("file").empty()) return;
    for (const char* attribute : {"vertex", "normal", "texcoord", "face"})
      if (element.xml.Attribute(attribute))
        refuse(std::string("the attributes 'file' and '") + attribute + "' exclude each other", &element.xml);
    add_file(element, kind, "file");
  }

  void add_file(const Element& element, File::Kind kind, const char* attribute, int factor = 1) {
    const std::string name = element.text(attribute);
    if (name.empty()) return;
    check_content_type(element, name);
    source_.files.push_back({kind, name, factor, source_.including});
  }

  // Bounds each number, so that products fit into 64 bits.
  std::int64_t count_of(const Element& element, const char* attribute) const {
    const std::int64_t count = std::max(element.integer(attribute), std::int64_t{0});
    check_limit(attribute, count, kNumericSize, &element.xml);
    return count;
  }

  void add_numbers(const Element& element, const char* attribute) { add_numbers(count_of(element, attribute)); }
  void add_numbers(std::int64_t count) {
    check_limit("numbers in user data and keyframes", numbers_ += count, kNumbers);
  }

  void add_pixels(std::int64_t count, const XMLElement* element = nullptr) {
    check_limit("pixels and heights", pixels_ += std::max(count, std::int64_t{0}), kAllPixels, element);
  }

  // Counts each point of a flex as an element, two bodies and dofs_each joints. dofs_each is 0 if the points have no
  // joints.
  void add_points(std::int64_t points, std::int64_t dofs_each) {
    check_limit("points of a flexcomp", points, kCompositeParts);
    counts_.elements += points;
    counts_.bodies += 2 * points;  // rods have another body for each edge
    counts_.joints += dofs_each * points;
    dofs_ += dofs_each * points;
  }

  // Limits the work on the mesh's convex hull, unless load() does. For a large mesh in a file, computes how many
  // vertices the hull has, but stops when there are more than the limit still allows. For other meshes, assumes that
  // all vertices are on the hull.
  void add_mesh(const MeshSize& size, const std::string& file, const XMLElement* element = nullptr) {
    check_limit("vertices in all meshes", vertices_ += size.vertices, kAllVertices, element);
    check_limit("triangles in all meshes", triangles_ += size.triangles, kAllTriangles, element);
    if (kLoadLimitsHulls || limits_.trusted()) return;
    constexpr std::int64_t kSmall = 1'000;  // vertices of a hull that takes a hundredth of a second
    const auto most = static_cast<std::int64_t>(std::cbrt(static_cast<double>(kHullCubes - hull_cubes_)));
    std::int64_t vertices = size.vertices;
    if (!file.empty() && vertices > std::min(kSmall, most))
      vertices =
          std::min(vertices, hull_vertices(file, folder_.files(), std::max(kSmall, most) + 1).value_or(vertices));
    if (vertices > most)
      refuse(std::string("the convex hulls of the meshes take too much work") + kUnlessTrusted, element);
    hull_cubes_ += vertices * vertices * vertices;
  }

  double real(const Element& element, const char* attribute, double fallback) const {
    if (!element.xml.Attribute(attribute)) return fallback;
    const auto value = element.real(attribute);
    if (!value) refuse(std::string("attribute '") + attribute + "' is not a number", &element.xml);
    return *value;
  }

  // ---- Files ----

  // Call this after all XML has been read, because the last setting of the folders applies to all files.
  void check_files() {
    for (const auto& file : source_.files) {
      const std::string path = path_of(file);
      const std::string& content = folder_.read(path, file.name, kFileBytes);
      check_limit("bytes in all files", file_bytes_ += static_cast<std::int64_t>(content.size()), kAllFileBytes);
      try {
        check_file(file, path, content);
      } catch (const Error& error) {
        fail(MJENV_E_MODEL, "file " + quoted(path) + ": " + error.what());
      }
    }
  }

  void check_file(const File& file, const std::string& path, const std::string& content) {
    switch (file.kind) {
      case File::Kind::mesh: return add_mesh(check_mesh(path, content, limits_), path);
      case File::Kind::flex: return add_points(check_mesh(path, content, limits_).vertices, file.factor);
      case File::Kind::gmsh: return;
      case File::Kind::skin: return check_skin(content, limits_);
      case File::Kind::heights: return add_pixels(check_heights(path, content, limits_));
      case File::Kind::texture: return add_pixels(file.factor * check_image(path, content, limits_));
    }
  }

  // Builds the path of a file as MuJoCo does. MuJoCo 4.0 looks in the model's folder, then in the folder of the
  // included file.
  std::string path_of(const File& file) {
    std::string path = path_of(file, file.name);
    if (!kIncludesHaveFolders || file.including.empty() || is_absolute(file.name) || folder_.has(path)) return path;
    return path_of(file, file.including + file.name);
  }

  std::string path_of(const File& file, const std::string& given) const {
    const Settings& settings = source_.settings;
    std::string name = settings.strips_path ? given.substr(given.find_last_of("/\\") + 1) : given;
    if (name.size() < 4) refuse("file " + quoted(file.name) + " has no extension");
    std::string below = file.kind == File::Kind::texture ? settings.texture_folder : settings.mesh_folder;
    if (!below.empty() && below.back() != '/' && below.back() != '\\') below += '/';
    if (is_absolute(name)) return name;
    return is_absolute(below) ? below + name : source_.folder + below + name;
  }

  // MuJoCo chooses a file's format by the content type, or by the extension if there is no content type.
  void check_content_type(const Element& element, const std::string& file) const {
    const std::string given = element.text("content_type");
    if (given.empty()) return;
    std::string extension = file.substr(std::min(file.find_last_of('.'), file.size()));
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    for (const auto& [type, fitting] : {std::pair{"model/obj", ".obj"},
                                        {"model/stl", ".stl"},
                                        {"model/vnd.mujoco.msh", ".msh"},
                                        {"image/png", ".png"},
                                        {"text/xml", ".xml"}})
      if (given == type && extension == fitting) return;
    refuse("the content type " + quoted(given) + " does not fit the extension of file " + quoted(file), &element.xml);
  }

  // Checks the sums over the whole model.
  void check_sums() {
    dofs_ += untyped_joints_ * max_default_dofs_;
    check_limit("degrees of freedom", dofs_, kDofs);
    // MuJoCo writes an element of a sparse Jacobian for each joint that a fixed tendon names. If it names one twice,
    // there may be more elements than the matrix has room for.
    constexpr std::int64_t kSparseDofs = 60;  // from this many on, MuJoCo chooses sparse Jacobians itself
    if (repeated_joint_ && (jacobian_ == "sparse" || (jacobian_ != "dense" && dofs_ >= kSparseDofs)))
      refuse(
          "a fixed tendon names the joint " + quoted(*repeated_joint_) +
          " twice, which MuJoCo cannot compute with sparse Jacobians; name it once, with the sum of the coefficients");

    const std::int64_t copies = max_copies_ + attachments_;
    check_limit("elements", counts_.elements + references_ * (copies - 1), kElements);
    for (auto* referring : {&counts_.tendons, &counts_.actuators, &counts_.sensors, &counts_.equalities})
      *referring *= copies;

    constexpr std::int64_t kNumbersPerPixel = 14, kNumbersPerVertex = 3;  // at most
    const std::int64_t wide = std::max(kNumbersPerPixel * max_camera_pixels_, kNumbersPerVertex * vertices_);
    for (const std::int64_t each : {std::int64_t{1}, wide})
      check_limit("numbers that sensors return for pixels or vertices", copies * wide_samples_ * each, kWideNumbers);
    std::int64_t numbers = copies * numbers_ + sizes_.nuserdata;
    for (const auto& [count, numbers_each] : {std::pair{counts_.bodies, sizes_.nuser_body},
                                              {counts_.joints, sizes_.nuser_jnt},
                                              {counts_.geoms, sizes_.nuser_geom},
                                              {counts_.sites, sizes_.nuser_site},
                                              {counts_.cameras, sizes_.nuser_cam},
                                              {counts_.tendons, sizes_.nuser_tendon},
                                              {counts_.actuators, sizes_.nuser_actuator},
                                              {counts_.sensors, sizes_.nuser_sensor}})
      numbers += count * numbers_each;
    const std::int64_t keyframe = 2 * dofs_ + 2 * counts_.joints + counts_.actuators + 7 * counts_.bodies;
    numbers += std::max(counts_.keys, sizes_.nkey) * keyframe;
    check_limit("numbers in user data and keyframes", numbers, kNumbers);

    const Settings& settings = source_.settings;
    const std::int64_t rows = sizes_.njmax;
    check_limit("numbers in a work space",
                rows * (rows + 4 * dofs_) + 70 * sizes_.nconmax + sizes_.nstack + 4 * dofs_ * 700, kWorkNumbers);
    // Newton's method needs a dozen iterations. PGS and the noslip solver use all the iterations that are allowed.
    const std::int64_t sweeps = sizes_.noslip_iterations + (settings.solver == "PGS" ? sizes_.iterations : 0);
    check_limit(
        "multiplications by the solver in a step",
        (settings.solver == "Newton" ? (rows + dofs_) * dofs_ * dofs_ : rows * dofs_) + sweeps * rows * rows / 10,
        kMultiplications);
    check_limit("constraints, equalities and degrees of freedom", rows + counts_.equalities + dofs_, kStackRows);

    // MuJoCo finds the range of muscles' lengths by simulation.
    const double step = settings.range_timestep > 0 ? settings.range_timestep : settings.timestep;
    const double steps = static_cast<double>(counts_.actuators) * settings.range_total / step;
    if (has_muscles_ && !(step > 0 && steps <= static_cast<double>(limits_.of(kRangeSteps))))
      refuse("finding the range of the muscles' lengths would take too many steps of " + number(step) + " s");
  }

  // ---- Refusing ----

  void check_limit(const std::string& what, std::int64_t count, const Limit& limit,
                   const XMLElement* element = nullptr) const {
    if (const auto why = limits_.excess(what, count, limit); !why.empty()) refuse(why, element);
  }

  [[noreturn]] void refuse(const std::string& why, const XMLElement* element = nullptr) const {
    std::string place;
    if (element) {
      place = " (element <" + std::string(element->Value()) + ">, line " + std::to_string(element->GetLineNum());
      if (source_.included.size() > 1) place += " of this file or an included one";
      place += ")";
    }
    fail(MJENV_E_MODEL, why + place);
  }
};

// ---- What is checked ----

// All rules that match an element apply to it.
const Check::Rule Check::kRules[] = {
    {nullptr, nullptr, &Counts::elements, &Check::any},
    {nullptr, "compiler", nullptr, &Check::compiler},
    {nullptr, "lengthrange", nullptr, &Check::lengthrange},
    {nullptr, "option", nullptr, &Check::option},
    {nullptr, "mesh", nullptr, &Check::mesh},
    {nullptr, "size", nullptr, &Check::size},
    {nullptr, "skin", nullptr, &Check::skin},
    {nullptr, "hfield", nullptr, &Check::hfield},
    {nullptr, "texture", nullptr, &Check::texture},
    {nullptr, "composite", nullptr, &Check::composite},
    {nullptr, "flexcomp", nullptr, &Check::flexcomp},
    {nullptr, "plugin", nullptr, &Check::plugin},
    {nullptr, "body", &Counts::bodies, nullptr},
    {nullptr, "freejoint", &Counts::joints, &Check::freejoint},
    {nullptr, "joint", nullptr, &Check::joint},
    {nullptr, "geom", &Counts::geoms, nullptr},
    {nullptr, "site", &Counts::sites, nullptr},
    {nullptr, "camera", &Counts::cameras, &Check::camera},
    {"contact", nullptr, nullptr, &Check::reference},
    {"deformable", nullptr, nullptr, &Check::reference},
    {"equality", nullptr, &Counts::equalities, &Check::reference},
    {"tendon", nullptr, &Counts::tendons, &Check::reference},
    {"tendon", "fixed", nullptr, &Check::fixed_tendon},
    {"fixed", "joint", nullptr, &Check::tendon_joint},
    {"actuator", nullptr, &Counts::actuators, &Check::actuator},
    {nullptr, "muscle", nullptr, &Check::muscle},
    {"sensor", nullptr, &Counts::sensors, &Check::sensor},
    {"sensor", "user", nullptr, &Check::user},
    {nullptr, "numeric", nullptr, &Check::numeric},
    {nullptr, "key", &Counts::keys, nullptr},
};

const Check::IntegerRule Check::kIntegers[] = {
    {"option", "iterations", kIterations, &Sizes::iterations},
    {"option", "noslip_iterations", kIterations, &Sizes::noslip_iterations},
    {"option", "mpr_iterations", kIterations, nullptr},
    {"option", "ccd_iterations", kIterations, nullptr},
    {"option", "ls_iterations", kSearches, nullptr},
    {"option", "sdf_iterations", kSearches, nullptr},
    {"option", "sdf_initpoints", kSearches, nullptr},
    {"size", "njmax", kConstraints, &Sizes::njmax},
    {"size", "nconmax", kConstraints, &Sizes::nconmax},
    {"size", "nstack", kWorkNumbers, &Sizes::nstack},
    {"size", "nkey", kElements, &Sizes::nkey},
    {"size", "nuserdata", kNumbers, &Sizes::nuserdata},
    {"size", "nuser_body", kNumbers, &Sizes::nuser_body},
    {"size", "nuser_jnt", kNumbers, &Sizes::nuser_jnt},
    {"size", "nuser_geom", kNumbers, &Sizes::nuser_geom},
    {"size", "nuser_site", kNumbers, &Sizes::nuser_site},
    {"size", "nuser_cam", kNumbers, &Sizes::nuser_cam},
    {"size", "nuser_tendon", kNumbers, &Sizes::nuser_tendon},
    {"size", "nuser_actuator", kNumbers, &Sizes::nuser_actuator},
    {"size", "nuser_sensor", kNumbers, &Sizes::nuser_sensor},
    {"hfield", "nrow", kPixels, nullptr},
    {"hfield", "ncol", kPixels, nullptr},
    {"texture", "width", kTextureWidth, nullptr},
    {"texture", "height", kTextureHeight, nullptr},
    {"texture", "nchannel", kChannels, nullptr},
    {"skin", "subgrid", kSubgrid, nullptr},
    {"user", "dim", kNumericSize, nullptr},
    {"numeric", "size", kNumericSize, nullptr},
    {"general", "actdim", kNumericSize, nullptr},
    {"contact", "num", kReported, nullptr},
    {"quality", "shadowsize", kShadowSize, nullptr},
    {"quality", "offsamples", kSamples, nullptr},
    {"quality", "numslices", kSlices, nullptr},
    {"quality", "numstacks", kSlices, nullptr},
    {"quality", "numquads", kSlices, nullptr},
    {"global", "offwidth", kPictureSide, nullptr},
    {"global", "offheight", kPictureSide, nullptr},
};

void Check::check(const Element& element) {
  for (const IntegerRule& rule : kIntegers)
    if (element.name == rule.element) check_integer(rule, element);
  for (const Rule& rule : kRules) {
    if ((rule.parent && element.parent != rule.parent) || (rule.name && element.name != rule.name)) continue;
    if (rule.counts) ++(counts_.*rule.counts);
    if (rule.check) (this->*rule.check)(element);
  }
  check_limit("elements", counts_.elements, kElements, &element.xml);
}

}  // namespace

void check_length_ranges(const mjModel_& m) {
  for (int i = 0; i < m.nu; ++i) {
    const bool is_muscle = m.actuator_gaintype[i] == mjGAIN_MUSCLE || m.actuator_biastype[i] == mjBIAS_MUSCLE;
    if (is_muscle && !(m.actuator_lengthrange[2 * i] < m.actuator_lengthrange[2 * i + 1]))
      fail(MJENV_E_MODEL, kStateRanges);
  }
}

std::int64_t max_text(bool trusted) { return Limits(trusted).of(kTextBytes); }
Mjcf checked(const std::string& path, const std::string& text, bool trusted) { return Check(path, trusted).run(text); }

}  // namespace mjenv::core
