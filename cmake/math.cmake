# MJENV_MATH: whose sin, cos, exp and so on the engine and the core call. With `portable`, defines mjenv_math, which is
# glibc's functions under names of their own, and makes the calls go there.
# Gymnasium's bits are those of glibc, which Windows and WebAssembly lack.
set(math_default system)
if(WIN32 OR EMSCRIPTEN)
  set(math_default portable)
endif()
set(MJENV_MATH ${math_default} CACHE STRING "system: the C library's functions, which Gymnasium on the same machine calls, too. portable: \
glibc's, compiled in (LGPL-2.1-or-later), for the same bits on every CPU and system")
set_property(CACHE MJENV_MATH PROPERTY STRINGS system portable)
set(MJENV_MATH_SOURCES "" CACHE PATH "Folder with the folder glibc; empty: tools/engine-sources fetches it")
# mjenv_use_math(TARGET): makes the target call mjenv_math's functions, if there is mjenv_math.
function(mjenv_use_math target)
  if(TARGET mjenv_math)
    # gcc would combine a sin and a cos into one call of the C library's sincos.
    target_compile_options(${target} PUBLIC "SHELL:-include ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/math/redirect.h" -fno-builtin-sin
                                            -fno-builtin-cos)
    target_link_libraries(${target} PUBLIC mjenv_math)
  endif()
endfunction()
if(MJENV_MATH STREQUAL system AND math_default STREQUAL system)
  return()
elseif(NOT MJENV_MATH STREQUAL portable)
  message(FATAL_ERROR "MJENV_MATH is ${MJENV_MATH}, neither system (not on Windows, not in WebAssembly) nor portable")
endif()
get_target_property(math_engine mjenv_engine TYPE)
if(NOT math_engine STREQUAL STATIC_LIBRARY)
  message(FATAL_ERROR "MJENV_MATH=portable needs the engine compiled in (MJENV_ENGINE=source): a library of MuJoCo calls the \
C library's functions")
endif()

set(math_sources ${MJENV_MATH_SOURCES})
if(NOT math_sources)
  execute_process(COMMAND ${PROJECT_SOURCE_DIR}/tools/engine-sources math OUTPUT_VARIABLE math_sources
                  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
endif()
set(math_glibc ${math_sources}/glibc/sysdeps/ieee754/dbl-64)
if(NOT EXISTS ${math_glibc}/s_sin.c)
  message(FATAL_ERROR "${math_sources} contains no sources of glibc")
endif()
message(STATUS "Math: glibc's, from ${math_sources}")
set(math_generated ${CMAKE_CURRENT_BINARY_DIR}/generated/math)

# The headers that glibc.h stands for.
foreach(header math.h math_private.h fenv_private.h math-underflow.h math-barriers.h math-narrow-eval.h math-svid-compat.h
        libm-alias-double.h libm-alias-finite.h libc-diag.h nan-high-order-bit.h endian.h)
  file(CONFIGURE OUTPUT ${math_generated}/${header} CONTENT "#include \"${CMAKE_CURRENT_LIST_DIR}/math/glibc.h\"\n")
endforeach()

# Copies of the functions, in which cmake/math/glibc.patch changes some statements and says why.
find_program(MJENV_PATCH patch REQUIRED)
set(math_patched ${math_generated}/glibc)
foreach(name s_sin s_tan e_asin e_atan2 e_exp e_log s_expm1 s_log1p e_pow)
  configure_file(${math_glibc}/${name}.c ${math_patched}/${name}.c COPYONLY)
endforeach()
execute_process(COMMAND ${MJENV_PATCH} --silent --strip=1 --fuzz=0 --directory=${math_patched}
                        --input=${CMAKE_CURRENT_LIST_DIR}/math/glibc.patch COMMAND_ERROR_IS_FATAL ANY)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_LIST_DIR}/math/glibc.patch)

