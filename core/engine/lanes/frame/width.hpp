// The most lanes that an instruction set has.
#pragma once

namespace mjenv::core::lanes {

constexpr int kMaxWidth = 8;

}  // namespace mjenv::core::lanes
