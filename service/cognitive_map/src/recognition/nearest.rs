//! Which place of a map is nearest, roughly: one number for each cell of a box.

use super::spots::whole;

/// Most cells; they are larger rather than more, so that they stay in a processor's caches.
const CELLS_MAX: f32 = 65_536.0;
/// No place is near.
const NONE: u16 = u16::MAX;

/// Cells of a brick along each axis, as powers of two: the numbers of a brick fill a line of a processor's cache, and neighbours
/// are mostly in one.
const BRICK: [u32; 3] = [2, 2, 1];
/// The same of all axes together.
const BRICK_CELLS: u32 = BRICK[0] + BRICK[1] + BRICK[2];
/// Bits of a cell's number that are its place within the brick.
const WITHIN: usize = (1 << BRICK_CELLS) - 1;

/// Cells over the box of a map, each with the place that is nearest to its middle, if one is within reach of any of its points. The
/// outermost cells are empty, and stand for all that is beyond.
#[derive(Clone, Debug)]
pub(super) struct Nearest {
    /// Middle of the first cell, from the map's middle \[m\].
    low: [f32; 3],
    per_m: f32,
    /// Cells along each axis.
    size: [f32; 3],
    /// Bricks along each axis but the first.
    rows: [u32; 2],
    /// Which of the kept bricks each is; most of a box is far from any place, and is the first one.
    kept: Vec<u16>,
    /// The bricks that hold a place, after an empty one: a surface's memory rather than its box's, of which more stays in a processor's
    /// caches.
    bricks: Vec<Brick>,
    /// How many places one number stands for: they lie side by side.
    step: u32,
}

/// Numbers of the places that are nearest to the cells of a brick, over a map's `step`: one line of a processor's cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Brick([u16; 1 << BRICK_CELLS]);

const EMPTY: Brick = Brick([NONE; 1 << BRICK_CELLS]);

impl Nearest {
    /// Of places at these positions, axis by axis \[m\], neighbours one after the other.
    pub(super) fn new(axes: &[Vec<f32>; 3], reach_m: f32, edge_m: f32) -> Self {
        let least = |at: &Vec<f32>| at.iter().copied().fold(f32::INFINITY, f32::min);
        let most = |at: &Vec<f32>| at.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let (mut low, mut high) = (axes.each_ref().map(least), axes.each_ref().map(most));
        if axes[0].is_empty() {
            (low, high) = ([0.0; 3], [0.0; 3]);
        }
        let mut edge_m = edge_m.max(1e-9);
        // Half the diagonal of a cell belongs to its reach.
        let reach = |edge_m: f32| reach_m + 0.87 * edge_m;
        let size = |edge_m: f32| -> [f32; 3] {
            std::array::from_fn(|axis| {
                ((high[axis] - low[axis] + 2.0 * reach(edge_m)) / edge_m).ceil() + 3.0
            })
        };
        while size(edge_m).iter().product::<f32>() > CELLS_MAX {
            edge_m *= 1.1;
        }
        let (reach_m, size) = (reach(edge_m), size(edge_m));
        let bricks: [usize; 3] = std::array::from_fn(|axis| {
            (whole(size[axis].into()) as usize).div_ceil(1 << BRICK[axis])
        });
        let mut nearest = Self {
            rows: [1, 2].map(|axis| u32::try_from(bricks[axis]).unwrap_or(u32::MAX)),
            low: low.map(|low| low - reach_m - edge_m),
            per_m: 1.0 / edge_m,
            size,
            kept: vec![0; bricks.iter().product()],
            bricks: vec![EMPTY; bricks.iter().product()],
            step: u32::try_from(axes[0].len().div_ceil(usize::from(NONE)))
                .map_or(1, |step| step.max(1)),
        };
        let mut squares = vec![f32::INFINITY; nearest.bricks.len() << BRICK_CELLS];
        let [x, y, z] = axes;
        for (number, ((x, y), z)) in x.iter().zip(y).zip(z).enumerate() {
            let number = u16::try_from(number / nearest.step as usize).unwrap_or(NONE);
            nearest.notice(number, [*x, *y, *z], reach_m, &mut squares);
        }
        nearest.leave_out_empty();
        nearest
    }

    /// Keeps the bricks that hold a place.
    fn leave_out_empty(&mut self) {
        let mut bricks = vec![EMPTY];
        for (kept, brick) in self.kept.iter_mut().zip(&self.bricks) {
            if brick.0.iter().any(|place| *place != NONE) {
                *kept = u16::try_from(bricks.len()).unwrap_or(0);
                bricks.push(*brick);
            }
        }
        self.bricks = bricks;
    }

