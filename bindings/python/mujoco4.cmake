# Builds the library of the engine "4.0" where MuJoCo's headers are: a project of its own, because the engine decides about
# the core's targets.
set(MJENV_MUJOCO4 auto CACHE STRING "For the engine 4.0: folder of MuJoCo 4.0, an unpacked official release or the folder \
mujoco of the package mujoco-core; auto: the package that this Python has, if it has one; OFF: leave the engine out")

set(folder ${MJENV_MUJOCO4})
if(folder STREQUAL "auto")
  find_package(Python REQUIRED COMPONENTS Interpreter)
  execute_process(
    COMMAND ${Python_EXECUTABLE} -c "from importlib.util import find_spec
spec = find_spec('mujoco')
print(*(spec.submodule_search_locations if spec else ()), sep=';', end='')"
    OUTPUT_VARIABLE folders)
  set(folder "")
  foreach(candidate IN LISTS folders)
    if(EXISTS ${candidate}/include/mujoco/mujoco.h)
      file(STRINGS ${candidate}/include/mujoco/mujoco.h header REGEX "define mjVERSION_HEADER 4000[0-9][0-9][0-9]$")
      if(header)
        set(folder ${candidate})
      endif()
    endif()
  endforeach()
endif()
if(NOT folder)
  message(STATUS "Without the engine 4.0, whose headers come with pip install 'mujoco-core>=4.0,<4.1', or with an official "
                 "release that -DMJENV_MUJOCO4=FOLDER names")
  return()
endif()

message(STATUS "With the engine 4.0, by the headers in ${folder}")
set(binary ${CMAKE_CURRENT_BINARY_DIR}/mujoco4)
set(passed -DMJENV_ENGINE=${folder} -DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE})
foreach(name CMAKE_TOOLCHAIN_FILE CMAKE_C_COMPILER CMAKE_CXX_COMPILER CMAKE_C_FLAGS_RELEASE CMAKE_CXX_FLAGS_RELEASE MJENV_ARCH
             MJENV_ENGINE_SOURCES)
  if(${name})
    list(APPEND passed -D${name}=${${name}})
  endif()
endforeach()
include(ExternalProject)
ExternalProject_Add(mjenv_mujoco4
  SOURCE_DIR ${mjenv_SOURCE_DIR}
  BINARY_DIR ${binary}
  # A unity build optimises across files as link-time optimisation does, in less time.
  CMAKE_ARGS ${passed} -DCMAKE_UNITY_BUILD=ON -DMJENV_LTO=OFF
  BUILD_COMMAND ${CMAKE_COMMAND} --build <BINARY_DIR> --target mjenv
  BUILD_ALWAYS ON
  INSTALL_COMMAND ""
  EXCLUDE_FROM_ALL ON)
add_dependencies(libraries mjenv_mujoco4)

get_directory_property(version DIRECTORY ${mjenv_SOURCE_DIR} DEFINITION mjenv_VERSION)
set(library libmjenv-mujoco4.so)
install(PROGRAMS ${binary}/${library}.${version} DESTINATION mjenv RENAME ${library})
# Python finds MuJoCo's library, wherever the package is installed.
install(CODE "file(RPATH_REMOVE FILE \${CMAKE_INSTALL_PREFIX}/mjenv/${library})")
