//! The arm of the scenario: it learns things by touch, and touches one of them again.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::script::{LEARN_S, Moment, RATE_HZ, TOUCH_S};
use super::{ARM, Act, AgentTick, start_pose};
use crate::hand::{Hand, NOISE};
use crate::reading::{Reading, ReadingBody, ReadingMark};
use crate::thing::Thing;
use trajectory::StampedPose;

/// The hand closes at each tick whose number divides by this.
const GRASP_EVERY: u64 = 4;
/// Places of a thing that is learned lie so far apart \[m\].
const SPACING_M: f64 = 0.006;
/// How far a thing stands from the middle of the table, along each axis \[m\].
const ON_TABLE_M: f64 = 0.2;
/// How far below the hand's first position the table is \[m\].
const BELOW_M: f64 = 0.1;

/// An arm over a table.
#[derive(Clone, Debug)]
pub(super) struct Arm {
    hand: Hand,
    table_m: Vector3<f64>,
    /// What it touches, and how that stands in the room.
    touched: Option<(Thing, Isometry3<f64>)>,
    /// Where things stand.
    random: ChaCha8Rng,
}

impl Arm {
    /// An arm whose hand is at a position \[m\]; `of_hand` and `of_things` are the noise of what it
    /// feels and where things are put.
    pub(super) fn new(
        position_m: Vector3<f64>,
        of_hand: ChaCha8Rng,
        of_things: ChaCha8Rng,
    ) -> Self {
        Self {
            hand: Hand::new(position_m, of_hand),
            table_m: position_m - Vector3::z() * BELOW_M,
            touched: None,
            random: of_things,
        }
    }

    /// What it does and feels.
    pub(super) fn tick(&mut self, moment: &Moment) -> (AgentTick, Option<Act>) {
        let stamp_ns = moment.stamp_ns();
        let mut readings = Vec::new();
        if moment.n_ticks == 0 {
            let body = start_pose(&self.hand.pose());
            readings.push(Reading { stamp_ns, body });
        }
        let mut act = None;
        if let Some((mark, this)) = self.mark(moment) {
            let body = ReadingBody::Object(mark);
            readings.push(Reading { stamp_ns, body });
            act = Some(this);
        }
        let is_turn = moment.n_ticks.is_multiple_of(GRASP_EVERY);
        if let (Some((thing, at)), true) = (self.touched, is_turn) {
            let duration_s = GRASP_EVERY as f64 / RATE_HZ as f64;
            readings.extend(self.hand.grasp(thing, &at, stamp_ns, duration_s));
        }
        let pose = self.hand.pose();
        let tick = AgentTick {
            name: ARM.to_owned(),
            truth: StampedPose { stamp_ns, pose },
            readings,
        };
        (tick, act)
    }

    /// What begins or ends now.
    fn mark(&mut self, moment: &Moment) -> Option<(ReadingMark, Act)> {
        let cycle = moment.cycle();
        let learned = LEARN_S
            .into_iter()
            .filter(|(_, to_s, _)| cycle == 0 && moment.has_room(*to_s));
        for (from_s, to_s, thing) in learned {
            if moment.is_now(from_s) {
                self.put(thing);
                let learn = ReadingMark::Learn {
                    name: thing.name().to_owned(),
                    spacing_m: SPACING_M,
                    noise: NOISE,
                };
                return Some((learn, Act::Learning(thing)));
            }
            if moment.is_now(to_s) {
                self.touched = None;
                return Some((ReadingMark::End, Act::LetGo));
            }
        }
        let (from_s, to_s) = TOUCH_S;
        if !moment.has_room(to_s) {
            return None;
        }
        if moment.is_now(from_s) {
            let index = usize::try_from(cycle).unwrap_or_default() % LEARN_S.len();
            let (_, _, thing) = LEARN_S[index];
            self.put(thing);
            let identify = ReadingMark::Identify { noise: NOISE };
            return Some((identify, Act::Touching(thing)));
        }
        moment.is_now(to_s).then(|| {
            self.touched = None;
            (ReadingMark::End, Act::LetGo)
        })
    }

    /// Puts a thing on the table, upright and turned.
    fn put(&mut self, thing: Thing) {
        let mut aside = || self.random.random_range(-ON_TABLE_M..ON_TABLE_M);
        let aside_m = Vector3::new(aside(), aside(), 0.0);
        let turn_rad = self.random.random_range(0.0..TAU);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn_rad);
        let at = Isometry3::from_parts(Translation3::from(self.table_m + aside_m), turn);
        self.touched = Some((thing, at));
    }
}
