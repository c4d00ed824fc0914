// Includes MuJoCo's headers, and hides the differences between the supported versions of MuJoCo: mujoco2.hpp (2.2.2)
// and mujoco4.hpp (4.0) define the same names. Which version is compiled is tested only here, in lanes/frame/version.hpp
// and version_code.hpp, and in task/registry.cpp, which lists Pusher-v4 on MuJoCo 2 alone.
#pragma once

#include <mujoco/mjxmacro.h>
#include <mujoco/mujoco.h>

#include <cstring>

#if mjVERSION_HEADER == 222
#include "engine/mujoco2.hpp"
#elif mjVERSION_HEADER >= 4000000 && mjVERSION_HEADER < 4001000
#include "engine/mujoco4.hpp"
#else
#error "mjenv works with MuJoCo 2.2.2 and 4.0"
#endif

namespace mjenv::core {

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-variable"  // the preambles declare sizes that not every array uses

// Calls visit(name, pointer, rows, columns, is_vector) for each array of mjModel.
template <typename Visit>
void for_each_array(const mjModel& model, const Visit& visit) {
  const mjModel* m = &model;
  MJMODEL_POINTERS_PREAMBLE(m)
#define X(type, name, rows, columns) visit(#name, m->name, m->rows, columns, std::strcmp(#columns, "1") == 0);
  MJMODEL_POINTERS
#undef X
}

// Calls visit in the same way for each array of mjData. data must belong to the model, or be null.
template <typename Visit>
void for_each_array(const mjModel& model, const mjData* data, const Visit& visit) {
  const mjModel* m = &model;
  MJDATA_POINTERS_PREAMBLE(m)
#define X(type, name, rows, columns)                                                    \
  visit(#name, data ? static_cast<const type*>(data->name) : nullptr, m->rows, columns, \
        std::strcmp(#columns, "1") == 0);
  MJDATA_POINTERS
#undef X
}

#pragma GCC diagnostic pop

}  // namespace mjenv::core
