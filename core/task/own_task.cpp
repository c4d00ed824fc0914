#include "task/own_task.hpp"

#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>

#include "engine/assets.hpp"
#include "error.hpp"
#include "structs.hpp"
#include "task/own_build.hpp"
#include "task/registry.hpp"

namespace mjenv::core {
namespace {

constexpr std::size_t kMaxId = 100, kMaxName = 200;
constexpr std::int64_t kMaxCount = 1 << 20;                        // of options, of fields, and of an option's numbers
constexpr std::int64_t kMaxNumbers = 1 << 24;                      // in an observation or an info
constexpr std::int64_t kMaxInteger = (std::int64_t{1} << 53) - 1;  // the bounds of options are doubles

// Calls visit(element) for each struct of an array whose elements all have the struct_size of the first.
template <typename T, typename Visit>
void for_each_struct(const T* array, std::int64_t count, const std::string& what, const Visit& visit) {
  if (count < 0 || count > kMaxCount)
    fail(MJENV_E_VALUE, what + "_count is " + std::to_string(count) + ", not 0 to " + std::to_string(kMaxCount));
  if (count > 0 && !array) fail(MJENV_E_ARGUMENT, what + "s is NULL");
  const auto* at = reinterpret_cast<const unsigned char*>(array);
  std::uint32_t step = 0;
  if (count > 0) std::memcpy(&step, at, sizeof step);
  for (std::int64_t i = 0; i < count; ++i, at += step)
    visit(read_struct(reinterpret_cast<const T*>(at), (what + "s[" + std::to_string(i) + "]").c_str()));
}

bool is_digit(char c) { return '0' <= c && c <= '9'; }

bool is_word(char c) { return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || is_digit(c) || c == '_'; }

// Returns the name of `what` ("a field", "an option"). Throws if it has none, or if it is too long or has blanks or
// quotes.
std::string checked_name(const char* name, const std::string& what) {
  if (!name || !*name) fail(MJENV_E_ARGUMENT, what + " has no name");
  std::string text = name;
  if (text.size() > kMaxName)
    fail(MJENV_E_VALUE, "the name of " + what + " has more than " + std::to_string(kMaxName) + " bytes");
  if (std::any_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) <= ' ' || c == '"'; }))
    fail(MJENV_E_VALUE, what + " is called " + quoted(text) + ", but a name must have no blanks and no quotes");
  return text;
}

// The folder of the shared object or program that contains the code. If that is unknown, the current folder.
std::string folder_of(const void* code) {
  Dl_info info{};
  std::unique_ptr<char, decltype(&std::free)> path(nullptr, std::free);
  if (dladdr(code, &info) != 0 && info.dli_fname) path.reset(realpath(info.dli_fname, nullptr));
  if (path) {
    const std::string file = path.get();
    return file.substr(0, file.rfind('/') + 1);
  }
  path.reset(realpath(".", nullptr));
  return path ? std::string(path.get()) + "/" : "./";
}

const char* role_name(mjenv_role role) {
  switch (role) {
    case MJENV_ROLE_OBSERVATION: return "observation";
    case MJENV_ROLE_INFO: return "info";
    case MJENV_ROLE_RESET_INFO: return "reset info";
    case MJENV_ROLE_REWARD: return "reward";
    case MJENV_ROLE_STRUCTURE: return "structure";
    default: return nullptr;
  }
}

std::int64_t numbers(const OwnField& field) {
  std::int64_t count = 1;
  for (const auto extent : field.shape) count *= extent;
  return count;
}

// The fields of a role, with their offsets. An observation does not list empty terms.
std::vector<Field> with_offsets(const std::vector<OwnField>& fields, mjenv_role role) {
  std::vector<Field> list;
  std::int64_t offset = 0;
  for (const auto& f : fields) {
    if (f.role != role) continue;
    if (std::find(f.shape.begin(), f.shape.end(), -1) != f.shape.end())
      fail(MJENV_E_TASK, "build did not set the length of the " + std::string(role_name(role)) + " " + quoted(f.name));
    const std::int64_t count = numbers(f);
    if (role == MJENV_ROLE_OBSERVATION && count == 0) continue;
    list.push_back({f.name, f.doc.empty() ? meaning(f.name) : f.doc, f.type, f.shape, offset, count});
    offset += count;
    if (offset > kMaxNumbers)
      fail(MJENV_E_VALUE,
           "the " + std::string(role_name(role)) + " has more than " + std::to_string(kMaxNumbers) + " numbers");
  }
  return list;
}

