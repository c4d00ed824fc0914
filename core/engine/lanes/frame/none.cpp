// Compiled instead of the lane code where there is none (cmake/lanes.cmake).
// MJENV_NO_LANES is the reason as a text.
#include "engine/lanes/frame/stepper.hpp"

namespace mjenv::core::lanes {

std::vector<int> widths() { return {}; }

std::string absence() { return MJENV_NO_LANES; }

std::string obstacle(const Model& /*model*/) { return absence(); }

std::string stage_lines(const Model& /*model*/) { return ""; }

int best_width(const Model& /*model*/, std::int64_t /*rows*/, int /*most*/) { return 0; }

const Code* code_of(int /*width*/) { return nullptr; }

std::size_t stepper_bytes(const Model& /*model*/, int /*width*/) { return 0; }

std::unique_ptr<Stepper> make_stepper(const Model& /*model*/, const Code& /*code*/) { return nullptr; }

}  // namespace mjenv::core::lanes
