#include "policy.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "chars.hpp"
#include "error.hpp"

namespace mjenv::learn {
namespace {

constexpr std::string_view kOldHead = "mjenv-policy 1", kHead = "mjenv-policy 2";

// The shortest text that reads as this float32.
std::string number32(float value) {
#if defined(__cpp_lib_to_chars)
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
#else
  return core::number(value);
#endif
}

void append_numbers(std::string& text, const char* name, const std::vector<double>& numbers) {
  text += name;
  for (const double value : numbers) text += ' ' + core::number(value);
  text += '\n';
}

// Scales a weight or bias of the last layer's output j to the environment's units: multiplies it by half the range of
// action j if scale_actions is set.
double scaled(const Settings& settings, const Spaces& spaces, std::size_t j, double value) {
  return settings.scale_actions ? value * 0.5 * (spaces.high[j] - spaces.low[j]) : value;
}

bool is_line(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

// Whether this can be the name of a term: task.h's names have no blanks.
bool is_name(std::string_view text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) > ' '; });
}

// The lines that say which elements of the observation the actor sees.
void append_inputs(std::string& text, const Terms& terms, const Network& actor) {
  int first = 0;
  for (const Term& term : terms) {
    const auto count = static_cast<int>(term.count);
    std::string elements;
    int seen = 0;
    for (int i = 0; i < count; ++i)
      if (actor.sees(first + i)) elements += ' ' + std::to_string(i), ++seen;
    if (seen > 0) text += "input " + term.name + ' ' + std::to_string(count) + (seen < count ? elements : "") + '\n';
    first += count;
  }
}

// A part of a text for a message, which is not to be long.
std::string shown(std::string_view text) { return core::quoted(std::string(text.substr(0, 100))); }

}  // namespace

void Description::check(std::size_t observations) const {
  if (!is_line(about)) core::fail(MJENV_E_VALUE, "about is not one line of printable ASCII");
  std::size_t count = 0;
  std::set<std::string> names;
  for (const Term& term : terms) {
    if (!is_name(term.name) || !names.insert(term.name).second)
      core::fail(MJENV_E_NAME, "a term is called " + shown(term.name) +
                                   (is_name(term.name) ? ", as another is" : ", but a name must have no blanks"));
    count += term.count;
  }
  if (!terms.empty() && count != observations)
    core::fail(MJENV_E_SIZE, "the terms have " + std::to_string(count) + " numbers, but an observation has " +
                                 std::to_string(observations));
}

std::string policy_text(const Settings& settings, const Spaces& spaces, const Network& actor, const float* parameters,
                        const std::vector<double>& mean, const std::vector<double>& scale, double clip,
                        const Description& description) {
  const bool names_inputs = !description.terms.empty();
  // Without names, all inputs are written, also those that the actor does not see, with weights of 0.
  const auto is_written = [&](int input) { return !names_inputs || actor.sees(input); };
  const auto written = [&](const std::vector<double>& numbers) {
    std::vector<double> found;
    for (std::size_t i = 0; i < numbers.size(); ++i)
      if (is_written(static_cast<int>(i))) found.push_back(numbers[i]);
    return found;
  };
  std::string text(names_inputs ? kHead : kOldHead);
  text += "\nid " + settings.id + '\n';
  if (names_inputs && !description.about.empty()) text += "about " + description.about + '\n';
  append_inputs(text, description.terms, actor);
  const std::vector<double> seen = written(mean);
  append_numbers(text, "mean", seen);
  append_numbers(text, "scale", written(scale));
  append_numbers(text, "low", spaces.low);
  append_numbers(text, "high", spaces.high);
  append_numbers(text, "clip", {clip});
  for (const Layer& layer : actor.layers()) {
    const bool last = &layer == &actor.layers().back(), scale_outputs = last && settings.scale_actions;
    const bool first = &layer == &actor.layers().front();
    const std::size_t inputs = first ? seen.size() : static_cast<std::size_t>(layer.inputs);
    text += "layer " + std::to_string(layer.outputs) + ' ' + std::to_string(inputs) + ' ';
    text += last ? "identity" : settings.activation;
    text += "\nbias";
    const float* bias = parameters + layer.bias;
    const auto append = [&](int output, float value, double offset) {
      const auto j = static_cast<std::size_t>(output);
      text += ' ';
      text += scale_outputs ? core::number(offset + scaled(settings, spaces, j, value)) : number32(value);
    };
    for (int o = 0; o < layer.outputs; ++o) {
      const auto j = static_cast<std::size_t>(o);
      append(o, bias[o], scale_outputs ? 0.5 * (spaces.high[j] + spaces.low[j]) : 0.0);
    }
    text += '\n';
    for (int o = 0; o < layer.outputs; ++o) {
      text += "weights";
      for (int i = 0; i < layer.inputs; ++i)
        if (!first || is_written(i)) append(o, parameters[layer.weight(i, o)], 0.0);
      text += '\n';
    }
  }
  return text;
}

