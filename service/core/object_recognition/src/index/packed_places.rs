//! Places of a model, packed for vectorised lookups, with their indexes.

use std::ops::Range;

use nalgebra::Point3;

use crate::index::lattice_index::LatticeIndex;
use crate::index::nearest_grid::NearestGrid;
use crate::index::wide_places::WidePlaces;
use crate::indexed_place::IndexedPlace;
use crate::numeric::{centroid, to_f32};
use crate::tuning::{
    GATE_SQUARED, NEAREST_CELLS_PER_REACH, NEAREST_GROWTH, NEAREST_MARGIN, NEAREST_SD,
};

/// Relative error of a distance computed in single precision: several roundings.
const ROUNDING: f64 = 16.0 * f32::EPSILON as f64;

/// A place with what most places have: a position and one level.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedPlace {
    /// From the model's middle \[m\].
    pub(crate) at: [f32; 3],
    /// Variance of a touch of this place, without the touch's noise, per axis \[m²\].
    pub(crate) variance_m2: f32,
    /// Mean level, less the median of the model's levels.
    pub(crate) level: f32,
    pub(crate) level_variance: f32,
}

/// A level relative to a model's in single precision, in which the square of any other's distance
/// to it is a number.
pub(crate) fn packed_level(level: f64) -> f32 {
    to_f32(level.clamp(-PACKED_LEVEL_MAX, PACKED_LEVEL_MAX))
}

/// The same of a contact. One beyond all levels of places agrees with none.
pub(crate) fn packed_reading(level: f64) -> f32 {
    let most = 2.0 * PACKED_LEVEL_MAX;
    to_f32(level.clamp(-most, most))
}

/// A variance of such levels.
pub(crate) fn packed_level_variance(variance: f64) -> f32 {
    to_f32(variance.min(PACKED_LEVEL_MAX * PACKED_LEVEL_MAX))
}

/// Levels farther from a model's are taken for as far, and a level that is rarer anywhere for as
/// rare.
pub(crate) const PACKED_LEVEL_MAX: f64 = 1e18;

/// Places of a model in the order of the lattice index.
#[derive(Clone, Debug)]
pub(crate) struct PackedPlaces {
    pub(crate) all: Vec<PackedPlace>,
    /// The positions again, axis by axis, and the levels and their variances: structures of arrays.
    pub(crate) axes: [Vec<f32>; 3],
    pub(crate) level_lists: [Vec<f32>; 2],
    /// Outward normals; zero where none is known.
    pub(crate) normals: Vec<[f32; 3]>,
    /// Number of each among the model's places.
    order: Vec<u32>,
    pub(crate) middle: Point3<f64>,
    pub(crate) lattice_index: LatticeIndex,
    /// Places that are found without the index.
    pub(crate) wide: WidePlaces,
    /// Mean of the places' variances per axis \[m²\].
    pub(crate) variance_m2: f64,
    /// Bound on the error of a distance by single precision \[m\].
    rounding_m: f64,
    /// Channel and median of the levels, if every place has one level of the same channel and no
    /// descriptor.
    levels: Option<(u16, f64)>,
    /// Nearest-place grids with their reaches \[m\], by scale.
    nearest: Vec<(f64, NearestGrid)>,
}

