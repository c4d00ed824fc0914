#include "render/budget.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "engine/untrusted/limits.hpp"
#include "error.hpp"
#include "system/memory.hpp"

namespace mjenv::core {
namespace {

// Limits of untrusted models.
constexpr double kMaxVertices = 1 << 25;  // vertices that OpenGL stores for the model
constexpr double kMaxDrawn = 1 << 30;     // vertices and pixels of shadow maps that one picture processes
// An upper bound: of all shapes, Mesa's software renderer needs the most for height fields, 54 bytes per vertex; for
// planes it needs 13.
constexpr double kBytesPerVertex = 64;
// A texture has four bytes for each pixel, smaller copies (mipmaps), and one more copy while those are made.
constexpr double kBytesPerPixel = 8;

// How many cells a plane has along an axis. MuJoCo makes cells as wide as the plane's third size. An infinite plane has
// the largest number.
double cells(const mjtNum* size, int axis) {
  const double half = size[axis];
  const double cell = std::max({size[2], half / (mjMAXPLANEGRID - 2), mjMINVAL});
  return half > 0 ? std::min<double>(mjMAXPLANEGRID, std::floor(half / cell) + 2)  // inf / inf is NaN: min ignores it
                  : mjMAXPLANEGRID;
}

double texture_bytes(const mjModel& m) {
  double pixels = 0;
  for (int i = 0; i < m.ntex; ++i) {
    const double width = m.tex_width[i];
    pixels += m.tex_type[i] == mjTEXTURE_2D ? width * m.tex_height[i] : 6 * width * width;
  }
  return kBytesPerPixel * pixels;
}

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

void check_limit(bool trusted, const std::string& what, double count, const std::string& unit, double limit) {
  if (!trusted && !(count <= limit))
    fail(MJENV_E_RENDER,
         what + " takes " + number(count) + " " + unit + "; the limit is " + number(limit) + kUnlessTrusted);
}

}  // namespace

Budget::Budget(const mjModel& m, bool trusted)
    : trusted_(trusted),
      shadow_(std::pow(std::max(m.vis.quality.shadowsize, 0), 2)),
      bytes_(0),
      round_(4.0 * std::max(m.vis.quality.numslices, 0) * (std::max(m.vis.quality.numstacks, 0) + 2.0)),
      quads_(4 * std::pow(std::max(m.vis.quality.numquads, 0), 2)) {
  for (int i = 0; i < m.ngeom; ++i)
    if (m.geom_type[i] == mjGEOM_PLANE)
      planes_.push_back(4 * cells(m.geom_size + 3 * i, 0) * cells(m.geom_size + 3 * i, 1));
  for (int i = 0; i < m.nmesh; ++i) {
    const int hull = m.mesh_graphadr[i];
    meshes_.push_back(3.0 * m.mesh_facenum[i]);
    meshes_.push_back(hull < 0 ? 0 : 3.0 * m.mesh_graph[hull + 1]);
  }
  for (int i = 0; i < m.nhfield; ++i) {
    const double rows = m.hfield_nrow[i] - 1.0, columns = m.hfield_ncol[i] - 1.0;
    fields_.push_back(6 * rows * columns + 8 * (rows + columns) + quads_);
  }
  for (int i = 0; i < m.nskin; ++i) skins_.push_back(3.0 * m.skin_facenum[i] + m.skin_vertnum[i]);
  check_limit(trusted, "drawing the model", of_model(), "vertices", kMaxVertices);
  bytes_ = kBytesPerVertex * of_model() + texture_bytes(m) + 4 * shadow_;
  if (bytes_ > free_memory())
    fail(MJENV_E_MEMORY, "drawing the model needs " + number(std::ceil(bytes_ / 1e9)) + " GB, more than is free");
}

// An upper bound: all primitive shapes together have fewer vertices than seven spheres and seven sides of a box.
double Budget::of_model() const {
  return sum(planes_) + sum(meshes_) + sum(fields_) + sum(skins_) + 7 * (round_ + quads_);
}

double Budget::of(const mjvGeom& geom) const {
  const auto at = [](const std::vector<double>& counts, int i) {
    return i >= 0 && static_cast<std::size_t>(i) < counts.size() ? counts[static_cast<std::size_t>(i)] : 0;
  };
  switch (geom.type) {
    case mjGEOM_PLANE: return geom.dataid < 0 ? quads_ : at(planes_, geom.dataid);
    case mjGEOM_HFIELD: return at(fields_, geom.dataid);
    case mjGEOM_MESH: return at(meshes_, geom.dataid);
    case mjGEOM_SKIN: return at(skins_, geom.objid);
    case mjGEOM_SPHERE:
    case mjGEOM_ELLIPSOID: return round_;
    case mjGEOM_CAPSULE:
    case mjGEOM_CYLINDER: return 2 * round_;
    case mjGEOM_BOX: return 6 * quads_;
    case mjGEOM_ARROW:
    case mjGEOM_ARROW1:
    case mjGEOM_ARROW2: return 5 * round_;
    default: return 0;
  }
}

void Budget::check(const mjvScene& scene) const {
  double vertices = 0, shadows = 0;
  for (int i = 0; i < scene.ngeom; ++i) vertices += of(scene.geoms[i]);
  for (int i = 0; i < scene.nlight; ++i) shadows += scene.lights[i].castshadow != 0;
  if (shadow_ == 0 || !scene.flags[mjRND_SHADOW]) shadows = 0;
  // MuJoCo draws the scene twice for each light that casts shadows, and transparent and reflected geoms twice.
  check_limit(trusted_, "a picture with " + number(shadows) + " lights that cast shadows",
              2 * (vertices + shadows * (vertices + shadow_)), "vertices and pixels of shadow maps", kMaxDrawn);
}

}  // namespace mjenv::core
