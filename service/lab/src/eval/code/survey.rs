//! A map full of places.

use cognitive_map::{
    AgentId, CognitiveMap, InvalidSample, Label, Motion, PoseNoise, Record, Sample, SampleBody,
    Settings, StartPose,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Edge of the cube that has room for one place on average, in field radii: eight places per cubic
/// metre with a radius of 0.25 m, so that a million fill a cube of 50 m.
const EDGE_PER_PLACE: f64 = 2.0;
/// No rotation.
const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// A map of so many places all over a cube around the origin, at a density that does not depend on
/// their number. With settings that recruit by novelty, no two are closer than a field radius. More
/// places than the settings' budget are recruited, but not all kept.
///
/// # Errors
/// None; the samples that it makes are valid.
pub fn survey(places: u64, settings: Settings, seed: u64) -> Result<CognitiveMap, InvalidSample> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let edge_m = EDGE_PER_PLACE * settings.field_radius_m * (places as f64).cbrt();
    let still = Motion::from_increment([0.0; 3], UPRIGHT, None)?;
    let mut map = CognitiveMap::new(settings);
    let (agent, mut seq) = (AgentId(0), 0);
    let mut events = Vec::new();
    let name = Label::new("surveyor")?;
    map.apply(&Record::Enrol { agent, name }, &mut events);
    while (map.places_recruited() as u64) < places {
        let position = [(); 3].map(|()| (random.random::<f64>() - 0.5) * edge_m);
        let put = StartPose::new(position, UPRIGHT, PoseNoise::none())?;
        for body in [SampleBody::StartPose(put), SampleBody::Motion(still)] {
            let stamp_ns = i64::try_from(seq).unwrap_or(i64::MAX);
            let sample = Sample { stamp_ns, body };
            let record = Record::Sample {
                agent,
                session: 1,
                seq,
                sample,
            };
            map.apply(&record, &mut events);
            seq += 1;
        }
        events.clear();
    }
    Ok(map)
}
