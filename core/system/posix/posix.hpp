// What posix.cpp asks of linux.cpp and macos.cpp.
#pragma once

#include "system/platform.hpp"

namespace mjenv::core::platform {

// Whether dlopen would read beyond the end of this file, which ends the process. The file is at its beginning.
bool is_cut_off(const InputFile& library);

}  // namespace mjenv::core::platform
