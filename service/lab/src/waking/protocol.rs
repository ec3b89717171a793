//! What is done, down to the last option.

use serde::Serialize;

/// One experiment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WakingProtocol {
    /// Robots that wake up.
    pub trials: u32,
    /// Of these, in one and the same building.
    pub trials_per_building: u32,
    /// Rooms of a building, which look alike up to three fifths of their height.
    pub rooms: u32,
    /// Steps of 0.1 m that the explorer makes in each room.
    pub explorer_steps: u32,
    /// How far a robot goes \[m\].
    pub travel_m: f64,
    /// The room is seen at every step whose number divides by this.
    pub view_every: u32,
    /// Length of a view's noise, as a share of the view's own.
    pub view_noise: f64,
    /// Share of views that show something else.
    pub view_wrong: f64,
    /// What is felt instead of being seen, if that is what robots do.
    pub felt: Option<FeltFields>,
    /// Number from which everything is drawn.
    pub seed: u64,
}

/// Levels of smooth fields, one for each of four channels, felt at every step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FeltFields {
    /// Correlation length of the fields \[m\].
    pub length_m: f64,
    /// Deviation of a level's noise; that of the fields is 1.
    pub noise: f64,
    /// Axes of the room along which they change, 1 to 3.
    pub axes: usize,
}

/// A protocol that cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidWaking {
    /// Nothing to do, or too much.
    #[error(
        "there are from 1 to 100000 trials, some of them in each building, 1 to 8 rooms and 1 to 10^7 steps of the explorer"
    )]
    Count,
    /// A way that is none.
    #[error("a robot goes from 0.1 m to 1000 m and sees the room at every step or more rarely")]
    Travel,
    /// Views that make no sense.
    #[error("noise and wrong views are shares from 0 to 1")]
    View,
    /// Levels that make no sense.
    #[error(
        "levels are felt in one room, in fields of a length from 0.01 to 1000 m along 1 to 3 axes and with noise up to 10"
    )]
    Felt,
}

impl Default for WakingProtocol {
    fn default() -> Self {
        Self {
            trials: 200,
            trials_per_building: 20,
            rooms: 1,
            explorer_steps: 40_000,
            travel_m: 3.0,
            view_every: 1,
            view_noise: 0.1,
            view_wrong: 0.05,
            felt: None,
            seed: 1,
        }
    }
}

impl WakingProtocol {
    /// # Errors
    /// Names the first option that makes no sense.
    pub fn check(&self) -> Result<(), InvalidWaking> {
        let counts = (1..=100_000).contains(&self.trials)
            && self.trials_per_building >= 1
            && (1..=8).contains(&self.rooms)
            && (1..=10_000_000).contains(&self.explorer_steps);
        if !counts {
            return Err(InvalidWaking::Count);
        }
        if !(0.1..=1000.0).contains(&self.travel_m) || self.view_every == 0 {
            return Err(InvalidWaking::Travel);
        }
        let share = |value: f64| (0.0..=1.0).contains(&value);
        if !share(self.view_noise) || !share(self.view_wrong) {
            return Err(InvalidWaking::View);
        }
        let is_felt = |felt: &FeltFields| {
            let length = (0.01..=1000.0).contains(&felt.length_m);
            length
                && (1..=3).contains(&felt.axes)
                && (0.0..=10.0).contains(&felt.noise)
                && self.rooms == 1
        };
        if !self.felt.as_ref().is_none_or(is_felt) {
            return Err(InvalidWaking::Felt);
        }
        Ok(())
    }
}
