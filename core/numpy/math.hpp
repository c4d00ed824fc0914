// NumPy's arithmetic (mjenv/numpy.hpp), and how NumPy rounds norms on this machine.
#pragma once

#include "mjenv/numpy.hpp"

namespace mjenv::core::np {

using mjenv::np::clip;
using mjenv::np::Norm;
using mjenv::np::power2;
using mjenv::np::Scalar;
using mjenv::np::sum;
using mjenv::np::sum_square;

// The norm as NumPy computes it on this CPU, with the present value of the environment variable OPENBLAS_CORETYPE.
Norm norm_as_numpy_here();

}  // namespace mjenv::core::np
