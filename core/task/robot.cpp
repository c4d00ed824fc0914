#include "task/robot.hpp"

#include "engine/assets.hpp"
#include "error.hpp"

namespace mjenv::core {
namespace {

// A reset draws from [-noise, noise], so 2 * noise must be finite.
constexpr double kMaxNoise = std::numeric_limits<double>::max() / 2;

std::string sizes(int nq, int nv) {
  return std::to_string(nq) + " positions and " + std::to_string(nv) + " velocities";
}

}  // namespace

void Info::add_field(const char* name, mjenv_type type, std::vector<std::int64_t> shape) {
  const std::int64_t offset = found_->empty() ? 0 : found_->back().offset + found_->back().count;
  const std::int64_t count = shape.empty() ? 1 : shape[0];
  found_->push_back({name, "", type, std::move(shape), offset, count});
}

void Info::refuse(const char* name, std::int64_t count) const {
  const auto text = [](const std::string& field, std::int64_t numbers) {
    return quoted(field) + " (" + std::to_string(numbers) + " number(s))";
  };
  fail(MJENV_E_INTERNAL, "the info must have the same fields in each call, but " +
                             (name ? text(name, count) + " was written" : std::string("it ended")) + " where " +
                             (field_ == end_ ? "the end" : text(field_->name, field_->count)) + " was expected");
}

Robot& Robot::open(const std::string& xml_file) {
  if (build_ == Build::task) task_.model = Model::open(xml_file, takes_xml_ && trusts_xml());
  return *this;
}

Robot& Robot::xml_file(const char* name) {
  takes_xml_ = true;
  task_.model_xml = asset_text(name);
  const Option& file = declare_model(options_, name);
  if (build_ == Build::options) return *this;
  const auto& text = options_.get("xml_string").text;
  if (text.empty()) return open(file.text);
  task_.model = Model::parse("xml_string", text, trusts_xml());
  return *this;
}

Robot& Robot::model(const char* name) {
  if (v5) return xml_file(name);
  task_.model_xml = asset_text(name);
  return open(name);
}

Robot& Robot::frame_skip(int count) {
  task_.frame_skip = count;
  if (v5)
    task_.frame_skip = static_cast<int>(
        options_.integer("frame_skip", count, 1, kMaxFrameSkip, "how many mj_steps make a step").integer);
  return *this;
}

Robot& Robot::needs(int nq, int nv) {
  if (const auto& m = task_.model; m && (m->nq() < nq || m->nv() < nv))
    fail(MJENV_E_MODEL, options_.id() + " needs a model with at least " + sizes(nq, nv) + "; " + quoted(m->label()) +
                            " has " + sizes(m->nq(), m->nv()));
  return *this;
}

Robot& Robot::needs_exactly(int nq, int nv) {
  if (const auto& m = task_.model; m && (m->nq() != nq || m->nv() != nv))
    fail(MJENV_E_MODEL, options_.id() + " needs a model with " + sizes(nq, nv) + "; " + quoted(m->label()) + " has " +
                            sizes(m->nq(), m->nv()));
  return *this;
}

Real Robot::real(const char* name, double value, const char* doc) {
  const Option& option = options_.reals(name, {value}, doc);
  return {option.reals[0], option.given_as_integer};
}

std::array<double, 2> Robot::range(const char* name, std::array<double, 2> value, const char* doc) {
  const Option& option = options_.reals(name, {value[0], value[1]}, doc);
  return {option.reals[0], option.reals[1]};
}

bool Robot::flag(const char* name, bool value, const char* doc) { return options_.flag(name, value, doc).integer != 0; }

double Robot::noise(double value) {
  return options_.reals("reset_noise_scale", {value}, "spread of the random initial state", 0, kMaxNoise).reals[0];
}

int Robot::body_option(const char* name, int value, const char* doc) {
  const Option& option = options_.text_or_index(name, value, doc);
  if (!task_.model) return 0;
  if (!option.given_as_integer) return body(option.text.c_str());
  if (option.integer >= task_.model->nbody())
    fail(MJENV_E_MODEL, "option " + quoted(name) + " is " + std::to_string(option.integer) + ", but model " +
                            quoted(task_.model->label()) + " has " + std::to_string(task_.model->nbody()) + " bodies");
  return static_cast<int>(option.integer);
}

np::Norm Robot::norm() {
  const std::string choice = build_ == Build::options ? "auto" : options_.get("norm").text;
  task_.norm = choice == "auto" ? np::norm_as_numpy_here() : np::Norm(choice == "fused");
  return *task_.norm;
}

int Robot::body(const char* name) const {
  if (!task_.model) return 0;
  try {
    return task_.model->index("body", name);
  } catch (const Error& error) {
    fail(MJENV_E_MODEL, options_.id() + " needs a body that the model lacks: " + error.what());
  }
}

int Robot::site(int index) const {
  if (task_.model && task_.model->count("site") <= index)
    fail(MJENV_E_MODEL, options_.id() + " needs site " + std::to_string(index) + "; model " +
                            quoted(task_.model->label()) + " has " + std::to_string(task_.model->count("site")) +
                            " site(s)");
  return index;
}

const Option& declare_model(Options& options, const char* xml_file) {
  return options.text("xml_file", xml_file,
                      "a built-in model (\"hopper.xml\"), or the path of an MJCF file, which begins with ./, / or ~",
                      "", Scope::service);
}

void declare_common(Options& options, bool takes_xml, std::int64_t time_limit) {
  constexpr std::int64_t max = (std::int64_t{1} << 53) - 1;  // the bounds are doubles
  // xml_string, trust_xml and norm have Scope::service, because an image's identity contains the model and the
  // rounding.
  if (takes_xml) {
    options.text("xml_string", "", "the text of an MJCF model, instead of xml_file; empty: xml_file is used", "",
                 Scope::service);
    options.flag(
        "trust_xml", false,
        "let the model be of any size and read any file; otherwise its size is limited, and it reads files only in its "
        "folder (xml_string: none)",
        Scope::service);
  }
  options.integer("max_episode_steps", time_limit, 0, max,
                  "the number of steps after which an episode is truncated; 0: never");
  options.text(
      "norm", "auto",
      "how Euclidean norms are rounded: as NumPy does on CPUs with AVX-512 (fused), on others (plain), or here (auto)",
      "auto fused plain", Scope::service);
}

void Robot::observe_nothing(const char* name) {
  task_.terms.push_back({name, [](const Sim&, double*) { return Eigen::Index{0}; }});
}

void Robot::structure(int skipped_qpos) {
  task_.has_structure = v5;
  task_.skipped_qpos = skipped_qpos;
}

}  // namespace mjenv::core
