//! Records: the journal's entries, in the order in which the fold meets them.

use super::{AgentId, Instruction, InvalidSample, Label, Lesson, Remembrance, Sample};

/// One entry of the journal.
#[derive(Clone, Debug, PartialEq)]
pub enum Record {
    /// A new agent. Its identifier is the number of those given out before, or one that is vacant.
    Enrol {
        /// Its identifier.
        agent: AgentId,
        /// Its name.
        name: Label,
    },
    /// A sample of an agent.
    Sample {
        /// The agent.
        agent: AgentId,
        /// Its session; a larger one than before begins a new session.
        session: u64,
        /// The sample's number within the session, from 0.
        seq: u64,
        /// The sample.
        sample: Sample,
    },
    /// Samples that will never come or were refused: the numbers `from..to`.
    Skip {
        /// The agent.
        agent: AgentId,
        /// Its session.
        session: u64,
        /// First number.
        from: u64,
        /// First number beyond.
        to: u64,
        /// Why.
        reason: SkipReason,
    },
    /// An object is taught at once, in place of what was known of it.
    TeachObject {
        /// Number of the space's lessons and wishes to forget before it.
        number: u64,
        /// Its name.
        name: Label,
        /// Its contacts.
        lesson: Lesson,
    },
    /// An object is forgotten.
    ForgetObject {
        /// Number of the space's lessons and wishes to forget before it.
        number: u64,
        /// Its name.
        name: Label,
    },
    /// Somebody said what routes are to heed.
    Instruct {
        /// Number of the space's instructions before it.
        number: u64,
        /// What was said.
        instruction: Instruction,
    },
    /// A place or a way that another map has had. It counts once: a place whose number has been
    /// given out is there already, and so is a way between two places that one joins.
    Remember(Remembrance),
    /// An agent is removed: its name is free, and what it did in the map stays.
    Remove {
        /// The agent.
        agent: AgentId,
    },
}

/// Why samples are skipped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SkipReason {
    /// The sample made no sense.
    Invalid(InvalidSample),
    /// Its stamp ran backwards.
    TimeBackwards,
    /// It never came.
    Lost,
}
