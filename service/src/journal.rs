//! Blocks of the journal: what one drained group of messages added to a space.
//!
//! ```text
//! block  = version:u8  entry*
//! entry  = 0 agent:varint name:string                      enrolment
//!        | 1 agent:varint batch                            samples, as a postcard v1 SampleBatch
//!        | 2 agent:varint session:varint from:varint to:varint reason:varint
//!        | 3 number:varint name:string lesson              a lesson about an object
//!        | 4 number:varint name:string                     an object to forget
//!        | 5 agent:varint                                  an agent that is removed
//!        | 6 number:varint instruction                     a blockage, a route, a pin
//!        | 7 remembrance                                   a place or a way of another map
//! ```
//!
//! All of it is postcard of [`Entry`], so a batch that came as postcard and is accepted whole goes
//! to disk as the bytes that came. The format is kept readable for ever: a change is a new version.

mod instruction;
mod remembrance;

use std::borrow::Cow;

use cogmap_proto::{Codec, ObjectLesson, SampleBatch, SkipReason};
pub use instruction::{JournaledBlocked, JournaledErrand, JournaledGoal, JournaledInstruction};
pub use remembrance::{
    JournaledPlace, JournaledPose, JournaledRemembrance, JournaledTraversals, JournaledWay,
};
use serde::{Deserialize, Serialize};

/// Version of blocks that this build writes.
const VERSION: u8 = 1;

/// One entry of a block.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Entry<'a> {
    /// A new agent.
    Enrol {
        /// Its number: the next one, counted from 0, or one that is vacant.
        agent: u32,
        /// Its name.
        name: Cow<'a, str>,
    },
    /// Consecutive samples of an agent.
    Samples {
        /// Its number.
        agent: u32,
        /// The samples.
        batch: SampleBatch,
    },
    /// Samples that were refused or never came.
    Skip {
        /// The agent's number.
        agent: u32,
        /// Its session.
        session: u64,
        /// First sequence number.
        from: u64,
        /// First beyond.
        to: u64,
        /// Why.
        reason: SkipReason,
    },
    /// An object is taught.
    Teach {
        /// Number of lessons and wishes to forget before it.
        number: u64,
        /// Name of the object.
        name: Cow<'a, str>,
        /// Its contacts.
        lesson: ObjectLesson,
    },
    /// An object is forgotten.
    Forget {
        /// Number of lessons and wishes to forget before it.
        number: u64,
        /// Name of the object.
        name: Cow<'a, str>,
    },
    /// An agent is removed: its name is free.
    Remove {
        /// Its number.
        agent: u32,
    },
    /// Somebody said what routes are to heed.
    Instruct {
        /// Number of instructions before it.
        number: u64,
        /// What was said.
        instruction: JournaledInstruction,
    },
    /// A place or a way that another map has had.
    Remember {
        /// It.
        remembrance: JournaledRemembrance,
    },
}

/// Tag of [`Entry::Samples`] in postcard.
const SAMPLES_TAG: u8 = 1;

/// A block under construction.
#[derive(Debug)]
pub(crate) struct BlockWriter {
    bytes: Vec<u8>,
}

impl BlockWriter {
    pub(crate) fn new() -> Self {
        Self {
            bytes: vec![VERSION],
        }
    }

    /// Whether nothing has been written.
    pub(crate) fn is_empty(&self) -> bool {
        self.bytes.len() == 1
    }

    /// Adds an entry.
    pub(crate) fn push(&mut self, entry: &Entry<'_>) {
        self.bytes.extend_from_slice(&Codec::Postcard.encode(entry));
    }

    /// Adds samples that came as a postcard batch, as they came.
    pub(crate) fn push_postcard_batch(&mut self, agent: u32, payload: &[u8]) {
        self.bytes.push(SAMPLES_TAG);
        let mut rest = agent;
        while rest >= 0x80 {
            self.bytes.push(rest.to_le_bytes()[0] | 0x80);
            rest >>= 7;
        }
        self.bytes.push(rest.to_le_bytes()[0]);
        self.bytes.extend_from_slice(payload);
    }

    /// The block so far.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Empties it for the next block.
    pub(crate) fn clear(&mut self) {
        self.bytes.truncate(1);
    }
}

