//! Entries of the journal.
//!
//! Recovery and the offline commands meet the same records as the live writer, so that they cannot
//! differ.

use cogmap_proto as wire;
use cognitive_map::{AgentId, InvalidSample, Label, Record, SkipReason};

use super::instruction::journaled_instruction;
use super::lesson::journaled_lesson;
use super::remembrance::journaled_remembrance;
use super::sample::journaled_sample;
use crate::journal::Entry;

/// Passes the records of a journal entry to `take`, in order.
pub fn records_of(entry: &Entry<'_>, mut take: impl FnMut(Record)) {
    match entry {
        Entry::Enrol { agent, name } => {
            if let Ok(name) = Label::new(name) {
                take(Record::Enrol {
                    agent: AgentId(*agent),
                    name,
                });
            }
        }
        Entry::Samples { agent, batch } => records_of_batch(AgentId(*agent), batch, take),
        Entry::Skip {
            agent,
            session,
            from,
            to,
            reason,
        } => take(Record::Skip {
            agent: AgentId(*agent),
            session: *session,
            from: *from,
            to: *to,
            reason: skip_reason(*reason),
        }),
        Entry::Teach {
            number,
            name,
            lesson,
        } => {
            // Only lessons that passed are journaled.
            if let (Ok(name), Ok(lesson)) = (Label::new(name), journaled_lesson(lesson)) {
                take(Record::TeachObject {
                    number: *number,
                    name,
                    lesson,
                });
            }
        }
        Entry::Instruct {
            number,
            instruction,
        } => {
            // Only instructions that passed are journaled.
            if let Some(instruction) = journaled_instruction(instruction) {
                take(Record::Instruct {
                    number: *number,
                    instruction,
                });
            }
        }
        Entry::Remember { remembrance } => {
            // Only what passed is journaled.
            if let Some(remembrance) = journaled_remembrance(remembrance) {
                take(Record::Remember(remembrance));
            }
        }
        Entry::Remove { agent } => take(Record::Remove {
            agent: AgentId(*agent),
        }),
        Entry::Forget { number, name } => {
            if let Ok(name) = Label::new(name) {
                take(Record::ForgetObject {
                    number: *number,
                    name,
                });
            }
        }
    }
}

/// Passes the records of consecutive samples to `take`, in order.
fn records_of_batch(agent: AgentId, batch: &wire::SampleBatch, mut take: impl FnMut(Record)) {
    let session = batch.session;
    for (ahead, sample) in (0..).zip(&batch.samples) {
        // The last number of all has no successor, so it is never a sample's.
        let Some(seq) = batch
            .first_seq
            .checked_add(ahead)
            .filter(|seq| *seq < u64::MAX)
        else {
            return;
        };
        take(match journaled_sample(sample) {
            Ok(sample) => Record::Sample {
                agent,
                session,
                seq,
                sample,
            },
            // Only samples that passed are journaled. A build with stricter rules than the
            // one that wrote the journal says so by skipping.
            Err(invalid) => {
                let reason = SkipReason::Invalid(invalid);
                Record::Skip {
                    agent,
                    session,
                    from: seq,
                    to: seq + 1,
                    reason,
                }
            }
        });
    }
}

/// Why samples are skipped, from the journal.
fn skip_reason(reason: wire::SkipReason) -> SkipReason {
    let invalid = match reason {
        // A leap is refused before the journal, and so never in it.
        wire::SkipReason::Lost | wire::SkipReason::SequenceLeap => return SkipReason::Lost,
        wire::SkipReason::TimeBackwards => return SkipReason::TimeBackwards,
        wire::SkipReason::NumberOutOfRange => InvalidSample::NumberOutOfRange,
        wire::SkipReason::NonUnitQuaternion => InvalidSample::NonUnitQuaternion,
        wire::SkipReason::NegativeNoise => InvalidSample::NegativeNoise,
        wire::SkipReason::InvalidDescriptor => InvalidSample::InvalidDescriptor,
        wire::SkipReason::InvalidLabel => InvalidSample::InvalidLabel,
        wire::SkipReason::InvalidNormal => InvalidSample::InvalidNormal,
    };
    SkipReason::Invalid(invalid)
}
