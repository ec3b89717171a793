//! Revisits: what was seen before corrects the way, and nothing else does.

use cognitive_map::keyframes::{KeyframeMap, KeyframeSettings, Moment};
use cognitive_map::{Descriptor, Label};
use geometry::PoseCovariance;
use nalgebra::{Isometry3, Vector3, Vector6};

use crate::as_read;
use random::Seeded;

/// Steps of a round, their length \[m\], and numbers of a view.
const ROUND: u64 = 80;
const STEP_M: f64 = 0.3;
const NUMBERS: usize = 64;

/// A robot that goes round and round, with a gyroscope that drifts.
struct Round {
    keyframes: KeyframeMap,
    scenery: Vec<(Vector3<f64>, f64)>,
    odom: Isometry3<f64>,
    told: Isometry3<f64>,
    truth: Isometry3<f64>,
    seq: u64,
}

impl Round {
    fn new() -> Self {
        let mut random = Seeded(5);
        let scenery = (0..NUMBERS).map(|_| {
            let wave = Vector3::new(random.normal(), random.normal(), random.normal());
            (wave, random.uniform() * std::f64::consts::TAU)
        });
        let scenery = scenery.collect();
        let mut keyframes = KeyframeMap::new(KeyframeSettings::default());
        let agent = keyframes.graph.enrol();
        keyframes.graph.found(agent);
        Self {
            keyframes,
            scenery,
            odom: Isometry3::identity(),
            told: Isometry3::identity(),
            truth: Isometry3::identity(),
            seq: 0,
        }
    }

    /// Goes on, and sees what there is to see, or something else.
    fn step(&mut self, strange: Option<u64>) {
        let turn = std::f64::consts::TAU / ROUND as f64;
        let move_by = |turn: f64| Isometry3::new(Vector3::x() * STEP_M, Vector3::z() * turn);
        let read = move_by(turn + 0.003);
        self.truth *= move_by(turn);
        self.told *= read;
        self.odom *= read;
        self.seq += 1;
        let moment = |pose: Isometry3<f64>, seq: u64| Moment {
            agent: 0,
            seq,
            stamp_ns: i64::try_from(seq).unwrap() * 100_000_000,
            pose,
        };
        // The drift is about what independent errors may add up to in a round.
        let variance = Vector6::new(1e-4, 1e-4, 0.0, 0.0, 0.0, 5e-4);
        self.keyframes.graph.motion(
            &moment(self.told, self.seq),
            &read,
            &variance,
            &as_read(&read),
        );
        let mut noise = Seeded(strange.unwrap_or(self.seq) << 20);
        let at = self.truth.translation.vector;
        let view: Vec<f32> = self
            .scenery
            .iter()
            .map(|(wave, shift)| {
                let seen = match strange {
                    None => (wave.dot(&at) + shift).cos() + 0.05 * noise.normal(),
                    Some(_) => noise.normal(),
                };
                #[expect(
                    clippy::cast_possible_truncation,
                    reason = "a view needs no more digits"
                )]
                let seen = seen as f32;
                seen
            })
            .collect();
        let far = self.seq as f64;
        let sd = Vector6::new(0.02, 0.02, 0.0, 0.0, 0.0, 0.004) * far;
        let descriptor = Descriptor::new(Label::new("view").unwrap(), &view).unwrap();
        let covariance = PoseCovariance::from_sd(&sd);
        let moment = moment(self.told, self.seq);
        let view = self
            .keyframes
            .observe(&moment, &descriptor, self.odom, covariance);
        self.keyframes.view(&view);
        if self.keyframes.graph.is_due() {
            for correction in self.keyframes.graph.relax() {
                self.told = correction.estimate.pose;
            }
        }
    }

    fn off_m(&self) -> f64 {
        (self.told.translation.vector - self.truth.translation.vector).norm()
    }
}

#[test]
fn what_was_seen_before_corrects_the_way() {
    let mut round = Round::new();
    for _ in 0..2 * ROUND {
        round.step(None);
    }
    let reckoned = (round.odom.translation.vector - round.truth.translation.vector).norm();
    assert!(reckoned > 1.0, "{reckoned}");
    assert!(round.keyframes.graph.n_closures_accepted() > 0);
    assert!(
        round.off_m() < 0.5 * reckoned,
        "{} of {reckoned}",
        round.off_m()
    );
    let refined = round.keyframes.graph.refine();
    let last = refined.agents[0].poses.last().unwrap().pose;
    let off = (last.translation.vector - round.truth.translation.vector).norm();
    assert!(off < 0.5 * reckoned, "{off} of {reckoned}");
}

#[test]
fn what_was_never_seen_corrects_nothing() {
    let mut round = Round::new();
    for step in 0..4 * ROUND {
        round.step(Some(step));
    }
    assert_eq!(round.keyframes.graph.n_closures_accepted(), 0);
    assert_eq!(round.told, round.odom);
}

#[test]
fn restored_keyframes_goes_on_like_the_original() {
    // In the middle of a stretch that was walked before.
    let mut round = Round::new();
    for _ in 0..ROUND + 9 {
        round.step(None);
    }
    let pages: Vec<_> = round.keyframes.checkpoint(0).collect();
    let restored = KeyframeMap::restore(KeyframeSettings::default(), 1, pages).unwrap();
    assert_eq!(restored.digest(), round.keyframes.digest());
    let mut other = Round {
        keyframes: restored,
        scenery: round.scenery.clone(),
        odom: round.odom,
        told: round.told,
        truth: round.truth,
        seq: round.seq,
    };
    for _ in 0..ROUND {
        round.step(None);
        other.step(None);
    }
    assert!(round.keyframes.graph.n_closures_accepted() > 0);
    assert_eq!(other.told, round.told);
    assert_eq!(other.keyframes.digest(), round.keyframes.digest());
}

#[test]
fn agents_that_were_put_elsewhere_are_not_beside_what_they_saw() {
    let mut round = Round::new();
    for _ in 0..ROUND / 2 {
        round.step(None);
    }
    let start = cognitive_map::StartPose::new(
        round.truth.translation.vector.into(),
        round.truth.rotation.coords.into(),
        cognitive_map::PoseNoise::none(),
    );
    let moment = Moment {
        agent: 0,
        seq: round.seq,
        stamp_ns: i64::try_from(round.seq).unwrap() * 100_000_000,
        pose: round.truth,
    };
    round.keyframes.start_pose(&moment, &start.unwrap());
    round.told = round.truth;
    for _ in 0..2 * ROUND {
        round.step(None);
    }
    assert!(round.off_m() < 1.5, "{}", round.off_m());
}
