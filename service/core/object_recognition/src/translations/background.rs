//! Background model: contacts with an unknown object, predicted from the surfaces of the library.

use std::collections::BTreeMap;
use std::f64::consts::{LN_2, TAU};

use nalgebra::UnitQuaternion;

use crate::contact::Contact;
use crate::library::{ObjectId, ObjectLibrary};
use crate::numeric::log_sum;
use crate::percept_likelihood::ContactPercepts;
use crate::translations::candidates::CandidateSearch;
use crate::tuning::{BACKGROUND_WEIGHT_MIN, OUTLIER_SHARE};

/// Log-likelihood of the contacts under an unknown object.
///
/// Its percepts are either like those of the library or carry no information, each with probability
/// ½. It depends on the object for which the unknown one would be taken: that one's places do not
/// count. When another object comes to be the best, its log-likelihood would rise by all that the
/// best one had earned so far. So it rises by one contact after the other only, each by the object
/// that was the best before; it falls at once.
#[derive(Clone, Debug, Default)]
pub(crate) struct BackgroundModel {
    /// Sums over all contacts so far, by the object for which it would be taken.
    sums: BTreeMap<ObjectId, [f64; 2]>,
    /// The object for which it would be taken after the contacts so far.
    best: Option<ObjectId>,
    /// Of all contacts so far.
    pub(crate) log: f64,
}

/// Log densities of a contact with an unknown object.
#[derive(Clone, Debug, Default)]
pub(crate) struct UnknownContact {
    /// By the object for which it would be taken, with percepts and without.
    pub(crate) of_objects: BTreeMap<ObjectId, [f64; 2]>,
    /// After the contacts before: what the contact adds to the unknown object's log-likelihood.
    pub(crate) log: f64,
}

impl BackgroundModel {
    /// Adds a contact: see [`background_logs`].
    pub(crate) fn touch(
        &mut self,
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        pair: (&Contact, &Contact),
        drift_m2: f64,
    ) -> UnknownContact {
        let of_objects = background_logs(library, rotations, pair, drift_m2);
        let before = self.log_of_best();
        for (object, logs) in &of_objects {
            for (sum, log) in self.sums.entry(*object).or_default().iter_mut().zip(logs) {
                *sum += log;
            }
        }
        let log = { self.log_of_best().zip(before) }.map_or(0.0, |(now, before)| now - before);
        self.log += log;
        UnknownContact { of_objects, log }
    }

    /// After a contact: the object for which the unknown one would be taken now.
    pub(crate) fn settle(&mut self, best: Option<ObjectId>) {
        self.best = best;
        if let Some(log) = self.log_of_best() {
            self.log = self.log.min(log);
        }
    }

    /// Of all contacts so far, taken for the best object.
    fn log_of_best(&self) -> Option<f64> {
        let best = self.best?;
        let logs = self.sums.get(&best).copied().unwrap_or_default();
        Some(log_sum(logs.iter().copied()) - LN_2)
    }
}

