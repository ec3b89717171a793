//! From wire samples to samples that make sense: the only place that refuses them. Questions that hold
//! a motion or a percept are read by the same rules.

pub(crate) mod fault;
mod trajectory;

pub use trajectory::stamped_pose;

use cogmap_proto as wire;
use cogmap_proto::limits::ROTATIONS_MAX;
use cognitive_map::{
    Descriptor, InvalidSample, Label, Level, Marker, Motion, ObjectMark, PerceptCue, PoseNoise,
    RangeBearing, Relation, RelativePose, RelativePosition, Sample, SampleBody, Sighting, Spacing,
    StartPose, Target, Touch, TouchLevel, TouchNoise,
};
use object_recognition::{Orientation, Reached};

/// Reads one sample that has just come.
///
/// # Errors
/// Says why the sample makes no sense.
pub fn sample(sample: &wire::Sample) -> Result<Sample, InvalidSample> {
    match &sample.body {
        wire::SampleBody::Level(level) => check_name(&level.channel)?,
        wire::SampleBody::Descriptor(descriptor) => check_name(&descriptor.channel)?,
        wire::SampleBody::Sighting(sighting) => {
            if let wire::Target::Agent(name) = &sighting.target {
                check_name(name)?;
            }
        }
        _ => {}
    }
    journaled_sample(sample)
}

/// Reads one sample of the journal: as [`sample`], but for names, which older versions took in more
/// forms.
///
/// # Errors
/// Says why the sample makes no sense.
pub fn journaled_sample(sample: &wire::Sample) -> Result<Sample, InvalidSample> {
    let body = match &sample.body {
        wire::SampleBody::Increment(body) => SampleBody::Motion(increment(body)?),
        wire::SampleBody::Velocity(body) => SampleBody::Motion(velocity(body)?),
        wire::SampleBody::Level(level) => SampleBody::Level(Level::new(
            Label::new(&level.channel)?,
            level.value,
            level.offset_m,
            level.normal,
        )?),
        wire::SampleBody::Descriptor(body) => SampleBody::Descriptor(descriptor(body)?),
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
        wire::SampleBody::Object(mark) => SampleBody::Object(object_mark(mark)?),
        wire::SampleBody::SessionEnd {} => SampleBody::SessionEnd,
    };
    Ok(Sample {
        stamp_ns: sample.stamp_ns,
        body,
    })
}

/// Reads a motion that is asked about.
///
/// # Errors
/// Says why it makes no sense.
pub fn motion(motion: &wire::MotionBody) -> Result<Motion, InvalidSample> {
    match motion {
        wire::MotionBody::Increment(body) => increment(body),
        wire::MotionBody::Velocity(body) => velocity(body),
    }
}

/// Checks the name of a channel or an agent.
fn check_name(name: &str) -> Result<(), InvalidSample> {
    wire::Name::check(name).map_err(|_| InvalidSample::InvalidLabel)
}

/// Checks the names of channels of contacts that have just come.
///
/// # Errors
/// Says which contact names none, by its place in the list.
pub fn check_channels(contacts: &[wire::Contact]) -> Result<(), (usize, InvalidSample)> {
    for (at, contact) in contacts.iter().enumerate() {
        let levels = contact.levels.iter().map(|level| &level.channel);
        let descriptors = contact.descriptors.iter().map(|seen| &seen.channel);
        for channel in levels.chain(descriptors) {
            check_name(channel).map_err(|error| (at, error))?;
        }
    }
    Ok(())
}

/// Reads a percept that is a cue.
///
/// # Errors
/// Says why it makes no sense.
pub fn percept(cue: &wire::PerceptCue) -> Result<PerceptCue, InvalidSample> {
    Ok(match cue {
        wire::PerceptCue::Level(level) => {
            let channel = Label::new(&level.channel)?;
            let value = level.value;
            if !value.is_finite() {
                return Err(InvalidSample::NumberOutOfRange);
            }
            PerceptCue::Level { channel, value }
        }
        wire::PerceptCue::Descriptor(body) => PerceptCue::Descriptor(descriptor(body)?),
    })
}

fn object_mark(mark: &wire::ObjectMark) -> Result<ObjectMark, InvalidSample> {
    Ok(match mark {
        wire::ObjectMark::Learn {
            name,
            spacing_m,
            orientation: turned,
            noise,
        } => ObjectMark::Learn {
            name: name.as_deref().map(object_name).transpose()?,
            spacing: spacing(*spacing_m)?,
            orientation: orientation(turned)?,
            noise: touch_noise(noise)?,
        },
        wire::ObjectMark::Identify {
            orientation: turned,
            noise,
        } => ObjectMark::Identify {
            orientation: orientation(turned)?,
            noise: touch_noise(noise)?,
        },
        wire::ObjectMark::End {} => ObjectMark::End,
    })
}

