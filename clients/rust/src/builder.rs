//! Connecting a robot.

use cogmap_proto::Name;
use zenoh::Session;

use crate::credentials::Credentials;
use crate::error::ClientError;
use crate::link;
use crate::robot::Robot;
use crate::settings::RobotSettings;

/// Builds a [`Robot`].
#[derive(Debug)]
#[must_use]
pub struct RobotBuilder {
    space: String,
    agent: String,
    endpoints: Vec<String>,
    shared: Option<Session>,
    credentials: Credentials,
    settings: RobotSettings,
}

impl RobotBuilder {
    pub(crate) fn new(space: &str, agent: &str) -> Self {
        Self {
            space: space.to_owned(),
            agent: agent.to_owned(),
            endpoints: Vec::new(),
            shared: None,
            credentials: Credentials::default(),
            settings: RobotSettings::default(),
        }
    }

    /// Adds a Zenoh endpoint, for example `tcp/127.0.0.1:7447`. Of several, the first that answers
    /// is used.
    pub fn endpoint(mut self, endpoint: &str) -> Self {
        self.endpoints.push(endpoint.to_owned());
        self
    }

    /// Uses a Zenoh session that is open already, and leaves it open; endpoints are then ignored.
    /// Many robots of one process share a session this way.
    pub fn zenoh_session(mut self, session: Session) -> Self {
        self.shared = Some(session);
        self
    }

    /// Shows credentials to the router, and checks who it is; they are ignored with a session that
    /// is open already.
    pub fn credentials(mut self, credentials: Credentials) -> Self {
        self.credentials = credentials;
        self
    }

    /// Sets the number of this run of the agent; see [`RobotSettings::session`].
    pub fn session(mut self, session: u64) -> Self {
        self.settings.session = Some(session);
        self
    }

    /// Sets all settings.
    pub fn settings(mut self, settings: RobotSettings) -> Self {
        self.settings = settings;
        self
    }

    /// Connects, subscribes to the agent's watermarks and estimates, and starts the thread that
    /// sends.
    ///
    /// # Errors
    /// A name or setting is not valid, no router answers in time, or Zenoh refuses a declaration.
    pub fn connect(self) -> Result<Robot, ClientError> {
        Name::check(&self.space).map_err(ClientError::Space)?;
        Name::check(&self.agent).map_err(ClientError::Agent)?;
        self.settings.check()?;
        let session = if let Some(session) = self.shared {
            session
        } else {
            let timeout = self.settings.connect_timeout;
            link::open_session_as(&self.endpoints, &self.credentials, timeout)?
        };
        Robot::start(session, self.space, self.agent, &self.settings)
    }
}

impl Robot {
    /// Connects to a Zenoh router as `agent` of `space`, with the default settings.
    ///
    /// # Errors
    /// As [`RobotBuilder::connect`].
    pub fn connect(endpoint: &str, space: &str, agent: &str) -> Result<Self, ClientError> {
        Self::builder(space, agent).endpoint(endpoint).connect()
    }

    /// Starts a builder for `agent` of `space`.
    pub fn builder(space: &str, agent: &str) -> RobotBuilder {
        RobotBuilder::new(space, agent)
    }
}
