//! Export of a space's map.

use std::io;
use std::ops::RangeInclusive;
use std::sync::Arc;

use ::trajectory::write_tum;
use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::Response;
use axum::http::header::{CONTENT_DISPOSITION, HeaderValue};
use cogmap_proto::limits::PAGE_ITEMS_MAX;
use cogmap_proto::{AgentSummary, Codec, Landmark, Place, SpaceInfo, TripDetail, Way};
use cognitive_map::Reverse;
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
use crate::encode::{self, RouteGraph};
use crate::engine::Space;

/// Legal tolerances of thinned ways \[m\].
const TOLERANCES_M: RangeInclusive<f64> = 0.0..=100.0;
/// The tolerance when the query names none \[m\].
const TOLERANCE_M: f64 = 0.1;

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
    /// The ways as a graph in the `GraphML` format.
    Graphml,
    /// The ways as a graph for the Route Server of Nav2 (`GeoJSON`).
    Nav2,
}

/// Which directions of ways to export.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ExportReverse {
    /// Both.
    #[default]
    Allowed,
    /// Only those in which somebody travelled all of it.
    Never,
}

/// What to export.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct ExportQuery {
    /// `json` (the map; when absent), `ply` (the places), `tum` (the trajectory of `agent`), `g2o`
    /// (what agents did and saw as a graph of poses and landmarks, relaxed), `graphml` or `nav2`
    /// (the ways as a graph: in `GraphML`, and in the `GeoJSON` of the Route Server of Nav2).
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
    /// How far places may lie from the edge that stands for a chain of ways \[m\], for `graphml`
    /// and `nav2`; 0.1 when absent.
    #[param(minimum = 0, maximum = 100)]
    tolerance_m: Option<f64>,
    /// `allowed` (when absent), or `never` for only those directions in which somebody travelled,
    /// for `graphml` and `nav2`.
    #[param(inline)]
    reverse: Option<ExportReverse>,
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
            (Vec<u8> = "application/octet-stream"),
            (String = "application/graphml+xml"), (RouteGraph = "application/geo+json"))),
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
    let (tolerance_m, reverse) = thinning(&query, format)?;
    let long = &service.long;
    let (mut response, file) = match format {
        ExportFormat::Json => (map(long, &space).await?, format!("{}.json", space.name())),
        ExportFormat::G2o => (graph(long, &space).await?, format!("{}.g2o", space.name())),
        ExportFormat::Ply => {
            let cloud = cloud::body(long, &space, form).await?;
            (cloud, format!("{}.ply", space.name()))
        }
        ExportFormat::Graphml | ExportFormat::Nav2 => {
            let map = space.snapshot().await?;
            let name = space.name().to_owned();
            let is_nav2 = format == ExportFormat::Nav2;
            let room = long.enter()?;
            let text = long.make(move || {
                if is_nav2 {
                    Codec::Json.encode(&encode::nav2(&name, &map, tolerance_m, reverse))
                } else {
                    encode::graphml(&map, tolerance_m, reverse).into_bytes()
                }
            });
            let (body, (media_type, ending)) = (Body::from(text.await?), graph_type(is_nav2));
            let answer = reply::with_type(media_type, holding(body, room));
            (answer, format!("{}.{ending}", space.name()))
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

/// Media type of a graph of ways, and how its files end.
fn graph_type(is_nav2: bool) -> (&'static str, &'static str) {
    if is_nav2 {
        ("application/geo+json", "geojson")
    } else {
        ("application/graphml+xml", "graphml")
    }
}

/// How ways are to be thinned, and in which directions.
fn thinning(query: &ExportQuery, format: ExportFormat) -> Result<(f64, Reverse), Problem> {
    let refused = |detail: String| Err(Problem::new(Kind::InvalidQuery, detail));
    let is_graph = matches!(format, ExportFormat::Graphml | ExportFormat::Nav2);
    if !is_graph && (query.tolerance_m.is_some() || query.reverse.is_some()) {
        let detail = "`tolerance_m` and `reverse` are for format=graphml and format=nav2 only";
        return refused(detail.to_owned());
    }
    let tolerance_m = query.tolerance_m.unwrap_or(TOLERANCE_M);
    // A comparison with NaN is false.
    if !TOLERANCES_M.contains(&tolerance_m) {
        let (min, max) = (TOLERANCES_M.start(), TOLERANCES_M.end());
        return refused(format!(
            "tolerance_m must be {min} to {max} m, not {tolerance_m}"
        ));
    }
    let reverse = match query.reverse.unwrap_or_default() {
        ExportReverse::Allowed => Reverse::Allowed,
        ExportReverse::Never => Reverse::Never,
    };
    Ok((tolerance_m, reverse))
}

async fn map(long: &LongAnswers, space: &Arc<Space>) -> Result<Response<Body>, Problem> {
    let room = long.enter()?;
    let map = space.snapshot().await?;
    let views = space.agents_after(None, usize::MAX);
    let agents = views.iter().map(|view| AgentSummary {
        heard_ago_s: None, // it is of the moment, and not of the map
        ..view.summary()
    });
    let (name, settings) = (space.name().to_owned(), space.settings().clone());
    let texts = encode::map_export(name, settings, map, agents.collect());
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
