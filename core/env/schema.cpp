#include "env/schema.hpp"

#include <sstream>

#include "error.hpp"
#include "task/options.hpp"

namespace mjenv::core {
namespace {

std::vector<Field> fields_of(mjenv_role role, const std::vector<Array>& arrays) {
  std::vector<Field> fields;
  for (const auto& a : arrays)
    fields.push_back({role, a.name, "", a.type, a.shape, 0, static_cast<std::int64_t>(a.count())});
  return fields;
}

}  // namespace

Schema::Schema(const Task& task, const Frames& frames, const ActionTransform& transform, const Options& options,
               const Work& work)
    : frames_(frames), fields_(task.fields), max_contacts_(options.get("max_contacts").integer) {
  fields_[MJENV_ROLE_GROUPS] = frames.keys();
  observation_count_ = total(frames.fields());
  const Model& model = *task.model;
  fields_[MJENV_ROLE_MODEL] = fields_of(MJENV_ROLE_MODEL, model.arrays());
  for (std::int64_t i = 0; i < task.action_count(); ++i)
    fields_[MJENV_ROLE_ACTION].push_back({MJENV_ROLE_ACTION, task.action_label(i), "", MJENV_DTYPE_ACTION, {}, i, 1});
  action_space_ = {transform.low(), transform.high(), {task.action_count()}};
  const std::vector<Array> arrays = work.arrays();
  fields_[MJENV_ROLE_DATA] = fields_of(MJENV_ROLE_DATA, arrays);
  choose_exported(options.get("arrays").text, arrays);
}

void Schema::choose_exported(const std::string& names, const std::vector<Array>& arrays) {
  std::istringstream words(names);
  for (std::string name; words >> name;) {
    const Array* found = find(arrays, name);
    if (!found) {
      std::vector<std::string> known;
      for (const auto& a : arrays) known.push_back(a.name);
      fail(MJENV_E_NAME,
           "option \"arrays\": no array " + quoted(name) + choices(name, known, "mjenv_field_at with MJENV_ROLE_DATA"));
    }
    exported_.push_back(static_cast<std::size_t>(found - arrays.data()));
    std::vector<Field>& list = fields_[MJENV_ROLE_ARRAYS];
    const Array array = with_contacts(*found, max_contacts_);
    const auto count = static_cast<std::int64_t>(array.count());
    list.push_back({MJENV_ROLE_ARRAYS, name, "", array.type, array.shape, total(list), count});
    exports_on_demand_ = exports_on_demand_ || (part_of(name) & Lag::on_demand);
  }
}

const std::vector<Field>& Schema::fields(mjenv_role role) const {
  if (role == MJENV_ROLE_OBSERVATION) return frames_.fields();
  if (role > MJENV_ROLE_OBSERVATION && role <= MJENV_ROLE_GROUPS) return fields_[role];
  fail(MJENV_E_ARGUMENT, "role is " + std::to_string(role) + ", which is not an mjenv_role");
}

std::int64_t Schema::count(mjenv_role role) const { return total(fields(role)); }

void Schema::check(const mjenv_batch& out, std::int64_t rows, std::int64_t observation_count) const {
  if (out.struct_size == 0) return;  // the caller gave no batch
  check_count("rows", out.rows, rows);
  if (out.obs || out.final_obs) {
    check_count("obs_count", out.obs_count, observation_count);
    if (out.obs_dtype != MJENV_DTYPE_FLOAT64 && out.obs_dtype != MJENV_DTYPE_FLOAT32)
      fail(MJENV_E_ARGUMENT,
           "obs_dtype is " + std::to_string(out.obs_dtype) + ", not MJENV_DTYPE_FLOAT64 or MJENV_DTYPE_FLOAT32");
  }
  if (out.info) check_count("info_count", out.info_count, count(MJENV_ROLE_INFO));
  if (out.final_info && !out.info)
    fail(MJENV_E_ARGUMENT, "final_info is given, but info is NULL: the numbers of final_info are copied from info");
  if (out.reset_info) check_count("reset_info_count", out.reset_info_count, count(MJENV_ROLE_RESET_INFO));
  if (out.arrays) check_count("arrays_count", out.arrays_count, count(MJENV_ROLE_ARRAYS));
}

}  // namespace mjenv::core