// Parses a policy's text line by line. Messages name the line.
class Policy::Parser {
 public:
  Parser(std::string_view text, Policy& policy) : text_(text), policy_(policy) {}

  void parse() {
    if (!next() || (line_ != kHead && line_ != kOldHead)) fail("is not " + core::quoted(std::string(kHead)));
    names_inputs_ = line_ == kHead;
    if (!next() || line_.substr(0, 3) != "id ") fail("is not \"id ID\"");
    policy_.id_ = line_.substr(3);
    if (!is_id(policy_.id_)) fail("names no environment");
    while (next()) {
      if (line_.empty()) continue;
      const std::string_view name = word();
      if (name == "layer")
        begin_layer();
      else if (name == "bias")
        read_numbers(layer().bias, static_cast<std::size_t>(layer().outputs));
      else if (name == "weights")
        read_row();
      else if (name == "input" && names_inputs_)
        read_input();
      else if (name == "about" && names_inputs_)
        read_about();
      else
        read_numbers(named(name));
    }
    finish();
  }

 private:
  std::string_view text_, line_;
  Policy& policy_;
  bool names_inputs_ = false;              // the format has names, as its version 2 does
  int number_ = 0;                         // of the line
  std::set<std::string> names_;            // of the inputs so far
  std::vector<std::vector<double>> rows_;  // the lines "weights" of the present layer so far
  std::vector<double> clip_;

  [[noreturn]] void fail(const std::string& reason) const {
    core::fail(MJENV_E_VALUE, "the text is no policy: line " + std::to_string(number_) + " " + reason);
  }
  [[noreturn]] static void fail_whole(const std::string& reason) {
    core::fail(MJENV_E_VALUE, "the text is no policy: " + reason);
  }

  bool next() {
    if (text_.empty()) return false;
    const std::size_t end = std::min(text_.find('\n'), text_.size());
    line_ = text_.substr(0, end);
    if (!line_.empty() && line_.back() == '\r') line_.remove_suffix(1);
    text_.remove_prefix(std::min(text_.size(), end + 1));
    ++number_;
    return true;
  }

  std::string_view word() {
    line_.remove_prefix(std::min(line_.find_first_not_of(' '), line_.size()));
    const std::string_view found = line_.substr(0, line_.find(' '));
    line_.remove_prefix(found.size());
    return found;
  }

  double number(std::string_view text) const {
    std::size_t length = 0;
    const std::optional<double> value = core::read_double(text, &length);
    if (!value || length != text.size() || !std::isfinite(*value)) fail("has " + shown(text) + ", not a finite number");
    return *value;
  }

  // Reads the numbers of the line. There must be exactly `count`; 0: any number of them.
  void read_numbers(std::vector<double>& to, std::size_t count = 0) {
    if (!to.empty()) fail("repeats an earlier one");
    for (std::string_view text = word(); !text.empty(); text = word()) to.push_back(number(text));
    if (to.empty() || (count > 0 && to.size() != count))
      fail("has " + std::to_string(to.size()) + " numbers" + (count > 0 ? ", not " + std::to_string(count) : ""));
  }

