//! What would be felt of something that was never learned, by what the surfaces are like that were.

use std::collections::BTreeMap;
use std::f64::consts::{LN_2, TAU};

use nalgebra::UnitQuaternion;

use super::contact::Contact;
use super::feeling::Feeling;
use super::library::{ObjectId, ObjectLibrary};
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
        (other, contact): (&Contact, &Contact),
        drift_m2: f64,
    ) {
        let like_others = stranger_logs(library, rotations, (other, contact), drift_m2);
        let bare = [other, contact].map(Contact::bare);
        let like_nothing = stranger_logs(library, rotations, (&bare[0], &bare[1]), drift_m2);
        for (object, log) in like_others {
            let [first, second] = self.0.entry(object).or_default();
            *first += log;
            *second += like_nothing.get(&object).copied().unwrap_or(log);
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
fn stranger_logs(
    library: &ObjectLibrary,
    rotations: &[UnitQuaternion<f64>],
    (other, contact): (&Contact, &Contact),
    drift_m2: f64,
) -> BTreeMap<ObjectId, f64> {
    let step = contact.position_m - other.position_m;
    let noise = contact.position_sd_m * contact.position_sd_m + drift_m2;
    let felt_before = Feeling::new(other, library.wide());
    let felt = Feeling::new(contact, library.wide());
    let mut sums: BTreeMap<ObjectId, [f64; 4]> = BTreeMap::new();
    let mut answers = Vec::new();
    let mut turns = rotations.iter().cycle();
    for &(object, spot) in library.samples() {
        let (Some(surface), Some(rotation)) = (library.surface(object), turns.next()) else {
            continue;
        };
        let here = felt_before.at(surface, rotation);
        let weight = f64::from(here.likelihood(spot as usize, &surface.spots.all[spot as usize]));
        let here = surface.patches[surface.spots.patch(spot as usize)].position;
        let local = felt.at(surface, rotation);
        let point = here + rotation * step;
        let spots = &surface.spots;
        let density = spots.answers(&point, (0.0, noise), &local, &mut answers);
        let density = density / TAU.powf(1.5);
        let density = density / surface.patches.len() as f64;
        let [sum, weights, plain, count] = sums.entry(object).or_default();
        *sum += weight * density;
        *weights += weight;
        *plain += density;
        *count += 1.0;
    }
    let all = { sums.values() }.fold([0.0; 4], |all, own| {
        std::array::from_fn(|k| all[k] + own[k])
    });
    // Of places of no other object, how a surface goes on is all that is known.
    let [_, _, plain, count] = all;
    let elsewhere = OUTLIERS * library.elsewhere();
    { sums.into_iter() }
        .map(|(object, [sum, weights, ..])| {
            let (sum, weights) = (all[0] - sum, all[1] - weights);
            let typical = if weights > WEIGHT_MIN * all[1] {
                sum / weights
            } else {
                plain / count
            };
            let density = (1.0 - OUTLIERS) * typical.max(0.0) + elsewhere;
            (object, density.ln())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use crate::recognition::{
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
