# Each of OBJECTS, of which there must be COUNT, is compiled for one instruction set, so it may offer the linker nothing but
# the table of its functions. Of a weak symbol, such as an inline function or an instantiated template of the standard
# library, the linker keeps one definition for the whole program. If it kept one from these objects, an older CPU would
# end at it.
list(LENGTH OBJECTS count)
if(NOT count EQUAL COUNT)
  message(FATAL_ERROR "${count} object files, not ${COUNT}: ${OBJECTS}")
endif()
foreach(object IN LISTS OBJECTS)
  execute_process(COMMAND ${NM} --defined-only --extern-only ${object} OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL "[^\n]+" symbols "${text}")
  list(FILTER symbols EXCLUDE REGEX " [RD] _ZN5mjenv4core5lanes(4sse2|4avx2|6avx512|4neon)E$")
  if(symbols)
    message(SEND_ERROR "${object} shares with the whole program: ${symbols}")
  endif()
  if(NOT text MATCHES "_ZN5mjenv4core5lanes")
    message(SEND_ERROR "${object} has no table of functions")
  endif()
endforeach()
