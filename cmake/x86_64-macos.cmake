# Compiles for macOS 11 and newer on CPUs from Intel, as cmake/aarch64-macos.cmake does for Apple's:
# cmake -B build-macos --toolchain cmake/x86_64-macos.cmake
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(MJENV_TARGET x86_64-macos.11.0)
include(${CMAKE_CURRENT_LIST_DIR}/aarch64-macos.cmake)
