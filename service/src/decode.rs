//! From wire samples to samples that make sense: the only place that refuses them.

use cogmap_proto as wire;
use cognitive_map::{
    Descriptor, InvalidSample, Label, Level, Marker, Motion, PoseNoise, RangeBearing, Relation,
    RelativePose, RelativePosition, Sample, SampleBody, Sighting, StartPose, Target,
};

/// Reads one sample.
///
/// # Errors
/// Says why the sample makes no sense.
pub fn sample(sample: &wire::Sample) -> Result<Sample, InvalidSample> {
    let body = match &sample.body {
        wire::SampleBody::Increment(increment) => SampleBody::Motion(Motion::from_increment(
            increment.translation_m,
            increment.rotation_xyzw,
            noise(increment.noise)?,
        )?),
        wire::SampleBody::Velocity(velocity) => SampleBody::Motion(Motion::from_velocity(
            velocity.linear_m_s,
            velocity.angular_rad_s,
            velocity.duration_s,
            noise(velocity.noise)?,
        )?),
        wire::SampleBody::Level(level) => SampleBody::Level(Level::new(
            Label::new(&level.channel)?,
            level.value,
            level.offset_m,
            level.normal,
        )?),
        wire::SampleBody::Descriptor(descriptor) => SampleBody::Descriptor(Descriptor::new(
            Label::new(&descriptor.channel)?,
            &descriptor.vector,
        )?),
        wire::SampleBody::Sighting(sighting) => SampleBody::Sighting(Sighting {
            target: target(&sighting.target)?,
            relation: relation(&sighting.relation)?,
        }),
        wire::SampleBody::StartPose(start) => SampleBody::StartPose(StartPose::new(
            start.translation_m,
            start.rotation_xyzw,
            noise(start.noise)?.unwrap_or_else(PoseNoise::none),
        )?),
        wire::SampleBody::Marker(marker) => SampleBody::Marker(Marker {
            label: Label::new(&marker.label)?,
            ends_trip: marker.ends_trip,
        }),
    };
    Ok(Sample {
        stamp_ns: sample.stamp_ns,
        body,
    })
}

fn noise(noise: Option<wire::MotionNoise>) -> Result<Option<PoseNoise>, InvalidSample> {
    noise
        .map(|noise| PoseNoise::new(noise.translation_sd_m, noise.rotation_sd_rad))
        .transpose()
}

fn target(target: &wire::Target) -> Result<Target, InvalidSample> {
    Ok(match target {
        wire::Target::Landmark(label) => Target::Landmark(Label::new(label)?),
        wire::Target::Agent(name) => Target::Agent(Label::new(name)?),
        wire::Target::OwnSample(seq) => Target::OwnSample(*seq),
    })
}

fn relation(relation: &wire::Relation) -> Result<Relation, InvalidSample> {
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
    })
}
