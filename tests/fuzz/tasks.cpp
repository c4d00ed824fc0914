// Descriptions of tasks, valid ones and spoilt ones, with callbacks that do all that mjenv/task.h allows and fail in
// every way. What is registered must build, reset and step, or say why not.
#include "mjenv/task.h"

#include <deque>
#include <limits>
#include <sstream>

#include "target.hpp"

namespace {

// More would only make the list of ids long. Later inputs are refused at last because their id is registered.
constexpr int kMostTasks = 2000;
constexpr std::int64_t kLargestRow = 10000;

// With a height field, which rows can have of their own, and a ball that touches it.
const char* const kField =
    R"(<mujoco><asset><hfield name="ground" nrow="2" ncol="3" size="1 1 0.2 0.1"/></asset><worldbody>
  <geom type="hfield" hfield="ground"/><body name="torso" pos="0 0 0.05"><joint name="z" type="slide" axis="0 0 1"/>
  <geom size="0.1"/><site/></body></worldbody><actuator><motor joint="z"/></actuator></mujoco>)";

// What the callbacks do, and how many numbers they write.
struct Plan {
  Bytes* bytes = nullptr;
  std::int64_t observation = 0, info = 0, reset_info = 0;
  std::vector<std::int64_t> own;  // how many elements each own array has
};

double value(Bytes& bytes) {
  static const double values[] = {0.25,
                                  0,
                                  -1,
                                  std::numeric_limits<double>::quiet_NaN(),
                                  std::numeric_limits<double>::infinity(),
                                  -std::numeric_limits<double>::infinity(),
                                  std::numeric_limits<double>::max()};
  const std::size_t kind = bytes.below(8);
  return kind < 7 ? values[kind] : bytes.take<double>();
}

std::int64_t count(Bytes& bytes) {
  static const std::int64_t counts[] = {1, 0, 2, 3, -1, -2, 4096, (1 << 24) + 1, INT64_MAX, INT64_MIN};
  return bytes.one_of(counts);
}

std::int32_t result(Bytes& bytes, const mjenv_task_api* api) {
  switch (bytes.below(16)) {
    case 1: return mjenv_task_fail(api, bytes.text(30).c_str());
    case 2: return bytes.take<std::int32_t>();
    case 3: return mjenv_task_fail(api, nullptr);
    default: return 0;
  }
}

void fill(Bytes& bytes, double* to, std::int64_t numbers) {
  for (std::int64_t i = 0; i < numbers; ++i) to[i] = bytes.left() > 0 ? value(bytes) : 0.5;
}

void draw(Bytes& bytes, mjenv_random* random) {
  static const double p[] = {0.5, 0.25, 0.25, 0};
  std::int64_t drawn[8];
  for (std::size_t i = bytes.below(4); i > 0; --i) switch (bytes.below(13)) {
      case 0: mjenv_random_uniform(random, value(bytes), value(bytes)); break;
      case 1: mjenv_random_normal(random); break;
      case 2: mjenv_random_integers(random, count(bytes), count(bytes)); break;
      case 3: mjenv_random_choice(random, bytes.flag() ? 4 : 3, p); break;
      case 4: mjenv_random_sample(random, count(bytes), static_cast<std::int64_t>(bytes.below(9)), drawn); break;
      case 5: mjenv_random_real(random); break;
      case 6: mjenv_random_state_rand(random), mjenv_random_state_is_new(random); break;
      case 7: mjenv_random_state_uniform(random, value(bytes), value(bytes)); break;
      case 8: mjenv_random_state_randn(random); break;
      case 9: mjenv_random_state_randint(random, count(bytes), count(bytes)); break;
      case 10: mjenv_random_state_choice(random, bytes.flag() ? 4 : count(bytes), nullptr); break;
      case 11: mjenv_random_state_choice(random, static_cast<std::int64_t>(bytes.below(5)), p); break;
      case 12: mjenv_random_state_permutation(random, static_cast<std::int64_t>(bytes.below(10)) - 1, drawn); break;
      default: mjenv_random_permutation(random, static_cast<std::int64_t>(bytes.below(10)) - 1, drawn);
    }
}

