#include "env/failures.hpp"

#include <exception>
#include <new>
#include <utility>

#include "error.hpp"

namespace mjenv::core {

void Failures::add(mjenv_status status, const std::string& what) noexcept {
  if (status_ == MJENV_OK || status == MJENV_E_MEMORY) status_ = status;
  try {
    text_ += (text_.empty() ? "" : "; ") + (what.empty() ? std::string("out of memory") : what);
  } catch (const std::exception&) {  // no memory for the text: drops it, and reports MJENV_E_MEMORY
    status_ = MJENV_E_MEMORY;
  }
}

void Failures::take(Failures& other) noexcept {
  if (other.status_ == MJENV_OK) return;
  add(other.status_, other.text_);
  other = {};
}

void Failures::raise() {
  if (status_ == MJENV_OK) return;
  Failures all = std::exchange(*this, {});
  if (all.status_ == MJENV_E_MEMORY && all.text_.empty()) throw std::bad_alloc();  // there was no memory for a text
  fail(all.status_, std::move(all.text_));
}

}  // namespace mjenv::core
