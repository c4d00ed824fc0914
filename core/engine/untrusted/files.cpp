#include "engine/untrusted/files.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <vector>

#include "chars.hpp"
#include "engine/untrusted/inflate.hpp"
#include "system/platform.hpp"

namespace mjenv::core {
namespace {

void check_limit(const Limits& limits, const char* what, std::int64_t count, const Limit& limit) {
  if (count < 0) refuse(std::to_string(count) + " " + what);
  if (const auto why = limits.excess(what, count, limit); !why.empty()) refuse(why);
}

void check_coordinate(double x) {
  if (!(std::abs(x) <= kMaxCoordinate)) refuse("a vertex has the coordinate " + number(x) + ", which is too large");
}

void check_vertex(std::int64_t vertex, std::int64_t vertices) {
  if (vertex < 0 || vertex >= vertices)
    refuse("a triangle has vertex " + std::to_string(vertex) + ", but the file has " + std::to_string(vertices) +
           " vertices, counted from 0");
}

// Returns the last four characters of a path in lower case: ".png", for instance.
std::string kind_of(const std::string& path) {
  std::string kind = path.substr(path.size() - std::min<std::size_t>(path.size(), 4));
  for (auto& letter : kind)
    if (letter >= 'A' && letter <= 'Z') letter = static_cast<char>(letter - 'A' + 'a');
  return kind;
}

// Reads little-endian integers and floats of four bytes from a file's content.
class Words {
 public:
  explicit Words(const std::string& content, std::size_t from = 0) : content_(content), at_(from) {}
  std::size_t left() const { return at_ > content_.size() ? 0 : (content_.size() - at_) / 4; }
  template <typename T>
  T next() {
    if (left() == 0) refuse("it ends too early");
    T value;
    std::memcpy(&value, content_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  void skip(std::int64_t words) {
    if (words < 0 || static_cast<std::uint64_t>(words) > left()) refuse("it ends too early");
    at_ += 4 * static_cast<std::size_t>(words);
  }

 private:
  const std::string& content_;
  std::size_t at_;
};

// ---- Meshes ----

// A face consists of a normal, three corners and two unused bytes.
constexpr std::size_t kStlFace = 50;

MeshSize check_stl(const std::string& content, const Limits& limits) {
  if (content.size() < 84) refuse("it is no binary STL file: it has no header");
  const std::int64_t faces = Words(content, 80).next<std::uint32_t>();
  check_limit(limits, "triangles", faces, kFaces);
  // MuJoCo merges equal corners of triangles into one vertex.
  using Vertex = std::array<std::uint32_t, 3>;  // compared as bits, because floats may be NaN
  std::vector<Vertex> corners;
  for (std::size_t at = 84; at + kStlFace <= content.size(); at += kStlFace)
    for (std::size_t corner = 1; corner < 4; ++corner)
      std::memcpy(&corners.emplace_back(), &content[at + corner * sizeof(Vertex)], sizeof(Vertex));
  std::sort(corners.begin(), corners.end());
  return {std::distance(corners.begin(), std::unique(corners.begin(), corners.end())), faces};
}

MeshSize check_msh(const std::string& content, const Limits& limits) {
  Words words(content);
  const std::int64_t vertices = words.next<std::int32_t>();
  const std::int64_t normals = words.next<std::int32_t>();
  const std::int64_t texcoords = words.next<std::int32_t>();
  const std::int64_t faces = words.next<std::int32_t>();
  check_limit(limits, "vertices", vertices, kVertices);
  check_limit(limits, "triangles", faces, kFaces);
  if ((normals != 0 && normals != vertices) || (texcoords != 0 && texcoords != vertices))
    refuse("it has " + std::to_string(vertices) + " vertices, but " + std::to_string(normals) + " normals and " +
           std::to_string(texcoords) + " texture coordinates");
  for (std::int64_t i = 0; i < 3 * vertices; ++i) check_coordinate(words.next<float>());
  words.skip(3 * normals + 2 * texcoords);
  for (std::int64_t i = 0; i < 3 * faces; ++i) check_vertex(words.next<std::int32_t>(), vertices);
  return {vertices, faces};
}

// Reads Wavefront OBJ files as tinyobjloader does, but also checks the indices.
class Obj {
 public:
  explicit Obj(const Limits& limits) : limits_(limits) {}

  MeshSize check(const std::string& content) {
    for (std::size_t at = 0; at < content.size();) {
      const std::size_t end = std::min(content.find_first_of("\r\n", at), content.size());
      line(std::string_view(content).substr(at, end - at));
      at = end + 1;
    }
    // If MuJoCo sees no faces, it uses the arrays of vertices, normals and texture coordinates directly, so their
    // lengths must match. Faces with more than four corners do not count, because tinyobjloader may find no triangle in
    // them. If polylines come first, MuJoCo may see no face, because it reads only the first shape.
    if ((faces_ == 0 && lines_ == 0 && positions_ < 4) ||
        ((faces_ == 0 || begins_with_lines_) &&
         ((normals_ && normals_ != positions_) || (texcoords_ && texcoords_ != positions_))))
      refuse(
          "MuJoCo sees no face in it, so it needs at least 4 vertices, with a normal and a texture coordinate for each "
          "vertex or for none; it has " +
          std::to_string(positions_) + " vertices, " + std::to_string(normals_) + " normals and " +
          std::to_string(texcoords_) + " texture coordinates");
    // If there are normals, every corner of a face must have one; the same holds for texture coordinates.
    if ((normals_ && lacks_normals_) || (texcoords_ && lacks_texcoords_))
      refuse("it has normals or texture coordinates, but not for all faces");
    return {positions_, triangles_};
  }

 private:
  // A positive index counts from 1, and a negative one back from the last element so far.
  static void check_index(std::int64_t index, std::int64_t count) {
    if (index == 0 || index > count || index < -count)
      refuse("a face or a polyline has index " + std::to_string(index) + ", but there are " + std::to_string(count) +
             " elements so far");
  }

  const Limits& limits_;
  std::int64_t positions_ = 0, normals_ = 0, texcoords_ = 0;
  std::int64_t faces_ = 0, triangles_ = 0, lines_ = 0, line_ends_ = 0;
  bool lacks_normals_ = false, lacks_texcoords_ = false, begins_with_lines_ = false;

  static bool is_blank(char c) { return c == ' ' || c == '\t'; }
  static std::string_view trimmed(std::string_view text) {
    while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
    return text;
  }
  static std::string_view word(std::string_view& text) {
    text = trimmed(text);
    const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
    const std::string_view found = text.substr(0, end);
    text.remove_prefix(end);
    return found;
  }

  void line(std::string_view text) {
    if (text.find('\0') != std::string_view::npos) refuse("it is no text");
    text = trimmed(text);
    const std::string_view keyword = word(text);
    if (keyword == "v") {
      check_limit(limits_, "vertices", ++positions_, kVertices);
      for (int i = 0; i < 3; ++i) coordinate(word(text));
    } else if (keyword == "vn") {
      ++normals_;
      for (int i = 0; i < 3; ++i) coordinate(word(text));
    } else if (keyword == "vt") {
      ++texcoords_;
      coordinate(word(text));
      if (const std::string_view second = word(text); !second.empty()) coordinate(second);
    } else if (keyword == "f") {
      face(text);
    } else if (keyword == "l") {
      segments(text);
    } else if (keyword == "p" || keyword == "t" || keyword == "vw") {
      refuse("a line of its text begins with \"" + std::string(keyword) +
             "\"; only vertices, faces and polylines can be used");
    }
  }

  static void coordinate(std::string_view text) {
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    const std::optional<double> x = read_double(text);
    // tinyobjloader reads 0e999 as NaN, and numbers with hundreds of digits as infinity.
    const std::size_t e = std::min(text.find_first_of("eE"), text.size());
    const std::string exponent(text.substr(std::min(e + 1, text.size())));
    if (!x || text.size() > 100 || std::strtol(exponent.c_str(), nullptr, 10) > 99)
      refuse("a vertex has \"" + std::string(text.substr(0, 20)) + "\" in place of a number");
    check_coordinate(*x);
  }

  // Parses the integer at the front of the text and removes it.
  static std::int64_t index(std::string_view& text) {
    if (!text.empty() && text.front() == '+') text.remove_prefix(1);
    std::int64_t value = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
    if (read.ec != std::errc())
      refuse("a face or a polyline has \"" + std::string(text.substr(0, 20)) + "\" in place of an index");
    text.remove_prefix(static_cast<std::size_t>(read.ptr - text.data()));
    return value;
  }

  void face(std::string_view text) {
    std::int64_t corners = 0;
    for (std::string_view corner = word(text); !corner.empty(); corner = word(text), ++corners) {
      const std::string whole(corner);
      bool normal = false, texcoord = false;
      check_index(index(corner), positions_);
      if (!corner.empty() && corner.front() == '/') {
        corner.remove_prefix(1);
        texcoord = corner.empty() || corner.front() != '/';
        if (texcoord) check_index(index(corner), texcoords_);
        normal = !corner.empty() && corner.front() == '/';
        if (normal) {
          corner.remove_prefix(1);
          check_index(index(corner), normals_);
        }
      }
      if (!corner.empty()) refuse("a face has an invalid corner: \"" + whole.substr(0, 20) + "\"");
      lacks_normals_ = lacks_normals_ || !normal;
      lacks_texcoords_ = lacks_texcoords_ || !texcoord;
    }
    check_limit(limits_, "corners of a face", corners, kFaceCorners);
    faces_ += corners == 3 || corners == 4;
    triangles_ += std::max(corners - 2, std::int64_t{0});
    check_limit(limits_, "triangles", triangles_, kFaces);
  }

  // Reads a polyline. In the file of a flex, MuJoCo 4.0 turns it into edges; otherwise it ignores it.
  void segments(std::string_view text) {
    begins_with_lines_ = begins_with_lines_ || faces_ == 0;
    check_limit(limits_, "polylines", ++lines_, kFaces);
    std::int64_t ends = 0;
    for (std::string_view end = word(text); !end.empty(); end = word(text)) {
      check_limit(limits_, "vertices of polylines", ++ends + line_ends_, kFaces);
      check_index(index(end), positions_);
      if (!end.empty() && end.front() == '/') {
        end.remove_prefix(1);
        check_index(index(end), texcoords_);
      }
      if (!end.empty()) refuse("a polyline has \"" + std::string(end.substr(0, 20)) + "\" after an index");
    }
    if (ends < 2) refuse("a polyline has " + std::to_string(ends) + " vertices; it needs at least 2");
    line_ends_ += ends;
  }
};

// ---- Images ----

std::uint32_t big_endian(const std::string& content, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(content[at + i]);
  return value;
}

std::int64_t check_png(const std::string& content, const Limits& limits) {
  static const std::string signature("\x89PNG\r\n\x1a\n");
  if (content.compare(0, 8, signature) != 0 || content.size() < 33 || content.compare(12, 4, "IHDR") != 0)
    refuse("it is no PNG image");
  const std::int64_t width = big_endian(content, 16), height = big_endian(content, 20);
  check_limit(limits, "pixels in a row", width, kPixels);
  check_limit(limits, "rows of pixels", height, kPixels);
  check_limit(limits, "pixels", width * height, kPixels);
  // An upper bound, with room for a filter byte in each row of each of the seven passes of an interlaced image.
  const int bits = static_cast<unsigned char>(content[24]);
  const std::int64_t unpacked = 2 * height * ((width * bits * 4 + 7) / 8 + 8) + 4096;

  std::vector<unsigned char> data;
  int texts = 0;
  for (std::size_t at = 8; at + 12 <= content.size();) {
    const std::size_t length = big_endian(content, at);
    const std::string type = content.substr(at + 4, 4);
    if (length > content.size() - at - 12) break;
    if (type == "IDAT") data.insert(data.end(), &content[at + 8], &content[at + 8] + length);
    if (type == "zTXt" || type == "iTXt" || type == "iCCP")
      check_limit(limits, "compressed texts", ++texts, kCompressedTexts);
    at += length + 12;
  }
  // One byte of a deflate stream unpacks to 1032 bytes at most.
  if (static_cast<std::int64_t>(data.size()) * 1032 > std::max(64 * kMiB, unpacked) &&
      !inflates_within(data.data(), data.size(), static_cast<std::size_t>(unpacked)))
    refuse("it unpacks to more than its pixels");
  return width * height;
}

}  // namespace

MeshSize check_mesh(const std::string& path, const std::string& content, const Limits& limits) {
  const std::string kind = kind_of(path);
  if (kind == ".stl") return check_stl(content, limits);
  if (kind == ".msh") return check_msh(content, limits);
  if (kind == ".obj") return Obj(limits).check(content);
  refuse("a mesh is an .stl, .obj or .msh file");
}

void check_skin(const std::string& content, const Limits& limits) {
  Words words(content);
  const std::int64_t vertices = words.next<std::int32_t>();
  const std::int64_t texcoords = words.next<std::int32_t>();
  const std::int64_t faces = words.next<std::int32_t>();
  const std::int64_t bones = words.next<std::int32_t>();
  check_limit(limits, "vertices", vertices, kVertices);
  check_limit(limits, "texture coordinates", texcoords, kVertices);
  check_limit(limits, "triangles", faces, kFaces);
  check_limit(limits, "bones", bones, kVertices);
  words.skip(3 * vertices + 2 * texcoords);
  for (std::int64_t i = 0; i < 3 * faces; ++i) check_vertex(words.next<std::int32_t>(), vertices);
  for (std::int64_t bone = 0; bone < bones; ++bone) {
    words.skip(17);  // name, position, orientation
    const std::int64_t count = words.next<std::int32_t>();
    if (count < 1) refuse("a bone has " + std::to_string(count) + " vertices");
    words.skip(2 * count);
  }
}

namespace {

// Checks a file of MuJoCo's own format: two integers, followed by three bytes or one float for each pixel.
std::int64_t check_raw(const std::string& content, const Limits& limits, std::int64_t bytes_per_pixel) {
  Words words(content);
  const std::int64_t first = words.next<std::int32_t>(), second = words.next<std::int32_t>();
  const auto bytes = static_cast<std::int64_t>(content.size());
  if (first < 0 || second < 0 || (second > 0 && first > bytes / second) ||
      8 + first * second * bytes_per_pixel != bytes)
    refuse(
        "it is no PNG image (.png), and not in MuJoCo's own format: a file in that format begins with its two "
        "dimensions, here " +
        std::to_string(first) + " and " + std::to_string(second) + ", and has " + std::to_string(bytes_per_pixel) +
        " bytes for each element, but this file has " + std::to_string(bytes) + " bytes in all");
  check_limit(limits, "rows", first, kPixels);
  check_limit(limits, "columns", second, kPixels);
  check_limit(limits, "pixels", first * second, kPixels);
  return first * second;
}

}  // namespace

std::int64_t check_image(const std::string& path, const std::string& content, const Limits& limits) {
  if (kind_of(path) == ".ktx") refuse("it is a KTX image, which cannot be drawn with OpenGL; use a PNG image");
  return kind_of(path) == ".png" ? check_png(content, limits) : check_raw(content, limits, 3);
}

std::int64_t check_heights(const std::string& path, const std::string& content, const Limits& limits) {
  if (kind_of(path) == ".png") return check_png(content, limits);
  const std::int64_t count = check_raw(content, limits, sizeof(float));
  for (Words words(content, 8); words.left() > 0;)
    if (!std::isfinite(words.next<float>())) refuse("a height is not finite");
  return count;
}

}  // namespace mjenv::core