std::int64_t total(const std::vector<Field>& fields) {
  return fields.empty() ? 0 : fields.back().offset + fields.back().count;
}

// A registered task in one environment: its callbacks, and the `self` that build made for them.
class Instance {
 public:
  Instance(std::string id, const OwnCallbacks& callbacks, bool strict)
      : id_(std::move(id)), callbacks_(callbacks), strict_(strict), self_(callbacks.user) {}
  ~Instance() {
    if (built_ && callbacks_.destroy) callbacks_.destroy(self_);
  }
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  void build(OwnBuild& builder) {
    if (!callbacks_.build) return;
    call("build", [&] {
      void* self = nullptr;
      const std::int32_t result = callbacks_.build(&builder, callbacks_.user, &self);
      if (result == 0) self_ = self;
      built_ = result == 0;  // if build failed, it has freed what it allocated
      builder.check();
      return result;
    });
  }

  void set_counts(const Described& fields) {
    observation_count_ = total(fields.observation);
    info_count_ = total(fields.info);
    reset_info_count_ = total(fields.reset_info);
  }

  void reset(Start& start, Rng& rng) const {
    OwnRandom random(rng);
    const auto size = [](Eigen::Index count) { return static_cast<std::int32_t>(count); };
    mjenv_start to{sizeof to,
                   0,
                   &task_api(),
                   &random,
                   start.sim.c().qpos0,
                   start.qpos.data(),
                   start.qvel.data(),
                   start.act.data(),
                   start.carried.data(),
                   start.sim.c().arrays,
                   size(start.qpos.size()),
                   size(start.qvel.size()),
                   size(start.act.size()),
                   size(start.carried.size())};
    call(
        "reset", [&] { return callbacks_.reset(self_, &to); }, &random);
    for (const auto& [name, values] : {std::pair{"qpos", start.qpos}, {"qvel", start.qvel}, {"act", start.act}})
      for (Eigen::Index i = 0; i < values.size(); ++i)
        if (!std::isfinite(values[i]))
          refuse("reset", std::string(name) + "[" + std::to_string(i) + "] is " + number(values[i]));
  }

  void reset_info(const Sim& sim, Info& info) const {
    sim.complete();
    double* values = nan_info(sim, reset_info_count_);
    call("reset_info", [&] { return callbacks_.reset_info(self_, &sim.c(), values); });
    info.write_all(values);
  }

  void carry(const Sim& sim, double* carried) const {
    sim.complete();
    call("carry", [&] { return callbacks_.carry(self_, &sim.c(), carried); });
  }

  void observe(const Sim& sim, double* to) const {
    sim.complete();
    call("observe", [&] { return callbacks_.observe(self_, &sim.c(), to); });
    if (!strict_) return;
    double sum = 0;
    for (std::int64_t i = 0; i < observation_count_; ++i) sum += 0 * to[i];  // becomes NaN if a number is not finite
    if (sum == 0) return;
    for (std::int64_t i = 0; i < observation_count_; ++i)
      if (std::isnan(to[i])) refuse("observe", "observation[" + std::to_string(i) + "] is NaN");
  }

  Outcome step(const Sim& sim, Row& row, Info& info) const {
    sim.complete();
    OwnRandom random(row.rng);
    const Eigen::Index nu = sim.action.count;
    double* action = sim.action_buffer();
    for (Eigen::Index i = 0; i < nu; ++i) action[i] = sim.action[i];
    mjenv_outcome to{sizeof to, 0, 0, nan_info(sim, info_count_), row.carried.data(), &random};
    struct Clear {  // other callbacks see an action of NaN
      double* values;
      Eigen::Index count;
      ~Clear() { std::fill_n(values, count, std::numeric_limits<double>::quiet_NaN()); }
    };
    const Clear clear{action, nu};
    call(
        "step", [&] { return callbacks_.step(self_, &sim.c(), &to); }, &random);
    if (strict_ && std::isnan(to.reward)) refuse("step", "the reward is NaN");
    info.write_all(to.info);
    return {to.reward, to.terminated != 0};
  }

 private:
  std::string id_;
  OwnCallbacks callbacks_;
  bool strict_, built_ = false;
  void* self_;
  std::int64_t observation_count_ = 0, info_count_ = 0, reset_info_count_ = 0;

