#include "error.hpp"
#include "render/gl.hpp"

namespace mjenv::gl {

std::unique_ptr<Context> open_glfw(int, int) { fail(MJENV_E_RENDER, "glfw: not offered yet"); }

}  // namespace mjenv::gl
