# Compiles for macOS 11 and newer on Apple's own CPUs, with zig's clang, which needs nothing from Apple (tools/setup macos):
# cmake -B build-macos --toolchain cmake/aarch64-macos.cmake
# cmake/x86_64-macos.cmake does the same for CPUs from Intel.
if(NOT MJENV_TARGET)
  set(CMAKE_SYSTEM_PROCESSOR arm64)
  set(MJENV_TARGET aarch64-macos.11.0)
endif()
set(CMAKE_SYSTEM_NAME Darwin)
set(CMAKE_SYSTEM_VERSION 20)  # of macOS 11's kernel
if(NOT MJENV_ZIG)
  execute_process(COMMAND ${CMAKE_CURRENT_LIST_DIR}/../tools/setup macos OUTPUT_VARIABLE MJENV_ZIG
                  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
endif()
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES MJENV_ZIG)
set(CMAKE_C_COMPILER ${MJENV_ZIG}/cc)
set(CMAKE_CXX_COMPILER ${MJENV_ZIG}/c++)
set(CMAKE_C_COMPILER_TARGET ${MJENV_TARGET})
set(CMAKE_CXX_COMPILER_TARGET ${MJENV_TARGET})
set(CMAKE_AR ${MJENV_ZIG}/ar)
set(CMAKE_RANLIB ${MJENV_ZIG}/ranlib)
set(CMAKE_INSTALL_NAME_TOOL llvm-install-name-tool-19)
set(CMAKE_OSX_SYSROOT "")  # zig brings its own
set(CMAKE_FIND_ROOT_PATH ${MJENV_ZIG})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE BOTH)  # Eigen consists of headers alone