const char* name(Bytes& bytes) {
  static const std::string endless(300, 'x');
  static const char* const names[] = {"qpos",      "qvel",         "weight",       "gait",          nullptr,
                                      "",          "two words",    "a\"quote",     "xpos",          "torso",
                                      "joint",     "body",         "norm",         "frame_skip",    "cfrc_ext",
                                      "contacts",  "site",         "opt.gravity",  endless.c_str(), "geom_pos",
                                      "geom_rgba", "qfrc_applied", "xfrc_applied", "hfield_data",   "geom_contype"};
  return bytes.one_of(names);
}

template <typename T>
T described() {
  T made{};
  made.struct_size = sizeof made;
  return made;
}

mjenv_task_field field(mjenv_role role, const char* called, std::int64_t length) {
  auto made = described<mjenv_task_field>();
  made.role = role;
  made.name = called;
  made.ndim = 1;
  made.shape[0] = length;
  return made;
}

// ---- The callbacks ----

std::int32_t build(mjenv_builder* builder, void* user, void** self) {
  Bytes& bytes = *static_cast<Plan*>(user)->bytes;
  double reals[4], low[3], high[3];
  *self = user;
  static_cast<Plan*>(user)->own.clear();
  for (std::size_t i = bytes.below(8); i > 0; --i) switch (bytes.below(20)) {
      case 0: mjenv_build_integer(builder, name(bytes)); break;
      case 1: mjenv_build_reals(builder, name(bytes), reals, static_cast<std::int64_t>(bytes.below(5))); break;
      case 2: mjenv_build_is_integer(builder, name(bytes)); break;
      case 3: mjenv_build_text(builder, name(bytes)); break;
      case 4: mjenv_build_index(builder, name(bytes), name(bytes)); break;
      case 5: mjenv_build_option_index(builder, name(bytes), name(bytes)); break;
      case 6: mjenv_build_norm_is_fused(builder); break;
      case 7: mjenv_build_need(builder, name(bytes)); break;
      case 8: mjenv_build_array(builder, name(bytes), nullptr); break;
      case 9: mjenv_build_carry(builder, count(bytes)); break;
      case 10: mjenv_build_carry_bounds(builder, count(bytes), count(bytes), value(bytes), value(bytes)); break;
      case 11: mjenv_build_keep(builder, count(bytes), count(bytes)); break;
      case 12: mjenv_build_parameter(builder, name(bytes)); break;
      case 13:
      case 14: mjenv_build_current(builder); break;
      case 15: mjenv_build_random_state(builder); break;
      case 16: mjenv_build_real(builder, name(bytes)); break;
      case 17: {
        fill(bytes, low, 3);
        fill(bytes, high, 3);
        const auto most = static_cast<std::int64_t>(bytes.below(4));
        mjenv_build_action(builder, bytes.flag() ? most : 1 - most, bytes.flag() ? low : nullptr, high);
        break;
      }
      case 18: {
        const char* own = name(bytes);
        auto shape = described<mjenv_field>();
        mjenv_build_array(builder, own, &shape);
        mjenv_build_own(builder, own);
        if (!builder->failed) static_cast<Plan*>(user)->own.push_back(shape.count);
        break;
      }
      default: {
        const mjenv_role roles[] = {MJENV_ROLE_OBSERVATION, MJENV_ROLE_INFO,   MJENV_ROLE_RESET_INFO,
                                    MJENV_ROLE_STRUCTURE,   MJENV_ROLE_REWARD, MJENV_ROLE_ACTION};
        mjenv_build_length(builder, bytes.one_of(roles), name(bytes), count(bytes));
      }
    }
  return result(bytes, builder->api);
}

void destroy(void* self) { REQUIRE(self); }

const Plan& plan_of(const void* self) { return *static_cast<const Plan*>(self); }

