//! What a model's places say of how a field varies between them.

use nalgebra::{Point3, Unit, Vector3};

use super::graph::LinkGraph;
use super::kriging::{Kriging, Weights};
use crate::model::ModelPlace;
use crate::tuning::{
    ERROR_NEIGHBOURS, FIELD_LENGTHS, FIELD_NOISES, FIELD_SAMPLES, KRIGING_CURVE, KRIGING_SURFACE,
    SHRINKAGE, UNPREDICTED_MAX,
};

/// What varies over a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FieldOf {
    /// The surface's own place, across it.
    Place,
    /// The level of a channel.
    Level(u16),
}

/// A Gaussian process over a surface, as far as the places tell it.
#[derive(Clone, Debug)]
pub(super) struct Field {
    of: FieldOf,
    length_m: f64,
    /// Noise per variance.
    noise: f64,
    variance: f64,
    /// Squared error of each place, left out, per its expectation.
    errors: Vec<f64>,
}

/// Where a field is predicted: the middle, and the axes along the surface.
#[derive(Clone, Debug)]
pub(super) struct Site {
    pub(super) middle: Point3<f64>,
    pub(super) axes: Vec<Vector3<f64>>,
}

/// A field about a site.
#[derive(Debug)]
pub(super) struct LocalField {
    kriging: Kriging,
    near: Vec<u32>,
    variance: f64,
}

impl Site {
    /// Places by which a field is predicted here.
    fn count(&self) -> usize {
        if self.axes.len() == 1 {
            KRIGING_CURVE
        } else {
            KRIGING_SURFACE
        }
    }
}

impl Field {
    /// Learned by leave-one-out cross-validation: length and noise are those of the largest
    /// likelihood of the places, each predicted by the others, and the variance follows.
    pub(super) fn learned(of: FieldOf, places: &[ModelPlace], graph: &LinkGraph) -> Option<Self> {
        let step = places.len().div_ceil(FIELD_SAMPLES).max(1);
        let sites: Vec<(usize, Site)> = (0..places.len())
            .step_by(step)
            .filter_map(|own| Some((own, site_of(own, places, graph)?)))
            .collect();
        let mut best: Option<(f64, Self)> = None;
        for length in FIELD_LENGTHS {
            for noise in FIELD_NOISES {
                let field = Self {
                    of,
                    length_m: length * graph.typical_m,
                    noise,
                    variance: 1.0,
                    errors: Vec::new(),
                };
                if let Some((log, variance)) = field.cross_validated(&sites, places, graph)
                    && best.as_ref().is_none_or(|(most, _)| log > *most)
                {
                    let errors = Vec::new();
                    best = Some((
                        log,
                        Self {
                            variance,
                            errors,
                            ..field
                        },
                    ));
                }
            }
        }
        let (_, mut field) = best?;
        let errors = (0..places.len()).map(|own| {
            let site = site_of(own, places, graph)?;
            let (residual, variance) = field.left_out(own, &site, places, graph)?;
            Some(residual / (field.variance * variance))
        });
        field.errors = errors.map(|error| error.unwrap_or(1.0)).collect();
        Some(field)
    }

    /// Whether the places around tell most of what is felt at a place.
    pub(super) fn is_predictable(&self, places: &[ModelPlace], graph: &LinkGraph) -> bool {
        let FieldOf::Level(channel) = self.of else {
            return true;
        };
        let (mut count, mut error) = (0.0, 0.0);
        let mut levels = Vec::new();
        for own in 0..places.len() {
            levels.extend(level(&places[own], channel));
            let left_out = site_of(own, places, graph)
                .and_then(|site| self.left_out(own, &site, places, graph));
            if let Some((residual, _)) = left_out {
                count += 1.0;
                error += residual;
            }
        }
        let n = levels.len().max(1) as f64;
        let mean = levels.iter().sum::<f64>() / n;
        let variance = levels
            .iter()
            .map(|level| (level - mean).powi(2))
            .sum::<f64>()
            / n;
        error <= UNPREDICTED_MAX * variance * count
    }

    /// Squared difference of a place from its prediction by the others, and the variance of that,
    /// per the field's own.
    fn left_out(
        &self,
        own: usize,
        site: &Site,
        places: &[ModelPlace],
        graph: &LinkGraph,
    ) -> Option<(f64, f64)> {
        let local = self.around(site, graph.near[own].iter().copied(), places)?;
        let place = &places[own];
        let weights = local.kriging.weights(&place.position_m.coords);
        let residual = self.residual(&weights, &local, site, place, places)?;
        Some((residual, weights.variance + self.noise))
    }

