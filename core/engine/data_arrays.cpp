#include "engine/data_arrays.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <string_view>
#include <type_traits>
#include <utility>

#include "engine/mujoco.hpp"
#include "names.hpp"

namespace mjenv::core {
namespace {

constexpr std::array kForceArrays{"cacc", "cfrc_int", "cfrc_ext"};
// What every step computes. Each name is between two spaces, so that a search for it with its spaces finds no part of
// another name.
constexpr std::string_view kShown =
    " time qpos qvel act qacc_warmstart ctrl qacc xpos xquat xmat xipos ximat xanchor xaxis site_xpos site_xmat "
    "subtree_com cinert cvel sensordata actuator_length actuator_velocity actuator_force qfrc_actuator "
    "qfrc_passive qfrc_bias qfrc_constraint ten_length ten_velocity qfrc_applied xfrc_applied ";

// How many points the paths of all tendons have together.
std::int64_t path_points(const mjModel& m, const mjData& d) {
  return m.ntendon == 0 ? 0 : std::int64_t{d.ten_wrapadr[m.ntendon - 1]} + d.ten_wrapnum[m.ntendon - 1];
}

// The Array::held of an array of mjData: a function if the number of elements in use depends on the state, otherwise
// empty.
std::function<std::int64_t()> held_elements(const mjModel& m, const mjData& d, const std::string& name) {
  if (name == "wrap_obj") return [&] { return path_points(m, d); };
  if (name == "wrap_xpos") return [&] { return 3 * path_points(m, d); };
  return held_by_constraints(m, d, name);
}

}  // namespace

unsigned part_of(const std::string& array) {
  if (kShown.find(" " + array + " ") != kShown.npos) return 0;
  return is_in(kForceArrays, array) ? Lag::forces : is_in(kFrameArrays, array) ? Lag::frames : Lag::others;
}

std::vector<std::string> on_demand_arrays() {
  std::vector<std::string> names(kForceArrays.begin(), kForceArrays.end());
  names.insert(names.end(), kFrameArrays.begin(), kFrameArrays.end());
  return names;
}

std::vector<Array> data_arrays(const mjModel& m, const mjData& d, const std::function<const mjModel&()>& present) {
  std::vector<Array> list{{"time", MJENV_DTYPE_FLOAT64, {}, &d.time},
                          {"energy", MJENV_DTYPE_FLOAT64, {2}, d.energy},
                          {"ncon", MJENV_DTYPE_INT32, {}, &d.ncon},
                          {"nefc", MJENV_DTYPE_INT32, {}, &d.nefc},
                          {kSolverIterations, MJENV_DTYPE_INT32, {}, solver_iterations(d)}};
  if (kSolverIterationsCount > 1) list.back().shape = {kSolverIterationsCount};
  for_each_array(m, &d,
                 [&](const char* name, const auto* data, std::int64_t rows, std::int64_t columns, bool is_vector) {
                   using T = std::decay_t<decltype(*data)>;
                   if constexpr (!std::is_same_v<T, mjContact> && !std::is_same_v<T, std::uintptr_t>) {
                     const auto type = std::is_same_v<T, int>       ? MJENV_DTYPE_INT32
                                       : std::is_same_v<T, mjtBool> ? MJENV_DTYPE_UINT8
                                                                    : MJENV_DTYPE_FLOAT64;
                     list.push_back({name, type, is_vector ? std::vector{rows} : std::vector{rows, columns}, data, 0,
                                     held_elements(m, d, name)});
                   }
                 });
  // mjContact's H is left out: lanes do not compute it, because only MuJoCo's solver reads it.
  const auto add_of_contacts = [&](const char* name, const auto* data, int columns) {
    using T = std::decay_t<decltype(*data)>;
    const auto type = std::is_same_v<T, int> ? MJENV_DTYPE_INT32 : MJENV_DTYPE_FLOAT64;
    std::vector<std::int64_t> shape{max_contacts(m)};
    if (columns > 1) shape.push_back(columns);
    list.push_back({name, type, std::move(shape), data, sizeof(mjContact), [&d] { return d.ncon; }});
  };
  const mjContact* contact = d.contact;
  add_of_contacts("contact.dist", &contact->dist, 1);
  add_of_contacts("contact.pos", contact->pos, 3);
  add_of_contacts("contact.frame", contact->frame, 9);
  add_of_contacts("contact.includemargin", &contact->includemargin, 1);
  add_of_contacts("contact.friction", contact->friction, 5);
  add_of_contacts("contact.solref", contact->solref, mjNREF);
  add_of_contacts("contact.solimp", contact->solimp, mjNIMP);
  add_of_contacts("contact.mu", &contact->mu, 1);
  add_of_contacts("contact.dim", &contact->dim, 1);
  add_of_contacts("contact.geom1", &contact->geom1, 1);
  add_of_contacts("contact.geom2", &contact->geom2, 1);
  add_of_contacts("contact.exclude", &contact->exclude, 1);
  add_of_contacts("contact.efc_address", &contact->efc_address, 1);
  add_more_of_contacts(contact, add_of_contacts);
  // MuJoCo has a function for the force, but no array.
  add_of_contacts("contact.force", contact->frame, 6);
  list.back().compute = [&d, present](std::int64_t i, double* force) {
    mj_contactForce(&present(), &d, static_cast<int>(i), force);
  };
  // MuJoCo's counts of warnings, as 0 or 1, because a row does not store the counts.
  list.push_back(
      {"warnings", MJENV_DTYPE_INT32, {mjNWARNING}, d.warning, sizeof(mjWarningStat), [] { return mjNWARNING; }});
  list.back().compute = [&](std::int64_t i, double* given) { *given = d.warning[i].number > 0 ? 1 : 0; };
  if (!find(list, "efc_force")) {  // MuJoCo 4.0 puts it elsewhere in each step
    list.push_back(
        {"efc_force", MJENV_DTYPE_FLOAT64, {max_constraints(m)}, &d, sizeof(mjtNum), [&d] { return d.nefc; }});
    list.back().compute = [&d](std::int64_t i, double* force) { *force = d.efc_force[i]; };
  }
  return list;
}

Array with_contacts(Array array, std::int64_t count) {
  constexpr std::string_view kPrefix = "contact.";
  if (count > 0 && array.name.compare(0, kPrefix.size(), kPrefix) == 0)
    array.shape[0] = std::min(array.shape[0], count);
  return array;
}

}  // namespace mjenv::core
