//! Samples that someone waits for, and what the waiting can end with.

use cogmap_proto::{IngestAnswer, ObjectLesson, Sample, SampleBatch, SampleBody, Target};
use cognitive_map::{Instruction, Label, Lesson};
use tokio::sync::oneshot;

use super::sequencer::Weight;

/// Samples of an agent for whose durability someone waits.
#[derive(Debug)]
pub(crate) struct Request {
    pub(crate) agent: Box<str>,
    pub(crate) batch: SampleBatch,
    pub(crate) reply: Reply,
}

/// A change of what is known of objects, for whose durability someone waits.
#[derive(Debug)]
pub(crate) struct ObjectRequest {
    pub(crate) name: Label,
    /// The lesson as it came and as the map takes it; none to forget the object.
    pub(crate) lesson: Option<(ObjectLesson, Lesson)>,
    pub(crate) reply: ChangeReply,
}

/// An agent that is to be removed, for whose removal someone waits.
#[derive(Debug)]
pub(crate) struct RemovalRequest {
    pub(crate) agent: Box<str>,
    pub(crate) reply: ChangeReply,
}

/// An instruction, for whose durability someone waits.
#[derive(Debug)]
pub(crate) struct InstructionRequest {
    pub(crate) instruction: Instruction,
    pub(crate) reply: oneshot::Sender<Result<u64, IngestError>>,
}

impl InstructionRequest {
    /// Memory that it takes beside itself \[bytes\].
    pub(crate) fn bytes(&self) -> usize {
        match &self.instruction {
            Instruction::Follow(_, errand) => {
                size_of_val(&errand.avoid_places[..]) + size_of_val(&errand.avoid_regions[..])
            }
            _ => 0,
        }
    }
}

/// Whoever waits for a change that is no sample to be durable.
pub(crate) type ChangeReply = oneshot::Sender<Result<(), IngestError>>;

/// A change that is no sample, for whose durability someone waits.
#[derive(Debug)]
pub(crate) enum Change {
    /// One of objects or agents.
    Made(ChangeReply),
    /// An instruction of this number.
    Instructed(oneshot::Sender<Result<u64, IngestError>>, u64),
}

impl Change {
    /// Answers that it is durable, or why it is not. Whoever asked may have gone.
    pub(crate) fn answer(self, made: Result<(), IngestError>) {
        match self {
            Self::Made(reply) => drop(reply.send(made)),
            Self::Instructed(reply, number) => drop(reply.send(made.map(|()| number))),
        }
    }
}

/// What someone waits for.
#[derive(Debug)]
pub(crate) enum Call {
    Samples(Request),
    Object(ObjectRequest),
    Removal(RemovalRequest),
    Instruction(InstructionRequest),
}

/// Whoever waits for samples to be durable.
pub(crate) type Reply = oneshot::Sender<Result<IngestAnswer, IngestError>>;

/// Why samples were not taken. None of these leaves a part of the request behind unsaid: what was
/// taken before the error stands in the agent's watermark.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IngestError {
    /// The space is still loading.
    #[error("the space is recovering")]
    Recovering,
    /// The writer's queue is full.
    #[error("the space's queue is full")]
    Busy,
    /// Samples before these are missing.
    #[error("sample {expected} of session {session} is next")]
    Gap {
        /// Current session.
        session: u64,
        /// Sequence number of the next sample in order.
        expected: u64,
    },
    /// A newer session has taken the agent over.
    #[error("session {current} has taken over")]
    StaleSession {
        /// The newer session.
        current: u64,
    },
    /// The session has a number that lies too far in the future.
    #[error(
        "session {session} lies in the future: a session is the Unix time of its start [ns], and the \
         service begins none above {latest} now"
    )]
    SessionInFuture {
        /// The session.
        session: u64,
        /// The largest one that may begin now.
        latest: u64,
    },
    /// There is no such agent.
    #[error("the space has no agent {0:?}")]
    UnknownAgent(String),
    /// The space has as many agents as it may.
    #[error("the space has its full number of agents")]
    TooManyAgents,
    /// The store's disk is full.
    #[error("{0}")]
    DiskFull(String),
    /// Another process owns the store now; whether it has these samples is not known.
    #[error("{0}")]
    Fenced(String),
    /// The store failed otherwise.
    #[error("{0}")]
    Store(String),
    /// The space is stopped, because its journal is damaged.
    #[error("{0}")]
    Stopped(String),
    /// The space is closing.
    #[error("the space is closing")]
    Closed,
}

impl Weight for Sample {
    fn bytes(&self) -> usize {
        let beside = match &self.body {
            SampleBody::Increment(_)
            | SampleBody::Velocity(_)
            | SampleBody::StartPose(_)
            | SampleBody::SessionEnd {} => 0,
            SampleBody::Level(level) => level.channel.len(),
            SampleBody::Descriptor(descriptor) => {
                descriptor.channel.len() + size_of_val(descriptor.vector.as_slice())
            }
            SampleBody::Sighting(sighting) => match &sighting.target {
                Target::Landmark(label) | Target::Agent(label) => label.len(),
                Target::OwnSample(_) => 0,
            },
            SampleBody::Marker(marker) => marker.label.len(),
            SampleBody::Object(mark) => {
                let (name, rotations) = mark.lengths();
                name + rotations * size_of::<[f64; 4]>()
            }
        };
        size_of::<Self>() + beside
    }
}
