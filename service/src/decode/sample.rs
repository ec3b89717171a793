//! Samples.

use cogmap_proto as wire;
use cognitive_map::{
    InvalidSample, Label, Level, Marker, PoseNoise, Sample, SampleBody, Sighting, StartPose,
};

use super::contact::object_mark;
use super::motion::{increment, noise, velocity};
use super::name::check_name;
use super::percept::descriptor;
use super::sighting::{relation, target};

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
