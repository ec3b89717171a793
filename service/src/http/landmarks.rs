//! Landmarks.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::FromRequestParts;
use axum::http::Response;
use axum::http::request::Parts;
use cogmap_proto::{Landmark, LandmarkPage};
use serde::Deserialize;

use super::extract::{LabelParams, NoQuery, Query, SpaceOfPath, SpaceParam, path, space};
use super::page;
use super::places::unknown;
use super::problem::Problem;
use super::reply;
use super::state::Service;
use crate::encode;
use crate::engine::Space;

/// Which landmarks.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct LandmarksQuery {
    /// Only landmarks whose labels come after this one.
    after: Option<String>,
    /// Most landmarks in the answer; 100 when absent.
    #[param(minimum = 1, maximum = 1000)]
    limit: Option<u32>,
}

/// The landmarks of a space.
#[utoipa::path(get, path = "/v1/spaces/{space}/landmarks", tag = "memory",
    operation_id = "list_landmarks", params(SpaceParam, LandmarksQuery),
    responses(
        (status = 200, description = "The landmarks, by label", body = LandmarkPage),
        (status = 404, description = "There is no such space"),
        (status = 422, description = "A parameter breaks a rule")))]
pub(crate) async fn list(
    SpaceOfPath(space): SpaceOfPath,
    Query(query): Query<LandmarksQuery>,
) -> Result<Response<Body>, Problem> {
    let limit = page::limit(query.limit)?;
    let map = space.snapshot().await?;
    let listed = map
        .landmarks_after(query.after.as_deref())
        .map(|(_, landmark)| landmark);
    let (landmarks, next) = page::cut(listed, limit, |landmark| {
        landmark.label().as_str().to_owned()
    });
    Ok(reply::json(&LandmarkPage {
        frame: encode::FRAME.to_owned(),
        landmarks: landmarks.into_iter().map(encode::landmark).collect(),
        next,
    }))
}

/// A landmark.
#[utoipa::path(get, path = "/v1/spaces/{space}/landmarks/{id}", tag = "memory",
    operation_id = "get_landmark", params(LabelParams),
    responses(
        (status = 200, description = "The landmark", body = Landmark),
        (status = 404, description = "There is no such space or landmark")))]
pub(crate) async fn get(
    LandmarkOfPath(space, label): LandmarkOfPath,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    let found = map
        .landmark_by_label(&label)
        .map(|(_, landmark)| encode::landmark(landmark));
    found
        .map(|landmark| reply::json(&landmark))
        .ok_or_else(|| unknown("landmark", &label))
}

/// The space that the path names, and the label of a landmark that may be there or not.
pub(crate) struct LandmarkOfPath(Arc<Space>, String);

impl FromRequestParts<Service> for LandmarkOfPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, service: &Service) -> Result<Self, Problem> {
        let params: LabelParams = path(parts, service).await?;
        Ok(Self(space(parts, service, &params.space)?, params.id))
    }
}
