//! Requests that no handler takes: unknown paths, and methods that a path does not have.

use axum::body::Body;
use axum::extract::State;
use axum::http::header::LOCATION;
use axum::http::{HeaderValue, Method, Response, StatusCode, Uri};
use axum::response::IntoResponse;

use super::problem::{Kind, Problem};
use super::state::Service;

/// Paths beside those that the description names.
const PAGES: [&str; 3] = ["/", "/openapi.json", "/docs/"];
/// How alike a path must be to one that there is, to be named: of ten letters some three may
/// differ.
const NEAR_MIN: f64 = 0.7;
/// Most paths that are named.
const NEAR_MAX: usize = 3;
/// Longest path that is compared: every one that there is is shorter, with names of a usual length.
const COMPARED_BYTES_MAX: usize = 256;

/// Answers for a path that is none: by the way to it if it only ends with a slash, otherwise by
/// what is near it.
pub(crate) async fn unknown_path(State(service): State<Service>, uri: Uri) -> Response<Body> {
    let path = uri.path();
    let trimmed = path.trim_end_matches('/');
    let known = |path: &str| service.paths.iter().any(|template| fits(template, path));
    if trimmed != path && known(trimmed) {
        let query = uri.query().map(|query| format!("?{query}"));
        let there = format!("{trimmed}{}", query.unwrap_or_default());
        if let Ok(there) = HeaderValue::try_from(there) {
            return (StatusCode::PERMANENT_REDIRECT, [(LOCATION, there)]).into_response();
        }
    }
    let near = near(&service.paths, trimmed);
    let detail = if near.is_empty() {
        format!("there is nothing under {path}; /v1 and /docs/ list what there is")
    } else {
        format!(
            "there is nothing under {path}; near it: {}",
            near.join(", ")
        )
    };
    Problem::new(Kind::UnknownRoute, detail).into_response()
}

/// Answers for a method that the path does not take. The header `Allow`, which lists those that it
/// takes, is there already.
pub(crate) async fn other_method(method: Method) -> Response<Body> {
    if method == Method::OPTIONS {
        return StatusCode::NO_CONTENT.into_response();
    }
    let detail = format!("this path does not take {method}; the header Allow lists what it takes");
    Problem::new(Kind::MethodNotAllowed, detail).into_response()
}

/// Whether a path is one of a template, such as `/v1/spaces/{space}`.
fn fits(template: &str, path: &str) -> bool {
    let (template, path) = (template.split('/'), path.split('/'));
    template.clone().count() == path.clone().count()
        && template
            .zip(path)
            .all(|(part, given)| part == given || (part.starts_with('{') && !given.is_empty()))
}

/// The paths nearest to one that is none, nearest first, with its own names in them.
fn near(templates: &[String], path: &str) -> Vec<String> {
    if path.len() > COMPARED_BYTES_MAX {
        return Vec::new();
    }
    let versioned = format!("/v1{path}");
    let mut near: Vec<(f64, String)> = Vec::new();
    let known = templates.iter().map(String::as_str).chain(PAGES);
    for template in known.filter(|template| *template != "/") {
        for given in [path, &versioned] {
            let named = with_names(template, given);
            let alike = strsim::normalized_damerau_levenshtein(&named, given);
            // A forgotten version counts no more than a letter.
            if alike >= NEAR_MIN && !near.iter().any(|(_, known)| *known == named) {
                near.push((alike, named));
            }
        }
    }
    near.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.cmp(&b.1)));
    near.into_iter()
        .take(NEAR_MAX)
        .map(|(_, path)| path)
        .collect()
}

/// A template with the names that a path has in the same places.
fn with_names(template: &str, path: &str) -> String {
    let mut given = path.split('/');
    let parts: Vec<_> = template
        .split('/')
        .map(|part| match given.next() {
            Some(name) if part.starts_with('{') && !name.is_empty() => name,
            _ => part,
        })
        .collect();
    parts.join("/")
}
