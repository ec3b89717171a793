//! Building the surfel map of a model.

use std::f64::consts::{FRAC_1_PI, TAU};

use nalgebra::Unit;

use crate::index::cell_lists::CellLists;
use crate::model::ObjectModel;
use crate::numeric::centroid;
use crate::surfels::coverage_test::CoverageTest;
use crate::surfels::fit::surfels;
use crate::surfels::local_surface::LocalSurface;
use crate::surfels::map::SurfelMap;
use crate::surfels::point_pairs::PointPairTable;
use crate::surfels::surfel::{ContactNoise, Surfel};
use crate::tuning::{
    ALONG_MAX, COVERAGE_MIN, FIT_NEIGHBOURS, LEAVE_ONE_OUT_MAX, LIST_CELL_PER_REACH, OUTLIER_SHARE,
    REACH_SD, SAME_SIDE_COS,
};

impl SurfelMap {
    /// Of a model; `None` if fewer than three of its places have a normal.
    pub(crate) fn new(model: &ObjectModel) -> Option<Self> {
        let mut surfels = surfels(model.places());
        if surfels.len() < 3 {
            return None;
        }
        let middle = centroid(surfels.iter().map(|surfel| surfel.position.coords));
        for surfel in &mut surfels {
            surfel.position -= middle;
        }
        let radius_m = surfels
            .iter()
            .map(|surfel| surfel.position.coords.norm())
            .fold(1e-9, f64::max);
        let extent_m = 2.0 * radius_m;
        let noise_m2 = model.noise_m2();
        let mut map = Self {
            middle,
            pairs: PointPairTable::new(&surfels, extent_m),
            cells: cell_lists(&surfels, noise_m2),
            area_m2: surfels.iter().map(|surfel| surfel.area_m2).sum::<f64>(),
            extent_m,
            spacing_m: model.spacing_m(),
            coverage_test: CoverageTest::default(),
            correlation_m: 0.0,
            surfels,
            expected: (0.0, 1.0),
        };
        for _ in 0..2 {
            map.equalise_areas(noise_m2);
        }
        map.area_m2 = map.surfels.iter().map(|surfel| surfel.area_m2).sum::<f64>();
        let place_m2 = map.area_m2 / map.surfels.len() as f64;
        map.correlation_m = (FIT_NEIGHBOURS as f64 * place_m2 * FRAC_1_PI).sqrt();
        map.coverage_test = CoverageTest::new(&map.surfels);
        map.expected = map.leave_one_out(model);
        Some(map)
    }

    /// Scales areas so that the surfels sum up to one at every place: where places are dense each
    /// stands for less area, at edges for more.
    fn equalise_areas(&mut self, noise_m2: f64) {
        let sums: Vec<f64> = self
            .surfels
            .iter()
            .map(|own| {
                let near = self.cells.near(&own.position).iter();
                near.map(|&number| {
                    let surfel = &self.surfels[number as usize];
                    let along = 0.5 * surfel.against(&own.position).along_m2;
                    let tangent = surfel.tangent_m2 + noise_m2;
                    let is_same = surfel.normal.dot(&own.normal) > SAME_SIDE_COS
                        && along < ALONG_MAX * tangent;
                    let weight = surfel.area_m2 / (TAU * tangent) * (-along / tangent).exp();
                    if is_same { weight } else { 0.0 }
                })
                .sum()
            })
            .collect();
        for (surfel, sum) in self.surfels.iter_mut().zip(sums) {
            surfel.area_m2 /= sum.max(COVERAGE_MIN);
        }
    }

    /// Leave-one-out cross-validation: mean and standard deviation of the log density of a place,
    /// taken for a contact, under the surfels of the others.
    fn leave_one_out(&self, model: &ObjectModel) -> (f64, f64) {
        let step = self.surfels.len().div_ceil(LEAVE_ONE_OUT_MAX).max(1);
        let floor = 1e-3 * self.area_m2 / self.extent_m.powi(3);
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for own in (0..self.surfels.len()).step_by(step) {
            let place = &model.places()[self.surfels[own].place as usize];
            let point = place.position_m - self.middle;
            let normal = place.normal();
            let normal = normal.as_ref().map(Unit::as_ref);
            let noise = ContactNoise {
                position_m2: place.variance_m2 / place.count,
                normal: place.normal_variance / place.count,
                widen: 1.0,
            };
            let others = { self.cells.near(&point).iter() }
                .filter(|&&number| number as usize != own)
                .map(|&number| &self.surfels[number as usize]);
            let surface = LocalSurface::new(&point, normal, &noise, others, |_| 1.0);
            let total = surface.map_or(0.0, |surface| surface.densities(normal, &noise).sum());
            let log = ((1.0 - OUTLIER_SHARE) * total + floor).ln();
            count += 1.0;
            sum += log;
            squares += log * log;
        }
        let mean: f64 = sum / count;
        (mean, (squares / count - mean * mean).max(0.01).sqrt())
    }
}

fn cell_lists(surfels: &[Surfel], noise_m2: f64) -> CellLists {
    let positions: Vec<_> = surfels.iter().map(|surfel| surfel.position).collect();
    let reaches_m: Vec<_> = surfels
        .iter()
        .map(|surfel| REACH_SD * (surfel.tangent_m2 + noise_m2).sqrt())
        .collect();
    CellLists::new(&positions, &reaches_m, LIST_CELL_PER_REACH)
}
