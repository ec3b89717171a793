//! Problems: every answer that is not what was asked for is one of these (RFC 9457), over HTTP and
//! Zenoh alike.

mod kind;

use cogmap_proto::{Codec, DecodeError};
pub use kind::Kind;

use crate::decode::{
    InvalidChannel, InvalidContacts, InvalidPrediction, InvalidQuery, InvalidRoute,
    InvalidSequence, InvalidSequenceQuery,
};
use crate::engine::{IngestError, QuestionError, SpaceError, TrajectoryError, Unavailable};
use crate::store::StoreError;

/// A problem, as an answer.
#[derive(Clone, Debug)]
pub struct Problem {
    kind: Kind,
    detail: String,
    expected: Option<Expected>,
}

/// Which sample the service takes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Expected {
    /// The agent's current session.
    pub session: u64,
    /// Sequence number of the next sample in order.
    pub expected_seq: Option<u64>,
}

impl Problem {
    /// A problem of a kind; `detail` says what was wrong this time.
    pub fn new(kind: Kind, detail: impl Into<String>) -> Self {
        Self {
            kind,
            detail: detail.into(),
            expected: None,
        }
    }

    /// There is no such space.
    pub fn unknown_space(name: &str) -> Self {
        let detail = format!("there is no space {name:?}; PUT /v1/spaces/{name} creates it");
        Self::new(Kind::UnknownSpace, detail)
    }

    /// Nobody in reach owns the space now.
    pub fn moving(name: &str) -> Self {
        let detail = format!("the shard of the space {name:?} is changing hands");
        Self::new(Kind::Moving, detail)
    }

    /// There is no such agent.
    pub fn unknown_agent(name: &str) -> Self {
        Self::new(
            Kind::UnknownAgent,
            format!("the space has no agent {name:?}"),
        )
    }

    /// The space is stopped.
    pub fn space_stopped(reason: &str) -> Self {
        Self::new(Kind::SpaceStopped, reason)
    }

    /// Work in another thread ended with a panic.
    pub fn interrupted() -> Self {
        Self::new(Kind::Internal, "the work was interrupted")
    }

    /// Its kind.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Which sample the service takes next, of samples that were not.
    pub fn expected(&self) -> Option<Expected> {
        self.expected
    }

    /// The problem as the wire has it.
    pub fn to_wire(&self) -> cogmap_proto::Problem {
        cogmap_proto::Problem {
            kind: format!("/problems/{}", self.kind.name()),
            title: self.kind.title().to_owned(),
            status: self.kind.status(),
            detail: self.detail.clone(),
        }
    }

    fn expecting(mut self, session: u64, expected_seq: Option<u64>) -> Self {
        self.expected = Some(Expected {
            session,
            expected_seq,
        });
        self
    }
}

