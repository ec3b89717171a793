//! Laws of recognition, and an oracle by brute force.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Unit, UnitQuaternion, Vector3};

use super::{
    Contact, ModelSettings, ObjectId, ObjectLibrary, ObjectModel, Orientation, Posterior,
    Recognition, Verdict,
};
use crate::numeric::log_sum;
use crate::translations::GaussianSum;
use crate::variant::{Variant, VariantId};

mod bodies;
mod levels;
mod runs;
mod sizes;
mod sparse;
mod turns;
mod unknown;

const NOISE_M: f64 = 0.001;
const NOISE_RAD: f64 = 0.02;

fn uniform(key: u64) -> f64 {
    random::uniform(11, [0, 0, key])
}

/// About normal: the sum of twelve uniform numbers.
fn normal(key: u64) -> f64 {
    (0..12)
        .map(|k| uniform(key * 16 + k + (1 << 40)))
        .sum::<f64>()
        - 6.0
}

/// A point of the surface of a box with these sides, with its normal.
fn on_box(sides: [f64; 3], key: u64) -> (Point3<f64>, Unit<Vector3<f64>>) {
    let [a, b, c] = sides;
    let areas = [b * c, a * c, a * b];
    let mut pick = uniform(4 * key) * areas.iter().sum::<f64>() * 2.0;
    let mut face = 0;
    while pick > areas[face % 3] && face < 5 {
        pick -= areas[face % 3];
        face += 1;
    }
    let sign = if face < 3 { 1.0 } else { -1.0 };
    let mut point = Vector3::new(
        a * (uniform(4 * key + 1) - 0.5),
        b * (uniform(4 * key + 2) - 0.5),
        c * (uniform(4 * key + 3) - 0.5),
    );
    point[face % 3] = 0.5 * sign * sides[face % 3];
    let mut normal = Vector3::zeros();
    normal[face % 3] = sign;
    (Point3::from(point), Unit::new_unchecked(normal))
}

fn on_ball(radius_m: f64, key: u64) -> (Point3<f64>, Unit<Vector3<f64>>) {
    let direction = Vector3::new(normal(3 * key), normal(3 * key + 1), normal(3 * key + 2));
    let direction = Unit::new_normalize(direction);
    (Point3::from(direction.into_inner() * radius_m), direction)
}

/// A noisy touch of a point, in a frame.
fn touch(
    (point, along): (Point3<f64>, Unit<Vector3<f64>>),
    frame: &Isometry3<f64>,
    key: u64,
) -> Contact {
    let noise =
        |at: u64| Vector3::from_fn(|axis, _| normal(1_000_000 + 16 * key + at + axis as u64));
    let point = frame * (point + noise(0) * NOISE_M);
    let along = frame * Unit::new_normalize(along.into_inner() + noise(4) * NOISE_RAD);
    Contact::at(point, NOISE_M).with_normal(along, NOISE_RAD)
}

type Shape = fn(u64) -> (Point3<f64>, Unit<Vector3<f64>>);

const BOX: Shape = |key| on_box([0.06, 0.09, 0.14], key);
const CUBE: Shape = |key| on_box([0.08, 0.08, 0.08], key);
const BALL: Shape = |key| on_ball(0.05, key);
const LARGE_BALL: Shape = |key| on_ball(0.058, key);

fn library(shapes: &[Shape]) -> ObjectLibrary {
    let mut library = ObjectLibrary::default();
    for (id, shape) in (0u32..).zip(shapes) {
        let mut model = ObjectModel::new(ModelSettings::default());
        for key in 0..500 {
            let key = key + 10_000 * u64::from(id + 1);
            model.learn(&touch(shape(key), &Isometry3::identity(), key));
        }
        library.put(ObjectId(id), model);
    }
    library
}

fn frame() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(0.4, -0.7, 1.1), Vector3::new(1.0, -0.5, 2.0))
}

fn episode(shape: Shape, count: u64, frame: &Isometry3<f64>) -> Vec<Contact> {
    (0..count)
        .map(|key| touch(shape(key + 77), frame, key + 500_000))
        .collect()
}

fn recognise(library: &ObjectLibrary, contacts: &[Contact]) -> Posterior {
    let mut recognition = Recognition::new(&Orientation::Free);
    for contact in contacts {
        recognition.touch(library, contact.clone());
    }
    recognition.posterior(library)
}

#[test]
fn shapes_are_told_apart_in_any_pose_and_their_pose_is_found() {
    let library = library(&[BOX, CUBE, BALL]);
    for (id, shape) in (0u32..).zip([BOX, CUBE, BALL]) {
        let posterior = recognise(&library, &episode(shape, 16, &frame()));
        assert_eq!(
            posterior.verdict(),
            Verdict::Object(ObjectId(id)),
            "{posterior:?}"
        );
        let pose = posterior.pose.unwrap();
        // All of them are symmetric about their middle, wherever else they are turned.
        let middle = pose.map_from_episode * (frame() * Point3::origin());
        assert!(middle.coords.norm() < 0.003, "{middle}");
    }
}

