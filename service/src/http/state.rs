//! What handlers share.

use std::sync::Arc;

use metrics_exporter_prometheus::PrometheusHandle;
use tokio::sync::{Semaphore, watch};

use super::long::LongAnswers;
use super::settings::HttpSettings;
use crate::cluster::Cluster;
use crate::engine::Engine;

/// What HTTP answers from.
#[derive(Clone, Debug)]
pub struct Served {
    /// The spaces that are here.
    pub engine: Engine,
    /// The cluster that this service is a node of, if it is one.
    pub cluster: Option<Cluster>,
    /// What this node follows of other nodes' spaces.
    pub replicas: Option<Engine>,
}

/// A service by itself.
impl From<Engine> for Served {
    fn from(engine: Engine) -> Self {
        Self {
            engine,
            cluster: None,
            replicas: None,
        }
    }
}

/// The service, as handlers see it. One counted pointer, because each request clones it.
pub(crate) type Service = Arc<Shared>;

/// What handlers share.
pub(crate) struct Shared {
    pub(crate) engine: Engine,
    pub(crate) cluster: Option<Cluster>,
    /// What is followed of other nodes' spaces.
    pub(crate) replicas: Option<Engine>,
    /// The way to other nodes.
    pub(crate) forwarder: super::forwarder::Forwarder,
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
        served: Served,
        prometheus: PrometheusHandle,
        settings: &HttpSettings,
        stopping: watch::Receiver<bool>,
        paths: Vec<String>,
    ) -> Self {
        let streams = Arc::new(Semaphore::new(settings.streams_max));
        Self {
            engine: served.engine,
            cluster: served.cluster,
            replicas: served.replicas,
            forwarder: super::forwarder::Forwarder::default(),
            prometheus,
            streams,
            long: LongAnswers::default(),
            stopping,
            paths,
        }
    }
}
