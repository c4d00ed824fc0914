// The helpers that share structs with callers, on a struct that has grown since its first release. Compiled so that a
// member that is read at a wrong address ends the program.
#include <array>
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

constexpr std::size_t oldest_size(const Grown*) { return 8; }

using namespace mjenv::core;

namespace {

// The text of the error that body throws, "" if it throws none.
template <typename Body>
std::string refusal(const Body& body) {
  try {
    body();
  } catch (const Error& error) {
    return error.status() == MJENV_E_ARGUMENT ? error.what() : "another status";
  }
  return "";
}

// A caller's struct may lie at any address: in a packed struct, or in the bytes of a file.
int at_odd_address() {
  alignas(Grown) std::array<unsigned char, sizeof(Grown) + 1> bytes{};
  const Grown given{sizeof(Grown), 7, "theirs", 8};
  std::memcpy(&bytes[1], &given, sizeof given);
  auto* theirs = reinterpret_cast<Grown*>(&bytes[1]);
  EXPECT(read_struct(theirs, "it").first == 7);
  write_struct(theirs, "it", Grown{0, 9, "ours", 10});
  Grown written{};
  std::memcpy(&written, &bytes[1], sizeof written);
  EXPECT(written.struct_size == sizeof(Grown) && written.first == 9 && written.newest == 10);
  return 0;
}

// In an array, the elements of a caller of an older header lie closer together, and all have one struct_size.
int in_arrays() {
  struct Older {
    std::uint32_t struct_size;
    std::int32_t first;
  };
  std::array<Older, 3> older{{{8, 1}, {8, 2}, {8, 3}}};
  const auto sum = [&](std::int64_t count) {
    std::int32_t total = 0;
    for_each_struct(reinterpret_cast<const Grown*>(older.data()), count, 3, "count", "items",
                    [&](const Grown& one) { total += one.first + (one.added || one.newest != 0 ? 100 : 0); });
    return total;
  };
  EXPECT(sum(0) == 0 && sum(3) == 6);
  for (const std::uint32_t size : {0u, 7u, 16u, 24u, 0xffff'ffffu}) {  // with 24, the last would be read beyond its end
    older[2].struct_size = size;
    EXPECT(sum(2) == 3);
    EXPECT(refusal([&] {
             sum(3);
           }).find("items[2].struct_size is " + std::to_string(size) + ", but items[0].struct_size is 8") == 0);
  }
  older[0].struct_size = 0;
  EXPECT(refusal([&] { sum(1); }).find("items[0]->struct_size is 0, less than 8") == 0);
  EXPECT(refusal([] { for_each_struct<Grown>(nullptr, 1, 1, "count", "items", [](const Grown&) {}); }) ==
         "items is NULL");
  return 0;
}

}  // namespace

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
  return at_odd_address() != 0 || in_arrays() != 0;
}
