//! Which touch would tell most between hypotheses.

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::contact::Contact;
use super::library::{ObjectId, ObjectLibrary};
use super::relief::Scene;
use super::surface::Surface;

/// Hypotheses told apart at a time: the heaviest.
pub(super) const RIVALS_MAX: usize = 6;
/// Touches considered on each of them.
const TOUCHES_MAX: usize = 32;
/// A touch tells two hypotheses apart by this much at most: it may be an outlier \[nats\].
const TOLD_MAX: f64 = 8.0;
/// What telling two poses of one map apart is worth, against telling two maps.
const POSE_WORTH: f64 = 0.2;
/// Lightest hypothesis worth asking about.
const WEIGHT_MIN: f64 = 1e-4;

/// A touch that would tell much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextTouch {
    /// Where to touch \[m\], in the episode's frame.
    pub point_m: Point3<f64>,
    /// From which side: the way to move on the approach, in the episode's frame.
    pub approach: Option<Unit<Vector3<f64>>>,
    /// Information expected from it \[nats\], at most.
    pub gain_nats: f64,
}

/// A hypothesis with its share of the mass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rival {
    pub(super) object: ObjectId,
    pub(super) map_from_episode: Isometry3<f64>,
    pub(super) weight: f64,
}

/// The best touch on the surface of one rival to tell it from the others, after these contacts; the last
/// is one as they come, for its noise.
pub(super) fn next_touch(
    library: &ObjectLibrary,
    mut rivals: Vec<Rival>,
    contacts: &[Contact],
) -> Option<NextTouch> {
    let like = contacts.last()?;
    rivals.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    // One pose of every map that is in question, then further poses.
    let mut chosen: Vec<Rival> = Vec::with_capacity(RIVALS_MAX);
    for first in [true, false] {
        for rival in rivals.iter().filter(|rival| rival.weight > WEIGHT_MIN) {
            let met = chosen.iter().any(|other| other.object == rival.object);
            let same = |other: &Rival| other.map_from_episode == rival.map_from_episode;
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
        let Some(surface) = library.surface(own.object) else {
            continue;
        };
        let back = own.map_from_episode.inverse();
        for spot in spots(surface) {
            let mut touch = like.clone();
            touch.position_m = back * spot.position;
            touch.normal = spot.normal.map(|normal| back * normal);
            touch.levels.clear();
            touch.descriptors.clear();
            for level in &surface.patches[spot.place].levels {
                let sd = level.variance().sqrt();
                touch = touch.with_level(level.channel, level.mean, sd);
            }
            let here = log(library, surface, own, &touch);
            let told = chosen.iter().map(|other| {
                let worth = if other.object == own.object {
                    POSE_WORTH
                } else {
                    1.0
                };
                let there = library
                    .surface(other.object)
                    .map_or(here, |surface| log(library, surface, other, &touch));
                other.weight * worth * (here - there).clamp(0.0, TOLD_MAX)
            });
            // A patch errs alike at every touch: what it tells, it has told by and by.
            let before = surface.relief.as_ref().map_or(0.0, |relief| {
                let alike = contacts.iter().map(|before| relief.alike(&touch, before));
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

/// Where a map could be touched.
struct Spot {
    position: Point3<f64>,
    normal: Option<Unit<Vector3<f64>>>,
    place: usize,
}

/// Some of a map's places, evenly: where its surface is thought to lie, not where it was felt. Of places as they
/// were felt those with the greatest errors would seem to tell most.
fn spots(surface: &Surface) -> Vec<Spot> {
    if let Some(relief) = &surface.relief {
        let step = relief.facets.len().div_ceil(TOUCHES_MAX).max(1);
        let facets = relief.facets.iter().step_by(step);
        let spots = facets.map(|facet| Spot {
            position: facet.position + relief.middle,
            normal: Some(Unit::new_normalize(facet.normal)),
            place: facet.place as usize,
        });
        return spots.collect();
    }
    let step = surface.patches.len().div_ceil(TOUCHES_MAX).max(1);
    let patches = surface.patches.iter().enumerate().step_by(step);
    let spots = patches.map(|(place, patch)| Spot {
        position: patch.position,
        normal: patch.normal,
        place,
    });
    spots.collect()
}

/// Log density of a touch under one hypothesis.
fn log(library: &ObjectLibrary, surface: &Surface, rival: &Rival, touch: &Contact) -> f64 {
    if let Some(relief) = &surface.relief {
        let to_middle = nalgebra::Translation3::from(-relief.middle);
        let scene = Scene {
            patches: &surface.patches,
            wide: library.wide(),
            elsewhere: library.elsewhere(),
        };
        return relief.log(&(to_middle * rival.map_from_episode), touch, scene);
    }
    let point = rival.map_from_episode * touch.position_m;
    let mut best = -TOLD_MAX;
    surface.spots.near(&point, touch.variance_m2(), |number| {
        let patch = &surface.patches[number as usize];
        let variance = patch.variance_m2 + touch.variance_m2();
        let log = patch.percept_log(touch, library.wide())
            - 0.5 * (patch.position - point).norm_squared() / variance;
        best = f64::max(best, log);
    });
    best
}
