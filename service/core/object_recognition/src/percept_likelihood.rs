//! Likelihood of a contact's percepts at the places of a model.

use nalgebra::UnitQuaternion;

use crate::contact::{Contact, LevelReading};
use crate::index::packed_places::{
    PACKED_LEVEL_MAX, PackedPlace, PackedPlaces, packed_level_variance, packed_reading,
};
use crate::indexed_model::IndexedModel;
use crate::level_prior::LevelPrior;
use crate::model::LevelMemory;
use crate::numeric::{exp, to_f32};
use crate::tuning::{NORMAL_VARIANCE, SPARSE_RATIOS, WRONG_NORMAL_SHARE, WRONG_PERCEPT_SHARE};

/// Places that are evaluated at once.
pub(crate) const LANES: usize = 8;

/// Percepts of one contact, with all terms that do not depend on the place.
#[derive(Clone, Debug)]
pub(crate) struct ContactPercepts<'a> {
    pub(crate) contact: &'a Contact,
    levels: Vec<Level>,
    /// Factor of the variances of a place's levels.
    counted: f64,
}

/// A level on a channel of the library.
#[derive(Clone, Copy, Debug)]
struct Level {
    channel: u16,
    value: f64,
    /// Variance of its noise.
    noise: f64,
    /// Factor of the density at a place.
    scale: f64,
}

/// The percepts of one contact against the places of one model in one rotation, good to six digits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PerceptLikelihood<'a> {
    percepts: &'a ContactPercepts<'a>,
    indexed: &'a IndexedModel,
    kind: PerceptForm,
    normal_percept: Option<NormalPercept>,
}

#[derive(Clone, Copy, Debug)]
enum PerceptForm {
    /// No percept on a channel of the model.
    Nothing,
    /// One level, less the median of the model's.
    Level {
        value: f32,
        noise: f32,
        scale: f32,
        counted: f32,
    },
    /// Several percepts: each place's own lists are read.
    Several,
}

/// The contact's normal, in the model's axes.
#[derive(Clone, Copy, Debug)]
struct NormalPercept {
    normal: [f32; 3],
    per_variance: f32,
}

impl<'a> ContactPercepts<'a> {
    /// Of a contact, with the distribution of levels over the library.
    pub(crate) fn new(contact: &'a Contact, level_prior: &[LevelPrior]) -> Self {
        Self::in_measure_of(contact, contact, level_prior)
    }

    /// The same, against how likely the levels of another contact are anywhere.
    pub(crate) fn in_measure_of(
        contact: &'a Contact,
        other: &Contact,
        level_prior: &[LevelPrior],
    ) -> Self {
        let level = |reading: &LevelReading| {
            let of_channel = |own: &&LevelReading| own.channel == reading.channel;
            let anywhere = other.levels.iter().find(of_channel)?;
            let level_prior = level_prior
                .iter()
                .find(|level_prior| level_prior.channel == reading.channel)?;
            let scale = (1.0 - WRONG_PERCEPT_SHARE) / level_prior.density(anywhere);
            Some(Level {
                channel: reading.channel,
                value: reading.value,
                noise: level_prior.noise(reading),
                scale: scale.min(PACKED_LEVEL_MAX),
            })
        };
        Self {
            contact,
            levels: contact.levels.iter().filter_map(level).collect(),
            counted: 1.0,
        }
    }

    /// The same, with so many times the variances of the levels of places.
    pub(crate) fn counting(self, counted: f64) -> Self {
        Self { counted, ..self }
    }

