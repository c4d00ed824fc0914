# The CMake package inside the Python package, two folders above: mjenv::mjenv on MuJoCo 2.2.2, and where they are there,
# mjenv::mujoco4 on MuJoCo 4.0 and mjenv::learn; and mjenv_add_tasks.
get_filename_component(mjenv_folder ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
function(mjenv_add_library target file)  # on Windows, the third argument is the file that a program links
  if(EXISTS ${mjenv_folder}/${file} AND NOT TARGET ${target})
    add_library(${target} SHARED IMPORTED)
    set_target_properties(${target} PROPERTIES IMPORTED_LOCATION ${mjenv_folder}/${file}
                                               INTERFACE_INCLUDE_DIRECTORIES ${mjenv_folder}/include)
    if(ARGC GREATER 2)
      set_property(TARGET ${target} PROPERTY IMPORTED_IMPLIB ${mjenv_folder}/${ARGV2})
    endif()
  endif()
endfunction()
if(WIN32)
  mjenv_add_library(mjenv::mjenv mjenv.dll mjenv.lib)
  mjenv_add_library(mjenv::learn libmjenv-learn.dll libmjenv-learn.dll.a)
else()
  mjenv_add_library(mjenv::mjenv libmjenv${CMAKE_SHARED_LIBRARY_SUFFIX})
  mjenv_add_library(mjenv::learn libmjenv-learn${CMAKE_SHARED_LIBRARY_SUFFIX})
endif()
mjenv_add_library(mjenv::mujoco4 libmjenv-mujoco4.so)
include(${CMAKE_CURRENT_LIST_DIR}/mjenv-tasks.cmake)
