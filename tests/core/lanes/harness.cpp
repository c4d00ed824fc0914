// Lanes compute every array of mjData as MuJoCo's own functions do, bit for bit: steps of random states, in all
// instruction sets of this CPU, against mj_step.
#include "lanes/harness.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>

namespace mjenv::core::lanes_tests {

int share = 1, made, made_of_contacts, made_of_shared, left_by_solver;
const lanes::Code* counted;
std::string failures;

namespace {

int run(bool few) {
  if (few) share = 5;
  return run_listed("lanes");
}

}  // namespace

std::vector<double> random_state(const mjModel& m, const StateLayout& layout, Kind kind, Noise& noise) {
  std::vector<double> state(layout.size);
  double *qpos = layout.qpos(state.data()), *qvel = layout.qvel(state.data()), *warm = layout.warmstart(state.data());
  double* ctrl = warm + layout.nv;
  const double spread = kind == Kind::at_rest ? 0 : kind == Kind::fast ? 4 : 0.4;
  for (int i = 0; i < m.nq; ++i) qpos[i] = m.qpos0[i] + spread * noise();
  for (int i = 0; i < m.nv; ++i) {
    qvel[i] = kind == Kind::at_rest ? 0 : (kind == Kind::fast ? 30 : 3) * noise();
    warm[i] = kind == Kind::at_rest ? 0 : 10 * noise();
  }
  for (int i = 0; i < m.nu; ++i) ctrl[i] = 1.5 * noise();
  for (int i = 0; i < m.na; ++i) layout.act(state.data())[i] = 0.5 + 0.6 * noise();
  for (std::size_t i = 0; i < layout.more; ++i) layout.rest(state.data())[i] = noise();  // mocap_quat
  for (int j = 0; j < m.njnt; ++j) {
    if (m.jnt_type[j] != mjJNT_FREE && m.jnt_type[j] != mjJNT_BALL) continue;
    double* quat = qpos + m.jnt_qposadr[j] + (m.jnt_type[j] == mjJNT_FREE ? 3 : 0);
    if (kind != Kind::at_rest)
      for (int k = 0; k < 4; ++k) quat[k] = noise();
    if (kind == Kind::odd)
      for (int k = 0; k < 4; ++k) quat[k] = noise.below(3) ? noise.odd() : k == 0;
  }
  if (kind == Kind::odd) {
    for (int i = 0; i < m.nq; ++i)
      if (noise.below(3) == 0) qpos[i] = noise.below(2) ? m.qpos0[i] : noise.odd();
    for (int i = 0; i < m.nv; ++i)
      if (noise.below(3) == 0) qvel[i] = noise.odd();
    for (int i = 0; i < m.nu; ++i)
      if (noise.below(3) == 0) ctrl[i] = noise.odd();
  }
  if (kind == Kind::tiny) {
    std::fill_n(qvel, m.nv, -0.0);
    std::fill_n(ctrl, m.nu, -5e-324);
  }
  if (kind == Kind::at_limit) {
    const double values[] = {0, 9e9, 9.99e9, 1e10, std::nextafter(1e10, kInfinite), 1.001e10, 1.01e10};
    const auto any = [&] { return (noise.below(2) ? 1 : -1) * values[noise.below(std::size(values))]; };
    for (int i = 0; i < m.nq; ++i) qpos[i] = any();
    for (int i = 0; i < m.nv; ++i) qvel[i] = any();
  }
  if (kind == Kind::bad) {
    const double values[] = {kNaN, -kNaN, INFINITY, -INFINITY, 1e11, -1e300, 9.9e9};
    const auto any = [&](double* array, int count) {
      if (count > 0) array[noise.below(static_cast<std::uint64_t>(count))] = values[noise.below(std::size(values))];
    };
    switch (noise.below(5)) {
      case 0: any(qpos, m.nq); break;
      case 1: any(qvel, m.nv); break;
      case 2: any(ctrl, m.nu); break;
      case 3: any(layout.rest(state.data()), static_cast<int>(layout.more)); break;
      default: any(warm, m.nv);
    }
  }
  return state;
}

namespace {

// How much of an array has a meaning. Of those of constraints, as many rows as there are constraints.
std::size_t length(const Array& array, const mjModel& m, const mjData& d) {
  // mj_Euler factorises the matrix with damping only if there is damping.
  const bool is_damped = std::any_of(m.dof_damping, m.dof_damping + m.nv, [](mjtNum damping) { return damping > 0; });
  if ((array.name == "qH" || array.name == "qHDiagInv") && !is_damped) return 0;
  if (array.name.rfind("wrap_", 0) == 0 || (array.name.rfind("ten_J", 0) == 0 && array.held))
    return static_cast<std::size_t>(array.held());
  if (array.name.rfind("efc_", 0) != 0) return array.count();
  const auto rows = static_cast<std::size_t>(d.nefc);
  if (array.name == "efc_J" && mj_isSparse(&m)) return rows ? d.efc_J_rowadr[rows - 1] + d.efc_J_rownnz[rows - 1] : 0;
  if (array.name == "efc_J") return rows * static_cast<std::size_t>(m.nv);
  if (array.name == "efc_KBIP") return 4 * rows;
  static const char* const ones[] = {"efc_type",       "efc_id",    "efc_pos",  "efc_margin", "efc_frictionloss",
                                     "efc_diagApprox", "efc_D",     "efc_R",    "efc_vel",    "efc_aref",
                                     "efc_b",          "efc_force", "efc_state"};
  return std::count(std::begin(ones), std::end(ones), array.name) ? rows : 0;
}

}  // namespace

std::string difference(Work& got, Work& want) {
  got.complete();
  want.complete();
  if (got.lag() & got.expected()) return "what is expected lags";
  const std::vector<Array> found = got.arrays(), expected = want.arrays();
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (got.lag() & part_of(found[i].name)) continue;
    const std::size_t count = length(expected[i], want.model(), *want.data());
    if (found[i].stride) {
      std::vector<double> a(found[i].count()), b(a.size());
      found[i].read(a.data());
      expected[i].read(b.data());
      if (std::memcmp(a.data(), b.data(), a.size() * sizeof(double))) return found[i].name;
      continue;
    }
    const std::size_t size = found[i].type == MJENV_DTYPE_UINT8   ? 1
                             : found[i].type == MJENV_DTYPE_INT32 ? sizeof(int)
                                                                  : sizeof(double);
    if (count && std::memcmp(found[i].data, expected[i].data, count * size)) return found[i].name;
  }
  return "";
}

