//! Landmarks.

use cogmap_proto as wire;
use cognitive_map::Landmark;

/// A landmark as the wire has it.
pub fn landmark(landmark: &Landmark) -> wire::Landmark {
    let c = landmark.covariance();
    wire::Landmark {
        id: landmark.label().as_str().to_owned(),
        translation_m: landmark.position().coords.into(),
        covariance: [
            c[(0, 0)],
            c[(0, 1)],
            c[(0, 2)],
            c[(1, 1)],
            c[(1, 2)],
            c[(2, 2)],
        ],
        sightings: landmark.sightings(),
        first_stamp_ns: landmark.first_stamp_ns(),
        last_stamp_ns: landmark.last_stamp_ns(),
    }
}
