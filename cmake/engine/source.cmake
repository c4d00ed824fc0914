# Defines mjenv_engine: MuJoCo and the libraries that it needs, compiled from the sources in ${sources}.
foreach(library mujoco libccd lodepng qhull tinyxml2 tinyobjloader)
  if(NOT IS_DIRECTORY ${sources}/${library})
    message(FATAL_ERROR "The engine's sources lack a folder ${sources}/${library}")
  endif()
endforeach()
mjenv_find_version(${sources}/mujoco/include version)
if(NOT version STREQUAL "2.2.2")
  message(FATAL_ERROR "${sources}/mujoco is MuJoCo ${version}; only 2.2.2 is compiled in")
endif()

set(generated ${CMAKE_CURRENT_BINARY_DIR}/generated/engine)
# libccd's own build would generate this file. MuJoCo needs double precision.
file(CONFIGURE OUTPUT ${generated}/ccd/config.h CONTENT "#define CCD_DOUBLE\n")

file(GLOB engine
  ${sources}/mujoco/src/engine/*.c
  ${sources}/mujoco/src/render/*.c ${sources}/mujoco/src/render/glad/*.c ${sources}/mujoco/src/render/glad/*.cc
  ${sources}/mujoco/src/user/*.cc
  ${sources}/mujoco/src/xml/*.cc
  ${sources}/qhull/src/libqhull_r/*.c)
# guards.c and load.cc replace these.
list(REMOVE_ITEM engine ${sources}/qhull/src/libqhull_r/usermem_r.c ${sources}/qhull/src/libqhull_r/userprintf_r.c
                        ${sources}/mujoco/src/xml/xml_api.cc)
list(APPEND engine
  ${CMAKE_CURRENT_LIST_DIR}/collision.c ${CMAKE_CURRENT_LIST_DIR}/forces.c ${CMAKE_CURRENT_LIST_DIR}/guards.c
  ${CMAKE_CURRENT_LIST_DIR}/load.cc ${CMAKE_CURRENT_LIST_DIR}/overlaps.c ${CMAKE_CURRENT_LIST_DIR}/rays.c
  ${sources}/libccd/src/ccd.c ${sources}/libccd/src/mpr.c ${sources}/libccd/src/polytope.c ${sources}/libccd/src/support.c
  ${sources}/libccd/src/vec3.c
  ${sources}/lodepng/lodepng.cpp
  ${sources}/tinyxml2/tinyxml2.cpp)

if(WIN32)
  list(APPEND engine ${CMAKE_CURRENT_LIST_DIR}/utf8.c)
  set(readers ${sources}/mujoco/src/engine/engine_file.c ${sources}/mujoco/src/user/user_mesh.cc ${sources}/tinyxml2/tinyxml2.cpp)
  set_property(SOURCE ${readers} APPEND PROPERTY COMPILE_OPTIONS -include ${CMAKE_CURRENT_LIST_DIR}/utf8.h)
  set_property(SOURCE ${readers} APPEND PROPERTY OBJECT_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/utf8.h)
endif()
add_library(mjenv_engine STATIC ${engine})
mjenv_tune(mjenv_engine)
# What reads models runs once for each: it gains little from inlining more, which takes a third of its time to compile.
set(readers ${engine})
list(FILTER readers INCLUDE REGEX "/mujoco/src/(user|xml)/|/qhull/|/tinyxml2/|/lodepng/|/glad/")
set(others ${engine})
list(REMOVE_ITEM others ${readers})
set_property(SOURCE ${others} APPEND PROPERTY COMPILE_OPTIONS ${MJENV_TUNE_INLINING})
target_include_directories(mjenv_engine SYSTEM PUBLIC ${sources}/mujoco/include ${sources}/tinyxml2
                                                      ${sources}/lodepng)
target_include_directories(mjenv_engine PRIVATE
  ${generated} ${sources}/mujoco/src ${sources}/libccd/src ${sources}/qhull/src
  ${sources}/qhull/src/libqhull_r ${sources}/tinyobjloader)
# MJ_STATIC keeps MuJoCo's functions from being exported. The core calls load.cc instead of mj_loadXML.
target_compile_definitions(mjenv_engine PUBLIC MJ_STATIC PRIVATE _GNU_SOURCE CCD_STATIC_DEFINE)
if(MJENV_ARCH MATCHES "x86-64-v[34]")
  target_compile_definitions(mjenv_engine PRIVATE mjUSEPLATFORMSIMD)
else()
  # All CPUs use MuJoCo's code for AVX, because the official library adds in its order.
  set(avx ${CMAKE_CURRENT_LIST_DIR}/avx.h)
  set(sums ${sources}/mujoco/src/engine/engine_util_blas.c ${sources}/mujoco/src/engine/engine_util_sparse.c)
  set_property(SOURCE ${sums} APPEND PROPERTY COMPILE_DEFINITIONS mjUSEAVX)
  set_property(SOURCE ${sums} APPEND PROPERTY COMPILE_OPTIONS -include ${avx})
  set_property(SOURCE ${sums} APPEND PROPERTY OBJECT_DEPENDS ${avx})
endif()
if(MINGW OR EMSCRIPTEN)  # for localtime_r
  set_property(SOURCE ${sources}/mujoco/src/engine/engine_util_errmem.c APPEND PROPERTY
               COMPILE_DEFINITIONS _POSIX_C_SOURCE=200809L)
endif()
set_property(SOURCE ${sources}/mujoco/src/engine/engine_setconst.c APPEND PROPERTY
             COMPILE_DEFINITIONS mj_step1=mjenv_step1)
set_property(SOURCE ${sources}/mujoco/src/engine/engine_core_smooth.c APPEND PROPERTY
             COMPILE_DEFINITIONS mj_applyFT=mjenv_applyFT)
set_property(SOURCE ${sources}/mujoco/src/engine/engine_forward.c APPEND PROPERTY
             COMPILE_DEFINITIONS mj_collision=mjenv_collision)
set_property(SOURCE ${sources}/mujoco/src/engine/engine_sensor.c APPEND PROPERTY COMPILE_DEFINITIONS mj_ray=mjenv_ray)
set_property(SOURCE ${sources}/mujoco/src/engine/engine_collision_convex.c APPEND PROPERTY
             COMPILE_DEFINITIONS ccdMPRPenetration=mjenv_penetration)
set_property(SOURCE ${sources}/mujoco/src/user/user_mesh.cc APPEND PROPERTY
             COMPILE_DEFINITIONS qh_vertexneighbors=mjenv_vertexneighbors)
set_property(SOURCE ${sources}/qhull/src/libqhull_r/libqhull_r.c APPEND PROPERTY
             COMPILE_DEFINITIONS qh_resetlists=mjenv_resetlists)
file(GLOB loader ${sources}/mujoco/src/user/*.cc ${sources}/mujoco/src/xml/*.cc ${CMAKE_CURRENT_LIST_DIR}/load.cc)
set_property(SOURCE ${loader} APPEND PROPERTY COMPILE_OPTIONS -include ${CMAKE_CURRENT_LIST_DIR}/apart.hpp)
set_property(SOURCE ${loader} APPEND PROPERTY OBJECT_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/apart.hpp)
list(REMOVE_ITEM loader ${CMAKE_CURRENT_LIST_DIR}/load.cc)  # which defines what they call in place of MuJoCo's functions
set_property(SOURCE ${loader} APPEND PROPERTY COMPILE_DEFINITIONS mj_findFileVFS=mjenv_find_file)
set_property(SOURCE ${loader} ${sources}/mujoco/src/engine/engine_io.c APPEND PROPERTY
             COMPILE_DEFINITIONS mju_malloc=mjenv_malloc mju_free=mjenv_free)
set_property(SOURCE ${sources}/mujoco/src/user/user_model.cc APPEND PROPERTY COMPILE_DEFINITIONS
             mj_defaultOption=mjenv_default_option mj_step=mjenv_test_step _mjPRIVATE__set_tls_error_fn=mjenv_set_error_handler)
set_property(SOURCE ${sources}/mujoco/src/xml/xml.cc APPEND PROPERTY
             COMPILE_DEFINITIONS mjuu_getfiledir=mjenv_getfiledir)
set_property(SOURCE ${CMAKE_CURRENT_LIST_DIR}/load.cc APPEND PROPERTY INCLUDE_DIRECTORIES ${PROJECT_SOURCE_DIR}/core)
set_property(SOURCE ${sources}/libccd/src/mpr.c APPEND PROPERTY COMPILE_DEFINITIONS __ccdSupport=mjenv_support)
# Errors leave MuJoCo's C code as exceptions. If that code had no tables for them, the compiler would drop the handlers of
# its callers.
if(NOT EMSCRIPTEN)  # where all code has them
  target_compile_options(mjenv_engine PRIVATE $<$<COMPILE_LANGUAGE:C>:-fexceptions>)
endif()
if(MJENV_SANITIZE)
  # MuJoCo does two things that C leaves undefined and every machine defines. It converts numbers that fit no int, and then
  # bounds them, where a simulation diverges. It reads the numbers of an STL file from addresses that are not aligned.
  target_compile_options(mjenv_engine PRIVATE -fno-sanitize=float-cast-overflow)
  set_property(SOURCE ${sources}/mujoco/src/user/user_mesh.cc APPEND PROPERTY COMPILE_OPTIONS -fno-sanitize=alignment)
endif()
# The readers are left out of link-time optimisation, too, which takes most of a build. With -O1, a mesh of 57,000 triangles
# is read in 0.6 times the CPU time that -O3 for meshes and -Os for the rest took.
if(MJENV_USE_LTO)
  set_property(SOURCE ${readers} APPEND PROPERTY COMPILE_OPTIONS -fno-lto -O1)
endif()
# The code belongs to other projects, so its warnings are not shown.
target_compile_options(mjenv_engine PRIVATE -w)
# Several of the files define helpers of the same name.
set_target_properties(mjenv_engine PROPERTIES C_STANDARD 11 UNITY_BUILD OFF EXPORT_COMPILE_COMMANDS OFF)
target_link_libraries(mjenv_engine PUBLIC m ${CMAKE_DL_LIBS})

# Every copy of the library that is distributed needs these licences.
set(licenses ${CMAKE_CURRENT_BINARY_DIR}/generated/licenses)
foreach(license mujoco/LICENSE libccd/BSD-LICENSE lodepng/LICENSE qhull/COPYING.txt tinyxml2/LICENSE.txt tinyobjloader/LICENSE
        eigen3/LICENSE json/LICENSE)
  get_filename_component(library ${license} DIRECTORY)
  if(EXISTS ${sources}/${license})  # Eigen and json are the system's except in release archives
    configure_file(${sources}/${license} ${licenses}/${library}.txt COPYONLY)
  endif()
endforeach()
install(DIRECTORY ${licenses} DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documents)
install(FILES THIRD_PARTY_NOTICES.md sbom.cdx.json DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT documents)
