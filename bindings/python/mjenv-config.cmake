# The CMake package inside the Python package, two folders above: mjenv::mjenv, and mjenv_add_tasks.
get_filename_component(mjenv_folder ${CMAKE_CURRENT_LIST_DIR}/../.. ABSOLUTE)
if(NOT TARGET mjenv::mjenv)
  add_library(mjenv::mjenv SHARED IMPORTED)
  set_target_properties(mjenv::mjenv PROPERTIES IMPORTED_LOCATION ${mjenv_folder}/libmjenv.so
                                                INTERFACE_INCLUDE_DIRECTORIES ${mjenv_folder}/include)
endif()
include(${CMAKE_CURRENT_LIST_DIR}/mjenv-tasks.cmake)
