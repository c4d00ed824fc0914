# Chooses the sources of core/engine/lanes. The lane code follows MuJoCo 2.2.2 for x86-64 or aarch64, as mjenv compiles it: a
# built libmujoco may add in another order, or give some zeros another sign, so rows are then stepped one by one. Of MuJoCo
# 4.0, it follows the published library for x86-64. Sets MJENV_LANES to the names of the files that are compiled for one
# instruction set each; it is empty if there is no lane code.
set(folder ${CMAKE_CURRENT_SOURCE_DIR}/core/engine/lanes)
set(frame ${folder}/frame)
set(none ${frame}/none.cpp)
file(GLOB lane_sources CONFIGURE_DEPENDS ${frame}/*.cpp ${folder}/mujoco${MJENV_ENGINE_MAJOR}/*.cpp)
set(of_x86 sse2 avx2 avx512)
set(of_aarch64 neon)
set(MJENV_LANES "")
if(MJENV_ARCH MATCHES "x86-64-v[34]")
elseif(MJENV_ENGINE_MAJOR EQUAL 4 AND CMAKE_SYSTEM_NAME STREQUAL Linux AND CMAKE_SYSTEM_PROCESSOR STREQUAL x86_64)
  set(MJENV_LANES ${of_x86})
  set(others aarch64 ${of_aarch64})
elseif(MJENV_ENGINE_MAJOR EQUAL 2 AND NOT MJENV_LOADER)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
    set(MJENV_LANES ${of_x86})
    set(others aarch64 ${of_aarch64})
  elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
    set(MJENV_LANES ${of_aarch64})
    set(others x86 ${of_x86})
  endif()
endif()
if(MJENV_LANES)
  list(TRANSFORM others REPLACE "(.+)" "${frame}/\\1.cpp")
  list(REMOVE_ITEM lane_sources ${others} ${none})
  list(APPEND core_sources ${lane_sources})
else()
  list(APPEND core_sources ${none})
  if(NOT MJENV_ENGINE_MAJOR EQUAL 2)
    set(why "lanes follow MuJoCo 4.0 on x86-64 Linux")
  elseif(NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|aarch64|arm64)$")
    set(why "lanes are for x86-64 and aarch64, and this library is for ${CMAKE_SYSTEM_PROCESSOR}")
  elseif(MJENV_LOADER)
    set(why "lanes follow MuJoCo as mjenv compiles it, and this library uses a built libmujoco, which may add otherwise")
  else()
    set(why "lanes have not been compared with a library that is built for ${MJENV_ARCH}")
  endif()
  set_property(SOURCE ${none} APPEND PROPERTY COMPILE_DEFINITIONS "MJENV_NO_LANES=\"${why}\"")
endif()

# A profile knows nothing of these files, because the steps that it counts are without lanes, so clang would make them
# small instead of fast.
if(MJENV_PGO)
  list(TRANSFORM MJENV_LANES PREPEND frame/ OUTPUT_VARIABLE names)
  list(APPEND names frame/lane_stepper frame/row_maker frame/row_solver mujoco2/stepper mujoco2/solver
       mujoco2/constraint_maker)
  foreach(name IN LISTS names)
    set_property(SOURCE ${folder}/${name}.cpp APPEND PROPERTY COMPILE_OPTIONS -fno-profile-generate
                                                                              -fno-profile-instr-use)
  endforeach()
endif()
# Each of these files is compiled for one instruction set, so link-time optimisation must leave them alone.
foreach(name IN LISTS MJENV_LANES)
  set_property(SOURCE ${frame}/${name}.cpp APPEND PROPERTY COMPILE_OPTIONS -fno-lto ${MJENV_TUNE_INLINING})
endforeach()
set_property(SOURCE ${frame}/avx2.cpp APPEND PROPERTY COMPILE_OPTIONS -mavx2)
set_property(SOURCE ${frame}/avx512.cpp APPEND PROPERTY COMPILE_OPTIONS -mavx512f -mavx512dq
                                                                         -mprefer-vector-width=512)
if(MINGW)
  # Windows aligns stacks to 16 bytes, but gcc for Windows assumes that wider vectors on the stack are aligned to their
  # width. So the assembler turns aligned moves into unaligned ones.
  foreach(name avx2 avx512)
    set_property(SOURCE ${frame}/${name}.cpp APPEND PROPERTY COMPILE_OPTIONS -Wa,-muse-unaligned-vector-move)
  endforeach()
endif()
