//! The composition root: the whole service from its settings.

mod opening;

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use metrics_exporter_prometheus::PrometheusHandle;
use tokio::net::{TcpListener, TcpSocket};
use tokio::sync::oneshot;
use tokio::task::JoinHandle;
use zenoh::Session;

use crate::config::{Config, ConfigError, ZenohMode};
use crate::decode::core_settings;
use crate::descriptors::{self, Shares};
use crate::engine::{Engine, Publisher, Silent, SpaceError};
use crate::http::{self, HttpSettings, Served};
use crate::metrics;
use crate::ports;
use crate::store::StoreError;
use crate::transport::{
    self, Intake, IntakeOfSpaces, TransportError, TransportSettings, ZenohPublisher,
};

use opening::Opened;
pub use opening::{open_store, store_at};

/// Longest wait for the Zenoh session to close.
const SESSION_CLOSE_TIMEOUT: Duration = Duration::from_secs(2);
/// How long a node that is a Zenoh router waits before it opens its session. Routers reckon their
/// trees anew every 100 ms, and tell one that is back within that time nothing of what they know.
const ROUTER_PAUSE: Duration = Duration::from_millis(500);
/// Most connections of HTTP that are not yet accepted.
const HTTP_BACKLOG: u32 = 4096;
/// Most connections that are not yet a session of Zenoh.
const ZENOH_HANDSHAKES_MAX: usize = 128;

/// A running service.
#[derive(Debug)]
pub struct Service {
    opened: Opened,
    address: SocketAddr,
    session: Option<Session>,
    publisher: Option<Arc<ZenohPublisher>>,
    intake: Option<Doors>,
    stop_http: oneshot::Sender<()>,
    http: JoinHandle<std::io::Result<()>>,
    upkeep: [JoinHandle<()>; 2],
}

/// Where samples and queries come in over Zenoh. Dropping it closes them.
#[derive(Debug)]
enum Doors {
    /// Those of all spaces.
    All { _intake: Intake },
    /// Those of the spaces that are here, in a cluster.
    OfSpaces { _intake: IntakeOfSpaces },
}

impl Doors {
    async fn open(session: &Session, served: &Served) -> Result<Self, TransportError> {
        Ok(if let Some(cluster) = &served.cluster {
            Self::OfSpaces {
                _intake: IntakeOfSpaces::start(session, &served.engine, cluster),
            }
        } else {
            Self::All {
                _intake: Intake::start(session, &served.engine).await?,
            }
        })
    }
}

