# The CMake package inside the Python package, two folders above: mjenv::mjenv on MuJoCo 2.2.2, mjenv::mujoco4 on MuJoCo 4.0
# if it is there, and mjenv_add_tasks.
get_filename_component(mjenv_folder ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
function(mjenv_add_library target file)
  if(EXISTS ${mjenv_folder}/${file} AND NOT TARGET ${target})
    add_library(${target} SHARED IMPORTED)
    set_target_properties(${target} PROPERTIES IMPORTED_LOCATION ${mjenv_folder}/${file}
                                               INTERFACE_INCLUDE_DIRECTORIES ${mjenv_folder}/include)
  endif()
endfunction()
if(WIN32)
  mjenv_add_library(mjenv::mjenv mjenv.dll)
  set_target_properties(mjenv::mjenv PROPERTIES IMPORTED_IMPLIB ${mjenv_folder}/mjenv.lib)
else()
  mjenv_add_library(mjenv::mjenv libmjenv.so)
endif()
mjenv_add_library(mjenv::mujoco4 libmjenv-mujoco4.so)
include(${CMAKE_CURRENT_LIST_DIR}/mjenv-tasks.cmake)
