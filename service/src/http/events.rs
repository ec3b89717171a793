//! Events of a space: as they happen (server-sent events), or the latest ones page by page.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::body::Body;
use axum::extract::State;
use axum::http::header::ACCEPT;
use axum::http::{HeaderMap, Response};
use axum::response::IntoResponse;
use axum::response::sse::{Event, KeepAlive, Sse};
use cogmap_proto::{EventId, EventPage, EventRecord, MissedEvents};
use futures_util::{Stream, StreamExt, stream};
use serde::{Deserialize, Serialize};
use tokio::sync::OwnedSemaphorePermit;
use utoipa::ToSchema;

use super::extract::{Query, SpaceOfPath, SpaceParam};
use super::page;
use super::problem::{Kind, Problem};
use super::reply;
use super::state::Service;
use crate::answer::agent_once_named;
use crate::engine::{EVENTS_KEPT, EventFollower, Space};
use crate::metrics::HTTP_STREAMS;

/// A comment goes out after this long without an event: proxies cut silent connections after a
/// minute or so.
const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// Events that are taken at once.
const TAKEN_AT_ONCE: usize = 64;
/// By this header a browser says which event it had last.
const LAST_EVENT_ID: &str = "last-event-id";
/// How long a stream waits for its space to load, and how often it looks: a browser that is refused
/// does not come back by itself.
const LOADING_MAX: Duration = Duration::from_secs(5);
const LOADING_POLL: Duration = Duration::from_millis(20);

/// Form of events.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "lowercase")]
pub(crate) enum EventFormat {
    /// Server-sent events.
    Stream,
    /// One page as JSON.
    Json,
}

/// Which events.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct EventsQuery {
    /// Only events that the agent with this name caused.
    agent: Option<String>,
    /// Only events after the one with this id; `0-0` for all that are kept. A stream without it
    /// begins with what happens next.
    #[param(value_type = Option<String>, pattern = "^[0-9]+-[0-9]+$")]
    after: Option<EventId>,
    /// `stream` or `json`; when absent, `json` if `Accept` asks for application/json.
    #[param(inline)]
    format: Option<EventFormat>,
    /// Most events of a page; 100 when absent. For pages only.
    #[param(minimum = 1, maximum = 1000)]
    limit: Option<u32>,
}

/// One server-sent event of a stream: `id`, `event` and `data`, a line each.
#[derive(Debug, Serialize, ToSchema)]
#[serde(tag = "event", rename_all = "lowercase")]
#[expect(dead_code, reason = "describes the lines of a stream")]
pub(crate) enum ServerSentEvent {
    /// Something happened.
    Message {
        /// Id of the event; a reader that comes back names it in `Last-Event-ID`.
        id: String,
        /// The event, as JSON.
        data: cogmap_proto::Event,
    },
    /// Events were missed before the next one.
    Missed {
        /// How many, and where the stream goes on, as JSON.
        data: MissedEvents,
    },
}

/// Follow the events of a space, or page through the latest ones.
///
/// A stream of server-sent events, each with its `id`, `event: message` and an Event as its `data`.
/// Who comes back names the last one in the header `Last-Event-ID`, as browsers do by themselves,
/// or in `after`, and gets what happened since. The latest 1024 are kept, also over a restart. Who
/// comes back later or cannot keep up is told so by `event: missed`, and how many, where that is
/// known. The stream ends when the service stops or the space is deleted.
#[utoipa::path(get, path = "/v1/spaces/{space}/events",
    tag = "spaces", operation_id = "follow_events",
    params(SpaceParam, EventsQuery, ("Last-Event-ID" = Option<String>, Header,
        description = "As `after`, and before it", pattern = "^[0-9]+-[0-9]+$")),
    responses(
        (status = 200, description = "The events", content(
            (ServerSentEvent = "text/event-stream"), (EventPage = "application/json"))),
        (status = 404, description = "There is no such space or agent"),
        (status = 422, description = "A parameter breaks a rule")))]
