//! A space as it changes: ticks at a steady rate, as server-sent events.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::State;
use axum::http::Response;
use axum::response::IntoResponse;
use axum::response::sse::{Event, Sse};
use cogmap_proto::LiveTick;
use futures_util::{Stream, StreamExt, stream};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::extract::{Query, SpaceOfPath, SpaceParam};
use super::problem::{Kind, Problem};
use super::state::Service;
use super::streams::{OpenStream, keep_alive, loaded, stopped};
use crate::engine::LiveFollower;
use crate::metrics::resident_bytes;

/// Ticks in a second, when no rate is asked for \[Hz\].
const RATE_DEFAULT_HZ: f64 = 10.0;
/// Lowest and highest rate of ticks \[Hz\]: a tick must come before proxies cut the connection, and
/// no screen shows more.
const RATE_HZ: std::ops::RangeInclusive<f64> = 0.1..=60.0;
/// How long the memory of the process is taken to stay as it was measured: to measure it takes as
/// long as the rest of a tick.
const MEMORY_AGE_MAX: Duration = Duration::from_secs(1);

/// How often.
#[derive(Debug, Deserialize, utoipa::IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(crate) struct LiveQuery {
    /// Ticks in a second; 10 when absent.
    #[param(minimum = 0.1, maximum = 60)]
    rate_hz: Option<f64>,
}

/// One server-sent event of a live stream: `event` and `data`, a line each.
#[derive(Debug, Serialize, ToSchema)]
#[serde(tag = "event", rename_all = "lowercase")]
#[expect(dead_code, reason = "describes the lines of a stream")]
pub(crate) enum LiveEvent {
    /// What changed since the tick before.
    Tick {
        /// The tick, as JSON.
        data: Box<LiveTick>,
    },
    /// The reader was too slow: ticks were left out. The next one has all that changed.
    Lagged {
        /// How many, as JSON.
        data: LaggedTicks,
    },
}

/// Ticks that were left out.
#[derive(Debug, Serialize, ToSchema)]
pub(crate) struct LaggedTicks {
    /// How many.
    ticks: u64,
}

/// Watch a space as it changes.
///
/// A stream of server-sent events. Each `event: tick` has a `LiveTick` as its `data`: what changed
/// since the tick before, and everything in the first one. Who reads more slowly than ticks come is
/// told so by `event: lagged`, and gets fewer of them; each has all that changed since the one
/// before, so nothing but events and sightings beyond those that are kept is missed. The stream
/// ends when the service stops or the space is deleted.
#[utoipa::path(get, path = "/v1/spaces/{space}/live", tag = "spaces", operation_id = "watch_space",
    params(SpaceParam, LiveQuery),
    responses(
        (status = 200, description = "The ticks", content((LiveEvent = "text/event-stream"))),
        (status = 404, description = "There is no such space"),
        (status = 422, description = "The rate is out of range")))]
pub(crate) async fn get(
    State(service): State<Service>,
    SpaceOfPath(space): SpaceOfPath,
    Query(query): Query<LiveQuery>,
) -> Result<Response<Body>, Problem> {
    let rate_hz = query.rate_hz.unwrap_or(RATE_DEFAULT_HZ);
    if !RATE_HZ.contains(&rate_hz) {
        let (least, most) = (RATE_HZ.start(), RATE_HZ.end());
        let detail = format!("rate_hz is {rate_hz}; it must be from {least} to {most}");
        return Err(Problem::new(Kind::InvalidQuery, detail));
    }
    loaded(&space).await;
    let open = OpenStream::open(&service)?;
    let ticks = ticks(space.watch().await?, Duration::from_secs_f64(1.0 / rate_hz));
    // A stream that holds on to the space would keep it from being deleted.
    drop(space);
    let ticks = ticks.take_until(Box::pin(stopped(&service)));
    let ticks = ticks.map(move |event| {
        let _ = &open;
        Ok::<_, Infallible>(event)
    });
    Ok(Sse::new(ticks).keep_alive(keep_alive()).into_response())
}

/// When ticks are due.
#[derive(Debug)]
struct Pace {
    period: Duration,
    due: Instant,
}

/// The memory of the process, as it was measured last.
#[derive(Debug, Default)]
struct Memory(Option<(Instant, Option<u64>)>);

impl Pace {
    /// Number of whole periods that the next tick is overdue.
    fn overdue(&self, now: Instant) -> u32 {
        let late = now.saturating_duration_since(self.due);
        let periods = late.as_nanos() / self.period.as_nanos();
        u32::try_from(periods).unwrap_or(u32::MAX)
    }

    /// The next tick is due at the first whole period after `now`.
    fn go_on(&mut self, now: Instant) {
        self.due += self.period * self.overdue(now).saturating_add(1);
    }
}

impl Memory {
    fn bytes(&mut self, now: Instant) -> Option<u64> {
        match self.0 {
            Some((at, bytes)) if now.saturating_duration_since(at) < MEMORY_AGE_MAX => bytes,
            _ => {
                let bytes = resident_bytes();
                self.0 = Some((now, bytes));
                bytes
            }
        }
    }
}

/// The events of a stream. A tick is made when the reader can take it and it is due; this is asked
/// for the next event as soon as the reader has room for it.
fn ticks(follower: LiveFollower, period: Duration) -> impl Stream<Item = Event> {
    let due = Instant::now();
    let state = (follower, Pace { period, due }, Memory::default());
    stream::unfold(
        (state, VecDeque::new()),
        |(mut state, mut ready)| async move {
            if ready.is_empty() {
                let (follower, pace, memory) = &mut state;
                // A late reader finds the tick overdue. A service that wakes up late does not say
                // that of its reader.
                let lagged = pace.overdue(Instant::now());
                tokio::select! {
                    () = tokio::time::sleep_until(pace.due.into()) => {}
                    () = follower.gone() => return None,
                }
                let now = Instant::now();
                pace.go_on(now);
                let mut tick = follower.take(now)?;
                tick.health.resident_bytes = memory.bytes(now);
                if lagged > 0 {
                    let ticks = lagged.into();
                    ready.push_back(event("lagged", &LaggedTicks { ticks }));
                }
                ready.push_back(event("tick", &tick));
            }
            let next = ready.pop_front()?;
            Some((next, (state, ready)))
        },
    )
}

fn event<T: Serialize>(name: &str, data: &T) -> Event {
    let data = serde_json::to_string(data).expect("plain data encodes");
    Event::default().event(name).data(data)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_that_are_left_out_are_counted_and_the_next_is_due_in_step() {
        let start = Instant::now();
        let period = Duration::from_millis(100);
        let at = |ms: u64| start + Duration::from_millis(ms);
        let mut pace = Pace { period, due: start };
        assert_eq!(pace.overdue(at(0)), 0);
        pace.go_on(at(2));
        assert_eq!(pace.due, at(100));
        assert_eq!((pace.overdue(at(50)), pace.overdue(at(199))), (0, 0));
        assert_eq!(pace.overdue(at(455)), 3, "those of 100, 200 and 300 ms");
        pace.go_on(at(455));
        assert_eq!(pace.due, at(500));
    }
}
