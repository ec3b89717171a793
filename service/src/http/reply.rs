//! Answers that are not problems.

use axum::body::Body;
use axum::http::Response;
use axum::http::header::{CONTENT_TYPE, HeaderValue};
use serde::Serialize;

/// A JSON answer.
pub(crate) fn json<T: Serialize>(message: &T) -> Response<Body> {
    let bytes = serde_json::to_vec(message).expect("plain data encodes");
    with_type("application/json", Body::from(bytes))
}

/// An answer of a media type.
pub(crate) fn with_type(media_type: &'static str, body: Body) -> Response<Body> {
    let mut response = Response::new(body);
    response
        .headers_mut()
        .insert(CONTENT_TYPE, HeaderValue::from_static(media_type));
    response
}
