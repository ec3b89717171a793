//! What lies between few contacts without normals.

use super::unknown::{WAVES, run_over, taught};
use super::*;
use crate::indexed_model::IndexedModel;

const SIDES_M: [f64; 3] = [0.08, 0.07, 0.11];
const RADIUS_M: f64 = 0.05;

/// Distances of what is predicted between sixty contacts from the surface \[m\], and the same in
/// the deviations that the model claims.
fn errors(shape: Shape, off_m: fn(&Point3<f64>) -> f64) -> [Vec<f64>; 2] {
    let mut errors = [Vec::new(), Vec::new()];
    for object in 0..6 {
        let mut model = ObjectModel::new(ModelSettings::default());
        for key in 0..60 {
            let key = 1000 * object + key;
            let felt = touch(shape(key), &Isometry3::identity(), key);
            model.learn(&Contact::at(felt.position_m, NOISE_M));
        }
        let indexed = IndexedModel::new(&model);
        for place in indexed
            .places
            .iter()
            .filter(|place| place.prediction.is_some())
        {
            let off_m = off_m(&place.position);
            errors[0].push(off_m);
            errors[1].push(off_m / place.variance_m2.sqrt());
        }
    }
    for errors in &mut errors {
        errors.sort_by(f64::total_cmp);
    }
    errors
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Distance of a point from the surface of the box \[m\].
fn off_box_m(point: &Point3<f64>) -> f64 {
    let apart = point.coords.abs() - Vector3::from(SIDES_M) / 2.0;
    let outside = apart.map(|own| own.max(0.0)).norm();
    if outside > 0.0 { outside } else { -apart.max() }
}

#[test]
fn a_box_of_sixty_contacts_has_its_faces_and_edges() {
    let [off_m, in_deviations] = errors(|key| on_box(SIDES_M, key), off_box_m);
    assert!(off_m.len() > 6 * 200, "{} nodes", off_m.len());
    let median_m = off_m[off_m.len() / 2];
    // A smooth surface through the same contacts is 3 mm off, and 10 mm about the edges.
    assert!(median_m < 0.002, "{median_m}");
    let worst_m = off_m[off_m.len() * 9 / 10];
    assert!(worst_m < 0.008, "{worst_m}");
    let claimed = root_mean_square(&in_deviations);
    assert!((0.3..1.5).contains(&claimed), "{claimed}");
}

#[test]
fn a_ball_of_sixty_contacts_is_round() {
    let off_m = |point: &Point3<f64>| (point.coords.norm() - RADIUS_M).abs();
    let [off_m, in_deviations] = errors(|key| on_ball(RADIUS_M, key), off_m);
    assert!(off_m.len() > 6 * 200, "{} nodes", off_m.len());
    let worst_m = off_m[off_m.len() * 9 / 10];
    assert!(worst_m < 0.004, "{worst_m}");
    let claimed = root_mean_square(&in_deviations);
    assert!((0.1..1.5).contains(&claimed), "{claimed}");
}

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
