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
        Entry::Remove { agent } => take(Record::Remove {
            agent: AgentId(*agent),
        }),
        Entry::Teach { .. }
        | Entry::Forget { .. }
        | Entry::Instruct { .. }
        | Entry::Remember { .. } => {
            if let Some(record) = record_of_change(entry) {
                take(record);
            }
        }
    }
}

/// The record of a change that is no agent's, if it makes sense: only what passed is journaled.
fn record_of_change(entry: &Entry<'_>) -> Option<Record> {
    match entry {
        Entry::Teach {
            number,
            name,
            lesson,
        } => Some(Record::TeachObject {
            number: *number,
            name: Label::new(name).ok()?,
            lesson: journaled_lesson(lesson).ok()?,
        }),
        Entry::Forget { number, name } => Some(Record::ForgetObject {
            number: *number,
            name: Label::new(name).ok()?,
        }),
        Entry::Instruct {
            number,
            instruction,
        } => Some(Record::Instruct {
            number: *number,
            instruction: journaled_instruction(instruction)?,
        }),
        Entry::Remember { remembrance } => journaled_remembrance(remembrance).map(Record::Remember),
        Entry::Enrol { .. } | Entry::Samples { .. } | Entry::Skip { .. } | Entry::Remove { .. } => {
            None
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
