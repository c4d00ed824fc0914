// Handles MuJoCo's errors and warnings.
#pragma once

#include <array>

namespace mjenv::core {

// The functions that MuJoCo calls on a thread when it fails or warns. Their types depend on MuJoCo's version.
using Handlers = std::array<void (*)(), 2>;

// While an ErrorTrap lives, MuJoCo's errors on its thread become exceptions, and MuJoCo's warnings are ignored.
class ErrorTrap {
 public:
  // is_checked: the functions of MuJoCo that are called while the trap lives check the result of mju_malloc for null,
  // as mj_makeData does.
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
