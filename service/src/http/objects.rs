//! Objects: what was learned by touch, taught at once, and known again.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{FromRequestParts, State};
use axum::http::request::Parts;
use axum::http::{Response, StatusCode};
use cogmap_proto::{
    AgentObject, Identification, IdentifyQuery, ObjectDetail, ObjectLesson, ObjectPage,
    ObjectSummary,
};
use cognitive_map::{CognitiveMap, Label};
use serde::Deserialize;

use super::extract::{
    AgentOfPath, AgentParams, Json, NoQuery, Query, SpaceOfPath, SpaceParam, path, space,
};
use super::page;
use super::places::unknown;
use super::problem::Problem;
use super::reply;
use super::state::Service;
use crate::answer;
use crate::decode::{self, InvalidContacts};
use crate::encode;
use crate::engine::Space;

/// An object of a space in a path.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[into_params(parameter_in = Path)]
pub(crate) struct ObjectParams {
    /// Name of the space.
    #[param(
        pattern = "^[A-Za-z0-9][A-Za-z0-9_.-]*$",
        min_length = 1,
        max_length = 64
    )]
    space: String,
    /// Name of the object.
    #[param(min_length = 1, max_length = 128)]
    name: String,
}

/// Which objects.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct ObjectsQuery {
    /// Only objects whose names come after this one.
    after: Option<String>,
    /// Most objects in the answer; 100 when absent.
    #[param(minimum = 1, maximum = 1000)]
    limit: Option<u32>,
}

/// The objects of a space.
#[utoipa::path(get, path = "/v1/spaces/{space}/objects", tag = "memory",
    operation_id = "list_objects", params(SpaceParam, ObjectsQuery),
    responses(
        (status = 200, description = "The objects, by name", body = ObjectPage),
        (status = 404, description = "There is no such space"),
        (status = 422, description = "A parameter breaks a rule")))]
pub(crate) async fn list(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    Query(query): Query<ObjectsQuery>,
) -> Result<Response<Body>, Problem> {
    let limit = page::limit(query.limit)?;
    let map = space.snapshot().await?;
    let listed = service
        .long
        .make(move || summaries(&map, query.after.as_deref(), limit));
    listed.await
}

fn summaries(map: &CognitiveMap, after: Option<&str>, limit: usize) -> Response<Body> {
    let after = after.unwrap_or_default();
    let mut objects: Vec<_> = map
        .objects()
        .filter(|(_, known, _)| known.name().as_str() > after)
        .collect();
    objects.sort_by(|a, b| a.1.name().cmp(b.1.name()));
    let summaries = objects
        .iter()
        .map(|object| encode::object_summary(map, *object));
    let (objects, next) = page::cut(summaries, limit, |summary| summary.name.clone());
    reply::json(&ObjectPage { objects, next })
}

/// An object, with its places.
#[utoipa::path(get, path = "/v1/spaces/{space}/objects/{name}", tag = "memory",
    operation_id = "get_object", params(ObjectParams),
    responses(
        (status = 200, description = "The object", body = ObjectDetail),
        (status = 404, description = "There is no such space or object")))]
pub(crate) async fn get(
    State(service): State<Service>,
    ObjectOfPath(space, name): ObjectOfPath,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    let label = Label::new(&name).map_err(|_| unknown("object", &name))?;
    let object = detail(&service, map, label).await?;
    let object = object.ok_or_else(|| unknown("object", &name))?;
    Ok(reply::json(&object))
}

/// What the answer to a lesson tells beside the object.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct TeachQuery {
    /// Whether to compare it with all other objects, and to tell for which it would be taken. Takes
    /// as long as to identify something among them; false when absent.
    #[serde(default)]
    alike: bool,
}

/// Teach an object at once, by contacts in its own frame, in place of what was known of it. Answers
/// when the lesson is on disk.
#[utoipa::path(put, path = "/v1/spaces/{space}/objects/{name}", tag = "memory",
    operation_id = "teach_object", params(ObjectParams, TeachQuery), request_body = ObjectLesson,
    responses(
        (status = 200, description = "The object is known", body = ObjectSummary),
        (status = 404, description = "There is no such space"),
        (status = 422, description = "The name or the lesson makes no sense"),
        (status = 507, description = "The store is full")))]
