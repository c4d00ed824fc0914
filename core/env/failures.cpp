#include "env/failures.hpp"

#include <exception>
#include <new>
#include <utility>

#include "error.hpp"

namespace mjenv::core {

void Failures::add(mjenv_status status, const std::string& what) noexcept { add(status, what, 1, 0); }

void Failures::take(Failures& other) noexcept {
  if (other.status_ == MJENV_OK) return;
  add(other.status_, other.text_, other.named_, other.unnamed_);
  other = {};
}

void Failures::add(mjenv_status status, const std::string& what, std::size_t named, std::size_t unnamed) noexcept {
  if (status_ == MJENV_OK || status == MJENV_E_MEMORY) status_ = status;
  if (unnamed_ > 0 || (named_ > 0 && text_.size() + what.size() > kMaxText)) {
    unnamed_ += named + unnamed;
    return;
  }
  try {
    text_ += (text_.empty() ? "" : "; ") + (what.empty() ? std::string("out of memory") : what);
    named_ += named;
    unnamed_ += unnamed;
  } catch (const std::exception&) {  // there is no memory for the text: drops it, and reports MJENV_E_MEMORY
    status_ = MJENV_E_MEMORY;
  }
}

void Failures::raise() {
  if (status_ == MJENV_OK) return;
  Failures all = std::exchange(*this, {});
  if (all.status_ == MJENV_E_MEMORY && all.text_.empty()) throw std::bad_alloc();  // there was no memory for a text
  if (all.unnamed_ > 0) all.text_ += "; and " + std::to_string(all.unnamed_) + " more";
  fail(all.status_, std::move(all.text_));
}

}  // namespace mjenv::core
