#include "task/registered_task.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/assets.hpp"
#include "engine/errors.hpp"
#include "error.hpp"
#include "structs.hpp"
#include "system/platform.hpp"
#include "task/builder.hpp"
#include "task/registry.hpp"
#include "task/task_field.hpp"

namespace mjenv::core {
namespace {

constexpr std::size_t kMaxId = 100;
constexpr std::int64_t kMaxCount = 1 << 20;  // of options, fields, and numbers in one option
// The largest value of an integer option. A double holds it exactly, and the bounds of options are doubles.
constexpr std::int64_t kMaxInteger = (std::int64_t{1} << 53) - 1;

bool is_digit(char c) { return '0' <= c && c <= '9'; }
bool is_word(char c) { return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || is_digit(c) || c == '_'; }

}  // namespace

std::string folder_of(const void* code) {
  std::string path = platform::file_of(code);
  if (!path.empty()) path = platform::real_path(path);
  if (!path.empty()) return path.substr(0, path.rfind('/') + 1);
  path = platform::real_path(".");
  return path.empty() ? "./" : path + "/";
}

RegisteredTask::RegisteredTask(const mjenv_task& given, Origin origin, const void* plugin)
    : built_in_(origin == Origin::built_in), given_(given), camera_ MJENV_TASK_CAMERA_INIT, plugin_(plugin) {
  if (given.has_reward_threshold == 0) given_.reward_threshold = std::numeric_limits<double>::quiet_NaN();
  take_id(given.id);
  try {
    take_model(given);
    check_range("frame_skip", given_.frame_skip, 1, kMaxFrameSkip);
    check_range("time_limit", given_.time_limit, 0, kMaxInteger);
    check_range("carry_count", given_.carry_count, 0, kMaxCarried);
    if (given.camera) camera_ = read_struct(given.camera, "camera", camera_);
    take_options(given);
    take_fields(given);
    check_callbacks(given_, fields_);
  } catch (const Error& error) {
    fail(error.status(), "task " + quoted(id_) + ": " + error.what());
  }
  given_.id = given_.model = given_.model_text = nullptr;
  given_.options = nullptr, given_.fields = nullptr, given_.camera = nullptr;
}

std::unique_ptr<RegisteredTask> users_task(const mjenv_task* given, const void* plugin) {
  return std::make_unique<RegisteredTask>(read_struct(given, "task"), RegisteredTask::Origin::user, plugin);
}

void RegisteredTask::take_id(const char* id) {
  if (!id) fail(MJENV_E_ARGUMENT, "the task's id is NULL");
  id_ = std::string(id).substr(0, kMaxId + 1);
  const std::size_t dash = id_.rfind("-v");
  const std::string number = dash == std::string::npos ? "" : id_.substr(dash + 2);
  // At most 9 digits, because std::stoi throws if the number does not fit an int.
  const bool numbered = !number.empty() && number.size() < 10 && std::all_of(number.begin(), number.end(), is_digit);
  robot_ = id_.substr(0, numbered ? dash : 0);
  const auto fits = [](char c) { return is_word(c) || c == '.' || c == '-'; };
  const std::size_t slash = robot_.find('/');
  const std::string space = slash == std::string::npos ? "" : robot_.substr(0, slash);
  const std::string name = slash == std::string::npos ? robot_ : robot_.substr(slash + 1);
  const auto is_name = [&](const std::string& text) {
    return !text.empty() && is_word(text[0]) && std::all_of(text.begin(), text.end(), fits);
  };
  if (id_.size() > kMaxId || !is_name(name) || (slash != std::string::npos && !is_name(space)))
    fail(MJENV_E_VALUE,
         "the id " + quoted(id_) +
             " is malformed: it must be NAME-vNUMBER or NAMESPACE/NAME-vNUMBER, as \"Cartpole-v0\", of at most " +
             std::to_string(kMaxId) +
             " bytes; names consist of letters, digits, \"_\", \".\" and \"-\", and begin with a letter, a digit or "
             "\"_\"; the number has at most 9 digits");
  version_ = std::stoi(number);
}

void RegisteredTask::take_model(const mjenv_task& given) {
  if (!given.model == !given.model_text) fail(MJENV_E_ARGUMENT, "set exactly one of model and model_text");
  if (given.model_text) {
    model_text_ = given.model_text;
    if (model_text_.empty()) fail(MJENV_E_VALUE, "model_text is empty");
    return;
  }
  model_ = given.model;
  if (model_.empty() && !built_in_) fail(MJENV_E_VALUE, "model is empty");  // only "Model-v0" has no model of its own
  if (model_.empty() || model_[0] != '.') return;
  // A relative path is looked up from the folder of the task's code, so that it does not depend on the current folder.
  const auto code = given.step ? reinterpret_cast<const void*>(given.step) : reinterpret_cast<const void*>(given.build);
  model_ = folder_of(code) + (model_.rfind("./", 0) == 0 ? model_.substr(2) : model_);
}

void RegisteredTask::take_options(const mjenv_task& given) {
  for_each_struct(given.options, given.option_count, kMaxCount, "option_count", "options", [&](const auto& from) {
    const std::string name = checked_name(from.name, "an option"), what = "option " + quoted(name);
    const bool unbounded = from.low == 0 && from.high == 0;
    Option option(from.kind, name, from.doc ? from.doc : "", InIdentity::yes, unbounded ? -kInfinity : from.low,
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
        fail(MJENV_E_VALUE,
             what + ": its default " + number(from.value) + " is not an integer between -(2^53 - 1) and 2^53 - 1");
      option.integer = static_cast<std::int64_t>(from.value);
    };
    if (std::isnan(from.low) || std::isnan(from.high) || from.low > from.high)
      fail(MJENV_E_VALUE, what + " has the bounds [" + number(from.low) + ", " + number(from.high) +
                              "], which are NaN or in the wrong order");
    switch (from.kind) {
      case MJENV_KIND_FLAG: set_integer(0, 1); break;
      case MJENV_KIND_INTEGER: set_integer(-static_cast<double>(kMaxInteger), static_cast<double>(kMaxInteger)); break;
      case MJENV_KIND_REALS:
        check_range((what + ": its count").c_str(), from.count, 0, kMaxCount);
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
        if (!option.allows(option.text))
          fail(MJENV_E_VALUE, what + ": its default " + quoted(option.text) + " is not one of its choices");
        break;
      case MJENV_KIND_STRING_OR_INT:
        option.given_as_integer = !from.text;
        if (!from.text) {
          set_integer(0, std::numeric_limits<int>::max());
        } else {
          option.text = from.text;
          if (unbounded) option.low = 0, option.high = std::numeric_limits<int>::max();
        }
        break;
      default: fail(MJENV_E_TYPE, what + " has kind " + std::to_string(from.kind) + ", which does not exist");
    }
    if (from.live != 0 && from.kind != MJENV_KIND_REALS)
      fail(MJENV_E_TYPE, what + " is " + kind_name(from.kind) + ", but a live parameter is real numbers");
    option.live = from.live != 0;
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

void RegisteredTask::take_fields(const mjenv_task& given) {
  for_each_struct(given.fields, given.field_count, kMaxCount, "field_count", "fields", [&](const auto& from) {
    const std::size_t before = fields_.size();
    Field field = field_of(from);
    const std::string name = field.name, role = role_name(field.role);
    replace_or_add(fields_, std::move(field));
    if (fields_.size() == before)
      fail(MJENV_E_VALUE, "there is already " +
                              (from.role == MJENV_ROLE_REWARD ? "a field of the reward" : role + " " + quoted(name)));
  });
}

void RegisteredTask::check_callbacks(const mjenv_task& c, const std::vector<Field>& fields) const {
  const auto has = [&](mjenv_role role) {
    return std::any_of(fields.begin(), fields.end(), [&](const Field& f) { return f.role == role; });
  };
  const auto require = [](bool fulfilled, const char* what) {
    if (!fulfilled) fail(MJENV_E_ARGUMENT, std::string("callback ") + what);
  };
  require(c.build || has(MJENV_ROLE_OBSERVATION), "build is NULL, and there is no field of the observation");
  require(!c.destroy || c.build, "destroy is given, but there is no build whose self it could free");
  if (given_.physics_only != 0) {
    require(!c.reset_info, "reset_info is given, but the task is physics_only");
    require(!c.carry, "carry is given, but the task is physics_only");
    require(!c.observe, "observe is given, but the task is physics_only");
    require(!c.step, "step is given, but the task is physics_only");
    require(!c.before_step, "before_step is given, but the task is physics_only");
    require(!c.before_substep, "before_substep is given, but the task is physics_only");
    require(!c.compute_reward, "compute_reward is given, but the task is physics_only");
    return;
  }
  require(c.reset, "reset is NULL");
  require(c.observe, "observe is NULL");
  require(c.step, "step is NULL");
  require(!c.carry || c.build || given_.carry_count > 0, "carry is given, but carry_count is 0");
  require(c.reset_info || !has(MJENV_ROLE_RESET_INFO), "reset_info is NULL, but there are fields for it");
}

void RegisteredTask::declare(Options& options, const std::vector<Option>& of_task) const {
  if (given_.fixed_model == 0)
    options.text(
        "xml_file", model_.c_str(),
        "a built-in model (\"hopper.xml\"), or the path of an MJCF file, which begins with \".\", \"/\" or \"~\"", "",
        InIdentity::no);
  if (!given_.fixed_frame_skip)
    options.integer("frame_skip", given_.frame_skip, 1, kMaxFrameSkip, "how many times a step calls mj_step");
  for (const auto& option : of_task) options.add(option);
  // xml_file, xml_string, trust_xml and norm have InIdentity::no, because the identity contains the model and the
  // rounding.
  if (given_.fixed_model == 0) {
    options.text("xml_string", "", "the text of an MJCF model, instead of xml_file; empty: xml_file is used", "",
                 InIdentity::no);
    options.text(
        "trust_xml", "auto",
        "yes: the model may be very large and read any file; no: its size is limited, and it reads only files in its "
        "folder, or no files if it is an xml_string; auto: yes for xml_file, no for xml_string",
        "auto yes no", InIdentity::no);
  }
  options.integer("max_episode_steps", given_.time_limit, 0, kMaxInteger,
                  "the number of steps after which an episode is truncated; 0: never");
  options.text(
      "norm", "auto",
      "how Euclidean norms are rounded: as NumPy does on CPUs with AVX-512 (fused), on other x86-64 CPUs (plain), or "
      "here (auto)",
      "auto fused plain", InIdentity::no);
}

Outline RegisteredTask::outline() const {
  return {model_text_.empty() ? asset_text(model_) : model_text_.c_str(), given_.time_limit, given_.reward_threshold,
          camera_, given_.revision};
}

std::shared_ptr<const Model> RegisteredTask::open(const Options& options) const {
  if (given_.fixed_model == 0) {
    const std::string &text = options.get("xml_string").text, &file = options.get("xml_file").text;
    const std::string& trust = options.get("trust_xml").text;
    if (!text.empty()) return Model::parse("xml_string", text, trust == "yes");
    if (file != model_) return Model::open(file, trust != "no");
  }
  // The task's own model is trusted, because its code is trusted.
  return model_text_.empty() ? Model::open(model_, true) : Model::parse(id_, model_text_, true);
}

Task RegisteredTask::build(const Options& options) const {
  Task task;
  task.model = open(options);
  // If open() was the first to load libmujoco, the caller's ErrorTrap does not catch its errors. This one does.
  const ErrorTrap trap;
  task.frame_skip = given_.fixed_frame_skip ? given_.frame_skip : static_cast<int>(options.get("frame_skip").integer);
  task.camera = camera_;
  task.revision = given_.revision;
  task.caller_thread = given_.caller_thread != 0;
  task.physics_only = given_.physics_only != 0;

  Work work(task.model);
  work.begin();
  work.forward();
  SimView view(work, task.frame_skip);
  const std::vector<double> zeros(work.layout().nu);
  const Action no_action{zeros.data(), {}, task.model->nu()};
  view.show(no_action);
  for (const Option& option : options.all())
    if (option.live) task.parameters.add(option);
  view.show_parameters(task.parameters.defaults().data());
  Builder builder(options, *task.model, view, fields_, given_.carry_count, task.parameters);
  // A built-in robot returns what Gymnasium returns, which may be NaN.
  const bool checks = !built_in_ && options.get("strict").integer != 0;
  // Calls build, which fills the builder and may replace callbacks.
  const auto calls = std::make_shared<Calls>(id_, given_, checks, builder);
  try {
    check_callbacks(calls->callbacks(), builder.fields());
  } catch (const Error& error) {
    fail(MJENV_E_TASK, id_ + ": build: " + error.what());
  }
  task.norm = builder.rounding();
  task.fields = described(builder, calls->callbacks());
  task.fields[MJENV_ROLE_PARAMETERS] = task.parameters.fields();
  task.kept = builder.kept();
  task.needs = view.needs();
  const ActionBounds& own_space = task.needs.action;
  if (!own_space.low.empty() && !calls->has_before_step() && !task.physics_only)
    fail(MJENV_E_TASK, id_ + ": build: an action space of the task's own needs the callback before_step");
  task.action = own_space.low.empty() ? ActionBounds{task.model->action_low(), task.model->action_high()} : own_space;
  // Gymnasium's robots keep Gymnasium's action space, which is 0 to 0 for such an actuator.
  if (own_space.low.empty() && !(built_in_ && !model_.empty()))
    for (std::size_t i = 0; i < task.action.low.size(); ++i)
      if (!task.model->has_control_range(static_cast<int>(i)))
        task.action.low[i] = -kInfinity, task.action.high[i] = kInfinity;
  task.needs.info = static_cast<std::size_t>(
      std::max(total(task.fields[MJENV_ROLE_INFO]), total(task.fields[MJENV_ROLE_RESET_INFO])));
  task.carry_count = builder.carry_count();
  if (calls->callbacks().compute_reward) task.goal_count = goal_count(task.fields[MJENV_ROLE_OBSERVATION]);
  calls->set_counts(task.fields, task.carry_count, builder.bounds());
  task.calls = calls;

  // A trial step: a model that MuJoCo cannot step is refused now.
  std::vector<double> before(work.layout().size);
  work.act(no_action);
  work.step(1, before.data());
  return task;
}

// Returns how many numbers a goal has. Throws unless the observation has two goals of the same length.
std::int64_t RegisteredTask::goal_count(const std::vector<Field>& observation) const {
  const std::vector<Field> keys = keys_of(observation);
  const auto length_of = [&](const char* name) {
    for (const Field& key : keys)
      if (key.name == name) return key.count;
    fail(MJENV_E_TASK, id_ + ": compute_reward is given, but the observation has no group or term " + quoted(name));
  };
  const std::int64_t achieved = length_of("achieved_goal"), desired = length_of("desired_goal");
  if (achieved != desired || achieved == 0)
    fail(MJENV_E_TASK, id_ + ": compute_reward is given, but achieved_goal has " + std::to_string(achieved) +
                           " number(s) and desired_goal " + std::to_string(desired));
  return achieved;
}

// Returns the task's fields with the lengths that build has set. Throws if they do not fit the callbacks.
Fields RegisteredTask::described(const Builder& builder, const mjenv_task& callbacks) const {
  try {
    Fields fields;
    for (std::size_t role = 0; role < fields.size(); ++role)
      if (role_name(static_cast<mjenv_role>(role)))
        fields[role] = with_offsets(builder.fields(), static_cast<mjenv_role>(role));
    keys_of(fields[MJENV_ROLE_OBSERVATION]);  // throws if the groups are wrong
    if (fields[MJENV_ROLE_OBSERVATION].empty() && !built_in_)
      fail(MJENV_E_TASK, "there is no field of the observation");
    if (callbacks.carry && builder.carry_count() == 0) fail(MJENV_E_TASK, "carry is given, but carry_count is 0");
    for (const CarryBounds& bounds : builder.bounds())
      if (bounds.first + bounds.count > builder.carry_count())
        fail(MJENV_E_TASK, "carry_bounds: first is " + std::to_string(bounds.first) + " and count " +
                               std::to_string(bounds.count) + ", but carry_count is " +
                               std::to_string(builder.carry_count()));
    for (const KeptNumbers& kept : builder.kept())
      if (kept.first + kept.count > builder.carry_count())
        fail(MJENV_E_TASK, "keep: first is " + std::to_string(kept.first) + " and count " + std::to_string(kept.count) +
                               ", but carry_count is " + std::to_string(builder.carry_count()));
    std::vector<Field>& reward = fields[MJENV_ROLE_REWARD];
    if (reward.empty()) reward.push_back({MJENV_ROLE_REWARD, "reward", meaning("reward"), MJENV_DTYPE_FLOAT64, {}});
    reward[0].name = "reward";
    return fields;
  } catch (const Error& error) {
    fail(error.status(), id_ + ": " + error.what());
  }
}

}  // namespace mjenv::core
