#include "env/draw_document.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "engine/state_layout.hpp"
#include "error.hpp"
#include "json.hpp"
#include "task/task_field.hpp"

namespace mjenv::core {
namespace {

constexpr std::size_t kMaxItems = 10'000;
constexpr std::int64_t kMaxDelay = 1'000'000;
constexpr const char* kNothing = R"({"randomize": null, "noise": null, "delay": null, "push": null})";

using Names = std::vector<std::string>;

// Ends a message about a word that is none of `words`.
std::string choice_of(const std::string& given, const Names& words) {
  const Names likely = nearest(given, words);
  return "; " + (likely.empty() ? "there are " + listed(words) : "is one of these meant? " + listed(likely));
}

// A value of the document.
struct Value {
  const Json* json;  // null if the document has none here
  std::string place;

  explicit operator bool() const { return json != nullptr; }

  [[noreturn]] void refuse(mjenv_status status, const std::string& why) const { fail(status, place + ": " + why); }
  [[noreturn]] void refuse_kind(const std::string& wanted) const {
    std::string given = written(*json);
    if (given.size() > 40) given = given.substr(0, 40) + "...";
    refuse(MJENV_E_TYPE, wanted + " is expected, not " + given);
  }

  // Refuses what is no object, and members with other names.
  const Value& has(const Names& names) const {
    if (!json) return *this;
    if (json->kind != Json::Kind::object) refuse_kind("an object {...}");
    for (const Json& member : json->items)
      if (std::find(names.begin(), names.end(), member.name) == names.end())
        refuse(MJENV_E_NAME, "there is no " + quoted(member.name) + choice_of(member.name, names));
    return *this;
  }
  Value operator[](const std::string& name) const {
    return {json ? json->find(name) : nullptr, place.empty() ? name : place + "." + name};
  }
  // The elements of a list; of anything else the value itself; nothing if there is none.
  std::vector<Value> several() const {
    if (!json || json->kind == Json::Kind::null) return {};
    if (json->kind != Json::Kind::list) return {*this};
    std::vector<Value> all;
    for (const Json& item : json->items) all.push_back({&item, place + "[" + std::to_string(all.size()) + "]"});
    return all;
  }

