# Compiles with clang 19 on Debian 12 what runs on x86-64 Linux from glibc 2.28 on (tools/setup sysroot_x86_64):
# cmake -B build-old --toolchain cmake/glibc-2.28.cmake
# cmake/aarch64-linux-gnu.cmake does the same for aarch64.
if(NOT MJENV_TARGET)
  set(MJENV_TARGET x86_64-linux-gnu)
  set(MJENV_GCC /usr/lib/gcc/x86_64-linux-gnu/12)
  set(MJENV_SETUP sysroot_x86_64)
endif()
if(NOT MJENV_SYSROOT)
  execute_process(COMMAND ${CMAKE_CURRENT_LIST_DIR}/../tools/setup ${MJENV_SETUP} OUTPUT_VARIABLE MJENV_SYSROOT
                  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
endif()
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES MJENV_SYSROOT)
set(CMAKE_SYSROOT ${MJENV_SYSROOT})
# The C++ library is Debian 12's. It is linked statically, because older systems have an older one.
foreach(language C CXX)
  set(CMAKE_${language}_COMPILER_TARGET ${MJENV_TARGET})
  set(CMAKE_${language}_FLAGS_INIT --gcc-install-dir=${MJENV_GCC})
endforeach()
set(CMAKE_C_COMPILER clang-19)
set(CMAKE_CXX_COMPILER clang++-19)
foreach(kind EXE SHARED MODULE)
  set(CMAKE_${kind}_LINKER_FLAGS_INIT "-static-libstdc++ -fuse-ld=lld")
endforeach()