/// Reads the name of an object. None is called as the question is asked, since its address would be that question's.
///
/// # Errors
/// Nothing can be called so.
fn object_name(name: &str) -> Result<Label, InvalidSample> {
    if name == "identify" {
        return Err(InvalidSample::InvalidLabel);
    }
    Label::new(name)
}

/// Reads how far apart the places of an object are \[m\].
///
/// # Errors
/// It is out of range.
pub fn spacing(spacing_m: f64) -> Result<Spacing, InvalidSample> {
    Spacing::new(spacing_m)
}

/// Reads how exactly is felt.
///
/// # Errors
/// A deviation is negative or out of range.
pub fn touch_noise(noise: &wire::TouchNoise) -> Result<TouchNoise, InvalidSample> {
    TouchNoise::new(noise.position_sd_m, noise.normal_sd_rad, noise.level_sd)
}

/// Reads how a frame may be turned.
///
/// # Errors
/// A rotation is not a unit quaternion, or there are none or too many.
pub fn orientation(orientation: &wire::Orientation) -> Result<Orientation, InvalidSample> {
    Ok(match orientation {
        wire::Orientation::Known {} => Orientation::Known,
        wire::Orientation::Cube {} => Orientation::cube(),
        wire::Orientation::Free {} => Orientation::Free,
        wire::Orientation::Finite { rotations_xyzw } => {
            if !(1..=ROTATIONS_MAX).contains(&rotations_xyzw.len()) {
                return Err(InvalidSample::NumberOutOfRange);
            }
            let rotations = rotations_xyzw.iter().map(|xyzw| {
                let pose = StartPose::new([0.0; 3], *xyzw, PoseNoise::none())?;
                Ok(pose.pose().rotation)
            });
            Orientation::Finite(rotations.collect::<Result<_, _>>()?)
        }
    })
}

/// Reads contacts.
///
/// # Errors
/// Says which contact makes no sense, by its place in the list, and why.
pub fn touches(
    contacts: &[wire::Contact],
    noise: TouchNoise,
) -> Result<Vec<Touch>, (usize, InvalidSample)> {
    let touches = contacts.iter().enumerate();
    touches
        .map(|(at, contact)| touch(contact, noise).map_err(|error| (at, error)))
        .collect()
}

fn touch(contact: &wire::Contact, noise: TouchNoise) -> Result<Touch, InvalidSample> {
    let levels = contact
        .levels
        .iter()
        .map(|level| TouchLevel::new(Label::new(&level.channel)?, level.value, noise.level_sd()));
    let levels: Vec<_> = levels.collect::<Result<_, _>>()?;
    let descriptors: Vec<_> = { contact.descriptors.iter() }
        .map(descriptor)
        .collect::<Result<_, _>>()?;
    let mut touch = Touch::new(contact.position_m, noise)?
        .with_levels(levels)
        .with_descriptors(descriptors)
        .with_drift(contact.drift_sd_m)?;
    if let Some(normal) = contact.normal {
        touch = touch.with_normal(normal)?;
    }
    Ok(touch.reached(match contact.reached {
        wire::Reached::Found => Reached::Found,
        wire::Reached::Aimed => Reached::Aimed,
        wire::Reached::Drawn => Reached::Drawn,
    }))
}

fn increment(body: &wire::Increment) -> Result<Motion, InvalidSample> {
    let noise = noise(body.noise)?;
    Motion::from_increment(body.translation_m, body.rotation_xyzw, noise)
}

fn velocity(body: &wire::Velocity) -> Result<Motion, InvalidSample> {
    Motion::from_velocity(
        body.linear_m_s,
        body.angular_rad_s,
        body.duration_s,
        noise(body.noise)?,
    )
}

fn descriptor(body: &wire::Descriptor) -> Result<Descriptor, InvalidSample> {
    Descriptor::new(Label::new(&body.channel)?, &body.vector)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_channels_are_checked_on_arrival_and_read_from_old_journals_as_they_are() {
        let felt = |channel: &str| wire::Sample {
            stamp_ns: 0,
            body: wire::SampleBody::Level(wire::Level {
                channel: channel.to_owned(),
                value: 1.0,
                offset_m: [0.0; 3],
                normal: None,
            }),
        };
        for name in ["my channel!", "-x", &"a".repeat(65)] {
            let refused = sample(&felt(name)).expect_err("no name");
            assert_eq!(refused, InvalidSample::InvalidLabel, "{name}");
            assert!(journaled_sample(&felt(name)).is_ok(), "{name}");
        }
        assert!(sample(&felt("touch-1.left_hand")).is_ok());
        assert!(journaled_sample(&felt("")).is_err());
    }
}