    /// Profile log-likelihood of the places left out one by one, and the variance at which it is
    /// the largest.
    fn cross_validated(
        &self,
        sites: &[(usize, Site)],
        places: &[ModelPlace],
        graph: &LinkGraph,
    ) -> Option<(f64, f64)> {
        let (mut count, mut squares, mut logs) = (0.0, 0.0, 0.0);
        for (own, site) in sites {
            let Some((residual, variance)) = self.left_out(*own, site, places, graph) else {
                continue;
            };
            count += 1.0;
            squares += residual / variance;
            logs += variance.ln();
        }
        if count < 4.0 {
            return None;
        }
        // A floor against values that are all the same.
        let variance = f64::max(squares / count, 1e-18);
        Some((-0.5 * (count * variance.ln() + logs), variance))
    }

    /// Squared difference of a place from its prediction.
    fn residual(
        &self,
        weights: &Weights,
        local: &LocalField,
        site: &Site,
        place: &ModelPlace,
        places: &[ModelPlace],
    ) -> Option<f64> {
        match self.of {
            FieldOf::Place => {
                let mut apart = local.position(weights, places) - place.position_m;
                for axis in &site.axes {
                    apart -= axis * axis.dot(&apart);
                }
                Some(apart.norm_squared())
            }
            FieldOf::Level(channel) => {
                let predicted = local.level(weights, channel, places)?;
                Some((level(place, channel)? - predicted).powi(2))
            }
        }
    }

    /// The field about a site, from the nearest of these places that have it.
    pub(super) fn around(
        &self,
        site: &Site,
        near: impl Iterator<Item = u32>,
        places: &[ModelPlace],
    ) -> Option<LocalField> {
        let has = |number: &u32| match self.of {
            FieldOf::Place => true,
            FieldOf::Level(channel) => level(&places[*number as usize], channel).is_some(),
        };
        let near: Vec<u32> = near.filter(has).take(site.count()).collect();
        let positions = near
            .iter()
            .map(|number| places[*number as usize].position_m.coords);
        let positions = positions.collect();
        // What errs more than elsewhere, as at an edge, is less certain around (shrinkage).
        let some = near.iter().take(ERROR_NEIGHBOURS);
        let errors = some.filter_map(|number| self.errors.get(*number as usize));
        let (count, sum) = errors.fold((0.0, 0.0), |(n, sum), error| (n + 1.0, sum + error));
        let local = (sum + SHRINKAGE) / (count + SHRINKAGE);
        Some(LocalField {
            kriging: Kriging::new(positions, &site.axes, self.length_m, self.noise)?,
            near,
            variance: self.variance * local,
        })
    }
}

impl LocalField {
    /// Weights of the places at a point, and the variance of what is predicted.
    pub(super) fn at(&self, point: &Point3<f64>) -> (Weights, f64) {
        let weights = self.kriging.weights(&point.coords);
        let variance = self.variance * weights.variance;
        (weights, variance)
    }

    /// The place that is predicted.
    pub(super) fn position(&self, weights: &Weights, places: &[ModelPlace]) -> Point3<f64> {
        let own = weights.of.iter().zip(&self.near);
        let sum = own.map(|(w, number)| places[*number as usize].position_m.coords * *w);
        Point3::from(sum.sum::<Vector3<f64>>())
    }

    /// The level that is predicted.
    pub(super) fn level(
        &self,
        weights: &Weights,
        channel: u16,
        places: &[ModelPlace],
    ) -> Option<f64> {
        let levels = self
            .near
            .iter()
            .map(|n| level(&places[*n as usize], channel));
        let levels: Option<Vec<f64>> = levels.collect();
        Some(weights.mean(levels?.into_iter()))
    }
}

/// Mean level of a place on a channel.
fn level(place: &ModelPlace, channel: u16) -> Option<f64> {
    let own = place.levels.iter().find(|own| own.channel == channel);
    own.map(|own| own.mean)
}

/// The surface about a place: a plane where it has triangles, a line where it has two links.
fn site_of(own: usize, places: &[ModelPlace], graph: &LinkGraph) -> Option<Site> {
    let middle = places[own].position_m;
    let links = graph.links[own].iter();
    let to: Vec<Vector3<f64>> = links
        .map(|other| places[*other as usize].position_m - middle)
        .collect();
    if to.len() < 2 {
        return None;
    }
    let has_triangle = graph
        .triangles
        .iter()
        .any(|triangle| triangle.iter().any(|corner| *corner as usize == own));
    let axes = if has_triangle {
        let spread = to.iter().map(|to| to * to.transpose());
        let eigen = spread.sum::<nalgebra::Matrix3<f64>>().symmetric_eigen();
        let normal = eigen.eigenvalues.imin();
        let along = (0..3).filter(|axis| *axis != normal);
        along
            .map(|axis| eigen.eigenvectors.column(axis).into())
            .collect()
    } else {
        vec![Unit::try_new(to[1] - to[0], 1e-12)?.into_inner()]
    };
    Some(Site { middle, axes })
}
