#include "env/lane_choice.hpp"

#include <algorithm>

#include "engine/lanes/frame/stepper.hpp"
#include "error.hpp"
#include "system/platform.hpp"

namespace mjenv::core {
namespace {

constexpr const char* kVariable = "MJENV_LANES";

std::string counted(std::int64_t count, const std::string& what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

// Why lanes cannot be used with this task at all; "" if they can.
std::string obstacle_of(const Task& task) {
  std::string absence = lanes::absence();
  if (!absence.empty()) return absence;
  const std::string obstacle = lanes::obstacle(*task.model);
  return obstacle.empty() ? "" : "lanes cannot compute this model: " + obstacle;
}

LaneChoice best(const Task& task, std::int64_t rows, int threads, int most) {
  if (std::string obstacle = obstacle_of(task); !obstacle.empty()) return {0, std::move(obstacle)};
  const int width = lanes::best_width(*task.model, rows / threads, most);
  if (width > 0) return {width, ""};
  if (rows == 1) return {0, "the environment has only one row"};
  return {0, "the environment has only " + counted(rows, "row") + " for " + counted(threads, "thread")};
}

}  // namespace

LaneChoice choose_lanes(const Options& options, const Task& task, std::int64_t rows, int threads) {
  const Option& option = options.get("lanes");
  const bool is_explicit = option.given_as_integer;
  const std::string source = is_explicit ? "option \"lanes\"" : std::string("environment variable ") + kVariable;
  const std::string chosen =
      is_explicit ? std::to_string(option.integer) : platform::environment(kVariable).value_or("");
  if (chosen.empty()) {
    const bool is_auto = option.text == "auto";
    return best(task, rows, threads, is_auto ? lanes::kThriftyWidth : lanes::kWidths.back());
  }
  if (chosen == "0") return {0, "the " + source + " is 0"};
  const auto refuse = [&](const std::string& why) { fail(MJENV_E_VALUE, source + " is " + chosen + ", but " + why); };
  const auto find = [&](const std::vector<int>& widths) {
    const auto found = std::find_if(widths.begin(), widths.end(), [&](int w) { return std::to_string(w) == chosen; });
    return found == widths.end() ? 0 : *found;
  };
  std::vector<int> widths = lanes::widths();
  int width = find(widths);
  if (width == 0 && !widths.empty()) {
    std::vector<std::string> names{"0"};
    for (const int w : widths) names.push_back(std::to_string(w));
    refuse("this CPU supports " + listed(names));
  }
  if (width == 0 && find(lanes::kWidths) == 0) refuse("lanes are 0, 2, 4 or 8");
  std::string why = obstacle_of(task);
  if (why.empty() && rows < width) why = "the environment has only " + counted(rows, "row");
  if (why.empty()) return {width, ""};
  if (is_explicit) refuse(why + "; \"auto\" takes only as many lanes as this environment can use");
  return {0, std::move(why)};
}

}  // namespace mjenv::core
