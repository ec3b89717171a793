//! What an evaluation found.

use std::collections::BTreeMap;

use serde::Serialize;

/// What an evaluation found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Objects.
    pub objects: usize,
    /// Trials with learned objects.
    pub trials: usize,
    /// Trials with objects left out.
    pub left_out_trials: usize,
    /// Mean number of places of a model.
    pub places_mean: f64,
    /// Share of trials whose most probable object was the right one, after so many contacts.
    pub top1_after: BTreeMap<usize, f64>,
    /// Share of trials whose most probable answer was `unknown`, though the object was learned.
    pub false_unknown_after: BTreeMap<usize, f64>,
    /// Error of the rotation, modulo the object's own symmetries, where the object was named right.
    pub rotation_deg: BTreeMap<usize, Rotation>,
    /// Share of trials with an object that was left out whose fit lies below the threshold that 2 %
    /// of the trials with learned objects lie below.
    pub unknown_caught: BTreeMap<usize, f64>,
    /// The same with the recogniser's own threshold: share of trials whose most probable answer was
    /// `unknown`.
    pub unknown_answered: BTreeMap<usize, f64>,
    /// Stopping by itself.
    pub stop: Stop,
    /// Median time of one contact with its answer \[ms\].
    pub decision_ms_p50: f64,
    /// 99th percentile of it \[ms\].
    pub decision_ms_p99: f64,
    /// How many hypotheses are live, mean after so many contacts.
    pub live_hypotheses: BTreeMap<usize, f64>,
    /// After the last contact, by object.
    pub by_object: BTreeMap<String, OneObject>,
    /// Which object was taken for which after the last contact, and how often.
    pub confusions: BTreeMap<String, usize>,
}

/// What was found of one object after the last contact.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct OneObject {
    /// Share named right.
    pub top1: f64,
    /// Median error of the rotation where it was \[deg\].
    pub rotation_deg_p50: f64,
    /// Mean fit.
    pub fit_mean: f64,
}

/// Error of a rotation \[deg\].
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Rotation {
    /// Median.
    pub p50: f64,
    /// Nine of ten are below.
    pub p90: f64,
}

/// Stopping by itself, with learned objects.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Stop {
    /// Share of trials that were answered with the right object.
    pub accuracy: f64,
    /// Mean number of contacts until then, or until the trial's end.
    pub contacts_mean: f64,
    /// Share that never came to an answer.
    pub undecided: f64,
}

/// The value below which this share of the values lies; NaN of none.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an index"
    )]
    let at = (share * values.len() as f64) as usize;
    values
        .get(at.min(values.len().saturating_sub(1)))
        .copied()
        .unwrap_or(f64::NAN)
}
