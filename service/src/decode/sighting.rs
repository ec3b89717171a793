//! Sightings: what was seen, and where from the robot.

use cogmap_proto as wire;
use cognitive_map::{
    InvalidSample, Label, PoseNoise, Range, RangeBearing, Relation, RelativePose, RelativePosition,
    Target,
};

pub(super) fn target(target: &wire::Target) -> Result<Target, InvalidSample> {
    Ok(match target {
        wire::Target::Landmark(label) => Target::Landmark(Label::new(label)?),
        wire::Target::Agent(name) => Target::Agent(Label::new(name)?),
        wire::Target::OwnSample(seq) => Target::OwnSample(*seq),
    })
}

pub(super) fn relation(relation: &wire::Relation) -> Result<Relation, InvalidSample> {
    Ok(match *relation {
        wire::Relation::Position {
            translation_m,
            sd_m,
        } => Relation::Position(RelativePosition::new(translation_m, sd_m)?),
        wire::Relation::RangeBearing {
            range_m,
            azimuth_rad,
            elevation_rad,
            range_sd_m,
            bearing_sd_rad,
        } => Relation::RangeBearing(RangeBearing::new(
            range_m,
            azimuth_rad,
            elevation_rad,
            range_sd_m,
            bearing_sd_rad,
        )?),
        wire::Relation::Pose {
            translation_m,
            rotation_xyzw,
            noise,
        } => {
            let noise = PoseNoise::new(noise.translation_sd_m, noise.rotation_sd_rad)?;
            Relation::Pose(RelativePose::new(translation_m, rotation_xyzw, noise)?)
        }
        wire::Relation::Range {
            range_m,
            range_sd_m,
            offset_m,
        } => Relation::Range(Range::new(range_m, range_sd_m, offset_m)?),
    })
}