#[test]
fn moving_the_episodes_frame_moves_the_pose_and_nothing_else() {
    let library = library(&[BOX, CUBE]);
    let plain = recognise(&library, &episode(BOX, 12, &Isometry3::identity()));
    for far_m in [-1000.0, 1.0, 1000.0] {
        let moved = Isometry3::new(
            Vector3::new(far_m, -2.0 * far_m, 0.5 * far_m),
            Vector3::new(-2.0, 0.4, 1.0),
        );
        let contacts: Vec<_> = episode(BOX, 12, &Isometry3::identity())
            .into_iter()
            .map(|mut contact| {
                contact.position_m = moved * contact.position_m;
                contact.normal = contact.normal.map(|normal| moved * normal);
                contact
            })
            .collect();
        let posterior = recognise(&library, &contacts);
        assert!((posterior.objects[0].1 - plain.objects[0].1).abs() < 1e-4);
        let (pose, plain) = (posterior.pose.unwrap(), plain.pose.clone().unwrap());
        let back = pose.map_from_episode * moved;
        let poses =
            std::iter::once(plain.map_from_episode).chain(plain.others.iter().map(|other| other.0));
        // A symmetric pose is as right.
        let apart = |other: &Isometry3<f64>| {
            (back.translation.vector - other.translation.vector).norm()
                + back.rotation.angle_to(&other.rotation)
        };
        let nearest = poses
            .map(|other| apart(&other))
            .fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.01, "{nearest}");
    }
}

#[test]
fn a_box_is_found_in_all_its_four_poses() {
    let library = library(&[BOX]);
    let posterior = recognise(&library, &episode(BOX, 30, &frame()));
    let pose = posterior.pose.unwrap();
    let truth = frame().inverse();
    let turns = [Vector3::zeros(), Vector3::x(), Vector3::y(), Vector3::z()]
        .map(|axis| UnitQuaternion::new(axis * std::f64::consts::PI));
    let mut found = [0.0; 4];
    let poses = std::iter::once((pose.map_from_episode, pose.share)).chain(pose.others);
    for (pose, share) in poses {
        for (turn, found) in turns.iter().zip(&mut found) {
            if (turn * truth.rotation).angle_to(&pose.rotation) < 0.1 {
                *found += share;
            }
        }
    }
    assert!(found.iter().sum::<f64>() > 0.95, "{found:?}");
    assert!(
        found.iter().filter(|share| **share > 0.01).count() >= 3,
        "{found:?}"
    );
}

#[test]
fn the_same_contacts_give_the_same_bits() {
    let library = library(&[BOX, CUBE]);
    let contacts = episode(CUBE, 9, &frame());
    let (a, b) = (
        recognise(&library, &contacts),
        recognise(&library, &contacts),
    );
    assert_eq!(format!("{a:?}"), format!("{b:?}"));
}

#[test]
fn the_touch_that_is_asked_for_tells_boxes_apart() {
    // Only one side differs; the first touches are all on the others.
    let longer: Shape = |key| on_box([0.06, 0.09, 0.17], key);
    let library = library(&[BOX, longer]);
    let mut recognition = Recognition::new(&Orientation::Free);
    let contacts = (0..200).map(|key| touch(BOX(key), &frame(), key + 900_000));
    let on_sides = contacts.filter(|contact| {
        let normal = frame().inverse() * contact.normal.unwrap();
        let at = frame().inverse() * contact.position_m;
        normal.z.abs() < 0.3 && at.z.abs() < 0.05
    });
    for (number, contact) in on_sides.take(12).enumerate() {
        let is_aimed = number % 3 == 0;
        recognition.touch(&library, if is_aimed { contact.aimed() } else { contact });
    }
    let asked = recognition.next_touch(&library).unwrap();
    let at = frame().inverse() * asked.point_m;
    assert!(at.z.abs() > 0.06, "asked at {at}");
    assert!(asked.gain_nats > 0.0 && asked.approach.is_some());
}

/// A few places with levels.
fn dots(key: u64, count: u64) -> Vec<(Point3<f64>, f64)> {
    (0..count)
        .map(|at| {
            let k = 100 * key + 8 * at;
            let point = Point3::new(uniform(k), uniform(k + 1), uniform(k + 2)) * 0.1;
            (point, (uniform(k + 3) * 6.0).floor())
        })
        .collect()
}

fn dotted(key: u64) -> ObjectModel {
    let settings = ModelSettings {
        spacing_m: 0.001,
        ..ModelSettings::default()
    };
    let mut model = ObjectModel::new(settings);
    for (point, level) in dots(key, 7) {
        model.learn(&Contact::at(point, 0.0).with_level(0, level, 0.1));
    }
    model
}

