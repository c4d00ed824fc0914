// NumPy's arithmetic (mjenv/numpy.hpp), and which of OpenBLAS's roundings is NumPy's here.
#pragma once

#include "mjenv/numpy.hpp"

namespace mjenv::core::np {

using mjenv::np::clip;
using mjenv::np::Norm;
using mjenv::np::power2;
using mjenv::np::Scalar;
using mjenv::np::sum;
using mjenv::np::sum_square;

// Rounds as NumPy's OpenBLAS does on this CPU with this environment variable OPENBLAS_CORETYPE.
Norm norm_as_numpy_here();

}  // namespace mjenv::core::np
