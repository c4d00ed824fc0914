// NumPy's arithmetic (mjenv/numpy.hpp), and how NumPy rounds norms on this machine.
#pragma once

#include "mjenv/numpy.hpp"

namespace mjenv::core::np {

using mjenv::np::Norm;

// The norm as NumPy computes it on this CPU, with the present value of the environment variable OPENBLAS_CORETYPE.
Norm norm_as_numpy_here();

}  // namespace mjenv::core::np
