// Sequences of calls, with any arguments that C lets a caller make without undefined behaviour of its own: null
// pointers, any number, counts and sizes that lie only where the library can know better.
#include <array>
#include <climits>

#include "mjenv/task.h"
#include "target.hpp"

namespace {

constexpr std::size_t kSlots = 3;

// A task whose outputs the caller computes.
bool add_halves() {
  mjenv_task_field field = MJENV_TASK_FIELD_INIT;
  field.name = "seen";
  field.ndim = 1;
  field.shape[0] = 3;
  mjenv_task task = MJENV_TASK_INIT;
  task.id = "Halves-v0";
  task.model = "hopper.xml";
  task.fields = &field;
  task.field_count = 1;
  task.carry_count = 2;
  task.physics_only = 1;
  return mjenv_register_task(&task) == MJENV_OK;
}

class Calls {
 public:
  explicit Calls(Bytes bytes) : bytes_(bytes) {}

  void run() {
    for (int calls = 0; calls < 60 && bytes_.left() > 0; ++calls) call();
  }

 private:
  // An environment, with arrays that outlive what is under way in it.
  struct Slot {
    std::unique_ptr<Outputs> out;
    std::array<double, 1000> mirrored{};
    EnvHandle env;  // destroyed first
    std::size_t actuators = 0, nq = 0, nv = 0, nu = 0;
  };

  Bytes bytes_;
  std::array<OptionsHandle, kSlots> options_;
  std::array<Slot, kSlots> slots_;

  mjenv_options* options() { return options_[bytes_.below(kSlots)].get(); }
  Slot& slot() { return slots_[bytes_.below(kSlots)]; }

  const char* id() {
    static const bool has_halves = add_halves();
    static const char* const ids[] = {has_halves ? "Halves-v0" : "",
                                      "Ant-v5",
                                      "Hopper-v4",
                                      "InvertedPendulum-v5",
                                      "Reacher-v5",
                                      "Swimmer-v5",
                                      "Ant-v6",
                                      nullptr};
    return bytes_.one_of(ids);
  }
  const char* option_name() {
    static const char* const names[] = {
        "strict",   "autoreset_mode",    "on_divergence",    "num_threads", "arrays", "max_episode_steps",
        "xml_file", "reset_noise_scale", "ctrl_cost_weight", "none",        "",       nullptr};
    return bytes_.one_of(names);
  }
  std::int64_t integer() {
    static const std::int64_t values[] = {0, 1, 2, 3, -1, 4, 100, INT_MAX, INT64_MAX, INT64_MIN};
    return bytes_.one_of(values);
  }
  // Mostly what is right, sometimes anything.
  std::size_t size(std::size_t right) { return bytes_.below(8) ? right : static_cast<std::size_t>(integer()); }
  std::int64_t row() { return bytes_.below(6) ? static_cast<std::int64_t>(bytes_.below(3)) : integer(); }
  // The array, or null.
  template <typename T>
  T* maybe(T* array) {
    return bytes_.below(10) ? array : nullptr;
  }
  // Counts never claim more than there is, as the library cannot see that.
  std::size_t at_most(std::size_t right) { return std::min(size(right), right); }

  // The slot's batch with something wrong now and then; its arrays are as long as the environment's rows.
  const mjenv_batch* batch(Slot& slot, mjenv_batch& changed) {
    if (!slot.out || bytes_.below(8) == 0) return nullptr;
    changed = slot.out->batch;
    switch (bytes_.below(16)) {
      case 0: changed.struct_size = static_cast<std::uint32_t>(integer()) % (sizeof changed + 1); break;
      case 1: changed.rows = integer(); break;
      case 2: changed.obs_count = integer(); break;
      case 3: changed.info_count = integer(); break;
      case 4: changed.reset_info_count = integer(); break;
      case 5: changed.arrays_count = integer(); break;
      case 6: changed.obs_dtype = static_cast<std::int32_t>(integer()); break;
      case 7: changed.obs_dtype = MJENV_DTYPE_FLOAT32; break;
      case 8: changed.obs = nullptr; break;
      case 9: changed.info = nullptr; break;
      case 10: changed.reward = nullptr; break;
      case 11: changed.final_obs = nullptr; break;
      default: break;
    }
    return &changed;
  }

