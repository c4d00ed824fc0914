# MJENV_MATH: whose sin, cos, exp and so on the engine and the core call. With `portable`, defines mjenv_math, which is
# glibc's functions under names of their own, and makes the calls go there.
# Gymnasium's bits are those of glibc, which Windows, macOS and WebAssembly lack.
set(math_default system)
if(WIN32 OR APPLE OR EMSCRIPTEN)
  set(math_default portable)
endif()
set(MJENV_MATH ${math_default} CACHE STRING "system: the C library's functions, as Gymnasium beside this library has them. portable: \
glibc's, compiled in (LGPL-2.1-or-later), for the same bits on every CPU and system")
set_property(CACHE MJENV_MATH PROPERTY STRINGS system portable)
set(MJENV_MATH_SOURCES "" CACHE PATH "Folder with the folder glibc; empty: tools/engine-sources fetches it")
if(MJENV_MATH STREQUAL system AND math_default STREQUAL system)
  return()
elseif(NOT MJENV_MATH STREQUAL portable)
  message(FATAL_ERROR "MJENV_MATH is ${MJENV_MATH}, neither system (not on Windows, not on macOS, not in WebAssembly) nor portable")
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

# mjenv_fused(NAME FUNCTIONS [PATTERN REPLACEMENT COUNT]...)
#
# Writes NAME.cpp, which is glibc's NAME.c with Real in place of double, and the functions for doubles, "sin(double x)" for
# instance.
# Real fuses within an expression. COUNT places that match the regular expression PATTERN are replaced: where glibc's build
# fuses a product with an addition in a later statement, where it computes a product once for two branches and so fuses it
# in neither, and where C++ demands a conversion.
function(mjenv_fused name functions)
  file(READ ${math_glibc}/${name}.c text)
  while(ARGN)
    list(POP_FRONT ARGN pattern replacement count)
    string(REGEX MATCHALL "${pattern}" matches "${text}")
    list(LENGTH matches found)
    if(NOT found EQUAL count)
      message(FATAL_ERROR "${math_glibc}/${name}.c has ${found} of ${count} places like ${pattern}")
    endif()
    string(REGEX REPLACE "${pattern}" "${replacement}" text "${text}")
  endwhile()
  set(before "// glibc's ${name}.c, changed by cmake/math.cmake: Real in place of double, and some statements.
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
mjenv_fused(s_tan "tan(double x)"
  "t2 \\*= x \\* x2" "const auto product = t2 * (x * x2)" 1
  "y = x \\+ t2" "y = x + product" 1)
mjenv_fused(e_asin "asin(double x);acos(double x)"
  "t = (asncs[^;]*)" "const auto product = \\1" 10
  "t\\+=p" "t = product + p" 10
  "t = (\\(+f6[^;]*)" "const auto product = \\1" 2
  "res = x\\+t" "res = x + product" 1
  "\\+hp1\\.x\\)-t" "+ hp1.x) - product" 1
  "-\\(y\\+cc\\)\\*p" "- (double)((y + cc) * p)" 1
  "cc\\+p\\*\\(y\\+cc\\)" "cc + (double)(p * (y + cc))" 1
  "0:2\\.0\\*hp0\\.x" "0:(double)(2.0 * hp0.x)" 1)
mjenv_fused(e_atan2 "atan2(double y, double x)"
  "i = (\\(TWO52[^;]*)" "i = (int)(\\1)" 4)
# In `specialcase`, exp and pow use one product in two branches.
set(in_specialcase
  "y = scale \\+ scale \\* tmp" "y = scale + (double)(scale * tmp)" 1
  "scale - y \\+ scale \\* tmp" "scale - y + (double)(scale * tmp)" 1)
mjenv_fused(e_exp "exp(double x)" ${in_specialcase}
  "z \\+ Shift" "InvLn2N * x + Shift" 1)
mjenv_fused(e_log "log(double x)"
  "y = r3 \\*" "const auto product = r3 *" 1
  "y \\+= lo" "y = product + lo" 1)
mjenv_fused(s_log1p "log1p(double x)"
  "R1 = z \\* Lp" "const auto product = z * Lp" 1
  "R = R1" "R = product" 1
  "s \\* \\(hfsq \\+ R\\)" "(double)(s * (hfsq + R))" 2)
mjenv_fused(e_pow "pow(double x, double y)" ${in_specialcase}
  "z \\+ Shift" "InvLn2N * x + Shift" 1
  "p = \\(ar3" "const auto product = (ar3" 1
  "lo4 \\+ p" "lo4 + product" 1)

# glibc compiles these without FMA, and tables.
foreach(name branred sincostab e_exp_data e_log_data e_pow_log_data)
  list(APPEND math_files ${math_glibc}/${name}.c)
endforeach()
set_property(SOURCE ${math_files} APPEND PROPERTY INCLUDE_DIRECTORIES ${math_generated} ${math_glibc})
add_library(mjenv_math STATIC ${math_files} ${CMAKE_CURRENT_LIST_DIR}/math/choose.cpp ${CMAKE_CURRENT_LIST_DIR}/math/errors.cpp
                              ${CMAKE_CURRENT_LIST_DIR}/math/fma.cpp ${CMAKE_CURRENT_LIST_DIR}/math/sort.c)
mjenv_tune(mjenv_math)
# The code belongs to another project, so its warnings are not shown.
target_compile_options(mjenv_math PRIVATE -w $<$<COMPILE_LANGUAGE:CXX>:-Wno-narrowing>)
# Not optimised at link time, because the compiler may still make calls of them after it has dropped what nothing calls.
set_target_properties(mjenv_math PROPERTIES C_STANDARD 11 UNITY_BUILD OFF EXPORT_COMPILE_COMMANDS OFF
                                            INTERPROCEDURAL_OPTIMIZATION OFF)

# gcc would make one call of the C library's sincos of a sin and a cos.
target_compile_options(mjenv_engine PUBLIC "SHELL:-include ${CMAKE_CURRENT_LIST_DIR}/math/redirect.h" -fno-builtin-sin
                                           -fno-builtin-cos)
target_link_libraries(mjenv_engine PUBLIC mjenv_math)

configure_file(${math_sources}/glibc/COPYING.LIB ${CMAKE_CURRENT_BINARY_DIR}/generated/licenses/glibc.txt COPYONLY)
