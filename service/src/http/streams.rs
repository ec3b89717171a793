//! What streams of server-sent events have in common.

use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use axum::response::sse::KeepAlive;
use tokio::sync::OwnedSemaphorePermit;

use super::problem::{Kind, Problem};
use super::state::Shared;
use crate::engine::Space;
use crate::metrics::HTTP_STREAMS;

/// A comment goes out after this long without an event: proxies cut silent connections after a
/// minute or so.
const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// How long a stream waits for its space to load, and how often it looks: a browser that is refused
/// does not come back by itself.
const LOADING_MAX: Duration = Duration::from_secs(5);
const LOADING_POLL: Duration = Duration::from_millis(20);

/// Counts a stream as long as it lives.
pub(crate) struct OpenStream {
    _permit: OwnedSemaphorePermit,
}

impl OpenStream {
    /// Room for one more stream, if there is any.
    pub(crate) fn open(service: &Shared) -> Result<Self, Problem> {
        let permit = Arc::clone(&service.streams).try_acquire_owned();
        let permit =
            permit.map_err(|_| Problem::new(Kind::Busy, "too many event streams are open"))?;
        metrics::gauge!(HTTP_STREAMS).increment(1.0);
        Ok(Self { _permit: permit })
    }
}

impl Drop for OpenStream {
    fn drop(&mut self) {
        metrics::gauge!(HTTP_STREAMS).decrement(1.0);
    }
}

/// Comments that keep a connection open.
pub(crate) fn keep_alive() -> KeepAlive {
    KeepAlive::new().interval(KEEP_ALIVE)
}

/// Ends when the service stops.
pub(crate) fn stopped(service: &Shared) -> impl Future<Output = ()> + Send + use<> {
    let mut stopping = service.stopping.clone();
    async move {
        // A dropped sender means the same as a sent stop.
        let _ = stopping.wait_for(|stopping| *stopping).await;
    }
}

/// Waits until a space has loaded, not for ever: one that is still loading then is refused as
/// others that cannot be read.
pub(crate) async fn loaded(space: &Space) {
    let loaded = async {
        while space.recovering() {
            tokio::time::sleep(LOADING_POLL).await;
        }
    };
    let _ = tokio::time::timeout(LOADING_MAX, loaded).await;
}