    /// Writes a place into all cells whose middle is within reach and to which none was nearer.
    fn notice(&mut self, number: u16, at: [f32; 3], reach_m: f32, squares: &mut [f32]) {
        let at: [f32; 3] = std::array::from_fn(|axis| (at[axis] - self.low[axis]) * self.per_m);
        let reach = reach_m * self.per_m;
        let range = |axis: usize| {
            let last = whole(self.size[axis].into()) - 2;
            let first = (at[axis] - reach).max(1.0).ceil();
            whole(first.into())..=whole((at[axis] + reach).into()).min(last)
        };
        for i in range(0) {
            for j in range(1) {
                for k in range(2) {
                    let apart: [f32; 3] = [i as f32 - at[0], j as f32 - at[1], k as f32 - at[2]];
                    let squared: f32 = apart.iter().map(|x| x * x).sum();
                    let cell = cell([i, j, k], self.rows) as usize;
                    if squared <= reach * reach && squared < squares[cell] {
                        squares[cell] = squared;
                        self.bricks[cell >> BRICK_CELLS].0[cell & WITHIN] = number;
                    }
                }
            }
        }
    }

    /// Numbers of the cells of these points, moved so; axis by axis \[m\].
    pub(super) fn cells(&self, [x, y, z]: [&[f32]; 3], shift: [f32; 3], out: &mut [u32]) {
        /// Adding it leaves the nearest whole number in the low bits.
        const WHOLE: f32 = 8_388_608.0;
        let per_m = self.per_m;
        let at = |at: f32, from: f32, last: f32| {
            let at = (at + from) * per_m;
            // What is no number is in the first cell.
            let at = if at > 0.0 { at } else { 0.0 };
            let at = if at < last { at } else { last };
            (at + WHOLE).to_bits() & 0x007F_FFFF
        };
        let [fx, fy, fz] = std::array::from_fn(|axis| shift[axis] - self.low[axis]);
        let [lx, ly, lz] = self.size.map(|size| size - 1.0);
        let rows = self.rows;
        for (((x, y), z), out) in x.iter().zip(y).zip(z).zip(out) {
            *out = cell([at(*x, fx, lx), at(*y, fy, ly), at(*z, fz, lz)], rows);
        }
    }

    /// The place of a cell, or a number beyond all places.
    pub(super) fn place(&self, cell: u32) -> u32 {
        let cell = cell as usize;
        let brick = self.kept[cell >> BRICK_CELLS];
        u32::from(self.bricks[usize::from(brick)].0[cell & WITHIN]) * self.step
    }
}

/// The number of a cell, by its place along each axis.
fn cell([i, j, k]: [u32; 3], [rows, columns]: [u32; 2]) -> u32 {
    let [a, b, c] = BRICK;
    let within = |at: u32, power: u32| at & ((1 << power) - 1);
    let brick = ((i >> a) * rows + (j >> b)) * columns + (k >> c);
    brick << (a + b + c) | within(i, a) << (b + c) | within(j, b) << c | within(k, c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_near_is_noticed_and_what_is_far_is_not() {
        let noise = |k: u64| {
            let uniform = crate::random::uniform(5, crate::record::AgentId(0), 0, k);
            crate::recognition::spots::narrow(uniform) * 0.2 - 0.1
        };
        let axis =
            |from: u64, count: u64| -> Vec<f32> { (from..from + count).map(noise).collect() };
        let [x, y, z] = [axis(0, 200), axis(1000, 200), axis(2000, 200)];
        let (reach_m, edge_m) = (0.01, 0.009);
        let axes = [x, y, z];
        let nearest = Nearest::new(&axes, reach_m, edge_m);
        let [x, y, z] = &axes;
        let [qx, qy, qz] = [axis(5000, 2000), axis(7000, 2000), axis(9000, 2000)];
        let shift = [0.01, -0.02, 0.005];
        let mut cells = vec![0; 2000];
        nearest.cells([&qx, &qy, &qz], shift, &mut cells);
        let mut noticed = 0;
        for (k, cell) in cells.iter().enumerate() {
            let to = |place: usize| {
                let apart = [
                    qx[k] + shift[0] - x[place],
                    qy[k] + shift[1] - y[place],
                    qz[k] + shift[2] - z[place],
                ];
                apart.iter().map(|x| x * x).sum::<f32>().sqrt()
            };
            let least = (0..200).map(to).fold(f32::INFINITY, f32::min);
            match nearest.place(*cell) {
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
        nearest.cells(
            [&[f32::NAN, 1e30, -1e30], &[0.0; 3], &[0.0; 3]],
            [0.0; 3],
            &mut cells,
        );
        assert!(cells[..3].iter().all(|cell| nearest.place(*cell) >= 200));
        let empty = Nearest::new(&[vec![], vec![], vec![]], 0.01, 0.004);
        empty.cells([&[0.0], &[0.0], &[0.0]], [0.0; 3], &mut cells);
        assert!(empty.place(cells[0]) > 0);
    }
}
