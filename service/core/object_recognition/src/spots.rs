//! Places of a map, packed for look-ups by the thousand and for a rough look from all of them at once.

use nalgebra::{Point3, Vector3};

use super::nearest::Nearest;
use super::reaches::Reaches;
use super::surface::Patch;

/// Squared distance, in variances, beyond which a place is not the one that was touched: e⁻¹⁶.
pub(super) const DISTANCE_MAX: f64 = 32.0;
/// Standard deviations to which a place is noticed in a rough look.
const NOTICED_SD: f64 = 3.5;
/// From one scale of rough looks to the next the reach grows so much.
const GROWTH: f64 = 3.0;
/// Cells of a scale along a reach, at most.
const CELLS_PER_REACH: f64 = 4.0;

/// A place with what most places have: where it is, and one level.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// From the map's middle \[m\].
    pub(super) at: [f32; 3],
    /// Variance of a touch of this place, without the touch's noise, per axis \[m²\].
    pub(super) variance_m2: f32,
    /// Mean level, from the middle of those of the map.
    pub(super) level: f32,
    pub(super) level_variance: f32,
}

/// Places of a map in the order of their index.
#[derive(Clone, Debug)]
pub(super) struct Spots {
    pub(super) all: Vec<Spot>,
    /// Where they are, and their levels and the variances of these, once more: list by list.
    pub(super) axes: [Vec<f32>; 3],
    pub(super) level_lists: [Vec<f32>; 2],
    /// Outward normals; of no length where none is known.
    pub(super) normals: Vec<[f32; 3]>,
    /// Number of the patch that each is.
    order: Vec<u32>,
    pub(super) middle: Point3<f64>,
    pub(super) reaches: Reaches,
    /// Variance of a touch of a place without the touch's noise per axis, on average and at most \[m²\].
    pub(super) variance_m2: f64,
    pub(super) variance_max_m2: f64,
    /// Channel and middle of the levels, if all places have one of the same and nothing else.
    levels: Option<(u16, f64)>,
    /// How uncertain a point may be \[m\], and what is nearest then.
    nearest: Vec<(f64, Nearest)>,
}

impl Spots {
    /// Of the places of a map with this spacing and extent \[m\], learned from touches with this variance on
    /// average \[m²\].
    pub(super) fn new(patches: &[Patch], spacing_m: f64, extent_m: f64, noise_m2: f64) -> Self {
        let positions: Vec<_> = patches.iter().map(|patch| patch.position).collect();
        let (reaches, order) = Reaches::new(&positions);
        let count = patches.len().max(1) as f64;
        let sum = positions.iter().map(|position| position.coords);
        let middle = Point3::from(sum.sum::<Vector3<f64>>() / count);
        let levels = levels(patches);
        let ordered = || order.iter().map(|&number| &patches[number as usize]);
        let spot = |patch: &Patch| Spot {
            at: (patch.position - middle).map(narrow).into(),
            variance_m2: narrow(patch.variance_m2),
            level: levels.map_or(0.0, |(_, middle)| narrow(patch.levels[0].mean - middle)),
            level_variance: levels.map_or(1.0, |_| narrow(patch.levels[0].variance())),
        };
        let normal = |patch: &Patch| {
            let normal = patch.normal.map(|normal| normal.map(narrow).into());
            normal.unwrap_or([0.0; 3])
        };
        let all: Vec<Spot> = ordered().map(spot).collect();
        let axes = [0, 1, 2].map(|axis| all.iter().map(|spot| spot.at[axis]).collect());
        let variances = || patches.iter().map(|patch| patch.variance_m2);
        let variance_m2 = variances().sum::<f64>() / count;
        // A touch like those that were learned, in a hypothesis as wide.
        let mut reach_m = (1.1 * NOTICED_SD * (2.0 * (noise_m2 + variance_m2)).sqrt()).max(1e-9);
        let mut nearest = Vec::new();
        loop {
            let edge_m = spacing_m.max(reach_m / CELLS_PER_REACH);
            let grid = Nearest::new(&axes, narrow(reach_m), narrow(edge_m));
            nearest.push((reach_m, grid));
            if reach_m > extent_m {
                break;
            }
            reach_m *= GROWTH;
        }
        Self {
            normals: ordered().map(normal).collect(),
            level_lists: [
                all.iter().map(|spot| spot.level).collect(),
                all.iter().map(|spot| spot.level_variance).collect(),
            ],
            axes,
            variance_max_m2: variances().fold(0.0, f64::max),
            variance_m2,
            all,
            order,
            middle,
            reaches,
            levels,
            nearest,
        }
    }

    /// Channel and middle of the levels, if all places have one of the same and nothing else.
    pub(super) fn levels(&self) -> Option<(u16, f64)> {
        self.levels
    }

    /// The number of the patch that a spot is.
    pub(super) fn patch(&self, spot: usize) -> usize {
        self.order[spot] as usize
    }

    /// What is nearest to points whose variance is this along each axis \[m²\].
    pub(super) fn nearest(&self, variance_m2: f64) -> &Nearest {
        let reach_m = NOTICED_SD * variance_m2.sqrt();
        let wide = self.nearest.iter().find(|(widest, _)| reach_m <= *widest);
        // There is one scale at least.
        &wide.unwrap_or(&self.nearest[self.nearest.len() - 1]).1
    }

    /// Visits places that a point could be of whose variance along each axis is so much \[m²\], and some others: their numbers
    /// among the patches.
    pub(super) fn near(&self, point: &Point3<f64>, variance_m2: f64, mut visit: impl FnMut(u32)) {
        let reach_m = (DISTANCE_MAX * (variance_m2 + self.variance_max_m2)).sqrt();
        let mut runs = Vec::new();
        self.reaches.runs(point, reach_m, &mut runs);
        for place in runs.into_iter().flatten() {
            visit(self.order[place as usize]);
        }
    }
}

/// Channel and middle of the levels, if all places have one of the same and nothing else.
fn levels(patches: &[Patch]) -> Option<(u16, f64)> {
    let channel = patches.first()?.levels.first()?.channel;
    let is_plain = |patch: &Patch| {
        let [level] = &patch.levels[..] else {
            return false;
        };
        level.channel == channel && patch.descriptors.is_empty()
    };
    if !patches.iter().all(is_plain) {
        return None;
    }
    let means = patches.iter().map(|patch| patch.levels[0].mean);
    Some((channel, means.sum::<f64>() / patches.len() as f64))
}

/// In half the digits.
pub(super) fn narrow(x: f64) -> f32 {
    #[expect(clippy::cast_possible_truncation, reason = "meant to be rough")]
    let narrow = x as f32;
    narrow
}

/// A whole number that is positive.
pub(super) fn whole(x: f64) -> u32 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "rounds down, and saturates"
    )]
    let whole = x as u32;
    whole
}