  std::vector<double>& named(std::string_view name) {
    if (name == "mean") return policy_.mean_;
    if (name == "scale") return policy_.scale_;
    if (name == "low") return policy_.low_;
    if (name == "high") return policy_.high_;
    if (name == "clip") return clip_;
    fail("begins with " + shown(name));
  }

  PolicyLayer& layer() {
    if (policy_.layers_.empty()) fail("belongs to no layer");
    return policy_.layers_.back();
  }

  int integer(std::string_view text, int least, int most, const char* wanted) const {
    int value = 0;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
    if (read.ec != std::errc() || read.ptr != text.data() + text.size() || value < least || value > most)
      fail("has " + shown(text) + ", not " + wanted);
    return value;
  }
  int width() { return integer(word(), 1, 1 << 20, "a number of inputs or outputs"); }

  void read_about() {
    if (!policy_.about_.empty()) fail("repeats an earlier one");
    if (!is_line(line_)) fail("is not printable ASCII");
    policy_.about_ = line_.substr(std::min(line_.find_first_not_of(' '), line_.size()));
  }

  // Memory grows with the text, whatever size the term claims to have.
  void read_input() {
    Input made;
    made.name = word();
    if (!is_name(made.name)) fail("has no name without blanks");
    made.count = static_cast<std::size_t>(width());
    int least = 0;
    for (std::string_view text = word(); !text.empty(); text = word()) {
      made.elements.push_back(integer(text, least, static_cast<int>(made.count) - 1, "the next element of the term"));
      least = static_cast<int>(made.elements.back()) + 1;
    }
    if (!names_.insert(made.name).second) fail("repeats an earlier one");
    policy_.inputs_.push_back(std::move(made));
  }

  void begin_layer() {
    if (!policy_.layers_.empty()) finish_layer(false, "line " + std::to_string(number_) + " comes too early");
    PolicyLayer made{};
    made.outputs = width();
    made.inputs = width();
    made.padded_outputs = padded(made.outputs, kLaneBlock);
    const std::string_view name = word();
    made.activation = activation_named(name);
    if (made.activation == Activation::kUnknown) fail("has the unknown activation " + shown(name));
    policy_.layers_.push_back(std::move(made));
    rows_.clear();
  }

  // Memory grows with the text, whatever sizes the layer claims to have.
  void read_row() {
    const PolicyLayer& to = layer();
    std::vector<double> row;
    read_numbers(row, static_cast<std::size_t>(to.inputs));
    if (rows_.size() == static_cast<std::size_t>(to.outputs)) fail("is one line \"weights\" too many");
    rows_.push_back(std::move(row));
  }

  // why: what is wrong with the text if the layer is not complete.
  void finish_layer(bool is_last, const std::string& why) {
    PolicyLayer& done = layer();
    if (rows_.size() != static_cast<std::size_t>(done.outputs) || done.bias.empty())
      fail_whole(why + ": layer " + std::to_string(policy_.layers_.size()) + " has " + std::to_string(rows_.size()) +
                 " of " + std::to_string(done.outputs) + " lines \"weights\"" +
                 (done.bias.empty() ? " and no bias" : ""));
    // Copies the weights, also to float32, there padded and in the order that the kernels need.
    const auto inputs = static_cast<std::size_t>(done.inputs), outputs = static_cast<std::size_t>(done.outputs);
    const auto stride = static_cast<std::size_t>(done.padded_outputs);
    const auto row = static_cast<std::size_t>(done.padded_inputs());
    done.weights.resize(inputs * outputs);
    done.weights32.resize(is_last ? outputs * row : row * stride);
    done.bias32.resize(stride);
    for (std::size_t o = 0; o < outputs; ++o) {
      done.bias32[o] = static_cast<float>(done.bias[o]);
      for (std::size_t i = 0; i < inputs; ++i) {
        done.weights[i * outputs + o] = rows_[o][i];
        done.weights32[is_last ? o * row + i : i * stride + o] = static_cast<float>(rows_[o][i]);
      }
    }
  }

