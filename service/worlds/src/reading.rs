//! Readings: what a sensor gives, in plain numbers, before anything has judged them.

use cognitive_map::{
    Descriptor, InvalidSample, Label, Level, Motion, ObjectMark, PoseNoise, RangeBearing, Relation,
    Sample, SampleBody, Sighting, Spacing, StartPose, Target, TouchNoise,
};
use object_recognition::Orientation;

/// One reading of one robot.
///
/// Plain numbers, so that a stream can become samples of the core ([`Sample`], by `TryFrom`) as
/// well as messages on a wire.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    /// Time on the robot's clock \[ns\]; for a motion, its end.
    pub stamp_ns: i64,
    /// What was read.
    pub body: ReadingBody,
}

/// What a reading says.
#[derive(Clone, Debug, PartialEq)]
pub enum ReadingBody {
    /// A body twist held for a time that ends at the stamp.
    Velocity {
        /// Velocity in the body frame \[m/s\].
        linear_m_s: [f64; 3],
        /// Angular velocity in the body frame \[rad/s\].
        angular_rad_s: [f64; 3],
        /// How long it was held \[s\].
        duration_s: f64,
        /// Standard deviations of the displacement: translation \[m\] and rotation \[rad\].
        noise: Option<([f64; 3], [f64; 3])>,
    },
    /// A target seen at a distance and in a direction.
    Sighting {
        /// What was seen.
        target: ReadingTarget,
        /// Distance \[m\].
        range_m: f64,
        /// Direction in the body's x-y plane, left positive \[rad\].
        azimuth_rad: f64,
        /// Direction above that plane \[rad\].
        elevation_rad: f64,
        /// Standard deviation of the distance \[m\].
        range_sd_m: f64,
        /// Standard deviation of either direction \[rad\].
        bearing_sd_rad: f64,
    },
    /// Where the robot stands in `map`, exactly.
    StartPose {
        /// Position \[m\].
        translation_m: [f64; 3],
        /// Orientation as a unit quaternion `[x, y, z, w]`.
        rotation_xyzw: [f64; 4],
    },
    /// A scalar felt on a channel, at the body's origin.
    Level {
        /// Channel.
        channel: String,
        /// Value, in the channel's unit.
        value: f64,
    },
    /// A scalar felt by a finger that touches something.
    Contact {
        /// Channel.
        channel: String,
        /// Value, in the channel's unit.
        value: f64,
        /// Where the finger touches, in the body frame \[m\].
        offset_m: [f64; 3],
        /// Out of the surface, in the body frame.
        normal: [f64; 3],
    },
    /// What is touched from here on.
    Object(ReadingMark),
    /// A view on a channel, from the body's origin.
    Descriptor {
        /// Channel.
        channel: String,
        /// The vector, of any length but zero.
        vector: Vec<f32>,
    },
}

/// What an arm says of what it touches. The object may be turned in any way.
#[derive(Clone, Debug, PartialEq)]
pub enum ReadingMark {
    /// It is an object of a name, to be learned.
    Learn {
        /// The name.
        name: String,
        /// Contacts within this distance \[m\] are of one place.
        spacing_m: f64,
        /// How exactly is felt.
        noise: ReadingNoise,
    },
    /// It is to be recognised.
    Identify {
        /// How exactly is felt.
        noise: ReadingNoise,
    },
    /// Nothing more is touched.
    End,
}

/// How exactly an arm feels: standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReadingNoise {
    /// Of a contact's position along each axis \[m\].
    pub position_sd_m: f64,
    /// Of a normal about each axis \[rad\].
    pub normal_sd_rad: f64,
    /// Of a level, in its channel's unit.
    pub level_sd: f64,
}

/// What a sighting is of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReadingTarget {
    /// A landmark, by label.
    Landmark(String),
    /// Another robot, by name.
    Robot(String),
}

/// The name of a robot by its number: `robot1`, `robot2`, ...
pub fn robot_name(number: u32) -> String {
    format!("robot{number}")
}

impl TryFrom<&Reading> for Sample {
    type Error = InvalidSample;

    fn try_from(reading: &Reading) -> Result<Self, InvalidSample> {
        Ok(Self {
            stamp_ns: reading.stamp_ns,
            body: body(&reading.body)?,
        })
    }
}