impl From<Unavailable> for Problem {
    fn from(error: Unavailable) -> Self {
        let kind = match &error {
            Unavailable::Recovering => Kind::Recovering,
            Unavailable::Closing => Kind::Closing,
            Unavailable::Interrupted => Kind::Internal,
            Unavailable::Stopped(_) => Kind::SpaceStopped,
            Unavailable::Failed(_) => Kind::StoreFailed,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<DecodeError> for Problem {
    fn from(error: DecodeError) -> Self {
        let kind = match &error {
            DecodeError::TooLong(_) => Kind::BodyTooLong,
            DecodeError::UnknownEncoding(_) | DecodeError::UnsupportedVersion(_) => {
                Kind::UnsupportedMediaType
            }
            DecodeError::Malformed { .. } => Kind::MalformedBody,
            DecodeError::EmptyBatch
            | DecodeError::TooManySamples(_)
            | DecodeError::SequenceOverflow
            | DecodeError::LastSession => Kind::InvalidQuery,
        };
        let detail = match error {
            // It names the field; the codec is the one of whoever asks by hand.
            DecodeError::Malformed { codec, detail } if codec == Codec::Json.name() => detail,
            error => error.to_string(),
        };
        Self::new(kind, detail)
    }
}

impl From<InvalidQuery> for Problem {
    fn from(error: InvalidQuery) -> Self {
        let kind = match &error {
            InvalidQuery::UnknownAgent(name) => return Self::unknown_agent(name),
            InvalidQuery::Channel(InvalidChannel::Unknown { .. })
            | InvalidQuery::ChannelOfList(_, InvalidChannel::Unknown { .. }) => {
                Kind::UnknownChannel
            }
            _ => Kind::InvalidQuery,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<InvalidContacts> for Problem {
    fn from(error: InvalidContacts) -> Self {
        Self::new(Kind::InvalidQuery, error.to_string())
    }
}

impl From<InvalidSequence> for Problem {
    fn from(error: InvalidSequence) -> Self {
        Self::new(Kind::InvalidQuery, error.to_string())
    }
}

impl From<InvalidSequenceQuery> for Problem {
    fn from(error: InvalidSequenceQuery) -> Self {
        let kind = match error {
            InvalidSequenceQuery::Query(error) => return error.into(),
            InvalidSequenceQuery::UnknownPlace(..) => Kind::UnknownMemory,
            InvalidSequenceQuery::GivenUp => Kind::Timeout,
            InvalidSequenceQuery::Number(..) => Kind::InvalidQuery,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<InvalidRoute> for Problem {
    fn from(error: InvalidRoute) -> Self {
        let kind = match error {
            InvalidRoute::Query(error) => return error.into(),
            InvalidRoute::UnknownMemory(_) | InvalidRoute::FollowsNone(_) => Kind::UnknownMemory,
            InvalidRoute::Forgotten(_) => Kind::ForgottenMemory,
            InvalidRoute::AgentLost(_) => Kind::AgentLost,
            InvalidRoute::NothingNear(..) | InvalidRoute::NoPlaces => Kind::NothingNear,
            InvalidRoute::NoWay(..) => Kind::NoWay,
            InvalidRoute::TooManyBlockages(_) => Kind::TooManyBlockages,
            InvalidRoute::GivenUp => Kind::Timeout,
            InvalidRoute::Number(..)
            | InvalidRoute::Box(_)
            | InvalidRoute::TooMany(..)
            | InvalidRoute::WhichBack(_)
            | InvalidRoute::RetraceFrom
            | InvalidRoute::WhichBlockage
            | InvalidRoute::LongPath(_) => Kind::InvalidQuery,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<QuestionError> for Problem {
    fn from(error: QuestionError) -> Self {
        let kind = match error {
            QuestionError::Busy => Kind::Busy,
            QuestionError::Overdue(_) => Kind::Timeout,
            QuestionError::Interrupted => Kind::Internal,
            QuestionError::Unavailable(error) => return error.into(),
        };
        Self::new(kind, error.to_string())
    }
}

impl From<InvalidPrediction> for Problem {
    fn from(error: InvalidPrediction) -> Self {
        let kind = match &error {
            InvalidPrediction::NotPlaced => Kind::NotPlaced,
            InvalidPrediction::Channel(InvalidChannel::Unknown { .. }) => Kind::UnknownChannel,
            _ => Kind::InvalidQuery,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        let kind = match &error {
            StoreError::DiskFull => Kind::StoreFull,
            StoreError::Fenced(_) => Kind::OwnerLost,
            _ => Kind::StoreFailed,
        };
        tracing::error!(%error, "answer from the store");
        Self::new(kind, error.to_string())
    }
}

impl From<TrajectoryError> for Problem {
    fn from(error: TrajectoryError) -> Self {
        match error {
            TrajectoryError::UnknownAgent => Self::new(Kind::UnknownAgent, error.to_string()),
            TrajectoryError::OutOfRange(_) => Self::new(Kind::StampOutOfRange, error.to_string()),
            TrajectoryError::RemovedAgent => Self::new(Kind::RemovedAgent, error.to_string()),
            TrajectoryError::Derived(error) => {
                tracing::error!(%error, "read a trajectory");
                Self::new(Kind::StoreFailed, error.to_string())
            }
            TrajectoryError::Interrupted => Self::interrupted(),
            TrajectoryError::Unavailable(error) => error.into(),
        }
    }
}

impl From<SpaceError> for Problem {
    fn from(error: SpaceError) -> Self {
        let kind = match error {
            SpaceError::InvalidSettings(_) => Kind::InvalidSettings,
            SpaceError::ExistsWithOtherSettings(_) => Kind::OtherSettings,
            SpaceError::TooManySpaces(_) => Kind::TooManySpaces,
            SpaceError::Unknown => Kind::UnknownSpace,
            SpaceError::Closed => Kind::Closing,
            SpaceError::NotHere => Kind::Moving,
            SpaceError::Store(error) => return error.into(),
        };
        Self::new(kind, error.to_string())
    }
}

impl From<IngestError> for Problem {
    fn from(error: IngestError) -> Self {
        let detail = error.to_string();
        match error {
            IngestError::Recovering => Self::new(Kind::Recovering, detail),
            IngestError::Busy => Self::new(Kind::Busy, detail),
            IngestError::Gap { session, expected } => {
                Self::new(Kind::SequenceGap, detail).expecting(session, Some(expected))
            }
            IngestError::StaleSession { current } => {
                Self::new(Kind::StaleSession, detail).expecting(current, None)
            }
            IngestError::SessionInFuture { .. } => Self::new(Kind::SessionInFuture, detail),
            IngestError::UnknownAgent(_) => Self::new(Kind::UnknownAgent, detail),
            IngestError::TooManyAgents => Self::new(Kind::TooManyAgents, detail),
            IngestError::DiskFull(_) => Self::new(Kind::StoreFull, detail),
            IngestError::Fenced(_) => Self::new(Kind::OwnerLost, detail),
            IngestError::Store(_) => Self::new(Kind::StoreFailed, detail),
            IngestError::Stopped(_) => Self::new(Kind::SpaceStopped, detail),
            IngestError::Closed => Self::new(Kind::Closing, detail),
        }
    }
}