pub(crate) async fn put(
    State(service): State<Service>,
    ObjectOfPath(space, name): ObjectOfPath,
    Query(query): Query<TeachQuery>,
    Json(lesson): Json<ObjectLesson>,
) -> Result<Response<Body>, Problem> {
    let label = Label::new(&name).map_err(InvalidContacts::Name)?;
    let valid = decode::lesson(&lesson)?;
    space.teach(&label, lesson, valid).await?;
    let map = space.snapshot().await?;
    let object = detail(&service, map, label.clone()).await?;
    let object = object.ok_or_else(|| unknown("object", &name))?;
    let mut taught = object.summary;
    // The lesson is on disk, whether or not there is room for the question.
    if query.alike
        && let Ok((map, alike)) = space.alike(label).await
    {
        taught.alike = encode::object_alike(&map, alike);
    }
    Ok(reply::json(&taught))
}

/// Forget an object.
#[utoipa::path(delete, path = "/v1/spaces/{space}/objects/{name}", tag = "memory",
    operation_id = "forget_object", params(ObjectParams),
    responses(
        (status = 204, description = "The object is gone"),
        (status = 404, description = "There is no such space or object")))]
pub(crate) async fn delete(
    ObjectOfPath(space, name): ObjectOfPath,
    _: NoQuery,
) -> Result<StatusCode, Problem> {
    let map = space.snapshot().await?;
    let label = Label::new(&name).map_err(|_| unknown("object", &name))?;
    if map.object_by_name(&label).is_none() {
        return Err(unknown("object", &name));
    }
    space.forget_object(&label).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Which object a sequence of contacts is of, in which pose, and where the next touch would tell
/// most. Changes nothing.
///
/// A few such questions are answered at once; further ones are told to come back.
#[utoipa::path(post, path = "/v1/spaces/{space}/objects/identify", tag = "memory",
    operation_id = "identify", params(SpaceParam), request_body = IdentifyQuery,
    responses(
        (status = 200, description = "What the contacts say", body = Identification),
        (status = 404, description = "There is no such space"),
        (status = 422, description = "The query makes no sense")))]
pub(crate) async fn identify(
    SpaceOfPath(space): SpaceOfPath,
    _: NoQuery,
    Json(query): Json<IdentifyQuery>,
) -> Result<Response<Body>, Problem> {
    let (orientation, touches) = decode::touches_to_identify(&query)?;
    let (map, identified) = space.identify(orientation, touches).await?;
    let answer = encode::identification(space.name(), &map, &identified);
    Ok(reply::json(&answer))
}

/// What an agent's episode with an object says so far, and what the latest one said that has ended.
#[utoipa::path(get, path = "/v1/spaces/{space}/agents/{agent}/object", tag = "agents",
    operation_id = "get_agent_object", params(AgentParams),
    responses(
        (status = 200, description = "The episode under way and the latest that has ended, if there are any",
            body = AgentObject),
        (status = 404, description = "There is no such space or agent")))]
pub(crate) async fn of_agent(
    State(service): State<Service>,
    AgentOfPath(space, view): AgentOfPath,
    _: NoQuery,
) -> Result<Response<Body>, Problem> {
    let map = space.snapshot().await?;
    // After the map: an episode that ends in between is told twice and never missed.
    let last = view.ended_episode().as_deref().cloned();
    // All contacts of the episode may be judged anew.
    let answered = service.long.make(move || {
        let answer = answer::agent_object(space.name(), &map, view.id(), view.name(), last);
        reply::json(&answer)
    });
    answered.await
}

/// An object of a name. How densely it was felt may have to be computed.
async fn detail(
    service: &Service,
    map: Arc<CognitiveMap>,
    name: Label,
) -> Result<Option<ObjectDetail>, Problem> {
    let made = service.long.make(move || {
        let id = map.object_by_name(&name)?;
        let object = map.objects().find(|(object, ..)| *object == id)?;
        Some(encode::object_detail(&map, object))
    });
    made.await
}

/// The space that the path names, and the name of an object that may be there or not, or none that
/// an object can have.
pub(crate) struct ObjectOfPath(Arc<Space>, String);

impl FromRequestParts<Service> for ObjectOfPath {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, service: &Service) -> Result<Self, Problem> {
        let params: ObjectParams = path(parts, service).await?;
        Ok(Self(space(parts, service, &params.space)?, params.name))
    }
}