pub(crate) async fn get(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    Query(query): Query<EventsQuery>,
    headers: HeaderMap,
) -> Result<Response<Body>, Problem> {
    loaded(&space).await;
    if let Some(name) = &query.agent {
        agent_once_named(&space, name)?;
    }
    let after = last_event_id(&headers)?.or(query.after);
    if query.format.unwrap_or_else(|| accepted(&headers)) == EventFormat::Json {
        let limit = page::limit(query.limit)?;
        let first = after.unwrap_or_default();
        let mut page = read_page(space.follow(Some(first))?, limit, query.agent.as_deref());
        page.next = page.next.or(after);
        page.missed = page.missed.filter(|_| after.is_some());
        return Ok(reply::json(&page));
    }
    if query.limit.is_some() {
        let detail = "`limit` is for format=json only";
        return Err(Problem::new(Kind::InvalidQuery, detail));
    }
    let permit = service.streams.clone().try_acquire_owned();
    let permit = permit.map_err(|_| Problem::new(Kind::Busy, "too many event streams are open"))?;
    let open = OpenStream::new(permit);
    let follower = space.follow(after)?;
    let mut stopping = service.stopping.clone();
    let stopped = async move {
        // A dropped sender means the same as a sent stop.
        let _ = stopping.wait_for(|stopping| *stopping).await;
    };
    let events = lines(follower, query.agent).take_until(Box::pin(stopped));
    let events = events.map(move |event| {
        let _ = &open;
        Ok::<_, Infallible>(event)
    });
    Ok(Sse::new(events)
        .keep_alive(KeepAlive::new().interval(KEEP_ALIVE))
        .into_response())
}

/// The form that `Accept` asks for; a stream if it asks for none, or for both.
fn accepted(headers: &HeaderMap) -> EventFormat {
    let accept = headers.get(ACCEPT).and_then(|accept| accept.to_str().ok());
    let accept = accept.unwrap_or_default();
    if accept.contains("application/json") && !accept.contains("text/event-stream") {
        EventFormat::Json
    } else {
        EventFormat::Stream
    }
}

/// The id in the header of a reader that comes back.
fn last_event_id(headers: &HeaderMap) -> Result<Option<EventId>, Problem> {
    let Some(given) = headers.get(LAST_EVENT_ID) else {
        return Ok(None);
    };
    let text = String::from_utf8_lossy(given.as_bytes());
    let id = text.parse().map_err(|error| {
        let detail = format!("Last-Event-ID: {error}");
        Problem::new(Kind::InvalidParameter, detail)
    })?;
    Ok(Some(id))
}

/// Waits until a space has loaded, not for ever: one that is still loading then is refused as
/// others that cannot be read.
async fn loaded(space: &Space) {
    let loaded = async {
        while space.recovering() {
            tokio::time::sleep(LOADING_POLL).await;
        }
    };
    let _ = tokio::time::timeout(LOADING_MAX, loaded).await;
}

/// Up to `limit` events, those of one agent or of all.
fn read_page(mut follower: EventFollower, limit: usize, agent: Option<&str>) -> EventPage {
    let followed = follower.take(EVENTS_KEPT);
    let mut page = EventPage {
        events: Vec::new(),
        missed: followed.missed,
        next: None,
    };
    for record in followed.events {
        if page.events.len() == limit {
            break;
        }
        page.next = Some(record.id);
        if agent.is_none_or(|agent| agent == record.event.agent) {
            page.events.push(EventRecord::clone(&record));
        }
    }
    page
}

/// The events of a stream, those of one agent or of all.
fn lines(follower: EventFollower, agent: Option<String>) -> impl Stream<Item = Event> {
    let state = (follower, agent, VecDeque::new());
    stream::unfold(state, |(mut follower, agent, mut ready)| async move {
        loop {
            if let Some(event) = ready.pop_front() {
                return Some((event, (follower, agent, ready)));
            }
            let followed = follower.take(TAKEN_AT_ONCE);
            let taken = !followed.events.is_empty();
            ready.extend(followed.missed.map(|missed| missed_line(&missed)));
            let wanted = |record: &&Arc<EventRecord>| {
                { agent.as_ref() }.is_none_or(|agent| *agent == record.event.agent)
            };
            ready.extend(
                followed
                    .events
                    .iter()
                    .filter(wanted)
                    .map(|record| line(record)),
            );
            if ready.is_empty() && !taken && !follower.wait().await {
                return None;
            }
        }
    })
}

fn line(record: &EventRecord) -> Event {
    let data = serde_json::to_string(&record.event).expect("plain data encodes");
    let event = Event::default().id(record.id.to_string()).event("message");
    event.data(data)
}

fn missed_line(missed: &MissedEvents) -> Event {
    let data = serde_json::to_string(missed).expect("plain data encodes");
    Event::default().event("missed").data(data)
}

/// Counts a stream as long as it lives.
struct OpenStream {
    _permit: OwnedSemaphorePermit,
}

impl OpenStream {
    fn new(permit: OwnedSemaphorePermit) -> Self {
        metrics::gauge!(HTTP_STREAMS).increment(1.0);
        Self { _permit: permit }
    }
}

impl Drop for OpenStream {
    fn drop(&mut self) {
        metrics::gauge!(HTTP_STREAMS).decrement(1.0);
    }
}
