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

// How many lanes a stepper can have on some CPU.
inline const std::vector<int> kWidths{2, 4, 8};
// The same on this CPU, in ascending order; none if the library has no lane code.
std::vector<int> widths();
// Why the library has no lane code, "" if it has.
std::string absence();

// What in the model has no lane code, "" if nothing.
std::string obstacle(const Model& model);
// A line for each stage of a step: its name, and how it is computed. "" if the library has no lane code.
std::string stage_lines(const Model& model);

// Whether rows of a model without obstacles can have their own values of this array of mjModel, or input of mjData.
bool computes_own(const std::string& array);

// With how many lanes a thread should step its rows; 0: one by one.
int best_width(const Model& model, std::int64_t rows);

class Stepper {
 public:
  virtual ~Stepper() = default;

  // Advances up to `width` work spaces by `frames` calls of mj_step. Each has its action (Work::act), and its
  // own arrays are among those for which computes_own is true. Writes the states before the last call to `before`.
  // before_substep: may be null. Called for each work space, by its index, before each mj_step; it may write ctrl and
  // forces.
  // Returns, as bits, the work spaces that are now as Work::step leaves them. The others met numbers or cases that
  // are left to MuJoCo's own code: load them again and step them one by one.
  using BeforeSubstep = std::function<void(int, std::int64_t)>;
  virtual std::uint32_t step(Work* const* works, int count, std::int64_t frames, double* const* before,
                             const BeforeSubstep* before_substep = nullptr) = 0;
};

// How much memory the large arrays of a stepper take.
std::size_t stepper_bytes(const Model& model, int width);

// The functions of an instruction set, by its number of lanes, which must be one of widths().
struct Code;
const Code* code_of(int width);

// The model must have no obstacle. The code must outlive the stepper.
std::unique_ptr<Stepper> make_stepper(const Model& model, const Code& code);

}  // namespace mjenv::core::lanes
