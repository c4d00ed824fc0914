// Finds the pairs of geoms that certainly do not touch, for several rows at once. The test of bounding spheres decides
// as that of mj_collideGeoms does; that of boxes is not MuJoCo's, and leaves room for rounding errors.
#pragma once

#include "engine/lanes/mujoco2/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

// A geom's bounding box in the world: its middle, and its three axes as columns of the geom's matrix.
struct PlacedBox {
  const GeomBox& box;
  const V* mat;
  V middle[3];

  PlacedBox(const Lanes& d, int geom) : box(d.boxes[geom]), mat(vectors(d.geom_xmat) + 9 * geom) {
    rotVecMat(middle, box.middle, mat);
    add_to(middle, vectors(d.geom_xpos) + 3 * geom, 3);
  }
  V along(const V* vec, int axis) const { return vec[0] * mat[axis] + vec[1] * mat[3 + axis] + vec[2] * mat[6 + axis]; }
};

V greatest(V a, V b) { return a > b ? a : b; }

// Half the length of a box's projection on an axis. share: the absolute cosines of the angles between this axis and the
// axes of the box, each `stride` elements after the one before.
V half_width(const GeomBox& box, const V* share, int stride) {
  return box.half[0] * share[0] + box.half[1] * share[stride] + box.half[2] * share[2 * stride];
}

// The greatest gap between the projections of two boxes on the axes of the separating axis theorem. Axes that are cross
// products are not normalised, so the gap along them is multiplied by the sine of the angle between the two axes. This
// only makes it smaller.
V gap_of_boxes(const PlacedBox& a, const PlacedBox& b, const V* dif) {
  V dif1[3], dif2[3], rot[9], rotabs[9];
  for (int i = 0; i < 3; ++i) {
    dif1[i] = a.along(dif, i);
    dif2[i] = b.along(dif, i);
    for (int j = 0; j < 3; ++j) {
      rot[3 * i + j] = a.mat[i] * b.mat[j] + a.mat[3 + i] * b.mat[3 + j] + a.mat[6 + i] * b.mat[6 + j];
      rotabs[3 * i + j] = abs(rot[3 * i + j]);
    }
  }
  V gap = splat(-kInfinite);
  for (int i = 0; i < 3; ++i) {
    gap = greatest(gap, abs(dif1[i]) - a.box.half[i] - half_width(b.box, rotabs + 3 * i, 1));
    gap = greatest(gap, abs(dif2[i]) - b.box.half[i] - half_width(a.box, rotabs + i, 3));
  }
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const V apart = abs(dif1[i2] * rot[3 * i1 + j] - dif1[i1] * rot[3 * i2 + j]);
      const V width1 = a.box.half[i1] * rotabs[3 * i2 + j] + a.box.half[i2] * rotabs[3 * i1 + j];
      const V width2 = b.box.half[j1] * rotabs[3 * i + j2] + b.box.half[j2] * rotabs[3 * i + j1];
      gap = greatest(gap, apart - width1 - width2);
    }
  }
  return gap;
}

// Whether the box from low to high is above all points of the height field in the cells below it. The field's base does
// not matter: MuJoCo skips a prism whose upper corners are all lower than the geom, even if its base is higher than
// they are, which a row's own heights can cause. heights: hfield_data.
bool is_above_ground(const mjModel& m, const float* heights, int geom, const double* low, const double* high) {
  const int id = m.geom_dataid[geom], rows = m.hfield_nrow[id], columns = m.hfield_ncol[id];
  const double* const size = m.hfield_size + 4 * id;
  const float* const data = heights + m.hfield_adr[id];
  const auto cell = [](double x, double extent, int count) { return (x + extent) / (2 * extent) * (count - 1); };
  // Returns a valid index even for a number that is not finite, because lanes that are left to MuJoCo are still
  // computed.
  const auto within = [](double at, int count) {
    return static_cast<int>(at > 0 ? (at < count - 1 ? at : count - 1) : 0);
  };
  const int first_column = within(cell(low[0], size[0], columns) - 1, columns),
            last_column = within(cell(high[0], size[0], columns) + 2, columns),
            first_row = within(cell(low[1], size[1], rows) - 1, rows),
            last_row = within(cell(high[1], size[1], rows) + 2, rows);
  for (int row = first_row; row <= last_row; ++row)
    for (int column = first_column; column <= last_column; ++column)
      if (data[row * columns + column] * size[2] >= low[2]) return false;
  return true;
}

