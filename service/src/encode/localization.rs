//! Where samples were taken.

use cogmap_proto as wire;
use cognitive_map::{CognitiveMap, Guess, Localization};
use geometry::{PoseCovariance, upper_triangle};
use nalgebra::Isometry3;

use super::FRAME;
use super::agent::status;

/// Where samples were taken, as the wire has it.
pub fn localization(space: &str, map: &CognitiveMap, found: &Localization) -> wire::Localization {
    let Localization {
        status: known,
        pose: found_pose,
        since,
        guesses,
    } = found;
    wire::Localization {
        space: space.to_owned(),
        frame: FRAME.to_owned(),
        map_revision: map.revision(),
        status: status(*known),
        pose: found_pose
            .as_ref()
            .map(|(found, covariance)| pose(found, covariance)),
        found_after: since.map(|since| since as u64),
        hypotheses: guesses.iter().map(hypothesis).collect(),
    }
}

fn hypothesis(guess: &Guess) -> wire::LocalizationHypothesis {
    wire::LocalizationHypothesis {
        pose: pose(&guess.pose, &guess.covariance),
        probability: guess.probability,
        looks: guess.looks.into(),
    }
}

fn pose(pose: &Isometry3<f64>, covariance: &PoseCovariance) -> wire::LocalizedPose {
    wire::LocalizedPose {
        translation_m: pose.translation.vector.into(),
        rotation_xyzw: pose.rotation.coords.into(),
        covariance: upper_triangle(&covariance.in_map_axes(&pose.rotation)),
    }
}
