//! Export of a space's map.

use std::io;
use std::sync::Arc;

use ::trajectory::write_tum;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::Response;
use axum::http::header::{CONTENT_DISPOSITION, HeaderValue};
use cogmap_proto::limits::PAGE_ITEMS_MAX;
use cogmap_proto::{AgentSummary, Landmark, Place, SpaceInfo, TripDetail, Way};
use cognitive_map::{CognitiveMap, LandmarkId, PlaceId, TripId};
use futures_util::stream;
use pose_graph::g2o::write_g2o;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::cloud::{self, CloudForm, PlyEncoding};
use super::extract::{Query, SpaceOfPath, SpaceParam};
use super::held::holding;
use super::long::LongAnswers;
use super::problem::{Kind, Problem};
use super::reply;
use super::state::Service;
use super::trajectory::TUM;
use crate::answer::agent_once_named;
use crate::encode;
use crate::engine::Space;

/// Items that are written at once: an answer of any length takes the memory of this many.
const CHUNK_ITEMS: usize = 256;

/// Form of an export.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ExportFormat {
    /// The whole map as one JSON object.
    #[default]
    Json,
    /// The places as a point cloud.
    Ply,
    /// The causal trajectory of one agent as lines `t x y z qx qy qz qw`.
    Tum,
    /// What agents did and saw as a graph of poses and landmarks, relaxed.
    G2o,
}

/// What to export.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct ExportQuery {
    /// `json` (the map; when absent), `ply` (the places), `tum` (the trajectory of `agent`) or
    /// `g2o` (what agents did and saw as a graph of poses and landmarks, relaxed).
    #[param(inline)]
    format: Option<ExportFormat>,
    /// Name of the agent, for `tum`.
    agent: Option<String>,
    /// Session of the agent, for `tum`; the current one when absent.
    session: Option<u64>,
    /// `ascii` (when absent) or `binary` (little-endian, with strength and stamps), for `ply`.
    #[param(inline)]
    encoding: Option<PlyEncoding>,
    /// Only places that were recruited, moved, visited or forgotten after this revision of the map,
    /// for binary `ply`; others may be among them.
    since_revision: Option<u64>,
}

/// A whole map.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct MapExport {
    /// The space.
    space: SpaceInfo,
    /// Its agents, by name, where they were when the request came.
    agents: Vec<AgentSummary>,
    /// Its places, by number.
    places: Vec<Place>,
    /// Its trips, by number, with their legs.
    trips: Vec<TripDetail>,
    /// Its ways, each between two places.
    ways: Vec<Way>,
    /// Its landmarks, in the order of learning.
    landmarks: Vec<Landmark>,
}

/// Export the map of a space.
///
/// The map is as it was when the request came, whatever happens while it is sent. For a graph the
/// whole map is relaxed, which may take seconds; all who ask meanwhile get the same one after it.
///
/// A binary point cloud has the vertex properties `id`, `x`, `y`, `z` \[m\], `strength`, `visits`,
/// `first_s` and `last_s` (stamps \[s\]), and names its `revision` in a comment. Who asks again
/// with `since_revision` gets the places that changed since, and the numbers of forgotten ones as a
/// second element `forgotten`. Where the comment `since_revision` says 0, these are all places: the
/// service does not know what changed, or that would be more.
#[utoipa::path(get, path = "/v1/spaces/{space}/export",
    tag = "spaces", operation_id = "export_space",
    params(SpaceParam, ExportQuery),
    responses(
        (status = 200, description = "The map", content(
            (MapExport = "application/json"), (String = "text/plain"),
            (Vec<u8> = "application/octet-stream"))),
        (status = 404, description = "There is no such space or agent"),
        (status = 410, description = "The agent has been removed: name one of its sessions"),
        (status = 422, description = "Parameters do not go together, such as `agent` with another format than `tum`")))]
pub(crate) async fn get(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    Query(query): Query<ExportQuery>,
) -> Result<Response<Body>, Problem> {
    let format = query.format.unwrap_or_default();
    if format != ExportFormat::Tum && (query.agent.is_some() || query.session.is_some()) {
        let detail = "`agent` and `session` are for format=tum only";
        return Err(Problem::new(Kind::InvalidQuery, detail));
    }
    let form = cloud_form(&query, format)?;
    let long = &service.long;
    let (mut response, file) = match format {
        ExportFormat::Json => (map(long, &space).await?, format!("{}.json", space.name())),
        ExportFormat::G2o => (graph(long, &space).await?, format!("{}.g2o", space.name())),
        ExportFormat::Ply => {
            let cloud = cloud::body(long, &space, form).await?;
            (cloud, format!("{}.ply", space.name()))
        }
        ExportFormat::Tum => {
            let detail = "format=tum needs agent";
            let agent = query
                .agent
                .ok_or_else(|| Problem::new(Kind::InvalidQuery, detail))?;
            agent_once_named(&space, &agent)?;
            let file = format!("{}-{agent}.tum", space.name());
            (trajectory(long, space, agent, query.session).await?, file)
        }
    };
    if let Ok(disposition) = HeaderValue::try_from(format!("attachment; filename=\"{file}\"")) {
        response
            .headers_mut()
            .insert(CONTENT_DISPOSITION, disposition);
    }
    Ok(response)
}

