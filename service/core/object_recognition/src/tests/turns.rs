//! Objects that have turned, in one of a few ways or about the vertical.

use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use super::{dots, dotted};
use crate::{Contact, ObjectId, ObjectLibrary, Orientation, Recognition, Verdict};

#[test]
fn one_of_24_turns_is_found() {
    let mut library = ObjectLibrary::default();
    for key in 1..6 {
        library.put(ObjectId(u32::try_from(key).unwrap()), dotted(key));
    }
    let Orientation::Finite(turns) = Orientation::cube() else {
        panic!("the turns of a cube are 24")
    };
    assert_eq!(turns.len(), 24);
    for (number, turn) in turns.iter().enumerate() {
        // Each is another one.
        assert!(
            turns[..number]
                .iter()
                .all(|other| other.angle_to(turn) > 1.0)
        );
        let map_from_episode = Isometry3::from_parts(Translation3::new(-40.0, 3.0, 7.0), *turn);
        let mut recognition = Recognition::new(&Orientation::cube());
        for (point, level) in dots(4, 6) {
            let at = map_from_episode.inverse() * point;
            recognition.touch(&library, Contact::at(at, 0.001).with_level(0, level, 0.3));
        }
        let posterior = recognition.posterior(&library);
        assert_eq!(
            posterior.verdict(),
            Verdict::Object(ObjectId(4)),
            "{posterior:?}"
        );
        let pose = posterior.pose.unwrap().map_from_episode;
        assert!(pose.rotation.angle_to(turn) < 1e-6);
        assert!((pose.translation.vector - map_from_episode.translation.vector).norm() < 0.003);
    }
}

#[test]
fn a_turn_about_the_vertical_is_found() {
    let mut library = ObjectLibrary::default();
    for key in 1..6 {
        library.put(ObjectId(u32::try_from(key).unwrap()), dotted(key));
    }
    // Both signs, none, a half turn, and halfway between two hypotheses.
    for degrees in [0.0, 31.0, -77.0, 179.9, 180.0, 3601.0_f64] {
        let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, degrees.to_radians());
        let map_from_episode = Isometry3::from_parts(Translation3::new(-0.4, 3.0, 0.7), turn);
        let mut recognition = Recognition::new(&Orientation::Yaw);
        for (point, level) in dots(4, 9) {
            let at = map_from_episode.inverse() * point;
            recognition.touch(&library, Contact::at(at, 0.001).with_level(0, level, 0.3));
        }
        let posterior = recognition.posterior(&library);
        assert_eq!(
            posterior.verdict(),
            Verdict::Object(ObjectId(4)),
            "{degrees}: {posterior:?}"
        );
        let found = posterior.pose.unwrap();
        let error = found.map_from_episode.inverse() * map_from_episode;
        let sd_rad = found.covariance.matrix()[(5, 5)].sqrt();
        assert!((0.009..0.011).contains(&sd_rad), "{sd_rad}");
        assert!(error.rotation.angle() < 2.0 * sd_rad, "{degrees}: {error}");
        // Where the contacts are, and not only where their frame begins.
        let at = map_from_episode.inverse() * dots(4, 1)[0].0;
        assert!((error * at - at).norm() < 0.01, "{degrees}: {error}");
    }
}