/// Why the service does not start.
#[derive(Debug, thiserror::Error)]
pub enum StartError {
    /// The settings.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The store.
    #[error("store {place}")]
    Store {
        /// Its directory or URL.
        place: String,
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
    /// Somebody else has the port of the HTTP listener.
    #[error(
        "HTTP cannot listen on {address}, since another program does: choose another port with --set http.listen=ADDRESS:PORT"
    )]
    HttpTaken {
        /// Its address.
        address: SocketAddr,
    },
    /// Somebody else has the port of a Zenoh listener.
    #[error(
        "Zenoh cannot listen on {endpoint}, since another program does: choose another port with --set zenoh.listen=tcp/ADDRESS:PORT, or if rmw_zenohd runs there, be its client: cogmap serve --set zenoh.mode=client --set zenoh.connect={endpoint}"
    )]
    ZenohTaken {
        /// Its endpoint.
        endpoint: String,
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
    /// Opens the HTTP listener, the Zenoh session and the store, and begins to serve. Spaces may
    /// still be loading when it returns. A start that fails leaves no store behind that was not
    /// there.
    ///
    /// # Errors
    /// See [`StartError`].
    pub async fn start(config: &Config, prometheus: PrometheusHandle) -> Result<Self, StartError> {
        // What may fail comes in the order of what it leaves behind: settings nothing, a port or a
        // session nothing that outlives the process, the store files.
        check_spaces(config)?;
        let (http_settings, shares) = share_descriptors(config);
        let address = config.http.listen;
        let of_http = |source: std::io::Error| match source.kind() {
            std::io::ErrorKind::AddrInUse => StartError::HttpTaken { address },
            _ => StartError::Http { address, source },
        };
        let listener = listen(address).map_err(of_http)?;
        if config.http.is_open() {
            tracing::warn!(%address, "anyone who reaches this address can read and write: set http.token_file");
        }
        let address = listener.local_addr().map_err(of_http)?;
        let (session, publisher) = open_zenoh(config, shares).await?;
        let publishes: Arc<dyn Publisher> = match &publisher {
            Some(publisher) => Arc::clone(publisher) as Arc<dyn Publisher>,
            None => Arc::new(Silent),
        };
        let opened = Opened::open(config, address, publishes, session.as_ref()).await?;
        let served = opened.served();
        let intake = match &session {
            Some(session) => Some(Doors::open(session, &served).await?),
            None => None,
        };
        let is_local = config.store.url.is_empty();
        let directory = is_local.then(|| config.store.directory.clone());
        let upkeep = [
            tokio::spawn(metrics::upkeep(prometheus.clone(), directory)),
            tokio::spawn(transport::forbid_lingering()),
        ];
        let (stop_http, stopped) = oneshot::channel();
        let http = tokio::spawn(http::run(
            listener,
            served,
            http_settings,
            prometheus,
            async {
                // A dropped sender means the same as a sent stop.
                let _ = stopped.await;
            },
        ));
        Ok(Self {
            opened,
            address,
            session,
            publisher,
            intake,
            stop_http,
            http,
            upkeep,
        })
    }

    /// The engine.
    pub fn engine(&self) -> &Engine {
        self.opened.engine()
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
        self.upkeep.iter().for_each(JoinHandle::abort);
        let (opened, publisher) = (self.opened, self.publisher);
        let end = move || {
            opened.close();
            if let Some(publisher) = publisher {
                publisher.close();
            }
        };
        if tokio::task::spawn_blocking(end).await.is_err() {
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

/// Checks the settings of the spaces that are to be there.
fn check_spaces(config: &Config) -> Result<(), StartError> {
    for (name, settings) in &config.spaces {
        core_settings(settings).map_err(|source| StartError::Space {
            name: name.to_string(),
            source: source.into(),
        })?;
    }
    Ok(())
}

/// The Zenoh session and what publishes over it; neither where the settings ask for none.
async fn open_zenoh(
    config: &Config,
    shares: Shares,
) -> Result<(Option<Session>, Option<Arc<ZenohPublisher>>), StartError> {
    let Some(settings) = transport_settings(config, shares) else {
        return Ok((None, None));
    };
    // Zenoh would say it in a paragraph that names its source files.
    let taken = || {
        let endpoint = ports::taken_endpoint(&settings.listen)?.clone();
        Some(StartError::ZenohTaken { endpoint })
    };
    if let Some(error) = taken() {
        return Err(error);
    }
    if config.cluster.enabled && config.zenoh.mode == ZenohMode::Router {
        tokio::time::sleep(ROUTER_PAUSE).await;
    }
    for endpoint in transport::open_endpoints(&settings)? {
        tracing::warn!(
            endpoint,
            "anyone who reaches this endpoint can publish as any robot: set zenoh.config_file with \
             users and rules, as docs/security.md says"
        );
    }
    // Somebody may have come first since.
    let session = transport::open(&settings).await;
    let session = session.map_err(|error| taken().unwrap_or_else(|| error.into()))?;
    let codec = config.zenoh.encoding.codec();
    let publisher = ZenohPublisher::declare(session.clone(), codec).await?;
    Ok((Some(session), Some(Arc::new(publisher))))
}

/// Listens on an address. Connections that come faster than they are accepted wait in a long queue:
/// of those beyond it the system drops the first packet, and they come again after a second.
fn listen(address: SocketAddr) -> std::io::Result<TcpListener> {
    let socket = match address {
        SocketAddr::V4(_) => TcpSocket::new_v4()?,
        SocketAddr::V6(_) => TcpSocket::new_v6()?,
    };
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(HTTP_BACKLOG)
}

/// Shares out the descriptors that the system allows. Bounds of the settings that do not fit are
/// lowered.
fn share_descriptors(config: &Config) -> (HttpSettings, Shares) {
    let limit = descriptors::raise_limit();
    let wanted = Shares {
        http: config.http.connections_max,
        sessions: config.zenoh.sessions_max,
        handshakes: ZENOH_HANDSHAKES_MAX,
    };
    let shares = descriptors::share_out(limit, wanted);
    if shares.sessions < wanted.sessions {
        let (key, wanted, most) = ("zenoh.sessions_max", wanted.sessions, shares.sessions);
        tracing::warn!(key, wanted, most, "lowered: too few open files are allowed");
    }
    let http = fitting(config.http_settings(), shares.http);
    tracing::info!(
        limit,
        http_connections = http.connections_max,
        zenoh_sessions = shares.sessions,
        zenoh_handshakes = shares.handshakes,
        "open files"
    );
    (http, shares)
}

/// The settings of HTTP with so many connections: bounds that do not fit are lowered.
fn fitting(mut settings: HttpSettings, connections: usize) -> HttpSettings {
    let connections = connections.min(settings.connections_max);
    let busy = settings.requests_max + settings.streams_max;
    if connections < settings.connections_max || busy >= connections {
        // Some always wait for requests, and make room for others.
        let bounds = [
            (
                "http.connections_max",
                &mut settings.connections_max,
                connections,
            ),
            (
                "http.requests_max",
                &mut settings.requests_max,
                (connections / 2).max(1),
            ),
            (
                "http.streams_max",
                &mut settings.streams_max,
                (connections / 4).max(1),
            ),
        ];
        for (key, bound, most) in bounds {
            if *bound > most {
                tracing::warn!(
                    key,
                    wanted = *bound,
                    most,
                    "lowered: too few connections or open files are allowed"
                );
                *bound = most;
            }
        }
    }
    settings
}

fn transport_settings(config: &Config, shares: Shares) -> Option<TransportSettings> {
    let zenoh = &config.zenoh;
    zenoh.enabled.then(|| TransportSettings {
        mode: zenoh.mode.as_str().to_owned(),
        listen: zenoh.endpoints().to_vec(),
        connect: zenoh.connect.clone(),
        config_file: zenoh.config_file.clone(),
        sessions_max: shares.sessions,
        handshakes_max: shares.handshakes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bounds(settings: &HttpSettings) -> [usize; 3] {
        [
            settings.connections_max,
            settings.requests_max,
            settings.streams_max,
        ]
    }

    #[test]
    fn some_connections_always_wait_for_requests() {
        let wanted = || HttpSettings {
            requests_max: 1024,
            streams_max: 256,
            connections_max: 4096,
            ..Config::default().http.settings()
        };
        assert_eq!(bounds(&fitting(wanted(), 4096)), [4096, 1024, 256]);
        assert_eq!(bounds(&fitting(wanted(), 400)), [400, 200, 100]);
        // Whoever allows for few connections has as few under way.
        let few = HttpSettings {
            connections_max: 1000,
            ..wanted()
        };
        assert_eq!(bounds(&fitting(few, 4096)), [1000, 500, 250]);
    }
}