// Reads what is there only if build has asked for it.
void look(const mjenv_sim* sim) {
  volatile double seen = *sim->time;
  for (std::int32_t i = 0; i < sim->contact_count; ++i) seen = sim->contacts[i].distance + sim->contacts[i].force[5];
  static_cast<void>(seen);
}

// Writes own arrays, of which those that this callback must not write are null.
void fill_own(const void* self, double* const* own) {
  const Plan& plan = plan_of(self);
  for (std::size_t i = 0; own && i < plan.own.size(); ++i)
    if (own[i] && plan.bytes->flag()) fill(*plan.bytes, own[i], std::min<std::int64_t>(plan.own[i], 4));
}

std::int32_t reset(const void* self, mjenv_start* start) {
  Bytes& bytes = *plan_of(self).bytes;
  draw(bytes, start->random);
  if (bytes.flag()) fill(bytes, start->qpos, start->nq);
  if (bytes.flag()) fill(bytes, start->carried, start->carry_count);
  fill_own(self, start->own);
  for (std::size_t i = bytes.below(4); i > 0; --i) switch (bytes.below(4)) {
      case 0: mjenv_start_forward(start); break;
      case 1: mjenv_start_advance(start, static_cast<std::int64_t>(bytes.below(5)) - 1); break;
      case 2: mjenv_start_restart(start); break;
      default: mjenv_start_contact_count(start);
    }
  if (start->time && bytes.flag()) *start->time = value(bytes);
  if (start->sim) look(start->sim);
  return result(bytes, start->api);
}

std::int32_t reset_info(const void* self, const mjenv_sim* sim, double* to) {
  look(sim);
  fill(*plan_of(self).bytes, to, plan_of(self).reset_info);
  return result(*plan_of(self).bytes, sim->api);
}

std::int32_t carry(const void* self, const mjenv_sim* sim, double* to) {
  to[0] = sim->carried[0];
  return result(*plan_of(self).bytes, sim->api);
}

std::int32_t observe(const void* self, const mjenv_sim* sim, double* to) {
  look(sim);
  fill(*plan_of(self).bytes, to, plan_of(self).observation);
  return result(*plan_of(self).bytes, sim->api);
}

std::int32_t map(const void* self, const mjenv_sim* sim, mjenv_control* control) {
  Bytes& bytes = *plan_of(self).bytes;
  draw(bytes, control->random);
  if (bytes.flag()) fill(bytes, control->ctrl, sim->nu);
  fill_own(self, control->own);
  return result(bytes, sim->api);
}

std::int32_t compute_reward(const void* self, const mjenv_task_api* api, const double* achieved, const double* desired,
                            std::int64_t size, double* reward) {
  Bytes& bytes = *plan_of(self).bytes;
  *reward = size > 0 ? achieved[size - 1] - desired[0] : value(bytes);
  return result(bytes, api);
}

std::int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  Bytes& bytes = *plan_of(self).bytes;
  draw(bytes, outcome->random);
  fill(bytes, outcome->info, plan_of(self).info);
  fill_own(self, outcome->own);
  look(sim);
  if (bytes.flag()) fill(bytes, outcome->qvel, std::min(sim->nv, 2));
  if (bytes.left() > 0) outcome->reward = value(bytes);
  outcome->terminated = bytes.flag() ? 1 : 0;
  return result(bytes, sim->api);
}

// ---- The description ----

struct Parts {
  mjenv_task task = described<mjenv_task>();
  mjenv_task_camera camera = described<mjenv_task_camera>();
  mjenv_task_option options[2] = {described<mjenv_task_option>(), described<mjenv_task_option>()};
  mjenv_task_field fields[4] = {field(MJENV_ROLE_OBSERVATION, "qpos", 2), field(MJENV_ROLE_OBSERVATION, "qvel", 1),
                                field(MJENV_ROLE_INFO, "qpos", 2), field(MJENV_ROLE_RESET_INFO, "qpos", 1)};
  double values[3] = {1, 2, 3};
  std::deque<std::string> texts;