#[test]
fn the_evidence_is_that_of_all_assignments_of_contacts_to_places() {
    let noise_m = 0.008;
    let quarter = |turns: u8| {
        UnitQuaternion::new(Vector3::z() * std::f64::consts::FRAC_PI_2 * f64::from(turns))
    };
    // One orientation or four; and which of the contacts, if any, touches something else.
    for (trial, stray) in (0..16).zip([9, 0, 1, 2].into_iter().cycle()) {
        let rotations: Vec<_> = (0..if trial < 8 { 1 } else { 4 }).map(quarter).collect();
        let mut library = ObjectLibrary::default();
        library.put(ObjectId(1), dotted(1));
        library.put(ObjectId(2), dotted(2));
        let offset = Vector3::new(3.0, -2.0, 0.1);
        let turn = rotations[rotations.len() - 1].inverse();
        let contacts: Vec<_> = [4u64, 1, 6]
            .iter()
            .zip(0..)
            .map(|(at, number)| {
                let (point, level) = dots(1, 7)[usize::try_from(*at).unwrap()];
                let noise = |k| noise_m * normal(7000 + 100 * trial + 10 * at + k);
                let noise = Vector3::new(noise(0), noise(1), noise(2));
                let far = Vector3::new(0.0, 0.03, 0.05) * f64::from(u8::from(number == stray));
                let at = turn * (point + noise + far) + offset;
                Contact::at(at, noise_m).with_level(0, level, 1.0)
            })
            .collect();
        let mut translations = GaussianSum::new(rotations.clone());
        for (count, contact) in contacts.iter().enumerate() {
            translations.touch(
                &library,
                &contacts[..count],
                contact,
                BTreeMap::new(),
                &|_| 0.0,
                None,
            );
            let contacts = &contacts[..=count];
            let found = |id: u32| {
                translations.variant_logs()[&VariantId {
                    object: ObjectId(id),
                    variant: Variant::Places,
                }]
            };
            let told = |id: u32| by_assignment(&library, id, &rotations, contacts);
            let (one, two) = (told(1), told(2));
            let best = one.max(two);
            for (own, id) in [(one, 1), (two, 2)] {
                let apart = found(id) - own;
                // Where an outlier is the most likely, a hypothesis does not part, and is a little
                // off after that.
                let most = if stray > 2 && id == 1 { 0.15 } else { 0.4 };
                // What hardly explains the contacts is dropped some day, but never overrated.
                let about = format!("{trial} {count} {id}: {} {one} {two}", found(id));
                assert!(apart < most || found(id) < best - 8.0, "{about}");
                assert!(apart > -most || own < best - 2.0, "{about}");
            }
        }
    }
}

/// Log evidence of a map: over all rotations and all ways to take each contact for a place or an
/// outlier, the integral over translations, which is a product of Gaussians.
fn by_assignment(
    library: &ObjectLibrary,
    id: u32,
    rotations: &[UnitQuaternion<f64>],
    contacts: &[Contact],
) -> f64 {
    let indexed = library.indexed(ObjectId(id)).unwrap();
    let count = indexed.places.len();
    let mut logs = Vec::new();
    let ways = (count + 1).pow(u32::try_from(contacts.len() - 1).unwrap());
    let firsts = (0..count).flat_map(|first| rotations.iter().map(move |turn| (first, turn)));
    let prior = -((count * rotations.len()) as f64).ln();
    for (first, turn) in firsts {
        for way in 0..ways {
            let mut rest = way;
            // The translation's Gaussian: mean and variance, begun by the first contact.
            let place = &indexed.places[first];
            let mut mean = place.position - turn * contacts[0].position_m;
            let mut variance = place.variance_m2 + contacts[0].variance_m2();
            let mut log = place.percept_log(&contacts[0], library.level_prior()) + prior;
            for contact in &contacts[1..] {
                let at = rest % (count + 1);
                rest /= count + 1;
                if at == count {
                    log += (0.02 * library.clutter_per_m3()).ln();
                    continue;
                }
                let place = &indexed.places[at];
                let apart = place.position - turn * contact.position_m - mean;
                let noise = place.variance_m2 + contact.variance_m2();
                let sum = variance + noise;
                log += place.percept_log(contact, library.level_prior()) + 0.98_f64.ln()
                    - (count as f64).ln()
                    - 0.5 * apart.norm_squared() / sum
                    - 1.5 * (std::f64::consts::TAU * sum).ln();
                mean += apart * (variance / sum);
                variance = variance * noise / sum;
            }
            logs.push(log);
        }
    }
    log_sum(logs.iter().copied())
}

