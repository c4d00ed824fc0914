# Makes mjenv.wasm, the library as one WebAssembly module without threads. A plug-in of extras/ is in a module of its own, which
# also has the library, because most programs need not load it. bindings/javascript/build makes the package of them.
# MJENV_TASK_SOURCES are in all of them.
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

# mjenv_compile_tasks(TARGET SOURCE...): a library of objects, which does not see the core's settings.
function(mjenv_compile_tasks target)
  add_library(${target} OBJECT ${ARGN})
  mjenv_tune(${target})
  mjenv_use_math(${target})
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/capi/include)
  target_link_libraries(${target} PRIVATE Eigen3::Eigen)
endfunction()

# mjenv_add_module(TARGET NAME [TASKS]...): NAME.wasm, with the tasks of these libraries and of MJENV_TASK_SOURCES
function(mjenv_add_module target name)
  add_executable(${target} $<TARGET_OBJECTS:mjenv> $<TARGET_OBJECTS:mjenv_core>)
  if(TARGET mjenv_wasm_own)
    list(APPEND ARGN mjenv_wasm_own)
  endif()
  if(ARGN)
    foreach(tasks IN LISTS ARGN ITEMS mjenv_wasm_register)
      target_sources(${target} PRIVATE $<TARGET_OBJECTS:${tasks}>)
    endforeach()
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

mjenv_compile_tasks(mjenv_wasm_register cmake/emscripten/tasks.cpp)
if(MJENV_TASK_SOURCES)
  mjenv_compile_tasks(mjenv_wasm_own ${MJENV_TASK_SOURCES})
endif()
mjenv_add_module(mjenv_wasm mjenv)

if(MJENV_BUILD_TESTS)
  mjenv_compile_tasks(mjenv_wasm_tasks_tasks examples/tasks/cartpole/cartpole.cpp tests/tasks/groups.cpp)
  mjenv_add_module(mjenv_wasm_tasks mjenv-tasks mjenv_wasm_tasks_tasks)
endif()

configure_file(${EMSCRIPTEN_ROOT_PATH}/system/lib/libc/musl/COPYRIGHT ${CMAKE_CURRENT_BINARY_DIR}/generated/licenses/musl.txt COPYONLY)
