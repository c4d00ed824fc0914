// A worker that computes several rows in turn shows each row's mjData as if that row had an mjData of its own: compared
// with plain MuJoCo, which resets, steps and sets states as Gymnasium does, with masses of the row's own.
#include "env/worker.hpp"

#include "engine/mujoco.hpp"  // before cmocka's macro fail

#include <algorithm>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

#include "engine/constants.hpp"
#include "run.hpp"
#include "task/registry.hpp"

// In the core's namespace, in which MuJoCo's names are the functions of the library that the core has opened.
namespace mjenv::core {
namespace {

constexpr std::int64_t kRows = 3;
constexpr int kOperations = 800;

// One row in plain MuJoCo.
class Plain {
 public:
  explicit Plain(const Task& task)
      : task_(task),
        owned_(mj_copyModel(nullptr, task.model->get()), mj_deleteModel),
        m_(owned_.get()),
        d_(mj_makeData(m_), mj_deleteData) {}

  void reset(const Rng& rng) {
    mj_resetData(m_, d_.get());
    mjenv_sim sizes{};
    sizes.nq = m_->nq, sizes.nv = m_->nv, sizes.na = m_->na, sizes.qpos0 = m_->qpos0;
    Random random(&rng);
    task_.calls->reset(sizes, {d_->qpos, d_->qvel, d_->act, nullptr, nullptr}, random);
    mj_forward(m_, d_.get());
  }
  void step(const std::vector<double>& action) {
    std::copy(action.begin(), action.end(), d_->ctrl);
    for (int i = 0; i < task_.frame_skip; ++i) mj_step(m_, d_.get());
    mj_rnePostConstraint(m_, d_.get());
  }
  void set_state(const std::vector<double>& qpos, const std::vector<double>& qvel) {
    std::copy(qpos.begin(), qpos.end(), d_->qpos);
    std::copy(qvel.begin(), qvel.end(), d_->qvel);
    mj_forward(m_, d_.get());
  }
  void set_masses(const std::vector<double>& masses) { std::copy(masses.begin(), masses.end(), m_->body_mass); }
  void set_constants() { mj_setConst(m_, d_.get()); }
  const mjData& data() const { return *d_; }
  const mjModel& model() const { return *m_; }

