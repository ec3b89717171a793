//! What lies between few contacts without normals.

use super::unknown::{WAVES, run_over, taught};
use super::*;

/// A hand that rests, and says that it is exact, learns nothing by it.
#[test]
fn a_hand_that_rests_on_a_known_box_calls_it_nothing_else() {
    let library = taught(WAVES, 0..4, 60);
    for position_sd_m in [0.0, NOISE_M] {
        let mut recognition = Recognition::new(&Orientation::Known);
        let run = run_over(WAVES, 2, 30);
        let still = std::iter::repeat_n(run[29].clone(), 40);
        for (count, contact) in (1..).zip(run.iter().cloned().chain(still)) {
            let position_sd_m = position_sd_m.min(contact.position_sd_m);
            recognition.touch(
                &library,
                Contact {
                    position_sd_m,
                    ..contact
                },
            );
            let posterior = recognition.posterior(&library);
            let all: f64 = posterior.objects.iter().map(|own| own.1).sum();
            let sum = all + posterior.unknown;
            assert!((sum - 1.0).abs() < 1e-9, "{sum} after {count} touches");
            let verdict = posterior.verdict();
            assert_ne!(verdict, Verdict::Unknown, "after {count} touches");
        }
    }
}

#[test]
fn boxes_of_sixty_contacts_are_named_by_a_walk() {
    let library = taught(WAVES, 0..4, 60);
    let verdict = |box_number| {
        let mut recognition = Recognition::new(&Orientation::Known);
        for contact in run_over(WAVES, box_number, 100) {
            recognition.touch(&library, contact);
        }
        recognition.posterior(&library).verdict()
    };
    let own: Vec<Verdict> = (0..4).map(verdict).collect();
    let others: Vec<Verdict> = (1000..1004).map(verdict).collect();
    for (id, verdict) in (0..).zip(&own) {
        assert_eq!(*verdict, Verdict::Object(ObjectId(id)), "{own:?}");
    }
    let named = |verdict: &Verdict| matches!(verdict, Verdict::Object(_));
    assert!(!others.iter().any(named), "{others:?}");
}