impl PackedPlaces {
    /// Of the places of a model with this spacing and extent \[m\], learned from touches with this
    /// mean variance \[m²\].
    pub(crate) fn new(
        places: &[IndexedPlace],
        spacing_m: f64,
        extent_m: f64,
        noise_m2: f64,
    ) -> Self {
        let positions: Vec<_> = places.iter().map(|place| place.position).collect();
        let (lattice_index, order) = LatticeIndex::new(&positions);
        let count = places.len().max(1) as f64;
        let middle = Point3::from(centroid(positions.iter().map(|position| position.coords)));
        let levels = levels(places);
        let ordered = || order.iter().map(|&number| &places[number as usize]);
        let packed_place = |place: &IndexedPlace| PackedPlace {
            at: (place.position - middle).map(to_f32).into(),
            variance_m2: to_f32(place.variance_m2),
            level: levels.map_or(0.0, |(_, middle)| {
                packed_level(place.levels[0].mean - middle)
            }),
            level_variance: levels
                .map_or(1.0, |_| packed_level_variance(place.levels[0].variance())),
        };
        let normal = |place: &IndexedPlace| {
            let normal = place.normal.map(|normal| normal.map(to_f32).into());
            normal.unwrap_or([0.0; 3])
        };
        let all: Vec<PackedPlace> = ordered().map(packed_place).collect();
        let axes = [0, 1, 2].map(|axis| {
            all.iter()
                .map(|packed_place| packed_place.at[axis])
                .collect()
        });
        let variances = places.iter().map(|place| place.variance_m2);
        let variance_m2 = variances.sum::<f64>() / count;
        // The first scale: a touch like the learned ones, in a hypothesis of the same variance.
        let mut reach_m =
            (NEAREST_MARGIN * NEAREST_SD * (2.0 * (noise_m2 + variance_m2)).sqrt()).max(1e-9);
        let touch_m2 = 2.0 * noise_m2 + variance_m2;
        let of_index = ordered().zip(&all);
        let of_index: Vec<_> = { of_index }
            .map(|(place, packed_place)| (place.position, packed_place.variance_m2))
            .collect();
        let wide = WidePlaces::new(&lattice_index, &of_index, touch_m2);
        let mut nearest = Vec::new();
        loop {
            let edge_m = spacing_m.max(reach_m / NEAREST_CELLS_PER_REACH);
            let grid = NearestGrid::new(&axes, to_f32(reach_m), to_f32(edge_m));
            nearest.push((reach_m, grid));
            if reach_m > extent_m {
                break;
            }
            reach_m *= NEAREST_GROWTH;
        }
        Self {
            normals: ordered().map(normal).collect(),
            level_lists: [
                all.iter().map(|packed_place| packed_place.level).collect(),
                all.iter()
                    .map(|packed_place| packed_place.level_variance)
                    .collect(),
            ],
            axes,
            rounding_m: ROUNDING * extent_m,
            variance_m2,
            all,
            order,
            middle,
            lattice_index,
            wide,
            levels,
            nearest,
        }
    }

    /// Channel and median of the levels, if every place has one level of the same channel and no
    /// descriptor.
    pub(crate) fn levels(&self) -> Option<(u16, f64)> {
        self.levels
    }

    /// Number of a packed place among the model's places.
    pub(crate) fn place(&self, packed_place: usize) -> usize {
        self.order[packed_place] as usize
    }

    /// The nearest-place grid for points with this variance per axis \[m²\].
    pub(crate) fn nearest(&self, variance_m2: f64) -> &NearestGrid {
        let reach_m = NEAREST_SD * variance_m2.sqrt();
        let wide = self.nearest.iter().find(|(widest, _)| reach_m <= *widest);
        // There is one scale at least.
        &wide.unwrap_or(&self.nearest[self.nearest.len() - 1]).1
    }

    /// Visits the places that a point with this variance per axis \[m²\] could be of, and some
    /// others, by their number among the model's places.
    pub(crate) fn near(&self, point: &Point3<f64>, variance_m2: f64, mut visit: impl FnMut(u32)) {
        let mut runs = Vec::new();
        self.runs(point, variance_m2, &mut runs);
        let wide = self.wide.numbers.iter().copied();
        for place in runs.into_iter().flatten().chain(wide) {
            visit(self.order[place as usize]);
        }
    }

    /// Lists runs of places that hold all that a point with this variance per axis \[m²\] could be
    /// of, and some others, but for the wide ones.
    pub(crate) fn runs(&self, point: &Point3<f64>, variance_m2: f64, runs: &mut Vec<Range<u32>>) {
        self.lattice_index
            .runs(point, self.reach_m(variance_m2), runs);
    }

    /// Distance within which all places lie that a point with this variance per axis \[m²\] could
    /// be of \[m\], but for the wide ones.
    fn reach_m(&self, variance_m2: f64) -> f64 {
        let widest_m2 = variance_m2 + f64::from(self.wide.narrow_max_m2);
        (GATE_SQUARED * widest_m2).sqrt()
    }

    /// `reach_m`, and what rounding to single precision may add to it: no place outside passes the
    /// gate in single precision.
    pub(crate) fn rounded_reach_m(&self, variance_m2: f64) -> f64 {
        (1.0 + ROUNDING) * self.reach_m(variance_m2) + self.rounding_m
    }
}

/// Channel and median of the levels, if every place has one level of the same channel and no
/// descriptor. One far from most leaves these their digits.
fn levels(places: &[IndexedPlace]) -> Option<(u16, f64)> {
    let channel = places.first()?.levels.first()?.channel;
    let is_plain = |place: &IndexedPlace| {
        let [level] = &place.levels[..] else {
            return false;
        };
        level.channel == channel && place.descriptors.is_empty()
    };
    if !places.iter().all(is_plain) {
        return None;
    }
    let mut means: Vec<f64> = places.iter().map(|place| place.levels[0].mean).collect();
    means.sort_unstable_by(f64::total_cmp);
    Some((channel, means[means.len() / 2]))
}
