#include "engine/errors.hpp"

#include <cstring>
#include <new>
#include <string>

#include "engine/mujoco.hpp"
#include "error.hpp"

namespace mjenv::core {
namespace {

[[noreturn]] void throw_error(const char* message) {
  if (lacks_memory(message)) throw std::bad_alloc();
  fail(MJENV_E_PHYSICS, std::string("MuJoCo: ") + message);
}

// If an allocation failed, returns, so that mju_malloc returns null. The calling function of MuJoCo then frees what it
// holds and reports an error of its own. Throws all other errors at once.
void throw_later(const char* message) {
  if (std::strcmp(message, "Could not allocate memory") != 0) throw_error(message);
}

}  // namespace

// MuJoCo's messages about failed allocations begin with "Could not allocate" or "mj_...: could not allocate".
bool lacks_memory(const char* message) { return std::strstr(message, "ould not allocate") != nullptr; }

ErrorTrap::ErrorTrap(Memory memory)
    : previous_(memory == Memory::is_checked ? set_handlers<throw_later>() : set_handlers<throw_error>()) {}

ErrorTrap::~ErrorTrap() { restore_handlers(previous_); }

}  // namespace mjenv::core
