//! Which rows of an environment a call is for.

/// Which rows of an environment a call is for. Functions take it as `impl Into<Rows>`: `..` is all rows, a number one
/// row, `&[4, 2]` some rows, and a slice of `bool` is a mask with an element for each row of the environment.
///
/// ```
/// # fn main() -> Result<(), mjenv::Error> {
/// # let mut env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5")?, 3)?;
/// # let mut batch = env.batch::<f64>();
/// env.seed(.., &[1, 2, 3])?;
/// env.reset(.., &mut batch)?;
/// env.step(.., &[0.5f32; 6], &mut batch)?; // two actuators
/// env.step(1, &[0.5f32, 0.0], &mut batch)?;
/// env.reset(&[0, 2], &mut batch)?;
/// env.reset(&[true, false, false], &mut batch)?;
/// # Ok(())
/// # }
/// ```
///
/// What belongs to a row, such as actions and seeds, is passed in one slice, row after row. For all rows and for a
/// mask, the slice has the elements of every row of the environment, and those of rows outside the mask are ignored.
/// Otherwise it has those of the chosen rows, in their order. In a [`Batch`](crate::Batch), each row always has its own
/// place.
///
/// A call for a row that does not exist returns [`ErrorKind::Value`](crate::ErrorKind::Value), and a mask of another
/// length [`ErrorKind::Size`](crate::ErrorKind::Size).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Rows<'a> {
    /// All rows.
    All,
    /// The row of this number.
    One(usize),
    /// The rows of these numbers.
    List(&'a [usize]),
    /// The rows where the mask is true.
    Mask(&'a [bool]),
}

impl Rows<'_> {
    /// Returns the row numbers if they are listed.
    pub(crate) fn list(&self) -> Option<&[usize]> {
        match self {
            Self::One(row) => Some(std::slice::from_ref(row)),
            Self::List(rows) => Some(rows),
            Self::All | Self::Mask(_) => None,
        }
    }
}

impl From<std::ops::RangeFull> for Rows<'_> {
    fn from(_: std::ops::RangeFull) -> Self {
        Self::All
    }
}

impl From<usize> for Rows<'_> {
    fn from(row: usize) -> Self {
        Self::One(row)
    }
}

/// Converts slices, arrays and vectors.
macro_rules! from_slices {
    ($($element:ty: $variant:ident;)*) => {$(
        impl<'a> From<&'a [$element]> for Rows<'a> {
            fn from(rows: &'a [$element]) -> Self {
                Self::$variant(rows)
            }
        }

        impl<'a, const N: usize> From<&'a [$element; N]> for Rows<'a> {
            fn from(rows: &'a [$element; N]) -> Self {
                Self::$variant(rows)
            }
        }

        impl<'a> From<&'a Vec<$element>> for Rows<'a> {
            fn from(rows: &'a Vec<$element>) -> Self {
                Self::$variant(rows)
            }
        }
    )*};
}

from_slices! {
    usize: List;
    bool: Mask;
}
