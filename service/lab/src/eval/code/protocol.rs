//! What is measured of a code.

use cognitive_map::{Settings, SettingsValues};

use crate::eval::protocol::InvalidProtocol;

/// Most places: what a gigabyte holds.
const PLACES_MAX: u64 = 5_000_000;

/// A code, and what it is put to.
#[derive(Clone, Debug, PartialEq)]
pub struct CodeProtocol {
    /// Settings of the map, the code's modules among them.
    pub settings: SettingsValues,
    /// Number of places.
    pub places: u64,
    /// Cues of each condition; rounded up so that all choices of erased modules get equally many.
    pub queries: u32,
    /// Standard deviation of noise on each phase component of a noisy code \[turns\].
    pub phase_noise_turns: f64,
    /// Standard deviation, along each axis, of a jittered code's position from the place \[m\].
    pub jitter_m: f64,
    /// Seed of places and cues.
    pub seed: u64,
}

impl Default for CodeProtocol {
    /// A space's default code, 100,000 places, 5 % of phase noise, a jitter of 5 cm.
    fn default() -> Self {
        Self {
            settings: SettingsValues::default(),
            places: 100_000,
            queries: 3000,
            phase_noise_turns: 0.05,
            jitter_m: 0.05,
            seed: 1,
        }
    }
}

impl CodeProtocol {
    /// # Errors
    /// Names the first option that makes no sense.
    pub fn check(&self) -> Result<(), InvalidProtocol> {
        if !(1..=PLACES_MAX).contains(&self.places) {
            return Err(InvalidProtocol::Places);
        }
        if self.queries == 0 {
            return Err(InvalidProtocol::Queries);
        }
        let noise = self.phase_noise_turns > 0.0 && self.phase_noise_turns <= 1.0;
        if !noise || !(0.0..=1e3).contains(&self.jitter_m) {
            return Err(InvalidProtocol::Damage);
        }
        self.map_settings()?;
        Ok(())
    }

    /// The settings of the map, which forgets nothing.
    pub(super) fn map_settings(&self) -> Result<Settings, InvalidProtocol> {
        Ok(Settings::new(SettingsValues {
            places_max: u32::MAX,
            ..self.settings.clone()
        })?)
    }
}