  std::string word() const {
    if (json->kind != Json::Kind::text) refuse_kind("a text");
    if (json->text.find('\0') != std::string::npos) refuse(MJENV_E_VALUE, "the text contains a null character");
    return json->text;
  }
  // The index of one of the words.
  std::size_t one_of(const Names& words) const {
    const std::string given = word();
    const auto found = std::find(words.begin(), words.end(), given);
    if (found == words.end()) refuse(MJENV_E_VALUE, "there is no " + quoted(given) + choice_of(given, words));
    return static_cast<std::size_t>(found - words.begin());
  }
  bool flag() const {
    if (!json) return false;
    if (json->kind != Json::Kind::flag) refuse_kind("true or false");
    return json->flag;
  }
  double number() const {
    if (!json->is_number()) refuse_kind("a number");
    return json->real;
  }
  std::int64_t integer() const {
    if (json->kind != Json::Kind::integer) refuse_kind("an integer");
    return json->integer;
  }
  std::vector<double> numbers() const {
    std::vector<double> found;
    for (const Value& one : several()) found.push_back(one.number());
    return found;
  }
  std::vector<std::int64_t> integers() const {
    std::vector<std::int64_t> found;
    for (const Value& one : several()) found.push_back(one.integer());
    return found;
  }
  // Calls take(value, indices) for each member of an object, whose name is that of a field or of a group of fields, with
  // the indices of these fields; if this value is no object, once with it and all indices.
  template <typename Take>
  void for_each_part(const std::vector<Field>& fields, const Take& take) const {
    if (!json) return;
    std::vector<std::size_t> all(static_cast<std::size_t>(total(fields)));
    std::iota(all.begin(), all.end(), 0);
    if (json->kind != Json::Kind::object) return take(*this, all);
    has(names_of(fields));
    std::vector<bool> is_taken(all.size());
    for (const Json& json_part : json->items) {
      const Value part{&json_part, place + "." + json_part.name};
      if (json_part.kind == Json::Kind::null) continue;
      std::vector<std::size_t> indices;
      for (const Field& field : fields) {
        if (!is_called(field, json_part.name)) continue;
        const auto first = all.begin() + field.offset;
        indices.insert(indices.end(), first, first + field.count);
        if (is_taken[*first]) part.refuse(MJENV_E_VALUE, quoted(field.name) + " is named twice");
        is_taken[*first] = true;
      }
      take(part, indices);
    }
  }
  // One number for each index of the fields: the document has all of them, one for all, or some by names, the others
  // being 0. If all are 0, the list is empty.
  std::vector<double> numbers_for(const std::vector<Field>& fields, bool are_deviations) const {
    std::vector<double> found(static_cast<std::size_t>(total(fields)));
    for_each_part(fields, [&](const Value& part, const std::vector<std::size_t>& indices) {
      const std::vector<double> given = part.numbers();
      if (given.size() != 1 && given.size() != indices.size())
        part.refuse(MJENV_E_SIZE,
                    std::to_string(given.size()) + " numbers, " + std::to_string(indices.size()) + " or 1 expected");
      for (std::size_t i = 0; are_deviations && i < given.size(); ++i)
        if (given[i] < 0) fail(MJENV_E_VALUE, element_is(part.place, i, given[i]) + ", but must not be negative");
      for (std::size_t i = 0; i < indices.size(); ++i) found[indices[i]] = given.size() == 1 ? given[0] : given[i];
    });
    if (std::all_of(found.begin(), found.end(), [](double one) { return one == 0; })) return {};
    return found;
  }
  // A pair [least, most], or one integer for both.
  std::pair<std::int64_t, std::int64_t> range() const {
    const std::vector<std::int64_t> found = integers();
    if (found.size() != 1 && found.size() != 2) refuse_kind("an integer, or a pair [least, most],");
    if (found.front() > found.back()) refuse(MJENV_E_VALUE, "the pair is in the wrong order");
    return {found.front(), found.back()};
  }
  // Three pairs [low, high].
  void bounds(double* low, double* high) const {
    if (!json) return;
    const std::vector<Value> pairs = several();
    if (json->kind != Json::Kind::list || pairs.size() != 3) refuse_kind("a list of three pairs [low, high]");
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const std::vector<double> pair = pairs[i].numbers();
      if (pair.size() != 2) pairs[i].refuse_kind("a pair [low, high]");
      low[i] = pair[0];
      high[i] = pair[1];
    }
  }
  // The number of an object, which is given by its name or number.
  std::int64_t object(const Model& model, const std::string& type) const {
    if (json->kind != Json::Kind::text) return integer();
    try {
      return model.index(type, word());
    } catch (const Error& error) {
      refuse(error.status(), error.what());
    }
  }
};

OwnArray array_of(const Model& model, const std::string& name) {
  if (StateLayout(model).part(name))
    fail(MJENV_E_NAME, "it is part of the state, but only arrays of the mjModel are drawn");
  if (!find(model.arrays(), name)) {
    const Names all = writable_names(model), likely = nearest(name, all);
    fail(MJENV_E_NAME, "mjModel has no array of this name, and only its arrays can be drawn; " +
                           (likely.empty() ? "those that can be drawn are " + listed(all)
                                           : "is one of these meant? " + listed(likely)));
  }
  return OwnArray::written(model, name);
}

// ---- Elements ----

// By what objects elements are selected: the beginning of the array's name, the type of object, and MuJoCo's array with
// the object that each row of the array belongs to, or null if row i belongs to object i.
struct Owner {
  const char *prefix, *type, *array;
};
constexpr Owner kOwners[] = {
    {"body_", "body", nullptr},     {"geom_", "geom", nullptr},         {"site_", "site", nullptr},
    {"jnt_", "joint", nullptr},     {"actuator_", "actuator", nullptr}, {"tendon_", "tendon", nullptr},
    {"dof_", "joint", "dof_jntid"}, {"geom_", "body", "geom_bodyid"},   {"site_", "body", "site_bodyid"},
    {"jnt_", "body", "jnt_bodyid"}, {"dof_", "body", "dof_bodyid"},
};
const Names kTypes{"body", "geom", "joint", "actuator", "site", "tendon"};

// The rows of the array that belong to the chosen objects.
std::vector<std::int64_t> rows_of(const Model& model, const Array& array, const std::string& type,
                                  const Value& chosen) {
  Names types;
  const Owner* owner = nullptr;
  for (const Owner& one : kOwners) {
    if (array.name.compare(0, std::string(one.prefix).size(), one.prefix) != 0) continue;
    types.emplace_back(one.type);
    if (type == one.type) owner = &one;
  }
  if (!owner)
    chosen.refuse(MJENV_E_TYPE, "elements of this array are not selected by " + type + ", but by " +
                                    (types.empty() ? "elements" : listed(types)));
  std::vector<double> owners(static_cast<std::size_t>(array.shape.at(0)));
  if (owner->array)
    find(model.arrays(), owner->array)->read(owners.data());
  else
    std::iota(owners.begin(), owners.end(), 0.0);
  std::vector<std::int64_t> rows;
  for (const Value& one : chosen.several()) {
    const auto object = static_cast<double>(one.object(model, type));
    const std::size_t before = rows.size();
    for (std::size_t i = 0; i < owners.size(); ++i)
      if (owners[i] == object) rows.push_back(static_cast<std::int64_t>(i));
    if (rows.size() == before) one.refuse(MJENV_E_VALUE, "no element belongs to this " + type);
  }
  return rows;
}

std::vector<std::size_t> elements_of(const Model& model, const Array& array, const Value& draw) {
  std::string type;
  const Value elements = draw["elements"], columns = draw["columns"];
  std::size_t given = elements ? 1 : 0;
  for (const std::string& one : kTypes)
    if (draw[one]) type = one, ++given;
  if (given > 1) draw.refuse(MJENV_E_TYPE, "give one of " + listed(kTypes) + ", elements");
  const std::size_t count = array.count();
  std::vector<std::size_t> found;
  if (elements) {
    if (columns) draw.refuse(MJENV_E_TYPE, "elements are of the flattened array, which has no columns");
    for (const Value& one : elements.several()) {
      const std::int64_t index = one.integer();
      if (index < 0 || static_cast<std::uint64_t>(index) >= count)
        one.refuse(MJENV_E_VALUE, "element " + std::to_string(index) + ", but the array has " + std::to_string(count));
      found.push_back(static_cast<std::size_t>(index));
    }
    return found;
  }
  const auto height = static_cast<std::size_t>(array.shape.empty() ? 1 : array.shape[0]);
  const std::size_t width = height == 0 ? 0 : count / height;
  std::vector<std::int64_t> rows(height), chosen(width);
  std::iota(rows.begin(), rows.end(), 0);
  std::iota(chosen.begin(), chosen.end(), 0);
  if (!type.empty()) rows = rows_of(model, array, type, draw[type]);
  if (columns) {
    chosen.clear();
    for (const Value& one : columns.several()) {
      const std::int64_t column = one.integer();
      if (array.shape.size() != 2 || column < 0 || column >= array.shape[1])
        one.refuse(MJENV_E_VALUE, "column " + std::to_string(column) + ", but the array has " +
                                      (array.shape.size() == 2 ? std::to_string(array.shape[1]) : "no") + " columns");
      chosen.push_back(column);
    }
  }
  for (const std::int64_t row : rows)
    for (const std::int64_t column : chosen)
      found.push_back(static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column));
  return found;
}

