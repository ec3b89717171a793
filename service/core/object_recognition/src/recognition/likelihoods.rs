//! Likelihoods that do not depend on a hypothesis.

use std::f64::consts::{FRAC_1_PI, TAU};

use crate::indexed_model::IndexedModel;
use crate::library::ObjectLibrary;
use crate::tuning::UNKNOWN_MISFIT_SD;

/// Log density of a walk's contacts, per that of contacts drawn from the whole model: each lies on
/// the share of the model within reach of the contact before.
pub(super) fn walk_log(indexed: &IndexedModel, steps: usize, reach_m: Option<f64>) -> f64 {
    let share = reach_m.map_or(0.0, |reach_m| indexed.share(reach_m).max(1e-9).ln());
    -(steps as f64) * share
}

/// Log of the share of a model that lies within reach of a walk's step, less its mean over all
/// models.
pub(super) fn step_share_logs(
    library: &ObjectLibrary,
    reach_m: Option<f64>,
) -> impl Fn(&IndexedModel) -> f64 {
    let log = move |indexed: &IndexedModel| -walk_log(indexed, 1, reach_m);
    let logs = library.likelier_models().map(|(_, indexed)| log(indexed));
    let mean = logs.sum::<f64>() / library.len().max(1) as f64;
    move |indexed| log(indexed) - mean
}

/// Log likelihood ratio of a goodness of fit: an unknown object against a learned one.
///
/// The fit of a learned object is a standard normal number g. That of an unknown one is g − x,
/// where x is Maxwell distributed, a length in three dimensions (depth and two angles) of scale S =
/// `UNKNOWN_MISFIT_SD` √contacts. With t = −fit S/√(1 + S²) the ratio of both densities is √(2/π)
/// ((t² + 1) √(2π) Φ(t) exp(t²/2) + t) (1 + S²)^(−3/2).
pub(super) fn unknown_fit_log(fit: f64, contacts: usize) -> f64 {
    let scale2 = 1.0 + UNKNOWN_MISFIT_SD * UNKNOWN_MISFIT_SD * contacts as f64;
    // A fit better than expected counts as the expected one.
    let t = -fit.min(0.0) * (1.0 - 1.0 / scale2).sqrt();
    // Φ(t) by Zelen and Severo's approximation (Abramowitz and Stegun 26.2.17), good to 1e-7.
    let k = 1.0 / (1.0 + 0.231_641_9 * t);
    let tail = k
        * (0.319_381_53
            + k * (-0.356_563_782
                + k * (1.781_477_937 + k * (-1.821_255_978 + k * 1.330_274_429))));
    let half = 0.5 * t * t;
    let fall = (-half).exp();
    // The factor exp(t²/2) stays a logarithm: it overflows where the fit is bad.
    let rest = (t * t + 1.0) * (TAU.sqrt() - tail * fall) + t * fall;
    half + ((2.0 * FRAC_1_PI).sqrt() * rest).ln() - 1.5 * scale2.ln()
}
