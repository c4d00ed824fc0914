#include "engine/untrusted/mjcf.hpp"

#include <strings.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/load.hpp"
#include "engine/untrusted/element.hpp"
#include "engine/untrusted/files.hpp"
#include "engine/untrusted/folder.hpp"
#include "engine/untrusted/limits.hpp"
#include "error.hpp"

namespace mjenv::core {
namespace {

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
  enum class Kind { mesh, skin, heights, texture } kind;
  std::string name;
  int copies;  // of an image; MuJoCo makes six for the sides of a cube
};

// Reads the model element by element, and then checks its files and its total sizes.
class Check {
 public:
  Check(const std::string& path, bool trusted) : limits_(trusted), folder_(path, limits_), included_{path} {}
  Mjcf run(const std::string& text);

 private:
  const Limits limits_;
  Folder folder_;
  std::vector<std::string> included_;
  std::vector<File> files_;
  Counts counts_;
  Sizes sizes_;
  Settings settings_;
  bool has_muscles_ = false;
  // A joint without a type has the type of its default class. Here it counts as the default class with the most degrees
  // of freedom.
  std::int64_t dofs_ = 0, untyped_joints_ = 0, max_default_dofs_ = 1;
  std::int64_t text_bytes_ = 0, file_bytes_ = 0, pixels_ = 0, numbers_ = 0, hull_work_ = 0;

  // A check of all elements with this name or parent.
  struct Rule {
    const char *parent, *name;     // null for any
    std::int64_t Counts::*counts;  // what the element is counted as; may be null
    void (Check::*check)(const Element& element);
  };
  static const Rule kRules[];

  // An attribute that holds one integer, which is -1 or more.
  struct IntegerRule {
    const char *element, *attribute;
    Limit limit;
    std::int64_t Sizes::*raises;  // may be null
  };
  static const IntegerRule kIntegers[];

  // Reading.
  void parse(XMLDocument& document, const std::string& text);
  void enter(const XMLElement& xml, std::int64_t level, const std::string& parent);
  void include(const Element& element, std::int64_t level);
  void check(const Element& element);
  void check_integer(const IntegerRule& rule, const Element& element);

  // Checks of one element, named as in MJCF.
  void any(const Element& element);
  void compiler(const Element& element);
  void lengthrange(const Element& element);
  void option(const Element& element);
  void mesh(const Element& element) { surface(element, File::Kind::mesh); }
  void skin(const Element& element);
  void hfield(const Element& element);
  void texture(const Element& element);
  void composite(const Element& element);
  void freejoint(const Element&) { dofs_ += 6; }
  void joint(const Element& element);
  void muscle(const Element&) { has_muscles_ = true; }
  void user(const Element& element) { add_numbers(element, "dim"); }
  void numeric(const Element& element) { add_numbers(element, "size"); }

  void surface(const Element& element, File::Kind kind);
  void add_file(const Element& element, File::Kind kind, const char* attribute);
  void add_numbers(const Element& element, const char* attribute);
  void add_pixels(std::int64_t count, const XMLElement* element = nullptr);
  void add_hull(std::int64_t vertices, const XMLElement* element = nullptr);
  double real(const Element& element, const char* attribute, double fallback) const;

  // Checks of the whole model.
  std::string path_of(const File& file) const;
  void check_files();
  void check_file(const File& file, const std::string& path, const std::string& content);
  void check_sums();

