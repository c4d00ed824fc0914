// Handles MuJoCo's errors and warnings.
#pragma once

namespace mjenv::core {

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
  void (*previous_error_)(const char*);
  void (*previous_warning_)(const char*);
};

// Whether this message of MuJoCo is about a failed allocation.
bool lacks_memory(const char* message);

}  // namespace mjenv::core
