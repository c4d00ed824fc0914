# Compiles with clang 19 on Debian 12 what runs on aarch64 Linux from glibc 2.28 on, and runs it in an emulator (tools/setup
# aarch64): cmake -B build-aarch64 --toolchain cmake/aarch64-linux-gnu.cmake
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(MJENV_TARGET aarch64-linux-gnu)
set(MJENV_GCC /usr/lib/gcc-cross/aarch64-linux-gnu/12)
set(MJENV_SETUP sysroot_aarch64)
include(${CMAKE_CURRENT_LIST_DIR}/glibc-2.28.cmake)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 -L /usr/aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH ${MJENV_SYSROOT})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE BOTH)  # Eigen consists of headers alone
set(CMAKE_OBJCOPY llvm-objcopy-19)
