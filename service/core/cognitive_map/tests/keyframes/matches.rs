//! Matches: true ones correct, false ones do not bend.

use crate::as_read;
use cognitive_map::keyframes::{Correction, KeyframeMap, KeyframeSettings, Moment};
use cognitive_map::{PoseNoise, Relation, RelativePose};
use nalgebra::{Isometry3, Vector3, Vector6};

/// Steps of a round.
const ROUND: u64 = 80;

/// A robot on a circle whose gyroscope drifts, so that the round does not close.
struct Rounds {
    keyframes: KeyframeMap,
    /// Steps of a round, and their length \[m\].
    round: u64,
    step_m: f64,
    told: Isometry3<f64>,
    truth: Vec<Isometry3<f64>>,
    corrections: Vec<Correction>,
}

impl Rounds {
    fn new(settings: KeyframeSettings, frame: &Isometry3<f64>) -> Self {
        let mut keyframes = KeyframeMap::new(settings);
        let agent = keyframes.graph.enrol();
        let start = cognitive_map::StartPose::new(
            frame.translation.vector.into(),
            frame.rotation.coords.into(),
            PoseNoise::none(),
        );
        keyframes.start_pose(&moment(0, frame), &start.unwrap());
        assert_eq!(agent, 0);
        Self {
            keyframes,
            round: ROUND,
            step_m: 0.3,
            told: *frame,
            truth: vec![*frame],
            corrections: Vec::new(),
        }
    }

    fn step(&mut self, drift_rad: f64) {
        let turn = std::f64::consts::TAU / self.round as f64;
        let ahead = Vector3::x() * self.step_m;
        let seq = self.truth.len() as u64;
        let true_step = Isometry3::new(ahead, Vector3::z() * turn);
        let read = Isometry3::new(ahead, Vector3::z() * (turn + drift_rad));
        self.truth
            .push(self.truth[self.truth.len() - 1] * true_step);
        self.told *= read;
        let variance = Vector6::new(1e-4, 1e-4, 0.0, 0.0, 0.0, 1e-4);
        self.keyframes
            .graph
            .motion(&moment(seq, &self.told), &read, &variance, &as_read(&read));
        if self.keyframes.graph.is_due() {
            let corrections = self.keyframes.graph.relax();
            if let Some(correction) = corrections.first() {
                self.told = correction.estimate.pose;
                self.corrections = corrections;
            }
        }
    }

    /// A match with an earlier step, off from what is true by an error.
    fn matched(&mut self, earlier: u64, error: &Isometry3<f64>) {
        let seq = self.truth.len() as u64 - 1;
        let now = self.truth[usize::try_from(seq).unwrap()];
        let seen = now.inv_mul(&self.truth[usize::try_from(earlier).unwrap()]) * error;
        self.same_place(earlier, &seen);
    }

    fn same_place(&mut self, earlier: u64, seen: &Isometry3<f64>) {
        let noise = PoseNoise::new([0.05, 0.05, 0.0], [0.0, 0.0, 0.02]).unwrap();
        let relation = RelativePose::new(
            seen.translation.vector.into(),
            seen.rotation.coords.into(),
            noise,
        );
        let seq = self.truth.len() as u64 - 1;
        let told = self.told;
        let relation = Relation::Pose(relation.unwrap());
        assert!(
            self.keyframes
                .graph
                .closure(&moment(seq, &told), earlier, &relation)
        );
    }

    /// Distance of where the robot is thought to be from where it is \[m\].
    fn off_m(&self) -> f64 {
        let truth = self.truth[self.truth.len() - 1].translation.vector;
        (self.told.translation.vector - truth).norm()
    }
}

fn moment(seq: u64, pose: &Isometry3<f64>) -> Moment {
    Moment {
        agent: 0,
        seq,
        stamp_ns: i64::try_from(seq).unwrap() * 100_000_000,
        pose: *pose,
    }
}

fn rounds(drift_rad: f64, mut at: impl FnMut(&mut Rounds, u64)) -> Rounds {
    rounds_in(&Isometry3::identity(), drift_rad, &mut at)
}

fn rounds_in(
    frame: &Isometry3<f64>,
    drift_rad: f64,
    at: &mut impl FnMut(&mut Rounds, u64),
) -> Rounds {
    let mut walk = Rounds::new(KeyframeSettings::default(), frame);
    for seq in 1..=4 * ROUND {
        walk.step(drift_rad);
        at(&mut walk, seq);
    }
    walk
}

#[test]
fn true_matches_close_the_loop_whichever_way_the_gyroscope_drifts() {
    for drift_rad in [0.004, -0.004] {
        let alone = rounds(drift_rad, |_, _| {});
        assert!(alone.off_m() > 1.0, "{}", alone.off_m());
        let closed = rounds(drift_rad, |walk, seq| {
            if seq > ROUND && seq.is_multiple_of(5) {
                walk.matched(seq - ROUND, &Isometry3::identity());
            }
        });
        assert!(closed.keyframes.graph.n_closures_accepted() > 20);
        assert!(closed.off_m() < 0.35 * alone.off_m(), "{}", closed.off_m());
        let covariance = closed.corrections[0].estimate.covariance;
        assert!(covariance.position_sd_m() < 0.5);
    }
}

