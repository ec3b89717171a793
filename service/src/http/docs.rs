//! The description of the interface, and the page that shows it.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{Path, State};
use axum::http::Response;
use axum::response::{IntoResponse, Redirect};
use axum::routing::get;
use axum::{Router, body::Bytes};
use utoipa_swagger_ui::{Config, serve};

use super::problem::{Kind, Problem};
use super::reply;

/// What these routes share.
#[derive(Clone)]
struct Docs {
    openapi: Bytes,
    swagger: Arc<Config<'static>>,
}

/// The routes, with the description that they show.
pub(crate) fn routes<S>(openapi: &serde_json::Value) -> Router<S> {
    let docs = Docs {
        openapi: Bytes::from(openapi.to_string()),
        swagger: Arc::new(Config::from("/openapi.json")),
    };
    Router::new()
        .route("/openapi.json", get(description))
        .route("/docs", get(|| async { Redirect::to("/docs/") }))
        .route(
            "/docs/",
            get(|State(docs): State<Docs>| async move { swagger(&docs, "") }),
        )
        .route("/docs/{*file}", get(swagger_file))
        .with_state(docs)
}

async fn description(State(docs): State<Docs>) -> Response<Body> {
    reply::with_type("application/json", Body::from(docs.openapi))
}

async fn swagger_file(State(docs): State<Docs>, Path(file): Path<String>) -> Response<Body> {
    swagger(&docs, &file)
}

fn swagger(docs: &Docs, file: &str) -> Response<Body> {
    match serve(file, Arc::clone(&docs.swagger)) {
        Ok(Some(found)) => (
            [("content-type", found.content_type)],
            found.bytes.into_owned(),
        )
            .into_response(),
        Ok(None) => Problem::new(Kind::UnknownRoute, "the page has no such file").into_response(),
        Err(error) => Problem::new(Kind::Internal, error.to_string()).into_response(),
    }
}
