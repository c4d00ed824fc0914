// Validates all models but the built-in ones, because MuJoCo can crash, hang or read out of bounds on some. Trusted
// models have wider limits (limits.hpp).
#pragma once

#include <cstdint>
#include <string>

#include "engine/load.hpp"

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core {

struct Mjcf {
  std::string text;
  Files files;                     // all to which the model refers, without the model itself
  bool must_state_ranges = false;  // the compiled model must pass check_length_ranges
};

// Returns how many bytes of XML a model may have, including its included files.
std::int64_t max_text(bool trusted);

// Fails with MJENV_E_MODEL if a muscle has no length range.
void check_length_ranges(const mjModel_& model);

// Checks a model's text and its files, and returns the text that MuJoCo is to load. path: that of the model, whose
// folder contains its files; "" for a model from memory. Fails with MJENV_E_MODEL.
Mjcf checked(const std::string& path, const std::string& text, bool trusted);

}  // namespace mjenv::core
