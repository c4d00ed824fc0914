# The CMake package inside the Python package, two folders above: mjenv::mjenv on MuJoCo 2.2.2; mjenv::NAME for each
# libmjenv-NAME beside it, such as mjenv::mujoco4 on MuJoCo 4.0; and mjenv_add_tasks.
get_filename_component(mjenv_folder ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
function(mjenv_add_library target file import)  # import: what a program links on Windows
  if(EXISTS ${mjenv_folder}/${file} AND NOT TARGET ${target})
    add_library(${target} SHARED IMPORTED)
    set_target_properties(${target} PROPERTIES IMPORTED_LOCATION ${mjenv_folder}/${file}
                                               INTERFACE_INCLUDE_DIRECTORIES ${mjenv_folder}/include)
    if(WIN32)
      set_property(TARGET ${target} PROPERTY IMPORTED_IMPLIB ${mjenv_folder}/${import})
    endif()
  endif()
endfunction()
if(WIN32)
  mjenv_add_library(mjenv::mjenv mjenv.dll mjenv.lib)
else()
  mjenv_add_library(mjenv::mjenv libmjenv${CMAKE_SHARED_LIBRARY_SUFFIX} "")
endif()
file(GLOB files RELATIVE ${mjenv_folder} ${mjenv_folder}/libmjenv-*${CMAKE_SHARED_LIBRARY_SUFFIX})
foreach(file IN LISTS files)
  string(REGEX REPLACE "^libmjenv-(.*)\\..*$" "\\1" name ${file})
  mjenv_add_library(mjenv::${name} ${file} ${file}.a)
endforeach()
include(${CMAKE_CURRENT_LIST_DIR}/mjenv-tasks.cmake)
