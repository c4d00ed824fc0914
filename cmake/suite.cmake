# dm_control's suite: the plug-in libmjenv-suite.so, and in WebAssembly, which has no plug-ins, mjenv_suite_sources for a
# module of its own. Its models are compiled into it, each as one text without includes, so that it is one file.

# Sets output to a file's text, in which each <include file="..."/> is replaced by what that file contains.
function(mjenv_read_model file output)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
  file(READ ${file} text)
  string(REGEX MATCHALL "<include file=\"[^\"]*\"/>" includes "${text}")
  get_filename_component(folder ${file} DIRECTORY)
  foreach(include IN LISTS includes)
    string(REGEX REPLACE ".*\"(.*)\".*" "${folder}/\\1" included "${include}")
    mjenv_read_model(${included} content)
    string(REGEX REPLACE ".*<mujocoinclude>\n(.*)</mujocoinclude>.*" "\\1" content "${content}")
    string(STRIP "${content}" content)
    string(REPLACE "${include}" "${content}" text "${text}")
  endforeach()
  set(${output} "${text}" PARENT_SCOPE)
endfunction()

file(GLOB files CONFIGURE_DEPENDS assets/dm_control/*.xml)
set(entries "")
foreach(file IN LISTS files)
  mjenv_read_model(${file} text)
  if(text MATCHES "<mujoco model=")
    get_filename_component(name ${file} NAME_WE)
    string(APPEND entries "    {\"${name}\", R\"mjcf(${text})mjcf\"},\n")
  endif()
endforeach()
file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/generated/suite_models.cpp @ONLY CONTENT
"#include \"models.hpp\"

namespace suite {

const Model models[] = {
@entries@};
const std::size_t model_count = sizeof models / sizeof models[0];

}  // namespace suite
")

file(GLOB mjenv_suite_sources CONFIGURE_DEPENDS suite/*.cpp)
list(APPEND mjenv_suite_sources ${CMAKE_CURRENT_BINARY_DIR}/generated/suite_models.cpp)
if(EMSCRIPTEN)
  return()
endif()
include(mjenv-tasks)
mjenv_add_tasks(mjenv_suite ${mjenv_suite_sources})
set_target_properties(mjenv_suite PROPERTIES OUTPUT_NAME mjenv-suite)
mjenv_use_math(mjenv_suite)
target_include_directories(mjenv_suite PRIVATE suite)
target_compile_options(mjenv_suite PRIVATE -Wall -Wextra -Wpedantic -Wshadow $<$<BOOL:${MJENV_WERROR}>:-Werror>)
