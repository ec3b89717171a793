//! Robots that know where they are, and are carried off.

use std::num::NonZeroUsize;

use cognitive_map::Status;
use serde::Serialize;

use super::protocol::{InvalidWaking, WakingProtocol};
use super::report::{FALSE_M, FOUND_M, Spread};
use super::run::{Robot, Site, apply, enrol, in_buildings};
use cogmap_worlds::STEP_M;

/// Way after which a robot should be back \[m\].
const BACK_M: f64 = 3.0;

/// One experiment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CarriedProtocol {
    /// How the robots wake up; they go its `travel_m` then.
    pub waking: WakingProtocol,
    /// How far those go on that know where they are, before they are carried off \[m\].
    pub stay_m: f64,
    /// How far they go after that \[m\]; with nothing they are not carried off.
    pub after_m: f64,
}

/// One robot that was to be carried off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CarriedTrial {
    /// Whether it knew where it was before.
    pub is_localized: bool,
    /// Times that it called itself lost before, having known where it is.
    pub alarms: u32,
    /// Of these, those when it was more than 0.5 m off.
    pub alarms_off: u32,
    /// Way that it went before, knowing where it is \[m\].
    pub stayed_m: f64,
    /// Way after which it called itself lost \[m\].
    pub noticed_m: Option<f64>,
    /// Way after which it knew again where it is \[m\].
    pub back_m: Option<f64>,
    /// How far off it was at the end of `BACK_M`, if it knew \[m\].
    pub error_m: Option<f64>,
    /// Whether it was taken to know where it is, and was somewhere else, after it had called itself
    /// lost.
    pub is_false: bool,
    /// Whether it was so beyond `BACK_M`, having called itself lost or not.
    pub is_late: bool,
}

/// What came of all of them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CarriedReport {
    /// What was done.
    pub protocol: CarriedProtocol,
    /// Robots that knew where they were after waking up.
    pub localized: u32,
    /// Way that these went before they were carried off, all together \[m\].
    pub stayed_m: f64,
    /// Times that they called themselves lost on that way.
    pub alarms: u32,
    /// Of these, those when they were more than 0.5 m off.
    pub alarms_off: u32,
    /// Share of them that called themselves lost after they were carried off.
    pub noticed: f64,
    /// Way after which they did \[m\].
    pub noticed_m: Spread,
    /// Way after which they knew again where they are \[m\].
    pub back_m: Spread,
    /// Share of them that knew it, within 0.2 m, when they had gone 3 m.
    pub back: f64,
    /// How far off those that knew were then \[m\].
    pub error_m: Spread,
    /// Robots that called themselves lost, and then localized more than 0.5 m from where they were.
    pub false_claims: u32,
    /// Robots that called themselves localized more than 0.5 m from where they were when they had
    /// gone more than 3 m.
    pub late_claims: u32,
}

/// Follows a protocol, on so many threads. The same protocol gives the same report on any number of
/// them.
///
/// # Errors
/// The protocol makes no sense.
pub fn run_carried(
    protocol: &CarriedProtocol,
    threads: NonZeroUsize,
    done: &(impl Fn() + Sync),
) -> Result<CarriedReport, InvalidWaking> {
    protocol.waking.check()?;
    let is_way = |way_m: f64| (0.0..=1e5).contains(&way_m);
    if !is_way(protocol.stay_m) || !is_way(protocol.after_m) {
        return Err(InvalidWaking::Travel);
    }
    let trials = in_buildings(&protocol.waking, threads, done, &|site, number| {
        site.carry(protocol, number)
    });
    Ok(CarriedReport::of(protocol, &trials))
}

