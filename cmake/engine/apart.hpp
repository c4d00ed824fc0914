// Included before each source file of MuJoCo's parser and compiler, to separate them from the host process. They read
// and write numbers in the classic locale, whatever C++'s global locale is. They draw the random dots of textures from
// a generator of the thread (guards.c), so they neither reset the host's rand() nor depend on it.
#pragma once

#include <stdlib.h>

#include <algorithm>
#include <locale>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

// NOLINTBEGIN(cert-dcl58-cpp): MuJoCo names them std::istringstream and std::stringstream
namespace std {

template <typename Stream>
class mjenv_classic : public Stream {
 public:
  template <typename... Arguments>
  explicit mjenv_classic(Arguments&&... arguments) : Stream(std::forward<Arguments>(arguments)...) {
    this->imbue(std::locale::classic());
  }
};
using mjenv_istringstream = mjenv_classic<istringstream>;
using mjenv_stringstream = mjenv_classic<stringstream>;

}  // namespace std
// NOLINTEND(cert-dcl58-cpp)

// In load.cc.
std::string mjenv_getfiledir(const char* path);
class mjXSchema;
void mjenv_delete(mjXSchema* schema);

// The children of an mjXSchema, of which it deletes those that are in the list. If memory runs out in its constructor, its
// destructor does not run, and the list deletes them.
template <>
class std::vector<mjXSchema*> {
 public:
  ~vector() {
    for (void* element : elements_) mjenv_delete(static_cast<mjXSchema*>(element));
  }
  void push_back(mjXSchema* element) {
    try {
      elements_.push_back(element);
    } catch (...) {
      mjenv_delete(element);
      throw;
    }
  }
  mjXSchema* operator[](std::size_t index) const { return static_cast<mjXSchema*>(elements_[index]); }
  std::size_t size() const { return elements_.size(); }
  void clear() { elements_.clear(); }

 private:
  std::vector<void*> elements_;
};

extern "C" {
void mjenv_srand(unsigned seed);
int mjenv_rand();
}

#define istringstream mjenv_istringstream
#define stringstream mjenv_stringstream
#define srand mjenv_srand
#define rand mjenv_rand