 private:
  const Task& task_;
  std::unique_ptr<mjModel, void (*)(mjModel*)> owned_;
  mjModel* m_;
  std::unique_ptr<mjData, void (*)(mjData*)> d_;
};

bool same(const Array& array, const double* expected, std::int64_t count) {
  return array.count() == static_cast<std::size_t>(count) &&
         std::memcmp(array.data, expected, static_cast<std::size_t>(count) * sizeof(double)) == 0;
}

// The first array of the row that differs from plain MuJoCo's; "" if none does.
std::string difference(Worker& worker, std::int64_t row, const Plain& plain) {
  const mjData& d = plain.data();
  const mjModel& m = plain.model();
  const struct {
    const char* name;
    const double* expected;
    std::int64_t count;
  } arrays[] = {{"qpos", d.qpos, m.nq},
                {"qvel", d.qvel, m.nv},
                {"qacc", d.qacc, m.nv},
                {"xpos", d.xpos, 3 * m.nbody},
                {"cvel", d.cvel, 6 * m.nbody},
                {"geom_xpos", d.geom_xpos, 3 * m.ngeom},
                {"cinert", d.cinert, 10 * m.nbody},
                {"cfrc_ext", d.cfrc_ext, 6 * m.nbody},
                {"qfrc_actuator", d.qfrc_actuator, m.nv},
                {"qacc_warmstart", d.qacc_warmstart, m.nv}};
  for (const auto& a : arrays)
    if (!same(*worker.array(row, a.name), a.expected, a.count)) return a.name;
  return "";
}

void test_rows_in_turn(void** state) {
  const char* id = static_cast<const char*>(*state);
  const Task task = task_of(id_of(id))->build(default_options(id_of(id)));
  Rows rows(task, 0, kRows);
  Worker worker(0, task, rows), other(1, task, rows);
  worker.clear();
  std::vector<std::string> arrays = constant_arrays(*task.model, {"body_mass"});
  arrays.emplace_back("body_mass");
  rows.add_arrays(arrays);
  for (Worker* each : {&worker, &other}) each->prepare();
  const OwnArray& mass = *rows.arrays().find("body_mass");
  std::vector<std::unique_ptr<Plain>> plain;
  for (std::int64_t row = 0; row < kRows; ++row) plain.push_back(std::make_unique<Plain>(task));

  Rng random = Rng::from_seed(7);
  const auto draw = [&](int count, double size) {
    std::vector<double> values(static_cast<std::size_t>(count));
    for (double& x : values) x = random.uniform(-size, size);
    return values;
  };
  int computed_again = 0;
  for (int i = 0; i < kOperations; ++i) {
    const auto row = static_cast<std::int64_t>(random.next() % kRows);
    Worker& chosen = random.next() % 4 == 0 ? other : worker;
    Plain& expected = *plain[static_cast<std::size_t>(row)];
    const std::uint64_t kind = i < kRows ? 0 : random.next() % 18;
    const std::int64_t target = i < kRows ? i : row;
    if (kind == 0) {
      Rng rng = Rng::from_seed(static_cast<std::uint64_t>(i));
      plain[static_cast<std::size_t>(target)]->reset(rng);
      chosen.reset.begin(target, rng);
    } else if (kind < 10) {
      const std::vector<double> action = draw(task.model->nu(), 1);
      expected.step(action);
      chosen.step.load(row, {action.data(), MJENV_DTYPE_FLOAT64, task.model->nu()});
      chosen.step.advance(task.frame_skip);
      chosen.step.commit(row);
    } else if (kind < 12) {
      std::vector<double> qpos(expected.data().qpos, expected.data().qpos + task.model->nq());
      qpos[0] += 0.01;
      const std::vector<double> qvel = draw(task.model->nv(), 1);
      expected.set_state(qpos, qvel);
      (rows.worker(row) == 0 ? worker : other).set_state(row, qpos.data(), qvel.data());
    } else if (kind == 12) {
      std::vector<double> masses(expected.model().body_mass, expected.model().body_mass + expected.model().nbody);
      for (double& x : masses) x *= random.uniform(0.5, 2);
      expected.set_masses(masses);
      rows.keep(row);
      mass.write(masses.data(), rows.own_values(row));
      rows.head(row).written = Written::by_caller;
      for (Worker* each : {&worker, &other}) each->forget(row);
    } else if (kind == 13) {
      expected.set_constants();
      assert_true((rows.worker(row) == 0 ? worker : other).set_constants(row).empty());
    } else {
      Worker& reader = rows.worker(target) == 0 ? worker : other;
      computed_again += !reader.holds(target);
      assert_string_equal(difference(reader, target, *plain[static_cast<std::size_t>(target)]).c_str(), "");
      assert_true(reader.holds(target));
    }
  }
  assert_true(computed_again > 20);
}

// A row that was changed elsewhere is not held any more, and no other row is forgotten.
void test_forget(void** state) {
  (void)state;
  const Task task = task_of(id_of("Hopper-v5"))->build(default_options(id_of("Hopper-v5")));
  Rows rows(task, 0, 2);
  Worker worker(0, task, rows);
  worker.clear();
  Rng rng = Rng::from_seed(1);
  worker.reset.begin(0, rng);
  assert_true(worker.holds(0) && !worker.holds(1));
  worker.forget(1);
  assert_true(worker.holds(0));
  worker.forget(0);
  assert_false(worker.holds(0));
  worker.hold(1);  // never reset: as mj_resetData leaves it
  assert_true(worker.holds(1));
  const Plain plain(task);
  assert_true(same(*worker.array(1, "xpos"), plain.data().xpos, 3 * plain.model().nbody));
}

int run() {
  static char ant[] = "Ant-v5", hopper[] = "Hopper-v5", humanoid[] = "Humanoid-v4", pusher[] = "Pusher-v5";
  const CMUnitTest tests[] = {
      cmocka_unit_test_prestate(test_rows_in_turn, ant),
      cmocka_unit_test_prestate(test_rows_in_turn, hopper),
      cmocka_unit_test_prestate(test_rows_in_turn, humanoid),
      cmocka_unit_test_prestate(test_rows_in_turn, pusher),
      cmocka_unit_test(test_forget),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}

}  // namespace
}  // namespace mjenv::core

int run_worker() { return mjenv::core::run(); }