impl Site {
    /// A robot wakes up, finds out where it is, and is carried off.
    fn carry(&self, protocol: &CarriedProtocol, number: u32) -> CarriedTrial {
        let mut robot = self.woken(&protocol.waking, number);
        let mut map = self.map.clone();
        let agent = enrol(&mut map, "carried");
        let mut seq = 0;
        let mut go = |robot: &mut Robot<'_>| {
            for reading in robot.step(&protocol.waking) {
                apply(&mut map, agent, seq, &reading);
                seq += 1;
            }
            let status = map.status(agent).unwrap_or(Status::Lost);
            let pose = map.agent(agent).expect("it was enrolled").pose();
            let off = robot.in_map().translation.vector - pose.translation.vector;
            (status, off.norm())
        };
        let mut trial = CarriedTrial::default();
        for _ in 0..steps(protocol.waking.travel_m) {
            trial.is_localized = go(&mut robot).0 == Status::Localized;
        }
        if !trial.is_localized {
            return trial;
        }
        let mut was_lost = false;
        for _ in 0..steps(protocol.stay_m) {
            let (status, error_m) = go(&mut robot);
            let is_alarm = status == Status::Lost && !was_lost;
            was_lost = status == Status::Lost;
            trial.alarms += u32::from(is_alarm);
            trial.alarms_off += u32::from(is_alarm && error_m > FALSE_M);
        }
        trial.stayed_m = protocol.stay_m;
        let mut random = self.random(9 + 10 * u64::from(number));
        robot.walker = self.somewhere(robot.room, true, &mut random);
        for step in 1..=steps(protocol.after_m) {
            let (status, error_m) = go(&mut robot);
            trial.note(f64::from(step) * STEP_M, status, error_m);
        }
        trial
    }
}

/// Steps of a way.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a way is at most 100 km long"
)]
fn steps(way_m: f64) -> u32 {
    (way_m / STEP_M).round() as u32
}

impl CarriedTrial {
    /// The robot has gone so far since it was carried off.
    fn note(&mut self, way_m: f64, status: Status, error_m: f64) {
        let is_localized = status == Status::Localized;
        if status == Status::Lost && self.noticed_m.is_none() {
            self.noticed_m = Some(way_m);
        }
        let was_lost = self.noticed_m.is_some();
        if is_localized && was_lost && self.back_m.is_none() {
            self.back_m = Some(way_m);
        }
        let is_off = is_localized && error_m > FALSE_M;
        self.is_false |= is_off && was_lost;
        if way_m <= BACK_M + 1e-9 {
            self.error_m = (is_localized && was_lost).then_some(error_m);
        } else {
            self.is_late |= is_off;
        }
    }
}

impl CarriedReport {
    fn of(protocol: &CarriedProtocol, trials: &[CarriedTrial]) -> Self {
        let localized: Vec<&CarriedTrial> =
            trials.iter().filter(|trial| trial.is_localized).collect();
        let count = |is: &dyn Fn(&CarriedTrial) -> bool| {
            let found = localized.iter().filter(|trial| is(trial)).count();
            u32::try_from(found).unwrap_or(u32::MAX)
        };
        let share = |is: &dyn Fn(&CarriedTrial) -> bool| {
            f64::from(count(is)) / localized.len().max(1) as f64
        };
        let spread = |of: &dyn Fn(&CarriedTrial) -> Option<f64>| {
            Spread::of(localized.iter().filter_map(|trial| of(trial)))
        };
        Self {
            protocol: *protocol,
            localized: count(&|_| true),
            stayed_m: localized.iter().map(|trial| trial.stayed_m).sum(),
            alarms: localized.iter().map(|trial| trial.alarms).sum(),
            alarms_off: localized.iter().map(|trial| trial.alarms_off).sum(),
            noticed: share(&|trial| trial.noticed_m.is_some()),
            noticed_m: spread(&|trial| trial.noticed_m),
            back_m: spread(&|trial| trial.back_m),
            back: share(&|trial| trial.error_m.is_some_and(|error_m| error_m <= FOUND_M)),
            error_m: spread(&|trial| trial.error_m),
            false_claims: count(&|trial| trial.is_false),
            late_claims: count(&|trial| trial.is_late),
        }
    }
}
