# Makes defects harder to exploit. MuJoCo's code that simulates steps gets no guards of stacks, because no
# foreign text or file reaches it.
option(MJENV_HARDEN "Guard stacks and copies, and make what the loader writes read-only" ON)

function(mjenv_harden)
  if(NOT MJENV_HARDEN OR MJENV_SANITIZE)
    return()
  endif()
  foreach(target IN LISTS ARGN)
    get_target_property(type ${target} TYPE)
    if(type STREQUAL INTERFACE_LIBRARY)
      continue()
    endif()
    # Checked copies need an optimising compiler.
    target_compile_options(${target} PRIVATE
      $<$<CONFIG:Release,RelWithDebInfo,MinSizeRel>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=2>)
    if(NOT target STREQUAL mjenv_engine)
      target_compile_options(${target} PRIVATE -fstack-protector-strong)
    else()  # the parts of the engine that read models, meshes and pictures
      get_target_property(readers mjenv_engine SOURCES)
      list(FILTER readers INCLUDE REGEX "/mujoco/src/(user|xml)/|/engine_(file|io|vfs)\\.c$|/qhull/|/tinyxml2/|/lodepng/")
      set_property(SOURCE ${readers} APPEND PROPERTY COMPILE_OPTIONS -fstack-protector-strong)
    endif()
    if(type STREQUAL SHARED_LIBRARY AND NOT WIN32)
      target_link_options(${target} PRIVATE -Wl,-z,relro -Wl,-z,now -Wl,-z,noexecstack)
    endif()
  endforeach()
endfunction()
