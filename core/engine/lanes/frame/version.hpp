// The arrays and functions of the version of MuJoCo for which the library is compiled.
#pragma once

#include <mujoco/mujoco.h>

#if mjVERSION_HEADER == 222
#include "engine/lanes/mujoco2/lanes.hpp"
#else
#include "engine/lanes/mujoco4/lanes.hpp"
#endif
