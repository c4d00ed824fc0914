// Included before each source file of MuJoCo's parser and compiler, to separate them from the host process. They read
// and write numbers in the classic locale, whatever C++'s global locale is. They draw the random dots of textures from
// a generator of the thread (guards.c), so they neither reset the host's rand() nor depend on it.
#pragma once

#include <stdlib.h>

#include <algorithm>
#include <locale>
#include <sstream>
#include <utility>

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

extern "C" {
void mjenv_srand(unsigned seed);
int mjenv_rand();
}

#define istringstream mjenv_istringstream
#define stringstream mjenv_stringstream
#define srand mjenv_srand
#define rand mjenv_rand
