//! Reading samples without holding more of them than a message may have.
//!
//! A postcard sample can be as short as four bytes, and is some forty times as long in memory: a
//! hostile message of the allowed length would fill forty megabytes before its samples were
//! counted. So samples beyond the limit are read, counted and dropped.

use std::fmt;

use serde::de::{Deserialize, Deserializer, SeqAccess, Visitor};

use crate::error::DecodeError;
use crate::limits::BATCH_SAMPLES_MAX;
use crate::sample::{Sample, SampleBatch};

impl SampleBatch {
    /// Checks the bounds of the batch as a whole.
    ///
    /// # Errors
    /// It is empty, too large, or its numbers leave none for what comes after it.
    pub fn check(&self) -> Result<(), DecodeError> {
        if self.samples.is_empty() {
            return Err(DecodeError::EmptyBatch);
        }
        if self.samples.len() > BATCH_SAMPLES_MAX {
            return Err(DecodeError::TooManySamples(self.samples.len()));
        }
        if self.session == u64::MAX {
            return Err(DecodeError::LastSession);
        }
        match self.first_seq.checked_add(self.samples.len() as u64) {
            // The number after the last sample, and one beyond it, can still be counted.
            Some(end) if end < u64::MAX => Ok(()),
            _ => Err(DecodeError::SequenceOverflow),
        }
    }
}

/// A [`SampleBatch`] on its way in. The fields are the same, in the same order.
#[derive(serde::Deserialize)]
#[serde(expecting = "a batch of samples")]
pub(crate) struct BoundedBatch {
    session: u64,
    first_seq: u64,
    samples: BoundedSamples,
}

impl BoundedBatch {
    /// The batch, if it is within its bounds.
    pub(crate) fn into_batch(self) -> Result<SampleBatch, DecodeError> {
        if self.samples.count > BATCH_SAMPLES_MAX {
            return Err(DecodeError::TooManySamples(self.samples.count));
        }
        let batch = SampleBatch {
            session: self.session,
            first_seq: self.first_seq,
            samples: self.samples.kept,
        };
        batch.check()?;
        Ok(batch)
    }
}

/// The samples of a question where they were taken: one more than there may be stands for all that
/// are too many, for whoever answers to refuse.
pub(crate) fn localize_samples<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<Sample>, D::Error> {
    let BoundedSamples { kept, .. } = BoundedSamples::deserialize(deserializer)?;
    Ok(kept)
}

/// The first samples, one more than there may be at most, and how many there were.
struct BoundedSamples {
    kept: Vec<Sample>,
    count: usize,
}

impl<'de> Deserialize<'de> for BoundedSamples {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(BoundedVisitor)
    }
}

struct BoundedVisitor;

impl<'de> Visitor<'de> for BoundedVisitor {
    type Value = BoundedSamples;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an array of samples")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<BoundedSamples, A::Error> {
        let expected = seq.size_hint().unwrap_or(0).min(BATCH_SAMPLES_MAX);
        let mut kept = Vec::with_capacity(expected);
        let mut count = 0;
        while let Some(sample) = seq.next_element()? {
            if count <= BATCH_SAMPLES_MAX {
                kept.push(sample);
            }
            count += 1;
        }
        Ok(BoundedSamples { kept, count })
    }
}
