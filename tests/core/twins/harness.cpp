#include "twins/harness.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "engine/errors.hpp"

namespace mjenv::core::twins {
namespace {

// The name of an array in which two work spaces differ, "" if there is none. Of a step that is not whole, compares the
// arrays that can be read after every step.
std::string difference(Work& found, Work& wanted) {
  for (Work* work : {&found, &wanted}) work->complete();
  const std::vector<Array> a = found.arrays(), b = wanted.arrays();
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (found.lag() & part_of(a[i].name)) continue;
    std::vector<double> x(a[i].count()), y(x.size());
    a[i].read(x.data());
    b[i].read(y.data());
    if (std::memcmp(x.data(), y.data(), x.size() * sizeof(double))) return a[i].name;
  }
  return "";
}

// Whether the array of geoms or bodies decides which of them touch.
bool decides_touch(const std::string& array) {
  return array.find("_contype") != std::string::npos || array.find("_conaffinity") != std::string::npos;
}

// Writes other values of an array to a row's block.
void change(const OwnArray& array, std::byte* block, Noise& noise) {
  std::vector<double> values(array.original.count());
  array.read(block, values.data());
  for (double& value : values)
    if (array.original.name.find("sameframe") != std::string::npos)
      value = noise.below(3) ? value : static_cast<double>(noise.below(5));
    else if (decides_touch(array.original.name))
      value = 1;
    else if (array.original.name == "eq_active")
      value = noise.below(3) > 0 ? 1 : 0;
    else if (array.original.name == "opt.enableflags")
      value = static_cast<double>(noise.below(2) * mjENBL_ENERGY);
    else if (array.original.name == "opt.disableflags")
      value = static_cast<double>(noise.below(2) * mjDSBL_ACTUATION);
    else if (value *= 1 + 0.3 * noise(); noise.below(8) == 0)
      value += 0.1;
  array.write(values.data(), block);
}

}  // namespace

void set_random(const mjModel& m, Work& work, Noise& noise) {
  work.clear();
  mjData& d = *work.data();
  const double spread = noise.below(4) == 0 ? 0.0 : noise.below(2) ? 0.1 : 1.0;
  const double speed = noise.below(6) == 0 ? 3000 : 3;
  for (int i = 0; i < m.nq; ++i) d.qpos[i] = m.qpos0[i] + spread * noise();
  for (int i = 0; i < m.njnt; ++i) {  // quaternions that turn nothing, some of them zeros
    if ((m.jnt_type[i] != mjJNT_FREE && m.jnt_type[i] != mjJNT_BALL) || noise.below(6)) continue;
    mjtNum* const quat = d.qpos + m.jnt_qposadr[i] + (m.jnt_type[i] == mjJNT_FREE ? 3 : 0);
    quat[0] = noise.below(2) ? 1 : 0;
    for (int k = 1; k < 4; ++k) quat[k] = noise.below(2) ? 0.0 : -0.0;
  }
  for (int i = 0; i < m.nv; ++i) d.qvel[i] = noise.below(5) == 0 ? noise.odd() : speed * spread * noise();
  for (int i = 0; i < m.nu; ++i) d.ctrl[i] = noise();
  for (int i = 0; i < m.nv; ++i) d.qacc_warmstart[i] = 30 * spread * noise();
}

