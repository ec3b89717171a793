//! Small experiments with objects, and what must be true of any.

use std::num::NonZeroUsize;

use nalgebra::UnitQuaternion;
use object_recognition::ObjectId;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{
    Answer, Decision, InvalidObjectProtocol, ObjectExperiment, ObjectProtocol, ObjectReport,
    ObjectTable, Outcomes, Rotate, TouchStep, Trace, object_figures,
};
use crate::objects::ExplorationNoise;

fn run(protocol: &ObjectProtocol, threads: usize) -> ObjectReport {
    let threads = NonZeroUsize::new(threads).unwrap();
    let experiment = ObjectExperiment::run(protocol, threads, &|_| {}, &|| 0.0).unwrap();
    ObjectReport::of(&experiment)
}

fn small() -> ObjectProtocol {
    ObjectProtocol {
        trials: 16,
        ..ObjectProtocol::of_paper(2)
    }
}

#[test]
fn two_objects_are_told_apart_in_fewer_touches_than_the_paper_needs() {
    let report = run(&small(), 2);
    let outcomes = report.outcomes.unwrap();
    assert!(outcomes.accuracy > 0.9, "{outcomes:?}");
    assert!(outcomes.steps_mean.unwrap() < 20.0, "{outcomes:?}");
    let live = &report.live_objects;
    assert!(live[0] > 1.5 && *live.last().unwrap() < 1.2, "{live:?}");
    assert!(report.confidence.last() > report.confidence.first());
    assert!(report.false_known_rate.unwrap() < 0.5);
    assert!(report.places_per_object > 50.0);
}

#[test]
fn few_turned_strangers_are_taken_for_an_object() {
    let report = run(
        &ObjectProtocol {
            rotate: Rotate::Cube,
            trials: 100,
            ..small()
        },
        2,
    );
    let outcomes = report.outcomes.unwrap();
    assert!(outcomes.accuracy >= 0.98, "{outcomes:?}");
    let named = report.false_known_rate.unwrap();
    assert!(named <= 0.2, "{named}");
}

#[test]
fn outcomes_do_not_depend_on_the_number_of_threads() {
    let protocol = ObjectProtocol {
        trials: 6,
        ..small()
    };
    let json = |threads| serde_json::to_string(&run(&protocol, threads)).unwrap();
    assert_eq!(json(1), json(3));
    let other = ObjectProtocol {
        seed: 2,
        ..protocol
    };
    assert_ne!(json(1), serde_json::to_string(&run(&other, 1)).unwrap());
}

#[test]
fn figures_and_table_name_the_paper() {
    let reports = [run(
        &ObjectProtocol {
            trials: 4,
            ..small()
        },
        2,
    )];
    let figures = object_figures(&reports).unwrap();
    let names: Vec<&str> = figures.iter().map(|figure| figure.name).collect();
    assert_eq!(names, ["active-objects", "object-confidence"]);
    for figure in &figures {
        assert!(figure.svg.starts_with("<svg") && figure.svg.trim_end().ends_with("</svg>"));
        assert!(figure.svg.contains("Fig. 21") && figure.svg.contains("s: 180)"));
    }
    let table = ObjectTable(&reports).to_string();
    assert!(table.contains("98.2 %, 180 ± 25 steps"), "{table}");
    assert!(object_figures(&[]).is_ok());
}

#[test]
fn a_protocol_without_sense_is_refused_by_name() {
    let noise = |value, motion| ExplorationNoise { value, motion };
    let good = small();
    assert_eq!(good.check(), Ok(()));
    for (bad, reason) in [
        (
            ObjectProtocol { objects: 0, ..good },
            InvalidObjectProtocol::Objects,
        ),
        (
            ObjectProtocol {
                noise: noise(-0.1, 0.0),
                ..good
            },
            InvalidObjectProtocol::Noise,
        ),
        (
            ObjectProtocol {
                noise: noise(0.0, f64::NAN),
                ..good
            },
            InvalidObjectProtocol::Noise,
        ),
        (
            ObjectProtocol { trials: 0, ..good },
            InvalidObjectProtocol::Trials,
        ),
        (
            ObjectProtocol {
                touches_max: 0,
                ..good
            },
            InvalidObjectProtocol::Trials,
        ),
        (
            ObjectProtocol { sure: 1.0, ..good },
            InvalidObjectProtocol::Sure,
        ),
    ] {
        assert_eq!(bad.check(), Err(reason));
    }
}

/// A trace whose first choice was worth so much after each touch, with an answer after the last
/// one.
fn trace(right: &[f64], answer: Option<Answer>) -> Trace {
    let step = |right: &f64| TouchStep {
        right: *right,
        confidence: 0.5,
        unknown: 0.0,
        live_objects: 2.0,
        live_hypotheses: 3.0,
        took_s: 1e-6,
    };
    Trace {
        steps: right.iter().map(step).collect(),
        decision: answer.map(|answer| Decision {
            touches: right.len(),
            answer,
        }),
    }
}

#[test]
fn outcomes_are_shares_of_all_explorations() {
    let truth = ObjectId(1);
    let traces = [
        trace(&[0.5, 1.0], Some(Answer::Object(truth))),
        trace(&[0.0, 0.0, 0.0, 0.0], Some(Answer::Object(ObjectId(0)))),
        trace(&[1.0, 1.0, 1.0], Some(Answer::Unknown)),
        trace(&[1.0], None),
    ];
    let outcomes = Outcomes::of(traces.iter().map(|trace| (truth, trace))).unwrap();
    assert_eq!(
        (
            outcomes.accuracy,
            outcomes.wrong_rate,
            outcomes.unknown_rate,
            outcomes.undecided_rate
        ),
        (0.25, 0.25, 0.25, 0.25)
    );
    assert_eq!(outcomes.steps_mean, Some(3.0));
    let sd = (2.0_f64 / 3.0).sqrt();
    assert!((outcomes.steps_sd.unwrap() - sd).abs() < 1e-12);
    assert_eq!(Outcomes::of(std::iter::empty()), None);
    let traces: Vec<&Trace> = traces.iter().collect();
    // Who ended before counts with the last choice.
    assert_eq!(
        super::means(&traces, |step| step.right),
        [0.625, 0.75, 0.75, 0.75]
    );
}

#[test]
fn turns_are_those_that_the_recogniser_is_told() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    assert_eq!(Rotate::None.draw(&mut random), UnitQuaternion::identity());
    let turns: Vec<UnitQuaternion<f64>> =
        (0..400).map(|_| Rotate::Cube.draw(&mut random)).collect();
    let mut kinds: Vec<UnitQuaternion<f64>> = Vec::new();
    for turn in turns {
        // Each takes the axes to axes.
        let matrix = turn.to_rotation_matrix().into_inner();
        assert!(
            matrix
                .iter()
                .all(|x| x.abs() < 1e-9 || (x.abs() - 1.0).abs() < 1e-9)
        );
        if kinds.iter().all(|kind| kind.angle_to(&turn) > 0.1) {
            kinds.push(turn);
        }
    }
    assert_eq!(kinds.len(), 24);
    let free: Vec<f64> = (0..2000)
        .map(|_| Rotate::Free.draw(&mut random).angle())
        .collect();
    // The mean angle of an even rotation is π/2 + 2/π.
    let mean = free.iter().sum::<f64>() / free.len() as f64;
    assert!((mean - 2.207).abs() < 0.05, "{mean}");
}
