//! The page of the service: what `make dashboard` has built, inside the program.

use axum::Router;
use axum::body::Body;
use axum::extract::Path;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, ETAG, IF_NONE_MATCH, REFERRER_POLICY,
    X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, HeaderValue, Response, StatusCode};
use axum::response::IntoResponse;
use axum::routing::get;
use rust_embed::{Embed, EmbeddedFile};

use super::problem::{Kind, Problem};
use super::reply;

/// The page that stands for one that was not built: self-contained, so that it works without any
/// other host.
pub(super) const PLAIN_PAGE: &str = include_str!("plain_page.html");

/// What a browser lets the page do: run and show what comes from here, and ask only here. Images
/// may be made by the page itself.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; \
    img-src 'self' data: blob:; font-src 'self'; connect-src 'self'; worker-src 'self'; \
    base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
/// For files whose names change with their content.
const FOR_EVER: &str = "public, max-age=31536000, immutable";
/// For the page itself, which names them: a browser asks each time whether it is another one.
const ASK_AGAIN: &str = "no-cache";
/// Bytes of a file's hash in its entity tag: those of a number of 128 bits.
const TAG_BYTES: usize = 16;

/// The page, if it was there when the program was built. A program for development reads it from
/// the disk whenever it is asked for.
#[derive(Embed)]
#[folder = "../target/dashboard"]
#[allow_missing = true]
pub(crate) struct Built;

/// The routes of a page.
pub(crate) fn routes<S: Clone + Send + Sync + 'static, F: Embed + 'static>() -> Router<S> {
    Router::new()
        .route("/", get(index::<F>))
        .route("/assets/{*file}", get(asset::<F>))
}

async fn index<F: Embed>(headers: HeaderMap) -> Response<Body> {
    match F::get("index.html") {
        Some(page) => answer(&headers, page, ASK_AGAIN),
        None => reply::with_type("text/html; charset=utf-8", Body::from(PLAIN_PAGE)),
    }
}

async fn asset<F: Embed>(Path(file): Path<String>, headers: HeaderMap) -> Response<Body> {
    match F::get(&format!("assets/{file}")) {
        Some(asset) => answer(&headers, asset, FOR_EVER),
        None => Problem::new(Kind::UnknownRoute, "the page has no such file").into_response(),
    }
}

/// A file, or that the browser has it already.
fn answer(asked: &HeaderMap, file: EmbeddedFile, caching: &'static str) -> Response<Body> {
    let hash = file.metadata.sha256_hash();
    let start = hash.first_chunk::<TAG_BYTES>();
    let start = start.expect("SHA-256 has 32 bytes");
    let tag = format!("\"{:032x}\"", u128::from_be_bytes(*start));
    let known = asked.get(IF_NONE_MATCH).and_then(|tags| tags.to_str().ok());
    let mut response = if known.is_some_and(|tags| names(tags, &tag)) {
        StatusCode::NOT_MODIFIED.into_response()
    } else {
        let kind = file.metadata.mimetype();
        let of_text = if kind.starts_with("text/") {
            "; charset=utf-8"
        } else {
            ""
        };
        let kind = HeaderValue::try_from(format!("{kind}{of_text}"));
        let mut response = Response::new(Body::from(file.data.into_owned()));
        let headers = response.headers_mut();
        headers.extend(kind.ok().map(|kind| (CONTENT_TYPE, kind)));
        response
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (CACHE_CONTROL, caching),
        (CONTENT_SECURITY_POLICY, POLICY),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (REFERRER_POLICY, "no-referrer"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.extend(HeaderValue::try_from(tag).ok().map(|tag| (ETAG, tag)));
    response
}

/// Whether a list of entity tags has one in it. One that a proxy has made weak, for it has
/// compressed the file, is the same here.
fn names(tags: &str, tag: &str) -> bool {
    let mut tags = tags.split(',').map(str::trim);
    tags.any(|known| known == "*" || known.trim_start_matches("W/") == tag)
}
