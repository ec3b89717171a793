//! What came of it.

use nalgebra::Isometry3;
use serde::Serialize;

use super::protocol::WakingProtocol;

/// A robot that was put farther from where it is than this was put somewhere wrong \[m\].
pub(super) const FALSE_M: f64 = 0.5;
/// One that is nearer at the end was found \[m\].
pub(super) const FOUND_M: f64 = 0.2;
/// The same of one that feels, but does not see.
const FOUND_BY_LEVELS_M: f64 = 0.3;

/// One robot that woke up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct WakingTrial {
    /// Way after which it was put into the map \[m\]; none if it was not.
    pub travel_m: Option<f64>,
    /// How far off it was then \[m\].
    pub first_error_m: Option<f64>,
    /// How far off it is at the end \[m\].
    pub error_m: Option<f64>,
    /// How far it is turned at the end \[rad\].
    pub turn_rad: Option<f64>,
    /// Whether it was ever put somewhere wrong.
    pub is_false: bool,
    /// Whether it was put into the map before its room could be told from the others.
    pub is_early: bool,
}

/// What came of all of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WakingReport {
    /// What was done.
    pub protocol: WakingProtocol,
    /// How far off a robot may be at the end that counts as found \[m\].
    pub found_m: f64,
    /// Share of the robots that are in the map no farther off at the end.
    pub relocalised: f64,
    /// Robots that were ever put more than 0.5 m from where they were.
    pub false_claims: u32,
    /// Robots that were put into the map before their room could be told from the others that look
    /// alike.
    pub early_claims: u32,
    /// Robots that were not put into the map.
    pub uncertain: u32,
    /// Way after which a robot is put into the map \[m\].
    pub travel_m: Spread,
    /// How far off it is at the end \[m\].
    pub error_m: Spread,
    /// How far it is turned at the end \[rad\].
    pub turn_rad: Spread,
}

/// Median, ninth tenth and largest of values; none where there are none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Median.
    pub p50: Option<f64>,
    /// What nine of ten are below.
    pub p90: Option<f64>,
    /// Largest.
    pub max: Option<f64>,
}

impl WakingTrial {
    /// The robot is in the map, off by so much.
    pub(super) fn note(&mut self, travelled_m: f64, off: &Isometry3<f64>, is_told: bool) {
        let error_m = off.translation.vector.norm();
        if self.travel_m.is_none() {
            self.travel_m = Some(travelled_m);
            self.first_error_m = Some(error_m);
            self.is_early = !is_told;
        }
        self.error_m = Some(error_m);
        self.turn_rad = Some(off.rotation.angle());
        self.is_false |= error_m > FALSE_M;
    }
}

impl WakingReport {
    pub(super) fn of(protocol: &WakingProtocol, trials: &[WakingTrial]) -> Self {
        let count = |is: &dyn Fn(&WakingTrial) -> bool| {
            let found = trials.iter().filter(|trial| is(trial)).count();
            u32::try_from(found).unwrap_or(u32::MAX)
        };
        let found_m = match protocol.felt {
            Some(_) => FOUND_BY_LEVELS_M,
            None => FOUND_M,
        };
        let found = count(&|trial| trial.error_m.is_some_and(|error_m| error_m <= found_m));
        let spread =
            |of: &dyn Fn(&WakingTrial) -> Option<f64>| Spread::of(trials.iter().filter_map(of));
        Self {
            protocol: *protocol,
            found_m,
            relocalised: f64::from(found) / trials.len().max(1) as f64,
            false_claims: count(&|trial| trial.is_false),
            early_claims: count(&|trial| trial.is_early),
            uncertain: count(&|trial| trial.travel_m.is_none()),
            travel_m: spread(&|trial| trial.travel_m),
            error_m: spread(&|trial| trial.error_m),
            turn_rad: spread(&|trial| trial.turn_rad),
        }
    }
}

impl Spread {
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        let at = |percent: usize| {
            let last = values.len().checked_sub(1)?;
            values.get(last * percent / 100).copied()
        };
        Self {
            p50: at(50),
            p90: at(90),
            max: at(100),
        }
    }
}
