//! What a model's places say of how a field varies between them.

use nalgebra::{Point3, Vector3};

use super::graph::LinkGraph;
use super::kriging::{Kriging, Weights};
use super::row::Row;
use super::tails;
use super::tuning::{
    ERROR_NEIGHBOURS, FIELD_LENGTHS, FIELD_NOISES, FIELD_SAMPLES, KRIGING_CURVE, KRIGING_SURFACE,
    SAME_SDS,
};
use crate::indexed_place::Across;
use crate::model::{LevelMemory, ModelPlace};
use crate::numeric::median;
use crate::tuning::SHRINKAGE;

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
    /// What differs from place to place beyond the noise of contacts, per variance: edges, borders
    /// of patterns.
    roughness: f64,
    /// Squared error of each place, left out, per its expectation.
    errors: Vec<f64>,
    /// Median of how far the places are off their predictions.
    pub(super) typical_error: f64,
}

/// Where a field is predicted: the middle, and the axes along the surface.
#[derive(Clone, Debug)]
pub(super) struct Site {
    pub(super) middle: Point3<f64>,
    pub(super) axes: Vec<Vector3<f64>>,
    /// Places on whose side of the surface it lies; none of a curve.
    pub(super) of: Vec<u32>,
    /// The places before and after it along a curve, by which places are predicted.
    pub(super) row: Option<Row>,
}

/// A place that is predicted by the others.
#[derive(Clone, Debug)]
pub(super) struct LeftOut {
    pub(super) own: usize,
    /// The sides of the surface about it, and the places of each, nearest first.
    pub(super) from: Vec<(Site, Vec<u32>)>,
}

/// A field about a site.
#[derive(Debug)]
pub(super) struct LocalField {
    kriging: Kriging,
    near: Vec<u32>,
    variance: f64,
    roughness: f64,
    /// Over which plane or line a place is predicted; none of a level.
    over: Option<Site>,
}

impl Site {
    /// The point of the plane or line below a point.
    pub(super) fn below(&self, point: &Point3<f64>) -> Point3<f64> {
        let offset = point - self.middle;
        let along = self.axes.iter().map(|axis| axis * axis.dot(&offset));
        self.middle + along.sum::<Vector3<f64>>()
    }

    /// Where a point lies among the places by which one is predicted.
    fn coordinate(&self, point: &Point3<f64>) -> Vector3<f64> {
        match &self.row {
            Some(_) => Vector3::x() * self.axes[0].dot(&(point - self.middle)),
            None => self.below(point).coords,
        }
    }

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
    pub(super) fn learned(
        of: FieldOf,
        left_out: &[LeftOut],
        places: &[ModelPlace],
        graph: &LinkGraph,
    ) -> Option<(f64, Self)> {
        let step = left_out.len().div_ceil(FIELD_SAMPLES).max(1);
        let some: Vec<&LeftOut> = left_out.iter().step_by(step).collect();
        let mut best: Option<(f64, Self)> = None;
        for length in FIELD_LENGTHS {
            for noise in FIELD_NOISES {
                let field = Self {
                    of,
                    length_m: length * graph.typical_m,
                    noise,
                    variance: 1.0,
                    roughness: 0.0,
                    errors: Vec::new(),
                    typical_error: 0.0,
                };
                if let Some((log, variance)) = field.cross_validated(&some, places)
                    && best.as_ref().is_none_or(|(most, _)| log > *most)
                {
                    best = Some((log, Self { variance, ..field }));
                }
            }
        }
        let (log, mut field) = best?;
        let felt = places.iter().filter_map(|place| field.noise_of(place));
        let (count, sum) = felt.fold((0.0, 0.0), |(count, sum), noise| (count + 1.0, sum + noise));
        let felt = sum / f64::max(count, 1.0) / field.variance;
        field.roughness = (field.noise - felt).max(0.0);
        let mut errors = vec![1.0; places.len()];
        let mut squares = Vec::with_capacity(left_out.len());
        for of in left_out {
            if let Some((residual, variance)) = field.error(of, places) {
                errors[of.own] = residual / (field.variance * variance);
                squares.push(residual);
            }
        }
        field.errors = errors;
        field.typical_error = median(squares).sqrt();
        Some((log, field))
    }

    /// Variance of what was felt at a place, by the noise of its contacts.
    fn noise_of(&self, place: &ModelPlace) -> Option<f64> {
        match self.of {
            FieldOf::Place => Some(place.variance_m2 / (place.count * place.count)),
            FieldOf::Level(channel) => {
                let own = place.levels.iter().find(|own| own.channel == channel);
                own.map(LevelMemory::variance)
            }
        }
    }

