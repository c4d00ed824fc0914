// Validates untrusted models, because MuJoCo 2.2.2 can crash, hang or read out of bounds on some.
#pragma once

#include <cstdint>
#include <string>

namespace mjenv::core {

struct Mjcf {
  std::string text;
  bool refers_to_files;
};

// Returns how many bytes of XML a model may have, including its included files.
std::int64_t max_text(bool trusted);

// Checks a model's text and its files, and returns the text for MuJoCo. The path of the model tells the folder of its
// files; it is "" for a model from memory. Fails with MJENV_E_MODEL.
Mjcf checked(const std::string& path, const std::string& text, bool trusted);

}  // namespace mjenv::core
