//! Points side by side.

use nalgebra::Point3;

use crate::linear::{LANES, Row};

/// Coordinates of as many points, along each axis.
pub(super) type Lanes = [Row; 3];

/// Points, sixteen side by side; beyond the last one there are zeros.
pub(super) struct Points {
    blocks: Vec<Lanes>,
    count: usize,
}

impl Points {
    /// These points.
    pub(super) fn new<'a>(points: impl ExactSizeIterator<Item = &'a Point3<f64>>) -> Self {
        let count = points.len();
        let mut blocks = vec![[[0.0; LANES]; 3]; count.div_ceil(LANES)];
        for (number, point) in points.enumerate() {
            put(&mut blocks[number / LANES], number % LANES, point);
        }
        Self { blocks, count }
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// The coordinates of a point.
    #[inline]
    pub(super) fn at(&self, number: usize) -> [f64; 3] {
        let block = &self.blocks[number / LANES];
        block.map(|axis| axis[number % LANES])
    }

    /// The points from one on whose number divides by sixteen.
    #[inline]
    pub(super) fn from(&self, first: usize) -> &Lanes {
        &self.blocks[first / LANES]
    }
}

/// Puts a point into a lane.
pub(super) fn put(lanes: &mut Lanes, lane: usize, point: &Point3<f64>) {
    for (axis, coordinate) in lanes.iter_mut().zip(point.iter()) {
        axis[lane] = *coordinate;
    }
}
