#include "settings.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>
#include <utility>
#include <variant>

#include "chars.hpp"
#include "error.hpp"

namespace mjenv::learn {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kPositive = std::numeric_limits<double>::denorm_min();  // the least number greater than 0
constexpr double kMaxFloat = std::numeric_limits<float>::max(), kMaxSteps = 9007199254740992.0, kMaxSeed = 0x1p64;
constexpr double kMaxBatch = 1 << 26, kMaxWidth = 4096;
constexpr std::int64_t kMaxLayers = 8, kMaxObservations = 1 << 20;
constexpr const char* kActivationNames = "tanh relu elu";

struct Bounds {
  double low, high;
  std::int64_t count;   // the greatest number of elements of a list, else 1
  const char* choices;  // of a text
};
constexpr Bounds between(double low, double high) { return {low, high, 1, nullptr}; }
constexpr Bounds from(double low) { return between(low, kInfinite); }
constexpr Bounds list(double low, double high, std::int64_t most) { return {low, high, most, nullptr}; }
constexpr Bounds one_of(const char* choices) { return {0, 0, 1, choices}; }

enum class Change {
  kFree,   // at any time
  kFixed,  // never, once the learner is created
  kSaved   // never, and a checkpoint only fits learners with the same value
};

struct Setting {
  const char *name, *doc;
  std::variant<bool Settings::*, std::int64_t Settings::*, std::uint64_t Settings::*, double Settings::*,
               std::string Settings::*, Integers Settings::*>
      member;
  Bounds bounds;
  Change change;
};

constexpr Setting kSettings[] = {
#define SETTING(type, name, value, bounds, change, doc) {#name, doc, &Settings::name, bounds, Change::change},
#include "settings.def"
#undef SETTING
};

[[noreturn]] void refuse(const std::string& name, const std::string& value, const std::string& wanted,
                         mjenv_status status = MJENV_E_VALUE) {
  core::fail(status, "settings." + name + " is " + value + ", not " + wanted);
}

std::string range(const Bounds& bounds) {
  if (bounds.low == kPositive) return "a finite number greater than 0, in float32";
  if (std::isinf(bounds.high)) return "a finite number from " + core::number(bounds.low) + " on";
  return core::number(bounds.low) + " to " + core::number(bounds.high);
}

// ---- Values from text and to text ----

template <typename T>
void parse_integer(const std::string& name, const std::string& text, const Bounds& bounds, T& value) {
  const char* end = text.data() + text.size();
  const auto [read, error] = std::from_chars(text.data(), end, value);
  if (read != end || text.empty()) refuse(name, core::quoted(text.substr(0, 100)), "an integer", MJENV_E_TYPE);
  if (error != std::errc{} || static_cast<double>(value) < bounds.low || static_cast<double>(value) > bounds.high)
    refuse(name, text.substr(0, 100), range(bounds));
}

void parse(const std::string& name, const std::string& text, const Bounds& bounds, std::int64_t& value) {
  parse_integer(name, text, bounds, value);
}

void parse(const std::string& name, const std::string& text, const Bounds& bounds, std::uint64_t& value) {
  if (!text.empty() && text.front() == '-') refuse(name, text.substr(0, 100), "0 to 18446744073709551615");
  parse_integer(name, text, bounds, value);
}

void parse(const std::string& name, const std::string& text, const Bounds&, bool& value) {
  value = text == "true" || text == "1";
  if (!value && text != "false" && text != "0")
    refuse(name, core::quoted(text.substr(0, 100)), "true or false", MJENV_E_TYPE);
}

void parse(const std::string& name, const std::string& text, const Bounds& bounds, double& value) {
  std::size_t length = 0;
  const std::optional<double> found = core::read_double(text, &length);
  if (!found || length != text.size()) refuse(name, core::quoted(text.substr(0, 100)), "a number", MJENV_E_TYPE);
  value = *found;
  if (!(value >= bounds.low && value <= bounds.high && std::isfinite(value)))
    refuse(name, core::number(value), range(bounds));
}

void parse(const std::string& name, const std::string& text, const Bounds& bounds, std::string& value) {
  const std::string choices = ' ' + std::string(bounds.choices) + ' ';
  if (text.empty() || choices.find(' ' + text + ' ') == std::string::npos)
    refuse(name, core::quoted(text.substr(0, 100)), "one of " + std::string(bounds.choices));
  value = text;
}

void parse(const std::string& name, const std::string& text, const Bounds& bounds, Integers& value) {
  value.clear();
  for (std::size_t at = 0; at <= text.size() && !text.empty();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    if (static_cast<std::int64_t>(value.size()) == bounds.count)
      refuse(name, "a list of more than " + std::to_string(bounds.count), "shorter");
    const std::string element = name + "[" + std::to_string(value.size()) + "]";
    parse_integer(element, text.substr(at, end - at), bounds, value.emplace_back());
    at = end + 1;
  }
}

std::string text_of(bool value) { return value ? "true" : "false"; }
std::string text_of(std::int64_t value) { return std::to_string(value); }
std::string text_of(std::uint64_t value) { return std::to_string(value); }
std::string text_of(double value) { return core::number(value); }
std::string text_of(const std::string& value) { return value; }
std::string text_of(const Integers& value) {
  std::string text;
  for (const int element : value) text += (text.empty() ? "" : ",") + std::to_string(element);
  return text;
}

std::string value_of(const Settings& settings, const Setting& one) {
  return std::visit([&](auto member) { return text_of(settings.*member); }, one.member);
}

// ---- Words ----

const Setting& setting_named(const std::string& name) {
  std::vector<std::string> names;
  for (const Setting& one : kSettings) {
    if (name == one.name) return one;
    names.emplace_back(one.name);
  }
  core::fail(MJENV_E_NAME, "there is no setting " + core::quoted(name.substr(0, 100)) +
                               core::choices(name, names, "mjenv_learn_setting_at"));
}

void assign(Settings& settings, std::string_view words) {
  constexpr const char* kBlanks = " \t\r\n";
  for (std::size_t at = words.find_first_not_of(kBlanks); at != std::string_view::npos;) {
    const std::size_t end = std::min(words.find_first_of(kBlanks, at), words.size());
    const std::string_view word = words.substr(at, end - at);
    const std::size_t equals = word.find('=');
    if (equals == std::string_view::npos)
      core::fail(MJENV_E_VALUE, "settings has " + core::quoted(std::string(word.substr(0, 100))) + ", not NAME=VALUE");
    const Setting& one = setting_named(std::string(word.substr(0, equals)));
    const std::string value(word.substr(equals + 1));
    std::visit([&](auto member) { parse(one.name, value, one.bounds, settings.*member); }, one.member);
    at = words.find_first_not_of(kBlanks, end);
  }
  const auto most = static_cast<std::int64_t>(kMaxBatch) / settings.rows;
  if (settings.rollout_steps > most)
    refuse("rollout_steps", std::to_string(settings.rollout_steps), "1 to " + std::to_string(most));
}

// ---- Defaults ----

// For robots of which few steps are enough: few rows and many small minibatches. Those of settings.def are many rows,
// large minibatches and small standard deviations, with which a training reaches a given return in the least time.
constexpr const char* kFewRows = "rows=8 epochs=10 minibatch_size=256 value_coef=0.5 max_grad_norm=0.5 initial_std=1";

constexpr std::array<const char*, 3> kTuned[] = {  // the id, the settings on which its own are based, its own
    {"Ant-v5", "", ""},
    {"HalfCheetah-v5", "", "gamma=0.98"},
    {"Hopper-v5", kFewRows, "steps=1000000 rollout_steps=512 learning_rate=5e-4"},
    {"Humanoid-v5", "", "learning_rate=5e-4 decay_steps=8000000"},
    {"HumanoidStandup-v5", "", "steps=600000"},
    {"InvertedDoublePendulum-v5", "", "steps=400000"},
    {"InvertedPendulum-v5", kFewRows, "steps=100000 rollout_steps=256 epochs=5 minibatch_size=128"},
    {"Pusher-v5", "", "steps=1500000"},
    {"Reacher-v5", kFewRows, "steps=150000 rollout_steps=256 gamma=0.9"},
    {"Swimmer-v5", kFewRows, "steps=1000000 rollout_steps=1024 learning_rate=6e-4 gamma=0.9999 gae_lambda=0.98"},
    {"Walker2d-v5", "", "steps=1515520 decay_steps=3000000"}};

}  // namespace

