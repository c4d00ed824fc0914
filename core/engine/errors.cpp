#include "engine/errors.hpp"

#include <cstring>
#include <new>
#include <string>

#include "error.hpp"

// MuJoCo exports these functions for its own language bindings. They set handlers for one thread only.
// NOLINTBEGIN(bugprone-reserved-identifier): MuJoCo's names
extern "C" {
using mjenv_mju_handler = void (*)(const char*);
mjenv_mju_handler _mjPRIVATE__get_tls_error_fn();
void _mjPRIVATE__set_tls_error_fn(mjenv_mju_handler);
mjenv_mju_handler _mjPRIVATE__get_tls_warning_fn();
void _mjPRIVATE__set_tls_warning_fn(mjenv_mju_handler);
}
// NOLINTEND(bugprone-reserved-identifier)

namespace mjenv::core {
namespace {

[[noreturn]] void throw_error(const char* message) {
  if (lacks_memory(message)) throw std::bad_alloc();
  fail(MJENV_E_PHYSICS, std::string("MuJoCo: ") + message);
}

// Lets mju_malloc return null to a caller that frees what it holds and then reports an error of its own.
void throw_later(const char* message) {
  if (std::strcmp(message, "Could not allocate memory") != 0) throw_error(message);
}

void ignore_warning(const char*) {}

}  // namespace

// MuJoCo's messages about failed allocations are "Could not allocate ..." and "mj_...: could not allocate ...".
bool lacks_memory(const char* message) { return std::strstr(message, "ould not allocate") != nullptr; }

ErrorTrap::ErrorTrap(Memory memory)
    : previous_error_(_mjPRIVATE__get_tls_error_fn()), previous_warning_(_mjPRIVATE__get_tls_warning_fn()) {
  _mjPRIVATE__set_tls_error_fn(memory == Memory::is_checked ? throw_later : throw_error);
  _mjPRIVATE__set_tls_warning_fn(ignore_warning);
}

ErrorTrap::~ErrorTrap() {
  _mjPRIVATE__set_tls_error_fn(previous_error_);
  _mjPRIVATE__set_tls_warning_fn(previous_warning_);
}

}  // namespace mjenv::core
