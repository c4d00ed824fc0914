# Builds the programs and plug-ins beside the library: each folder of extras/ that has a CMakeLists.txt. They use the public
# headers, and the library builds without them.
include(mjenv-tasks)
set(MJENV_EXTRAS all CACHE STRING "Which folders of extras/ are built: all, or a list of their names")
set(MJENV_EXTRAS_CHOSEN "/extras/")
if(NOT MJENV_EXTRAS STREQUAL all)
  list(JOIN MJENV_EXTRAS "|" MJENV_EXTRAS_CHOSEN)
  set(MJENV_EXTRAS_CHOSEN "/extras/(${MJENV_EXTRAS_CHOSEN})/")
endif()
file(GLOB files CONFIGURE_DEPENDS extras/*/CMakeLists.txt)
list(FILTER files INCLUDE REGEX "${MJENV_EXTRAS_CHOSEN}")
# The library looks for plug-ins in its own folder.
set(CMAKE_LIBRARY_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
if(WIN32 OR EMSCRIPTEN)
  set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
endif()

# The programs' Python packages, which the wheel has beside mjenv.
file(GLOB MJENV_EXTRAS_PYTHON CONFIGURE_DEPENDS extras/*/python)
list(FILTER MJENV_EXTRAS_PYTHON INCLUDE REGEX "${MJENV_EXTRAS_CHOSEN}")
set_property(GLOBAL PROPERTY MJENV_BESIDE_PYTHON ${MJENV_EXTRAS_PYTHON})

# mjenv_add_plugin(NAME FOLDER SOURCE...): the plug-in libmjenv-NAME.so beside the library, of tasks with headers in FOLDER
function(mjenv_add_plugin name folder)
  mjenv_add_tasks(mjenv_${name} ${ARGN})
  set_target_properties(mjenv_${name} PROPERTIES OUTPUT_NAME mjenv-${name})
  mjenv_use_math(mjenv_${name})
  target_include_directories(mjenv_${name} PRIVATE ${folder})
  target_compile_options(mjenv_${name} PRIVATE -Wall -Wextra -Wpedantic -Wshadow $<$<BOOL:${MJENV_WERROR}>:-Werror>)
  mjenv_install_beside(mjenv_${name})
endfunction()

# mjenv_install_beside(TARGET [HEADERS FOLDER]): packages have this library in the folder of libmjenv, and these headers beside
# mjenv's. A library that programs link is the component of the CMake package with the target's name without mjenv_.
function(mjenv_install_beside target)
  cmake_parse_arguments(PARSE_ARGV 1 beside "" HEADERS "")
  set_property(GLOBAL APPEND PROPERTY MJENV_BESIDE ${target})
  get_target_property(type ${target} TYPE)
  if(type STREQUAL MODULE_LIBRARY)
    install(TARGETS ${target} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime)
    return()
  endif()
  string(REPLACE mjenv_ "" component ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${component})
  install(TARGETS ${target} EXPORT mjenv-${component}-targets
          LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT runtime NAMELINK_COMPONENT development
          RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime
          ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  install(EXPORT mjenv-${component}-targets NAMESPACE mjenv:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/mjenv COMPONENT development)
  if(beside_HEADERS)
    get_filename_component(headers ${beside_HEADERS} ABSOLUTE)
    set_property(GLOBAL APPEND PROPERTY MJENV_BESIDE_HEADERS ${headers})
    install(DIRECTORY ${headers}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
  endif()
endfunction()

foreach(file IN LISTS files)
  get_filename_component(folder ${file} DIRECTORY)
  add_subdirectory(${folder})
endforeach()
get_property(beside GLOBAL PROPERTY MJENV_BESIDE)
add_custom_target(extras DEPENDS ${beside})