  Parts(const char* id, Plan& plan) {
    options[0].kind = MJENV_KIND_REALS;
    options[0].name = "weight";
    options[1].kind = MJENV_KIND_STRING;
    options[1].name = "gait";
    options[1].text = "trot";
    options[1].choices = "walk trot";
    task.id = id;
    task.model = "hopper.xml";
    task.frame_skip = 1;
    task.carry_count = 1;
    task.camera = &camera;
    task.options = options;
    task.option_count = 2;
    task.fields = fields;
    task.field_count = 4;
    task.user = &plan;
    task.build = build;
    task.destroy = destroy;
    task.reset = reset;
    task.reset_info = reset_info;
    task.carry = carry;
    task.observe = observe;
    task.step = step;
  }
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  const char* text(Bytes& bytes) {
    if (bytes.flag()) return name(bytes);
    texts.push_back(bytes.text(20));
    return texts.back().c_str();
  }

  void spoil(Bytes& bytes) {
    static const std::uint32_t sizes[] = {0, 4, 8};
    mjenv_task_option& option = options[bytes.below(2)];
    mjenv_task_field& part = fields[bytes.below(4)];
    switch (bytes.below(35)) {
      case 0: task.id = text(bytes); break;
      case 1: task.model = text(bytes); break;
      case 2: task.model_text = text(bytes); break;
      case 3: task.frame_skip = static_cast<std::int32_t>(count(bytes)); break;
      case 4: task.time_limit = count(bytes); break;
      case 5: task.carry_count = count(bytes); break;
      case 6: task.has_reward_threshold = 1, task.reward_threshold = value(bytes); break;
      case 7: task.camera = nullptr; break;
      case 8: camera.distance = value(bytes), camera.trackbodyid = value(bytes); break;
      case 9: task.option_count = static_cast<std::int64_t>(bytes.below(4)) - 1; break;
      case 10: task.field_count = static_cast<std::int64_t>(bytes.below(6)) - 1; break;
      case 11: task.build = nullptr; break;
      case 12: task.destroy = nullptr; break;
      case 13: task.reset_info = nullptr; break;
      case 14: task.carry = nullptr; break;
      case 15: task.observe = nullptr; break;
      case 16: option.kind = static_cast<mjenv_kind>(bytes.below(7)); break;
      case 17: option.name = text(bytes); break;
      case 18: option.low = value(bytes), option.high = value(bytes); break;
      case 19: option.value = value(bytes); break;
      case 20: option.values = values, option.count = static_cast<std::int64_t>(bytes.below(5)) - 1; break;
      case 21: option.text = text(bytes), option.choices = bytes.flag() ? text(bytes) : nullptr; break;
      case 22: part.role = static_cast<mjenv_role>(bytes.below(10)); break;
      case 23: part.name = text(bytes); break;
      case 24: part.dtype = static_cast<mjenv_dtype>(bytes.below(10)); break;
      case 25: part.ndim = static_cast<std::int32_t>(bytes.below(7)) - 1; break;
      case 26: part.shape[bytes.below(4)] = count(bytes); break;
      case 27: task.before_step = map; break;
      case 28: task.before_substep = map; break;
      case 29: task.compute_reward = compute_reward; break;
      case 30: part.group = text(bytes); break;
      case 31: option.live = static_cast<std::int32_t>(count(bytes)); break;
      case 32: task.caller_thread = 1; break;
      case 33: task.model = nullptr, task.model_text = kField; break;
      default:
        *bytes.one_of({&task.struct_size, &camera.struct_size, &option.struct_size, &part.struct_size}) =
            bytes.one_of(sizes);
    }
    // The arrays hold no more.
    task.option_count = std::min<std::int64_t>(task.option_count, 2);
    task.field_count = std::min<std::int64_t>(task.field_count, 4);
    for (auto& one : options) one.count = std::min<std::int64_t>(one.count, 3);
  }
};

