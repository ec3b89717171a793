//! Levels that no sensor of their kind has.

use super::unknown::{WAVES_APART, run_over, taught};
use super::*;

/// A box with one absurd level, of either sign.
fn absurd(value: f64, contacts: u64) -> ObjectModel {
    let mut model = ObjectModel::new(ModelSettings::default());
    for (number, contact) in (0..).zip(run_over(WAVES_APART, 7, contacts)) {
        let value = if number % 3 == 0 { -value } else { value };
        let bare = Contact::at(contact.position_m, NOISE_M);
        model.learn(&bare.with_level(0, value, 0.1));
    }
    model
}

/// What it is after so many touches of each of the objects taught.
fn verdicts(library: &ObjectLibrary, count: u64) -> Vec<Verdict> {
    let verdict = |own| {
        let mut recognition = Recognition::new(&Orientation::Known);
        for contact in run_over(WAVES_APART, own, count) {
            recognition.touch(library, contact);
        }
        recognition.posterior(library).verdict()
    };
    (0..4).map(verdict).collect()
}

fn all_named() -> Vec<Verdict> {
    (0..4).map(|id| Verdict::Object(ObjectId(id))).collect()
}

#[test]
fn an_object_with_absurd_levels_leaves_the_others_as_they_were() {
    let library = taught(WAVES_APART, 0..4, 300);
    assert_eq!(verdicts(&library, 40), all_named());
    for value in [100.0, 1e4, 1e6, 1e15, 1e30] {
        for contacts in [6, 400] {
            let mut library = library.clone();
            library.put(ObjectId(9), absurd(value, contacts));
            assert_eq!(verdicts(&library, 40), all_named(), "{value} {contacts}");
            library.put(ObjectId(10), absurd(value * 1e-2, contacts));
            assert_eq!(verdicts(&library, 40), all_named(), "{value} {contacts}");
        }
    }
}

#[test]
fn a_level_that_stands_for_nothing_leaves_the_other_levels_of_its_object() {
    let taught = taught(WAVES_APART, 0..4, 300);
    for nothing in [-99_999.0, -2_147_483_648.0, 1e30] {
        let mut library = ObjectLibrary::default();
        for id in (0..4).map(ObjectId) {
            let mut model = taught.get(id).expect("four were taught").clone();
            let mut contact = model.places()[0].contact();
            contact.position_m.x += 0.01;
            contact.levels[0].value = nothing;
            model.learn(&contact);
            library.put(id, model);
        }
        assert_eq!(verdicts(&library, 40), all_named(), "{nothing}");
    }
}

#[test]
fn levels_at_the_ends_of_what_a_number_holds_leave_a_posterior() {
    let mut library = taught(WAVES_APART, 0..3, 60);
    library.put(ObjectId(9), absurd(1e30, 60));
    for value in [0.0, 1e30, -1e200, f64::MAX] {
        for sd in [0.0, 0.03, 1e30, 1e200, f64::MAX] {
            let mut recognition = Recognition::new(&Orientation::Known);
            for (number, contact) in (0..).zip(run_over(WAVES_APART, 0, 12)) {
                let value = if number % 2 == 0 { value } else { -value };
                let bare = Contact::at(contact.position_m, NOISE_M);
                recognition.touch(&library, bare.with_level(0, value, sd));
                let posterior = recognition.posterior(&library);
                let sum =
                    posterior.unknown + posterior.objects.iter().map(|own| own.1).sum::<f64>();
                assert!((sum - 1.0).abs() < 1e-6, "{value} {sd}: {posterior:?}");
            }
        }
    }
}