/// Why a block cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CorruptBlock {
    /// It was written by a newer build.
    #[error("journal block of version {0}, this build reads {VERSION}: update cogmap")]
    Version(u8),
    /// The bytes are not entries.
    #[error("malformed journal block: {0}")]
    Malformed(String),
}

/// Reads the entries of a block.
///
/// # Errors
/// The block is of another version or malformed.
pub fn entries(block: &[u8]) -> Result<Vec<Entry<'static>>, CorruptBlock> {
    let (&version, mut rest) = block
        .split_first()
        .ok_or_else(|| CorruptBlock::Malformed("empty".into()))?;
    if version != VERSION {
        return Err(CorruptBlock::Version(version));
    }
    let mut entries = Vec::new();
    while !rest.is_empty() {
        let (entry, after) = postcard::take_from_bytes::<Entry<'static>>(rest)
            .map_err(|error| CorruptBlock::Malformed(error.to_string()))?;
        entries.push(entry);
        rest = after;
    }
    Ok(entries)
}

/// Number of samples in a block; none in one that cannot be read.
pub fn samples_in(block: &[u8]) -> u64 {
    let entries = entries(block).unwrap_or_default();
    let samples = entries.iter().map(|entry| match entry {
        Entry::Samples { batch, .. } => batch.samples.len() as u64,
        _ => 0,
    });
    samples.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use cogmap_proto::{Marker, Sample, SampleBody};

    fn batch() -> SampleBatch {
        let body = SampleBody::Marker(Marker {
            label: "dock".into(),
            ends_trip: true,
        });
        SampleBatch {
            session: 9,
            first_seq: 4,
            samples: vec![Sample { stamp_ns: -5, body }],
        }
    }

    fn block() -> Vec<u8> {
        let mut writer = BlockWriter::new();
        writer.push(&Entry::Enrol {
            agent: 300,
            name: "ada".into(),
        });
        writer.push_postcard_batch(300, &Codec::Postcard.encode(&batch()));
        writer.push(&Entry::Samples {
            agent: 300,
            batch: batch(),
        });
        writer.push(&Entry::Skip {
            agent: 300,
            session: 9,
            from: 5,
            to: 7,
            reason: SkipReason::Lost,
        });
        writer.bytes().to_vec()
    }

    #[test]
    fn a_batch_on_disk_is_the_same_whether_copied_or_written_anew() {
        let read = entries(&block()).unwrap();
        assert_eq!(read.len(), 4);
        assert_eq!(read[1], read[2]);
        assert_eq!(
            read[1],
            Entry::Samples {
                agent: 300,
                batch: batch()
            }
        );
    }

    /// The bytes of version 1 as first released; they must be readable for ever.
    #[test]
    fn version_1_stays_readable() {
        let released: [u8; 23] = [
            1, 0, 2, 3, b'a', b'd', b'a', // enrolment of agent 2
            1, 2, 9, 4, 1, 9, 6, 4, b'd', b'o', b'c', b'k', 1, // a marker of agent 2
            2, 2, 9,
        ];
        let mut released = released.to_vec();
        released.extend([5, 7, 7]); // samples 5 and 6 of its session 9 never came
        let read = entries(&released).unwrap();
        assert_eq!(
            read[0],
            Entry::Enrol {
                agent: 2,
                name: "ada".into()
            }
        );
        assert_eq!(
            read[1],
            Entry::Samples {
                agent: 2,
                batch: batch()
            }
        );
        let lost = Entry::Skip {
            agent: 2,
            session: 9,
            from: 5,
            to: 7,
            reason: SkipReason::Lost,
        };
        assert_eq!(read[2], lost);
    }

    /// Entries that version 1 gained later have the tags after the first ones.
    #[test]
    fn a_removal_is_two_bytes_behind_what_was_there() {
        let mut writer = BlockWriter::new();
        writer.push(&Entry::Remove { agent: 2 });
        assert_eq!(writer.bytes(), [1, 5, 2]);
        assert_eq!(entries(&[1, 5, 2]).unwrap(), [Entry::Remove { agent: 2 }]);
    }

    #[test]
    fn truncated_and_foreign_blocks_are_errors() {
        let whole = block();
        assert_eq!(entries(&[]), Err(CorruptBlock::Malformed("empty".into())));
        assert_eq!(entries(&[2, 0]), Err(CorruptBlock::Version(2)));
        assert!(entries(&whole[..whole.len() - 1]).is_err());
    }
}
