//! When a request is sent again.

use std::time::{Duration, Instant};

use cogmap_proto::Problem;
use ureq::http::header::RETRY_AFTER;
use ureq::http::{Response, StatusCode};

use super::ApiError;

/// How long a request is sent again unless told otherwise: longer than another node needs to take
/// over from one that is gone.
pub(super) const RETRY_TIMEOUT: Duration = Duration::from_secs(30);
/// Pause before a request is sent again where the service names none.
const PAUSE: Duration = Duration::from_millis(500);
/// Shortest pause, whatever the service says.
const PAUSE_MIN: Duration = Duration::from_millis(10);

/// The space has no owner at the moment; nothing was done.
const MOVING: &str = "/problems/moving";
/// The owner of the space did not answer; what was asked may have been done.
const OWNER_LOST: &str = "/problems/owner-lost";

/// How often a request may be carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Repeat {
    /// As often as it is sent: it changes nothing, or the same only once.
    Harmless,
    /// Once: a second time it may change something more, or fail.
    Once,
}

/// The repetitions of one request.
pub(super) struct Retries {
    until: Instant,
    repeat: Repeat,
}

impl Retries {
    /// Repetitions for `timeout` from now on.
    pub(super) fn new(timeout: Duration, repeat: Repeat) -> Self {
        Self {
            until: crate::settings::deadline(timeout),
            repeat,
        }
    }

    /// How long to wait before the request is sent again; `None` where the answer stands.
    pub(super) fn pause_after(&self, answer: &Response<Vec<u8>>) -> Option<Duration> {
        let is_passing = match problem_kind(answer)?.as_str() {
            MOVING => true,
            OWNER_LOST => self.repeat == Repeat::Harmless,
            _ => false,
        };
        let left = self.until.saturating_duration_since(Instant::now());
        let pause = retry_after(answer).unwrap_or(PAUSE).max(PAUSE_MIN);
        (is_passing && !left.is_zero()).then(|| pause.min(left))
    }
}

fn problem_kind(answer: &Response<Vec<u8>>) -> Option<String> {
    let may_pass = [StatusCode::BAD_GATEWAY, StatusCode::SERVICE_UNAVAILABLE];
    if !may_pass.contains(&answer.status()) {
        return None;
    }
    let problem: Problem = serde_json::from_slice(answer.body()).ok()?;
    Some(problem.kind)
}

/// The header `Retry-After` in seconds; its other form, a date, is not read.
fn retry_after(answer: &Response<Vec<u8>>) -> Option<Duration> {
    let seconds = answer.headers().get(RETRY_AFTER)?.to_str().ok()?;
    Some(Duration::from_secs(seconds.trim().parse().ok()?))
}

/// Whether a request that failed may go to another address at once: nothing answers at this one, or
/// the connection broke and doing it twice is harmless.
pub(super) fn may_go_elsewhere(error: &ApiError, repeat: Repeat) -> bool {
    use std::io::ErrorKind::{
        BrokenPipe, ConnectionAborted, ConnectionRefused, ConnectionReset, HostUnreachable,
        NetworkUnreachable, TimedOut, UnexpectedEof,
    };
    let ApiError::Transport(error) = error else {
        return false;
    };
    match &**error {
        ureq::Error::HostNotFound
        | ureq::Error::ConnectionFailed
        | ureq::Error::Timeout(ureq::Timeout::Resolve | ureq::Timeout::Connect) => true,
        ureq::Error::Timeout(_) => repeat == Repeat::Harmless,
        ureq::Error::Io(error) => match error.kind() {
            ConnectionRefused | HostUnreachable | NetworkUnreachable => true,
            BrokenPipe | ConnectionAborted | ConnectionReset | TimedOut | UnexpectedEof => {
                repeat == Repeat::Harmless
            }
            _ => false,
        },
        _ => false,
    }
}