  void create() {
    Slot& made = slot();
    const OptionsHandle& chosen = options_[bytes_.below(kSlots)];
    std::int64_t threads = 0;
    if (chosen && mjenv_options_get_integer(chosen.get(), "num_threads", &threads) == MJENV_OK && threads > 3)
      check(mjenv_options_set_integer(chosen.get(), "num_threads", 2));
    mjenv_env* env = nullptr;
    static const std::int64_t rows[] = {1, 2, 4, 0, -1, INT64_MAX, INT64_MIN, std::int64_t{1} << 50};
    const mjenv_status status =
        check(mjenv_create(chosen.get(), bytes_.one_of(rows), bytes_.below(16) ? &env : nullptr));
    if (status != MJENV_OK) return;
    made.env.reset();
    made.env = EnvHandle(env);
    made.out = std::make_unique<Outputs>(env, rows_of(env));
    made.actuators = static_cast<std::size_t>(mjenv_field_count(env, MJENV_ROLE_ACTION));
    made.nq = number(env, "nq");
    made.nv = number(env, "nv");
    made.nu = number(env, "nu");
  }

  void describe() {
    Slot& s = slot();
    const auto role = static_cast<mjenv_role>(bytes_.below(12));
    mjenv_field field{};
    mjenv_space space{};
    mjenv_spec spec{};
    mjenv_option option{};
    field.struct_size = space.struct_size = spec.struct_size = option.struct_size = 1024;
    if (bytes_.below(4)) {
      field.struct_size = sizeof field;
      space.struct_size = sizeof space;
      spec.struct_size = sizeof spec;
      option.struct_size = sizeof option;
    } else {
      const auto least = static_cast<std::uint32_t>(bytes_.below(9));
      field.struct_size = space.struct_size = spec.struct_size = option.struct_size = least;
    }
    check(mjenv_field_at(s.env.get(), role, integer(), maybe(&field)));
    check(mjenv_space_of(s.env.get(), role, maybe(&space)));
    check(mjenv_spec_of(id(), maybe(&spec)));
    check(mjenv_options_at(options(), integer(), maybe(&option)));
    check(mjenv_options_at(mjenv_options_of(s.env.get()), integer(), maybe(&option)));
    mjenv_field_count(s.env.get(), role);
    mjenv_info info = MJENV_INFO_INIT;
    info.struct_size = field.struct_size;
    check(mjenv_info_of(s.env.get(), maybe(&info)));
    mjenv_lane_stages_of(s.env.get());
    mjenv_options_count(options());
    mjenv_id_at(integer());
    mjenv_status_name(static_cast<mjenv_status>(integer()));
    std::int64_t index = 0;
    const char* name = nullptr;
    static const char* const types[] = {"body", "joint", "geom", "actuator", "nothing", "", nullptr};
    check(mjenv_object_index(s.env.get(), bytes_.one_of(types), bytes_.flag() ? "torso" : nullptr, maybe(&index)));
    check(mjenv_object_count(s.env.get(), bytes_.one_of(types), maybe(&index)));
    check(mjenv_object_name(s.env.get(), bytes_.one_of(types), integer(), maybe(&name)));
  }

  void set_option() {
    mjenv_options* o = options();
    const char* name = option_name();
    static const char* const texts[] = {"same_step",        "next_step", "disabled", "terminate",
                                        "xpos qM cfrc_ext", "",          "ant.xml",  nullptr};
    const double reals[2] = {bytes_.take<double>(), 1};
    switch (bytes_.below(4)) {
      case 0: check(mjenv_options_set_integer(o, name, integer())); break;
      case 1: check(mjenv_options_set_reals(o, name, maybe(reals), bytes_.below(3))); break;
      case 2: check(mjenv_options_set_string(o, name, bytes_.one_of(texts))); break;
      default: {
        std::int64_t value = 0;
        const char* text = nullptr;
        double into[2];
        std::int64_t count = 0;
        check(mjenv_options_get_integer(o, name, maybe(&value)));
        check(mjenv_options_get_string(o, name, maybe(&text)));
        check(mjenv_options_get_reals(o, name, maybe(into), bytes_.below(3), maybe(&count)));
      }
    }
  }

  void seed() {
    Slot& s = slot();
    const auto count = static_cast<std::int64_t>(bytes_.below(13));  // of the words of all seeds
    const auto seeds = bytes_.list<std::uint64_t>(12);
    const auto mask = bytes_.list<std::uint8_t>(4);
    std::uint64_t words[4] = {};
    check(mjenv_seed(s.env.get(), maybe(mask.data()), maybe(seeds.data()), bytes_.below(8) ? count : -count));
    check(mjenv_seed_row(s.env.get(), row(), maybe(seeds.data()), bytes_.below(8) ? count : -count));
    check(mjenv_get_stream(s.env.get(), row(), maybe(words), size(4)));
    double goals[4] = {}, rewards[4];
    const auto numbers = static_cast<std::int64_t>(at_most(4));
    check(mjenv_compute_reward(s.env.get(), maybe(goals), maybe(goals), numbers, maybe(rewards), integer()));
    check(mjenv_set_stream(s.env.get(), row(), maybe(seeds.data()), size(4)));
    check(mjenv_seed_actions(s.env.get(), seeds[0]));
    draw(seeds);
  }