/// Log density of a contact with an unknown object, by the object for which it would be taken.
///
/// It is the mean over places of the library, each taken for the one touched by `other` and
/// weighted by the likelihood of the percepts there. Places of the object for which it would be
/// taken do not count: percepts that occur nowhere else would otherwise be as likely of an unknown
/// object. `drift_m2` is the variance of the drift of path integration since the contact before.
///
/// Evidence for a model thus begins where it explains more than a typical surface does. A uniform
/// density would be no rival: a step along any surface ends on most others, and neighbouring places
/// are similar on most.
///
/// The second number is the same without percepts.
fn background_logs(
    library: &ObjectLibrary,
    rotations: &[UnitQuaternion<f64>],
    (other, contact): (&Contact, &Contact),
    drift_m2: f64,
) -> BTreeMap<ObjectId, [f64; 2]> {
    let bare = [other, contact].map(Contact::bare);
    let step = contact.position_m - other.position_m;
    let noise = contact.position_sd_m * contact.position_sd_m + drift_m2;
    let before =
        [other, &bare[0]].map(|contact| ContactPercepts::new(contact, library.level_prior()));
    let now =
        [contact, &bare[1]].map(|contact| ContactPercepts::new(contact, library.level_prior()));
    // An object without a sample is one of which no place is to be left out.
    let objects = library.indexed_models().map(|(object, _)| object);
    let mut sums: BTreeMap<ObjectId, [Sums; 2]> =
        objects.map(|object| (object, Default::default())).collect();
    let mut nearby = CandidateSearch::default();
    let mut turns = rotations.iter().cycle();
    for sample in library.samples() {
        let (Some(indexed), Some(rotation)) = (library.indexed(sample.object), turns.next()) else {
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
        let densities = nearby.densities(&indexed.packed, &point, noise, [&whole, &bare]);
        let sums = sums.entry(sample.object).or_default();
        for ((sums, weight), density) in sums.iter_mut().zip(weights).zip(densities) {
            let density = density / TAU.powf(1.5);
            let density = density / indexed.places.len() as f64;
            sums.add([weight * density, weight, density, 1.0]);
        }
    }
    let mut all = [Sums::default(); 2];
    for own in sums.values() {
        for (all, own) in all.iter_mut().zip(own) {
            all.add(own.0);
        }
    }
    let clutter_per_m3 = OUTLIER_SHARE * library.clutter_per_m3();
    { sums.into_iter() }
        .map(|(object, own)| {
            let logs = std::array::from_fn(|k| {
                let density =
                    (1.0 - OUTLIER_SHARE) * all[k].typical_without(&own[k]) + clutter_per_m3;
                density.ln()
            });
            (object, logs)
        })
        .collect()
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
        // Without places of another object only the geometry counts.
        let typical = if weight > BACKGROUND_WEIGHT_MIN * weights {
            others / weight
        } else {
            plain / count
        };
        typical.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, UnitQuaternion};

    use super::BackgroundModel;
    use crate::{
        Contact, ModelSettings, ObjectId, ObjectLibrary, ObjectModel, Orientation, Recognition,
        Verdict,
    };

    /// A contact with the `k`-th place of a rod.
    fn contact(k: u16, level: f64) -> Contact {
        let at = Point3::new(0.02 * f64::from(k), 0.0, 0.0);
        Contact::at(at, 0.001).with_level(0, level, 0.2)
    }

    /// Rods of one shape: three with similar levels, and one with others.
    fn rods() -> ObjectLibrary {
        let mut library = ObjectLibrary::default();
        for (id, factor, offset) in [(0, 1, 0.0), (1, 5, 0.0), (2, 7, 0.0), (3, 5, 20.0)] {
            // The last one is known in finer places than the others.
            let spacing_m = if id == 3 { 0.004 } else { 0.01 };
            let settings = ModelSettings {
                spacing_m,
                ..ModelSettings::default()
            };
            let mut model = ObjectModel::new(settings);
            for k in 0..12 {
                model.learn(&contact(k, f64::from(k * factor % 13) + offset));
            }
            library.put(ObjectId(id), model);
        }
        library
    }

    #[test]
    fn an_unknown_object_rises_by_no_more_than_one_contact_says() {
        let library = rods();
        let mut background = BackgroundModel::default();
        let none = [UnitQuaternion::identity()];
        let mut falls = 0;
        for k in 0..11 {
            // What it would be taken for changes at each contact.
            background.settle(Some(ObjectId(u32::from(k % 4))));
            let levels = [k, k + 1].map(|k| f64::from(k * 5 % 13));
            let [before, now] = [contact(k, levels[0]), contact(k + 1, levels[1])];
            let log = background.log;
            let said = background.touch(&library, &none, (&before, &now), 0.0);
            let most = said.of_objects.values().flatten().copied();
            let most = most.fold(f64::NEG_INFINITY, f64::max);
            assert!(background.log - log <= most + 1e-9, "{k}: {said:?}");
            let log = background.log;
            background.settle(Some(ObjectId(u32::from((k + 1) % 4))));
            assert!(background.log <= log, "{k}");
            falls += u32::from(background.log < log);
        }
        assert!(falls > 0, "no other object explains it better");
    }

    #[test]
    fn a_known_shape_with_unknown_levels_is_unknown() {
        let library = rods();
        for offset in [-40.0, 20.0, 40.0, 1000.0] {
            let mut recognition = Recognition::new(&Orientation::Known);
            for k in 0..12 {
                let level = f64::from(k * 7 % 13) + offset;
                recognition.touch(&library, contact(k, level));
                let verdict = recognition.posterior(&library).verdict();
                assert!(
                    !matches!(verdict, Verdict::Object(_)),
                    "{offset}: {verdict:?} after {}",
                    k + 1
                );
            }
            let posterior = recognition.posterior(&library);
            assert!(posterior.unknown > 0.95, "{offset}: {}", posterior.unknown);
        }
    }
}