    /// Against the places of a model, turned by `rotation`.
    pub(crate) fn at(
        &'a self,
        indexed: &'a IndexedModel,
        rotation: &UnitQuaternion<f64>,
    ) -> PerceptLikelihood<'a> {
        let Self {
            contact,
            levels,
            counted,
        } = self;
        let kind = match indexed.packed.levels() {
            _ if levels.is_empty() && contact.descriptors.is_empty() => PerceptForm::Nothing,
            None => PerceptForm::Several,
            Some((channel, middle)) => { levels.iter() }
                .find(|level| level.channel == channel)
                .map_or(PerceptForm::Nothing, |level| PerceptForm::Level {
                    value: packed_reading(level.value - middle),
                    noise: packed_level_variance(level.noise),
                    scale: to_f32(level.scale),
                    counted: to_f32(*counted),
                }),
        };
        let variance = contact.normal_sd_rad * contact.normal_sd_rad + NORMAL_VARIANCE;
        let normal_percept = contact.normal.map(|normal| NormalPercept {
            normal: (rotation * normal.into_inner()).map(to_f32).into(),
            per_variance: to_f32(1.0 / variance),
        });
        PerceptLikelihood {
            percepts: self,
            indexed,
            kind,
            normal_percept,
        }
    }
}

impl PerceptLikelihood<'_> {
    /// Likelihood ratio of the percepts: at a place, against anywhere.
    ///
    /// In the measure of the contact itself it is the exponential of
    /// [`percept_log`](crate::indexed_place::IndexedPlace::percept_log), times that of the normal.
    pub(crate) fn likelihood(&self, number: usize, packed_place: &PackedPlace) -> f32 {
        let likelihood = match &self.kind {
            PerceptForm::Nothing => 1.0,
            PerceptForm::Level {
                value,
                noise,
                scale,
                counted,
            } => level_likelihood(
                value - packed_place.level,
                counted * packed_place.level_variance + noise,
                *scale,
            ),
            PerceptForm::Several => self.place_likelihood(number),
        };
        match &self.normal_percept {
            None => likelihood,
            Some(normal_percept) => {
                likelihood * normal_percept.likelihood(&self.indexed.packed.normals[number])
            }
        }
    }

    /// The same for the first `count` of eight places.
    #[expect(
        clippy::inline_always,
        reason = "inlined into dispatched closures: compiled for their vectors"
    )]
    #[inline(always)]
    pub(crate) fn likelihoods_of(&self, numbers: &[u32; LANES], count: usize) -> [f32; LANES] {
        let packed = &self.indexed.packed.all;
        let mut likelihoods = [1.0; LANES];
        match (&self.kind, &self.normal_percept) {
            (PerceptForm::Nothing, None) => {}
            (
                PerceptForm::Level {
                    value,
                    noise,
                    scale,
                    counted,
                },
                None,
            ) => {
                // Loops, since closures given to `array::map` and `from_fn` are not compiled for
                // the widest vectors.
                let (mut levels, mut variances) = ([0.0; LANES], [0.0; LANES]);
                for (k, number) in numbers.iter().enumerate() {
                    let own = &packed[*number as usize];
                    (levels[k], variances[k]) = (own.level, own.level_variance);
                }
                for ((likelihood, level), variance) in
                    likelihoods.iter_mut().zip(&levels).zip(&variances)
                {
                    *likelihood =
                        level_likelihood(value - level, counted * variance + noise, *scale);
                }
            }
            _ => {
                for (likelihood, number) in likelihoods.iter_mut().zip(&numbers[..count]) {
                    let number = *number as usize;
                    *likelihood = self.likelihood(number, &packed[number]);
                }
            }
        }
        likelihoods
    }

    /// The same for all places of the model.
    pub(crate) fn likelihoods(&self, out: &mut Vec<f32>) {
        let PackedPlaces {
            normals,
            level_lists: [levels, variances],
            ..
        } = &self.indexed.packed;
        out.clear();
        out.resize(normals.len(), 1.0);
        match self.kind {
            PerceptForm::Nothing => {}
            PerceptForm::Level {
                value,
                noise,
                scale,
                counted,
            } => {
                let out = &mut out[..];
                simd::dispatch(
                    #[inline(always)]
                    move || {
                        for ((likelihood, level), variance) in
                            out.iter_mut().zip(levels).zip(variances)
                        {
                            *likelihood =
                                level_likelihood(value - level, counted * variance + noise, scale);
                        }
                    },
                );
            }
            PerceptForm::Several => {
                for (number, likelihood) in out.iter_mut().enumerate() {
                    *likelihood = self.place_likelihood(number);
                }
            }
        }
        if let Some(normal_percept) = &self.normal_percept {
            let out = &mut out[..];
            simd::dispatch(
                #[inline(always)]
                move || {
                    for (likelihood, normal) in out.iter_mut().zip(normals) {
                        *likelihood *= normal_percept.likelihood(normal);
                    }
                },
            );
        }
    }

    /// Fewer places than one in so many are faster one by one.
    pub(crate) fn sparse(&self) -> usize {
        SPARSE_RATIOS[usize::from(matches!(self.kind, PerceptForm::Several))]
    }

    /// Whether the likelihoods are the same in all rotations.
    pub(crate) fn is_rotation_invariant(&self) -> bool {
        self.normal_percept.is_none()
    }

    fn place_likelihood(&self, number: usize) -> f32 {
        let place = &self.indexed.places[self.indexed.packed.place(number)];
        let ratios = self.percepts.levels.iter().filter_map(|level| {
            let of_channel = |own: &&LevelMemory| own.channel == level.channel;
            let own = place.levels.iter().find(of_channel)?;
            let (apart, variance) = (
                level.value - own.mean,
                self.percepts.counted * own.variance() + level.noise,
            );
            let here = (-0.5 * apart * apart / variance).exp() / variance.sqrt();
            Some(level.scale * here + WRONG_PERCEPT_SHARE)
        });
        let descriptors = place.descriptor_log(self.percepts.contact).exp();
        to_f32(ratios.product::<f64>() * descriptors)
    }
}