  // The buffer for an info. Values that the callback does not write stay NaN.
  static double* nan_info(const Sim& sim, std::int64_t count) {
    return std::fill_n(sim.info_buffer(), count, std::numeric_limits<double>::quiet_NaN()) - count;
  }

  [[noreturn]] void refuse(const char* callback, const std::string& why) const {
    fail(MJENV_E_TASK, id_ + ": " + callback + ": " + why);
  }

  template <typename Body>
  void call(const char* name, const Body& body, const OwnRandom* random = nullptr) const {
    set_task_message("");
    std::int32_t result = 0;
    try {
      result = body();
    } catch (const Error& error) {  // from OwnBuild::check
      fail(error.status(), id_ + ": " + name + ": " + error.what());
    } catch (const std::exception& error) {
      refuse(name, std::string("it threw an exception: ") + error.what());
    } catch (...) {
      refuse(name, "it threw an exception");
    }
    if (result == 0 && !(random && random->failed)) return;
    const std::string why = task_message();
    refuse(name, why.empty() ? "it returned " + std::to_string(result) + " without a message" : why);
  }
};

}  // namespace

// NOLINTNEXTLINE(clang-analyzer-optin.cplusplus.UninitializedObject): clang 14 overlooks the braces of the base
OwnRandom::OwnRandom(Rng& stream) : mjenv_random{sizeof(mjenv_random), 0, &task_api()}, rng(stream) {}

OwnField own_field(const mjenv_task_field& given) {
  const auto from = read_struct(&given, "field");
  OwnField field{from.role, checked_name(from.name, "a field"), from.doc ? from.doc : "", from.type, {}};
  const std::string what = "field " + quoted(field.name);
  if (!role_name(field.role))
    fail(MJENV_E_TYPE, what + " has role " + std::to_string(field.role) + ", which a task cannot describe");
  if (field.type == 0) field.type = MJENV_TYPE_FLOAT64;
  if (field.type < MJENV_TYPE_FLOAT64 || field.type > MJENV_TYPE_UINT8)
    fail(MJENV_E_TYPE, what + " has type " + std::to_string(field.type) + ", which does not exist");
  if (from.ndim < 0 || from.ndim > 4)
    fail(MJENV_E_VALUE, what + " has " + std::to_string(from.ndim) + " dimensions, not 0 to 4");
  const bool term = field.role == MJENV_ROLE_OBSERVATION;
  if (term && from.ndim > 1)
    fail(MJENV_E_VALUE, what + " has " + std::to_string(from.ndim) + " dimensions: an observation's terms are vectors");
  if (term && field.type != MJENV_TYPE_FLOAT64) fail(MJENV_E_TYPE, what + ": an observation is of MJENV_TYPE_FLOAT64");
  if (field.role == MJENV_ROLE_REWARD && from.ndim != 0) fail(MJENV_E_VALUE, what + ": a reward is one number");
  std::int64_t count = 1;
  for (std::int32_t i = 0; i < from.ndim; ++i) {
    if (from.shape[i] < -1 || from.shape[i] > kMaxNumbers ||
        count * std::max<std::int64_t>(from.shape[i], 1) > kMaxNumbers)
      fail(MJENV_E_VALUE, what + " has the length " + std::to_string(from.shape[i]));
    field.shape.push_back(from.shape[i]);
    count *= std::max<std::int64_t>(from.shape[i], 1);
  }
  if (term && field.shape.empty()) field.shape = {1};
  return field;
}

void replace_or_add(std::vector<OwnField>& fields, OwnField field) {
  const auto found = std::find_if(fields.begin(), fields.end(), [&](const OwnField& f) {
    return f.role == field.role && (f.name == field.name || f.role == MJENV_ROLE_REWARD);
  });
  if (found == fields.end()) return fields.push_back(std::move(field));
  if (field.doc.empty()) field.doc = found->doc;
  *found = std::move(field);
}

