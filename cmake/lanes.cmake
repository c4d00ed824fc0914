# Chooses the sources of core/engine/lanes. The lane code follows MuJoCo 2.2.2 and uses the instructions of x86-64. Sets
# MJENV_LANES if there is any. MuJoCo's code for AVX, which official releases contain and MJENV_ARCH can choose, gives
# some zeros another sign, so rows are then stepped one by one.
file(GLOB lane_sources CONFIGURE_DEPENDS core/engine/lanes/*.cpp)
list(REMOVE_ITEM core_sources ${lane_sources})
set(folder ${CMAKE_CURRENT_SOURCE_DIR}/core/engine/lanes)
if(MJENV_ENGINE_MAJOR EQUAL 2 AND CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$"
   AND NOT MJENV_ARCH MATCHES "x86-64-v[34]" AND NOT IS_DIRECTORY "${MJENV_ENGINE}")
  set(MJENV_LANES ON)
  list(REMOVE_ITEM lane_sources ${folder}/none.cpp)
  list(APPEND core_sources ${lane_sources})
else()
  set(MJENV_LANES OFF)
  list(APPEND core_sources ${folder}/none.cpp)
endif()

# A profile knows nothing of these files, because the steps that it counts are without lanes, so clang would make them
# small instead of fast.
if(MJENV_PGO)
  foreach(name sse2 avx2 avx512 stepper solver constraint_maker)
    set_property(SOURCE ${folder}/${name}.cpp APPEND PROPERTY COMPILE_OPTIONS -fno-profile-generate
                                                                              -fno-profile-instr-use)
  endforeach()
endif()
# Each of these files is compiled for one instruction set, so link-time optimisation must leave them alone.
set_property(SOURCE ${folder}/sse2.cpp APPEND PROPERTY COMPILE_OPTIONS -fno-lto)
set_property(SOURCE ${folder}/avx2.cpp APPEND PROPERTY COMPILE_OPTIONS -fno-lto -mavx2)
set_property(SOURCE ${folder}/avx512.cpp APPEND PROPERTY COMPILE_OPTIONS -fno-lto -mavx512f -mavx512dq
                                                                         -mprefer-vector-width=512)
if(APPLE)  # zig's clang leaves this part of AVX-512 out unless it is asked for
  set_property(SOURCE ${folder}/avx512.cpp APPEND PROPERTY COMPILE_OPTIONS -mevex512)
endif()
if(MINGW)
  # Windows aligns stacks to 16 bytes, and gcc for it takes the copies there of wider vectors for aligned to their width.
  foreach(name avx2 avx512)
    set_property(SOURCE ${folder}/${name}.cpp APPEND PROPERTY COMPILE_OPTIONS -Wa,-muse-unaligned-vector-move)
  endforeach()
endif()
