//! Why bytes are refused.

use crate::encoding::POSTCARD_V1;
use crate::limits::{BATCH_SAMPLES_MAX, MESSAGE_BYTES_MAX};

/// Why bytes are not the message that they should be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// No codec has this encoding.
    #[error("unknown encoding {0:?}")]
    UnknownEncoding(String),
    /// The codec is known, this version of it is not.
    #[error("unsupported version {0:?}; this build speaks {POSTCARD_V1:?}")]
    UnsupportedVersion(String),
    /// The message is longer than [`MESSAGE_BYTES_MAX`].
    #[error("message of {0} bytes, the limit is {MESSAGE_BYTES_MAX}")]
    TooLong(usize),
    /// The bytes are not a message in this codec.
    #[error("malformed {codec}: {detail}")]
    Malformed {
        /// Name of the codec.
        codec: &'static str,
        /// What the codec says.
        detail: String,
    },
    /// A batch without samples.
    #[error("a batch has at least one sample")]
    EmptyBatch,
    /// A batch with more than [`BATCH_SAMPLES_MAX`] samples.
    #[error("batch of {0} samples, the limit is {BATCH_SAMPLES_MAX}")]
    TooManySamples(usize),
    /// Sequence numbers beyond what can be counted.
    #[error("the batch's sequence numbers run past the largest number")]
    SequenceOverflow,
    /// The largest session: no later one could ever take over from it.
    #[error("session {} leaves no number for a later one", u64::MAX)]
    LastSession,
}
