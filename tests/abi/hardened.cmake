# The built library is hardened as cmake/harden.cmake asks. Usage: cmake -P hardened.cmake -- READELF LIBRARY
cmake_minimum_required(VERSION 3.22)
execute_process(COMMAND ${CMAKE_ARGV4} --wide --program-headers --dynamic --dyn-syms ${CMAKE_ARGV5} OUTPUT_VARIABLE text
                COMMAND_ERROR_IS_FATAL ANY)
foreach(wanted
        "GNU_RELRO"                        # made read-only
        "BIND_NOW|FLAGS_1.*NOW"            # before anything runs
        "GNU_STACK[^\n]* RW +0x"           # a stack that is not executable
        "__stack_chk_fail"                 # guarded stacks
        "__[a-z]+_chk")                    # checked copies
  if(NOT text MATCHES "${wanted}")
    message(SEND_ERROR "${CMAKE_ARGV5}: no ${wanted}")
  endif()
endforeach()
foreach(unwanted "TEXTREL" "LOAD[^\n]* RWE " "\\(RPATH\\)")
  if(text MATCHES "${unwanted}")
    message(SEND_ERROR "${CMAKE_ARGV5}: ${unwanted}")
  endif()
endforeach()
