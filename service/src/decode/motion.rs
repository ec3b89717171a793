//! Motions, and how exact they are.

use cogmap_proto as wire;
use cognitive_map::{InvalidSample, Motion, PoseNoise};

/// Reads a motion that is asked about.
///
/// # Errors
/// Says why it makes no sense.
pub(super) fn motion(motion: &wire::MotionBody) -> Result<Motion, InvalidSample> {
    match motion {
        wire::MotionBody::Increment(body) => increment(body),
        wire::MotionBody::Velocity(body) => velocity(body),
    }
}

pub(super) fn increment(body: &wire::Increment) -> Result<Motion, InvalidSample> {
    let noise = noise(body.noise)?;
    Motion::from_increment(body.translation_m, body.rotation_xyzw, noise)
}

pub(super) fn velocity(body: &wire::Velocity) -> Result<Motion, InvalidSample> {
    Motion::from_velocity(
        body.linear_m_s,
        body.angular_rad_s,
        body.duration_s,
        noise(body.noise)?,
    )
}

pub(super) fn noise(noise: Option<wire::MotionNoise>) -> Result<Option<PoseNoise>, InvalidSample> {
    noise
        .map(|noise| PoseNoise::new(noise.translation_sd_m, noise.rotation_sd_rad))
        .transpose()
}