// ---- Draws ----

const Names kDistributions{"uniform", "log_uniform", "normal", "truncated_normal", "choice"};
const Names kParameters[] = {
    {"low", "high"}, {"low", "high"}, {"mean", "std"}, {"mean", "std", "low", "high"}, {"choices"}};
const Names kKinds{"value", "scale", "offset", "same"};

void take_parameters(DrawSettings& to, const Value& draw) {
  const Value name = draw["distribution"];
  std::size_t index = name ? name.one_of(kDistributions) : 0;
  if (index == 0 && draw["choices"]) index = 4;
  to.distribution = static_cast<Distribution>(index + 1);
  const Names& wanted = kParameters[index];
  Names given;
  for (const char* one : {"mean", "std", "low", "high", "choices"})
    if (draw[one]) given.emplace_back(one);
  if (given != wanted)
    draw.refuse(MJENV_E_TYPE, kDistributions[index] + " takes " + listed(wanted) + ", not " +
                                  (given.empty() ? "none of them" : listed(given)));
  for (const std::string& one : wanted) {
    if (to.distribution == Distribution::choice)
      to.parameters = draw[one].numbers();
    else
      to.parameters.push_back(draw[one].number());
  }
  if (to.parameters.empty()) draw["choices"].refuse(MJENV_E_SIZE, "there is nothing to choose from");
}

