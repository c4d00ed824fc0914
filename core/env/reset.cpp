#include "env/reset.hpp"

#include "error.hpp"

namespace mjenv::core {

void Reset::begin(std::int64_t row, const Rng& rng, const Randomization& randomization, const Initial& initial) {
  scratch_.ensure(holder_);
  Rows& rows = holder_.rows();
  Work& work = holder_.work();
  SimView& view = holder_.view();
  const Task& task = holder_.task();
  const OwnArrays& arrays = rows.arrays();
  holder_.release();
  scratch_.drawn.clear();
  // The reset changes copies of the own values and of the streams, because it may fail.
  scratch_.block.assign(rows.values(row), rows.values(row) + rows.block_bytes());
  if (!arrays.empty()) {
    arrays.clear_inputs(scratch_.block.data());
    holder_.use(scratch_.block.data());
  }
  for (Scratch::TaskArray& own : scratch_.task_arrays)
    if (!own.is_force) own.array->read(scratch_.block.data(), own.values.data());
  Random random(&rng);
  np::RandomState stream;
  if (rows.has_random_state()) {
    stream = rows.random_state(row);
    if (!stream.is_seeded()) {
      const std::uint64_t seed = Rng::from_entropy().next();
      stream = np::RandomState::from_seed(&seed, 1);
    }
    random.state = &stream;
  }
  work.begin();
  // Computes what the task's reset sees. If the caller gives the state instead, mj_forward is called once, because its
  // solver begins with the result of the call before.
  if (work.keeps_current() && (!initial.qpos || task.calls->callbacks().reset)) {
    work.forward();
    view.complete();
  }
  std::fill_n(view.carried(), task.carry_count, 0.0);
  for (const KeptNumbers& kept : task.kept)
    std::copy_n(rows.carried(row) + kept.first, kept.count, view.carried() + kept.first);
  view.show_parameters(rows.parameters(row));

  const Work::State state = work.state();
  ResetSimulation simulation{work, view, state.time, take_own_};
  task.calls->reset(view.sim(), {state.qpos, state.qvel, state.act, view.carried(), scratch_.of_reset.data()}, random,
                    work.keeps_current() ? &simulation : nullptr);
  initial.copy_to(state, work.layout());
  take_own();
  // The streams are saved before what may fail now: the next reset must then draw something else.
  rows.head(row).rng = random.drew() ? random.rng() : rng;
  rows.head(row).seeded = true;
  if (rows.has_random_state()) rows.set_random_state(row, stream);
  if (!randomization.empty()) draw(row, randomization);
  work.save(holder_.before());
  work.forward();
  holder_.save(row, Origin::forward);
  if (arrays.empty()) return;
  rows.set_values(row, scratch_.block.data());
  holder_.use(row);
}

void Reset::take_own() {
  for (const Scratch::TaskArray& own : scratch_.task_arrays) {
    if (own.is_force) continue;
    own.array->check(own.values.data());
    own.array->write(own.values.data(), scratch_.block.data());
  }
}

void Reset::draw(std::int64_t row, const Randomization& randomization) {
  Rows& rows = holder_.rows();
  scratch_.drawn = scratch_.block;
  std::byte* block = scratch_.drawn.data();
  randomization.draw(rows.head(row).rng, rows.ranges(row), block);
  if (!randomization.computes_constants()) return;
  Constants& constants = holder_.constants();
  constants.compute(rows.arrays(), block);
  const std::vector<std::string> shared = constants.new_arrays(rows.arrays());
  if (!shared.empty()) fail(MJENV_E_MODEL, "mj_setConst changes " + listed(shared) + ", which all rows share");
  constants.save(rows.arrays(), block);
}

void Reset::adopt(std::int64_t row) noexcept {
  if (scratch_.drawn.empty()) return;
  Rows& rows = holder_.rows();
  rows.keep(row);
  rows.set_values(row, scratch_.drawn.data());
  rows.head(row).written = Written::by_caller;
  scratch_.drawn.clear();
  holder_.forget(row);
}

}  // namespace mjenv::core
