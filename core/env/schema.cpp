#include "env/schema.hpp"

#include <algorithm>
#include <sstream>

#include "error.hpp"
#include "task/options.hpp"

namespace mjenv::core {
namespace {

void append(std::vector<Field>& fields, const std::string& name, mjenv_type type, std::vector<std::int64_t> shape,
            std::int64_t count) {
  fields.push_back({name, "", type, std::move(shape), total(fields), count});
}

std::vector<Field> fields_of(const std::vector<Array>& arrays) {
  std::vector<Field> fields;
  for (const auto& a : arrays) fields.push_back({a.name, "", a.type, a.shape, 0, static_cast<std::int64_t>(a.count())});
  return fields;
}

}  // namespace

Schema::Schema(const Task& task, const std::string& exported, const Work& work)
    : observation_(task.fields.observation),
      info_(task.fields.info),
      reset_info_(task.fields.reset_info),
      reward_(task.fields.reward),
      structure_(task.fields.structure),
      model_(fields_of(task.model->arrays())),
      observation_count_(total(observation_)) {
  const Model& model = *task.model;
  for (int i = 0; i < model.nu(); ++i) action_.push_back({model.actuator_label(i), "", MJENV_TYPE_ACTION, {}, i, 1});
  action_space_ = {model.action_low(), model.action_high()};
  const auto count = static_cast<std::size_t>(observation_count_);
  observation_space_ = {std::vector<double>(count, -kInfinity), std::vector<double>(count, kInfinity)};
  const std::vector<Array> arrays = work.arrays();
  data_ = fields_of(arrays);
  choose_exported(exported, arrays);
}

void Schema::choose_exported(const std::string& names, const std::vector<Array>& arrays) {
  std::istringstream words(names);
  for (std::string name; words >> name;) {
    const auto found = std::find_if(arrays.begin(), arrays.end(), [&](const Array& a) { return a.name == name; });
    if (found == arrays.end()) {
      std::vector<std::string> known;
      for (const auto& a : arrays) known.push_back(a.name);
      fail(MJENV_E_NAME, "option \"arrays\": no array " + quoted(name) + "; there are " + listed(known));
    }
    exported_.push_back(static_cast<std::size_t>(found - arrays.begin()));
    append(arrays_, name, found->type, found->shape, static_cast<std::int64_t>(found->count()));
    exports_on_demand_ = exports_on_demand_ || is_on_demand(name);
  }
}

const std::vector<Field>& Schema::fields(mjenv_role role) const {
  switch (role) {
    case MJENV_ROLE_OBSERVATION: return observation_;
    case MJENV_ROLE_ACTION: return action_;
    case MJENV_ROLE_INFO: return info_;
    case MJENV_ROLE_RESET_INFO: return reset_info_;
    case MJENV_ROLE_REWARD: return reward_;
    case MJENV_ROLE_STRUCTURE: return structure_;
    case MJENV_ROLE_DATA: return data_;
    case MJENV_ROLE_MODEL: return model_;
    case MJENV_ROLE_ARRAYS: return arrays_;
  }
  fail(MJENV_E_ARGUMENT, "no role " + std::to_string(role));
}

std::int64_t Schema::count(mjenv_role role) const { return total(fields(role)); }

void Schema::check(const mjenv_batch& out, std::int64_t rows) const {
  if (out.struct_size == 0) return;  // the caller gave no batch
  check_count("rows", out.rows, rows);
  if (out.obs || out.final_obs) check_count("obs_count", out.obs_count, observation_count_);
  if (out.info) check_count("info_count", out.info_count, total(info_));
  if (out.final_info && !out.info)
    fail(MJENV_E_ARGUMENT, "final_info is given, but info is NULL: the numbers of final_info are copied from info");
  if (out.reset_info) check_count("reset_info_count", out.reset_info_count, total(reset_info_));
  if (out.arrays) check_count("arrays_count", out.arrays_count, total(arrays_));
  if (out.obs_dtype != MJENV_DTYPE_FLOAT64 && out.obs_dtype != MJENV_DTYPE_FLOAT32)
    fail(MJENV_E_ARGUMENT,
         "obs_dtype is " + std::to_string(out.obs_dtype) + ", not MJENV_DTYPE_FLOAT64 or MJENV_DTYPE_FLOAT32");
}

}  // namespace mjenv::core
