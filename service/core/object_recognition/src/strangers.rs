//! What would be felt of something that was never learned, by what the surfaces are like that were.

use std::collections::BTreeMap;
use std::f64::consts::{LN_2, TAU};

use nalgebra::UnitQuaternion;

use super::contact::Contact;
use super::feeling::Feeling;
use super::library::{ObjectId, ObjectLibrary};
use super::nearby::Nearby;
use super::shifts::{OUTLIERS, log_sum};

/// Least share of the weight that places of other objects must have before they say what is beside them.
const WEIGHT_MIN: f64 = 1e-9;

/// Log-likelihood of contacts with something that was never learned, by the object that it would be taken for.
///
/// It either feels like the others do, or like nothing in particular: what was learned does not say what else there is.
#[derive(Clone, Debug, Default)]
pub(super) struct Strangers(BTreeMap<ObjectId, [f64; 2]>);

impl Strangers {
    /// One more contact, as [`stranger_logs`] has it.
    pub(super) fn touch(
        &mut self,
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        pair: (&Contact, &Contact),
        drift_m2: f64,
    ) {
        for (object, logs) in stranger_logs(library, rotations, pair, drift_m2) {
            for (sum, log) in self.0.entry(object).or_default().iter_mut().zip(logs) {
                *sum += log;
            }
        }
    }

    /// Of all contacts so far.
    pub(super) fn log(&self, object: ObjectId) -> Option<f64> {
        let logs = self.0.get(&object)?;
        Some(log_sum(logs.iter().copied()) - LN_2)
    }
}

/// Log-density of a contact with something that was never learned: the mean over places of the library, each taken for
/// the one touched by `other`, weighed by how well it explains what was felt there. By the object that it would be
/// taken for, whose own places do not count: what is felt nowhere else would otherwise be as like something
/// unknown as it is like that one. `drift_m2` is what path integration has drifted since the contact before.
///
/// It is what a hypothesis that knows nothing else would expect, so that evidence for a map begins
/// where the map explains more than a surface of its kind. Space filled evenly would be no rival: a step along
/// any surface ends on most others, and neighbouring places feel alike on most.
///
/// The second of each is the same if nothing had been felt.
fn stranger_logs(
    library: &ObjectLibrary,
    rotations: &[UnitQuaternion<f64>],
    (other, contact): (&Contact, &Contact),
    drift_m2: f64,
) -> BTreeMap<ObjectId, [f64; 2]> {
    let bare = [other, contact].map(Contact::bare);
    let step = contact.position_m - other.position_m;
    let noise = contact.position_sd_m * contact.position_sd_m + drift_m2;
    let before = [other, &bare[0]].map(|contact| Feeling::new(contact, library.wide()));
    let now = [contact, &bare[1]].map(|contact| Feeling::new(contact, library.wide()));
    let mut sums: BTreeMap<ObjectId, [Sums; 2]> = BTreeMap::new();
    let mut nearby = Nearby::default();
    let mut turns = rotations.iter().cycle();
    for sample in library.samples() {
        let (Some(surface), Some(rotation)) = (library.surface(sample.object), turns.next()) else {
            continue;
        };
        let number = sample.spot as usize;
        let spot = &surface.spots.all[number];
        let weights = before.each_ref().map(|feeling| {
            let likelihood = feeling.at(surface, rotation).likelihood(number, spot);
            f64::from(likelihood)
        });
        let [felt, bare] = now.each_ref().map(|feeling| feeling.at(surface, rotation));
        let point = sample.position + rotation * step;
        let densities = nearby.densities(&surface.spots, &point, noise, [&felt, &bare]);
        let sums = sums.entry(sample.object).or_default();
        for ((sums, weight), density) in sums.iter_mut().zip(weights).zip(densities) {
            let density = density / TAU.powf(1.5);
            let density = density / surface.patches.len() as f64;
            sums.add([weight * density, weight, density, 1.0]);
        }
    }
    let mut all = [Sums::default(); 2];
    for own in sums.values() {
        for (all, own) in all.iter_mut().zip(own) {
            all.add(own.0);
        }
    }
    let elsewhere = OUTLIERS * library.elsewhere();
    { sums.into_iter() }
        .map(|(object, own)| {
            let logs = std::array::from_fn(|k| {
                let density = (1.0 - OUTLIERS) * all[k].typical_without(&own[k]) + elsewhere;
                density.ln()
            });
            (object, logs)
        })
        .collect()
}

/// Sums over places: of the weighted densities, of the weights, of the densities, and how many they are.
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
        // Of places of no other object, how a surface goes on is all that is known.
        let typical = if weight > WEIGHT_MIN * weights {
            others / weight
        } else {
            plain / count
        };
        typical.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use crate::{
        Contact, ModelSettings, ObjectId, ObjectLibrary, ObjectModel, Orientation, Recognition,
        Verdict,
    };

    /// A contact with the `k`-th place of a rod.
    fn contact(k: u16, level: f64) -> Contact {
        let at = Point3::new(0.02 * f64::from(k), 0.0, 0.0);
        Contact::at(at, 0.001).with_level(0, level, 0.2)
    }

    /// Rods of one shape: three that feel alike, and one that feels otherwise.
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
    fn a_known_shape_that_feels_like_nothing_known_is_unknown() {
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
