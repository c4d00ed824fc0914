# Sets the options that make the core and the engine as fast as the same bits allow.
include(CheckIPOSupported)
include(CheckLinkerFlag)

option(MJENV_SYMBOLS "Strip the library, and keep its symbols and line numbers in a file of their own" OFF)
option(MJENV_LTO "Optimise across the core and the engine at link time" ON)
set(MJENV_ARCH "" CACHE STRING "Instruction set, x86-64-v3 for instance; empty: runs on every machine of this architecture")
set(MJENV_SANITIZE "" CACHE STRING "Sanitizers: address,undefined or thread")
set(MJENV_PGO OFF CACHE STRING
    "Optimise by profile (clang): OFF, use; or, for tools/engine-pgo, generate and refine, which build the library to be profiled")
set(MJENV_PROFILE "" CACHE FILEPATH "Profile to use; empty: tools/engine-pgo makes it")
set_property(CACHE MJENV_PGO PROPERTY STRINGS OFF use generate refine)

# For exact bits there is no fused multiply-add and no reordering. MuJoCo reads no errno and handles no trap.
set(MJENV_TUNE -ffp-contract=off -fno-math-errno -fno-trapping-math)
set(MJENV_TUNE_LINK "")
if(EMSCRIPTEN)
  set(exceptions -fwasm-exceptions -sSUPPORT_LONGJMP=wasm)
  list(APPEND MJENV_TUNE ${exceptions})
  list(APPEND MJENV_TUNE_LINK ${exceptions})
else()
  list(APPEND MJENV_TUNE -fno-plt -fno-semantic-interposition)
endif()
# MuJoCo and the lane code consist of many small functions that compute few numbers each, so inlining gains most. The rest of
# the core would gain half a percent, and take half as much time again to compile.
set(MJENV_TUNE_INLINING "")
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  list(APPEND MJENV_TUNE -fno-tree-vectorize)
  set(MJENV_TUNE_INLINING --param=max-inline-insns-auto=100 --param=inline-unit-growth=300
                          --param=large-function-growth=1000)
  list(APPEND MJENV_TUNE_LINK -fno-tree-vectorize ${MJENV_TUNE_INLINING})
endif()
if(MJENV_ARCH)
  # gcc 12's vectorizer fuses in spite of -ffp-contract=off.
  list(APPEND MJENV_TUNE -march=${MJENV_ARCH} -fno-tree-slp-vectorize
                         $<$<STREQUAL:${CMAKE_SYSTEM_PROCESSOR},x86_64>:-mno-fma>)
endif()
if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
  check_linker_flag(CXX -fuse-ld=lld MJENV_HAVE_LLD)
  if(MJENV_HAVE_LLD)
    list(APPEND MJENV_TUNE_LINK -fuse-ld=lld -Wl,-mllvm,-inline-threshold=1000)
  endif()
  # Optimises the whole program at once. CMake would choose ThinLTO.
  set(CMAKE_C_COMPILE_OPTIONS_IPO -flto)
  set(CMAKE_CXX_COMPILE_OPTIONS_IPO -flto)
endif()

if(MJENV_SANITIZE)
  list(APPEND MJENV_TUNE -fsanitize=${MJENV_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  list(APPEND MJENV_TUNE_LINK -fsanitize=${MJENV_SANITIZE})
endif()

if(MJENV_PGO AND NOT CMAKE_CXX_COMPILER_ID MATCHES Clang)
  message(FATAL_ERROR "MJENV_PGO needs clang; this is ${CMAKE_CXX_COMPILER_ID}")
endif()
if(MJENV_PGO STREQUAL generate)
  list(APPEND MJENV_TUNE -fprofile-generate)
  list(APPEND MJENV_TUNE_LINK -fprofile-generate)
elseif(MJENV_PGO)
  if(NOT MJENV_PROFILE)
    execute_process(COMMAND ${PROJECT_SOURCE_DIR}/tools/engine-pgo -DCMAKE_C_COMPILER=${CMAKE_C_COMPILER}
                            -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER} -DMJENV_ARCH=${MJENV_ARCH}
                            -DMJENV_ENGINE_SOURCES=${MJENV_ENGINE_SOURCES}
                    OUTPUT_VARIABLE profile OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE failed)
    if(failed)
      message(FATAL_ERROR "tools/engine-pgo could not make a profile; see above, or set -DMJENV_PGO=OFF")
    endif()
    set_property(CACHE MJENV_PROFILE PROPERTY VALUE ${profile})
  endif()
  list(APPEND MJENV_TUNE -fprofile-use=${MJENV_PROFILE} -Wno-profile-instr-unprofiled -Wno-profile-instr-out-of-date)
  list(APPEND MJENV_TUNE_LINK -fprofile-use=${MJENV_PROFILE})
  if(MJENV_PGO STREQUAL refine)  # counts again, now in each place that a function was inlined into
    list(APPEND MJENV_TUNE -fcs-profile-generate)
    list(APPEND MJENV_TUNE_LINK -fcs-profile-generate)
  endif()
endif()

# Link-time optimisation makes neither an instrumented nor a sanitized library better.
if(MJENV_LTO AND NOT MJENV_SANITIZE AND NOT MJENV_PGO STREQUAL generate)
  check_ipo_supported(RESULT MJENV_USE_LTO OUTPUT reason LANGUAGES C CXX)
  if(NOT MJENV_USE_LTO)
    message(WARNING "Building without link-time optimisation, which makes the library slower: ${reason}")
  endif()
else()
  set(MJENV_USE_LTO OFF)
endif()
# What is optimised as a whole is also compiled in few pieces, because most of the time is that of reading headers.
option(CMAKE_UNITY_BUILD "Compile several files of the core at once" ${MJENV_USE_LTO})

if(MJENV_SYMBOLS)
  list(APPEND MJENV_TUNE -g1)
endif()

set(MJENV_PIC ON)
if(EMSCRIPTEN)  # which makes no shared library
  set(MJENV_PIC OFF)
endif()

function(mjenv_tune target)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ${MJENV_PIC} C_VISIBILITY_PRESET hidden
                        CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
                        INTERPROCEDURAL_OPTIMIZATION ${MJENV_USE_LTO})
  # libmjenv.a makes all names but mjenv_* local, which is not possible for gcc's unique symbols.
  target_compile_options(${target} PRIVATE ${MJENV_TUNE} $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-fno-gnu-unique>)
  target_link_options(${target} PUBLIC "$<BUILD_INTERFACE:${MJENV_TUNE_LINK}>")
endfunction()

# Moves the symbols of a shared library to LIBRARY.debug, where debuggers look for them.
function(mjenv_split_symbols target)
  if(NOT MJENV_SYMBOLS)
    return()
  endif()
  set(file $<TARGET_FILE:${target}>)
  add_custom_command(TARGET ${target} POST_BUILD VERBATIM
    COMMAND ${CMAKE_OBJCOPY} --only-keep-debug ${file} ${file}.debug
    COMMAND ${CMAKE_OBJCOPY} --strip-unneeded --add-gnu-debuglink=${file}.debug ${file})
  install(FILES ${file}.debug DESTINATION ${CMAKE_INSTALL_LIBDIR})
endfunction()
