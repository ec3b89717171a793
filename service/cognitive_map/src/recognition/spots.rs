//! Places of a map, packed for a rough look from all of them at once.

use nalgebra::{Point3, Vector3};

use super::nearest::Nearest;
use super::surface::Patch;

/// Standard deviations to which a place is noticed.
const REACH_SD: f64 = 3.5;
/// From one scale to the next the reach grows so much.
const GROWTH: f64 = 3.0;
/// Cells of a scale along a reach, at most.
const CELLS_PER_REACH: f64 = 4.0;

/// Places of a map in its own order; positions are from its middle \[m\].
#[derive(Clone, Debug)]
pub(super) struct Spots {
    middle: Point3<f64>,
    pub(super) x: Vec<f32>,
    pub(super) y: Vec<f32>,
    pub(super) z: Vec<f32>,
    /// Outward normals; zero where none is known.
    pub(super) normals: Vec<[f32; 3]>,
    /// Variance of a touch of a place without the touch's noise, on average, per axis \[m²\].
    pub(super) variance_m2: f64,
    levels: Option<Levels>,
    /// How uncertain a point may be \[m\], and what is nearest then.
    nearest: Vec<(f64, Nearest)>,
}

/// Levels of a map all of whose places have one of the same channel.
#[derive(Clone, Debug)]
pub(super) struct Levels {
    pub(super) channel: u16,
    /// Middle of the means, from which they are told.
    pub(super) middle: f64,
    pub(super) means: Vec<f32>,
    pub(super) variances: Vec<f32>,
}

impl Spots {
    /// Of the places of a map with this spacing and extent \[m\], learned from touches with this variance on
    /// average \[m²\].
    pub(super) fn new(patches: &[Patch], spacing_m: f64, extent_m: f64, noise_m2: f64) -> Self {
        let count = patches.len().max(1) as f64;
        let sum = patches.iter().map(|patch| patch.position.coords);
        let middle = Point3::from(sum.sum::<Vector3<f64>>() / count);
        let variance_m2 = patches.iter().map(|patch| patch.variance_m2).sum::<f64>() / count;
        let axis = |axis: usize| -> Vec<f32> {
            { patches.iter() }
                .map(|patch| narrow(patch.position[axis] - middle[axis]))
                .collect()
        };
        let normal = |patch: &Patch| {
            patch
                .normal
                .map_or([0.0; 3], |normal| normal.into_inner().map(narrow).into())
        };
        let (x, y, z) = (axis(0), axis(1), axis(2));
        // A touch like those that were learned, in a hypothesis as wide.
        let mut reach_m = (1.1 * REACH_SD * (2.0 * (noise_m2 + variance_m2)).sqrt()).max(1e-9);
        let mut nearest = Vec::new();
        loop {
            let edge_m = spacing_m.max(reach_m / CELLS_PER_REACH);
            let grid = Nearest::new([&x, &y, &z], narrow(reach_m), narrow(edge_m));
            nearest.push((reach_m, grid));
            if reach_m > extent_m {
                break;
            }
            reach_m *= GROWTH;
        }
        Self {
            normals: patches.iter().map(normal).collect(),
            levels: Levels::of(patches),
            middle,
            x,
            y,
            z,
            variance_m2,
            nearest,
        }
    }

    /// Levels, if all places have one of the same channel and nothing else.
    pub(super) fn levels(&self) -> Option<&Levels> {
        self.levels.as_ref()
    }

    /// What is nearest to points whose variance is this along each axis \[m²\].
    pub(super) fn nearest(&self, variance_m2: f64) -> &Nearest {
        let reach_m = REACH_SD * variance_m2.sqrt();
        let wide = self.nearest.iter().find(|(widest, _)| reach_m <= *widest);
        // There is one scale at least.
        &wide.unwrap_or(&self.nearest[self.nearest.len() - 1]).1
    }
}

impl Levels {
    fn of(patches: &[Patch]) -> Option<Self> {
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
        let own = || patches.iter().map(|patch| &patch.levels[0]);
        let middle = own().map(|level| level.mean).sum::<f64>() / patches.len() as f64;
        Some(Self {
            channel,
            middle,
            means: own().map(|level| narrow(level.mean - middle)).collect(),
            variances: own().map(|level| narrow(level.variance())).collect(),
        })
    }
}

/// In half the digits.
pub(super) fn narrow(x: f64) -> f32 {
    #[expect(clippy::cast_possible_truncation, reason = "meant to be rough")]
    let narrow = x as f32;
    narrow
}