    /// How much the places around tell of what is felt at a place \[nats\], over all places.
    ///
    /// If they leave the share s of the variance of n levels open, the log-likelihood ratio of
    /// Gaussian levels that follow from them to independent ones is −n/2 ln s. Levels that differ
    /// by no more than their noise are the same all over, and follow anyway.
    pub(super) fn predicted_nats(&self, left_out: &[LeftOut], places: &[ModelPlace]) -> f64 {
        let FieldOf::Level(channel) = self.of else {
            return f64::INFINITY;
        };
        if is_same_all_over(channel, places) {
            return f64::INFINITY;
        }
        let errors = left_out.iter().filter_map(|own| self.error(own, places));
        let (count, error) = errors.fold((0.0, 0.0), |(n, sum), (error, _)| (n + 1.0, sum + error));
        let levels = places.iter().filter_map(|place| level(place, channel));
        let levels: Vec<f64> = levels.collect();
        let n = levels.len().max(1) as f64;
        let mean = levels.iter().sum::<f64>() / n;
        let variance = levels
            .iter()
            .map(|level| (level - mean).powi(2))
            .sum::<f64>()
            / n;
        let open = error / f64::max(variance * count, f64::MIN_POSITIVE);
        -0.5 * count * open.ln()
    }

    /// Squared difference of a place from its prediction by the others, and the variance of that,
    /// per the field's own. About an edge it lies on the side that predicts it best.
    fn error(&self, left_out: &LeftOut, places: &[ModelPlace]) -> Option<(f64, f64)> {
        let place = &places[left_out.own];
        let of_site = |(site, near): &(Site, Vec<u32>)| {
            let local = self.around(site, near, places)?;
            let weights = local.weights(&place.position_m);
            let residual = self.residual(&weights, &local, site, place, places)?;
            Some((residual, weights.variance + self.noise))
        };
        let all = left_out.from.iter().filter_map(of_site);
        all.min_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)))
    }

    /// Profile log-likelihood of a place, on average over those left out one by one, and the
    /// variance at which it is the largest.
    fn cross_validated(&self, left_out: &[&LeftOut], places: &[ModelPlace]) -> Option<(f64, f64)> {
        let errors = left_out.iter().filter_map(|own| {
            let (residual, variance) = self.error(own, places)?;
            Some((residual / variance, variance, own.from.len() as f64))
        });
        let errors: Vec<(f64, f64, f64)> = errors.collect();
        if errors.len() < 4 {
            return None;
        }
        // A floor against values that are all the same.
        Some(tails::profile(&errors, 1e-18))
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
        near: &[u32],
        places: &[ModelPlace],
    ) -> Option<LocalField> {
        let has = |number: &u32| match self.of {
            FieldOf::Place => true,
            FieldOf::Level(channel) => level(&places[*number as usize], channel).is_some(),
        };
        // Places lie across the plane by what is to be predicted: it must not tell of itself.
        let over = (self.of == FieldOf::Place).then(|| site.clone());
        let row = over.as_ref().and_then(|over| over.row.as_ref());
        let (near, positions, axes): (Vec<u32>, Vec<Vector3<f64>>, _) = if let Some(row) = row {
            let (near, along) = row.iter().unzip();
            (near, along, &[Vector3::x()][..])
        } else {
            let near = near.iter().copied().filter(has).take(site.count());
            let of = |number: u32| {
                let at = places[number as usize].position_m;
                let over = over.as_ref();
                (number, over.map_or(at.coords, |over| over.coordinate(&at)))
            };
            let (near, positions) = near.map(of).unzip();
            (near, positions, &site.axes[..])
        };
        // What errs more than elsewhere, as at an edge, is less certain around (shrinkage).
        let some = near.iter().take(ERROR_NEIGHBOURS);
        let errors = some.filter_map(|number| self.errors.get(*number as usize));
        let (count, sum) = errors.fold((0.0, 0.0), |(n, sum), error| (n + 1.0, sum + error));
        let local = (sum + SHRINKAGE) / (count + SHRINKAGE);
        Some(LocalField {
            kriging: Kriging::new(positions, axes, self.length_m, self.noise)?,
            near,
            variance: self.variance * local,
            roughness: self.roughness,
            over,
        })
    }
}

impl LocalField {
    /// Weights of the places at a point, and the variance of what is predicted.
    pub(super) fn at(&self, point: &Point3<f64>) -> (Weights, f64) {
        let weights = self.weights(point);
        let variance = self.variance * (weights.variance + self.roughness);
        (weights, variance)
    }

    /// What is across the plane or line over which places are predicted; of a row, across the curve
    /// as it leads from half a step before a point to half a step behind it.
    pub(super) fn across(&self, at: &Point3<f64>, step_m: f64, places: &[ModelPlace]) -> Across {
        let site = self.over.as_ref();
        if let Some(site) = site.filter(|site| site.row.is_some()) {
            let half_step = site.axes[0] * (0.5 * step_m);
            let [before, after] = [at - half_step, at + half_step]
                .map(|at| self.position(&self.weights(&at), places));
            if let Some(along) = (after - before).try_normalize(1e-12) {
                return Across::new([&along].into_iter());
            }
        }
        Across::new(site.iter().flat_map(|site| &site.axes))
    }

