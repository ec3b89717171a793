use nalgebra::{Isometry3, Point3};

use super::super::{Effect, Estimator, Parameters};
use super::{POSTS, SECOND_NS, label, motion, polar, start};
use crate::input::{Relation, RelativePosition};

/// A frame that is left by its only agent is forgotten, and the numbers of the others stay.
#[test]
fn frames_are_told_and_emptied() {
    let mut estimator = Estimator::new(Parameters::default());
    let [first, second] = [(); 2].map(|()| estimator.enrol());
    assert_eq!(estimator.frame_of(second), Some(2));
    assert!(estimator.found(first));
    assert_eq!(estimator.frame_of(first), Some(0));
    let mut effects = Vec::new();
    let taken = estimator.landmark(
        second,
        0,
        &label(0),
        &polar(&Isometry3::identity(), &Point3::from(POSTS[0])),
        &mut effects,
    );
    assert!(taken.is_new && taken.accepted);
    assert!(
        matches!(effects[..], [Effect::LandmarkSighted { variance, .. }] if variance.min() > 0.0)
    );
    estimator.start_pose(second, &start(&Isometry3::identity(), 0.1), &mut Vec::new());
    assert_eq!(estimator.frame_of(second), Some(0));
    assert!(estimator.frame(2).landmarks.is_empty() && estimator.frame(2).covariance.dim() == 0);
    assert_eq!(estimator.frame(0).population, 2);
}

/// A step tells what was corrected, and an effect tells of a sighting once both agents have moved
/// up to it.
#[test]
fn the_outcome_of_a_sample_is_told() {
    let mut estimator = Estimator::new(Parameters::default());
    let [observer, target] = [(); 2].map(|()| estimator.enrol());
    estimator.start_pose(
        observer,
        &start(&Isometry3::identity(), 0.1),
        &mut Vec::new(),
    );
    estimator.start_pose(
        target,
        &start(&Isometry3::translation(3.0, 0.0, 0.0), 0.1),
        &mut Vec::new(),
    );
    let moved = motion([0.5, 0.0, 0.0], [0.0, 0.0, 0.2]);
    let before = *estimator.in_frame(observer).unwrap();
    let step = estimator.motion(observer, SECOND_NS, &moved, &mut Vec::new());
    let after = estimator.in_frame(observer).unwrap();
    assert!((after.to_homogeneous() - (before * step.increment).to_homogeneous()).amax() < 1e-12);
    assert_eq!(after.translation.vector, step.displacement);
    assert!((step.variance[0] - 1e-4).abs() < 1e-12 && (step.variance[5] - 2.5e-5).abs() < 1e-12);
    let seen = Relation::Position(RelativePosition::new([3.1, 0.2, 0.0], [0.1; 3]).unwrap());
    let mut effects = Vec::new();
    estimator.sighting(observer, SECOND_NS, target, &seen, &mut effects);
    assert_eq!(effects, [], "the target has not moved yet");
    estimator.motion(target, SECOND_NS, &moved, &mut effects);
    let [Effect::Moved { agent, .. }, Effect::AgentSighted(sighted)] = &effects[..] else {
        panic!("{effects:?}");
    };
    assert_eq!(*agent, target);
    assert!(sighted.accepted && sighted.relation == seen);
    assert_eq!((sighted.observer, sighted.target), (observer, target));
}