OwnTask::OwnTask(const mjenv_task& given, const void* plugin)
    : revision_(given.revision),
      frame_skip_(given.frame_skip),
      reward_threshold_(given.has_reward_threshold != 0 ? given.reward_threshold
                                                        : std::numeric_limits<double>::quiet_NaN()),
      time_limit_(given.time_limit),
      carry_count_(given.carry_count),
      callbacks_{given.user,       given.build, given.destroy, given.reset,
                 given.reset_info, given.carry, given.observe, given.step},
      caller_thread_(given.caller_thread != 0),
      physics_only_(given.physics_only != 0),
      plugin_(plugin) {
  take_id(given.id);
  try {
    take_model(given);
    const auto check_range = [](const char* what, std::int64_t value, std::int64_t low, std::int64_t high) {
      if (value < low || value > high)
        fail(MJENV_E_VALUE, std::string(what) + " is " + std::to_string(value) + ", not " + std::to_string(low) +
                                " to " + std::to_string(high));
    };
    check_range("frame_skip", frame_skip_, 1, kMaxFrameSkip);
    check_range("time_limit", time_limit_, 0, kMaxInteger);
    check_range("carry_count", carry_count_, 0, kMaxCarried);
    if (given.camera) {
      const auto camera = read_struct(given.camera, "camera");
      camera_ = {camera.trackbodyid,
                 camera.distance,
                 {camera.lookat[0], camera.lookat[1], camera.lookat[2]},
                 camera.elevation};
    }
    take_options(given);
    take_fields(given);
    check_callbacks();
  } catch (const Error& error) {
    fail(error.status(), "task " + quoted(id_) + ": " + error.what());
  }
}

std::unique_ptr<OwnTask> own_task(const mjenv_task* given, const void* plugin) {
  return std::make_unique<OwnTask>(read_struct(given, "task"), plugin);
}

void OwnTask::take_id(const char* id) {
  if (!id) fail(MJENV_E_ARGUMENT, "the task's id is NULL");
  id_ = std::string(id).substr(0, kMaxId + 1);
  const std::size_t dash = id_.rfind("-v");
  const std::string number = dash == std::string::npos ? "" : id_.substr(dash + 2);
  const bool numbered = !number.empty() && number.size() < 10 && std::all_of(number.begin(), number.end(), is_digit);
  robot_ = id_.substr(0, numbered ? dash : 0);
  const auto fits = [](char c) { return is_word(c) || c == '.' || c == '-'; };
  if (id_.size() > kMaxId || robot_.empty() || !is_word(robot_[0]) || !std::all_of(robot_.begin(), robot_.end(), fits))
    fail(MJENV_E_VALUE,
         "an id is a name of letters, digits, \"_\", \".\" and \"-\", then \"-v\" and a number, as "
         "\"Cartpole-v0\"; at most " +
             std::to_string(kMaxId) + " bytes; not " + quoted(id_));
  version_ = std::stoi(number);
}

void OwnTask::take_model(const mjenv_task& given) {
  if (!given.model == !given.model_text) fail(MJENV_E_ARGUMENT, "set exactly one of model and model_text");
  if (given.model_text) {
    model_text_ = given.model_text;
    if (model_text_.empty()) fail(MJENV_E_VALUE, "model_text is empty");
    return;
  }
  model_ = given.model;
  if (model_.empty()) fail(MJENV_E_VALUE, "model is empty");
  if (model_[0] != '.') return;
  // Looks the path up from the folder of the task's code, so that it does not depend on the current folder.
  const auto code = given.step ? reinterpret_cast<const void*>(given.step) : reinterpret_cast<const void*>(given.build);
  model_ = folder_of(code) + (model_.rfind("./", 0) == 0 ? model_.substr(2) : model_);
}

