//! Writing batches straight from the window, and how long a sample can become in a codec.

use cogmap_proto::limits::MESSAGE_BYTES_MAX;
use cogmap_proto::{Codec, Relation, Sample, SampleBody, Target};
use serde::{Serialize, Serializer};

/// Most bytes that the samples of one batch may have, which leaves room for its head.
pub(crate) const BATCH_BYTES_MAX: usize = MESSAGE_BYTES_MAX - 128;

/// [`cogmap_proto::SampleBatch`] on its way out: the same fields in the same order, but the
/// samples stay where they are, so that sending copies no descriptor.
#[derive(Serialize)]
#[serde(rename = "SampleBatch")]
struct BorrowedBatch<I: Iterator + Clone>
where
    I::Item: Serialize,
{
    session: u64,
    first_seq: u64,
    #[serde(serialize_with = "serialize_each")]
    samples: I,
}

fn serialize_each<I, S>(samples: &I, serializer: S) -> Result<S::Ok, S::Error>
where
    I: Iterator + Clone,
    I::Item: Serialize,
    S: Serializer,
{
    serializer.collect_seq(samples.clone())
}

/// Writes a batch.
pub(crate) fn encode<'a>(
    session: u64,
    first_seq: u64,
    samples: impl ExactSizeIterator<Item = &'a Sample> + Clone,
    codec: Codec,
) -> Vec<u8> {
    codec.encode(&BorrowedBatch {
        session,
        first_seq,
        samples,
    })
}

/// An upper bound of a sample's length in a codec \[bytes\], found without writing it.
///
/// Batches are cut by it, because the service refuses a message beyond
/// [`MESSAGE_BYTES_MAX`] whole, and would do so at every repetition.
pub(crate) fn bytes_max(sample: &Sample, codec: Codec) -> usize {
    let (texts, vector) = match &sample.body {
        SampleBody::Increment(_)
        | SampleBody::Velocity(_)
        | SampleBody::StartPose(_)
        | SampleBody::SessionEnd {} => (0, 0),
        SampleBody::Level(level) => (level.channel.len(), 0),
        SampleBody::Descriptor(descriptor) => (descriptor.channel.len(), descriptor.vector.len()),
        SampleBody::Sighting(sighting) => match (&sighting.target, &sighting.relation) {
            (
                Target::Landmark(label) | Target::Agent(label),
                Relation::Position { .. }
                | Relation::RangeBearing { .. }
                | Relation::Pose { .. }
                | Relation::Range { .. },
            ) => (label.len(), 0),
            (Target::OwnSample(_), _) => (0, 0),
        },
        SampleBody::Marker(marker) => (marker.label.len(), 0),
        SampleBody::Object(mark) => {
            let (name, rotations) = mark.lengths();
            // Four numbers each, twice as long as those of a vector, and their brackets.
            (name, rotations * 9)
        }
    };
    // Numbers, field names and lengths of the longest kind; then one character, one number.
    let (fixed, character, number) = match codec {
        Codec::Postcard => (144, 1, 4),
        Codec::Cbor => (512, 1, 5),
        // A control character is escaped with six; an f32 has at most 16 characters and a comma.
        Codec::Json => (1024, 6, 17),
    };
    fixed + character * texts + number * vector
}

/// Whether the codec carries the sample at all: JSON has no NaN and no infinity, and one such
/// number would make its whole batch unreadable, at every repetition.
pub(crate) fn is_carried(sample: &Sample, codec: Codec) -> bool {
    codec != Codec::Json || codec.decode::<Sample>(&codec.encode(sample)).is_ok()
}

#[cfg(test)]
mod tests {
    use super::{bytes_max, encode, is_carried};
    use cogmap_proto::{
        Codec, Descriptor, Increment, Level, Marker, MotionNoise, ObjectMark, Orientation,
        Relation, Sample, SampleBatch, SampleBody, Sighting, StartPose, Target, TouchNoise,
        Velocity,
    };

