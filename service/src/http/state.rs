//! What handlers share.

use std::sync::Arc;

use metrics_exporter_prometheus::PrometheusHandle;
use tokio::sync::{Semaphore, watch};

use super::settings::HttpSettings;
use crate::engine::Engine;

/// What handlers share. Clones share it too.
#[derive(Clone)]
pub(crate) struct Service {
    pub(crate) engine: Engine,
    pub(crate) prometheus: PrometheusHandle,
    /// One permit for each event stream.
    pub(crate) streams: Arc<Semaphore>,
    /// Turns true when the service stops; event streams end then.
    pub(crate) stopping: watch::Receiver<bool>,
}

impl Service {
    pub(crate) fn new(
        engine: Engine,
        prometheus: PrometheusHandle,
        settings: &HttpSettings,
        stopping: watch::Receiver<bool>,
    ) -> Self {
        let streams = Arc::new(Semaphore::new(settings.streams_max));
        Self {
            engine,
            prometheus,
            streams,
            stopping,
        }
    }
}
