//! Readings as samples of the wire.

use crate::reading::{Reading, ReadingBody, ReadingMark, ReadingNoise, ReadingTarget};
use cogmap_proto::{
    Descriptor, Level, MotionNoise, ObjectMark, Orientation, Relation, Sample, SampleBody,
    Sighting, StartPose, Target, TouchNoise, Velocity,
};

impl From<&Reading> for Sample {
    /// The sample that a robot would send for a reading.
    fn from(reading: &Reading) -> Self {
        let body = match &reading.body {
            ReadingBody::Velocity {
                linear_m_s,
                angular_rad_s,
                duration_s,
                noise,
            } => SampleBody::Velocity(Velocity {
                linear_m_s: *linear_m_s,
                angular_rad_s: *angular_rad_s,
                duration_s: *duration_s,
                noise: noise.map(|(translation_sd_m, rotation_sd_rad)| MotionNoise {
                    translation_sd_m,
                    rotation_sd_rad,
                }),
            }),
            ReadingBody::Sighting {
                target,
                range_m,
                azimuth_rad,
                elevation_rad,
                range_sd_m,
                bearing_sd_rad,
            } => SampleBody::Sighting(Sighting {
                target: target.into(),
                relation: Relation::RangeBearing {
                    range_m: *range_m,
                    azimuth_rad: *azimuth_rad,
                    elevation_rad: *elevation_rad,
                    range_sd_m: *range_sd_m,
                    bearing_sd_rad: *bearing_sd_rad,
                },
            }),
            ReadingBody::StartPose {
                translation_m,
                rotation_xyzw,
            } => SampleBody::StartPose(StartPose {
                translation_m: *translation_m,
                rotation_xyzw: *rotation_xyzw,
                noise: None,
            }),
            ReadingBody::Level { channel, value } => level(channel, *value, [0.0; 3], None),
            ReadingBody::Contact {
                channel,
                value,
                offset_m,
                normal,
            } => level(channel, *value, *offset_m, Some(*normal)),
            ReadingBody::Object(mark) => SampleBody::Object(mark.into()),
            ReadingBody::Descriptor { channel, vector } => SampleBody::Descriptor(Descriptor {
                channel: channel.clone(),
                vector: vector.clone(),
            }),
        };
        Self {
            stamp_ns: reading.stamp_ns,
            body,
        }
    }
}

fn level(channel: &str, value: f64, offset_m: [f64; 3], normal: Option<[f64; 3]>) -> SampleBody {
    SampleBody::Level(Level {
        channel: channel.to_owned(),
        value,
        offset_m,
        normal,
    })
}

impl From<&ReadingTarget> for Target {
    fn from(target: &ReadingTarget) -> Self {
        match target {
            ReadingTarget::Landmark(label) => Self::Landmark(label.clone()),
            ReadingTarget::Robot(name) => Self::Agent(name.clone()),
        }
    }
}

impl From<&ReadingMark> for ObjectMark {
    fn from(mark: &ReadingMark) -> Self {
        let orientation = Orientation::Free {};
        match mark {
            ReadingMark::Learn {
                name,
                spacing_m,
                noise,
            } => Self::Learn {
                name: Some(name.clone()),
                spacing_m: *spacing_m,
                orientation,
                noise: noise.into(),
            },
            ReadingMark::Identify { noise } => Self::Identify {
                orientation,
                noise: noise.into(),
            },
            ReadingMark::End => Self::End {},
        }
    }
}

impl From<&ReadingNoise> for TouchNoise {
    fn from(noise: &ReadingNoise) -> Self {
        Self {
            position_sd_m: noise.position_sd_m,
            normal_sd_rad: noise.normal_sd_rad,
            level_sd: noise.level_sd,
        }
    }
}