DrawSettings settings_of(const Value& draw, const std::string& name, const Model& model,
                         const std::vector<DrawSettings>& before) {
  draw.has({"kind", "low", "high", "distribution", "mean", "std", "choices", "body", "geom", "joint", "actuator",
            "site", "tendon", "elements", "columns", "shared", "set_constants", "factor"});
  DrawSettings to;
  to.place = draw.place;
  try {
    to.array = array_of(model, name);
  } catch (const Error& error) {
    draw.refuse(error.status(), error.what());
  }
  const Value kind = draw["kind"], factor = draw["factor"];
  const std::size_t index = kind ? kind.one_of(kKinds) : 0;
  to.repeats = index == 3;
  if (to.repeats) {
    if (before.empty()) draw.refuse(MJENV_E_VALUE, "it is the same as the item before, but there is none");
    to.effect = before.back().effect;
    to.distribution = before.back().distribution;
    for (const char* one : {"low", "high", "distribution", "mean", "std", "choices", "shared"})
      if (draw[one]) draw[one].refuse(MJENV_E_TYPE, "the same draws as before have none of their own");
  } else {
    to.effect = static_cast<Effect>(index + 1);
    take_parameters(to, draw);
  }
  if (factor) to.factor = factor.number();
  if (to.factor == 0) factor.refuse(MJENV_E_VALUE, "it must not be 0");
  to.elements = elements_of(model, to.array.original, draw);
  to.shared = draw["shared"].flag();
  to.constants = draw["set_constants"].flag();
  return to;
}

// ---- Pushes ----

PushSettings settings_of(const Value& push, const Model& model) {
  push.has({"body", "force", "torque", "velocity", "angular_velocity", "every", "duration"});
  PushSettings to;
  to.place = push.place;
  if (!push["body"]) push.refuse(MJENV_E_TYPE, "it has no body");
  const std::int64_t body = push["body"].object(model, "body");
  if (body < 1 || body >= model.nbody())
    push["body"].refuse(MJENV_E_VALUE,
                        "body " + std::to_string(body) + ", not 1 to " + std::to_string(model.nbody() - 1));
  to.body = static_cast<std::int32_t>(body);
  push["force"].bounds(&to.low[0], &to.high[0]);
  push["torque"].bounds(&to.low[3], &to.high[3]);
  to.is_kick = push["velocity"] || push["angular_velocity"];
  if (to.is_kick) {
    const auto is_zero = [](double one) { return one == 0; };
    if (!std::all_of(to.low.begin(), to.low.end(), is_zero) || !std::all_of(to.high.begin(), to.high.end(), is_zero))
      push.refuse(MJENV_E_VALUE, "it has either a force and a torque, or velocities; for both, give two pushes");
    to.low = to.high = {};
    push["velocity"].bounds(&to.low[0], &to.high[0]);
    push["angular_velocity"].bounds(&to.low[3], &to.high[3]);
  }
  std::tie(to.min_steps, to.max_steps) =
      push["every"] ? push["every"].range() : std::pair<std::int64_t, std::int64_t>{100, 200};
  if (push["duration"]) std::tie(to.min_duration, to.max_duration) = push["duration"].range();
  return to;
}

}  // namespace

