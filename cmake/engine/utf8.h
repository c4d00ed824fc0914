// Included before the sources of the engine that open files, on Windows: its C library takes paths for texts in the code
// page of the country, and here they are UTF-8.
#pragma once

#include <stdio.h>

#ifdef __cplusplus
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

// NOLINTBEGIN(cert-dcl58-cpp): tinyobjloader names it std::ifstream
namespace std {

class mjenv_ifstream : public ifstream {
 public:
  explicit mjenv_ifstream(const string& path) : ifstream(filesystem::u8path(path)) {}
};

}  // namespace std
// NOLINTEND(cert-dcl58-cpp)
#define ifstream mjenv_ifstream

extern "C" {
#endif
FILE* mjenv_fopen(const char* path, const char* mode);  // in utf8.c
#ifdef __cplusplus
}
#endif
#define fopen mjenv_fopen
