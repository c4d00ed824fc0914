# mjenv_engine: MuJoCo 2.2.2, however it is provided.
find_package(Eigen3 3.3 REQUIRED NO_MODULE)

set(MJENV_ENGINE auto CACHE STRING "MuJoCo 2.2.2: source (compiled into the library), system (an installed one), auto \
(source where the sources can be had, else system), or the folder of an unpacked official release or wheel")
set(MJENV_ENGINE_SOURCES "" CACHE PATH "Folder with mujoco, libccd, lodepng, qhull, tinyxml2 and tinyobjloader; empty: \
tools/engine-sources fetches them")
include(engine/tune)

function(mjenv_check_version include_folder)
  file(STRINGS ${include_folder}/mujoco/mujoco.h version REGEX "define mjVERSION_HEADER 222$")
  if(NOT version)
    message(FATAL_ERROR "${include_folder}/mujoco is not MuJoCo 2.2.2")
  endif()
endfunction()

# Sets output to the folder of the sources, or to "".
function(mjenv_find_sources output)
  set(folder ${MJENV_ENGINE_SOURCES})
  if(NOT folder)
    execute_process(COMMAND ${PROJECT_SOURCE_DIR}/tools/engine-sources OUTPUT_VARIABLE folder
                    OUTPUT_STRIP_TRAILING_WHITESPACE)
  endif()
  set(${output} "${folder}" PARENT_SCOPE)
endfunction()

# A built library: in a folder, as official releases (lib, include) and wheels (mujoco, mujoco/include) have it, or, without
# a folder, the system's. Not by mujocoConfig.cmake: Debian's asks for OpenGL, which the library does not need.
function(mjenv_link_engine)
  set(where "")
  if(ARGV)
    set(where PATHS ${ARGV} PATH_SUFFIXES lib include mujoco mujoco/include NO_DEFAULT_PATH)
  endif()
  find_path(headers mujoco/mujoco.h ${where} NO_CACHE)
  find_library(library NAMES mujoco libmujoco.so.2.2.2 ${where} NO_CACHE)
  if(NOT headers OR NOT library)
    message(FATAL_ERROR "MuJoCo 2.2.2 was not found: install it, or set MJENV_ENGINE to source or to the folder of an "
                        "official release, or set MJENV_ENGINE_SOURCES to a folder of sources")
  endif()
  mjenv_check_version(${headers})
  add_library(mjenv_engine INTERFACE)
  target_include_directories(mjenv_engine SYSTEM INTERFACE ${headers})
  target_link_libraries(mjenv_engine INTERFACE ${library})
endfunction()

set(sources "")
if(MJENV_ENGINE MATCHES "^(source|auto)$")
  mjenv_find_sources(sources)
endif()
if(sources)
  message(STATUS "Engine: compiled in, from ${sources}")
  include(engine/source)
elseif(MJENV_ENGINE STREQUAL "source")
  message(FATAL_ERROR "The engine's sources could not be had, see above")
elseif(MJENV_ENGINE MATCHES "^(system|auto)$")
  message(STATUS "Engine: the system's libmujoco, which is slower than MJENV_ENGINE=source")
  mjenv_link_engine()
elseif(IS_DIRECTORY ${MJENV_ENGINE})
  message(STATUS "Engine: the library in ${MJENV_ENGINE}")
  mjenv_link_engine(${MJENV_ENGINE})
else()
  message(FATAL_ERROR "MJENV_ENGINE is ${MJENV_ENGINE}: neither source, system nor auto, nor a folder")
endif()
