// What is asked of a caller's model before MuJoCo sees it, as MuJoCo 2.2.2 crashes, hangs or reads anything on some.
#pragma once

#include <cstdint>
#include <string>

namespace mjenv::core {

struct Mjcf {
  std::string path;  // names the folder that its files are looked for in; "" for a model from memory
  std::string text;
  bool trusted;  // it may read any file and be of any size
};

// Bytes of XML, included files too.
std::int64_t most_text(bool trusted);

// Fails with MJENV_E_MODEL. The result is the text that MuJoCo is to load.
std::string checked(const Mjcf& model);

}  // namespace mjenv::core
