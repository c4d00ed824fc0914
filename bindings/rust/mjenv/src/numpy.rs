//! Sums, norms and scalars that round as NumPy's do, for tasks that must return the same bits as a Python original.

use std::ops::{Add, Mul, Neg};

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

pub(crate) fn sum_of<F: Copy + Default + Add<Output = F>>(values: &[f64], term: impl Fn(f64) -> F + Copy) -> F {
    const LANES: usize = 8;
    const BLOCK: usize = 128;
    let add = |total: F, &value: &f64| total + term(value);
    if values.len() < LANES {
        return values.iter().fold(F::default(), add);
    }
    if values.len() > BLOCK {
        let half = values.len() / 2;
        let (left, right) = values.split_at(half - half % LANES);
        return sum_of(left, term) + sum_of(right, term);
    }
    let mut lanes = [F::default(); LANES];
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
#[non_exhaustive]
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

/// `numpy.linalg.norm` of a vector. NumPy calls OpenBLAS, whose kernel for AVX-512 (fused) fuses each multiplication
/// with an addition, and so rounds once instead of twice; its kernel for AVX2 (plain) does so in whole blocks of 16
/// numbers. The option `norm` chooses. [`Builder::norm`](crate::task::Builder::norm) returns one.
///
/// Of more than 10000 numbers, NumPy's threads add parts, and this type does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Norm {
    fused: bool,
}

impl Norm {
    /// The numbers of a block, which OpenBLAS keeps in four vectors of AVX2.
    const BLOCK: usize = 16;

    /// Returns a norm that rounds like OpenBLAS's kernel for AVX-512 (`fused`), or like its kernel for AVX2.
    pub fn new(fused: bool) -> Self {
        Self { fused }
    }

    /// Returns the norm of the numbers.
    pub fn of(self, numbers: impl AsRef<[f64]>) -> f64 {
        let numbers = numbers.as_ref();
        let (blocks, rest) = numbers.split_at(numbers.len() - numbers.len() % Self::BLOCK);
        let total = match (blocks, self.fused) {
            ([], _) => 0.0,
            (_, true) => Self::fused_blocks(blocks),
            (_, false) => Self::plain_blocks(blocks),
        };
        let add = |total: f64, &x: &f64| if self.fused { x.mul_add(x, total) } else { total + x * x };
        rest.iter().fold(total, add).sqrt()
    }

    /// Two blocks at once in vectors of AVX-512, whose halves are added; then a block that is left over.
    fn fused_blocks(blocks: &[f64]) -> f64 {
        let (pairs, last) = blocks.split_at(blocks.len() - blocks.len() % (2 * Self::BLOCK));
        let wide = add_squares([0.0; 2 * Self::BLOCK], pairs);
        let mut sums = [0.0; Self::BLOCK];
        for (i, sum) in sums.iter_mut().enumerate() {
            let low = i / 4 * 8 + i % 4;
            *sum = wide[low] + wide[low + 4];
        }
        let sums = add_squares(sums, last);
        let add = |i: usize| ((sums[i] + sums[i + 4]) + sums[i + 8]) + sums[i + 12];
        (add(0) + add(2)) + (add(1) + add(3))
    }

    fn plain_blocks(blocks: &[f64]) -> f64 {
        let sums = add_squares([0.0; Self::BLOCK], blocks);
        let half = |i: usize| sums[i] + sums[i + 2];
        let add = |i: usize| (half(i) + half(i + 4)) + (half(i + 8) + half(i + 12));
        add(0) + add(1)
    }
}

/// Adds the squares of the values to sums that take turns.
fn add_squares<const N: usize>(mut sums: [f64; N], values: &[f64]) -> [f64; N] {
    for turn in values.chunks_exact(N) {
        for (sum, &value) in sums.iter_mut().zip(turn) {
            *sum = value.mul_add(value, *sum);
        }
    }
    sums
}
