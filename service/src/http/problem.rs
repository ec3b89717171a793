//! Problems: every answer that is not what was asked for is one of these (RFC 9457).

use axum::body::Body;
use axum::http::header::{CONTENT_TYPE, HeaderValue, RETRY_AFTER, WWW_AUTHENTICATE};
use axum::http::{Response, StatusCode};
use axum::response::IntoResponse;
use serde::Serialize;
use utoipa::ToSchema;

use crate::answer::{InvalidContacts, InvalidPrediction, InvalidQuery, InvalidSequence};
use crate::engine::{IngestError, QuestionError, SpaceError, TrajectoryError, Unavailable};
use crate::store::StoreError;

/// Media type of problems.
pub(crate) const PROBLEM_JSON: &str = "application/problem+json";

/// Wait that a busy service asks for \[s\].
const RETRY_AFTER_S: &str = "1";

/// Kinds of problems. Their names are part of the interface and stay as they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A name or number in the path cannot be one.
    InvalidPath,
    /// A query parameter is unknown, or its value is not one.
    InvalidParameter,
    /// The body is not such a message.
    MalformedBody,
    /// The token is missing or wrong.
    Unauthorized,
    /// There is nothing under this path.
    UnknownRoute,
    /// There is no such space.
    UnknownSpace,
    /// There is no such agent.
    UnknownAgent,
    /// There is no such place, trip or landmark.
    UnknownMemory,
    /// The place or trip has been forgotten.
    ForgottenMemory,
    /// The path does not take this method.
    MethodNotAllowed,
    /// Samples before those of the request are missing.
    SequenceGap,
    /// A newer session has taken the agent over.
    StaleSession,
    /// The space exists with other settings.
    OtherSettings,
    /// The space has its full number of agents.
    TooManyAgents,
    /// The service has its full number of spaces.
    TooManySpaces,
    /// The body is too long.
    BodyTooLong,
    /// The body's codec is not one that is read here.
    UnsupportedMediaType,
    /// Settings that make no sense.
    InvalidSettings,
    /// A query that makes no sense.
    InvalidQuery,
    /// It is not known where the agent stands in the map.
    NotPlaced,
    /// A fault of the service.
    Internal,
    /// The store does not work; the service must be looked after.
    StoreFailed,
    /// Too much is under way; come back.
    Busy,
    /// The space is still loading; come back.
    Recovering,
    /// The space's journal is damaged; an operator must look after it.
    SpaceStopped,
    /// The service or the space is closing.
    Closing,
    /// The service cannot do its work until it is looked after.
    NotReady,
    /// The answer took too long.
    Timeout,
    /// The store's disk is full.
    StoreFull,
}

/// A problem, as an answer.
#[derive(Clone, Debug)]
pub struct Problem {
    kind: Kind,
    detail: String,
    expected: Option<Expected>,
}

/// Which sample the service takes next.
#[derive(Clone, Copy, Debug, Serialize, ToSchema)]
pub(crate) struct Expected {
    /// The agent's current session.
    session: u64,
    /// Sequence number of the next sample in order.
    expected_seq: Option<u64>,
}

/// A problem of samples that are not next in order.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct SequenceProblem {
    /// The problem.
    #[serde(flatten)]
    problem: cogmap_proto::Problem,
    /// Which sample the service takes next.
    #[serde(flatten)]
    expected: Option<Expected>,
}

