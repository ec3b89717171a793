//! Samples that are to be localised.

use cogmap_proto as wire;
use cogmap_proto::limits::LOCALIZE_SAMPLES_MAX;
use cognitive_map::{InvalidSample, Sample};

use super::fault;
use super::sample::sample as read_sample;

/// Why samples cannot be localised.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidSequence {
    /// There are none, or too many.
    #[error("samples must be 1 to {LOCALIZE_SAMPLES_MAX}, not {told}", told = counted(*.0))]
    Count(usize),
    /// A sample makes no sense.
    #[error("samples[{0}].{1}: {2}")]
    Sample(usize, String, InvalidSample),
    /// A stamp is earlier than the one before.
    #[error("samples[{0}]: the stamp runs backwards")]
    TimeBackwards(usize),
    /// A sample tells where the robot is, which is what was asked.
    #[error("samples[{0}]: a start pose has no place where a pose is asked for")]
    StartPose(usize),
    /// A sample begins or ends an episode with an object, of which nothing would be learned.
    #[error("samples[{0}]: an episode with an object has no place where a pose is asked for")]
    Object(usize),
}

/// How many samples there are, as far as they are counted when they are read.
fn counted(count: usize) -> String {
    if count > LOCALIZE_SAMPLES_MAX {
        "more".to_owned()
    } else {
        count.to_string()
    }
}

/// The samples of a question, as the map takes them.
///
/// # Errors
/// Says which sample breaks which rule, by its place in the list.
pub fn samples_to_localize(query: &wire::LocalizeQuery) -> Result<Vec<Sample>, InvalidSequence> {
    let count = query.samples.len();
    if !(1..=LOCALIZE_SAMPLES_MAX).contains(&count) {
        return Err(InvalidSequence::Count(count));
    }
    let mut latest_ns = i64::MIN;
    let samples = query.samples.iter().enumerate().map(|(at, sample)| {
        match &sample.body {
            wire::SampleBody::StartPose(_) => return Err(InvalidSequence::StartPose(at)),
            wire::SampleBody::Object(_) => return Err(InvalidSequence::Object(at)),
            _ if sample.stamp_ns < latest_ns => return Err(InvalidSequence::TimeBackwards(at)),
            _ => latest_ns = sample.stamp_ns,
        }
        read_sample(sample).map_err(|error| {
            let field = fault::in_sample(sample);
            InvalidSequence::Sample(at, field, error)
        })
    });
    samples.collect()
}