  void finish() {
    if (policy_.layers_.empty()) fail_whole("it has no layer");
    finish_layer(true, "it ends too early");
    if (clip_.size() != 1 || !(clip_[0] > 0)) fail_whole("clip is missing, or not one number greater than 0");
    policy_.clip_ = clip_[0];
    int before = static_cast<int>(policy_.mean_.size());
    for (std::size_t l = 0; l < policy_.layers_.size(); ++l) {
      if (policy_.layers_[l].inputs != before)
        fail_whole("layer " + std::to_string(l + 1) + " has " + std::to_string(policy_.layers_[l].inputs) +
                   " inputs, but " + (l == 0 ? "mean has " : "the layer before has ") + std::to_string(before) +
                   (l == 0 ? " elements" : " outputs"));
      before = policy_.layers_[l].outputs;
    }
    std::size_t seen = 0;
    for (const Input& input : policy_.inputs_) seen += input.elements.empty() ? input.count : input.elements.size();
    if (names_inputs_ && seen != policy_.mean_.size())
      fail_whole("mean has " + std::to_string(policy_.mean_.size()) + " elements, but the inputs have " +
                 std::to_string(seen));
    if (policy_.scale_.size() != policy_.mean_.size()) fail_whole("mean and scale have different lengths");
    if (policy_.low_.size() != policy_.high_.size() || static_cast<int>(policy_.low_.size()) != before)
      fail_whole("low or high has another length than the outputs of the last layer");
    for (std::size_t j = 0; j < policy_.low_.size(); ++j)
      if (!(policy_.low_[j] <= policy_.high_[j])) fail_whole("an element of low is greater than that of high");
    for (const double scale : policy_.scale_)
      if (!(scale > 0)) fail_whole("an element of scale is not greater than 0");
  }
};

Policy::Policy(std::string_view text) { Parser(text, *this).parse(); }

std::vector<std::size_t> Policy::find(const Terms& terms) const {
  std::size_t count = 0;
  std::vector<std::string> names;
  std::map<std::string, std::pair<std::size_t, std::size_t>> places;  // where each term begins, and its count
  std::vector<std::size_t> found;
  for (const Term& term : terms) {
    names.push_back(term.name);
    places[term.name] = {count, term.count};
    count += term.count;
  }
  const std::string policy = "the policy of " + core::quoted(id_) + " sees ";
  if (inputs_.empty()) {
    if (count != observations())
      core::fail(MJENV_E_SIZE,
                 policy + std::to_string(observations()) + " numbers, but an observation has " + std::to_string(count));
    for (std::size_t i = 0; i < count; ++i) found.push_back(i);
  }
  for (const Input& input : inputs_) {
    const auto place = places.find(input.name);
    const std::string sees = policy + core::quoted(input.name) + ", ";
    if (place == places.end())
      core::fail(MJENV_E_NAME, sees + std::to_string(input.count) + " numbers, but the observation has no such term" +
                                   core::choices(input.name, names, "mjenv_field_at with MJENV_ROLE_OBSERVATION"));
    const auto [first, size] = place->second;
    if (size != input.count)
      core::fail(MJENV_E_SIZE, sees + std::to_string(input.count) + " numbers, but this term of the observation has " +
                                   std::to_string(size));
    for (std::size_t i = 0; input.elements.empty() && i < input.count; ++i) found.push_back(first + i);
    for (const std::int64_t i : input.elements) found.push_back(first + static_cast<std::size_t>(i));
  }
  return found;
}

mjenv_policy_input Policy::input(std::int64_t index) const {
  core::check_index("input", index, inputs_.size());
  const Input& chosen = inputs_[static_cast<std::size_t>(index)];
  mjenv_policy_input input = MJENV_POLICY_INPUT_INIT;
  input.name = chosen.name.c_str();
  input.count = static_cast<std::int64_t>(chosen.count);
  input.seen = static_cast<std::int64_t>(chosen.elements.empty() ? chosen.count : chosen.elements.size());
  input.elements = chosen.elements.empty() ? nullptr : chosen.elements.data();
  return input;
}