void OwnTask::take_options(const mjenv_task& given) {
  for_each_struct(given.options, given.option_count, "option", [&](const mjenv_task_option& from) {
    const std::string name = checked_name(from.name, "an option"), what = "option " + quoted(name);
    const bool unbounded = from.low == 0 && from.high == 0;
    Option option(from.kind, name, from.doc ? from.doc : "", Scope::episodes, unbounded ? -kInfinity : from.low,
                  unbounded ? kInfinity : from.high);
    const auto check_default = [&](double value) {
      if (!(option.low <= value && value <= option.high))
        fail(MJENV_E_VALUE, what + ": its default " + number(value) + " does not lie in [" + number(option.low) + ", " +
                                number(option.high) + "]");
    };
    const auto set_integer = [&](double low, double high) {
      if (unbounded) option.low = low, option.high = high;
      check_default(from.value);
      if (from.value != std::floor(from.value) || std::fabs(from.value) > static_cast<double>(kMaxInteger))
        fail(MJENV_E_VALUE, what + ": its default " + number(from.value) + " is not an integer");
      option.integer = static_cast<std::int64_t>(from.value);
    };
    if (std::isnan(from.low) || std::isnan(from.high) || from.low > from.high)
      fail(MJENV_E_VALUE, what + " has the bounds [" + number(from.low) + ", " + number(from.high) +
                              "], which are NaN or in the wrong order");
    switch (from.kind) {
      case MJENV_KIND_FLAG: set_integer(0, 1); break;
      case MJENV_KIND_INTEGER: set_integer(-static_cast<double>(kMaxInteger), static_cast<double>(kMaxInteger)); break;
      case MJENV_KIND_REALS:
        if (from.count < 0 || from.count > kMaxCount)
          fail(MJENV_E_VALUE,
               what + ": its count is " + std::to_string(from.count) + ", not 0 to " + std::to_string(kMaxCount));
        if (from.count > 0 && !from.values) fail(MJENV_E_ARGUMENT, what + ": values is NULL");
        if (from.count == 0)
          option.reals = {from.value};
        else
          option.reals.assign(from.values, from.values + from.count);
        std::for_each(option.reals.begin(), option.reals.end(), check_default);
        break;
      case MJENV_KIND_STRING:
        option.text = from.text ? from.text : "";
        option.choices = from.choices ? from.choices : "";
        if (!option.choices.empty() && (" " + option.choices + " ").find(" " + option.text + " ") == std::string::npos)
          fail(MJENV_E_VALUE, what + ": its default " + quoted(option.text) + " is not one of its choices");
        break;
      case MJENV_KIND_STRING_OR_INT:
        set_integer(0, std::numeric_limits<int>::max());
        option.given_as_integer = !from.text;
        if (from.text) option.text = from.text;
        break;
      default: fail(MJENV_E_TYPE, what + " has kind " + std::to_string(from.kind) + ", which does not exist");
    }
    if (from.kind == MJENV_KIND_FLAG && (option.low != 0 || option.high != 1))
      fail(MJENV_E_VALUE, what + ": the bounds of a flag are 0 and 1, or both 0");
    options_.push_back(std::move(option));
  });
  // Names must differ from each other and from the options that every task has.
  std::vector<std::string> names;
  Options common(id_);
  declare(common, {});
  declare_env_options(common);
  for (const auto& option : common.all()) names.push_back(option.name);
  for (const auto& option : options_) {
    if (std::find(names.begin(), names.end(), option.name) != names.end())
      fail(MJENV_E_VALUE, "there is already an option " + quoted(option.name));
    names.push_back(option.name);
  }
}

void OwnTask::take_fields(const mjenv_task& given) {
  for_each_struct(given.fields, given.field_count, "field", [&](const mjenv_task_field& from) {
    const std::size_t before = fields_.size();
    OwnField field = own_field(from);
    const std::string name = field.name, role = role_name(field.role);
    replace_or_add(fields_, std::move(field));
    if (fields_.size() == before) fail(MJENV_E_VALUE, "there is already " + role + " " + quoted(name));
  });
}

void OwnTask::check_callbacks() const {
  const OwnCallbacks& c = callbacks_;
  const auto has = [&](mjenv_role role) {
    return std::any_of(fields_.begin(), fields_.end(), [&](const OwnField& f) { return f.role == role; });
  };
  const auto require = [](bool fulfilled, const char* what) {
    if (!fulfilled) fail(MJENV_E_ARGUMENT, std::string("callback ") + what);
  };
  require(c.build || has(MJENV_ROLE_OBSERVATION), "build is NULL, and there is no field of the observation");
  require(!c.destroy || c.build, "destroy is given, but there is no build whose self it could free");
  if (physics_only_) {
    require(!c.reset, "reset is given, but the task is physics_only");
    require(!c.reset_info, "reset_info is given, but the task is physics_only");
    require(!c.carry, "carry is given, but the task is physics_only");
    require(!c.observe, "observe is given, but the task is physics_only");
    require(!c.step, "step is given, but the task is physics_only");
    return;
  }
  require(c.reset, "reset is NULL");
  require(c.observe, "observe is NULL");
  require(c.step, "step is NULL");
  require(!c.carry || c.build || carry_count_ > 0, "carry is given, but carry_count is 0");
  require(c.reset_info || !has(MJENV_ROLE_RESET_INFO), "reset_info is NULL, but there are fields for it");
}

