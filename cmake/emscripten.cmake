# Makes mjenv.wasm, the library as one WebAssembly module without threads, and mjenv-suite.wasm, which also has dm_control's
# suite, in a file of its own because most programs need not load it. bindings/javascript/build makes the package of them.
set(MJENV_TASK_SOURCES "" CACHE STRING "C sources (mjenv/task.h) or C++ sources (mjenv/task.hpp) of tasks that are compiled in")

# All functions of the header but those that draw.
file(STRINGS capi/include/mjenv/mjenv.h declarations REGEX "^MJENV_API ")
set(exported _malloc _free)
foreach(declaration IN LISTS declarations)
  string(REGEX MATCH "mjenv_[a-z_]+\\(" function "${declaration}")
  string(REPLACE "(" "" function "${function}")
  if(NOT function MATCHES "^mjenv_(render|window)")
    list(APPEND exported _${function})
  endif()
endforeach()

# mjenv_add_module(TARGET NAME [TASKS]...): NAME.wasm
function(mjenv_add_module target name)
  add_executable(${target} $<TARGET_OBJECTS:mjenv> $<TARGET_OBJECTS:mjenv_core>)
  if(ARGN)
    # A library of its own, because it does not see the core's settings.
    add_library(${target}_tasks OBJECT ${ARGN} ${PROJECT_SOURCE_DIR}/cmake/emscripten/tasks.cpp)
    mjenv_tune(${target}_tasks)
    target_include_directories(${target}_tasks PRIVATE capi/include)
    target_link_libraries(${target}_tasks PRIVATE Eigen3::Eigen)
    target_sources(${target} PRIVATE $<TARGET_OBJECTS:${target}_tasks>)
    list(APPEND exported _mjenv_register_own_tasks)
  endif()
  list(JOIN exported "," exported)
  mjenv_tune(${target})
  set_target_properties(${target} PROPERTIES OUTPUT_NAME ${name} SUFFIX .wasm)
  target_link_libraries(${target} PRIVATE mjenv_core)
  # The stack lies below all else, so that its overflow is a trap and overwrites nothing. Emscripten's JavaScript is left
  # out: what the module asks of its host is in bindings/javascript/src/library.js.
  target_link_options(${target} PRIVATE
    -sSTANDALONE_WASM --no-entry -sWASM_BIGINT -sEXPORTED_FUNCTIONS=${exported} -sALLOW_MEMORY_GROWTH -sMAXIMUM_MEMORY=4GB
    -sINITIAL_MEMORY=32MB -sTOTAL_STACK=8MB -Wl,--stack-first)
endfunction()

mjenv_add_module(mjenv_wasm mjenv ${MJENV_TASK_SOURCES})
mjenv_add_module(mjenv_wasm_suite mjenv-suite ${mjenv_suite_sources} ${MJENV_TASK_SOURCES})
mjenv_use_math(mjenv_wasm_suite_tasks)
target_include_directories(mjenv_wasm_suite_tasks PRIVATE suite)
if(MJENV_BUILD_TESTS)
  mjenv_add_module(mjenv_wasm_tasks mjenv-tasks examples/tasks/cartpole/cartpole.cpp tests/tasks/groups.cpp)
endif()

configure_file(${EMSCRIPTEN_ROOT_PATH}/system/lib/libc/musl/COPYRIGHT ${CMAKE_CURRENT_BINARY_DIR}/generated/licenses/musl.txt COPYONLY)
