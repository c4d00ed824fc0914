# Makes libmjenv.a, in which the core and the engine are one object that defines only mjenv_*. A program can therefore
# contain another MuJoCo as well.
option(MJENV_STATIC "Make libmjenv.a, too" OFF)
if(NOT MJENV_STATIC)
  return()
endif()
get_target_property(kind mjenv_engine TYPE)
if(NOT kind STREQUAL STATIC_LIBRARY)
  message(FATAL_ERROR "MJENV_STATIC needs the engine compiled in: MJENV_ENGINE=source")
endif()

set(relocatable -r -nostdlib -fPIC)
if(MJENV_USE_LTO)
  list(APPEND relocatable -O3 ${CMAKE_CXX_COMPILE_OPTIONS_IPO} ${MJENV_TUNE} ${MJENV_TUNE_LINK})
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    # The objects do not pass -fno-gnu-unique on, and objcopy leaves gcc's unique symbols global. gcc 12 crashes when it
    # divides the objects among partitions (add_symbol_to_partition_1), so there is one.
    list(APPEND relocatable -flinker-output=nolto-rel -fno-gnu-unique -flto-partition=one)
  endif()
endif()
set(archive ${CMAKE_CURRENT_BINARY_DIR}/libmjenv.a)
# ld dissolves the groups of inline functions, so that no other library's copies replace them.
add_custom_command(OUTPUT ${archive}
  COMMAND ${CMAKE_CXX_COMPILER} ${relocatable} -o mjenv-all.o
          $<TARGET_OBJECTS:mjenv> $<TARGET_OBJECTS:mjenv_core> $<TARGET_OBJECTS:mjenv_engine>
          $<$<TARGET_EXISTS:mjenv_math>:$<TARGET_OBJECTS:mjenv_math>>
  COMMAND ld -r --force-group-allocation -o mjenv.o mjenv-all.o
  COMMAND ${CMAKE_OBJCOPY} --strip-debug --wildcard --keep-global-symbol=mjenv_* mjenv.o
  COMMAND ${CMAKE_COMMAND} -E rm -f ${archive} mjenv-all.o
  COMMAND ${CMAKE_AR} rcs ${archive} mjenv.o
  DEPENDS mjenv mjenv_core mjenv_engine $<TARGET_NAME_IF_EXISTS:mjenv_math>
  COMMAND_EXPAND_LISTS VERBATIM)
add_custom_target(mjenv_static ALL DEPENDS ${archive})
install(FILES ${archive} DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
