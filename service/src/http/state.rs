//! What handlers share.

use std::sync::Arc;

use metrics_exporter_prometheus::PrometheusHandle;
use tokio::sync::{Semaphore, watch};

use super::long::LongAnswers;
use super::settings::HttpSettings;
use crate::engine::Engine;

/// The service, as handlers see it. One counted pointer, because each request clones it.
pub(crate) type Service = Arc<Shared>;

/// What handlers share.
pub(crate) struct Shared {
    pub(crate) engine: Engine,
    pub(crate) prometheus: PrometheusHandle,
    /// One permit for each event stream.
    pub(crate) streams: Arc<Semaphore>,
    /// Room for answers that take long.
    pub(crate) long: LongAnswers,
    /// Turns true when the service stops; event streams end then.
    pub(crate) stopping: watch::Receiver<bool>,
    /// The paths that there are, as the description has them.
    pub(crate) paths: Vec<String>,
}

impl Shared {
    pub(crate) fn new(
        engine: Engine,
        prometheus: PrometheusHandle,
        settings: &HttpSettings,
        stopping: watch::Receiver<bool>,
        paths: Vec<String>,
    ) -> Self {
        let streams = Arc::new(Semaphore::new(settings.streams_max));
        Self {
            engine,
            prometheus,
            streams,
            long: LongAnswers::default(),
            stopping,
            paths,
        }
    }
}
