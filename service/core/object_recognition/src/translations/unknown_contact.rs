//! Densities of one contact with an unknown object.

use std::collections::BTreeMap;
use std::f64::consts::{LN_2, TAU};

use nalgebra::UnitQuaternion;

use crate::contact::{Contact, LevelReading};
use crate::indexed_place::IndexedPlace;
use crate::library::ObjectLibrary;
use crate::numeric::log_sum;
use crate::object_id::ObjectId;
use crate::percept_likelihood::ContactPercepts;
use crate::translations::candidates::CandidateSearch;
use crate::tuning::{APART_MIN, BACKGROUND_WEIGHT_MIN, ERROR_REACH, OUTLIER_SHARE};
use crate::variant::Variant;

/// Logs of one contact, or sums over several, by what an unknown object's percepts are like.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PerceptLogs {
    /// Like those of the library.
    pub(crate) alike: f64,
    /// Without information.
    pub(crate) bare: f64,
    /// Levels change over the surface like those of the library, from whatever they are. None
    /// before there were two to compare.
    pub(crate) changing: Option<f64>,
}

impl PerceptLogs {
    /// With levels that change, if there are any.
    pub(super) fn changing(&self) -> f64 {
        self.changing.unwrap_or(self.bare)
    }

    /// With levels that change, the surface goes on as that of the library or, as probably, as
    /// the contacts before tell, by which the contact's position has this log density.
    pub(super) fn go_on(&mut self, log: f64) {
        let bare = self.bare;
        let also = |changing: f64| log_sum([changing, log + changing - bare].into_iter()) - LN_2;
        self.changing = self.changing.map(also);
    }

    /// Adds those of a further contact.
    pub(super) fn add(&mut self, other: &Self) {
        let compared = self.changing.is_some() || other.changing.is_some();
        let changing = self.changing() + other.changing();
        self.changing = compared.then_some(changing);
        self.alike += other.alike;
        self.bare += other.bare;
    }
}

