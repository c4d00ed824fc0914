#pragma once

#include <cstddef>

namespace mjenv::core {

// Whether a zlib stream (RFC 1950) unpacks to at most `most` bytes; also true of a damaged one that ends before.
bool inflates_within(const unsigned char* stream, std::size_t size, std::size_t most);

}  // namespace mjenv::core
