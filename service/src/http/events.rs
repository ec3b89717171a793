//! Events of a space, as they happen (server-sent events).

use std::convert::Infallible;
use std::time::Duration;

use axum::extract::State;
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::StreamExt;
use futures_util::future::ready;
use serde::Deserialize;
use tokio::sync::OwnedSemaphorePermit;
use tokio_stream::wrappers::BroadcastStream;
use tokio_stream::wrappers::errors::BroadcastStreamRecvError;

use super::extract::{Query, SpaceOfPath, SpaceParam};
use super::problem::{Kind, Problem};
use super::state::Service;
use crate::metrics::HTTP_STREAMS;

/// A comment goes out after this long without an event: proxies cut silent connections after a
/// minute or so.
const KEEP_ALIVE: Duration = Duration::from_secs(15);

/// Which events.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct EventsQuery {
    /// Only events that the agent with this name caused.
    agent: Option<String>,
}

/// Follow the events of a space.
///
/// Server-sent events from now on, each with an Event as its data. A reader who cannot keep up
/// misses events; an event of type `lagged` then says how many. The stream ends when the service
/// stops or the space is deleted.
#[utoipa::path(get, path = "/v1/spaces/{space}/events", tag = "spaces", operation_id = "follow_events",
    params(SpaceParam, EventsQuery),
    responses(
        (status = 200, description = "The events", body = String, content_type = "text/event-stream"),
        (status = 404, description = "There is no such space")))]
pub(crate) async fn get(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    Query(query): Query<EventsQuery>,
) -> Result<Response, Problem> {
    let permit = service.streams.clone().try_acquire_owned();
    let permit = permit.map_err(|_| Problem::new(Kind::Busy, "too many event streams are open"))?;
    let open = OpenStream::new(permit);
    let mut stopping = service.stopping.clone();
    let stopped = async move {
        // A dropped sender means the same as a sent stop.
        let _ = stopping.wait_for(|stopping| *stopping).await;
    };
    let events = BroadcastStream::new(space.events()).take_until(stopped);
    let events = events.filter_map(move |received| {
        let _ = &open;
        ready(sent(received.as_deref(), query.agent.as_deref()).map(Ok::<_, Infallible>))
    });
    Ok(Sse::new(events)
        .keep_alive(KeepAlive::new().interval(KEEP_ALIVE))
        .into_response())
}

/// What goes out for what was received.
fn sent(
    received: Result<&cogmap_proto::Event, &BroadcastStreamRecvError>,
    agent: Option<&str>,
) -> Option<Event> {
    match received {
        Ok(event) if agent.is_none_or(|agent| agent == event.agent) => {
            let data = serde_json::to_string(event).expect("plain data encodes");
            Some(Event::default().data(data))
        }
        Ok(_) => None,
        Err(BroadcastStreamRecvError::Lagged(missed)) => Some(
            Event::default()
                .event("lagged")
                .data(format!("{{\"missed\":{missed}}}")),
        ),
    }
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