bool ends_with(const std::string& name, const std::string& end) {
  return name.size() >= end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0;
}

namespace {

// Changes the integers of an array at random: flags, which geoms can touch, and numbers of iterations.
void change_integers(const Array& array, std::vector<double>& values, Noise& noise) {
  const bool is_flag = array.type == MJENV_DTYPE_UINT8, is_changed = noise.below(24) == 0;
  for (double& value : values)
    if (is_flag)
      value = noise.below(4) ? value : 1 - value;
    else if (array.name == "opt.iterations")
      value = std::floor(value * (1 + 0.3 * noise()));
    else if (is_changed && (array.name == "opt.noslip_iterations" || array.name.rfind("opt.", 0) != 0))
      value = static_cast<double>(noise.below(3));
}

// Values of their own for a row: those of the model, changed at random. Half of the rows have numbers in an array where the
// model has zeros.
std::vector<double> random_block(const OwnArrays& own, Noise& noise) {
  std::vector<double> block(own.block_bytes() / sizeof(double));
  auto* bytes = reinterpret_cast<std::byte*>(block.data());
  for (const OwnArray& array : own.list()) {
    if (!array.original.data) {  // an input of mjData
      std::vector<double> values(array.original.count());
      const bool is_still = noise.below(3) == 0;
      for (double& value : values) value = is_still || noise.below(4) == 0 ? noise.odd() * 0 : 0.3 * noise();
      array.write(values.data(), bytes);
      continue;
    }
    const bool is_raised = noise.below(2 * own.list().size()) == 0;
    std::vector<double> values(array.original.count());
    array.original.read(values.data());
    const bool is_cleared = array.original.name == "dof_damping" && noise.below(8) == 0;
    const bool is_shifted = array.original.name == "jnt_stiffness" && noise.below(8) == 0;
    const std::string& name = array.original.name;
    if (array.original.type == MJENV_DTYPE_UINT8 || array.original.type == MJENV_DTYPE_INT32) {
      change_integers(array.original, values, noise);
      array.write(values.data(), bytes);
      continue;
    }
    for (double& value : values) {
      value = is_cleared ? 0 : value * (1 + 0.3 * noise()) + (is_shifted ? 1 : 0);
      if (is_raised && value == 0 && noise.below(2)) value = 0.1 + 0.1 * noise();
    }
    if ((ends_with(name, "_quat") || ends_with(name, "_iquat")) && noise.below(8) > 0)
      for (std::size_t i = 0; i < values.size(); i += 4) mju_normalize4(&values[i]);
    // In a fluid, MuJoCo passes over bodies whose mass is below 1e-15.
    if (array.original.name == "body_mass" && noise.below(8) == 0) values[noise.below(values.size())] = 1e-16;
    array.write(values.data(), bytes);
  }
  return block;
}

}  // namespace

