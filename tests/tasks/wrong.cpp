// Definitions that must not compile, each with the message that the compiler gives. wrong.cmake compares them.
#include <mjenv/task.hpp>
#include <random>

using namespace mjenv;

MJENV_TASK("Wrong-v0", r) {
  // says: observe cannot draw or change the row, because it is also called when a program reads a row
  r.observe("noisy", [](const Sim& s, Rng& rng) { return s.qpos()[0] + rng.normal(); });
  // says: observe cannot draw or change the row
  r.observe("counts", [](const Sim&, Row& row) { return row.rng.random(); });
  // says: the lambda of observe takes (const Sim &s), and is not mutable
  r.observe("own", [stream = std::mt19937()](const Sim&) mutable { return static_cast<double>(stream()); });
  // says: the lambda of observe returns a number or an Eigen vector
  r.observe("list", [](const Sim& s) { return std::vector<double>(s.qpos().data(), s.qpos().data() + 1); });
  // says: the lambda of reset takes (Start &start, Rng &rng) or (Start &start, RandomState &random)
  r.reset([](const Sim&, Start&, Rng&) {});
  // says: the lambda of carry takes (const Sim &s), and is not mutable; it cannot draw
  r.carry([](const Sim&, Rng& rng) { return Eigen::Vector2d(rng.random(), rng.random()); });
  // says: the lambda of step takes (const Sim &s, Info &info), (const Sim &s, const Carried &before, Info &info)
  r.step([](const Sim&, Info&, Rng&) -> Outcome { return {0, false}; });
  // says: returns an Outcome, and is not mutable
  r.step([](const Sim& s, Info&) { return s.qpos()[0]; });
  // says: the lambda of before_step and before_substep takes (const Sim &s, Control &control)
  r.before_step([](const Sim&, Rng&) {});
  // says: the lambda of reset_info takes (const Sim &s, Info &info), and is not mutable
  r.reset_info([](const Sim&, Row&, Info&) {});
}