mjenv_policy_spec Policy::spec() const {
  mjenv_policy_spec spec = MJENV_POLICY_SPEC_INIT;
  spec.layer_count = static_cast<std::int64_t>(layers_.size());
  spec.clip = clip_;
  spec.mean = mean_.data();
  spec.scale = scale_.data();
  spec.low = low_.data();
  spec.high = high_.data();
  spec.input_count = static_cast<std::int64_t>(inputs_.size());
  spec.about = about_.c_str();
  return spec;
}

mjenv_policy_layer Policy::layer(std::int64_t index) const {
  core::check_index("layer", index, layers_.size());
  const PolicyLayer& chosen = layers_[static_cast<std::size_t>(index)];
  mjenv_policy_layer layer = MJENV_POLICY_LAYER_INIT;
  layer.activation = kActivations[static_cast<std::size_t>(chosen.activation)].data();
  layer.inputs = chosen.inputs;
  layer.outputs = chosen.outputs;
  layer.weights = chosen.weights.data();
  layer.bias = chosen.bias.data();
  return layer;
}

void Policy::act(mjenv_precision precision, std::size_t rows, const double* obs, float* actions) const {
  if (precision == MJENV_PRECISION_FLOAT32)
    act32(rows, obs, actions);
  else if (precision == MJENV_PRECISION_FLOAT64)
    act64(rows, obs, actions);
  else
    core::fail(MJENV_E_VALUE, "precision is " + std::to_string(precision) +
                                  ", not MJENV_PRECISION_FLOAT64 or MJENV_PRECISION_FLOAT32");
}

// Uses the functions of the C library, as mjenv.policy in Python does.
void Policy::activate64(Activation activation, std::vector<double>& values) {
  if (activation == Activation::kTanh)
    for (double& y : values) y = std::tanh(y);
  else if (activation == Activation::kRelu)
    for (double& y : values) y = std::max(y, 0.0);
  else if (activation == Activation::kElu)
    for (double& y : values) y = y > 0 ? y : std::expm1(y);
}

void Policy::act64(std::size_t rows, const double* obs, float* actions) const {
  std::vector<double> values, next;
  for (std::size_t row = 0; row < rows; ++row, obs += observations(), actions += actuators()) {
    values.resize(observations());
    for (std::size_t j = 0; j < values.size(); ++j)
      values[j] = std::min(std::max((obs[j] - mean_[j]) / scale_[j], -clip_), clip_);
    for (const PolicyLayer& layer : layers_) {
      next = layer.bias;
      for (std::size_t i = 0; i < values.size(); ++i) {
        const double* weights = &layer.weights[i * next.size()];
        for (std::size_t o = 0; o < next.size(); ++o) next[o] += weights[o] * values[i];
      }
      activate64(layer.activation, next);
      std::swap(values, next);
    }
    for (std::size_t j = 0; j < values.size(); ++j)
      actions[j] = static_cast<float>(std::min(std::max(values[j], low_[j]), high_[j]));
  }
}

