# mjenv_engine: MuJoCo 2.2.2, however it is provided.
find_package(Eigen3 3.3 REQUIRED NO_MODULE)
# Not by mujocoConfig.cmake: Debian's asks for OpenGL, which the library does not need.
find_path(MUJOCO_INCLUDE_DIR mujoco/mujoco.h REQUIRED)
find_library(MUJOCO_LIBRARY NAMES mujoco libmujoco.so.2.2.2 REQUIRED)
file(STRINGS ${MUJOCO_INCLUDE_DIR}/mujoco/mujoco.h mujoco_version REGEX "define mjVERSION_HEADER 222")
if(NOT mujoco_version)
  message(FATAL_ERROR "${MUJOCO_INCLUDE_DIR}/mujoco is not MuJoCo 2.2.2")
endif()

add_library(mjenv_engine INTERFACE)
target_include_directories(mjenv_engine SYSTEM INTERFACE ${MUJOCO_INCLUDE_DIR})
target_link_libraries(mjenv_engine INTERFACE ${MUJOCO_LIBRARY})