/// Log density of a contact with an unknown object, by the object for which it would be taken.
///
/// It is the mean over places of the library, each taken for the one touched by `other` and
/// weighted by the likelihood of the percepts there. Places of the object for which it would be
/// taken do not count, unless there are no others: percepts that occur nowhere else would otherwise
/// be as likely of an unknown object. `drift_m2` is the variance of the drift of path integration
/// since the contact before.
///
/// Evidence for a model thus begins where it explains more than a typical surface does. A uniform
/// density would be no rival: a step along any surface ends on most others, and neighbouring places
/// are similar on most.
pub(super) fn unknown_contact(
    library: &ObjectLibrary,
    rotations: &[UnitQuaternion<f64>],
    (other, contact): (&Contact, &Contact),
    drift_m2: f64,
) -> BTreeMap<ObjectId, PerceptLogs> {
    let level_prior = library.level_prior();
    let bare = [other, contact].map(Contact::bare);
    let step = contact.position_m - other.position_m;
    let noise = contact.position_sd_m * contact.position_sd_m + drift_m2;
    let before = [other, &bare[0]].map(|contact| ContactPercepts::new(contact, level_prior));
    let now = [contact, &bare[1]].map(|contact| ContactPercepts::new(contact, level_prior));
    // An object without a sample is one of which no place is to be left out.
    let objects = library.indexed_models().map(|(object, _)| object);
    let mut sums: BTreeMap<ObjectId, [Sums; 3]> =
        objects.map(|object| (object, Default::default())).collect();
    let compares = { contact.levels.iter() }.any(|reading| other.level(reading.channel).is_some());
    let mut nearby = CandidateSearch::default();
    let mut turns = rotations.iter().cycle();
    for sample in library.samples() {
        let (Some(indexed), Some(rotation)) = (library.variant(sample.of), turns.next()) else {
            continue;
        };
        let number = sample.packed_place as usize;
        let packed_place = &indexed.packed.all[number];
        let weights = before.each_ref().map(|percepts| {
            let likelihood = percepts
                .at(indexed, rotation)
                .likelihood(number, packed_place);
            f64::from(likelihood)
        });
        let [whole, bare] = now
            .each_ref()
            .map(|percepts| percepts.at(indexed, rotation));
        let point = sample.position + rotation * step;
        let densities = if compares {
            let place = &indexed.places[indexed.packed.place(number)];
            let are_alike = sample.of.variant == Variant::Body && place.prediction.is_some();
            let changed = changed((other, contact), place, are_alike);
            let mut changed = ContactPercepts::in_measure_of(&changed, contact, level_prior);
            if are_alike {
                let correlation = indexed.error_correlation(step.norm_squared(), ERROR_REACH);
                changed = changed.counting((2.0 * (1.0 - correlation)).max(APART_MIN));
            }
            let locals = [&whole, &bare, &changed.at(indexed, rotation)];
            nearby.densities(&indexed.packed, &point, noise, locals)
        } else {
            let locals = [&whole, &bare];
            let [whole, bare] = nearby.densities(&indexed.packed, &point, noise, locals);
            [whole, bare, bare]
        };
        let sums = sums.entry(sample.of.object).or_default();
        let weights = [weights[0], weights[1], weights[1]];
        for ((sums, weight), density) in sums.iter_mut().zip(weights).zip(densities) {
            let density = density / TAU.powf(1.5);
            let density = density / indexed.places.len() as f64;
            sums.add([weight * density, weight, density, 1.0]);
        }
    }
    let mut all = [Sums::default(); 3];
    for own in sums.values() {
        for (all, own) in all.iter_mut().zip(own) {
            all.add(own.0);
        }
    }
    let clutter_per_m3 = OUTLIER_SHARE * library.clutter_per_m3();
    { sums.into_iter() }
        .map(|(object, own)| {
            let [alike, bare, changing] = std::array::from_fn(|k| {
                let density =
                    (1.0 - OUTLIER_SHARE) * all[k].typical_without(&own[k]) + clutter_per_m3;
                density.ln()
            });
            let logs = PerceptLogs {
                alike,
                bare,
                changing: compares.then_some(changing),
            };
            (object, logs)
        })
        .collect()
}

/// A contact as it would be if the one before had had the levels of a place: with these, changed as
/// from the one before to it, and without what that does not tell.
///
/// Predictions of which neighbouring levels tell little err alike, as far as their errors are
/// correlated: the difference of two has 2 (1 − ρ) times the variance of one, which is that of the
/// place to come. Then `are_alike`, and the place's own is left out.
fn changed((before, now): (&Contact, &Contact), place: &IndexedPlace, are_alike: bool) -> Contact {
    let levels = now.levels.iter().filter_map(|reading| {
        let before = before.level(reading.channel)?;
        let own = place.level(reading.channel)?;
        let known = if are_alike { 0.0 } else { own.variance() };
        let variance = known + before.sd * before.sd + reading.sd * reading.sd;
        Some(LevelReading {
            channel: reading.channel,
            value: own.mean + reading.value - before.value,
            sd: variance.sqrt(),
        })
    });
    Contact {
        levels: levels.collect(),
        ..now.bare()
    }
}

/// Sums over places: weighted densities, weights, densities, and their number.
#[derive(Clone, Copy, Debug, Default)]
struct Sums([f64; 4]);

impl Sums {
    fn add(&mut self, other: [f64; 4]) {
        for (sum, own) in self.0.iter_mut().zip(other) {
            *sum += own;
        }
    }

    /// Mean density over the others than these.
    fn typical_without(&self, own: &Self) -> f64 {
        let [sum, weights, plain, count] = self.0;
        let (others, weight) = (sum - own.0[0], weights - own.0[1]);
        // Without places of another object all count alike.
        let typical = if weight > BACKGROUND_WEIGHT_MIN * weights {
            others / weight
        } else {
            plain / count
        };
        typical.max(0.0)
    }
}