// Computes the actions as a learner computes their means.
void Policy::act32(std::size_t rows, const double* obs, float* actions) const {
  const Kernels& kernels = chosen_kernels();
  const int count = padded(static_cast<int>(rows), kRowBlock);
  int stride = padded(static_cast<int>(observations()), kLaneBlock);
  std::vector<float> values(static_cast<std::size_t>(count) * stride), next;
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < observations(); ++j) {
      const double x = (obs[i * observations() + j] - mean_[j]) * (1 / scale_[j]);
      values[i * static_cast<std::size_t>(stride) + j] = static_cast<float>(std::min(clip_, std::max(-clip_, x)));
    }
  for (const PolicyLayer& layer : layers_) {
    const float *weights = layer.weights32.data(), *bias = layer.bias32.data();
    next.resize(static_cast<std::size_t>(count) * layer.padded_outputs);
    if (&layer == &layers_.back())
      kernels.dots(values.data(), count, stride, weights, layer.outputs, bias, layer.padded_outputs, next.data());
    else
      kernels.product(values.data(), stride, count, stride, weights, layer.padded_outputs, bias, next.data());
    stride = layer.padded_outputs;
    if (layer.activation != Activation::kIdentity) kernels.activate(layer.activation, next.data(), next.size());
    std::swap(values, next);
  }
  for (std::size_t i = 0; i < rows; ++i)
    for (std::size_t j = 0; j < actuators(); ++j)
      actions[i * actuators() + j] = static_cast<float>(
          std::min<double>(std::max<double>(values[i * static_cast<std::size_t>(stride) + j], low_[j]), high_[j]));
}

void evaluate_policy(Environment& env, const Policy& policy, mjenv_precision precision, std::uint64_t seed,
                     std::int64_t episodes, double* returns, std::int64_t* lengths) {
  constexpr std::int64_t kLongest = 10'000'000;  // steps
  const std::vector<std::size_t> places = policy.find(env.terms());
  if (env.spaces().actuators != policy.actuators())
    core::fail(MJENV_E_SIZE, "the policy of " + core::quoted(policy.id()) + " has " +
                                 std::to_string(policy.actuators()) + " actuators, the environment " +
                                 std::to_string(env.spaces().actuators));
  const auto rows = static_cast<std::size_t>(env.rows());
  std::vector<std::int64_t> episode(rows), length(rows);
  std::vector<double> total(rows);
  std::vector<std::uint8_t> playing(rows), begins(rows);
  std::vector<std::uint64_t> seeds(rows);
  std::vector<double> seen(rows * places.size());
  std::vector<float> actions(rows * policy.actuators());
  // The rows as they are now. An episode may leave things that a reset keeps, such as values that it has drawn.
  std::vector<std::vector<std::byte>> images(rows);
  for (std::size_t row = 0; row < rows; ++row) env.save(images[row], static_cast<std::int64_t>(row));
  std::int64_t next = 0;
  const auto begin = [&](std::size_t row) {
    playing[row] = begins[row] = next < episodes;
    if (begins[row] == 0) return;
    env.restore(images[row].data(), images[row].size(), static_cast<std::int64_t>(row));
    seeds[row] = seed + static_cast<std::uint64_t>(next);
    episode[row] = next++;
    total[row] = 0;
    length[row] = 0;
  };
  const auto any = [](const std::vector<std::uint8_t>& mask) {
    return std::any_of(mask.begin(), mask.end(), [](std::uint8_t element) { return element != 0; });
  };
  for (std::size_t row = 0; row < rows; ++row) begin(row);
  while (any(playing)) {
    if (any(begins)) {
      env.seed(seeds, begins.data());
      env.reset(begins.data());
      std::fill(begins.begin(), begins.end(), std::uint8_t{0});
    }
    const Outcome outcome = env.outcome();
    for (std::size_t row = 0; row < rows; ++row)
      for (std::size_t j = 0; j < places.size(); ++j)
        seen[row * places.size() + j] = outcome.obs[row * env.spaces().observations + places[j]];
    policy.act(precision, rows, seen.data(), actions.data());
    env.step(actions, playing.data());
    for (std::size_t row = 0; row < rows; ++row) {
      if (playing[row] == 0) continue;
      total[row] += outcome.reward[row];
      if (++length[row] > kLongest)
        core::fail(MJENV_E_VALUE, "episode " + std::to_string(episode[row]) + " does not end within " +
                                      std::to_string(kLongest) + " steps");
      if (outcome.terminated[row] == 0 && outcome.truncated[row] == 0) continue;
      if (returns) returns[episode[row]] = total[row];
      if (lengths) lengths[episode[row]] = length[row];
      begin(row);
    }
  }
}

}  // namespace mjenv::learn
