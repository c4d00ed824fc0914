# Makes mjenv.wasm, the library as one WebAssembly module without threads, and of it and bindings/javascript the folder
# `package`, which is what npm packs.
set(MJENV_TASK_SOURCES "" CACHE STRING "Sources of tasks that are compiled in; one of them has MJENV_PLUGIN or MJENV_TASKS")

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
list(JOIN exported "," exported)

add_executable(mjenv_wasm $<TARGET_OBJECTS:mjenv> $<TARGET_OBJECTS:mjenv_core>)
mjenv_tune(mjenv_wasm)
set_target_properties(mjenv_wasm PROPERTIES OUTPUT_NAME mjenv SUFFIX .wasm)
target_link_libraries(mjenv_wasm PRIVATE mjenv_core)
# The stack lies below all else, so that its overflow is a trap and overwrites nothing. Files, threads and the like are
# left out: what the module asks of its host is in bindings/javascript/src/library.js.
target_link_options(mjenv_wasm PRIVATE
  -sSTANDALONE_WASM --no-entry -sWASM_BIGINT -sEXPORTED_FUNCTIONS=${exported} -sALLOW_MEMORY_GROWTH -sMAXIMUM_MEMORY=4GB
  -sINITIAL_MEMORY=32MB -sTOTAL_STACK=8MB -Wl,--stack-first)
