//! Woken up elsewhere: a robot without a start pose in a room that a team-mate has explored.
//!
//! An explorer walks through the obstacle-rich room of the seed paper (or through several rooms
//! that look alike), told where it begins; it keeps to its place by obstacles that it sights, and
//! sees the room ([`Scenery`](cogmap_worlds::Scenery)). Then robots wake up one by one anywhere in
//! it, know neither where they are nor how they are turned, walk on by odometry of their own, and
//! see the room as the explorer did: with noise, and now and then something that is not there at
//! all. Or they feel levels of smooth fields instead, as a touch, light, magnetic or radio sensor
//! does. Each is a trial: is it found, after what way, how far off, and was any place announced
//! that was wrong? Others are carried off when they know where they are ([`run_carried`]): when do
//! they notice, and when are they back?

mod building;
mod carried;
mod protocol;
mod report;
mod run;

pub use building::Building;
pub use carried::{CarriedProtocol, CarriedReport, CarriedTrial, run_carried};
pub use protocol::{FeltFields, InvalidWaking, WakingProtocol};
pub use report::{Spread, WakingReport, WakingTrial};
pub use run::{run_waking, time_waking};

#[cfg(test)]
mod tests;
