// The state of single rows: which work space holds it, reading and setting it.
#include <algorithm>
#include <cmath>

#include "env/env.hpp"
#include "error.hpp"

namespace mjenv::core {

// Makes what the work space holds the row's state; scratch holds the state before the last evaluation.
void Env::commit(Worker& worker, std::int64_t row, Origin origin) {
  double* start = worker.scratch.data();
  if (origin == Origin::set)
    std::copy_n(layout_.warmstart(start), layout_.nv, std::copy_n(layout_.qpos(start), layout_.nq, changed(row)));
  else
    std::copy_n(start, layout_.size, before(row));
  worker.work.save(state(row));
  if (task_.carry) task_.carry(worker.work.sim(), carried(row));
  heads_[row].origin = origin;
  heads_[row].worker = worker.index;
  worker.resident = row;
}

// Derived arrays belong to the row that a worker computed last; another row's follow from the state before its last
// evaluation.
Env::Worker& Env::resident_worker(std::int64_t row) {
  const Head& head = heads_[row];
  Worker& worker = *workers_[static_cast<std::size_t>(head.worker)];
  if (worker.resident == row) return worker;
  worker.resident = -1;
  switch (head.origin) {
    case Origin::cleared: worker.work.clear(); break;
    case Origin::forward:
      worker.work.begin();
      worker.work.load(before(row));
      worker.work.forward();
      break;
    case Origin::step:
      worker.work.load(before(row));
      worker.work.repeat_step();
      break;
    case Origin::set:
      worker.work.load(before(row));
      worker.work.repeat_step();
      worker.work.complete_forces();
      double* start = worker.scratch.data();
      std::copy_n(state(row), layout_.size, start);
      std::copy_n(changed(row), layout_.nq, layout_.qpos(start));
      std::copy_n(changed(row) + layout_.nq, layout_.nv, layout_.warmstart(start));
      worker.work.load(start);
      worker.work.forward();
      break;
  }
  worker.resident = row;
  return worker;
}

const Array& Env::array(std::int64_t row, const std::string& name) {
  check_settled();
  check_row(row);
  const auto find = [&](const std::vector<Array>& list) {
    const auto found = std::find_if(list.begin(), list.end(), [&](const Array& a) { return a.name == name; });
    return found == list.end() ? nullptr : &*found;
  };
  if (const Array* found = find(task_.model->arrays())) return *found;
  const auto worker = static_cast<std::size_t>(heads_[row].worker);
  if (const Array* found = find(workers_[worker]->arrays)) {
    resident_worker(row).work.complete();
    return *found;
  }
  std::vector<std::string> names;
  for (const auto& field : data_) names.push_back(field.name);
  for (const auto& field : model_fields_) names.push_back(field.name);
  fail(MJENV_E_NAME, "no array " + quoted(name) + "; there are " + listed(names));
}

void Env::show(std::int64_t row, const std::function<void(mjData_*)>& look) {
  check_settled();
  check_row(row);
  if (!heads_[row].ready) fail(MJENV_E_STATE, in_row(row, "reset it before it is drawn"));
  Worker& worker = resident_worker(row);
  worker.resident = -1;  // should look fail
  worker.work.complete();
  look(worker.work.data());
  worker.resident = row;
}

void Env::set_state(std::int64_t row, const double* qpos, std::size_t nq, const double* qvel, std::size_t nv) {
  check_settled();
  check_row(row);
  check_count("nq", static_cast<std::int64_t>(nq), static_cast<std::int64_t>(layout_.nq));
  check_count("nv", static_cast<std::int64_t>(nv), static_cast<std::int64_t>(layout_.nv));
  for (std::size_t i = 0; i < nq + nv; ++i) {
    const double x = i < nq ? qpos[i] : qvel[i - nq];
    if (!std::isfinite(x))
      fail(MJENV_E_VALUE,
           (i < nq ? "qpos[" + std::to_string(i) : "qvel[" + std::to_string(i - nq)) + "] is " + number(x));
  }
  Head& head = heads_[row];
  Worker& worker = *workers_[static_cast<std::size_t>(head.worker)];
  const bool in_episode = head.origin == Origin::step || head.origin == Origin::set;
  const bool has_forces = in_episode && worker.resident == row;
  double* start = worker.scratch.data();
  std::copy_n(state(row), layout_.size, start);
  std::copy_n(qpos, nq, layout_.qpos(start));
  std::copy_n(qvel, nv, layout_.qvel(start));
  worker.resident = -1;
  if (has_forces)
    worker.work.complete_forces();
  else
    worker.work.begin();
  worker.work.load(start);
  worker.work.forward();
  commit(worker, row, in_episode ? Origin::set : Origin::forward);
  if (in_episode && !has_forces) worker.resident = -1;
  head.ready = true;
  head.ended = false;
}

void Env::simulate(std::int64_t row, const double* ctrl, std::size_t count, std::int64_t frames) {
  check_settled();
  check_row(row);
  check_count("count", static_cast<std::int64_t>(count), task_.model->nu());
  if (frames < 1) fail(MJENV_E_VALUE, "frames is " + std::to_string(frames) + ", less than 1");
  Worker& worker = *workers_[0];
  worker.resident = -1;
  worker.work.load(state(row));
  worker.work.step({ctrl, MJENV_FLOAT64, task_.model->nu()}, frames, worker.scratch.data());
  commit(worker, row, Origin::step);
}

}  // namespace mjenv::core