#[test]
fn a_round_of_more_than_four_kilometres_closes() {
    let round = 4400;
    let mut walk = Rounds::new(KeyframeSettings::default(), &Isometry3::identity());
    (walk.round, walk.step_m) = (round, 1.0);
    for seq in 1..=round + 800 {
        walk.step(2e-5);
        if seq == round {
            assert!(walk.off_m() > 50.0, "{}", walk.off_m());
        }
        if seq > round && seq.is_multiple_of(5) {
            walk.matched(seq - round, &Isometry3::identity());
        }
    }
    assert!(walk.off_m() < 2.0, "{}", walk.off_m());
}

#[test]
fn a_single_match_that_the_map_cannot_judge_waits() {
    let walk = rounds(0.004, |walk, seq| {
        if seq == 3 * ROUND {
            walk.matched(2 * ROUND, &Isometry3::identity());
        }
    });
    assert_eq!(walk.keyframes.graph.n_closures_accepted(), 0);
}

#[test]
fn false_matches_do_not_bend() {
    let elsewhere = Isometry3::identity();
    let walk = rounds(0.0, |walk, seq| {
        // Of places a third of a round apart, each with another one.
        if seq > ROUND && seq.is_multiple_of(7) {
            walk.same_place(seq * 29 % (seq - 27), &elsewhere);
        }
    });
    assert!(walk.off_m() < 0.2, "{}", walk.off_m());
    let drifting = |false_ones: bool| {
        rounds(0.003, |walk, seq| {
            if seq > ROUND && seq.is_multiple_of(5) {
                walk.matched(seq - ROUND, &Isometry3::identity());
            }
            if false_ones && seq > ROUND && seq.is_multiple_of(2) {
                walk.same_place(seq * 29 % (seq - 27), &elsewhere);
            }
        })
    };
    let (clean, doubted) = (drifting(false), drifting(true));
    assert!(doubted.off_m() < clean.off_m() + 0.2, "{}", doubted.off_m());
}

#[test]
fn a_wider_gate_takes_closures_that_disagree_more() {
    let n_believed = |closure_gate_chi2| {
        let settings = KeyframeSettings {
            closure_gate_chi2,
            ..KeyframeSettings::default()
        };
        let mut walk = Rounds::new(settings, &Isometry3::identity());
        for seq in 1..=4 * ROUND {
            walk.step(0.0);
            if seq > ROUND && seq.is_multiple_of(5) {
                // Off by four of its deviations, to one side and to the other in turn.
                let side_m = if seq.is_multiple_of(10) { 0.2 } else { -0.2 };
                walk.matched(seq - ROUND, &Isometry3::translation(0.0, side_m, 0.0));
            }
        }
        walk.keyframes.graph.n_closures_accepted()
    };
    let (narrow, wide) = (n_believed(1.0), n_believed(100.0));
    assert!(narrow < wide / 2, "{narrow} {wide}");
}

#[test]
fn corrections_move_with_the_start() {
    let frame = Isometry3::new(Vector3::new(-20.0, 30.0, 0.0), Vector3::z() * -2.0);
    let mut at = |walk: &mut Rounds, seq: u64| {
        if seq > ROUND && seq.is_multiple_of(5) {
            walk.matched(seq - ROUND, &Isometry3::identity());
        }
    };
    let here = rounds_in(&Isometry3::identity(), 0.004, &mut at);
    let there = rounds_in(&frame, 0.004, &mut at);
    let off = (frame * here.told).inv_mul(&there.told);
    assert!(off.translation.vector.norm() < 1e-3 && off.rotation.angle() < 1e-3);
}

#[test]
fn restored_keyframes_relaxes_to_the_same_bits() {
    let mut at = |walk: &mut Rounds, seq: u64| {
        if seq > ROUND && seq.is_multiple_of(5) {
            walk.matched(seq - ROUND, &Isometry3::identity());
        }
    };
    let live = rounds_in(&Isometry3::identity(), 0.004, &mut at);
    let recovered = rounds_in(&Isometry3::identity(), 0.004, &mut |walk, seq| {
        if seq.is_multiple_of(50) {
            let pages: Vec<_> = walk.keyframes.checkpoint(0).collect();
            walk.keyframes = KeyframeMap::restore(KeyframeSettings::default(), 1, pages).unwrap();
        }
        at(walk, seq);
    });
    assert_eq!(live.keyframes.digest(), recovered.keyframes.digest());
    assert_eq!(live.told, recovered.told);
    assert_eq!(
        live.keyframes.graph.refine(),
        recovered.keyframes.graph.refine()
    );
}
