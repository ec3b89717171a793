//! How far contacts tell the same: those in one gap of a model share its errors.

use nalgebra::{Isometry3, Point3};

use crate::contact::Contact;
use crate::indexed_model::IndexedModel;

/// Evidence of contacts in a pose, per that of independent ones.
///
/// What is predicted between places errs by the same wherever contacts lie in one gap. With ρ the
/// correlation of these errors and m their share of a contact's variance, the variance of a sum
/// over n contacts is t = 1 + m (Σρ/n − 1) times that of independent ones, of which 1/t is the
/// share. `reach` is how far these errors are common, in typical links.
pub(super) fn evidence_share(
    indexed: &IndexedModel,
    map_from_episode: &Isometry3<f64>,
    contacts: &[Contact],
    reach: f64,
) -> f64 {
    let points: Vec<Point3<f64>> = { contacts.iter() }
        .map(|contact| map_from_episode * contact.position_m)
        .collect();
    let shares = points.iter().zip(contacts);
    let shares = shares.map(|(point, contact)| error_share(indexed, point, contact));
    let count = points.len().max(1) as f64;
    let share = shares.sum::<f64>() / count;
    let correlations = points.iter().enumerate().map(|(number, point)| {
        let before = points[..number].iter();
        let square = |other: &Point3<f64>| (other - point).norm_squared();
        let correlation = |other: &Point3<f64>| indexed.error_correlation(square(other), reach);
        1.0 + 2.0 * before.map(correlation).sum::<f64>()
    });
    let common = correlations.sum::<f64>() / count;
    1.0 / (1.0 + share * (common - 1.0).max(0.0))
}

/// The share of a contact's variance that is the error of what is predicted there: of its position
/// or of a level, whichever is larger.
fn error_share(indexed: &IndexedModel, point: &Point3<f64>, contact: &Contact) -> f64 {
    // Where nothing is near the model errs as a whole.
    let mut nearest = (f64::INFINITY, 1.0);
    indexed.packed.near(point, contact.variance_m2(), |number| {
        let place = &indexed.places[number as usize];
        let square = (place.position - point).norm_squared();
        if square >= nearest.0 {
            return;
        }
        let mut share = 0.0;
        if let Some(prediction) = &place.prediction {
            let noise = contact.position_sd_m * contact.position_sd_m;
            let error_m2 = prediction.across_m2();
            share = error_m2 / (error_m2 + noise).max(f64::MIN_POSITIVE);
            for reading in &contact.levels {
                let own = place.level(reading.channel);
                if let Some(own) = own {
                    let all = own.variance() + reading.sd * reading.sd;
                    share = f64::max(share, own.variance() / all.max(f64::MIN_POSITIVE));
                }
            }
        }
        nearest = (square, share);
    });
    nearest.1
}
