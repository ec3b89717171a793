//! However many threads relax the past, and whenever the service restarts, the map is the same.

use std::f64::consts::TAU;

use cogmap_proto::{Increment, MotionNoise, Relation, Sample, SampleBody, Sighting, Target};

use super::*;

/// Steps of a round, ten a second, and rounds.
const ROUND: u64 = 40;
const ROUNDS: u64 = 6;

/// Numbers of samples after which the service restarts, each in the middle of a relaxation.
const RESTARTS: [usize; 2] = [80, 163];

/// A robot that goes round in a circle with odometry that turns 2 % too much, and tells from the
/// second round on that it is where it was a round ago.
fn rounds() -> Vec<Sample> {
    let (mut samples, mut motions) = (Vec::new(), Vec::new());
    for step in 0..ROUND * ROUNDS {
        let stamp_ns = i64::try_from(step).unwrap() * 100_000_000;
        let half = TAU / ROUND as f64 * 1.02 / 2.0;
        motions.push(samples.len() as u64);
        let body = SampleBody::Increment(Increment {
            translation_m: [0.3, 0.0, 0.0],
            rotation_xyzw: [0.0, 0.0, half.sin(), half.cos()],
            noise: Some(noise(0.01)),
        });
        samples.push(Sample { stamp_ns, body });
        if step > ROUND && step % 4 == 0 {
            let then = usize::try_from(step - ROUND).unwrap();
            let relation = Relation::Pose {
                translation_m: [0.0; 3],
                rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
                noise: noise(0.04),
            };
            let target = Target::OwnSample(motions[then]);
            let body = SampleBody::Sighting(Sighting { target, relation });
            samples.push(Sample { stamp_ns, body });
        }
    }
    samples
}

fn noise(sd: f64) -> MotionNoise {
    MotionNoise {
        translation_sd_m: [sd, sd, 0.0],
        rotation_sd_rad: [0.0, 0.0, sd],
    }
}

/// Digest and number of closures after the rounds, sent so many at a time.
fn served(threads: usize, at_once: usize) -> (String, usize) {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let settings = EngineSettings {
        relaxation_threads: threads,
        checkpoint_interval: Duration::from_millis(1),
        ..EngineSettings::default()
    };
    let samples = rounds();
    let mut engine = open(directory.path(), settings);
    let mut sent = 0;
    for some in samples.chunks(at_once) {
        offer(&engine, sent as u64, some);
        let before = sent;
        sent += some.len();
        if RESTARTS.iter().any(|&at| before < at && at <= sent) {
            wait_for(|| applied(&engine) == sent as u64);
            engine.shutdown();
            drop(engine);
            engine = open(directory.path(), settings);
        }
    }
    wait_for(|| applied(&engine) == samples.len() as u64);
    let digest = digest(&engine);
    let runtime = tokio::runtime::Builder::new_current_thread().build();
    let space = engine.space(SPACE).expect("the space is there");
    let map = runtime.expect("a runtime").block_on(space.snapshot());
    let closures = map.expect("a snapshot").closure_count();
    engine.shutdown();
    (digest, closures)
}

#[test]
fn threads_and_batches_make_no_difference() {
    let alone = served(0, 64);
    assert!(alone.1 > 10, "{} closures", alone.1);
    for (threads, at_once) in [(0, 1), (1, 1), (1, 7), (8, 64), (8, 4096)] {
        let served = served(threads, at_once);
        assert_eq!(
            served, alone,
            "{threads} threads, {at_once} samples a message"
        );
    }
}
