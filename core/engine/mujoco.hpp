// MuJoCo's headers, and common names for what differs between the versions of MuJoCo that mjenv works with. Only this
// header asks which version it is. mujoco2.hpp and mujoco4.hpp define the same names for 2.2.2 and for 4.0.
#pragma once

#include <mujoco/mjxmacro.h>
#include <mujoco/mujoco.h>

#if mjVERSION_HEADER == 222
#include "engine/mujoco2.hpp"
#elif mjVERSION_HEADER >= 4000000 && mjVERSION_HEADER < 4001000
#include "engine/mujoco4.hpp"
#else
#error "mjenv works with MuJoCo 2.2.2 and 4.0"
#endif