    fn weights(&self, point: &Point3<f64>) -> Weights {
        let over = self.over.as_ref();
        let at = over.map_or(point.coords, |over| over.coordinate(point));
        self.kriging.weights(&at)
    }

    /// The place that is predicted.
    pub(super) fn position(&self, weights: &Weights, places: &[ModelPlace]) -> Point3<f64> {
        let own = weights.of.iter().zip(&self.near);
        let sum = own.map(|(w, number)| places[*number as usize].position_m.coords * *w);
        Point3::from(sum.sum::<Vector3<f64>>())
    }

    /// What is known of the level at a point; none where a place has no such level.
    pub(super) fn memory(
        &self,
        at: &Point3<f64>,
        channel: u16,
        places: &[ModelPlace],
    ) -> Option<LevelMemory> {
        let (weights, variance) = self.at(at);
        Some(LevelMemory {
            channel,
            count: 1.0,
            mean: self.level(&weights, channel, places)?,
            squares: 0.0,
            noise: variance,
        })
    }

    /// Variance of the level over the field of a point: along these axes it lies within one of
    /// these offsets to either side \[m\].
    pub(super) fn scatter(
        &self,
        at: &Point3<f64>,
        (axes, field_m): (&[Vector3<f64>], f64),
        channel: u16,
        places: &[ModelPlace],
    ) -> Option<f64> {
        let level = |at: Point3<f64>| self.level(&self.weights(&at), channel, places);
        let squares = axes.iter().map(|axis| {
            let [above, below] = [at + axis * field_m, at - axis * field_m].map(level);
            Some((0.5 * (above? - below?)).powi(2))
        });
        squares.sum()
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

/// Whether the levels of places differ by no more than their noise: the squares about their mean,
/// each per the variance of its noise, are together about as many as they (χ²).
fn is_same_all_over(channel: u16, places: &[ModelPlace]) -> bool {
    let levels = places.iter().filter_map(|place| {
        let own = place.levels.iter().find(|own| own.channel == channel)?;
        // No level is more exact than its number.
        let least = (16.0 * f64::EPSILON * own.mean).powi(2).max(1e-60);
        let noise = own.noise / (own.count * own.count);
        Some((own.mean, noise.max(least).recip()))
    });
    let weights: f64 = levels.clone().map(|(_, weight)| weight).sum();
    let mean = levels
        .clone()
        .map(|(own, weight)| own * weight)
        .sum::<f64>()
        / weights;
    let squares = levels.map(|(own, weight)| (own - mean).powi(2) * weight);
    let (n, sum) = squares.fold((0.0, 0.0), |(n, sum), square| (n + 1.0, sum + square));
    sum <= n + SAME_SDS * f64::sqrt(2.0 * n)
}

/// Mean level of a place on a channel.
fn level(place: &ModelPlace, channel: u16) -> Option<f64> {
    let own = place.levels.iter().find(|own| own.channel == channel);
    own.map(|own| own.mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Contact;
    use crate::model::{ModelSettings, ObjectModel};

    /// Whether so many places with these levels and deviations have the same all over.
    fn is_same(of: impl Fn(u32) -> (f64, f64)) -> bool {
        let mut model = ObjectModel::new(ModelSettings::default());
        for k in 0..60 {
            let (level, sd) = of(k);
            let at = Point3::new(0.02 * f64::from(k), 0.0, 0.0);
            model.learn(&Contact::at(at, 0.001).with_level(0, level, sd));
        }
        is_same_all_over(0, model.places())
    }

    #[test]
    fn levels_that_differ_by_their_noise_alone_are_the_same() {
        let normal = |k: u32| {
            let uniform = |axis| random::uniform(41, [u64::from(k), axis, 0]);
            (0..12).map(uniform).sum::<f64>() - 6.0
        };
        let of_board = |k: u32| f64::from(k % 2);
        assert!(is_same(|_| (2.0, 0.0)));
        assert!(is_same(|k| (2.0 + 0.1 * normal(k), 0.1)));
        assert!(is_same(|k| (-1e6 + 0.1 * normal(k), 0.2)));
        assert!(!is_same(|k| (2.0 + 0.2 * normal(k), 0.1)));
        assert!(!is_same(|k| (of_board(k), 0.01)));
        // One imprecise level says nothing of the others.
        assert!(!is_same(|k| (
            of_board(k),
            if k == 0 { 10.0 } else { 0.01 }
        )));
        assert!(is_same(|k| if k == 0 { (9.0, 10.0) } else { (2.0, 0.01) }));
    }
}
