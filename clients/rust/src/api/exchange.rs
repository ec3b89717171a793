//! Bodies and paths of requests, and what comes back.

use cogmap_proto::{Codec, Name};
use serde::Serialize;
use serde::de::DeserializeOwned;
use ureq::Body;
use ureq::http::Response;

use super::ApiError;
use super::retry::Repeat;

/// Longest answer \[bytes\]: a full page of the longest items, many times over.
const ANSWER_BYTES_MAX: u64 = 64 << 20;
/// Longest text kept of an answer that is no problem document \[bytes\].
const EXCERPT_BYTES_MAX: usize = 400;

/// Body of a request.
pub(super) struct Content {
    pub(super) kind: &'static str,
    pub(super) bytes: Vec<u8>,
    pub(super) repeat: Repeat,
}

/// A body in JSON.
pub(super) fn json<T: Serialize>(body: &T) -> Content {
    Content {
        kind: Codec::Json.encoding(),
        bytes: Codec::Json.encode(body),
        repeat: Repeat::Once,
    }
}

/// The path of what belongs to a space.
pub(super) fn path(space: &str, rest: &str) -> Result<String, ApiError> {
    Name::check(space)?;
    Ok(format!("/v1/spaces/{space}{rest}"))
}

/// The path of what belongs to an agent.
pub(super) fn agent_path(space: &str, agent: &str, rest: &str) -> Result<String, ApiError> {
    Name::check(agent)?;
    path(space, &format!("/agents/{agent}{rest}"))
}

/// Whether something was done that has no answer.
pub(super) fn done(response: Response<Vec<u8>>) -> Result<(), ApiError> {
    if response.status().is_success() {
        Ok(())
    } else {
        Err(refusal(response))
    }
}

/// A label may have any characters; in a URL all but the unreserved ones are escaped (RFC 3986,
/// section 2.3).
pub(super) fn escaped(text: &str) -> String {
    use std::fmt::Write as _;
    text.bytes().fold(String::new(), |mut url, byte| {
        if byte.is_ascii_alphanumeric() || matches!(byte, b'-' | b'.' | b'_' | b'~') {
            url.push(char::from(byte));
        } else {
            write!(url, "%{byte:02X}").expect("writing to a String does not fail");
        }
        url
    })
}

/// An answer, read to its end.
pub(super) fn whole(response: Response<Body>) -> Result<Response<Vec<u8>>, ApiError> {
    let (head, body) = response.into_parts();
    let bytes = body
        .into_with_config()
        .limit(ANSWER_BYTES_MAX)
        .read_to_vec()?;
    Ok(Response::from_parts(head, bytes))
}

/// The message that an answer holds.
pub(super) fn answer<T: DeserializeOwned>(
    path: &str,
    response: Response<Vec<u8>>,
) -> Result<T, ApiError> {
    if !response.status().is_success() {
        return Err(refusal(response));
    }
    serde_json::from_slice(response.body()).map_err(|source| ApiError::Answer {
        path: path.to_owned(),
        source,
    })
}

/// Why nothing was answered; the body may be anything when a proxy wrote it.
pub(super) fn refusal(response: Response<Vec<u8>>) -> ApiError {
    let status = response.status().as_u16();
    let body = response.into_body();
    serde_json::from_slice(&body).map_or_else(
        |_| ApiError::Status {
            status,
            body: String::from_utf8_lossy(&body[..body.len().min(EXCERPT_BYTES_MAX)]).into_owned(),
        },
        ApiError::Problem,
    )
}
