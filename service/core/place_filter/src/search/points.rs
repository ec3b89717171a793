//! Points side by side.

use nalgebra::Point3;

use crate::linear::{LANES, Row};

/// Coordinates of as many points, along each axis.
pub(super) type Lanes = [Row; 3];

/// Points, sixteen side by side; the last one stands in all lanes after it, since covariances of a
/// point far away are so small that processors take long over them.
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
            put_from(&mut blocks[number / LANES], number % LANES, point);
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

/// Puts a point into a lane, and into all lanes after it until another point is put there.
pub(super) fn put_from(lanes: &mut Lanes, lane: usize, point: &Point3<f64>) {
    for (axis, coordinate) in lanes.iter_mut().zip(point.iter()) {
        axis[lane..].fill(*coordinate);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_point_fills_its_block() {
        let points: Vec<Point3<f64>> = (0..18)
            .map(|k| Point3::new(f64::from(k), 1e3, -f64::from(k)))
            .collect();
        let lanes = Points::new(points.iter());
        assert_eq!(lanes.len(), points.len());
        for (number, point) in points.iter().enumerate() {
            assert_eq!(Point3::from(lanes.at(number)), *point);
        }
        for number in points.len()..2 * LANES {
            assert_eq!(Point3::from(lanes.at(number)), points[17]);
        }
    }
}
