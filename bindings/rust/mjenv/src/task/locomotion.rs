//! Helpers for robots that walk: which feet touch the ground, how long they are in the air, and the heights of a terrain.

use super::builder::Builder;
use super::row::Start;
use super::sim::{Array, Sim};

const HEIGHT_FIELD: usize = 1; // mjGEOM_HFIELD

impl Sim<'_> {
    /// For each of these geoms, whether it touches the geom `other`: whether they have a contact whose distance is at
    /// most 0. Panics if build did not ask for the contacts.
    pub fn touching<const N: usize>(&self, geoms: [usize; N], other: usize) -> [bool; N] {
        let is_between = |first: i32, second: i32, geom: usize| {
            let pair = [first, second].map(|index| usize::try_from(index).ok());
            pair == [Some(geom), Some(other)] || pair == [Some(other), Some(geom)]
        };
        geoms.map(|geom| {
            self.contacts()
                .iter()
                .any(|contact| contact.distance <= 0.0 && is_between(contact.geom1, contact.geom2, geom))
        })
    }
}

/// Counts how long each of some geoms, such as feet, has been in the air. `time` are carried numbers, which become 0 for a
/// geom that touches the ground, and otherwise grow by `dt` in each step. Returns for each geom how long the flight was that
/// ended in this step, s; 0 if none did.
///
/// ```
/// let mut time = [0.5, 0.25];
/// assert_eq!(mjenv::task::air_time(&mut time, [true, false], 0.25), [0.5, 0.0]);
/// assert_eq!(time, [0.0, 0.5]);
/// ```
pub fn air_time<const N: usize>(time: &mut [f64; N], touching: [bool; N], dt: f64) -> [f64; N] {
    let mut flights = [0.0; N];
    for ((time, flight), touches) in time.iter_mut().zip(&mut flights).zip(touching) {
        if touches {
            *flight = std::mem::take(time);
        } else {
            *time += dt;
        }
    }
    flights
}

/// Where [`Terrain::height`] reads the heights: a [`Sim`] or a [`Start`].
pub trait View {
    #[doc(hidden)]
    fn heights(&self, data: Array<f32>) -> &[f32];
}

impl View for Sim<'_> {
    fn heights(&self, data: Array<f32>) -> &[f32] {
        self.array(data)
    }
}

impl View for Start<'_> {
    fn heights(&self, data: Array<f32>) -> &[f32] {
        self.array_of_model(data)
    }
}

/// A height field whose geom is fixed to the world and not turned; [`Builder::terrain`] returns it. The surface consists of
/// the triangles with which other geoms collide. Beyond the edge, the heights are those of the edge. If rows have their own
/// `hfield_data`, the heights are the row's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terrain {
    data: Array<f32>,
    /// The index of the field's first number in `hfield_data`.
    first: usize,
    rows: usize,
    columns: usize,
    size: [f64; 3],
    position: [f64; 3],
}

impl Terrain {
    /// The surface's height at `x` and `y`, m; all in the world's frame. In reset, `view` is the [`Start`], whose own arrays
    /// count after [`Start::forward`] or [`Start::advance`].
    pub fn height<V: View>(&self, view: &V, x: f64, y: f64) -> f64 {
        let column = cell(x - self.position[0], self.size[0], self.columns);
        let row = cell(y - self.position[1], self.size[1], self.rows);
        let c = (column as usize).min(self.columns.saturating_sub(2));
        let r = (row as usize).min(self.rows.saturating_sub(2));
        let (u, v) = (column - c as f64, row - r as f64);
        let data = &view.heights(self.data)[self.first..];
        let at = |j: usize, i: usize| {
            f64::from(data[(r + j).min(self.rows - 1) * self.columns + (c + i).min(self.columns - 1)])
        };
        // The diagonal of a cell goes from (r, c) to (r + 1, c + 1).
        let (near, far) = (at(0, 0), at(1, 1));
        let along = if u >= v {
            let corner = at(0, 1);
            u * (corner - near) + v * (far - corner)
        } else {
            let corner = at(1, 0);
            v * (corner - near) + u * (far - corner)
        };
        (near + along) * self.size[2] + self.position[2]
    }

    /// The surface's heights at `points` (x, y) in the frame of a body that is turned by the body's yaw alone, m in the
    /// world's frame. Panics if there is no such body.
    pub fn around<'a>(
        &'a self,
        sim: &'a Sim<'_>,
        body: usize,
        points: &'a [[f64; 2]],
    ) -> impl Iterator<Item = f64> + 'a {
        let (mat, at) = (sim.xmat()[body], sim.xpos()[body]);
        let (ahead, left) = (mat[0], mat[3]);
        let norm = (ahead * ahead + left * left).sqrt();
        let (cos, sin) = if norm > 0.0 { (ahead / norm, left / norm) } else { (1.0, 0.0) };
        points.iter().map(move |&[x, y]| self.height(sim, at[0] + (cos * x - sin * y), at[1] + (sin * x + cos * y)))
    }
}

/// Where a position lies among `count` numbers that are spread over twice the radius.
fn cell(x: f64, radius: f64, count: usize) -> f64 {
    let last = (count - 1) as f64;
    ((x + radius) / (2.0 * radius) * last).max(0.0).min(last)
}

impl Builder<'_> {
    /// The height field of this geom, whose heights [`Terrain::height`] reads. Errors: if the geom is no height field,
    /// if it is not fixed to the world, or if it is turned.
    pub fn terrain(&mut self, geom: &str) -> super::Result<Terrain> {
        let at = self.geom(geom);
        let data = self.array("hfield_data");
        if self.lists() {
            return Ok(Terrain { data, first: 0, rows: 1, columns: 1, size: [1.0; 3], position: [0.0; 3] });
        }
        let is_fixed = self.element("geom_bodyid", at) == 0 && self.number("geom_quat", 4 * at) == 1.0;
        if self.element("geom_type", at) != HEIGHT_FIELD || !is_fixed {
            return Err(format!("geom {geom:?} is no height field that is fixed to the world and not turned").into());
        }
        let field = self.element("geom_dataid", at);
        Ok(Terrain {
            data,
            first: self.element("hfield_adr", field),
            rows: self.element("hfield_nrow", field),
            columns: self.element("hfield_ncol", field),
            size: [0, 1, 2].map(|i| self.number("hfield_size", 4 * field + i)),
            position: [0, 1, 2].map(|i| self.number("geom_pos", 3 * at + i)),
        })
    }
}
