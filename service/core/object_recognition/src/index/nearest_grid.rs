//! Nearest-place grid: the nearest place for each cell of a box (a feature transform).

use crate::index::block_grid::{BlockGrid, NONE, cell};
use crate::numeric::floor_u32;
use crate::tuning::NEAREST_CELLS_MAX;

/// Cells over the box of a model, each with the place nearest to its middle, if one is within reach
/// of any of its points. The outermost cells are empty and stand for everything beyond.
#[derive(Clone, Debug)]
pub(crate) struct NearestGrid {
    /// Middle of the first cell, from the model's middle \[m\].
    low: [f32; 3],
    per_m: f32,
    /// Cells along each axis.
    size: [f32; 3],
    /// Blocks along the second and the third axis.
    rows: [u32; 2],
    /// Numbers of the places, divided by `step`.
    places: BlockGrid,
    /// Places that share one number, neighbours of each other.
    step: u32,
}

impl NearestGrid {
    /// Of places at these positions, axis by axis \[m\], in an order that keeps neighbours
    /// together.
    pub(crate) fn new(axes: &[Vec<f32>; 3], reach_m: f32, edge_m: f32) -> Self {
        let least = |at: &Vec<f32>| at.iter().copied().fold(f32::INFINITY, f32::min);
        let most = |at: &Vec<f32>| at.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let (mut low, mut high) = (axes.each_ref().map(least), axes.each_ref().map(most));
        if axes[0].is_empty() {
            (low, high) = ([0.0; 3], [0.0; 3]);
        }
        let mut edge_m = edge_m.max(1e-9);
        // Half the diagonal of a cell, √3/2 edges, is added to the reach.
        let reach = |edge_m: f32| reach_m + 0.87 * edge_m;
        let size = |edge_m: f32| -> [f32; 3] {
            std::array::from_fn(|axis| {
                ((high[axis] - low[axis] + 2.0 * reach(edge_m)) / edge_m).ceil() + 3.0
            })
        };
        while size(edge_m).iter().product::<f32>() > NEAREST_CELLS_MAX {
            edge_m *= 1.1;
        }
        let (reach_m, size) = (reach(edge_m), size(edge_m));
        let blocks = BlockGrid::along(size.map(|size| floor_u32(size.into())));
        let step = axes[0].len().div_ceil(usize::from(NONE));
        let mut nearest = Self {
            low: low.map(|low| low - reach_m - edge_m),
            per_m: 1.0 / edge_m,
            size,
            rows: [blocks[1], blocks[2]],
            places: BlockGrid::new(&[]),
            step: u32::try_from(step).map_or(1, |step| step.max(1)),
        };
        let mut places = vec![NONE; BlockGrid::cells(blocks)];
        let mut squares = vec![f32::INFINITY; places.len()];
        let [x, y, z] = axes;
        for (number, ((x, y), z)) in x.iter().zip(y).zip(z).enumerate() {
            let number = u16::try_from(number / nearest.step as usize).unwrap_or(NONE);
            nearest.put(number, [*x, *y, *z], reach_m, (&mut places, &mut squares));
        }
        nearest.places = BlockGrid::new(&places);
        nearest
    }

    /// Writes a place into all cells within reach to which it is the nearest so far.
    fn put(
        &self,
        number: u16,
        at: [f32; 3],
        reach_m: f32,
        (places, squares): (&mut [u16], &mut [f32]),
    ) {
        let at: [f32; 3] = std::array::from_fn(|axis| (at[axis] - self.low[axis]) * self.per_m);
        let reach = reach_m * self.per_m;
        let range = |axis: usize| {
            let last = floor_u32(self.size[axis].into()) - 2;
            let first = (at[axis] - reach).max(1.0).ceil();
            floor_u32(first.into())..=floor_u32((at[axis] + reach).into()).min(last)
        };
        for i in range(0) {
            for j in range(1) {
                for k in range(2) {
                    let apart: [f32; 3] = [i as f32 - at[0], j as f32 - at[1], k as f32 - at[2]];
                    let squared: f32 = apart.iter().map(|x| x * x).sum();
                    let cell = cell([i, j, k], self.rows) as usize;
                    if squared <= reach * reach && squared < squares[cell] {
                        squares[cell] = squared;
                        places[cell] = number;
                    }
                }
            }
        }
    }