# mjenv_fused(NAME FUNCTIONS)
#
# Writes NAME.cpp, which is the patched NAME.c with Real in place of double, and the functions for doubles,
# "sin(double x)" for instance.
function(mjenv_fused name functions)
  file(READ ${math_patched}/${name}.c text)
  set(before "// glibc's ${name}.c, changed by cmake/math.cmake and cmake/math/glibc.patch: Real in place of double, and some statements.
#include \"${CMAKE_CURRENT_FUNCTION_LIST_DIR}/math/arithmetic.hpp\"
#include \"${CMAKE_CURRENT_FUNCTION_LIST_DIR}/math/glibc.h\"
#define __branred MJENV_NAME(branred_of_${name})
#define double Real
extern \"C\" {
")
  set(after "
}
#undef double
")
  if(text MATCHES "__branred")
    string(APPEND after "extern \"C\" int __branred(Real x, Real* high, Real* low) {
  return mjenv_branred(x.value, &high->value, &low->value);
}
")
  endif()
  foreach(function IN LISTS functions)
    string(REGEX MATCH "^[a-z0-9]+" public "${function}")
    string(REGEX REPLACE "^[a-z0-9]+" "" parameters "${function}")
    string(REPLACE "double " "" arguments "${parameters}")
    set(own __${public})
    if(NOT text MATCHES "\n${own} ?\\(")
      set(own __ieee754_${public})
    endif()
    string(APPEND before "#define ${own} MJENV_NAME(glibc_${public})\n")
    string(APPEND after "extern \"C\" double MJENV_NAME(${public})${parameters} { return ${own}${arguments}.value; }\n")
  endforeach()
  file(CONFIGURE OUTPUT ${math_generated}/${name}.cpp CONTENT "${before}${text}${after}" @ONLY)
  foreach(variant IN LISTS math_variants)
    file(CONFIGURE OUTPUT ${math_generated}/${name}${variant}.cpp CONTENT "#define MJENV_VARIANT ${variant}\n#include \"${name}.cpp\"\n")
    list(APPEND math_files ${math_generated}/${name}${variant}.cpp)
    if(variant STREQUAL _fma)
      set_property(SOURCE ${math_generated}/${name}${variant}.cpp PROPERTY COMPILE_OPTIONS -mfma)
    endif()
  endforeach()
  set(math_files "${math_files}" PARENT_SCOPE)
endfunction()

set(math_variants _all)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$")
  set(math_variants _fma _soft)
endif()
set(math_files "")
mjenv_fused(s_sin "sin(double x);cos(double x)")
mjenv_fused(s_tan "tan(double x)")
mjenv_fused(e_asin "asin(double x);acos(double x)")
mjenv_fused(e_atan2 "atan2(double y, double x)")
mjenv_fused(e_exp "exp(double x)")
mjenv_fused(e_log "log(double x)")
mjenv_fused(s_expm1 "expm1(double x)")
mjenv_fused(s_log1p "log1p(double x)")
mjenv_fused(e_pow "pow(double x, double y)")

# branred, which glibc compiles without FMA, and tables.
foreach(name branred sincostab e_exp_data e_log_data e_pow_log_data)
  list(APPEND math_files ${math_glibc}/${name}.c)
endforeach()
set_property(SOURCE ${math_files} APPEND PROPERTY INCLUDE_DIRECTORIES ${math_generated} ${math_glibc})
add_library(mjenv_math STATIC ${math_files} ${CMAKE_CURRENT_LIST_DIR}/math/choose.cpp ${CMAKE_CURRENT_LIST_DIR}/math/errors.cpp
                              ${CMAKE_CURRENT_LIST_DIR}/math/fma.cpp ${CMAKE_CURRENT_LIST_DIR}/math/sort.c)
mjenv_tune(mjenv_math)
# The code belongs to another project, so its warnings are not shown.
target_compile_options(mjenv_math PRIVATE -w $<$<COMPILE_LANGUAGE:CXX>:-Wno-narrowing>)
# Not optimised at link time, because the compiler may still generate calls of these functions after it has dropped
# those that nothing calls.
set_target_properties(mjenv_math PROPERTIES C_STANDARD 11 UNITY_BUILD OFF EXPORT_COMPILE_COMMANDS OFF
                                            INTERPROCEDURAL_OPTIMIZATION OFF)

mjenv_use_math(mjenv_engine)

configure_file(${math_sources}/glibc/COPYING.LIB ${CMAKE_CURRENT_BINARY_DIR}/generated/licenses/glibc.txt COPYONLY)
