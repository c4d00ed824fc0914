# mjenv_engine: MuJoCo and the libraries it needs, compiled from the sources in ${sources}, for linking into one library.
foreach(library mujoco libccd lodepng qhull tinyxml2 tinyobjloader)
  if(NOT IS_DIRECTORY ${sources}/${library})
    message(FATAL_ERROR "The engine's sources lack a folder ${sources}/${library}")
  endif()
endforeach()
mjenv_check_version(${sources}/mujoco/include)

set(generated ${CMAKE_CURRENT_BINARY_DIR}/generated/engine)
# What libccd's own build would generate: double precision, as MuJoCo wants it.
file(CONFIGURE OUTPUT ${generated}/ccd/config.h CONTENT "#define CCD_DOUBLE\n")

function(mjenv_compile_engine target)
  mjenv_tune(${target})
  target_include_directories(${target} SYSTEM PUBLIC ${sources}/mujoco/include)
  target_include_directories(${target} PRIVATE
    ${generated} ${sources}/mujoco/src ${sources}/libccd/src ${sources}/lodepng ${sources}/qhull/src
    ${sources}/qhull/src/libqhull_r ${sources}/tinyxml2 ${sources}/tinyobjloader)
  # MJ_STATIC keeps MuJoCo's functions from being exported.
  target_compile_definitions(${target} PUBLIC MJ_STATIC PRIVATE _GNU_SOURCE CCD_STATIC_DEFINE)
  # Others' code: its warnings are theirs.
  target_compile_options(${target} PRIVATE -w)
  set_target_properties(${target} PROPERTIES C_STANDARD 11 EXPORT_COMPILE_COMMANDS OFF)
endfunction()

# The part that simulates.
set(simulation
  collision_box collision_convex collision_driver collision_primitive core_constraint core_smooth derivative forward inverse
  io ray sensor solver support util_blas util_misc util_solve util_sparse util_spatial)
list(TRANSFORM simulation REPLACE "(.+)" "${sources}/mujoco/src/engine/engine_\\1.c")
list(APPEND simulation
  ${sources}/libccd/src/ccd.c ${sources}/libccd/src/mpr.c ${sources}/libccd/src/polytope.c ${sources}/libccd/src/support.c
  ${sources}/libccd/src/vec3.c)
# The part that loads, writes and draws.
file(GLOB rest
  ${sources}/mujoco/src/engine/*.c
  ${sources}/mujoco/src/render/*.c ${sources}/mujoco/src/render/glad/*.c ${sources}/mujoco/src/render/glad/*.cc
  ${sources}/mujoco/src/user/*.cc
  ${sources}/mujoco/src/xml/*.cc
  ${sources}/qhull/src/libqhull_r/*.c)
list(REMOVE_ITEM rest ${simulation})
list(APPEND rest ${sources}/lodepng/lodepng.cpp ${sources}/tinyxml2/tinyxml2.cpp)

add_library(mjenv_engine STATIC ${rest})
mjenv_compile_engine(mjenv_engine)
target_link_libraries(mjenv_engine PUBLIC m ${CMAKE_DL_LIBS})

add_library(mjenv_engine_v1 OBJECT ${simulation})
mjenv_compile_engine(mjenv_engine_v1)
target_sources(mjenv_engine PRIVATE $<TARGET_OBJECTS:mjenv_engine_v1>)
if(MJENV_ARCH MATCHES "x86-64-v[34]")
  target_compile_definitions(mjenv_engine_v1 PRIVATE mjUSEPLATFORMSIMD)
endif()

# A second time, for machines with AVX2: under other names, as names.txt lists all that ${simulation} defines.
if(MJENV_DISPATCH)
  file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/names.txt names)
  list(TRANSFORM names REPLACE "(.+)" "#define \\1 \\1_v3\n" OUTPUT_VARIABLE renames)
  list(JOIN renames "" renames)
  file(CONFIGURE OUTPUT ${generated}/v3.h CONTENT "${renames}")
  add_library(mjenv_engine_v3 OBJECT ${simulation})
  mjenv_compile_engine(mjenv_engine_v3)
  target_compile_options(mjenv_engine_v3 PRIVATE -include ${generated}/v3.h -march=x86-64-v3 -mno-fma)
  target_compile_definitions(mjenv_engine_v3 PRIVATE mjUSEPLATFORMSIMD)

  # Whoever calls these gets dispatch.c's.
  target_compile_definitions(mjenv_engine_v1 PRIVATE
    mj_step=mj_step_v1 mj_forward=mj_forward_v1 mj_rnePostConstraint=mj_rnePostConstraint_v1)
  target_sources(mjenv_engine PRIVATE ${CMAKE_CURRENT_LIST_DIR}/dispatch.c $<TARGET_OBJECTS:mjenv_engine_v3>)
endif()

set(licenses mujoco/LICENSE libccd/BSD-LICENSE lodepng/LICENSE qhull/COPYING.txt tinyxml2/LICENSE.txt tinyobjloader/LICENSE)
foreach(license IN LISTS licenses)
  get_filename_component(library ${license} DIRECTORY)
  install(FILES ${sources}/${license} DESTINATION ${CMAKE_INSTALL_DOCDIR}/licenses RENAME ${library}.txt)
endforeach()