/// The body of a sample, or why the core refuses it.
fn body(body: &ReadingBody) -> Result<SampleBody, InvalidSample> {
    Ok(match body {
        ReadingBody::Velocity {
            linear_m_s,
            angular_rad_s,
            duration_s,
            noise,
        } => {
            let noise = noise
                .map(|(translation_sd_m, rotation_sd_rad)| {
                    PoseNoise::new(translation_sd_m, rotation_sd_rad)
                })
                .transpose()?;
            SampleBody::Motion(Motion::from_velocity(
                *linear_m_s,
                *angular_rad_s,
                *duration_s,
                noise,
            )?)
        }
        ReadingBody::Sighting {
            target,
            range_m,
            azimuth_rad,
            elevation_rad,
            range_sd_m,
            bearing_sd_rad,
        } => SampleBody::Sighting(Sighting {
            target: target_of(target)?,
            relation: Relation::RangeBearing(RangeBearing::new(
                *range_m,
                *azimuth_rad,
                *elevation_rad,
                *range_sd_m,
                *bearing_sd_rad,
            )?),
        }),
        ReadingBody::StartPose {
            translation_m,
            rotation_xyzw,
        } => SampleBody::StartPose(StartPose::new(
            *translation_m,
            *rotation_xyzw,
            PoseNoise::none(),
        )?),
        ReadingBody::Level { channel, value } => level(channel, *value, [0.0; 3], None)?,
        ReadingBody::Contact {
            channel,
            value,
            offset_m,
            normal,
        } => level(channel, *value, *offset_m, Some(*normal))?,
        ReadingBody::Object(mark) => SampleBody::Object(object_mark(mark)?),
        ReadingBody::Descriptor { channel, vector } => {
            SampleBody::Descriptor(Descriptor::new(Label::new(channel)?, vector)?)
        }
    })
}

fn target_of(target: &ReadingTarget) -> Result<Target, InvalidSample> {
    Ok(match target {
        ReadingTarget::Landmark(label) => Target::Landmark(Label::new(label)?),
        ReadingTarget::Robot(name) => Target::Agent(Label::new(name)?),
    })
}

fn level(
    channel: &str,
    value: f64,
    offset_m: [f64; 3],
    normal: Option<[f64; 3]>,
) -> Result<SampleBody, InvalidSample> {
    let level = Level::new(Label::new(channel)?, value, offset_m, normal)?;
    Ok(SampleBody::Level(level))
}

fn object_mark(mark: &ReadingMark) -> Result<ObjectMark, InvalidSample> {
    let core = |noise: &ReadingNoise| {
        TouchNoise::new(noise.position_sd_m, noise.normal_sd_rad, noise.level_sd)
    };
    Ok(match mark {
        ReadingMark::Learn {
            name,
            spacing_m,
            noise,
        } => ObjectMark::Learn {
            name: Some(Label::new(name)?),
            spacing: Spacing::new(*spacing_m)?,
            orientation: Orientation::Free,
            noise: core(noise)?,
        },
        ReadingMark::Identify { noise } => ObjectMark::Identify {
            orientation: Orientation::Free,
            noise: core(noise)?,
            learns: true,
        },
        ReadingMark::End => ObjectMark::End,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(body: ReadingBody) -> Result<Sample, InvalidSample> {
        Sample::try_from(&Reading { stamp_ns: 5, body })
    }

    #[test]
    fn a_velocity_becomes_the_motion_over_its_duration() {
        let velocity = ReadingBody::Velocity {
            linear_m_s: [2.0, 0.0, 0.0],
            angular_rad_s: [0.0, 0.0, std::f64::consts::PI],
            duration_s: 0.5,
            noise: Some(([0.1, 0.2, 0.3], [0.4, 0.5, 0.6])),
        };
        let sample = sample(velocity).unwrap();
        assert_eq!(sample.stamp_ns, 5);
        let SampleBody::Motion(motion) = sample.body else {
            panic!("not a motion")
        };
        // A quarter of a circle to the left, of radius 2/π.
        let radius = 2.0 / std::f64::consts::PI;
        let expected = nalgebra::Vector3::new(radius, radius, 0.0);
        assert!((motion.increment().translation.vector - expected).norm() < 1e-12);
        assert_eq!(
            motion.noise().unwrap().sd().as_slice(),
            [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
        );
    }

    #[test]
    fn a_sighting_keeps_its_target_and_numbers() {
        for (target, expected) in [
            (
                ReadingTarget::Landmark("a".into()),
                Target::Landmark(Label::new("a").unwrap()),
            ),
            (
                ReadingTarget::Robot(robot_name(2)),
                Target::Agent(Label::new("robot2").unwrap()),
            ),
        ] {
            let sighting = ReadingBody::Sighting {
                target,
                range_m: 3.0,
                azimuth_rad: -0.2,
                elevation_rad: 0.1,
                range_sd_m: 0.15,
                bearing_sd_rad: 0.025,
            };
            let SampleBody::Sighting(sighting) = sample(sighting).unwrap().body else {
                panic!("not a sighting")
            };
            assert_eq!(sighting.target, expected);
            let relation = RangeBearing::new(3.0, -0.2, 0.1, 0.15, 0.025).unwrap();
            assert_eq!(sighting.relation, Relation::RangeBearing(relation));
        }
    }

    #[test]
    fn what_the_core_refuses_is_an_error() {
        let level = ReadingBody::Level {
            channel: String::new(),
            value: 1.0,
        };
        assert_eq!(sample(level), Err(InvalidSample::InvalidLabel));
        let start = ReadingBody::StartPose {
            translation_m: [0.0; 3],
            rotation_xyzw: [0.0, 0.0, 0.0, 2.0],
        };
        assert_eq!(sample(start), Err(InvalidSample::NonUnitQuaternion));
        let level = ReadingBody::Level {
            channel: "light".into(),
            value: 0.5,
        };
        assert!(matches!(
            sample(level).unwrap().body,
            SampleBody::Level(l) if l.value().to_bits() == 0.5_f64.to_bits()
        ));
    }
}
