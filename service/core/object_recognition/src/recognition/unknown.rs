//! The unknown object: how likely the contacts are of something that was never learned.

use std::f64::consts::{FRAC_PI_6, PI};

use crate::library::ObjectLibrary;
use crate::recognition::episode::Hypotheses;
use crate::recognition::episode::Recognition;
use crate::tuning::MISS_PER_CONTACT;

impl Recognition {
    /// Probability that the right pose in a learned model is not among the hypotheses. The contacts
    /// are then as much like that model as like an unknown object.
    ///
    /// Translations are searched from every place of every model, so none is missed. Poses come
    /// from pairs of contacts, and each further contact finds a missing pose half of the time.
    pub(super) fn miss_probability(&self) -> f64 {
        match self.hypotheses {
            Hypotheses::Translations(_) => 0.0,
            Hypotheses::Poses(_) => MISS_PER_CONTACT.powf(self.count.saturating_sub(2) as f64),
        }
    }

    /// Log-likelihood of the contacts under an unknown object, in the measure of the hypotheses.
    pub(super) fn unknown_log(&self, library: &ObjectLibrary) -> f64 {
        let extent_m = library.extent_m().max(1e-6);
        let aimed = -(self.aimed as f64) * extent_m.ln();
        let steps = self.steps_m.len() as f64;
        match &self.hypotheses {
            Hypotheses::Translations(translations) => {
                let shares = self.reach_m().map_or(0.0, |reach_m| {
                    let logs = library
                        .indexed_models()
                        .map(|(_, s)| s.share(reach_m).max(1e-9).ln());
                    logs.sum::<f64>() / library.len().max(1) as f64
                });
                translations.background.log - steps * shares + aimed
            }
            // Only its size is known: a contact lies anywhere within a step, with any normal.
            Hypotheses::Poses(_) => {
                let ball = |radius_m: f64| (8.0 * FRAC_PI_6 * radius_m.powi(3)).ln();
                let found = self.reach_m().map_or(0.0, |reach_m| {
                    steps * ball(reach_m.min(0.5 * extent_m).max(1e-6))
                });
                let drawn = self.drawn as f64 * ball(0.5 * extent_m);
                -found - drawn - self.count as f64 * (4.0 * PI).ln() + aimed
            }
        }
    }
}
