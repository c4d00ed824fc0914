# libmjenv-learn.so, which trains policies. It is not linked with libmjenv: programs pass it the functions that it calls, so
# one build serves every engine. It compiles what it shares with the core, such as threads and handles, once more.
file(GLOB learn_sources CONFIGURE_DEPENDS learn/*.cpp)
list(FILTER learn_sources EXCLUDE REGEX "/learn/learn\\.cpp$")
set(learn_kernels sse2 avx2 avx512)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
  set(learn_kernels neon)
endif()
list(TRANSFORM learn_kernels REPLACE "(.+)" "learn/kernels/\\1.cpp" OUTPUT_VARIABLE learn_kernel_sources)
set(learn_shared ${core_sources})
list(FILTER learn_shared INCLUDE REGEX "/core/(\\./chars|\\./error|system/.*)\\.cpp$")

# All but the interface is a library of objects, so that tests can call what the interface hides.
add_library(mjenv_learn_parts OBJECT ${learn_sources} learn/kernels/kernels.cpp ${learn_kernel_sources} ${learn_shared})
target_include_directories(mjenv_learn_parts PUBLIC learn learn/include core capi/include)
target_link_libraries(mjenv_learn_parts PUBLIC Threads::Threads ${CMAKE_DL_LIBS})

add_library(mjenv_learn SHARED learn/learn.cpp capi/reasons.cpp)
add_library(mjenv::learn ALIAS mjenv_learn)
set_target_properties(mjenv_learn PROPERTIES OUTPUT_NAME mjenv-learn VERSION ${PROJECT_VERSION} SOVERSION 1 EXPORT_NAME learn)
target_include_directories(mjenv_learn PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/learn/include>
                                              $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/capi/include>
                                              $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
                                       PRIVATE capi)
target_link_libraries(mjenv_learn PRIVATE mjenv_learn_parts)
if(MINGW)  # so that it needs none of the compiler's DLLs
  target_link_options(mjenv_learn PRIVATE -static)
elseif(NOT APPLE)
  target_link_options(mjenv_learn PRIVATE -Wl,--version-script=${CMAKE_CURRENT_SOURCE_DIR}/capi/mjenv.map -Wl,--no-undefined)
endif()

# No unity builds: their files would share the unnamed namespaces, in which the learner's files use equal names.
set_target_properties(mjenv_learn_parts mjenv_learn PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden
                                                               VISIBILITY_INLINES_HIDDEN ON UNITY_BUILD OFF)
foreach(target mjenv_learn_parts mjenv_learn)
  target_compile_definitions(${target} PRIVATE MJENV_LEARN_BUILDING)
  # Fused operations would round otherwise, and errno of sqrt is not read.
  target_compile_options(${target} PRIVATE -ffp-contract=off -fno-math-errno -Wall -Wextra -Wpedantic -Wshadow
                                           $<$<BOOL:${MJENV_WERROR}>:-Werror>)
  if(MJENV_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${MJENV_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  endif()
endforeach()
if(MJENV_SANITIZE)
  target_link_options(mjenv_learn PRIVATE -fsanitize=${MJENV_SANITIZE})
else()  # also in builds that are to compile quickly, because tests train
  set_property(SOURCE ${learn_kernel_sources} APPEND PROPERTY COMPILE_OPTIONS -O3)
endif()
set_property(SOURCE learn/kernels/avx2.cpp APPEND PROPERTY COMPILE_OPTIONS -mavx2)
set_property(SOURCE learn/kernels/avx512.cpp APPEND PROPERTY COMPILE_OPTIONS -mavx512f -mavx512dq -mprefer-vector-width=512)
if(APPLE)  # zig's clang leaves this part of AVX-512 out unless it is asked for
  set_property(SOURCE learn/kernels/avx512.cpp APPEND PROPERTY COMPILE_OPTIONS -mevex512)
endif()
if(MINGW)  # as for the lanes: stacks are aligned to 16 bytes there
  foreach(name avx2 avx512)
    set_property(SOURCE learn/kernels/${name}.cpp APPEND PROPERTY COMPILE_OPTIONS -Wa,-muse-unaligned-vector-move)
  endforeach()
endif()
