// What linux.cpp implements for posix.cpp.
#pragma once

#include "system/platform.hpp"

namespace mjenv::core::platform {

// Whether dlopen would read beyond the end of this file, which would end the process. Nothing may have been read from
// `library` yet.
bool is_cut_off(const InputFile& library);

}  // namespace mjenv::core::platform