// Returns those of the lanes `rows` (bits) in which a geom is above a height field by more than `limit`.
unsigned above_ground(const Lanes& d, const GeomPair& pair, const PlacedBox& box, double limit, unsigned rows) {
  const V* const mat = vectors(d.geom_xmat) + 9 * pair.geom1;
  V dif[3], low[3], high[3];
  for (int k = 0; k < 3; ++k) dif[k] = box.middle[k] - vectors(d.geom_xpos)[3 * pair.geom1 + k];
  for (int k = 0; k < 3; ++k) {
    const V at = dif[0] * mat[k] + dif[1] * mat[3 + k] + dif[2] * mat[6 + k];
    V share[3];
    for (int j = 0; j < 3; ++j)
      share[j] = abs(mat[k] * box.mat[j] + mat[3 + k] * box.mat[3 + j] + mat[6 + k] * box.mat[6 + j]);
    const V half = half_width(box.box, share, 1) + box.box.round + limit;
    low[k] = at - half;
    high[k] = at + half;
  }
  unsigned above = 0;
  for (int lane = 0; lane < kWidth; ++lane) {
    if (!(rows >> lane & 1)) continue;
    const double lowest[3] = {low[0][lane], low[1][lane], low[2][lane]}, ends[2] = {high[0][lane], high[1][lane]};
    const float* const heights = d.heights ? d.heights[lane] : d.model->hfield_data;
    if (is_above_ground(*d.model, heights, pair.geom1, lowest, ends)) above |= 1U << lane;
  }
  return above;
}

// Returns those of the lanes `rows` (bits) in which the bounding boxes of a pair are so far apart that MuJoCo's
// function would find no contact.
unsigned boxes_apart(const Lanes& d, const GeomPair& pair, unsigned rows) {
  const BoxPair& limits = d.box_pairs[pair.box_pair];
  const PlacedBox box2(d, pair.geom2);
  const V* const pos1 = vectors(d.geom_xpos) + 3 * pair.geom1;
  V dif[3], size = V{};
  if (pair.has_plane) {
    const V* const mat = vectors(d.geom_xmat) + 9 * pair.geom1;
    const V normal[3] = {mat[2], mat[5], mat[8]};
    V share[3];
    for (int k = 0; k < 3; ++k) {
      dif[k] = box2.middle[k] - pos1[k];
      size += abs(pos1[k]) + abs(box2.middle[k]);
      share[k] = abs(box2.along(normal, k));
    }
    const V gap = dot3(dif, normal) - half_width(box2.box, share, 1);
    return bits(gap > limits.limit + BoxPair::kRounding * size) & rows;
  }
  // The field's bounding box is that of the shared model's heights, so it is not valid for a row's own heights.
  if (limits.is_ground && d.heights) return above_ground(d, pair, box2, limits.limit, rows);
  const PlacedBox box1(d, pair.geom1);
  for (int k = 0; k < 3; ++k) {
    dif[k] = box2.middle[k] - box1.middle[k];
    size += abs(box1.middle[k]) + abs(box2.middle[k]);
  }
  V between[3];
  for (int k = 0; k < 3; ++k) between[k] = vectors(d.geom_xpos)[3 * pair.geom2 + k] - pos1[k];
  const V limit = limits.limit + BoxPair::kRounding * size + BoxPair::kCollinear / sqrt(dot3(between, between));
  unsigned apart = bits(gap_of_boxes(box1, box2, dif) > limit);
  if (limits.is_ground && (rows & ~apart) != 0) apart |= above_ground(d, pair, box2, limits.limit, rows & ~apart);
  return apart & rows;
}

// ---- engine_collision_driver.c ----

// First repeats the test of bounding spheres with which mj_collideGeoms begins, but compares squares instead of
// computing a root. Then compares the bounding boxes of the pairs that have a BoxPair, because MuJoCo's function for
// their contacts takes longer. Compares no boxes if rows have their own sizes or margins of geoms, for which no boxes
// are known.
void reject(Lanes& d) {
  const V *const geom_xpos = vectors(d.geom_xpos), *const geom_xmat = vectors(d.geom_xmat);
  const GeomPair* pair = d.pairs;
  for (int i = 0; i < d.pair_count; ++i, ++pair) {
    const V *const a = geom_xpos + 3 * pair->geom1, *const b = geom_xpos + 3 * pair->geom2;
    V dif[3], apart;
    if (pair->has_plane) {
      const V* const mat = geom_xmat + 9 * pair->geom1;
      for (int k = 0; k < 3; ++k) dif[k] = b[k] - a[k];
      apart = dif[0] * mat[2] + dif[1] * mat[5] + dif[2] * mat[8];
    } else {
      for (int k = 0; k < 3; ++k) dif[k] = a[k] - b[k];
      apart = dot3(dif, dif);
    }
    unsigned near = bits(~(apart > pair_number(d, i, d.pair_limit, &PairNumbers::limit)));
    if (d.pair_rows) near &= d.pair_rows[i];
    if (pair->box_pair >= 0 && near != 0 && !d.has_own_sizes) near &= ~boxes_apart(d, *pair, near);
    d.may_touch[i] = static_cast<unsigned char>(near);
  }
}

}  // namespace
}  // namespace mjenv::core::lanes