    const CODECS: [Codec; 3] = [Codec::Postcard, Codec::Cbor, Codec::Json];
    /// A number whose text is as long as an f64's can be.
    const LONG: f64 = -1.234_567_890_123_456_7e-208;
    const NOISE: MotionNoise = MotionNoise {
        translation_sd_m: [LONG; 3],
        rotation_sd_rad: [LONG; 3],
    };

    #[expect(clippy::too_many_lines, reason = "a list: a sample of each kind")]
    fn longest_of_each_kind() -> Vec<Sample> {
        let text = "\u{1}".repeat(200);
        [
            SampleBody::Increment(Increment {
                translation_m: [LONG; 3],
                rotation_xyzw: [LONG; 4],
                noise: Some(NOISE),
            }),
            SampleBody::Velocity(Velocity {
                linear_m_s: [LONG; 3],
                angular_rad_s: [LONG; 3],
                duration_s: LONG,
                noise: Some(NOISE),
            }),
            SampleBody::Level(Level {
                channel: text.clone(),
                value: LONG,
                offset_m: [LONG; 3],
                normal: Some([LONG; 3]),
            }),
            SampleBody::Descriptor(Descriptor {
                channel: text.clone(),
                vector: vec![-1.175_494_4e-38; 4096],
            }),
            SampleBody::Sighting(Sighting {
                target: Target::Landmark(text.clone()),
                relation: Relation::Pose {
                    translation_m: [LONG; 3],
                    rotation_xyzw: [LONG; 4],
                    noise: NOISE,
                },
            }),
            SampleBody::Sighting(Sighting {
                target: Target::OwnSample(u64::MAX),
                relation: Relation::RangeBearing {
                    range_m: LONG,
                    azimuth_rad: LONG,
                    elevation_rad: LONG,
                    range_sd_m: LONG,
                    bearing_sd_rad: LONG,
                },
            }),
            SampleBody::StartPose(StartPose {
                translation_m: [LONG; 3],
                rotation_xyzw: [LONG; 4],
                noise: Some(NOISE),
            }),
            SampleBody::Object(ObjectMark::Learn {
                name: Some(text.clone()),
                spacing_m: LONG,
                orientation: Orientation::Finite {
                    rotations_xyzw: vec![[LONG; 4]; 1000],
                },
                noise: TouchNoise {
                    position_sd_m: LONG,
                    normal_sd_rad: LONG,
                    level_sd: LONG,
                },
            }),
            SampleBody::Marker(Marker {
                label: text,
                ends_trip: true,
            }),
        ]
        .map(|body| Sample {
            stamp_ns: i64::MIN,
            body,
        })
        .into()
    }

    #[test]
    fn no_sample_is_longer_than_its_bound() {
        for sample in longest_of_each_kind() {
            for codec in CODECS {
                let len = codec.encode(&sample).len();
                let bound = bytes_max(&sample, codec);
                assert!(len <= bound, "{codec:?}: {len} > {bound} for {sample:?}");
            }
        }
    }

    #[test]
    fn a_borrowed_batch_is_written_as_a_batch() {
        let samples = longest_of_each_kind();
        let batch = SampleBatch {
            session: 3,
            first_seq: 900,
            samples: samples.clone(),
        };
        for codec in CODECS {
            let bytes = encode(3, 900, samples.iter(), codec);
            assert_eq!(bytes, codec.encode(&batch), "{codec:?}");
        }
    }

    #[test]
    fn json_alone_does_not_carry_nan() {
        let sample = Sample {
            stamp_ns: 0,
            body: SampleBody::Level(Level {
                channel: "touch".to_owned(),
                value: f64::NAN,
                offset_m: [0.0; 3],
                normal: None,
            }),
        };
        assert_eq!(
            CODECS.map(|codec| is_carried(&sample, codec)),
            [true, true, false]
        );
    }
}