bool diverges(Work& work, int frames, double* before) {
  try {
    work.step(frames, before);
  } catch (const Error&) {
    return true;
  }
  return work.diverged() || work.diverged_early();
}

std::string compare(const Model& model, lanes::Stepper& stepper, std::vector<std::unique_ptr<Work>>& works, Work& plain,
                    const OwnArrays& own, Kind kind, int frames, Noise& noise, Counts& counts) {
  const mjModel& m = *model.get();
  const StateLayout layout(model);
  const int count = works.size() > 2 && noise.below(4) == 0 ? 2 : static_cast<int>(works.size());
  std::vector<Work*> some;
  std::vector<std::vector<double>> states, befores, blocks;
  std::vector<double*> before;
  const auto begin = [&](Work& work, std::size_t i) {
    const std::vector<double>& state = states[i];
    if (!own.list().empty()) work.use(own, reinterpret_cast<std::byte*>(blocks[i].data()));
    work.load(state.data());
    work.act({state.data() + layout.size - layout.more - layout.nu, MJENV_DTYPE_FLOAT64, m.nu});
  };
  for (int i = 0; i < count; ++i) {
    states.push_back(random_state(m, layout, kind, noise));
    befores.emplace_back(layout.size);
    blocks.push_back(random_block(own, noise));
    some.push_back(works[static_cast<std::size_t>(i)].get());
    begin(*some.back(), static_cast<std::size_t>(i));
  }
  for (auto& state : befores) before.push_back(state.data());
  const std::uint32_t done =
      frames == 0 ? stepper.forward(some.data(), count) : stepper.step(some.data(), count, frames, before.data());
  for (int i = 0; i < count; ++i) {
    ++counts.rows;
    std::vector<double> last(layout.size);
    begin(plain, static_cast<std::size_t>(i));
    if (!(done >> i & 1)) {
      // Lanes also leave rows whose numbers are bad between the stages of RK4, where MuJoCo does not check them. It finds
      // them at the beginning of the next step.
      counts.left += !diverges(plain, frames, last.data()) && !diverges(plain, 1, last.data());
      continue;
    }
    if (frames == 0)
      plain.forward();
    else
      plain.step(frames, last.data());
    counts.contacts += plain.data()->ncon;
    counts.constraints += plain.data()->nefc;
    if (plain.diverged()) return "a row that diverges was not left to MuJoCo";
    if (frames > 0 && std::memcmp(last.data(), before[static_cast<std::size_t>(i)], last.size() * sizeof(double)))
      return "before";
    const std::vector<double>&raw = some[static_cast<std::size_t>(i)]->raw_qpos(), &expected = plain.raw_qpos();
    if (std::memcmp(raw.data(), expected.data(), expected.size() * sizeof(double))) return "raw_qpos";
    const std::string found = difference(*some[static_cast<std::size_t>(i)], plain);
    if (!found.empty()) return found;
  }
  return "";
}

