#pragma once

#include <cstddef>

namespace mjenv::core {

// Whether a zlib stream (RFC 1950) unpacks to at most `limit` bytes. If the stream is damaged, only the part before the
// damage counts.
bool inflates_within(const unsigned char* stream, std::size_t size, std::size_t limit);

}  // namespace mjenv::core
