//! The composition root: the whole service from its settings.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use metrics_exporter_prometheus::PrometheusHandle;
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use zenoh::Session;

use crate::config::{Config, ConfigError};
use crate::engine::{Engine, Outlet, Silent, SpaceError};
use crate::http;
use crate::metrics;
use crate::store::{FjallStore, StoreError};
use crate::transport::{self, Intake, TransportError, TransportSettings, ZenohOutlet};

/// Longest wait for the Zenoh session to close.
const SESSION_CLOSE_TIMEOUT: Duration = Duration::from_secs(2);

/// A running service.
#[derive(Debug)]
pub struct Service {
    engine: Engine,
    address: SocketAddr,
    session: Option<Session>,
    intake: Option<Intake>,
    stop_http: oneshot::Sender<()>,
    http: JoinHandle<std::io::Result<()>>,
    upkeep: JoinHandle<()>,
}

/// Why the service does not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The settings.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The store.
    #[error("store {directory}")]
    Store {
        /// Its directory.
        directory: String,
        /// Why.
        source: StoreError,
    },
    /// Zenoh.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// A space named in the settings.
    #[error("space {name}")]
    Space {
        /// Its name.
        name: String,
        /// Why.
        source: SpaceError,
    },
    /// The HTTP listener.
    #[error("listen on {address}")]
    Http {
        /// Its address.
        address: SocketAddr,
        /// Why.
        source: std::io::Error,
    },
}

impl Service {
    /// Opens the store, the Zenoh session and the HTTP listener, and begins to serve. Spaces may
    /// still be loading when it returns.
    ///
    /// # Errors
    /// See [`StartError`].
    pub async fn start(config: &Config, prometheus: PrometheusHandle) -> Result<Self, StartError> {
        let directory = &config.store.directory;
        let of_store = |source| StartError::Store {
            directory: directory.display().to_string(),
            source,
        };
        let store = Arc::new(FjallStore::open(directory).map_err(of_store)?);

        // The port first: whoever finds it taken should not have disturbed anyone else by then.
        let address = config.http.listen;
        let of_http = |source| StartError::Http { address, source };
        let listener = TcpListener::bind(address).await.map_err(of_http)?;
        if config.http.is_open() {
            tracing::warn!(%address, "anyone who reaches this address can read and write: set http.token");
        }
        let address = listener.local_addr().map_err(of_http)?;

        let session = match transport_settings(config) {
            Some(settings) => Some(transport::open(&settings).await?),
            None => None,
        };
        let outlet: Arc<dyn Outlet> = match &session {
            Some(session) => {
                let codec = config.zenoh.encoding.codec();
                Arc::new(ZenohOutlet::declare(session.clone(), codec).await?)
            }
            None => Arc::new(Silent),
        };
        let engine = Engine::open(store, config.engine.settings(), outlet).map_err(of_store)?;
        for (name, settings) in &config.spaces {
            if let Some(space) = engine.space(name.as_str()) {
                if space.settings() != settings {
                    tracing::warn!(space = %name,
                        "the settings given for the space are without effect: they were fixed when it was created");
                }
                continue;
            }
            engine
                .create_space(name, settings)
                .map_err(|source| StartError::Space {
                    name: name.to_string(),
                    source,
                })?;
        }
        let intake = match &session {
            Some(session) => Some(Intake::start(session, &engine).await?),
            None => None,
        };
        let upkeep = tokio::spawn(metrics::upkeep(prometheus.clone(), directory.clone()));
        let (stop_http, stopped) = oneshot::channel();
        let http = tokio::spawn(http::run(
            listener,
            engine.clone(),
            config.http.settings(),
            prometheus,
            async {
                // A dropped sender means the same as a sent stop.
                let _ = stopped.await;
            },
        ));
        Ok(Self {
            engine,
            address,
            session,
            intake,
            stop_http,
            http,
            upkeep,
        })
    }

    /// The engine.
    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The Zenoh session, if there is one.
    pub fn session(&self) -> Option<&Session> {
        self.session.as_ref()
    }

    /// Address of the HTTP interface.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Takes no more samples, answers what is under way, makes everything durable, checkpoints.
    pub async fn stop(self) {
        drop(self.intake);
        let _ = self.stop_http.send(());
        match self.http.await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => tracing::error!(%error, "http"),
            Err(error) => tracing::error!(%error, "the http task ended with a panic"),
        }
        self.upkeep.abort();
        let engine = self.engine;
        if tokio::task::spawn_blocking(move || engine.shutdown())
            .await
            .is_err()
        {
            tracing::error!("the engine's shutdown ended with a panic");
        }
        if let Some(session) = self.session
            && tokio::time::timeout(SESSION_CLOSE_TIMEOUT, session.close())
                .await
                .is_err()
        {
            tracing::warn!("the zenoh session did not close in time");
        }
    }
}

fn transport_settings(config: &Config) -> Option<TransportSettings> {
    let zenoh = &config.zenoh;
    zenoh.enabled.then(|| TransportSettings {
        mode: zenoh.mode.as_str().to_owned(),
        listen: zenoh.listen.clone(),
        connect: zenoh.connect.clone(),
        config_file: zenoh.config_file.clone(),
    })
}
