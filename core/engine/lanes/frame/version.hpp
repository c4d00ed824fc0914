// The arrays and functions of the version of MuJoCo for which the library is compiled.
#pragma once

#include "engine/lanes/mujoco2/lanes.hpp"