std::vector<Array> writable_arrays(const Model& model) {
  const std::vector<std::string> names = writable_names(model);
  std::vector<Array> found;
  for (const Array& array : model.arrays())
    if (std::find(names.begin(), names.end(), array.name) != names.end()) found.push_back(array);
  return found;
}

bool is_read(const std::string& name) {
  for (const char* kind : {"key_", "light_", "mat_", "numeric_", "tex_", "tuple_", "stat."})
    if (name.rfind(kind, 0) == 0 && name != "stat.meaninertia") return false;
  return !ends_with(name, "_user") && !ends_with(name, "_rgba") && !ends_with(name, "_matid");
}

namespace {

// The arrays of which rows can have their own values; with those of frames and of which geoms touch, or without them.
OwnArrays own_arrays(const Model& model, bool with_frames) {
  OwnArrays own(model);
  const std::vector<std::string> frames{"body_pos", "body_quat",   "body_iquat",   "jnt_pos",          "jnt_axis",
                                        "qpos0",    "geom_pos",    "geom_quat",    "geom_size",        "geom_margin",
                                        "geom_gap", "geom_rbound", "geom_contype", "geom_conaffinity", "geom_fluid",
                                        "site_pos", "site_quat"};
  for (const Array& array : writable_arrays(model))
    if (is_read(array.name) && (with_frames || std::count(frames.begin(), frames.end(), array.name) == 0))
      own.add(array.name);
  for (const char* input : {"qfrc_applied", "xfrc_applied"}) own.add(input);
  if (model.get()->nmocap > 0) own.add("mocap_pos");
  return own;
}

// Work spaces that are used in turns: no more of mjData is read than after every step, all of it, or forces; and the same of
// the new state.
constexpr std::size_t kKinds = 6;
using Works = std::array<std::vector<std::unique_ptr<Work>>, kKinds>;

Works works_of(const std::shared_ptr<const Model>& model, int width) {
  Works works;
  for (std::size_t kind = 0; kind < kKinds; ++kind)
    for (int i = 0; i < width; ++i) {
      works[kind].push_back(std::make_unique<Work>(model));
      if (kind % 3 == 1) works[kind].back()->expect(part_of("qM"));
      if (kind % 3 == 2) works[kind].back()->expect(part_of("cfrc_ext"));
      if (kind >= 3) works[kind].back()->keep_current();
    }
  return works;
}

std::string compare(const std::shared_ptr<const Model>& model, int width, lanes::Stepper& stepper, Works& works,
                    const OwnArrays& own, int rows, Leavable leavable) {
  static std::size_t turn = 0;
  Work plain(model), plain_current(model);
  plain_current.keep_current();
  plain_current.expect(part_of("cfrc_ext"));  // so that its steps compute the forces
  Noise noise;
  const bool are_shared = own.list().empty();
  for (const auto& [kind, name] : {std::pair{Kind::at_rest, "at rest"},
                                   {Kind::tame, "tame"},
                                   {Kind::odd, "odd"},
                                   {Kind::fast, "fast"},
                                   {Kind::bad, "bad"}}) {
    Counts counts;
    for (int round = 0; round < rows / share / width; ++round) {
      const std::size_t use = turn++ % kKinds;
      const bool is_current = use >= 3;
      const std::string found = compare(*model, stepper, works[use], is_current ? plain_current : plain, own, kind,
                                        (use > 0) + static_cast<int>(noise.below(3)), noise, counts);
      if (!found.empty())
        return found + (is_current ? ", of the new state," : "") + " with " + std::to_string(width) + " lanes, round " +
               std::to_string(round) + " of states " + name + (are_shared ? "" : " of rows with values of their own");
    }
    std::printf("%s, %d lanes, %s%s: %d rows, %d left to MuJoCo, %d contacts, %d constraints\n", model->label().c_str(),
                width, name, are_shared ? "" : ", own values", counts.rows, counts.left, counts.contacts,
                counts.constraints);
    // A fifth of the rows is too few to say how many are usual.
    const int left_of = are_shared ? leavable.of_shared : leavable.of_own;
    if (share == 1 && kind < Kind::odd && counts.left > counts.rows / left_of)
      return "lanes leave too many rows to MuJoCo";
  }
  return "";
}

}  // namespace