    /// Cells of points, axis by axis, after a shift \[m\].
    pub(crate) fn cells(&self, [x, y, z]: [&[f32]; 3], shift: [f32; 3], out: &mut [u32]) {
        let (rows, per_m) = (self.rows, self.per_m);
        let [fx, fy, fz] = std::array::from_fn(|axis| shift[axis] - self.low[axis]);
        let [lx, ly, lz] = self.size.map(|size| size - 1.0);
        simd::dispatch(
            #[inline(always)]
            || {
                for (((x, y), z), out) in x.iter().zip(y).zip(z).zip(&mut *out) {
                    let (x, y, z) = ((x + fx) * per_m, (y + fy) * per_m, (z + fz) * per_m);
                    *out = cell([rounded(x, lx), rounded(y, ly), rounded(z, lz)], rows);
                }
            },
        );
    }

    /// Replaces each cell by its nearest place, or by a number beyond all places.
    pub(crate) fn places(&self, cells: &mut [u32]) {
        self.places.read(cells);
        if self.step > 1 {
            for place in cells {
                *place *= self.step;
            }
        }
    }
}

/// The nearest whole number from 0 to `last`; 0 for NaN.
#[inline(always)]
fn rounded(x: f32, last: f32) -> u32 {
    /// 2²³: adding it leaves the nearest whole number in the low bits.
    const WHOLE: f32 = 8_388_608.0;
    let x = if x > 0.0 { x } else { 0.0 };
    let x = if x < last { x } else { last };
    (x + WHOLE).to_bits() & 0x007F_FFFF
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_near_is_noticed_and_what_is_far_is_not() {
        let noise = |k: u64| {
            let uniform = random::uniform(5, [0, 0, k]);
            crate::numeric::to_f32(uniform) * 0.2 - 0.1
        };
        let axis =
            |from: u64, count: u64| -> Vec<f32> { (from..from + count).map(noise).collect() };
        let [x, y, z] = [axis(0, 200), axis(1000, 200), axis(2000, 200)];
        let (reach_m, edge_m) = (0.01, 0.009);
        let axes = [x, y, z];
        let nearest = NearestGrid::new(&axes, reach_m, edge_m);
        let [x, y, z] = &axes;
        let [qx, qy, qz] = [axis(5000, 2000), axis(7000, 2000), axis(9000, 2000)];
        let shift = [0.01, -0.02, 0.005];
        let mut places = vec![0; 2000];
        nearest.cells([&qx, &qy, &qz], shift, &mut places);
        nearest.places(&mut places);
        let mut noticed = 0;
        for (k, place) in places.iter().enumerate() {
            let to = |place: usize| {
                let apart = [
                    qx[k] + shift[0] - x[place],
                    qy[k] + shift[1] - y[place],
                    qz[k] + shift[2] - z[place],
                ];
                apart.iter().map(|x| x * x).sum::<f32>().sqrt()
            };
            let least = (0..200).map(to).fold(f32::INFINITY, f32::min);
            match *place {
                200.. => assert!(least > reach_m),
                place => {
                    noticed += 1;
                    // It is nearest to the cell's middle.
                    assert!(to(place as usize) < least + 1.74 * edge_m);
                    assert!(least < reach_m + 1.74 * edge_m);
                }
            }
        }
        assert!((200..2000).contains(&noticed), "{noticed}");
        let mut places = [0; 3];
        let far = [f32::NAN, 1e30, -1e30];
        nearest.cells([&far, &[0.0; 3], &[0.0; 3]], [0.0; 3], &mut places);
        nearest.places(&mut places);
        assert!(places.iter().all(|place| *place >= 200));
        let empty = NearestGrid::new(&[vec![], vec![], vec![]], 0.01, 0.004);
        let mut places = [0];
        empty.cells([&[0.0], &[0.0], &[0.0]], [0.0; 3], &mut places);
        empty.places(&mut places);
        assert!(places[0] > 0);
    }
}
