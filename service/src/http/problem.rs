//! Problems as HTTP answers.

use axum::body::Body;
use axum::http::header::{CONTENT_TYPE, HeaderValue, RETRY_AFTER, WWW_AUTHENTICATE};
use axum::http::{Response, StatusCode};
use axum::response::IntoResponse;
use serde::Serialize;
use utoipa::ToSchema;

pub use crate::problem::{Kind, Problem};

/// Media type of problems.
pub(crate) const PROBLEM_JSON: &str = "application/problem+json";

/// Wait that a busy service asks for \[s\].
const RETRY_AFTER_S: &str = "1";

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

impl IntoResponse for Problem {
    fn into_response(self) -> Response<Body> {
        let problem = SequenceProblem {
            problem: self.to_wire(),
            expected: self.expected().map(|expected| Expected {
                session: expected.session,
                expected_seq: expected.expected_seq,
            }),
        };
        let body = serde_json::to_vec(&problem).expect("plain data encodes");
        let mut response = Response::new(Body::from(body));
        let status = StatusCode::from_u16(self.kind().status());
        let status = status.expect("the table holds statuses");
        *response.status_mut() = status;
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static(PROBLEM_JSON));
        // Waiting does not help a space that is stopped.
        if status == StatusCode::SERVICE_UNAVAILABLE && self.kind() != Kind::SpaceStopped {
            headers.insert(RETRY_AFTER, HeaderValue::from_static(RETRY_AFTER_S));
        }
        if status == StatusCode::UNAUTHORIZED {
            headers.insert(WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        response
    }
}