std::string compare(const std::shared_ptr<const Model>& model, int width, lanes::Stepper& stepper, const OwnArrays& own,
                    int rows) {
  Works works = works_of(model, width);
  return compare(model, width, stepper, works, own, rows, {});
}

void count_making(lanes::Lanes& d, const lanes::Contacts& contacts, lanes::Constraints& c) {
  ++made;
  made_of_contacts += contacts.contact_count > 0;
  counted->makeConstraint(d, contacts, c);
}

namespace {

void count_leaving(lanes::Lanes& d, lanes::Constraints& c) {
  const unsigned before = d.left_to_mujoco;
  counted->solNewton(d, c);
  for (unsigned left = d.left_to_mujoco & ~before; left; left &= left - 1) ++left_by_solver;
}

}  // namespace

std::string compare(const std::shared_ptr<const Model>& model, int rows, Leavable leavable) {
  const ErrorTrap trap;
  const OwnArrays shared(*model), own = own_arrays(*model, false), placed = own_arrays(*model, true);
  made = made_of_contacts = left_by_solver = 0;
  for (const int width : lanes::widths()) {
    counted = lanes::code_of(width);
    lanes::Code code = *counted;
    code.makeConstraint = count_making;
    code.solNewton = count_leaving;
    const auto stepper = lanes::make_stepper(*model, code);
    Works of_shared = works_of(model, width), of_own = works_of(model, width);
    for (const OwnArrays* arrays : {&shared, &own, &placed, &shared}) {
      Works& works = arrays == &shared ? of_shared : of_own;
      const std::string found = compare(model, width, *stepper, works, *arrays, rows, leavable);
      if (!found.empty()) return found;
    }
  }
  return "";
}

std::string with(const std::string& from, const std::string& to, std::string text) {
  return text.replace(text.find(from), from.size(), to);
}

std::string in_front_of_body(const std::string& what, const std::string& text) {
  return with("<worldbody>", what + "<worldbody>", text);
}

std::vector<double> other_values(const OwnArray& array, Noise& noise) {
  std::vector<double> values(array.original.count());
  array.original.read(values.data());
  if (array.original.type == MJENV_DTYPE_FLOAT64 || array.original.type == MJENV_DTYPE_FLOAT32)
    for (double& value : values) value *= 1 + 0.01 * noise();
  if (ends_with(array.original.name, "quat"))
    for (std::size_t i = 0; i < values.size(); i += 4) mju_normalize4(&values[i]);
  return values;
}

std::string compare_own(const std::shared_ptr<const Model>& model, const std::string& array, const Values& values,
                        std::uint32_t left, int frames, Kind kind) {
  const mjModel& m = *model->get();
  const StateLayout layout(*model);
  const int width = lanes::widths().back();
  counted = lanes::code_of(width);
  lanes::Code code = *counted;
  code.makeConstraint = count_making;
  made = made_of_contacts = 0;
  const auto stepper = lanes::make_stepper(*model, code);
  OwnArrays own(*model);
  own.add(array);
  const OwnArray& written = own.list().front();
  Noise noise;
  std::vector<std::unique_ptr<Work>> works;
  std::vector<Work*> some;
  std::vector<std::vector<double>> states, befores, blocks;
  std::vector<double*> before;
  const auto begin = [&](Work& work, std::size_t i, bool is_own) {
    if (is_own) work.use(own, reinterpret_cast<std::byte*>(blocks[i].data()));
    work.load(states[i].data());
    work.act({states[i].data() + layout.size - layout.more - layout.nu, MJENV_DTYPE_FLOAT64, m.nu});
  };
  for (std::size_t i = 0; i < static_cast<std::size_t>(width); ++i) {
    states.push_back(random_state(m, layout, kind, noise));
    befores.emplace_back(layout.size);
    blocks.emplace_back(own.block_bytes() / sizeof(double) + 1);
    written.write(values(written, noise).data(), reinterpret_cast<std::byte*>(blocks.back().data()));
    before.push_back(befores.back().data());
    works.push_back(std::make_unique<Work>(model));
    works.back()->expect(part_of("qM"));
    some.push_back(works.back().get());
    begin(*some.back(), i, false);
  }
  const std::uint32_t usual = stepper->step(some.data(), width, frames, before.data());
  if (usual + 1 != 1U << width) return "left to MuJoCo without values of their own";
  made_of_shared = made;
  for (std::size_t i = 0; i < some.size(); ++i) begin(*some[i], i, true);
  const std::uint32_t done = stepper->step(some.data(), width, frames, before.data());
  if (done != (usual & ~left)) return (usual & ~left & ~done) != 0 ? "left to MuJoCo" : "not left to MuJoCo";
  Work plain(model);
  std::vector<double> last(layout.size);
  for (std::size_t i = 0; i < some.size(); ++i) {
    if (!(done >> i & 1)) continue;
    begin(plain, i, true);
    plain.step(frames, last.data());
    const std::string found = difference(*some[i], plain);
    if (!found.empty()) return found;
  }
  return "";
}

