#include "engine/untrusted/mjcf.hpp"

#include <strings.h>
#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <sstream>
#include <string_view>
#include <vector>

#include "engine/untrusted/files.hpp"
#include "error.hpp"

namespace mjenv::core {
namespace {

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

struct Limits {
  std::int64_t text, elements, depth, files;
  std::int64_t dofs, numbers, rows, iterations, range_steps, solver;
};

// Of a stranger's model: what loads in seconds, and a work space of at most about a gigabyte.
constexpr Limits stranger{std::int64_t{16} << 20, 50'000, 100, 1000, 3000, 1 << 26, 10'000, 10'000, 2'000'000,
                          1'000'000'000};
// Of any: where MuJoCo's own sums overflow.
constexpr Limits trusted_{std::int64_t{1} << 30,
                          10'000'000,
                          100,
                          100'000,
                          100'000,
                          1 << 28,
                          1'000'000'000,
                          1'000'000'000,
                          1'000'000'000,
                          std::numeric_limits<std::int64_t>::max()};

class Check {
 public:
  explicit Check(const Mjcf& model)
      : model_(model),
        limits_(model.trusted ? trusted_ : stranger),
        file_limits_(file_limits(model.trusted)),
        folder_(model.path.substr(0, model.path.find_last_of("/\\") + 1)) {}

  std::string run() {
    XMLDocument document;
    parse(document, model_.text);
    XMLElement* root = document.RootElement();
    if (!root) refuse(nullptr, "the XML has no root element");
    if (strcasecmp(root->Value(), "mujoco") != 0)
      refuse(root, "an MJCF model begins with <mujoco>; for URDF, convert it with MuJoCo's own compile program");
    included_.push_back(model_.path);
    enter(*root, 1, "");
    check_files();
    dofs_ += untyped_joints_ * default_dofs_;
    check_sums();
    if (!runs_threads_) return model_.text;
    // Errors in MuJoCo's threads would end the process.
    root->InsertNewChildElement("compiler")->SetAttribute("usethread", "false");
    tinyxml2::XMLPrinter printer;
    document.Print(&printer);
    return {printer.CStr(), static_cast<std::size_t>(printer.CStrSize()) - 1};
  }

 private:
  // A file, and what it is to the model.
  struct File {
    enum class Kind { mesh, skin, heights, texture } kind;
    std::string name;
    bool cube;
  };

  const Mjcf& model_;
  const Limits limits_;
  const FileLimits file_limits_;
  const std::string folder_;
  std::vector<std::string> included_;
  std::vector<File> files_;
  std::string mesh_folder_, texture_folder_;
  bool strips_path_ = false, runs_threads_ = false;
  std::int64_t text_ = 0, elements_ = 0, file_count_ = 0, pixels_ = 0, bytes_ = 0;
  std::int64_t bodies_ = 1, joints_ = 0, geoms_ = 0, sites_ = 0, cameras_ = 0, tendons_ = 0, actuators_ = 0,
               sensors_ = 0, equalities_ = 0, dofs_ = 0, keys_ = 0, keys_wanted_ = 0, numbers_ = 0, user_data_ = 0,
               rows_ = 500, stack_ = 0, contacts_ = 100;
  std::int64_t untyped_joints_ = 0, default_dofs_ = 1;  // the most of any class
  std::array<std::int64_t, 8> user_{};  // numbers of each body, joint, geom, site, camera, tendon, actuator, sensor
  std::int64_t iterations_ = 100, noslip_ = 0;
  std::string solver_ = "Newton";
  double timestep_ = 0.002, range_timestep_ = 0.01, range_total_ = 10;

  [[noreturn]] void refuse(const XMLElement* element, const std::string& why) const {
    std::string place;
    if (element) {
      place = " (element <" + std::string(element->Value()) + ">, line " + std::to_string(element->GetLineNum());
      if (included_.size() > 1) place += " of this file or an included one";
      place += ")";
    }
    fail(MJENV_E_MODEL, why + place);
  }

  void check_most(const XMLElement* element, const std::string& what, std::int64_t count, std::int64_t most) const {
    if (count <= most) return;
    refuse(element, std::to_string(count) + " " + what + ", of which there may be " + std::to_string(most) +
                        (model_.trusted ? "" : "; set the option \"trust_xml\" if the model comes from a friend"));
  }

  void parse(XMLDocument& document, const std::string& text) {
    check_most(nullptr, "bytes of XML", text_ += static_cast<std::int64_t>(text.size()), limits_.text);
    // tinyxml2 makes a hundred bytes of a "<".
    check_most(nullptr, "elements", std::count(text.begin(), text.end(), '<'), 2 * limits_.elements + 1000);
    if (text.find('\0') != std::string::npos) refuse(nullptr, "the XML holds a NUL character");
    document.Parse(text.data(), text.size());
    if (document.Error())
      refuse(nullptr, "XML parse error " + std::to_string(document.ErrorID()) + ": " + document.ErrorStr());
  }

  // ---- Files ----

  // A path as MuJoCo opens it, once the model is known to be allowed to.
  std::string allowed(const std::string& path, const std::string& name) {
    if (path.find('\0') != std::string::npos || path.size() > 900)
      refuse(nullptr, "file " + quoted(name) + " cannot be read: it has no proper name");
    check_most(nullptr, "files", ++file_count_, limits_.files);
    if (model_.trusted) return path;
    if (model_.path.empty())
      refuse(nullptr,
             "the model refers to file " + quoted(name) +
                 ", but as it comes from memory it has no folder; set the option \"trust_xml\" to let it read any");
    const std::string own = real_path(folder_.empty() ? "." : folder_), real = real_path(path);
    if (real.compare(0, own.size(), own) != 0 || (own != "/" && real[own.size()] != '/'))
      refuse(nullptr, "file " + quoted(path) + " is outside of the model's folder " + quoted(own) +
                          "; set the option \"trust_xml\" to let the model read any");
    return path;
  }

  std::string real_path(const std::string& path) const {
    char* real = realpath(path.c_str(), nullptr);
    if (!real) refuse(nullptr, "file " + quoted(path) + " cannot be read: " + std::strerror(errno));
    std::string found(real);
    std::free(real);
    return found;
  }

  void include(const XMLElement& element, std::int64_t depth, const std::string& parent) {
    const std::string name = text_of(element, "file"), path = folder_ + name;
    if (name.empty()) refuse(&element, "required attribute missing: 'file'");
    for (const auto& other : included_)
      if (strcasecmp(other.c_str(), path.c_str()) == 0) refuse(&element, "file " + quoted(path) + " already included");
    const std::string content = read_file(allowed(path, name), limits_.text);
    XMLDocument document;
    try {
      parse(document, content);
    } catch (const Error& error) {
      fail(MJENV_E_MODEL, "file " + quoted(path) + ": " + error.what());
    }
    included_.push_back(path);
    if (!document.RootElement()) refuse(&element, "root element missing in file " + quoted(path));
    for (const XMLElement* e = document.RootElement()->FirstChildElement(); e; e = e->NextSiblingElement())
      enter(*e, depth, parent);
  }

  static bool is_absolute(const std::string& path) {
    return !path.empty() && (path[0] == '/' || path[0] == '\\' || path.find(":/") != std::string::npos ||
                             path.find(":\\") != std::string::npos);
  }

  std::string path_of(const File& file, const std::string& subfolder) const {
    std::string name = strips_path_ ? file.name.substr(file.name.find_last_of("/\\") + 1) : file.name;
    if (name.size() < 4) refuse(nullptr, "file " + quoted(file.name) + " has no extension");
    std::string below = subfolder;
    if (!below.empty() && below.back() != '/' && below.back() != '\\') below += '/';
    if (is_absolute(name)) return name;
    return is_absolute(below) ? below + name : folder_ + below + name;
  }

  // When all of the XML has been read, as its last word on folders counts.
  void check_files() {
    for (const auto& file : files_) {
      const bool picture = file.kind == File::Kind::texture;
      const std::string path = allowed(path_of(file, picture ? texture_folder_ : mesh_folder_), file.name);
      const std::string content = read_file(path, file_limits_.bytes);
      check_most(nullptr, "bytes in all files", bytes_ += static_cast<std::int64_t>(content.size()),
                 8 * file_limits_.bytes);
      try {
        check_file(file, path, content);
      } catch (const Error& error) {
        fail(MJENV_E_MODEL, "file " + quoted(path) + ": " + error.what());
      }
    }
  }

  void check_file(const File& file, const std::string& path, const std::string& content) {
    switch (file.kind) {
      case File::Kind::mesh: check_mesh(path, content, file_limits_); break;
      case File::Kind::skin: check_skin(content, file_limits_); break;
      case File::Kind::heights:
      case File::Kind::texture:
        add_pixels(nullptr,
                   (file.cube ? 6 : 1) * check_image(path, content, file_limits_, file.kind == File::Kind::heights));
    }
  }

  void add_pixels(const XMLElement* element, std::int64_t count) {
    check_most(element, "pixels and heights", pixels_ += count, 2 * file_limits_.pixels);
  }

  // ---- Elements ----

  static std::string text_of(const XMLElement& element, const char* attribute) {
    const char* text = element.Attribute(attribute);
    return text ? text : "";
  }

  // As MuJoCo reads a single integer: the number at the front of the text.
  static std::int64_t integer(const XMLElement& element, const char* attribute, std::int64_t otherwise) {
    const char* text = element.Attribute(attribute);
    return text ? std::strtoll(text, nullptr, 10) : otherwise;
  }

  // As MuJoCo reads the first of an attribute's numbers: a word, of which 1e-400 is 0.
  double real(const XMLElement& element, const char* attribute, double otherwise) const {
    if (!element.Attribute(attribute)) return otherwise;
    std::istringstream text(text_of(element, attribute));
    std::string word;
    text >> word;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (strcasecmp(word.c_str(), "inf") == 0) return infinity;
    if (strcasecmp(word.c_str(), "-inf") == 0) return -infinity;
    std::istringstream from(word);
    double value = 0;
    if (!(from >> value) || !from.eof()) refuse(&element, std::string("attribute '") + attribute + "' is not a number");
    return value;
  }

  // The numbers at the front of the text, by a stream in the process's locale as MuJoCo has it.
  template <typename T>
  static std::vector<T> list(const std::string& text) {
    std::istringstream from(text);
    std::vector<T> values;
    for (T value; from >> value;) values.push_back(value);
    return values;
  }

  void check_count(const XMLElement& element, const char* attribute, std::int64_t& largest, std::int64_t most) const {
    const std::int64_t count = integer(element, attribute, 0);
    if (count < -1) refuse(&element, std::string(attribute) + " is " + std::to_string(count));
    check_most(&element, attribute, count, most);
    largest = std::max(largest, count);
  }

  void add_numbers(const XMLElement& element, const char* attribute) {
    std::int64_t count = 0;
    check_count(element, attribute, count, 1'000'000);
    numbers_ += count;
  }

  void add_file(const XMLElement& element, File::Kind kind, const char* attribute) {
    const char* name = element.Attribute(attribute);
    if (!name || !*name) return;
    const bool cube = kind == File::Kind::texture && text_of(element, "type") != "2d";
    files_.push_back({kind, name, cube});
  }

  // An included file's elements take the place of <include>.
  void enter(const XMLElement& element, std::int64_t depth, const std::string& parent) {
    check_most(&element, "levels of elements", depth, limits_.depth);
    if (strcasecmp(element.Value(), "include") == 0) return include(element, depth, parent);
    check_most(&element, "elements", ++elements_, limits_.elements);
    visit(element, parent);
    for (const XMLElement* e = element.FirstChildElement(); e; e = e->NextSiblingElement())
      enter(*e, depth + 1, element.Value());
  }

  void visit(const XMLElement& element, const std::string& parent) {
    const std::string name = element.Value();
    check_numbers(element);
    if (name == "compiler") return compiler(element);
    if (name == "lengthrange") return length_range(element);
    if (name == "option") return option(element);
    if (name == "size") return size(element);
    if (name == "composite") return composite(element);
    if (name == "mesh") return surface(element, File::Kind::mesh);
    if (name == "skin" && parent != "composite") return surface(element, File::Kind::skin);
    if (name == "hfield") return heights(element);
    if (name == "texture") return texture(element);
    if (name == "numeric") return add_numbers(element, "size");
    if (name == "user" && parent == "sensor") add_numbers(element, "dim");
    if (name == "quality" || name == "global") return picture(element);
    if (name == "key") ++keys_;
    if (name == "body") ++bodies_;
    if (name == "geom") ++geoms_;
    if (name == "site") ++sites_;
    if (name == "camera") ++cameras_;
    if (parent == "equality") ++equalities_;
    if (parent == "tendon") ++tendons_;
    if (parent == "sensor") ++sensors_;
    if (parent == "actuator") ++actuators_;
    if (name == "freejoint" || (name == "joint" && parent != "equality" && parent != "fixed")) joint(element, parent);
    for (const char* attribute : {"gaintype", "biastype"})
      if (const auto type = text_of(element, attribute); type == "muscle" || type == "user") runs_threads_ = true;
    if (name == "muscle") runs_threads_ = true;
  }

  // MuJoCo warns of it and goes on; whatever follows is undefined.
  void check_numbers(const XMLElement& element) const {
    for (const auto* a = element.FirstAttribute(); a; a = a->Next()) {
      std::string_view text = a->Value();
      while (!text.empty()) {
        const std::size_t end = std::min(text.find_first_of(" \t\n\v\f\r"), text.size());
        std::string_view token = text.substr(0, end);
        if (!token.empty() && (token[0] == '-' || token[0] == '+')) token.remove_prefix(1);
        if (token.size() == 3 && strncasecmp(token.data(), "nan", 3) == 0)
          refuse(&element, std::string("attribute '") + a->Name() + "' is not a number");
        text.remove_prefix(std::min(end + 1, text.size()));
      }
    }
  }

  void compiler(const XMLElement& element) {
    if (const char* folder = element.Attribute("meshdir")) mesh_folder_ = folder;
    if (const char* folder = element.Attribute("texturedir")) texture_folder_ = folder;
    if (const char* strips = element.Attribute("strippath")) strips_path_ = std::strcmp(strips, "true") == 0;
  }

  void length_range(const XMLElement& element) {
    runs_threads_ = true;
    range_timestep_ = real(element, "timestep", range_timestep_);
    range_total_ = real(element, "inttotal", range_total_);
  }

  void option(const XMLElement& element) {
    timestep_ = real(element, "timestep", timestep_);
    if (const char* solver = element.Attribute("solver")) solver_ = solver;
    std::int64_t collisions = 0;
    check_count(element, "iterations", iterations_, limits_.iterations);
    check_count(element, "noslip_iterations", noslip_, limits_.iterations);
    check_count(element, "mpr_iterations", collisions, limits_.iterations);
  }

  void size(const XMLElement& element) {
    static constexpr std::array<const char*, 8> names{"nuser_body", "nuser_jnt",    "nuser_geom",     "nuser_site",
                                                      "nuser_cam",  "nuser_tendon", "nuser_actuator", "nuser_sensor"};
    for (std::size_t i = 0; i < names.size(); ++i) check_count(element, names[i], user_[i], limits_.numbers);
    check_count(element, "njmax", rows_, limits_.rows);
    check_count(element, "nconmax", contacts_, limits_.rows);
    check_count(element, "nstack", stack_, 2 * limits_.numbers);
    check_count(element, "nkey", keys_wanted_, limits_.elements);
    check_count(element, "nuserdata", user_data_, limits_.numbers);
  }

  // What a renderer would make of it.
  void picture(const XMLElement& element) const {
    std::int64_t largest = 0;
    for (const char* attribute : {"shadowsize", "offwidth", "offheight"})
      check_count(element, attribute, largest, 16'384);
    for (const char* attribute : {"numslices", "numstacks", "numquads"})
      check_count(element, attribute, largest, model_.trusted ? 1024 : 128);
    check_count(element, "offsamples", largest, 1024);
  }

  void joint(const XMLElement& element, const std::string& parent) {
    const std::string type = text_of(element, "type");
    const std::int64_t dofs = element.Value()[0] == 'f' || type == "free" ? 6 : type == "ball" ? 3 : 1;
    ++joints_;
    if (parent == "default")
      default_dofs_ = std::max(default_dofs_, dofs);
    else if (element.Value()[0] == 'j' && type.empty())
      ++untyped_joints_;
    else
      dofs_ += dofs;
  }

  // Whatever it makes of each of its elements, it is no more than this.
  void composite(const XMLElement& element) {
    std::int64_t count = 1, subgrid = 0;
    for (const auto side : list<std::int64_t>(text_of(element, "count"))) {
      if (side < 1) refuse(&element, "count is " + std::to_string(side));
      check_most(&element, "elements in a row", side, limits_.elements);
      count *= side;
      check_most(&element, "elements of a composite", count, limits_.elements / 20);
    }
    for (const auto* skin = element.FirstChildElement("skin"); skin; skin = skin->NextSiblingElement("skin"))
      check_count(*skin, "subgrid", subgrid, 64);
    check_most(&element, "vertices of the skin", 2 * count * (subgrid + 1) * (subgrid + 1), file_limits_.vertices);
    for (auto* made : {&elements_, &bodies_, &joints_, &geoms_, &sites_, &tendons_}) *made += 3 * count;
    equalities_ += 3 * count;
    dofs_ += 3 * count;
  }

  // The vertices and faces of a mesh or a skin, which are in a file or here.
  void surface(const XMLElement& element, File::Kind kind) {
    add_file(element, kind, "file");
    const std::vector<float> vertices = list<float>(text_of(element, "vertex"));
    for (const float x : vertices)
      if (!(std::abs(x) <= 1 << 30)) refuse(&element, "a vertex is too far out");
    check_most(&element, "vertices", static_cast<std::int64_t>(vertices.size()) / 3, file_limits_.vertices);
    const std::int64_t count = static_cast<std::int64_t>(vertices.size()) / 3;
    for (const auto vertex : list<std::int64_t>(text_of(element, "face")))
      if (vertex < 0 || vertex >= count)
        refuse(&element, "a face has vertex " + std::to_string(vertex) + " of " + std::to_string(count));
    if (text_of(element, "file").empty()) return;
    for (const char* attribute : {"vertex", "normal", "texcoord", "face"})
      if (element.Attribute(attribute)) refuse(&element, std::string("it has a file and a ") + attribute);
  }

  void heights(const XMLElement& element) {
    std::int64_t rows = 0, columns = 0;
    check_count(element, "nrow", rows, file_limits_.pixels);
    check_count(element, "ncol", columns, file_limits_.pixels);
    add_pixels(&element, rows * columns);
    add_file(element, File::Kind::heights, "file");
  }

  void texture(const XMLElement& element) {
    const bool flat = text_of(element, "type") == "2d";
    std::int64_t width = 0, height = 0;
    check_count(element, "width", width, 16'384);
    check_count(element, "height", height, 6 * 16'384);
    add_pixels(&element, flat ? width * height : 6 * width * width);
    for (const auto side : list<std::int64_t>(text_of(element, "gridsize")))
      if (side < 1 || side > 12) refuse(&element, "gridsize is " + std::to_string(side));
    for (const char* attribute : {"file", "fileright", "fileleft", "fileup", "filedown", "filefront", "fileback"})
      add_file(element, File::Kind::texture, attribute);
  }

  // ---- The whole ----

  void check_sums() const {
    check_most(nullptr, "degrees of freedom", dofs_, limits_.dofs);
    const std::array<std::int64_t, 8> owners{bodies_,  joints_,  geoms_,     sites_,
                                             cameras_, tendons_, actuators_, sensors_};
    std::int64_t numbers = numbers_ + user_data_;
    for (std::size_t i = 0; i < owners.size(); ++i) numbers += owners[i] * user_[i];
    numbers += std::max(keys_, keys_wanted_) * (2 * dofs_ + 2 * joints_ + actuators_ + 7 * bodies_);
    check_most(nullptr, "numbers in user data and keyframes", numbers, limits_.numbers);
    check_most(nullptr, "numbers in a work space",
               rows_ * (rows_ + 4 * dofs_) + 70 * contacts_ + stack_ + 4 * dofs_ * 700, 2 * limits_.numbers);
    // Multiplications that a step may take: all of PGS's iterations, one of a dozen of Newton's.
    const std::int64_t sweeps = noslip_ + (solver_ == "PGS" ? iterations_ : 0);
    check_most(nullptr, "multiplications by the solver in a step",
               (solver_ == "Newton" ? (rows_ + dofs_) * dofs_ * dofs_ : rows_ * dofs_) + sweeps * rows_ * rows_ / 10,
               limits_.solver);
    // What the stack is by default must be an int.
    check_most(nullptr, "constraints, equalities and degrees of freedom", rows_ + equalities_ + dofs_, 20'000);
    const double step = range_timestep_ > 0 ? range_timestep_ : timestep_;
    if (runs_threads_ && !(step > 0 && static_cast<double>(actuators_) * range_total_ / step <=
                                           static_cast<double>(limits_.range_steps)))
      refuse(nullptr, "finding the range of the muscles' lengths would take too many steps of " + number(step) + " s");
  }
};

}  // namespace

std::int64_t most_text(bool trusted) { return trusted ? trusted_.text : stranger.text; }

std::string checked(const Mjcf& model) { return Check(model).run(); }

}  // namespace mjenv::core