void compare_steps(const Named& named, const lanes::Code& code, const Reading& reading, int& rows, int& left) {
  const auto& [name, model] = named;
  const ErrorTrap trap;
  Noise noise;
  const int width = code.width;
  const auto stepper = lanes::make_stepper(*model, code);
  std::vector<std::unique_ptr<Work>> works, plain;
  std::vector<Work*> all;
  std::vector<std::vector<double>> states, befores(static_cast<std::size_t>(width));
  std::vector<double*> before;
  for (int row = 0; row < width; ++row) {
    for (auto* list : {&works, &plain}) {
      list->push_back(std::make_unique<Work>(model));
      list->back()->expect(part_of(reading.array));
      if (reading.is_current) list->back()->keep_current();
    }
    all.push_back(works.back().get());
    befores[static_cast<std::size_t>(row)].resize(works[0]->layout().size);
    before.push_back(befores[static_cast<std::size_t>(row)].data());
  }
  OwnArrays own(*model);
  if (reading.own) own.add(reading.own);
  if (reading.own && decides_touch(reading.own)) own.add("body" + std::string(reading.own).substr(4));
  std::vector<std::vector<double>> blocks(all.size(), std::vector<double>(own.block_bytes() / sizeof(double) + 1));
  std::vector<double> last(works[0]->layout().size);
  states.assign(all.size(), last);
  Original original(*model);
  const bool is_original = reading.frames > 0 && !reading.own && !reading.has_callback && !reading.is_current;
  int usual_stepped = 0;
  const auto controls = static_cast<int>(model->get()->nu);
  for (int round = 0; round < kRounds; ++round) {
    const bool is_usual = round % 4 == 2;  // rows have the model's values
    const auto begin = [&](Work& work, std::size_t row) {
      if (reading.own) work.use(own, reinterpret_cast<std::byte*>(blocks[row].data()));
      work.load(states[row].data());
      work.act({});
    };
    const auto call_back = [&](Work& work, std::size_t row, std::int64_t frame) {
      for (int i = 0; i < controls; ++i)
        work.data()->ctrl[i] = round % 4 == 3 && row % 2 == 1 ? 2 * mjMAXVAL : 0.1 * (1.0 + row + frame + i);
    };
    const auto step_alone = [&](Work& work, std::size_t row) {
      const Work::BeforeSubstep of_row = [&](std::int64_t frame) { call_back(work, row, frame); };
      try {
        if (reading.frames == 0)
          work.forward();
        else
          work.step(reading.frames, last.data(), reading.has_callback ? &of_row : nullptr);
      } catch (const std::exception&) {
        return false;  // because MuJoCo's memory is too small
      }
      return true;
    };
    for (std::size_t row = 0; row < all.size(); ++row) {
      auto* const block = reinterpret_cast<std::byte*>(blocks[row].data());
      own.fill(0, block);
      for (const OwnArray& array : own.list())
        if (!is_usual) change(array, block, noise);
      set_random(*model->get(), *plain[row], noise);
      if (reading.place) reading.place(row, *plain[row]->data());
      std::vector<double>& state = states[row];
      plain[row]->save(state.data());
      if (reading.bad && noise.below(3) == 0) {
        const auto part = works[0]->layout().part(reading.bad);
        if (part->count > 0)
          state[static_cast<std::size_t>(part->offset) + noise.below(static_cast<std::uint64_t>(part->count))] =
              noise.below(2) ? std::nan("") : 2 * mjMAXVAL;
      }
      for (Work* work : {works[row].get(), plain[row].get()}) begin(*work, row);
    }
    const int count = std::max(2, width - round % 3);
    const lanes::Stepper::BeforeSubstep of_rows = [&](int row, std::int64_t frame) {
      const auto index = static_cast<std::size_t>(row);
      call_back(*works[index], index, frame);
    };
    const std::uint32_t stepped = reading.frames == 0 ? stepper->forward(all.data(), count)
                                                      : stepper->step(all.data(), count, reading.frames, before.data(),
                                                                      reading.has_callback ? &of_rows : nullptr);
    if (is_usual) usual_stepped += __builtin_popcount(stepped);
    for (std::size_t row = 0; row < static_cast<std::size_t>(count); ++row) {
      original.load(*plain[row]->data());
      const bool is_alone = !(stepped >> row & 1), fails = !step_alone(*plain[row], row);
      if (is_original && !fails) original.step(reading.frames);
      if (is_original && !fails && !original.has_state_of(*plain[row]->data()))
        fail_msg("%s: the step is not that of the model itself", name.c_str());
      ++rows;
      left += is_alone;
      if (is_alone) {
        begin(*works[row], row);
        if (step_alone(*works[row], row) == fails) fail_msg("%s, %d lanes: a row alone", name.c_str(), width);
        if (fails) continue;
      }
      if (fails) fail_msg("%s, %d lanes: lanes do not fail", name.c_str(), width);
      if (const std::string found = difference(*works[row], *plain[row]); !found.empty())
        fail_msg("%s, %d lanes, %s is read%s: %s", name.c_str(), width, reading.array,
                 reading.is_current ? ", new states are shown" : "", found.c_str());
    }
  }
  if (reading.returns && usual_stepped == 0) fail_msg("%s, %d lanes: usual rows are left", name.c_str(), width);
}

std::uint32_t step_rows(const std::shared_ptr<const Model>& model,
                        const std::function<void(std::size_t, mjData&)>& set) {
  const ErrorTrap trap;
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(lanes::widths().back()));
  Rows rows(model);
  for (std::size_t row = 0; row < rows.all.size(); ++row) {
    set(row, *rows.all[row]->data());
    rows.all[row]->save(rows.states[row].data());
  }
  const std::uint32_t done = rows.step(*stepper);
  Work plain(model);
  Original original(*model);
  std::vector<double> last(rows.states[0].size());
  for (std::size_t row = 0; row < rows.all.size(); ++row) {
    plain.load(rows.states[row].data());
    original.load(*plain.data());
    original.step();
    plain.step(1, last.data());
    assert_true(original.has_state_of(*plain.data()));
    if (done >> row & 1) assert_string_equal(difference(*rows.all[row], plain).c_str(), "");
  }
  return done;
}

}  // namespace mjenv::core::twins

int run_twins() { return run_listed("twins"); }