impl Kind {
    fn name_and_status(self) -> (&'static str, StatusCode) {
        use StatusCode as S;
        match self {
            Self::InvalidPath => ("invalid-path", S::BAD_REQUEST),
            Self::InvalidParameter => ("invalid-parameter", S::BAD_REQUEST),
            Self::MalformedBody => ("malformed-body", S::BAD_REQUEST),
            Self::Unauthorized => ("unauthorized", S::UNAUTHORIZED),
            Self::UnknownRoute => ("unknown-route", S::NOT_FOUND),
            Self::UnknownSpace => ("unknown-space", S::NOT_FOUND),
            Self::UnknownAgent => ("unknown-agent", S::NOT_FOUND),
            Self::UnknownMemory => ("unknown-memory", S::NOT_FOUND),
            Self::ForgottenMemory => ("forgotten-memory", S::GONE),
            Self::MethodNotAllowed => ("method-not-allowed", S::METHOD_NOT_ALLOWED),
            Self::SequenceGap => ("sequence-gap", S::CONFLICT),
            Self::StaleSession => ("stale-session", S::CONFLICT),
            Self::OtherSettings => ("other-settings", S::CONFLICT),
            Self::TooManyAgents => ("too-many-agents", S::CONFLICT),
            Self::TooManySpaces => ("too-many-spaces", S::CONFLICT),
            Self::BodyTooLong => ("body-too-long", S::PAYLOAD_TOO_LARGE),
            Self::UnsupportedMediaType => ("unsupported-media-type", S::UNSUPPORTED_MEDIA_TYPE),
            Self::InvalidSettings => ("invalid-settings", S::UNPROCESSABLE_ENTITY),
            Self::InvalidQuery => ("invalid-query", S::UNPROCESSABLE_ENTITY),
            Self::NotPlaced => ("not-placed", S::CONFLICT),
            Self::Internal => ("internal", S::INTERNAL_SERVER_ERROR),
            Self::StoreFailed => ("store-failed", S::INTERNAL_SERVER_ERROR),
            Self::Busy => ("busy", S::SERVICE_UNAVAILABLE),
            Self::Recovering => ("recovering", S::SERVICE_UNAVAILABLE),
            Self::SpaceStopped => ("space-stopped", S::SERVICE_UNAVAILABLE),
            Self::Closing => ("closing", S::SERVICE_UNAVAILABLE),
            Self::NotReady => ("not-ready", S::SERVICE_UNAVAILABLE),
            Self::Timeout => ("timeout", S::GATEWAY_TIMEOUT),
            Self::StoreFull => ("store-full", S::INSUFFICIENT_STORAGE),
        }
    }
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
        Self::new(Kind::UnknownSpace, format!("there is no space {name:?}"))
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

    fn expecting(mut self, session: u64, expected_seq: Option<u64>) -> Self {
        self.expected = Some(Expected {
            session,
            expected_seq,
        });
        self
    }
}

impl IntoResponse for Problem {
    fn into_response(self) -> Response<Body> {
        let (name, status) = self.kind.name_and_status();
        let problem = SequenceProblem {
            problem: cogmap_proto::Problem {
                kind: format!("/problems/{name}"),
                title: name.replace('-', " "),
                status: status.as_u16(),
                detail: self.detail,
            },
            expected: self.expected,
        };
        let body = serde_json::to_vec(&problem).expect("plain data encodes");
        let mut response = Response::new(Body::from(body));
        *response.status_mut() = status;
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static(PROBLEM_JSON));
        // Waiting does not help a space that is stopped.
        if status == StatusCode::SERVICE_UNAVAILABLE && self.kind != Kind::SpaceStopped {
            headers.insert(RETRY_AFTER, HeaderValue::from_static(RETRY_AFTER_S));
        }
        if status == StatusCode::UNAUTHORIZED {
            headers.insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}

impl From<Unavailable> for Problem {
    fn from(error: Unavailable) -> Self {
        let kind = match &error {
            Unavailable::Recovering => Kind::Recovering,
            Unavailable::Stopped(_) => Kind::SpaceStopped,
            Unavailable::Failed(_) => Kind::StoreFailed,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<InvalidQuery> for Problem {
    fn from(error: InvalidQuery) -> Self {
        Self::new(Kind::InvalidQuery, error.to_string())
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
            _ => Kind::InvalidQuery,
        };
        Self::new(kind, error.to_string())
    }
}

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        let kind = match &error {
            StoreError::DiskFull => Kind::StoreFull,
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
            SpaceError::ExistsWithOtherSettings => Kind::OtherSettings,
            SpaceError::TooManySpaces(_) => Kind::TooManySpaces,
            SpaceError::Unknown => Kind::UnknownSpace,
            SpaceError::Closed => Kind::Closing,
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
            IngestError::TooManyAgents => Self::new(Kind::TooManyAgents, detail),
            IngestError::DiskFull(_) => Self::new(Kind::StoreFull, detail),
            IngestError::Store(_) => Self::new(Kind::StoreFailed, detail),
            IngestError::Stopped(_) => Self::new(Kind::SpaceStopped, detail),
            IngestError::Closed => Self::new(Kind::Closing, detail),
        }
    }
}
