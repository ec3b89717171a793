//! The next touch: the one with the largest expected information between hypotheses.

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::contact::Contact;
use crate::indexed_model::IndexedModel;
use crate::library::ObjectLibrary;
use crate::tuning::{GAIN_NATS_MAX, POSE_WORTH, RIVAL_WEIGHT_MIN, RIVALS_MAX, SITES_MAX};
use crate::variant::VariantId;

/// A touch with its expected information.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextTouch {
    /// Where to touch \[m\], in the episode's frame.
    pub point_m: Point3<f64>,
    /// Direction of motion on the approach, in the episode's frame.
    pub approach: Option<Unit<Vector3<f64>>>,
    /// Information expected from it \[nats\], at most.
    pub gain_nats: f64,
}

/// A hypothesis with its share of all mass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WeightedPose {
    pub(crate) of: VariantId,
    pub(crate) map_from_episode: Isometry3<f64>,
    pub(crate) weight: f64,
}

/// The best touch on the surface of one hypothesis, after these contacts. The noise is that of the
/// last.
///
/// The gain is wᵢ Σ wⱼ min(log pᵢ/pⱼ, 8) / (1 + Σρ), i the own hypothesis and j the others: errors
/// of the model are common to all contacts near the touch.
pub(crate) fn next_touch(
    library: &ObjectLibrary,
    rivals: Vec<WeightedPose>,
    contacts: &[Contact],
) -> Option<NextTouch> {
    let last = contacts.last()?;
    let chosen = choose(rivals);
    if chosen.len() < 2 {
        return None;
    }
    let mut best: Option<NextTouch> = None;
    for own in &chosen {
        let Some(indexed) = library.variant(own.of) else {
            continue;
        };
        let back = own.map_from_episode.inverse();
        for site in touch_sites(indexed) {
            let touch = site.touch(indexed, &back, last);
            let gain_nats = gain_nats(library, indexed, own, &chosen, &touch, contacts);
            if gain_nats > best.map_or(0.0, |best| best.gain_nats) {
                best = Some(NextTouch {
                    point_m: touch.position_m,
                    approach: touch.normal.map(|normal| -normal),
                    gain_nats,
                });
            }
        }
    }
    best
}

/// The heaviest hypotheses: one pose of every object, then further poses.
fn choose(mut rivals: Vec<WeightedPose>) -> Vec<WeightedPose> {
    rivals.retain(|rival| rival.weight > RIVAL_WEIGHT_MIN);
    rivals.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    let mut chosen: Vec<WeightedPose> = Vec::with_capacity(RIVALS_MAX);
    for is_first in [true, false] {
        for rival in &rivals {
            let is_known = chosen
                .iter()
                .any(|other| other.of.object == rival.of.object);
            let same = |other: &WeightedPose| other.map_from_episode == rival.map_from_episode;
            if chosen.len() < RIVALS_MAX && is_known != is_first && !chosen.iter().any(same) {
                chosen.push(*rival);
            }
        }
    }
    chosen
}

/// Information that is expected of a touch of the hypothesis `own` \[nats\].
fn gain_nats(
    library: &ObjectLibrary,
    indexed: &IndexedModel,
    own: &WeightedPose,
    rivals: &[WeightedPose],
    touch: &Contact,
    contacts: &[Contact],
) -> f64 {
    let here = log(library, indexed, own, touch);
    let gains = rivals.iter().map(|other| {
        let worth = if other.of.object == own.of.object {
            POSE_WORTH
        } else {
            1.0
        };
        let there = library
            .variant(other.of)
            .map_or(here, |indexed| log(library, indexed, other, touch));
        other.weight * worth * (here - there).clamp(0.0, GAIN_NATS_MAX)
    });
    let correlated = indexed.surfel_map.as_ref().map_or(0.0, |surfel_map| {
        let correlations = contacts
            .iter()
            .map(|before| surfel_map.error_correlation(touch, before));
        correlations.sum()
    });
    own.weight * gains.sum::<f64>() / (1.0 + correlated)
}

/// A point where a model could be touched.
struct TouchSite {
    position: Point3<f64>,
    normal: Option<Unit<Vector3<f64>>>,
    place: usize,
}

impl TouchSite {
    /// A touch here with the noise of another, in the frame that `back` leads to.
    fn touch(&self, indexed: &IndexedModel, back: &Isometry3<f64>, like: &Contact) -> Contact {
        let mut touch = Contact {
            position_m: back * self.position,
            normal: self.normal.map(|normal| back * normal),
            ..like.bare()
        };
        for level in &indexed.places[self.place].levels {
            let sd = level.variance().sqrt();
            touch = touch.with_level(level.channel, level.mean, sd);
        }
        touch
    }
}

/// An even sample of a model's places, on its smoothed surface: of the raw places those with the
/// largest errors would seem to be the most informative.
fn touch_sites(indexed: &IndexedModel) -> Vec<TouchSite> {
    if let Some(surfel_map) = &indexed.surfel_map {
        let step = surfel_map.surfels.len().div_ceil(SITES_MAX).max(1);
        let surfels = surfel_map.surfels.iter().step_by(step);
        let touch_sites = surfels.map(|surfel| TouchSite {
            position: surfel.position + surfel_map.middle,
            normal: Some(Unit::new_normalize(surfel.normal)),
            place: surfel.place as usize,
        });
        return touch_sites.collect();
    }
    let step = indexed.places.len().div_ceil(SITES_MAX).max(1);
    let places = indexed.places.iter().enumerate().step_by(step);
    let touch_sites = places.map(|(number, place)| TouchSite {
        position: place.position,
        normal: place.normal,
        place: number,
    });
    touch_sites.collect()
}

/// Log density of a touch under one hypothesis.
fn log(
    library: &ObjectLibrary,
    indexed: &IndexedModel,
    rival: &WeightedPose,
    touch: &Contact,
) -> f64 {
    if let Some(surfel_map) = &indexed.surfel_map {
        let to_middle = nalgebra::Translation3::from(-surfel_map.middle);
        let context = library.percept_context(indexed);
        return surfel_map.contact_log(&(to_middle * rival.map_from_episode), touch, context);
    }
    let point = rival.map_from_episode * touch.position_m;
    let mut best = -GAIN_NATS_MAX;
    indexed.packed.near(&point, touch.variance_m2(), |number| {
        let place = &indexed.places[number as usize];
        let variance = place.variance_m2 + touch.variance_m2();
        let log = place.percept_log(touch, library.level_prior())
            - 0.5 * (place.position - point).norm_squared() / variance;
        best = f64::max(best, log);
    });
    best
}
