// The helper that shares structs with callers, on a struct that has grown since its first release.
#include <cassert>
#include <cstdio>
#include <cstring>

#include "structs.hpp"

#define EXPECT(condition) \
  if (!(condition)) return std::printf("%s:%d: %s\n", __FILE__, __LINE__, #condition), 1

struct Grown {
  std::uint32_t struct_size;
  std::int32_t first;
  const char* added;
  double newest;
};

template <>
inline constexpr std::size_t mjenv::core::kOldestSize<Grown> = 8;

using namespace mjenv::core;

int main() {
  const Grown defaults{0, 1, "default", 2};
  // Callers of the first header, of one between, of one whose size ends inside of a pointer, of today's and a later
  // one.
  const struct {
    std::uint32_t size;
    bool added, newest;
  } cases[] = {{8, false, false}, {16, true, false}, {12, false, false},
               {20, true, false}, {24, true, true},  {99, true, true}};
  for (const auto& c : cases) {
    Grown theirs{c.size, 7, "theirs", 8};
    const Grown read = read_struct(&theirs, "it", defaults);
    EXPECT(read.struct_size == c.size && read.first == 7);
    EXPECT(std::strcmp(read.added, c.added ? "theirs" : "default") == 0);
    EXPECT(read.newest == (c.newest ? 8 : 2));
    write_struct(&theirs, "it", Grown{0, 9, "ours", 10});
    EXPECT(theirs.struct_size == c.size && theirs.first == 9);
    EXPECT(std::strcmp(theirs.added, c.added ? "ours" : "theirs") == 0);
    EXPECT(theirs.newest == (c.newest ? 10 : 8));
  }
  const Grown small{7, 0, nullptr, 0};
  try {
    shared_size(&small, "it");
    return std::puts("a struct smaller than the first was accepted"), 1;
  } catch (const Error& error) {
    EXPECT(error.status() == MJENV_E_ARGUMENT && std::strstr(error.what(), "it->struct_size is 7, less than 8"));
  }
  return 0;
}
