//! What handlers take from a request; whatever does not fit is answered as a problem.

use std::sync::Arc;

use axum::body::{Body, Bytes};
use axum::extract::{FromRequest, FromRequestParts, Path, Request};
use axum::http::header::{CONTENT_TYPE, ORIGIN};
use axum::http::request::Parts;
use axum::http::{HeaderMap, StatusCode};
use cogmap_proto::limits::MESSAGE_BYTES_MAX;
use cogmap_proto::{Codec, Name};
use http_body_util::Limited;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::json;
use super::problem::{Kind, Problem};
use super::state::Service;
use crate::answer;
use crate::engine::{AgentView, Space};

/// What curl calls a body that it was not told the type of.
const CURL_DEFAULT: &str = "application/x-www-form-urlencoded";
/// By this header browsers say which site a request comes from; other programs do not send it.
const SEC_FETCH_SITE: &str = "sec-fetch-site";

/// The space that the path names.
#[derive(Debug)]
pub(crate) struct SpaceOfPath(pub(crate) Arc<Space>);

/// The space that the path names, and the name of an agent that may be there or not.
#[derive(Debug)]
pub(crate) struct AgentName(pub(crate) Arc<Space>, pub(crate) Name);

/// The space that the path names, also one that is stopped.
#[derive(Debug)]
pub(crate) struct AnySpaceOfPath(pub(crate) Arc<Space>);

/// The space and the agent that the path names.
#[derive(Debug)]
pub(crate) struct AgentOfPath(pub(crate) Arc<Space>, pub(crate) Arc<AgentView>);

/// Query parameters; unknown ones are refused.
#[derive(Debug)]
pub(crate) struct Query<T>(pub(crate) T);

/// No query parameters at all.
#[derive(Debug)]
pub(crate) struct NoQuery;

/// A JSON body.
#[derive(Debug)]
pub(crate) struct Json<T>(pub(crate) T);

/// A body in one of the codecs, and which one its `Content-Type` says.
#[derive(Debug)]
pub(crate) struct Encoded {
    pub(crate) codec: Codec,
    pub(crate) bytes: Bytes,
}

/// A space in a path.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct SpaceParam {
    /// Name of the space.
    #[param(
        pattern = "^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        min_length = 1,
        max_length = 64
    )]
    pub(crate) space: String,
}

/// An agent of a space in a path.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct AgentParams {
    /// Name of the space.
    #[param(
        pattern = "^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        min_length = 1,
        max_length = 64
    )]
    space: String,
    /// Name of the agent.
    #[param(
        pattern = "^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        min_length = 1,
        max_length = 64
    )]
    agent: String,
}

/// A place or trip of a space in a path.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct IdParams {
    /// Name of the space.
    #[param(
        pattern = "^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        min_length = 1,
        max_length = 64
    )]
    pub(crate) space: String,
    /// Its number.
    pub(crate) id: u64,
}

/// A landmark of a space in a path.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct LabelParams {
    /// Name of the space.
    #[param(
        pattern = "^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        min_length = 1,
        max_length = 64
    )]
    pub(crate) space: String,
    /// Label of the landmark.
    #[param(min_length = 1, max_length = 128)]
    pub(crate) id: String,
}

/// A name in a path.
pub(crate) fn name(text: &str) -> Result<Name, Problem> {
    text.parse()
        .map_err(|error| Problem::new(Kind::InvalidPath, format!("{text:?}: {error}")))
}

/// The space of a name in a path; in place of one of another node what this node follows of it, if
/// the request allows that.
pub(crate) fn space(parts: &Parts, service: &Service, text: &str) -> Result<Arc<Space>, Problem> {
    if let Some(replica) = parts.extensions.get::<super::forward::Replica>() {
        return Ok(Arc::clone(&replica.space));
    }
    answer::space_named(&service.engine, text)
}

/// The parameters of a path.
pub(crate) async fn path<T>(parts: &mut Parts, service: &Service) -> Result<T, Problem>
where
    T: DeserializeOwned + Send,
{
    let path = Path::<T>::from_request_parts(parts, service).await;
    path.map(|Path(params)| params)
        .map_err(|rejection| Problem::new(Kind::InvalidPath, of_path(&rejection.body_text())))
}

/// What axum says of a path, for whoever wrote the path.
fn of_path(text: &str) -> String {
    let value = text.strip_prefix("Invalid URL: Cannot parse `id` with value `");
    let value = value.and_then(|rest| rest.strip_suffix("` to a `u64`"));
    value.map_or_else(
        || text.to_owned(),
        |value| format!("{value:?} is not a whole number from 0 to {}", u64::MAX),
    )
}

