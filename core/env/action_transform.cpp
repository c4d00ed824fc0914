#include "env/action_transform.hpp"

#include <cmath>
#include <string>

#include "error.hpp"

namespace mjenv::core {

void declare_action_options(Options& options) {
  options.flag(
      "clip_actions", false,
      "clip actions to the bounds of the action space, and let the space have no bounds: Gymnasium's ClipAction");
  options.reals("rescale_actions", {0, 0},
                "the lowest and the highest action, which are scaled to the bounds of each actuator: Gymnasium's "
                "RescaleAction; both equal: actions are not rescaled");
}

ActionTransform::ActionTransform(const Options& options, const Task& task)
    : clips_(options.get("clip_actions").integer != 0),
      rescales_(false),
      low_(task.action.low),
      high_(task.action.high) {
  const std::vector<double>& range = options.get("rescale_actions").reals;
  rescales_ = range[0] != range[1];
  clip_low_.assign(low_.begin(), low_.end());
  clip_high_.assign(high_.begin(), high_.end());
  if (rescales_) {
    // Computes in the same types as Gymnasium's rescale_box does in NumPy: first long double, then float32.
    const double low = range[0], high = range[1];
    if (!(low < high) || !std::isfinite(low) || !std::isfinite(high))
      fail(MJENV_E_VALUE, "option \"rescale_actions\" is (" + number(low) + ", " + number(high) +
                              "), but must be finite, and the lowest action below the highest");
    for (std::size_t i = 0; i < low_.size(); ++i) {
      if (!(clip_low_[i] < clip_high_[i]) || !std::isfinite(clip_low_[i]) || !std::isfinite(clip_high_[i]))
        fail(MJENV_E_MODEL, "option \"rescale_actions\" is set, but " +
                                task.action_label(static_cast<std::int64_t>(i)) + " has the bounds " +
                                number(clip_low_[i]) + " and " + number(clip_high_[i]) +
                                ", to which no action can be rescaled");
      const long double extent = static_cast<long double>(clip_high_[i]) - static_cast<long double>(clip_low_[i]);
      gradient_.push_back(static_cast<float>((high - low) / extent));
      const float start = gradient_[i] * -clip_low_[i];
      intercept_.push_back(static_cast<float>(start + low));
    }
    low_.assign(low_.size(), low);
    high_.assign(high_.size(), high);
    clip_low_.assign(low_.begin(), low_.end());
    clip_high_.assign(high_.begin(), high_.end());
  }
  if (!clips_) return;
  low_.assign(low_.size(), -kInfinity);
  high_.assign(high_.size(), kInfinity);
}

template <typename Number>
Number ActionTransform::transformed(Number value, std::size_t i) const {
  if (clips_) {  // NaN stays NaN; a number equal to a bound becomes the bound, as in NumPy (-0 or 0)
    const Number low = clip_low_[i], high = clip_high_[i];
    if (!std::isnan(value) && !(value > low)) value = low;
    if (!std::isnan(value) && !(value < high)) value = high;
  }
  if (rescales_) value = (value - intercept_[i]) / gradient_[i];
  return value;
}

double ActionTransform::at(const Action& action, std::int64_t i) const {
  const std::size_t index = static_cast<std::size_t>(i) % clip_low_.size();
  return action.dtype == MJENV_DTYPE_FLOAT32 ? transformed(action.floats()[i], index)
                                             : transformed(action.doubles()[i], index);
}

Action ActionTransform::apply(const Action& action, std::vector<double>& scratch) const {
  const auto transform = [&](const auto* from, auto* to) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(action.count); ++i) to[i] = transformed(from[i], i);
  };
  if (action.dtype == MJENV_DTYPE_FLOAT32)
    transform(action.floats(), reinterpret_cast<float*>(scratch.data()));
  else
    transform(action.doubles(), scratch.data());
  return {scratch.data(), action.dtype, action.count};
}

}  // namespace mjenv::core
