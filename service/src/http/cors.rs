//! Pages of other origins that may ask, as the settings list them.

use std::time::Duration;

use axum::http::header::{AUTHORIZATION, CONTENT_DISPOSITION, CONTENT_TYPE, ETAG, RETRY_AFTER};
use axum::http::{HeaderName, HeaderValue, Method};
use tower_http::cors::{AllowOrigin, CorsLayer};

/// How long a browser may remember what pages of an origin may ask.
const REMEMBERED: Duration = Duration::from_secs(600);
/// By this header a reader of events says which one it had last.
const LAST_EVENT_ID: HeaderName = HeaderName::from_static("last-event-id");

/// Lets pages of these origins ask, and read the answers. Answers browsers that ask whether they
/// may before anything else does: they do not send the token then.
pub(crate) fn layer(origins: &[String]) -> CorsLayer {
    let origins = origins.iter().filter_map(|origin| origin.parse().ok());
    let origins: Vec<HeaderValue> = origins.collect();
    CorsLayer::new()
        .allow_origin(AllowOrigin::list(origins))
        .allow_methods([Method::GET, Method::POST, Method::PUT, Method::DELETE])
        .allow_headers([AUTHORIZATION, CONTENT_TYPE, LAST_EVENT_ID])
        .expose_headers([CONTENT_DISPOSITION, ETAG, RETRY_AFTER])
        .max_age(REMEMBERED)
}
