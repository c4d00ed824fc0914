# What the library for macOS needs. MJENV_API marks what it exports, and all else is hidden. A list of the exported
# symbols also hides what a linked-in C++ library defines; zig's linker knows no such lists.
include(CheckCSourceCompiles)
include(CheckLinkerFlag)
set(list ${CMAKE_CURRENT_BINARY_DIR}/generated/exported.txt)
file(CONFIGURE OUTPUT ${list} CONTENT "_mjenv_*\n")
check_linker_flag(CXX "-Wl,-exported_symbols_list,${list}" MJENV_HAVE_SYMBOL_LISTS)
if(MJENV_HAVE_SYMBOL_LISTS)
  target_link_options(mjenv PRIVATE "-Wl,-exported_symbols_list,${list}")
endif()
target_link_options(mjenv PRIVATE -Wl,-undefined,error)
# Elsewhere than on a Mac, CMake takes the system for one from before macOS 10.5, which did not look for libraries by @rpath.
foreach(language C CXX)
  set(CMAKE_SHARED_LIBRARY_RUNTIME_${language}_FLAG "-Wl,-rpath,")
endforeach()

if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  check_c_source_compiles("int main(void) { return __builtin_cpu_supports(\"fma\"); }" MJENV_HAVE_CPU_MODEL)
  if(NOT MJENV_HAVE_CPU_MODEL)
    add_library(mjenv_cpu_model STATIC ${CMAKE_CURRENT_LIST_DIR}/macos/cpu_model.c)
    mjenv_tune(mjenv_cpu_model)
    target_link_libraries(mjenv_math PUBLIC mjenv_cpu_model)
  endif()
endif()