/// What axum says of query parameters.
fn of_query(text: &str) -> String {
    let text = text.trim_start_matches("Failed to deserialize query string: ");
    // Stamps may be negative, all other whole numbers are counts.
    let is_stamp = { text.split(':').next() }.is_some_and(|name| name.ends_with("_ns"));
    let whole = if is_stamp {
        "expected a whole number"
    } else {
        "expected a whole number from 0 on"
    };
    text.replace("invalid digit found in string", whole)
        .replace(
            "cannot parse integer from empty string",
            "expected a whole number",
        )
        .replace(
            "number too large to fit in target type",
            "the number is too large",
        )
        .replace("invalid float literal", "expected a number")
}

impl FromRequestParts<Service> for SpaceOfPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, service: &Service) -> Result<Self, Problem> {
        let params: SpaceParam = path(parts, service).await?;
        space(parts, service, &params.space).map(Self)
    }
}

impl FromRequestParts<Service> for AnySpaceOfPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, service: &Service) -> Result<Self, Problem> {
        let params: SpaceParam = path(parts, service).await?;
        answer::any_space_named(&service.engine, &params.space).map(Self)
    }
}

impl FromRequestParts<Service> for AgentName {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, service: &Service) -> Result<Self, Problem> {
        let params: AgentParams = path(parts, service).await?;
        let agent = name(&params.agent)?;
        Ok(Self(space(parts, service, &params.space)?, agent))
    }
}

impl FromRequestParts<Service> for AgentOfPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, service: &Service) -> Result<Self, Problem> {
        let params: AgentParams = path(parts, service).await?;
        let space = space(parts, service, &params.space)?;
        let agent = name(&params.agent)?;
        let view = answer::agent_named(&space, agent.as_str())?;
        Ok(Self(space, view))
    }
}

impl<T: DeserializeOwned> FromRequestParts<Service> for Query<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &Service) -> Result<Self, Problem> {
        axum::extract::Query::try_from_uri(&parts.uri)
            .map(|axum::extract::Query(query)| Self(query))
            .map_err(|rejection| {
                Problem::new(Kind::InvalidParameter, of_query(&rejection.body_text()))
            })
    }
}

impl FromRequestParts<Service> for NoQuery {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &Service) -> Result<Self, Problem> {
        match parts.uri.query() {
            None | Some("") => Ok(Self),
            Some(_) => Err(Problem::new(
                Kind::InvalidParameter,
                "this path takes no query parameters",
            )),
        }
    }
}

impl<T: DeserializeOwned + Serialize> FromRequest<Service> for Json<T> {
    type Rejection = Problem;

    async fn from_request(request: Request, service: &Service) -> Result<Self, Problem> {
        must_be_json(request.headers())?;
        let bytes = whole_body(request, service).await?;
        json::message(&bytes).map(Self)
    }
}

impl FromRequest<Service> for Encoded {
    type Rejection = Problem;

    async fn from_request(request: Request, service: &Service) -> Result<Self, Problem> {
        let codec = codec(request.headers())?;
        Ok(Self {
            codec,
            bytes: whole_body(request, service).await?,
        })
    }
}

/// The codec of a body: that which its `Content-Type` names.
///
/// A program that names none, or lets curl name its default, means JSON. A page in a browser has to
/// name it: only then does the browser ask first whether a page of another origin may send it.
fn codec(headers: &HeaderMap) -> Result<Codec, Problem> {
    let media_type = headers.get(CONTENT_TYPE).map_or("", |value| {
        // What is not a text is not one of ours either.
        value.to_str().unwrap_or("?")
    });
    let essence = media_type.split(';').next().unwrap_or_default().trim();
    let unnamed = essence.is_empty() || essence.eq_ignore_ascii_case(CURL_DEFAULT);
    let from_page = headers.contains_key(ORIGIN) || headers.contains_key(SEC_FETCH_SITE);
    if unnamed && !from_page {
        return Ok(Codec::Json);
    }
    Codec::of_encoding(media_type).map_err(|error| {
        let detail = format!("Content-Type: {error}; JSON is {}", Codec::Json.encoding());
        Problem::new(Kind::UnsupportedMediaType, detail)
    })
}

/// Refuses a `Content-Type` that is not JSON.
pub(crate) fn must_be_json(headers: &HeaderMap) -> Result<(), Problem> {
    match codec(headers)? {
        Codec::Json => Ok(()),
        Codec::Cbor | Codec::Postcard => {
            let detail = format!("a body here is {}", Codec::Json.encoding());
            Err(Problem::new(Kind::UnsupportedMediaType, detail))
        }
    }
}

/// The whole body.
pub(crate) async fn whole_body(request: Request, service: &Service) -> Result<Bytes, Problem> {
    let bounded = request.map(|body| Body::new(Limited::new(body, MESSAGE_BYTES_MAX)));
    Bytes::from_request(bounded, service)
        .await
        .map_err(|rejection| {
            if rejection.status() == StatusCode::PAYLOAD_TOO_LARGE {
                let detail = format!("a body has at most {MESSAGE_BYTES_MAX} bytes");
                return Problem::new(Kind::BodyTooLong, detail);
            }
            Problem::new(Kind::MalformedBody, rejection.body_text())
        })
}
