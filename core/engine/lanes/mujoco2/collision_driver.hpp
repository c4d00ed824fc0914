// The contacts of pairs of geoms, for several rows at once. The results have MuJoCo's bits for the reasons that
// smooth.hpp gives.
#pragma once

#include "engine/lanes/mujoco2/collision_primitive.hpp"
#include "engine/lanes/mujoco2/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

// ---- engine_collision_driver.c ----

// The lanes, as bits, in which MuJoCo's search may miss a contact of the pair.
unsigned uncertain(V reach, const V* pos1, const V* pos2) {
  V dif[3], size = reach;
  for (int k = 0; k < 3; ++k) {
    dif[k] = pos1[k] - pos2[k];
    size += abs(pos1[k]) + abs(pos2[k]);
  }
  return bits(~(sqrt(dot3(dif, dif)) < reach - 1e-6 * size));
}

// Takes contact i of those that MuJoCo's function found (Contacts::collide).
void take(Contact& con, const Contacts& c, int i) {
  con.dist = vectors(c.single_dist)[i];
  copy(con.pos, vectors(c.single_pos) + 3 * i, 3);
  copy(con.frame, vectors(c.single_frame) + 9 * i, 9);
  con.is_there = mask_of(c.single_rows[i]);
}

// mj_collision for the pairs that `reject` has not excluded
bool collision(const Lanes& d, Contacts& c) {
  const mjModel& m = *d.model;
  c.contact_count = 0;
  for (int lane = 0; lane < kWidth; ++lane) c.found[lane] = 0;
  for (int i = 0; i < d.pair_count; ++i) {
    const unsigned near = d.may_touch[i] & c.rows;
    if (near == 0) continue;
    const ContactPair& pair = c.pairs[i];
    const V margin = pair_number(d, i, d.pair_margin, &PairNumbers::margin);
    const auto geom = [&](int id) {
      return Geom{vectors(d.geom_xpos) + 3 * id, vectors(d.geom_xmat) + 9 * id, vectors(d.geom_size) + 3 * id};
    };
    const Geom g1 = geom(pair.geom1), g2 = geom(pair.geom2);
    Contact found[kMostFound];
    int count = 1;
    bool is_single = false;  // MuJoCo's function finds the contacts
    switch (pair.shapes) {
      case Shapes::plane_sphere: PlaneSphere(found[0], margin, g1, g2.pos, g2.size[0]); break;
      case Shapes::plane_capsule:
        PlaneCapsule(found, margin, g1, g2);
        count = 2;
        break;
      case Shapes::plane_ellipsoid: PlaneEllipsoid(found[0], margin, g1, g2); break;
      case Shapes::plane_cylinder:
        PlaneCylinder<false>(found, margin, g1, g2);
        count = 4;
        break;
      case Shapes::plane_box:
        PlaneBox(found, margin, g1, g2);
        count = 4;
        break;
      case Shapes::sphere_sphere: SphereSphere<false>(found[0], margin, g1, g1.pos, g2, g2.pos); break;
      case Shapes::sphere_capsule: SphereCapsule(found[0], margin, g1, g2); break;
      case Shapes::sphere_box: SphereBox<false>(found[0], margin, g1, g2); break;
      case Shapes::capsule_capsule: count = CapsuleCapsule(found, margin, g1, g2); break;
      default: is_single = true;
    }
    if (is_single) count = c.collide(c.maker, i, near);
    if (count < 0) return false;
    for (int k = 0; k < count; ++k) {
      if (is_single) take(found[0], c, k);
      Contact& con = found[is_single ? 0 : k];
      const unsigned rows = bits(con.is_there) & near;
      if (rows == 0) continue;
      const V reach = pair_number(d, i, d.pair_reach, &PairNumbers::reach);
      if (c.are_searched && pair.can_be_missed && (uncertain(reach, g1.pos, g2.pos) & rows) != 0) return false;
      if ((bits(makeFrame(con.frame)) & rows) != 0) return false;
      for (int lane = 0; lane < kWidth; ++lane) c.found[lane] += rows >> lane & 1;
      const unsigned included = rows & bits(con.dist < includemargin(d, i));
      if (included == 0) continue;
      if (c.contact_count == Contacts::kCapacity) return false;
      const int n = c.contact_count++;
      c.contacts[n] = {i, included, included, {}};
      vectors(c.dist)[n] = con.dist;
      copy(vectors(c.pos) + 3 * n, con.pos, 3);
      copy(vectors(c.frame) + 9 * n, con.frame, 9);
      const int size = constraints_of(pair, m.opt.cone);
      for (int lane = 0; lane < kWidth; ++lane)
        if (included >> lane & 1) c.constraints[lane] += size;
    }
  }
  return true;
}

}  // namespace
}  // namespace mjenv::core::lanes
