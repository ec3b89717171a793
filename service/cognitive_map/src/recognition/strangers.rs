//! What would be felt of something that was never learned, by what the surfaces are like that were.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::UnitQuaternion;

use super::contact::Contact;
use super::feeling::Feeling;
use super::library::{ObjectId, ObjectLibrary};
use super::shifts::OUTLIERS;

/// Least share of the weight that places of other objects must have before they say what is beside them.
const WEIGHT_MIN: f64 = 1e-9;

/// Log-density of a contact with something that was never learned: the mean over places of the library, each taken for
/// the one touched by `other`, weighed by how well it explains what was felt there. By the object that it would be
/// taken for, whose own places do not count: what is felt nowhere else would otherwise be as like something
/// unknown as it is like that one. `drift_m2` is what path integration has drifted since the contact before.
///
/// It is what a hypothesis that knows nothing else would expect, so that evidence for a map begins
/// where the map explains more than a surface of its kind. Space filled evenly would be no rival: a step along
/// any surface ends on most others, and neighbouring places feel alike on most.
pub(super) fn stranger_logs(
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
