# mjenv_add_tasks(my_robots cartpole.cpp [more.c ...] [MODELS cartpole.xml ...])
#
# Builds a plug-in: libmy_robots.so with the tasks that C sources (mjenv/task.h) or C++17 sources (mjenv/task.hpp, which
# needs Eigen) define. The models are copied to its folder, where a task finds them as "./cartpole.xml". The plug-in
# does not link with libmjenv.
function(mjenv_add_tasks name)
  cmake_parse_arguments(PARSE_ARGV 1 tasks "" "" MODELS)
  add_library(${name} MODULE ${tasks_UNPARSED_ARGUMENTS})
  set_target_properties(${name} PROPERTIES PREFIX lib C_VISIBILITY_PRESET hidden CXX_VISIBILITY_PRESET hidden)
  if(NOT WIN32)  # where it would also hide the inline function that a plug-in exports
    set_property(TARGET ${name} PROPERTY VISIBILITY_INLINES_HIDDEN ON)
  endif()
  set(library mjenv::mjenv)
  if(NOT TARGET mjenv::mjenv)
    set(library mjenv::mujoco4)
  endif()
  target_include_directories(${name} PRIVATE $<TARGET_PROPERTY:${library},INTERFACE_INCLUDE_DIRECTORIES>)
  # NumPy does not fuse multiplications with additions.
  target_compile_options(${name} PRIVATE -ffp-contract=off)
  if(NOT tasks_UNPARSED_ARGUMENTS MATCHES "\\.c(;|$)" OR tasks_UNPARSED_ARGUMENTS MATCHES "\\.(cpp|cc|cxx)(;|$)")
    if(NOT TARGET Eigen3::Eigen)
      find_package(Eigen3 REQUIRED NO_MODULE)
    endif()
    target_link_libraries(${name} PRIVATE Eigen3::Eigen)
    target_compile_features(${name} PRIVATE cxx_std_17)
  endif()
  if(MINGW)  # so that it needs none of the compiler's DLLs
    target_link_options(${name} PRIVATE -static)
  endif()
  foreach(model IN LISTS tasks_MODELS)
    add_custom_command(TARGET ${name} POST_BUILD
      COMMAND ${CMAKE_COMMAND} -E copy_if_different ${CMAKE_CURRENT_SOURCE_DIR}/${model} $<TARGET_FILE_DIR:${name}>)
  endforeach()
endfunction()
