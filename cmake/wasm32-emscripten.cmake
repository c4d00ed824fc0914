# Compiles for WebAssembly with Emscripten (tools/setup javascript):
# cmake -B build-javascript --toolchain cmake/wasm32-emscripten.cmake
find_program(EMCC emcc REQUIRED)
file(REAL_PATH ${EMCC} emcc)
get_filename_component(emscripten ${emcc} DIRECTORY)
include(${emscripten}/cmake/Modules/Platform/Emscripten.cmake)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE BOTH)  # Eigen consists of headers alone