  // Of two streams, which may be none. What is refused changes nothing.
  void draw(std::vector<std::uint64_t> words) {
    for (std::size_t i = 0; i < words.size() && bytes_.below(8); i += 6) words[i + 2] |= 1, words[i + 4] &= 1;
    const auto before = words;
    const auto kind = static_cast<mjenv_distribution>(bytes_.below(8) ? bytes_.below(3) : integer());
    const double low = bytes_.flag() ? static_cast<double>(integer()) : bytes_.take<double>(),
                 high = bytes_.flag() ? static_cast<double>(integer()) : bytes_.take<double>();
    std::vector<double> drawn(4, 0.25);
    const auto streams = static_cast<std::int64_t>(at_most(2)), count = static_cast<std::int64_t>(at_most(4));
    const mjenv_status status =
        check(mjenv_draw(maybe(words.data()), streams, kind, low, high, maybe(drawn.data()), count));
    REQUIRE(status == MJENV_OK || (words == before && drawn == std::vector<double>(4, 0.25)));
    for (std::int64_t i = 0; status == MJENV_OK && kind == MJENV_DISTRIBUTION_INTEGERS && i < count; ++i)
      REQUIRE(drawn[i] >= low && drawn[i] < high);
  }

  void step() {
    Slot& s = slot();
    mjenv_batch changed{};
    const auto count = static_cast<std::size_t>(rows_of(s.env.get())) * s.actuators;
    const auto action = bytes_.list<double>(count);
    std::vector<float> drawn(count);
    check(mjenv_sample_actions(s.env.get(), maybe(drawn.data()), size(count)));
    const std::int64_t dtype = bytes_.below(8) ? 1 : integer() & 15;
    const mjenv_batch* out = batch(s, changed);
    if (bytes_.flag())
      check(mjenv_step(s.env.get(), nullptr, maybe(drawn.data()), size(count), MJENV_DTYPE_FLOAT32, out));
    else
      check(mjenv_step(s.env.get(), nullptr, maybe(action.data()), size(count), static_cast<mjenv_dtype>(dtype), out));
  }

  // A reset or a step in parts, in any order.
  void halves() {
    Slot& s = slot();
    mjenv_env* env = s.env.get();
    const auto rows = static_cast<std::size_t>(rows_of(env)), count = rows * s.actuators;
    const auto mask = bytes_.list<std::uint8_t>(4);
    const auto action = bytes_.list<double>(count), qpos = bytes_.list<double>(rows * s.nq),
               qvel = bytes_.list<double>(rows * s.nv), ctrl = bytes_.list<double>(rows * s.nu);
    const std::uint8_t* chosen = bytes_.flag() ? nullptr : mask.data();
    const bool has_ctrl = bytes_.flag();
    std::vector<double> seen(count);
    mjenv_batch changed{}, given{};
    const mjenv_batch* out = batch(s, changed);
    if (bytes_.flag())
      check(mjenv_begin(env, chosen, bytes_.flag() ? qpos.data() : nullptr, at_most(qpos.size()),
                        bytes_.flag() ? qvel.data() : nullptr, at_most(qvel.size()), out));
    if (bytes_.flag())
      check(mjenv_act(env, chosen, maybe(action.data()), size(count), MJENV_DTYPE_FLOAT64, maybe(seen.data())));
    if (bytes_.flag())
      check(mjenv_advance(env, chosen, maybe(action.data()), size(count), MJENV_DTYPE_FLOAT64,
                          has_ctrl ? ctrl.data() : nullptr, size(ctrl.size()), out));
    if (bytes_.flag()) check(mjenv_finish(env, chosen, batch(s, given), out));
  }

  void reset() {
    Slot& s = slot();
    mjenv_batch changed{};
    const auto mask = bytes_.list<std::uint8_t>(4);
    const mjenv_batch* out = batch(s, changed);
    check(mjenv_reset(s.env.get(), bytes_.flag() ? nullptr : mask.data(), out));
    if (out) check(mjenv_observe(s.env.get(), out)), check(mjenv_observe_row(s.env.get(), 0, out));
  }

  void roll() {
    Slot& s = slot();
    const std::int64_t rows = rows_of(s.env.get());
    const auto steps = static_cast<std::int64_t>(bytes_.below(4));
    const auto count = static_cast<std::size_t>(rows * steps) * s.actuators;
    const auto action = bytes_.list<double>(count);
    if (!s.env) return;
    Outputs out(s.env.get(), rows * steps);
    check(mjenv_rollout(s.env.get(), maybe(action.data()), size(count), MJENV_DTYPE_FLOAT64,
                        bytes_.below(8) ? steps : integer(), maybe(&out.batch)));
  }

