//! The composition root: the whole service from its settings.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use metrics_exporter_prometheus::PrometheusHandle;
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use zenoh::Session;

use crate::config::{Config, ConfigError};
use crate::engine::{self, Engine, Outlet, Silent, SpaceError, core_settings};
use crate::http;
use crate::metrics;
use crate::store::{self, Journal, LocalStore, StoreError};
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
    /// Opens the HTTP listener, the Zenoh session and the store, and begins to serve. Spaces may still
    /// be loading when it returns. A start that fails leaves no store behind that was not there.
    ///
    /// # Errors
    /// See [`StartError`].
    pub async fn start(config: &Config, prometheus: PrometheusHandle) -> Result<Self, StartError> {
        // What may fail comes in the order of what it leaves behind: settings nothing, a port or a
        // session nothing that outlives the process, the store files.
        for (name, settings) in &config.spaces {
            core_settings(settings).map_err(|source| StartError::Space {
                name: name.to_string(),
                source: source.into(),
            })?;
        }
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
            Some(session) => Arc::new(ZenohOutlet::new(
                session.clone(),
                config.zenoh.encoding.codec(),
            )),
            None => Arc::new(Silent),
        };
        let directory = &config.store.directory;
        let of_store = |source| StartError::Store {
            directory: directory.display().to_string(),
            source,
        };
        let store = Arc::new(open_store(directory).map_err(of_store)?);
        let stored = store.spaces().map_err(of_store)?;
        let name_lost = stored.iter().any(|space| space.settings.is_none());
        let engine = Engine::open(store, config.engine.settings(), outlet).map_err(of_store)?;
        for (name, settings) in &config.spaces {
            if let Some(space) = engine.space(name.as_str()) {
                if space.settings() != settings {
                    tracing::warn!(space = %name,
                        "the settings given for the space are without effect: they were fixed when it was created");
                }
                continue;
            }
            if name_lost {
                // A robot must not find an empty map where its own may be.
                tracing::error!(space = %name,
                    "the space is not created: it may be one whose name is lost, see /v1/spaces");
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
        let upkeep = tokio::spawn(metrics::upkeep(prometheus.clone()));
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

/// Opens the store in `directory`, made anew in the present format where it has an older one.
///
/// # Errors
/// See [`LocalStore::open`] and [`store::migrate`].
pub fn open_store(directory: &Path) -> Result<LocalStore, StoreError> {
    store::migrate(directory, engine::samples_in)?;
    LocalStore::open(directory)
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
