//! Sums, norms and scalars that round as NumPy's do, for tasks that must return the same bits as a Python original.

use std::ops::{Mul, Neg};

/// `numpy.sum(values)`. NumPy adds fewer than 8 numbers one after the other and up to 128 numbers in eight accumulators;
/// it splits longer arrays into halves.
pub fn sum(values: &[f64]) -> f64 {
    sum_of(values, |value| value)
}

/// `numpy.sum(numpy.square(values))`.
pub fn sum_square(values: &[f64]) -> f64 {
    sum_of(values, |value| value * value)
}

/// `numpy.clip` of one number. NaN stays NaN; if `low` is above `high`, the result is `high`.
pub fn clip(value: f64, low: f64, high: f64) -> f64 {
    let raised = if value < low { low } else { value };
    if raised > high {
        high
    } else {
        raised
    }
}

/// A float type in which a sum is computed.
pub(crate) trait Float: Copy + std::ops::Add<Output = Self> + Mul<Output = Self> {
    const ZERO: Self;
}

impl Float for f32 {
    const ZERO: Self = 0.0;
}

impl Float for f64 {
    const ZERO: Self = 0.0;
}

pub(crate) fn sum_of<F: Float>(values: &[f64], term: impl Fn(f64) -> F + Copy) -> F {
    const LANES: usize = 8;
    const BLOCK: usize = 128;
    let add = |total: F, &value: &f64| total + term(value);
    if values.len() < LANES {
        return values.iter().fold(F::ZERO, add);
    }
    if values.len() > BLOCK {
        let half = values.len() / 2;
        let (left, right) = values.split_at(half - half % LANES);
        return sum_of(left, term) + sum_of(right, term);
    }
    let mut lanes = [F::ZERO; LANES];
    for (lane, &value) in lanes.iter_mut().zip(values) {
        *lane = term(value);
    }
    let mut blocks = values[LANES..].chunks_exact(LANES);
    for block in blocks.by_ref() {
        for (lane, value) in lanes.iter_mut().zip(block) {
            *lane = add(*lane, value);
        }
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    blocks.remainder().iter().fold(((a + b) + (c + d)) + ((e + f) + (g + h)), add)
}

/// A NumPy scalar of the action's dtype. In a product with a Python float, NumPy first rounds the float to that dtype.
/// [`Action::sum_square`](crate::task::Action::sum_square) returns one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar {
    /// An np.float32.
    Float32(f32),
    /// An np.float64.
    Float64(f64),
}

impl From<Scalar> for f64 {
    fn from(scalar: Scalar) -> Self {
        match scalar {
            Scalar::Float32(value) => value.into(),
            Scalar::Float64(value) => value,
        }
    }
}

impl Neg for Scalar {
    type Output = Self;

    fn neg(self) -> Self {
        match self {
            Self::Float32(value) => Self::Float32(-value),
            Self::Float64(value) => Self::Float64(-value),
        }
    }
}

impl Mul<Scalar> for f64 {
    type Output = Scalar;

    fn mul(self, scalar: Scalar) -> Scalar {
        match scalar {
            Scalar::Float32(value) => Scalar::Float32(self as f32 * value),
            Scalar::Float64(value) => Scalar::Float64(self * value),
        }
    }
}

/// `numpy.linalg.norm` of two or three numbers. NumPy calls OpenBLAS, whose kernels for AVX-512 fuse the multiplication
/// with the addition, and so round once instead of twice. The option `norm` chooses.
/// [`Builder::norm`](crate::task::Builder::norm) returns one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Norm {
    pub(crate) fused: bool,
}

impl Norm {
    /// Returns the norm of the numbers.
    pub fn of<const N: usize>(self, numbers: [f64; N]) -> f64 {
        let add = |total: f64, x: f64| if self.fused { x.mul_add(x, total) } else { total + x * x };
        let squares =
            numbers.split_first().map_or(0.0, |(&first, rest)| rest.iter().fold(first * first, |t, &x| add(t, x)));
        squares.sqrt()
    }
}