#[test]
fn the_order_of_contacts_hardly_matters() {
    let mut library = ObjectLibrary::default();
    for key in 1..6 {
        library.put(ObjectId(u32::try_from(key).unwrap()), dotted(key));
    }
    let mut contacts: Vec<_> = dots(3, 7)
        .into_iter()
        .map(|(point, level)| Contact::at(point, 0.004).with_level(0, level, 0.5))
        .collect();
    let candidate = |contacts: &[Contact]| {
        let mut recognition = Recognition::new(&Orientation::Known);
        for contact in contacts {
            recognition.touch(&library, contact.clone());
        }
        recognition.posterior(&library)
    };
    let forth = candidate(&contacts[..4]);
    contacts[..4].reverse();
    let back = candidate(&contacts[..4]);
    assert_eq!(forth.verdict(), Verdict::Object(ObjectId(3)), "{forth:?}");
    // How far a stranger may be from the contact before is another matter than which object it is.
    let among = |candidate: &Posterior| candidate.objects[0].1 / (1.0 - candidate.unknown);
    assert_eq!(forth.objects[0].0, back.objects[0].0);
    assert!(
        (among(&forth) - among(&back)).abs() < 0.01,
        "{forth:?} {back:?}"
    );
}

#[test]
fn a_model_stays_within_its_budget_and_keeps_its_extent() {
    let settings = ModelSettings {
        spacing_m: 0.002,
        places_max: 100,
    };
    let mut model = ObjectModel::new(settings);
    for key in 0..3000 {
        model.learn(&touch(BOX(key), &Isometry3::identity(), key));
        assert!(model.places().len() <= 100);
    }
    assert!(model.spacing_m() > 0.002);
    assert!(model.places().len() > 20);
    let count: f64 = model.places().iter().map(|place| place.count).sum();
    assert!((count - 3000.0).abs() < 1e-6);
    let high = model
        .places()
        .iter()
        .map(|place| place.position_m.z)
        .fold(0.0, f64::max);
    assert!((high - 0.07).abs() < 0.01, "{high}");
    let again = ObjectModel::with_places(settings, model.spacing_m(), model.places().to_vec());
    assert_eq!(again.places(), model.places());
}

#[test]
fn numbers_of_any_size_stop_nothing() {
    let pick = |list: &[f64], key: u64| {
        let at = (uniform(key) * list.len() as f64).floor();
        let sign = if uniform(key + 1) < 0.5 { -1.0 } else { 1.0 };
        (
            list[(0..list.len()).find(|k| *k as f64 >= at).unwrap_or(0)],
            sign,
        )
    };
    let metres = [0.0, 1e-300, 1e-9, 0.01, 1.0, 1e3, 1e6];
    let levels = [0.0, 1e-300, 0.5, 1e10, 1e40, 1e300];
    let deviations = [0.0, 1e-300, 1e-3, 1.0, 1e6];
    let contact = |key: u64| {
        let value = |list: &[f64], key| {
            let (size, sign) = pick(list, key);
            size * sign
        };
        let point = Point3::new(
            value(&metres, key),
            value(&metres, key + 2),
            value(&metres, key + 4),
        );
        let mut contact = Contact::at(point, pick(&deviations, key + 6).0);
        if uniform(key + 8) < 0.7 {
            let (level, sd) = (value(&levels, key + 9), pick(&deviations, key + 11).0);
            contact = contact.with_level(0, level, sd);
        }
        if uniform(key + 13) < 0.5 {
            let (_, normal) = on_ball(1.0, key);
            contact = contact.with_normal(normal, pick(&deviations, key + 14).0);
        }
        contact.with_drift(pick(&deviations, key + 16).0)
    };
    for world in 0..60_u64 {
        let key = 1_000_000 * (world + 1);
        let mut library = ObjectLibrary::default();
        for object in 0..3 {
            let mut model = ObjectModel::new(ModelSettings::default());
            for touch in 0..=7 * u64::from(object) {
                model.learn(&contact(key + 10_000 * u64::from(object) + 40 * touch));
            }
            library.put(ObjectId(object), model);
        }
        for orientation in [Orientation::Free, Orientation::Known] {
            let mut recognition = Recognition::new(&orientation);
            for touch in 0..14 {
                recognition.touch(&library, contact(key + 500_000 + 40 * touch));
                let posterior = recognition.posterior(&library);
                let sum = posterior.objects.iter().map(|object| object.1).sum::<f64>();
                let all = sum + posterior.unknown;
                assert!((all - 1.0).abs() < 1e-6, "{all} of world {world}");
                if let Some(next) = recognition.next_touch(&library) {
                    let point = next.point_m.coords;
                    assert!(next.gain_nats > 0.0, "{next:?} of world {world}");
                    assert!(point.norm() < 1e7, "{next:?} of world {world}");
                }
            }
        }
    }
}