/// The form of a point cloud that a query asks for.
fn cloud_form(query: &ExportQuery, format: ExportFormat) -> Result<CloudForm, Problem> {
    let refused = |detail| Err(Problem::new(Kind::InvalidQuery, detail));
    match (query.encoding, query.since_revision) {
        (Some(_), _) | (_, Some(_)) if format != ExportFormat::Ply => {
            refused("`encoding` and `since_revision` are for format=ply only")
        }
        (Some(PlyEncoding::Binary), since) => Ok(CloudForm::Binary {
            since_revision: since.unwrap_or(0),
        }),
        (_, Some(_)) => refused("`since_revision` is for encoding=binary only"),
        (_, None) => Ok(CloudForm::Ascii),
    }
}

/// A list of an export that can be written from any of its items on: their numbers, and them as
/// JSON.
type Section = fn(&CognitiveMap, &[AgentSummary], u32) -> Vec<(u32, String)>;

/// The lists of the map with their names.
const SECTIONS: [(&str, Section); 5] = [
    ("agents", |_, agents, first| {
        let agents = (0..).zip(agents.iter()).skip(first as usize);
        agents
            .take(CHUNK_ITEMS)
            .map(|(at, agent)| (at, text(agent)))
            .collect()
    }),
    ("places", |map, _, first| {
        let places = map.places_from(PlaceId(first)).take(CHUNK_ITEMS);
        places
            .map(|(id, place)| (id.0, text(&encode::place(map, id, place))))
            .collect()
    }),
    ("trips", |map, _, first| {
        // A trip has up to a thousand legs.
        let trips = map.trips_from(TripId(first)).take(1);
        trips
            .map(|(id, trip)| (id.0, text(&encode::trip_detail(map, id, trip))))
            .collect()
    }),
    ("ways", |map, _, first| {
        let ways = map.ways_from(first).take(CHUNK_ITEMS);
        ways.filter_map(|(number, way)| Some((number, text(&encode::way(map, way)?))))
            .collect()
    }),
    ("landmarks", |map, _, first| {
        let known = (first..).map_while(|id| Some((id, map.landmark(LandmarkId(id))?)));
        // One with several names once, and those that are set aside not at all.
        let told = known.filter(|(id, landmark)| {
            let named = map.landmark_by_label(landmark.label().as_str());
            named.is_some_and(|(named, _)| named.0 == *id)
        });
        told.take(CHUNK_ITEMS)
            .map(|(id, landmark)| (id, text(&encode::landmark(landmark))))
            .collect()
    }),
];

async fn map(long: &LongAnswers, space: &Arc<Space>) -> Result<Response<Body>, Problem> {
    let room = long.enter()?;
    let map = space.snapshot().await?;
    let head = {
        let (space, map) = (Arc::clone(space), Arc::clone(&map));
        std::iter::once_with(move || {
            let info = encode::space_info(space.name(), space.settings(), &map);
            format!("{{\"space\":{}", text(&info))
        })
    };
    let views = space.agents_after(None, usize::MAX);
    let agents: Arc<[_]> = views
        .iter()
        .map(|view| AgentSummary {
            name: view.name().to_owned(),
            estimate: view.estimate(),
        })
        .collect();
    let lists = SECTIONS.into_iter().flat_map(move |(name, section)| {
        let (map, agents) = (Arc::clone(&map), Arc::clone(&agents));
        let (mut first, mut separator) = (Some(0), "");
        let items = std::iter::from_fn(move || {
            let (numbers, items): (Vec<_>, Vec<_>) =
                section(&map, &agents, first?).into_iter().unzip();
            // Numbers have gaps where something was forgotten.
            first = numbers.last()?.checked_add(1);
            let written = format!("{separator}{}", items.join(","));
            separator = ",";
            Some(written)
        });
        let open = std::iter::once(format!(",\"{name}\":["));
        open.chain(items).chain(std::iter::once("]".to_owned()))
    });
    let texts = head.chain(lists).chain(std::iter::once("}".to_owned()));
    Ok(reply::with_type("application/json", long.body(room, texts)))
}

/// The graph, in the memory of its whole text: that of the relaxation is larger.
async fn graph(long: &LongAnswers, space: &Space) -> Result<Response<Body>, Problem> {
    let room = long.enter()?;
    let graph = space.graph(|map| write_g2o(&map.pose_graph())).await?;
    let body = Body::from(Bytes::from_owner(graph));
    // Who reads it slowly holds on to all of it.
    Ok(reply::with_type(TUM, holding(body, room)))
}

async fn trajectory(
    long: &LongAnswers,
    space: Arc<Space>,
    agent: String,
    session: Option<u64>,
) -> Result<Response<Body>, Problem> {
    let room = long.enter()?;
    // The first page comes before the answer's head, so that its errors can still be told.
    let first = space
        .trajectory(&agent, session, None, None, PAGE_ITEMS_MAX)
        .await?;
    let session = first.session;
    let long = long.clone();
    let pages = stream::try_unfold(Some(first), move |page| {
        let _ = &room; // as long as there are pages
        let (long, space, agent) = (long.clone(), Arc::clone(&space), agent.clone());
        async move {
            let Some(page) = page else { return Ok(None) };
            let next = match page.next_from_ns {
                None => None,
                from => Some(
                    space
                        .trajectory(&agent, Some(session), from, None, PAGE_ITEMS_MAX)
                        .await
                        .map_err(io::Error::other)?,
                ),
            };
            let text = long.make(move || write_tum(&page.poses)).await;
            let text = text.map_err(|_| io::ErrorKind::Interrupted)?;
            Ok::<_, io::Error>(Some((Bytes::from(text), next)))
        }
    });
    Ok(reply::with_type(TUM, Body::from_stream(pages)))
}

fn text<T: Serialize>(message: &T) -> String {
    serde_json::to_string(message).expect("plain data encodes")
}