DrawDocument::DrawDocument() : json_(std::make_shared<const Json>(parse_json("{}", "the document"))) {}

DrawDocument DrawDocument::with(const std::string& text) const {
  static const Names parts{"randomize", "noise", "delay", "push"};
  const Json given = parse_json(text.empty() ? kNothing : text, "the document");
  Value{&given, "the document"}.has(parts);
  const auto names = [&](const std::string& part) {
    return std::any_of(given.items.begin(), given.items.end(), [&](const Json& one) { return one.name == part; });
  };
  DrawDocument next;
  Json json;
  json.kind = Json::Kind::object;
  for (const std::string& part : parts) {
    const bool replaces = names(part);
    if (replaces) (part == parts[0] ? next.replaces_draws_ : next.replaces_perturbation_) = true;
    if (const Json* from = (replaces ? given : *json_).find(part)) json.items.push_back(*from);
  }
  next.text_ = written(json);
  next.json_ = std::make_shared<const Json>(std::move(json));
  return next;
}

std::vector<DrawSettings> DrawDocument::draws(const Model& model) const {
  const Value all = Value{json_.get(), ""}["randomize"];
  std::vector<DrawSettings> found;
  if (!all) return found;
  if (all.json->kind != Json::Kind::object) all.refuse_kind("an object with the names of arrays");
  for (const Json& array : all.json->items)
    for (const Value& draw : Value{&array, all.place + "." + array.name}.several()) {
      if (found.size() == kMaxItems) all.refuse(MJENV_E_SIZE, "there are more than " + std::to_string(kMaxItems));
      found.push_back(settings_of(draw, array.name, model, found));
    }
  return found;
}

PerturbationSettings DrawDocument::perturbation(const Model& model, const std::vector<Field>& actions,
                                                const std::vector<Field>& observations) const {
  const Value root{json_.get(), ""}, noise = root["noise"], delay = root["delay"];
  noise.has({"action", "observation", "distribution"});
  delay.has({"action", "observation", "first_action", "first_observation", "redraw"});
  PerturbationSettings to;
  to.action_noise = noise["action"].numbers_for(actions, true);
  to.observation_noise = noise["observation"].numbers_for(observations, true);
  to.noise_is_uniform = noise["distribution"] && noise["distribution"].one_of({"normal", "uniform"}) == 1;
  to.first_action = delay["first_action"].numbers_for(actions, false);
  to.begins_with_own = delay["first_observation"] && delay["first_observation"].one_of({"zero", "reset"}) == 1;
  const auto delay_of = [](const Value& given) {
    DelaySettings one;
    std::tie(one.least, one.most) = given.range();
    for (const std::int64_t steps : {one.least, one.most}) check_range(given.place.c_str(), steps, 0, kMaxDelay);
    one.is_drawn = given.json->items.size() == 2 && one.most != 0;
    return one;
  };
  if (delay["action"]) to.action_delay = delay_of(delay["action"]);
  to.is_delayed.resize(static_cast<std::size_t>(total(observations)));
  delay["observation"].for_each_part(observations, [&](const Value& part, const std::vector<std::size_t>& indices) {
    const DelaySettings one = delay_of(part);
    DelaySettings& all = to.observation_delay;
    if (one.most == 0) return;
    if (all.most != 0 && std::tie(one.least, one.most, one.is_drawn) != std::tie(all.least, all.most, all.is_drawn))
      part.refuse(MJENV_E_VALUE, "all terms that are delayed must have the same delay");
    all = one;
    for (const std::size_t index : indices) to.is_delayed[index] = true;
  });
  if (delay["redraw"]) to.redraws_delays = delay["redraw"].one_of({"reset", "step"}) == 1;
  for (const Value& push : root["push"].several()) to.pushes.push_back(settings_of(push, model));
  return to;
}

}  // namespace mjenv::core
