//! Goodness of fit of a pose: whether the contacts are as the right pose of the right model has
//! them.

use nalgebra::Isometry3;

use crate::contact::{Contact, Reached};
use crate::surfels::deformation_test::DeformationTest;
use crate::surfels::map::{PerceptContext, SurfelMap};
use crate::tuning::{COVERAGE_SHARE_MIN, NOISE_LOG_VARIANCE};
use crate::z_score;

/// Fisher's combination of three z-scores: of the contacts' densities against those that the model
/// expects, of the deformation test, and of the coverage test over the contacts that were drawn.
pub(crate) fn z_score(
    surfel_map: &SurfelMap,
    context: PerceptContext<'_>,
    pose: &Isometry3<f64>,
    contacts: &[Contact],
) -> f64 {
    let fits: Vec<_> = { contacts.iter() }
        .map(|contact| surfel_map.fit_contact(pose, contact, context))
        .collect();
    let (mean, sd) = surfel_map.expected();
    let sum: f64 = fits.iter().map(|fit| fit.log).sum();
    let count = contacts.len() as f64;
    let inflation = variance_inflation(surfel_map, contacts);
    let densities = (sum - count * mean) / ((count * inflation).sqrt() * sd);
    let mut deformation = DeformationTest::new(surfel_map.extent_m, surfel_map.spacing_m);
    for height in fits.iter().filter_map(|fit| fit.height) {
        deformation.add(&height);
    }
    let drawn = { contacts.iter().zip(&fits) }
        .filter(|(contact, fit)| {
            contact.reached == Reached::Drawn && fit.share > COVERAGE_SHARE_MIN
        })
        .map(|(contact, _)| pose * contact.position_m);
    let coverage = surfel_map.coverage_test.z_score(drawn);
    let correlated = mean_correlated(surfel_map, contacts);
    let deformation = deformation.z_score(surfel_map.surfels.len(), correlated);
    let all = [Some(densities), deformation, coverage];
    z_score::fisher_combined(all.into_iter().flatten())
}

/// Variance of the sum of the contacts' log densities, per that of independent contacts: 1 + m (c −
/// 1), where m is the share of the variance that is the model's and not a contact's own noise, and
/// c the mean number of correlated contacts.
pub(crate) fn variance_inflation(surfel_map: &SurfelMap, contacts: &[Contact]) -> f64 {
    let (_, sd) = surfel_map.expected();
    let model_share = (1.0 - NOISE_LOG_VARIANCE / (sd * sd)).max(0.0);
    1.0 + model_share * (mean_correlated(surfel_map, contacts) - 1.0)
}

/// Mean number of contacts whose model errors are those of a contact, itself among them: Σ ρ / n.
fn mean_correlated(surfel_map: &SurfelMap, contacts: &[Contact]) -> f64 {
    let pairs = contacts.iter().enumerate().map(|(at, one)| {
        let correlations = contacts[..at]
            .iter()
            .map(|other| surfel_map.error_correlation(one, other));
        correlations.sum::<f64>()
    });
    1.0 + 2.0 * pairs.sum::<f64>() / contacts.len().max(1) as f64
}