  void send() {
    Slot& s = slot();
    const std::size_t row_count = bytes_.below(4);
    std::int64_t rows[4] = {row(), row(), row(), row()};
    const auto action = bytes_.list<double>(4 * s.actuators);
    const bool all = bytes_.flag();
    const std::size_t sent = all ? static_cast<std::size_t>(rows_of(s.env.get())) : row_count;
    check(mjenv_send(s.env.get(), all ? nullptr : rows, size(sent), maybe(action.data()), size(sent * s.actuators),
                     MJENV_DTYPE_FLOAT64));
  }

  void receive() {
    Slot& s = slot();
    std::int64_t rows[4];
    std::int64_t count = 0;
    mjenv_batch changed{};
    const mjenv_batch* out = s.out && bytes_.below(4) ? &s.out->batch : batch(s, changed);
    // No endless wait: rows that are under way are done soon.
    const double timeout = bytes_.flag() ? -1 : bytes_.take<double>();
    check(mjenv_recv(s.env.get(), bytes_.below(5), timeout > 1 ? 1 : timeout, maybe(rows), at_most(4), maybe(&count),
                     out));
  }

  void read() {
    Slot& s = slot();
    static const char* const arrays[] = {"qpos",  "xpos", "cfrc_ext", "efc_J", "opt.timestep",
                                         "names", "none", "",         nullptr};
    const char* name = bytes_.one_of(arrays);
    std::int64_t count = 0;
    if (check(mjenv_read(s.env.get(), row(), name, nullptr, 0, maybe(&count))) != MJENV_OK) return;
    std::vector<double> values(count);
    check(mjenv_read(s.env.get(), row(), name, maybe(values.data()), at_most(count), maybe(&count)));
    s.mirrored[bytes_.below(s.mirrored.size())] = bytes_.take<double>();
    const std::size_t bytes = std::min(size(values.size()) * sizeof(double), sizeof s.mirrored);
    check(mjenv_mirror(s.env.get(), row(), name, maybe(s.mirrored.data()), static_cast<std::int64_t>(bytes)));
  }

  void set_state() {
    Slot& s = slot();
    const auto qpos = bytes_.list<double>(s.nq), qvel = bytes_.list<double>(s.nv),
               ctrl = bytes_.list<double>(s.actuators);
    check(mjenv_set_state(s.env.get(), row(), maybe(qpos.data()), size(s.nq), maybe(qvel.data()), size(s.nv)));
    static const std::int64_t frames[] = {1, 2, 5, 0, -1, INT64_MIN};
    check(mjenv_simulate(s.env.get(), row(), maybe(ctrl.data()), size(s.actuators), bytes_.one_of(frames)));
    const auto mask = bytes_.list<std::uint8_t>(4);
    check(mjenv_copy_row(s.env.get(), maybe(mask.data()), row()));
  }

  void snapshot() {
    Slot &from = slot(), &to = slot();
    const std::int64_t which = bytes_.flag() ? MJENV_ALL_ROWS : row();
    std::int64_t bytes = 0;
    if (check(mjenv_snapshot(from.env.get(), which, nullptr, 0, maybe(&bytes))) != MJENV_OK) return;
    std::vector<unsigned char> image(bytes);
    check(mjenv_snapshot(from.env.get(), which, maybe(image.data()), at_most(bytes), maybe(&bytes)));
    check(mjenv_restore(to.env.get(), bytes_.below(4) ? which : row(), maybe(image.data()), at_most(image.size())));
  }

  void call() {
    switch (bytes_.below(16)) {
      case 0: {
        mjenv_options* made = nullptr;
        check(mjenv_options_create(id(), maybe(&made)));
        if (made) options_[bytes_.below(kSlots)].reset(made);
        break;
      }
      case 1: options_[bytes_.below(kSlots)].reset(); break;
      case 2: set_option(); break;
      case 3: create(); break;
      case 4: {
        Slot& s = slot();
        s.env.reset();
        s = Slot{};
        break;
      }
      case 5: describe(); break;
      case 6: seed(); break;
      case 7: reset(); break;
      case 8: step(); break;
      case 9: halves(); break;
      case 10: roll(); break;
      case 11: send(); break;
      case 12: receive(); break;
      case 13: read(); break;
      case 14: set_state(); break;
      default: snapshot();
    }
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Calls(Bytes(data, size)).run();
  return 0;
}
