// Handles MuJoCo's errors and warnings.
#pragma once

#include <array>

namespace mjenv::core {

// What MuJoCo calls on a thread when it fails or warns. The types of the functions depend on MuJoCo's version.
using Handlers = std::array<void (*)(), 2>;

// While it lives, MuJoCo's errors on this thread become exceptions, and its warnings are ignored.
class ErrorTrap {
 public:
  // Whether the called function of MuJoCo handles an mju_malloc that returns null, as mj_makeData does.
  enum class Memory { is_not_checked, is_checked };
  explicit ErrorTrap(Memory memory = Memory::is_not_checked);
  ~ErrorTrap();
  ErrorTrap(const ErrorTrap&) = delete;
  ErrorTrap& operator=(const ErrorTrap&) = delete;

 private:
  Handlers previous_;
};

// Whether this message of MuJoCo is about a failed allocation.
bool lacks_memory(const char* message);

}  // namespace mjenv::core
