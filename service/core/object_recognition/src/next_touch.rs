//! The next touch: the one with the largest expected information between hypotheses.

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use crate::contact::Contact;
use crate::indexed_model::IndexedModel;
use crate::library::{ObjectId, ObjectLibrary};
use crate::surfels::map::PerceptContext;
use crate::tuning::{GAIN_NATS_MAX, POSE_WORTH, RIVAL_WEIGHT_MIN, RIVALS_MAX, SITES_MAX};

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
    pub(crate) object: ObjectId,
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
    mut rivals: Vec<WeightedPose>,
    contacts: &[Contact],
) -> Option<NextTouch> {
    let like = contacts.last()?;
    rivals.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    // One pose of every object, then further poses.
    let mut chosen: Vec<WeightedPose> = Vec::with_capacity(RIVALS_MAX);
    for first in [true, false] {
        for rival in rivals
            .iter()
            .filter(|rival| rival.weight > RIVAL_WEIGHT_MIN)
        {
            let met = chosen.iter().any(|other| other.object == rival.object);
            let same = |other: &WeightedPose| other.map_from_episode == rival.map_from_episode;
            if chosen.len() < RIVALS_MAX && met != first && !chosen.iter().any(same) {
                chosen.push(*rival);
            }
        }
    }
    if chosen.len() < 2 {
        return None;
    }
    let mut best: Option<NextTouch> = None;
    for own in &chosen {
        let Some(indexed) = library.indexed(own.object) else {
            continue;
        };
        let back = own.map_from_episode.inverse();
        for site in touch_sites(indexed) {
            let mut touch = like.clone();
            touch.position_m = back * site.position;
            touch.normal = site.normal.map(|normal| back * normal);
            touch.levels.clear();
            touch.descriptors.clear();
            for level in &indexed.places[site.place].levels {
                let sd = level.variance().sqrt();
                touch = touch.with_level(level.channel, level.mean, sd);
            }
            let here = log(library, indexed, own, &touch);
            let told = chosen.iter().map(|other| {
                let worth = if other.object == own.object {
                    POSE_WORTH
                } else {
                    1.0
                };
                let there = library
                    .indexed(other.object)
                    .map_or(here, |indexed| log(library, indexed, other, &touch));
                other.weight * worth * (here - there).clamp(0.0, GAIN_NATS_MAX)
            });
            let before = indexed.surfel_map.as_ref().map_or(0.0, |surfel_map| {
                let alike = contacts
                    .iter()
                    .map(|before| surfel_map.error_correlation(&touch, before));
                alike.sum()
            });
            let gain_nats = own.weight * told.sum::<f64>() / (1.0 + before);
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

/// A point where a model could be touched.
struct TouchSite {
    position: Point3<f64>,
    normal: Option<Unit<Vector3<f64>>>,
    place: usize,
}

/// An even sample of a model's places, on its smoothed surface: of the raw places those with the
/// largest errors would seem to tell most.
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
        let context = PerceptContext {
            places: &indexed.places,
            level_prior: library.level_prior(),
            clutter_per_m3: library.clutter_per_m3(),
        };
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