#[expect(
    clippy::inline_always,
    reason = "inlined into dispatched closures: compiled for their vectors"
)]
#[inline(always)]
fn level_likelihood(apart: f32, variance: f32, scale: f32) -> f32 {
    let per = 1.0 / variance;
    scale * exp(-0.5 * apart * apart * per) * per.sqrt() + to_f32(WRONG_PERCEPT_SHARE)
}

impl NormalPercept {
    /// Likelihood ratio of the normal; 1 at a place without one, which is stored as zero.
    #[expect(
        clippy::inline_always,
        reason = "inlined into dispatched closures: compiled for their vectors"
    )]
    #[inline(always)]
    fn likelihood(&self, own: &[f32; 3]) -> f32 {
        let dot = self.normal[0] * own[0] + self.normal[1] * own[1] + self.normal[2] * own[2];
        let right = 2.0 * to_f32(1.0 - WRONG_NORMAL_SHARE) * self.per_variance;
        let likelihood = right * exp((dot - 1.0) * self.per_variance) + to_f32(WRONG_NORMAL_SHARE);
        let is_known = own[0] != 0.0 || own[1] != 0.0 || own[2] != 0.0;
        if is_known { likelihood } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Unit, Vector3};

    use super::*;
    use crate::level_prior::{level_prior, object_levels};
    use crate::model::ModelPlace;
    use crate::{ModelSettings, ObjectModel};

    fn level(channel: u16, mean: f64) -> LevelMemory {
        LevelMemory {
            channel,
            count: 3.0,
            mean,
            squares: 0.2,
            noise: 0.03,
        }
    }

    #[test]
    fn a_packed_place_has_the_likelihood_of_the_place_itself() {
        // Where the level is far from nothing, what is left of its digits has to do.
        let lists = [
            vec![vec![], vec![]],
            vec![vec![level(0, 1000.3)], vec![level(0, 1000.9)]],
            vec![vec![level(1, 0.3)], vec![level(1, 0.3)]],
            vec![vec![level(0, 1000.9)], vec![]],
            vec![
                vec![level(0, 1000.9), level(1, 2.0)],
                vec![level(1, 1.0), level(0, 1000.0)],
            ],
        ];
        let indexed_models: Vec<IndexedModel> = { lists.into_iter() }
            .map(|lists| {
                let places = lists.into_iter().zip(0..).map(|(levels, at)| ModelPlace {
                    position_m: Point3::new(f64::from(at), 0.0, 0.0),
                    normals: Vector3::new(f64::from(at), 0.0, 0.5 * f64::from(at)),
                    count: 3.0,
                    visits: 1.0,
                    variance_m2: 1e-6,
                    normal_variance: 0.0,
                    levels,
                    descriptors: Vec::new(),
                });
                let settings = ModelSettings::default();
                let model = ObjectModel::with_places(settings, 0.004, places.collect());
                IndexedModel::variants(&model).0
            })
            .collect();
        let level_prior = level_prior(indexed_models.iter().flat_map(|own| &own.own_levels));
        let bare = Contact::at(Point3::origin(), 0.001);
        let contacts = [
            bare.clone(),
            bare.clone().with_level(0, 1000.5, 0.1),
            bare.clone().with_level(0, 9000.0, 0.1),
            bare.clone().with_level(7, 0.5, 0.1),
            { bare.clone() }
                .with_level(0, 1000.5, 0.1)
                .with_level(1, 1.0, 0.2),
            bare.clone().with_level(1, 0.5, 0.0),
            bare.with_normal(Unit::new_normalize(Vector3::new(1.0, 0.2, 0.0)), 0.1),
        ];
        for contact in &contacts {
            let percepts = ContactPercepts::new(contact, &level_prior);
            for indexed in &indexed_models {
                let turn = UnitQuaternion::new(Vector3::new(0.0, -0.2, 0.1));
                let local = percepts.at(indexed, &turn);
                let mut all = Vec::new();
                local.likelihoods(&mut all);
                for (number, packed_place) in indexed.packed.all.iter().enumerate() {
                    let place = &indexed.places[indexed.packed.place(number)];
                    let packed = local.likelihood(number, packed_place);
                    assert!((all[number] / packed - 1.0).abs() < 1e-6);
                    let mut full = place.percept_log(contact, &level_prior);
                    if let (Some(normal), Some(own)) = (contact.normal, place.normal) {
                        let variance = 0.1 * 0.1 + NORMAL_VARIANCE;
                        let apart = 2.0 * (1.0 - (turn * normal.into_inner()).dot(&own));
                        let right = 0.9 * 2.0 / variance * (-0.5 * apart / variance).exp();
                        full += (right + 0.1).ln();
                    }
                    let packed = f64::from(packed).ln();
                    assert!((packed - full).abs() < 1e-3, "{packed} {full} {contact:?}");
                }
            }
        }
    }

    #[test]
    fn the_measure_of_another_contact_scales_what_a_right_level_tells() {
        // One level alone is compared at once, and lists one by one.
        for channels in [1, 2] {
            let place = ModelPlace {
                position_m: Point3::origin(),
                normals: Vector3::zeros(),
                count: 3.0,
                visits: 1.0,
                variance_m2: 1e-6,
                normal_variance: 0.0,
                levels: (0..channels).map(|channel| level(channel, 2.0)).collect(),
                descriptors: Vec::new(),
            };
            let model = ObjectModel::with_places(ModelSettings::default(), 0.004, vec![place]);
            let indexed = IndexedModel::variants(&model).0;
            let levels = [level(0, -1.0), level(0, 3.0)];
            let level_prior = level_prior(object_levels(levels.iter()).iter());
            let contact = |value| Contact::at(Point3::origin(), 0.001).with_level(0, value, 0.1);
            let (own, other) = (contact(2.1), contact(4.0));
            let right = |percepts: &ContactPercepts<'_>| {
                let local = percepts.at(&indexed, &UnitQuaternion::identity());
                f64::from(local.likelihood(0, &indexed.packed.all[0])) - WRONG_PERCEPT_SHARE
            };
            let same = right(&ContactPercepts::new(&own, &level_prior));
            let scaled = ContactPercepts::in_measure_of(&own, &other, &level_prior);
            let density = |contact: &Contact| level_prior[0].density(&contact.levels[0]);
            let expected = same * density(&own) / density(&other);
            let scaled = right(&scaled);
            assert!(expected > 1.2 * same, "{expected} {same}");
            assert!(
                (scaled / expected - 1.0).abs() < 1e-4,
                "{scaled} {expected}"
            );
            // Without a level on that channel there is nothing to compare with.
            let bare = ContactPercepts::in_measure_of(&own, &own.bare(), &level_prior);
            let bare = right(&bare) + WRONG_PERCEPT_SHARE;
            assert!((bare - 1.0).abs() < 1e-6, "{bare}");
        }
    }
}
