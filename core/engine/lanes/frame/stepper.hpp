// Steps several rows of one model at once, in the lanes of the CPU's vector unit. The results are those of MuJoCo, bit
// for bit. docs/lanes.md explains how.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/model.hpp"
#include "engine/work.hpp"

namespace mjenv::core::lanes {

// The numbers of lanes that instruction sets have, on any CPU.
inline const std::vector<int> kWidths{2, 4, 8};
// The numbers of lanes that this CPU can use, in ascending order; empty if the library has no lane code.
std::vector<int> widths();
// Why the library has no lane code, "" if it has.
std::string absence();

// The feature that keeps the model out of lanes; "" if there is none.
std::string obstacle(const Model& model);
// A line for each stage of a step: its name, and how it is computed. "" if the library has no lane code.
std::string stage_lines(const Model& model);

// The most lanes that the option "lanes" chooses at its default -1: eight lanes are only about a quarter faster than
// four, and each lane takes the memory of an mjData.
constexpr int kThriftyWidth = 4;

// How many lanes, at most `most`, a thread should use to step its rows; 0: it should step them one by one.
int best_width(const Model& model, std::int64_t rows, int most);

class Stepper {
 public:
  virtual ~Stepper() = default;

  // Advances `count` work spaces, at most as many as there are lanes, by `frames` calls of mj_step. Call Work::act for
  // each of them first, and Work::use with the same arrays for all or for none. `before` receives the state of each
  // before the last mj_step. before_substep: null, or a function that is called before each mj_step with the index of
  // each work space and the number of the mj_step. It may write ctrl and forces. Returns, as bits, the work spaces that
  // are now as Work::step leaves them. The others met numbers or cases that are left to MuJoCo's own code: load them
  // again and step them one by one.
  using BeforeSubstep = std::function<void(int, std::int64_t)>;
  virtual std::uint32_t step(Work* const* works, int count, std::int64_t frames, double* const* before,
                             const BeforeSubstep* before_substep = nullptr) = 0;
  // Calls mj_forward for `count` loaded work spaces in the same way. The others are as after Work::forward, except what
  // lags (Work::lag).
  virtual std::uint32_t forward(Work* const* works, int count) = 0;
};

// How much memory the large arrays of a stepper take.
std::size_t stepper_bytes(const Model& model, int width);

// The functions of the instruction set with this number of lanes, which must be one of widths().
struct Code;
const Code* code_of(int width);

// The model must have no obstacle. The code must outlive the stepper.
std::unique_ptr<Stepper> make_stepper(const Model& model, const Code& code);

}  // namespace mjenv::core::lanes
