//! When the acts come.

use crate::thing::Thing;

/// The acts come again after so long \[s\].
const CYCLE_S: u64 = 60;
/// When the acts come in a cycle \[s\]. A robot that woke up is switched off for the next cycle.
pub(super) const SWITCH_OFF_S: u64 = 4;
pub(super) const WAKE_S: u64 = 18;
pub(super) const CARRY_S: u64 = 36;
pub(super) const LEARN_S: [(u64, u64, Thing); 2] = [(2, 14, Thing::Cup), (15, 27, Thing::Bottle)];
pub(super) const TOUCH_S: (u64, u64) = (30, 44);
/// An act comes only where so much is left for what it leads to \[s\].
pub(super) const WAKE_ROOM_S: u64 = 7;
pub(super) const CARRY_ROOM_S: u64 = 15;
/// Ticks a second, and so steps of 0.1 m: 1 m/s.
pub(super) const RATE_HZ: u64 = 10;

/// What a scenario is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScenarioSettings {
    /// Seed of the room, the rounds and all noise.
    pub seed: u64,
    /// Number of robots. The last but one wakes up and the last one is carried off, where there are
    /// others whose memory helps them.
    pub n_robots: u32,
    /// Stamp of the first tick \[ns\].
    pub epoch_ns: i64,
    /// How long it goes on \[s\]: acts that do not fit do not come.
    pub duration_s: f64,
}

/// A moment of a scenario.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub(super) settings: ScenarioSettings,
    pub(super) n_ticks: u64,
}

impl ScenarioSettings {
    /// Whether the scenario goes on until a time of a cycle \[s\].
    pub(super) fn has_room(&self, cycle: u64, time_s: u64) -> bool {
        (cycle * CYCLE_S + time_s) as f64 <= self.duration_s
    }

    /// Number of the robot that wakes up, if there is one.
    pub(super) fn woken(&self) -> Option<u32> {
        let comes = self.n_robots >= 3 && self.has_room(0, WAKE_S + WAKE_ROOM_S);
        comes.then(|| self.n_robots - 1)
    }
}

impl Moment {
    /// Whether a time of the cycle \[s\] is now.
    pub(super) fn is_now(&self, time_s: u64) -> bool {
        self.n_ticks % (CYCLE_S * RATE_HZ) == time_s * RATE_HZ
    }

    /// The cycle.
    pub(super) fn cycle(&self) -> u64 {
        self.n_ticks / (CYCLE_S * RATE_HZ)
    }

    /// Whole seconds of the cycle.
    pub(super) fn of_cycle_s(&self) -> u64 {
        self.n_ticks % (CYCLE_S * RATE_HZ) / RATE_HZ
    }

    /// Whether the scenario goes on until a time of this cycle \[s\].
    pub(super) fn has_room(&self, time_s: u64) -> bool {
        self.settings.has_room(self.cycle(), time_s)
    }

    /// Stamp \[ns\].
    pub(super) fn stamp_ns(&self) -> i64 {
        let since_epoch_ns = i64::try_from(self.n_ticks.saturating_mul(1_000_000_000 / RATE_HZ));
        let epoch_ns = self.settings.epoch_ns;
        epoch_ns.saturating_add(since_epoch_ns.unwrap_or(i64::MAX))
    }
}
