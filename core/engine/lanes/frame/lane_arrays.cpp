#include "engine/lanes/frame/lane_arrays.hpp"

#include <algorithm>
#include <cmath>

namespace mjenv::core::lanes {
namespace {

// A number of mjOption, or the first of several.
const double* first(const double& number) { return &number; }
template <std::size_t count>
const double* first(const double (&numbers)[count]) {
  return numbers;
}

bool is_moderate(const mjtNum* numbers, std::ptrdiff_t count) {
  return std::all_of(numbers, numbers + count, [](mjtNum x) { return std::fabs(x) <= mjMAXVAL; });
}

}  // namespace

LaneArrays::LaneArrays(const mjModel& m, unsigned by_rows) : m_(m) {
  const auto add = [&](double* Lanes::*array, int count) {
    counts_.emplace_back(array, static_cast<std::size_t>(count));
  };
  const auto add_of_data = [&](const LaneArray& array, unsigned writers, unsigned readers) {
    add(array.numbers, array.count);
    longest_ = std::max(longest_, array.count);
    for (std::size_t party = 0; party < kParties && array.count > 0; ++party) {
      if (writers >> party & 1) written_[party].push_back(array);
      if (readers >> party & 1 && !(writers & by_rows)) read_[party].push_back(array);
    }
  };
#define MJENV_ARRAY(name, count) add(&Lanes::name, count);
  MJENV_LANES_RESULTS(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, limit) \
  own_.push_back({&Lanes::name, [](const mjModel& of) -> const mjtNum* { return of.name; }, static_cast<int>(count)});
  MJENV_LANES_OWN(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, limit) \
  own_.push_back({&Lanes::name, [](const mjModel& of) { return first(of.opt.name); }, count});
  MJENV_LANES_OWN_OPTIONS(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, limit) \
  frames_.push_back(                    \
      {&Lanes::name, [](const mjModel& of) -> const mjtNum* { return of.name; }, static_cast<int>(count)});
  MJENV_LANES_OWN_FRAMES(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, limit)                                                                        \
  flags_.push_back({&Lanes::name, [](const mjModel& of) { return reinterpret_cast<const mjtByte*>(of.name); }, \
                    static_cast<int>(count)});
  MJENV_LANES_OWN_FLAGS(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, writers, readers) \
  add_of_data({&Lanes::name, &mjData::name, static_cast<int>(count)}, writers, readers);
  MJENV_LANES_DATA(MJENV_ARRAY)
#undef MJENV_ARRAY
  for (const auto* list : {&own_, &frames_})
    for (const OwnNumbers& own : *list) add(own.numbers, own.count);
  for (const OwnFlags& own : flags_) add(own.numbers, own.count);
}

std::string excessive_array(const mjModel& m) {
#define MJENV_ARRAY(name, count, limit) \
  if (limit == kModerate && !is_moderate(m.name, count)) return #name;
  MJENV_LANES_OWN(MJENV_ARRAY)
  MJENV_LANES_OWN_FRAMES(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, limit) \
  if (limit == kModerate && !is_moderate(first(m.opt.name), count)) return "opt." #name;
  MJENV_LANES_OWN_OPTIONS(MJENV_ARRAY)
#undef MJENV_ARRAY
  return "";
}

}  // namespace mjenv::core::lanes
