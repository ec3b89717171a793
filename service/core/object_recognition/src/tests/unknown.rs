//! What was never learned.

use super::*;

#[test]
fn what_was_not_learned_is_unknown() {
    let library = library(&[BOX, CUBE, BALL]);
    let posterior = recognise(&library, &episode(LARGE_BALL, 40, &frame()));
    assert!(posterior.unknown > 0.9, "{posterior:?}");
    assert!(posterior.fit < -3.0, "{posterior:?}");
    let posterior = recognise(&library, &episode(BALL, 40, &frame()));
    assert!(
        posterior.unknown < 0.1 && posterior.fit > -3.0,
        "{posterior:?}"
    );
}

#[test]
fn what_lies_on_a_part_of_something_learned_is_another_thing() {
    /// A third of the ball's surface.
    const CAP: Shape = |key| {
        let points = (0..64).map(|k| BALL(64 * key + k));
        let mut caps = points.filter(|point| point.1.z > 1.0 / 3.0);
        caps.next().expect("one of 64 is on a third of it")
    };
    let library = library(&[BOX, BALL]);
    let contacts = episode(CAP, 60, &frame());
    let drawn: Vec<_> = contacts.iter().cloned().map(Contact::drawn).collect();
    let posterior = recognise(&library, &drawn);
    assert!(posterior.unknown > 0.9, "{posterior:?}");
    // A finger that was led there may have been on the whole ball.
    let posterior = recognise(&library, &contacts);
    assert_eq!(posterior.verdict(), Verdict::Object(ObjectId(1)));
    // And drawn from all of it, they are the ball's.
    let ball: Vec<_> = { episode(BALL, 60, &frame()).into_iter() }
        .map(Contact::drawn)
        .collect();
    let posterior = recognise(&library, &ball);
    assert_eq!(posterior.verdict(), Verdict::Object(ObjectId(1)));
}