bool is_id(std::string_view text) {
  const auto is_printed = [](char c) { return c >= ' ' && c <= '~'; };
  return !text.empty() && text.size() <= 1000 && std::all_of(text.begin(), text.end(), is_printed);
}

Settings::Settings(const std::string& env_id, std::string_view words) : id(env_id) {
  if (!is_id(id))
    core::fail(MJENV_E_VALUE, "id is " + core::quoted(id.substr(0, 100)) + ", not that of an environment");
  for (const auto& [tuned, base, own] : kTuned)
    if (id == tuned) assign(*this, std::string("scale_actions=false ") + base + ' ' + own);
  assign(*this, words);
}

void Settings::change(std::string_view words) {
  Settings changed = *this;
  assign(changed, words);
  for (const Setting& one : kSettings)
    if (one.change != Change::kFree && value_of(*this, one) != value_of(changed, one))
      core::fail(MJENV_E_VALUE, "settings." + std::string(one.name) + " cannot change once the learner is created");
  *this = std::move(changed);
}

void Settings::check_masks(std::size_t observations) const {
  const auto check = [&](const std::string& name, const Integers& mask) {
    if (mask.empty()) return;
    if (mask.size() != observations)
      core::fail(MJENV_E_SIZE, "settings." + name + " has " + std::to_string(mask.size()) +
                                   " elements, but an observation has " + std::to_string(observations));
    if (std::find(mask.begin(), mask.end(), 1) == mask.end())
      core::fail(MJENV_E_VALUE, "settings." + name + " is 0 for every element, so the network would see none");
  };
  check("actor_obs", actor_obs);
  check("critic_obs", critic_obs);
}

std::string Settings::text() const {
  std::string text;
  for (const Setting& one : kSettings) text += (text.empty() ? "" : " ") + (one.name + ('=' + value_of(*this, one)));
  return text;
}

std::string Settings::saved() const {
  std::string text = "id " + id + '\n';
  for (const Setting& one : kSettings)
    if (one.change == Change::kSaved) text += one.name + (' ' + value_of(*this, one)) + '\n';
  return text;
}

std::int64_t setting_count() { return std::size(kSettings); }

mjenv_option setting_at(std::int64_t index) {
  core::check_index("setting", index, std::size(kSettings));
  const Setting& one = kSettings[index];
  // By the place of its type in the variant.
  constexpr mjenv_kind kKinds[] = {MJENV_KIND_FLAG,  MJENV_KIND_INTEGER, MJENV_KIND_INTEGER,
                                   MJENV_KIND_REALS, MJENV_KIND_STRING,  MJENV_KIND_INTEGER};
  mjenv_option found = MJENV_OPTION_INIT;
  found.kind = kKinds[one.member.index()];
  found.name = one.name;
  found.doc = one.doc;
  found.low = one.bounds.low;
  found.high = one.bounds.high;
  found.count = one.bounds.count;
  found.choices = one.bounds.choices;
  return found;
}

}  // namespace mjenv::learn