Values in_odd_rows(double number, std::ptrdiff_t count) {
  int row = 0;
  return [row, number, count](const OwnArray& array, Noise& /*noise*/) mutable {
    std::vector<double> values(array.original.count());
    if (array.original.data) array.original.read(values.data());
    if (row++ % 2 == 1) std::fill(count ? values.end() - count : values.begin(), values.end(), number);
    return values;
  };
}

std::uint32_t step_rows(const std::shared_ptr<const Model>& model, lanes::Stepper& stepper,
                        std::vector<std::vector<double>> states, const std::string& expected) {
  const ErrorTrap trap;
  const int count = static_cast<int>(states.size());
  Group group(model, count);
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!expected.empty()) group.works[i]->expect(part_of(expected));
    group.works[i]->load(states[i].data());
  }
  const std::uint32_t done = stepper.step(group.some.data(), count, 1, group.before.data());
  Work plain(model);
  std::vector<double> last(StateLayout(*model).size);
  for (std::size_t i = 0; i < states.size(); ++i) {
    if (!(done >> i & 1)) continue;
    plain.load(states[i].data());
    plain.step(1, last.data());
    assert_memory_equal(last.data(), group.befores[i].data(), last.size() * sizeof(double));
    assert_string_equal(difference(*group.works[i], plain).c_str(), "");
  }
  return done;
}

std::uint32_t step_from(const std::shared_ptr<const Model>& model, const std::vector<SetState>& sets,
                        const std::string& expected) {
  const mjModel& m = *model->get();
  const StateLayout layout(*model);
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  std::uint32_t done = 0;
  for (const SetState& set : sets) {
    std::vector<std::vector<double>> states(static_cast<std::size_t>(width), std::vector<double>(layout.size));
    for (std::size_t i = 0; i < states.size(); ++i) {
      double *const state = states[i].data(), *const warmstart = layout.warmstart(state);
      std::copy_n(m.qpos0, m.nq, layout.qpos(state));
      set(i, {layout.qpos(state), layout.qvel(state), warmstart, warmstart + layout.nv});
    }
    done = step_rows(model, *stepper, states, expected);
  }
  return done;
}

void keep_state(std::size_t /*row*/, const RowState& /*state*/) {}

std::vector<std::vector<double>> states_with(const Model& model, std::size_t index, double number) {
  Noise noise;
  std::vector<std::vector<double>> states(static_cast<std::size_t>(lanes::widths().back()),
                                          random_state(*model.get(), StateLayout(model), Kind::at_rest, noise));
  for (std::size_t i = 1; i < states.size(); i += 2) states[i][index] = number;
  return states;
}

void assert_names(const std::string& found, const char* word) {
  if (found.find(word) == std::string::npos) fail_msg("\"%s\" does not name %s", found.c_str(), word);
}

}  // namespace mjenv::core::lanes_tests

int run_lanes(bool few) { return mjenv::core::lanes_tests::run(few); }

std::string compare_in_lanes(const std::shared_ptr<const mjenv::core::Model>& model, int rows) {
  return mjenv::core::lanes_tests::compare(model, rows,
                                           {20, 1});  // these rows are few, and all of them may have odd values
}
