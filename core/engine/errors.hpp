// MuJoCo's errors and warnings.
#pragma once

namespace mjenv::core {

// Turns MuJoCo's errors on this thread into exceptions, and silences its warnings, while it lives.
class ErrorTrap {
 public:
  // Whether the part of MuJoCo that is called frees what it has when mju_malloc returns null, as mj_makeData does.
  enum class Memory { is_not_checked, is_checked };
  explicit ErrorTrap(Memory memory = Memory::is_not_checked);
  ~ErrorTrap();
  ErrorTrap(const ErrorTrap&) = delete;
  ErrorTrap& operator=(const ErrorTrap&) = delete;

 private:
  void (*previous_error_)(const char*);
  void (*previous_warning_)(const char*);
};

// Whether a message of MuJoCo's is about a failed allocation.
bool lacks_memory(const char* message);

}  // namespace mjenv::core
