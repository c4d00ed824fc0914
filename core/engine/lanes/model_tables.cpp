#include "engine/lanes/model_tables.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

bool has_negative_zero(const mjtNum* numbers, int count) {
  return std::any_of(numbers, numbers + count, [](double x) { return x == 0 && std::signbit(x); });
}

// As in mj_tendon.
std::vector<double> tendon_jacobian(const mjModel& m) {
  std::vector<double> jacobian(static_cast<std::size_t>(m.ntendon) * static_cast<std::size_t>(m.nv));
  for (int i = 0; i < m.ntendon; ++i)
    for (int j = m.tendon_adr[i]; j < m.tendon_adr[i] + m.tendon_num[i]; ++j)
      jacobian[i * m.nv + m.jnt_dofadr[m.wrap_objid[j]]] = m.wrap_prm[j];
  return jacobian;
}

// As in mj_transmission.
std::vector<double> moments(const mjModel& m) {
  std::vector<double> moment(static_cast<std::size_t>(m.nu) * static_cast<std::size_t>(m.nv));
  for (int i = 0; i < m.nu; ++i) moment[i * m.nv + m.jnt_dofadr[m.actuator_trnid[2 * i]]] = m.actuator_gear[6 * i];
  return moment;
}

double fourth_power(double x) { return x * x * x * x; }

// As in mj_passive and mj_inertiaBoxFluidModel.
std::vector<FluidBody> bodies_in_fluid(const mjModel& m) {
  std::vector<FluidBody> bodies;
  if (!(m.opt.viscosity > 0 || m.opt.density > 0)) return bodies;
  for (int i = 1; i < m.nbody; ++i) {
    const double mass = m.body_mass[i];
    if (mass < mjMINVAL) continue;
    const double* inertia = m.body_inertia + 3 * i;
    const double box[3] = {std::sqrt(mju_max(mjMINVAL, inertia[1] + inertia[2] - inertia[0]) / mass * 6.0),
                           std::sqrt(mju_max(mjMINVAL, inertia[0] + inertia[2] - inertia[1]) / mass * 6.0),
                           std::sqrt(mju_max(mjMINVAL, inertia[0] + inertia[1] - inertia[2]) / mass * 6.0)};
    const double diam = (box[0] + box[1] + box[2]) / 3.0, density = m.opt.density;
    bodies.push_back(
        {i,
         -mjPI * diam * diam * diam * m.opt.viscosity,
         -3.0 * mjPI * diam * m.opt.viscosity,
         {density * box[0] * (fourth_power(box[1]) + fourth_power(box[2])),
          density * box[1] * (fourth_power(box[0]) + fourth_power(box[2])),
          density * box[2] * (fourth_power(box[0]) + fourth_power(box[1]))},
         {0.5 * density * box[1] * box[2], 0.5 * density * box[0] * box[2], 0.5 * density * box[0] * box[1]}});
  }
  return bodies;
}

// As in mj_collideGeoms.
std::vector<GeomPair> tested_pairs(const mjModel& m, const Pairs& listed) {
  std::vector<GeomPair> pairs;
  for (std::size_t i = 0; i < listed.geom1.size(); ++i) {
    int first = listed.geom1[i], second = listed.geom2[i];
    if (m.geom_type[first] > m.geom_type[second]) std::swap(first, second);
    const double radius1 = m.geom_rbound[first], radius2 = m.geom_rbound[second], margin = listed.margin[i];
    GeomPair pair{first, second, false, kInfinite};
    if (radius1 > 0 && radius2 > 0)
      pair.limit = largest_square(radius1 + radius2 + margin);
    else if (m.geom_type[first] == mjGEOM_PLANE && radius2 > 0)
      pair = {first, second, true, margin + radius2};
    pairs.push_back(pair);
  }
  return pairs;
}

bool any_positive(const mjtNum* numbers, int count) {
  return std::any_of(numbers, numbers + count, [](double x) { return x > 0; });
}

}  // namespace

double largest_square(double radius) {
  if (radius < 0) return -1;
  if (std::isinf(radius)) return radius;
  double square = radius * radius;
  while (std::sqrt(square) > radius) square = std::nextafter(square, 0);
  while (std::sqrt(std::nextafter(square, kInfinite)) <= radius) square = std::nextafter(square, kInfinite);
  return square;
}

ModelTables::ModelTables(const Model& model) {
  const mjModel& m = *model.get();
  ten_J = tendon_jacobian(m);
  actuator_moment = moments(m);
  fluid_bodies = bodies_in_fluid(m);
  if (model.pairs()) pairs = tested_pairs(m, *model.pairs());
  has_negative_zeros = has_negative_zero(m.jnt_axis, 3 * m.njnt) || has_negative_zero(m.jnt_pos, 3 * m.njnt);
  has_damping = any_positive(m.dof_damping, m.nv);
  constrains_tendons = any_positive(m.tendon_frictionloss, m.ntendon) ||
                       std::any_of(m.tendon_limited, m.tendon_limited + m.ntendon, [](mjtByte is) { return is != 0; });
}

}  // namespace mjenv::core::lanes