  [[noreturn]] void refuse(const std::string& why, const XMLElement* element = nullptr) const;
  void check_limit(const std::string& what, std::int64_t count, const Limit& limit,
                   const XMLElement* element = nullptr) const;
};

// ---- What is checked ----

// All rules that match an element apply to it.
const Check::Rule Check::kRules[] = {
    {nullptr, nullptr, &Counts::elements, &Check::any},
    {nullptr, "compiler", nullptr, &Check::compiler},
    {nullptr, "lengthrange", nullptr, &Check::lengthrange},
    {nullptr, "option", nullptr, &Check::option},
    {nullptr, "mesh", nullptr, &Check::mesh},
    {nullptr, "skin", nullptr, &Check::skin},
    {nullptr, "hfield", nullptr, &Check::hfield},
    {nullptr, "texture", nullptr, &Check::texture},
    {nullptr, "composite", nullptr, &Check::composite},
    {nullptr, "body", &Counts::bodies, nullptr},
    {nullptr, "freejoint", &Counts::joints, &Check::freejoint},
    {nullptr, "joint", nullptr, &Check::joint},
    {nullptr, "geom", &Counts::geoms, nullptr},
    {nullptr, "site", &Counts::sites, nullptr},
    {nullptr, "camera", &Counts::cameras, nullptr},
    {"equality", nullptr, &Counts::equalities, nullptr},
    {"tendon", nullptr, &Counts::tendons, nullptr},
    {"actuator", nullptr, &Counts::actuators, nullptr},
    {nullptr, "muscle", nullptr, &Check::muscle},
    {"sensor", nullptr, &Counts::sensors, nullptr},
    {"sensor", "user", nullptr, &Check::user},
    {nullptr, "numeric", nullptr, &Check::numeric},
    {nullptr, "key", &Counts::keys, nullptr},
};

const Check::IntegerRule Check::kIntegers[] = {
    {"option", "iterations", kIterations, &Sizes::iterations},
    {"option", "noslip_iterations", kIterations, &Sizes::noslip_iterations},
    {"option", "mpr_iterations", kIterations, nullptr},
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
    {"skin", "subgrid", kSubgrid, nullptr},
    {"user", "dim", kNumericSize, nullptr},
    {"numeric", "size", kNumericSize, nullptr},
    {"quality", "shadowsize", kShadowSize, nullptr},
    {"quality", "offsamples", kSamples, nullptr},
    {"quality", "numslices", kSlices, nullptr},
    {"quality", "numstacks", kSlices, nullptr},
    {"quality", "numquads", kSlices, nullptr},
    {"global", "offwidth", kPictureSide, nullptr},
    {"global", "offheight", kPictureSide, nullptr},
};

// Sums over the whole model.
void Check::check_sums() {
  dofs_ += untyped_joints_ * max_default_dofs_;
  check_limit("degrees of freedom", dofs_, kDofs);

  std::int64_t numbers = numbers_ + sizes_.nuserdata;
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

  const std::int64_t rows = sizes_.njmax;
  check_limit("numbers in a work space",
              rows * (rows + 4 * dofs_) + 70 * sizes_.nconmax + sizes_.nstack + 4 * dofs_ * 700, kWorkNumbers);
  // Newton's method needs a dozen iterations. PGS and the noslip solver use all the iterations that are allowed.
  const std::int64_t sweeps = sizes_.noslip_iterations + (settings_.solver == "PGS" ? sizes_.iterations : 0);
  check_limit(
      "multiplications by the solver in a step",
      (settings_.solver == "Newton" ? (rows + dofs_) * dofs_ * dofs_ : rows * dofs_) + sweeps * rows * rows / 10,
      kMultiplications);
  check_limit("constraints, equalities and degrees of freedom", rows + counts_.equalities + dofs_, kStackRows);

  // MuJoCo finds the range of muscles' lengths by simulation.
  const double step = settings_.range_timestep > 0 ? settings_.range_timestep : settings_.timestep;
  const double steps = static_cast<double>(counts_.actuators) * settings_.range_total / step;
  if (has_muscles_ && !(step > 0 && steps <= static_cast<double>(limits_.of(kRangeSteps))))
    refuse("finding the range of the muscles' lengths would take too many steps of " + number(step) + " s");
}

// ---- Reading ----

Mjcf Check::run(const std::string& text) {
  XMLDocument document;
  parse(document, text);
  XMLElement* root = document.RootElement();
  if (!root) refuse("the XML has no root element");
  if (strcasecmp(root->Value(), "mujoco") != 0)
    refuse("an MJCF model begins with <mujoco>; for URDF, convert it with MuJoCo's own compile program", root);
  enter(*root, 1, "");
  check_files();
  check_sums();
  if (!has_muscles_) return {text, folder_.used()};
  // An error in one of MuJoCo's own threads would end the process.
  root->InsertNewChildElement("compiler")->SetAttribute("usethread", "false");
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return {{printer.CStr(), static_cast<std::size_t>(printer.CStrSize()) - 1}, folder_.used()};
}

void Check::parse(XMLDocument& document, const std::string& text) {
  check_limit("bytes of XML", text_bytes_ += static_cast<std::int64_t>(text.size()), kTextBytes);
  // tinyxml2 needs a hundred bytes of memory for each "<".
  check_limit("elements", std::count(text.begin(), text.end(), '<'), kTags);
  if (text.find('\0') != std::string::npos) refuse("the XML holds a NUL character");
  document.Parse(text.data(), text.size());
  if (document.Error()) refuse("XML parse error " + std::to_string(document.ErrorID()) + ": " + document.ErrorStr());
}

// The elements of an included file replace <include>.
void Check::enter(const XMLElement& xml, std::int64_t level, const std::string& parent) {
  check_limit("levels of elements", level, kLevels, &xml);
  const Element element{xml, xml.Value(), parent};
  if (strcasecmp(xml.Value(), "include") == 0) return include(element, level);
  check(element);
  for (const XMLElement* e = xml.FirstChildElement(); e; e = e->NextSiblingElement())
    enter(*e, level + 1, element.name);
}

void Check::include(const Element& element, std::int64_t level) {
  const std::string name = element.text("file"), path = folder_.path() + name;
  if (name.empty()) refuse("required attribute missing: 'file'", &element.xml);
  for (const auto& other : included_)
    if (strcasecmp(other.c_str(), path.c_str()) == 0)
      refuse("file " + quoted(path) + " already included", &element.xml);
  const std::string content = folder_.read(path, name, kTextBytes);
  XMLDocument document;
  try {
    parse(document, content);
  } catch (const Error& error) {
    fail(MJENV_E_MODEL, "file " + quoted(path) + ": " + error.what());
  }
  included_.push_back(path);
  if (!document.RootElement()) refuse("root element missing in file " + quoted(path), &element.xml);
  for (const XMLElement* e = document.RootElement()->FirstChildElement(); e; e = e->NextSiblingElement())
    enter(*e, level, element.parent);
}

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

void Check::check_integer(const IntegerRule& rule, const Element& element) {
  const std::int64_t value = element.integer(rule.attribute);
  if (value < -1) refuse(std::string(rule.attribute) + " is " + std::to_string(value), &element.xml);
  check_limit(rule.attribute, value, rule.limit, &element.xml);
  if (rule.raises) sizes_.*rule.raises = std::max(sizes_.*rule.raises, value);
}

// ---- Elements ----

// Refuses NaN, because MuJoCo would only warn, and the results would be undefined.
void Check::any(const Element& element) {
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
  for (const char* attribute : {"gaintype", "biastype"})
    if (const auto type = element.text(attribute); type == "muscle" || type == "user") has_muscles_ = true;
}

void Check::compiler(const Element& element) {
  if (const char* folder = element.xml.Attribute("meshdir")) settings_.mesh_folder = folder;
  if (const char* folder = element.xml.Attribute("texturedir")) settings_.texture_folder = folder;
  if (const char* strips = element.xml.Attribute("strippath")) settings_.strips_path = std::strcmp(strips, "true") == 0;
}

void Check::lengthrange(const Element& element) {
  has_muscles_ = true;
  settings_.range_timestep = real(element, "timestep", settings_.range_timestep);
  settings_.range_total = real(element, "inttotal", settings_.range_total);
}

void Check::option(const Element& element) {
  settings_.timestep = real(element, "timestep", settings_.timestep);
  if (const char* solver = element.xml.Attribute("solver")) settings_.solver = solver;
}

void Check::skin(const Element& element) {
  if (element.parent != "composite") surface(element, File::Kind::skin);
}

void Check::hfield(const Element& element) {
  add_pixels(element.integer("nrow") * element.integer("ncol"), &element.xml);
  add_file(element, File::Kind::heights, "file");
}

void Check::texture(const Element& element) {
  const std::int64_t width = element.integer("width"), height = element.integer("height");
  add_pixels(element.text("type") == "2d" ? width * height : 6 * width * width, &element.xml);
  for (const auto side : values_of<std::int64_t>(element.text("gridsize")))
    if (side < 1 || side > 12) refuse("gridsize is " + std::to_string(side), &element.xml);
  for (const char* attribute : {"file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback"})
    add_file(element, File::Kind::texture, attribute);
}

// MuJoCo makes fewer than three objects of each kind for a part of the composite.
void Check::composite(const Element& element) {
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

void Check::joint(const Element& element) {
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
void Check::surface(const Element& element, File::Kind kind) {
  const std::vector<float> coordinates = values_of<float>(element.text("vertex"));
  for (const float x : coordinates)
    if (!(std::abs(x) <= kMaxCoordinate)) refuse("a vertex is too far out", &element.xml);
  const auto vertices = static_cast<std::int64_t>(coordinates.size()) / 3;
  check_limit("vertices", vertices, kVertices, &element.xml);
  for (const auto vertex : values_of<std::int64_t>(element.text("face")))
    if (vertex < 0 || vertex >= vertices)
      refuse("a face has vertex " + std::to_string(vertex) + " of " + std::to_string(vertices), &element.xml);
  if (kind == File::Kind::mesh) add_hull(vertices, &element.xml);
  if (element.text("file").empty()) return;
  for (const char* attribute : {"vertex", "normal", "texcoord", "face"})
    if (element.xml.Attribute(attribute)) refuse(std::string("it has a file and a ") + attribute, &element.xml);
  add_file(element, kind, "file");
}

void Check::add_file(const Element& element, File::Kind kind, const char* attribute) {
  const std::string name = element.text(attribute);
  const bool cube = kind == File::Kind::texture && element.text("type") != "2d";
  if (!name.empty()) files_.push_back({kind, name, cube ? 6 : 1});
}

void Check::add_numbers(const Element& element, const char* attribute) {
  numbers_ += std::max(element.integer(attribute), std::int64_t{0});
}

void Check::add_pixels(std::int64_t count, const XMLElement* element) {
  check_limit("pixels and heights", pixels_ += count, kAllPixels, element);
}

// Assumes that all vertices of the mesh are on its convex hull. The engine that is compiled in counts the actual work.
void Check::add_hull(std::int64_t vertices, const XMLElement* element) {
  if (!kLoadLimitsHulls)
    check_limit("squares of meshes' vertices", hull_work_ += vertices * vertices, kHullWork, element);
}

double Check::real(const Element& element, const char* attribute, double fallback) const {
  if (!element.xml.Attribute(attribute)) return fallback;
  const auto value = element.real(attribute);
  if (!value) refuse(std::string("attribute '") + attribute + "' is not a number", &element.xml);
  return *value;
}

// ---- Files ----

// Runs after all XML has been read, because the last setting of the folders applies.
void Check::check_files() {
  for (const auto& file : files_) {
    const std::string path = path_of(file), content = folder_.read(path, file.name, kFileBytes);
    check_limit("bytes in all files", file_bytes_ += static_cast<std::int64_t>(content.size()), kAllFileBytes);
    try {
      check_file(file, path, content);
    } catch (const Error& error) {
      fail(MJENV_E_MODEL, "file " + quoted(path) + ": " + error.what());
    }
  }
}

void Check::check_file(const File& file, const std::string& path, const std::string& content) {
  switch (file.kind) {
    case File::Kind::mesh: return add_hull(check_mesh(path, content, limits_));
    case File::Kind::skin: return check_skin(content, limits_);
    case File::Kind::heights: return add_pixels(check_heights(path, content, limits_));
    case File::Kind::texture: return add_pixels(file.copies * check_image(path, content, limits_));
  }
}

bool is_absolute(const std::string& path) {
  return !path.empty() && (path[0] == '/' || path[0] == '\\' || path.find(":/") != std::string::npos ||
                           path.find(":\\") != std::string::npos);
}

// Builds the path as MuJoCo does.
std::string Check::path_of(const File& file) const {
  std::string name = settings_.strips_path ? file.name.substr(file.name.find_last_of("/\\") + 1) : file.name;
  if (name.size() < 4) refuse("file " + quoted(file.name) + " has no extension");
  std::string below = file.kind == File::Kind::texture ? settings_.texture_folder : settings_.mesh_folder;
  if (!below.empty() && below.back() != '/' && below.back() != '\\') below += '/';
  if (is_absolute(name)) return name;
  return is_absolute(below) ? below + name : folder_.path() + below + name;
}

// ---- Refusing ----

void Check::check_limit(const std::string& what, std::int64_t count, const Limit& limit,
                        const XMLElement* element) const {
  if (const auto why = limits_.excess(what, count, limit); !why.empty()) refuse(why, element);
}

void Check::refuse(const std::string& why, const XMLElement* element) const {
  std::string place;
  if (element) {
    place = " (element <" + std::string(element->Value()) + ">, line " + std::to_string(element->GetLineNum());
    if (included_.size() > 1) place += " of this file or an included one";
    place += ")";
  }
  fail(MJENV_E_MODEL, why + place);
}

}  // namespace

std::int64_t max_text(bool trusted) { return Limits(trusted).of(kTextBytes); }

Mjcf checked(const std::string& path, const std::string& text, bool trusted) { return Check(path, trusted).run(text); }

}  // namespace mjenv::core