void perturb(mjenv_env* env, Bytes& bytes) {
  std::ostringstream text;  // with inf and nan, which JSON cannot have, now and then
  text << R"({"noise": {"action": )" << value(bytes) << R"(, "observation": 0.5}, "delay": {"action": [)"
       << bytes.below(3) << ", " << bytes.below(5) << R"(], "observation": [)" << bytes.below(3) << ", "
       << bytes.below(5) << R"(], "first_action": )" << value(bytes) << R"(, "redraw": ")"
       << (bytes.flag() ? "step" : "reset") << "\"}}";
  check(mjenv_randomize(env, text.str().c_str()));
}

void use(const std::string& id, Plan& plan) {
  const OptionsHandle options = options_of(id.c_str());
  REQUIRE(mjenv_options_set_integer(options.get(), "frame_skip", 1) == MJENV_OK);
  check(mjenv_options_set_integer(options.get(), "strict", plan.bytes->flag() ? 1 : 0));
  std::int64_t history = 0, time = 0;
  if (plan.bytes->flag()) {
    history = static_cast<std::int64_t>(plan.bytes->below(4));
    time = plan.bytes->flag() ? 1 : 0;
    REQUIRE(mjenv_options_set_string(options.get(), "observation", "flat") == MJENV_OK);
    REQUIRE(mjenv_options_set_integer(options.get(), "history", history) == MJENV_OK);
    REQUIRE(mjenv_options_set_integer(options.get(), "time_aware", time) == MJENV_OK);
    REQUIRE(mjenv_options_set_integer(options.get(), "clip_actions", plan.bytes->flag() ? 1 : 0) == MJENV_OK);
  }
  const EnvHandle env = create(options, 2);
  if (!env) return;
  plan.observation = total(env.get(), MJENV_ROLE_OBSERVATION) / std::max<std::int64_t>(history, 1) - time;
  plan.info = total(env.get(), MJENV_ROLE_INFO);
  plan.reset_info = total(env.get(), MJENV_ROLE_RESET_INFO);
  if (plan.observation + plan.info + plan.reset_info > kLargestRow) return;
  Outputs out(env.get(), 2);
  std::vector<double> action(2 * static_cast<std::size_t>(mjenv_field_count(env.get(), MJENV_ROLE_ACTION)), 0.5);
  const double weight = value(*plan.bytes);
  check(mjenv_write(env.get(), nullptr, "parameters.weight", &weight, 1));
  if (plan.bytes->flag()) perturb(env.get(), *plan.bytes);
  double goals[2] = {weight, 1}, rewards[2];
  check(mjenv_compute_reward(env.get(), goals, goals, 2, rewards, plan.bytes->flag() ? 1 : 2));
  check(mjenv_reset(env.get(), nullptr, &out.batch));
  for (int i = 0; i < 4; ++i) {
    check(mjenv_step(env.get(), nullptr, action.data(), action.size(), MJENV_DTYPE_FLOAT64, &out.batch));
    check(mjenv_observe(env.get(), &out.batch));
  }
  const auto image = image_of(env.get(), 0);
  REQUIRE(mjenv_restore(env.get(), 1, image.data(), image.size()) == MJENV_OK);
  REQUIRE(image_of(env.get(), 1) == image);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Plan plan;  // registered tasks keep a pointer to it
  static int registered = 0;
  Bytes bytes(data, size);
  plan = {};
  plan.bytes = &bytes;
  const std::string id = "Fuzz" + std::to_string(registered) + "-v0";
  Parts parts(id.c_str(), plan);
  for (std::size_t i = bytes.below(4); i > 0; --i) parts.spoil(bytes);
  const bool own_id = parts.task.id == id.c_str();
  const bool large = parts.task.carry_count > kLargestRow;
  if (check(mjenv_register_task(&parts.task)) != MJENV_OK || !own_id) return 0;
  if (registered < kMostTasks) ++registered;
  if (!large) use(id, plan);
  return 0;
}