void OwnTask::declare(Options& options, const std::vector<Option>& own) const {
  declare_model(options, model_.c_str());
  options.integer("frame_skip", frame_skip_, 1, kMaxFrameSkip, "how many mj_steps make a step");
  for (const auto& option : own) options.add(option);
  declare_common(options, true, time_limit_);
}

Task OwnTask::outline() const {
  Task task;
  task.frame_skip = frame_skip_;
  task.time_limit = time_limit_;
  task.reward_threshold = reward_threshold_;
  task.camera = camera_;
  task.model_xml = model_text_.empty() ? asset_text(model_) : model_text_.c_str();
  return task;
}

std::shared_ptr<const Model> OwnTask::open(const Options& options) const {
  const bool trusted = options.get("trust_xml").integer != 0;
  const std::string &text = options.get("xml_string").text, &file = options.get("xml_file").text;
  if (!text.empty()) return Model::parse("xml_string", text, trusted);
  if (file != model_) return Model::open(file, trusted);
  // The task's own model is trusted, because its code is trusted.
  return model_text_.empty() ? Model::open(model_, true) : Model::parse(id_, model_text_, true);
}

Task OwnTask::build(const Options& options) const {
  Task task = outline();
  task.model = open(options);
  task.frame_skip = static_cast<int>(options.get("frame_skip").integer);

  Needs needs;
  needs.api = &task_api();
  Work work(task.model, task.frame_skip, needs);
  work.begin();
  work.forward();
  std::fill_n(work.action_buffer(), task.model->nu(), 0.0);
  OwnBuild builder(options, *task.model, work, fields_, carry_count_);
  const auto instance = std::make_shared<Instance>(id_, callbacks_, options.get("strict").integer != 0);
  instance->build(builder);
  task.norm = builder.rounding();

  Described described;
  try {
    described = {with_offsets(builder.fields(), MJENV_ROLE_OBSERVATION),
                 with_offsets(builder.fields(), MJENV_ROLE_INFO), with_offsets(builder.fields(), MJENV_ROLE_RESET_INFO),
                 with_offsets(builder.fields(), MJENV_ROLE_REWARD),
                 with_offsets(builder.fields(), MJENV_ROLE_STRUCTURE)};
    if (described.observation.empty()) fail(MJENV_E_TASK, "there is no field of the observation");
    if (callbacks_.carry && builder.carry_count() == 0) fail(MJENV_E_TASK, "carry is given, but carry_count is 0");
    if (!described.reset_info.empty() && !callbacks_.reset_info && !physics_only_)
      fail(MJENV_E_TASK, "there are fields of the reset info, but reset_info is NULL");
  } catch (const Error& error) {
    fail(error.status(), id_ + ": " + error.what());
  }
  if (!described.reward.empty()) task.reward_type = described.reward[0].type;

  task.needs = work.needs();
  task.needs.info = static_cast<std::size_t>(std::max(total(described.info), total(described.reset_info)));
  task.carry_count = builder.carry_count();
  task.draws_in_steps = true;
  task.revision = revision_;
  task.caller_thread = caller_thread_;
  instance->set_counts(described);
  const auto count = static_cast<Eigen::Index>(total(described.observation));
  task.described = std::move(described);
  if (physics_only_) {
    task.terms.push_back({"observation", [count](const Sim&, double* to) {
                            if (to) std::fill_n(to, count, 0.0);
                            return count;
                          }});
    const std::vector<double> unknown(task.needs.info, std::numeric_limits<double>::quiet_NaN());
    task.reset = [instance](Start&, Rng&) {};  // keeps what build made for as long as the task
    task.reset_info = [unknown](const Sim&, Info& info) { info.write_all(unknown.data()); };
    task.step = [unknown](const Sim&, Row&, Info& info) -> Outcome {
      info.write_all(unknown.data());
      return {0, false};
    };
    return task;
  }
  task.terms.push_back({"observation", [instance, count](const Sim& s, double* to) {
                          if (to) instance->observe(s, to);
                          return count;
                        }});
  task.reset = [instance](Start& start, Rng& rng) { instance->reset(start, rng); };
  if (callbacks_.reset_info) task.reset_info = [instance](const Sim& s, Info& info) { instance->reset_info(s, info); };
  if (callbacks_.carry) task.carry = [instance](const Sim& s, double* to) { instance->carry(s, to); };
  task.step = [instance](const Sim& s, Row& row, Info& info) { return instance->step(s, row, info); };
  return task;
}

}  // namespace mjenv::core
