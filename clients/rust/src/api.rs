//! The service's HTTP interface.

mod addresses;
mod authorities;
mod error;
mod exchange;
mod guidance;
mod request;
mod retry;

use std::path::Path;
use std::time::Duration;

use cogmap_proto::limits::PAGE_ITEMS_MAX;
use cogmap_proto::{
    AgentAt, AgentDetail, AgentObject, AgentPage, AgentSummary, Channel, ChannelList, Codec,
    FeltAnswer, FeltQuery, GridState, Identification, IdentifyQuery, IngestAnswer, Landmark,
    LandmarkPage, Localization, LocalizeQuery, ObjectDetail, ObjectLesson, ObjectPage,
    ObjectSummary, Place, PlacePage, PlacePercepts, PredictAnswer, PredictQuery, RecallAnswer,
    RecallQuery, RouteAnswer, RouteQuery, SampleBatch, SequenceAnswer, SequenceQuery, SpaceInfo,
    SpaceList, SpaceSettings, Trajectory, Trip, TripDetail, TripPage,
};
use serde::de::DeserializeOwned;
use ureq::Agent;
use ureq::http::{Method, StatusCode};
use ureq::tls::TlsConfig;

use addresses::Addresses;
use authorities::authorities;
pub use error::ApiError;
use exchange::{Content, agent_path, answer, done, escaped, json, path, refusal};
use retry::{RETRY_TIMEOUT, Repeat};

/// Longest wait for a whole answer; the service itself gives up earlier.
const TIMEOUT: Duration = Duration::from_secs(30);

/// Asks a service over HTTP. Cheap to clone; connections are pooled.
#[derive(Clone, Debug)]
pub struct Api {
    addresses: Addresses,
    retry_timeout: Duration,
    token: Option<String>,
    agent: Agent,
}

impl Api {
    /// A client of the service at `base`, for example `http://127.0.0.1:8080`; `token` is sent as
    /// the bearer token. Nothing is sent yet. A web proxy in the environment is not used, because
    /// it would not know the robots' network. An `https://` service is checked against Mozilla's
    /// authorities; for others there is [`Api::trusting`].
    pub fn new(base: &str, token: Option<&str>) -> Self {
        Self::with_tls(base, token, TlsConfig::default())
    }

    /// As [`Api::new`], for an `https://` service whose certificate an authority of your own has
    /// signed: `ca_file` (PEM) has the authority's certificate, and no other is trusted.
    ///
    /// # Errors
    /// The file cannot be read, or has no certificate.
    pub fn trusting(
        base: &str,
        token: Option<&str>,
        ca_file: impl AsRef<Path>,
    ) -> Result<Self, ApiError> {
        let file = ca_file.as_ref();
        let roots = authorities(file).map_err(|source| ApiError::Authority {
            file: file.to_owned(),
            source,
        })?;
        let tls = TlsConfig::builder().root_certs(roots).build();
        Ok(Self::with_tls(base, token, tls))
    }

    fn with_tls(base: &str, token: Option<&str>, tls: TlsConfig) -> Self {
        let config = Agent::config_builder()
            .http_status_as_error(false)
            .timeout_global(Some(TIMEOUT))
            .proxy(None)
            .tls_config(tls)
            .build();
        Self {
            addresses: Addresses::of(base),
            retry_timeout: RETRY_TIMEOUT,
            token: token.map(str::to_owned),
            agent: config.new_agent(),
        }
    }

    /// Whether the service is ready to take samples. A service that cannot be reached is an error.
    ///
    /// # Errors
    /// The service cannot be reached or answers neither yes (200) nor no (503).
    pub fn ready(&self) -> Result<bool, ApiError> {
        let response = self.run(&Method::GET, "/readyz", None)?;
        match response.status() {
            StatusCode::SERVICE_UNAVAILABLE => Ok(false),
            status if status.is_success() => Ok(true),
            _ => Err(refusal(response)),
        }
    }

    /// All spaces.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn spaces(&self) -> Result<Vec<SpaceInfo>, ApiError> {
        Ok(self.get::<SpaceList>("/v1/spaces")?.spaces)
    }

    /// Creates a space.
    ///
    /// # Errors
    /// See [`ApiError`]; it is a problem if the space exists with other settings.
    pub fn create_space(
        &self,
        space: &str,
        settings: &SpaceSettings,
    ) -> Result<SpaceInfo, ApiError> {
        self.send(&Method::PUT, &path(space, "")?, &json(settings))
    }

    /// A space.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn space(&self, space: &str) -> Result<SpaceInfo, ApiError> {
        self.get(&path(space, "")?)
    }

    /// Deletes a space and everything in it.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn delete_space(&self, space: &str) -> Result<(), ApiError> {
        done(self.run(&Method::DELETE, &path(space, "")?, None)?)
    }

    /// All agents of a space, by name.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn agents(&self, space: &str) -> Result<Vec<AgentSummary>, ApiError> {
        self.pages(&path(space, "/agents")?, |page: AgentPage| {
            (page.agents, page.next)
        })
    }

    /// An agent.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn agent(&self, space: &str, agent: &str) -> Result<AgentDetail, ApiError> {
        self.get(&agent_path(space, agent, "")?)
    }

    /// Removes an agent; returns when that is durable. Its name is free, and what it did in the map
    /// stays: places, trips, landmarks and the causal trajectories of its sessions. A robot that
    /// goes on sending under the name comes back as a new agent.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn delete_agent(&self, space: &str, agent: &str) -> Result<(), ApiError> {
        done(self.run(&Method::DELETE, &agent_path(space, agent, "")?, None)?)
    }

    /// The grid-cell state of an agent.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn grid(&self, space: &str, agent: &str) -> Result<GridState, ApiError> {
        self.get(&agent_path(space, agent, "/grid")?)
    }

    /// The whole causal trajectory of an agent, all pages of it.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn trajectory(&self, space: &str, agent: &str) -> Result<Trajectory, ApiError> {
        self.whole_trajectory(space, agent, "causal")
    }

    /// The whole refined trajectory of an agent: its past by all that has been seen since.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn refined_trajectory(&self, space: &str, agent: &str) -> Result<Trajectory, ApiError> {
        self.whole_trajectory(space, agent, "refined")
    }

    /// Where an agent was at a stamp \[ns\], as it was known then.
    ///
    /// # Errors
    /// See [`ApiError`]. A stamp that its current session does not reach to breaks a rule (422).
    pub fn agent_at(&self, space: &str, agent: &str, stamp_ns: i64) -> Result<AgentAt, ApiError> {
        self.get(&agent_path(
            space,
            agent,
            &format!("/at?stamp_ns={stamp_ns}"),
        )?)
    }

    /// Where an agent was at a stamp \[ns\], by all that has been seen since.
    ///
    /// # Errors
    /// See [`ApiError`]. A stamp that its past does not reach to breaks a rule (422).
    pub fn refined_agent_at(
        &self,
        space: &str,
        agent: &str,
        stamp_ns: i64,
    ) -> Result<AgentAt, ApiError> {
        let rest = format!("/at?stamp_ns={stamp_ns}&trajectory=refined");
        self.get(&agent_path(space, agent, &rest)?)
    }

    /// All pages of a trajectory.
    fn whole_trajectory(
        &self,
        space: &str,
        agent: &str,
        kind: &str,
    ) -> Result<Trajectory, ApiError> {
        let path = agent_path(space, agent, "/trajectory")?;
        let path = format!("{path}?kind={kind}&limit={PAGE_ITEMS_MAX}");
        let mut whole: Trajectory = self.get(&path)?;
        let mut from_ns = whole.next_from_ns.take();
        while let Some(from) = from_ns {
            let page: Trajectory = self.get(&format!("{path}&from_ns={from}"))?;
            // A page that does not lead on would be asked for without end.
            from_ns = page.next_from_ns.filter(|next| *next > from);
            whole.poses.extend(page.poses);
        }
        Ok(whole)
    }

    /// Sends samples without Zenoh; returns when they are durable.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn post_samples(
        &self,
        space: &str,
        agent: &str,
        batch: &SampleBatch,
    ) -> Result<IngestAnswer, ApiError> {
        let content = Content {
            kind: Codec::Postcard.encoding(),
            bytes: Codec::Postcard.encode(batch),
            repeat: Repeat::Harmless,
        };
        self.send(
            &Method::POST,
            &agent_path(space, agent, "/samples")?,
            &content,
        )
    }

    /// Places that answer a cue, best first.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn recall(&self, space: &str, query: &RecallQuery) -> Result<RecallAnswer, ApiError> {
        self.send(&Method::POST, &path(space, "/recall")?, &json(query))
    }

    /// Where a sequence of samples was taken, which needs no agent and changes nothing.
    ///
    /// # Errors
    /// See [`ApiError`]. A service that is at several of these already asks to come back (503).
    pub fn localize(&self, space: &str, query: &LocalizeQuery) -> Result<Localization, ApiError> {
        self.send(&Method::POST, &path(space, "/localize")?, &json(query))
    }

    /// What an agent would feel after a motion from where it is now.
    ///
    /// # Errors
    /// See [`ApiError`]. An agent that is not placed is a conflict (409).
    pub fn predict(
        &self,
        space: &str,
        agent: &str,
        query: &PredictQuery,
    ) -> Result<PredictAnswer, ApiError> {
        self.send(
            &Method::POST,
            &agent_path(space, agent, "/predict")?,
            &json(query),
        )
    }

    /// How one gets from here to there, by ways that the team has gone.
    ///
    /// # Errors
    /// See [`ApiError`]. A lost agent and a goal to which no way leads are conflicts (409); a
    /// service that is at several of these already asks to come back (503).
    pub fn route(&self, space: &str, query: &RouteQuery) -> Result<RouteAnswer, ApiError> {
        self.send(&Method::POST, &path(space, "/route")?, &json(query))
    }

    /// Which trips the last places of somebody look like, and what comes next.
    ///
    /// # Errors
    /// See [`ApiError`]. A service that is at several of these already asks to come back (503).
    pub fn sequence(&self, space: &str, query: &SequenceQuery) -> Result<SequenceAnswer, ApiError> {
        self.send(&Method::POST, &path(space, "/sequence")?, &json(query))
    }

    /// What was felt near a point, and who was there.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn felt(&self, space: &str, query: &FeltQuery) -> Result<FeltAnswer, ApiError> {
        self.send(&Method::POST, &path(space, "/felt")?, &json(query))
    }

    /// All places of a space, by id.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn places(&self, space: &str) -> Result<Vec<Place>, ApiError> {
        self.pages(&path(space, "/places")?, |page: PlacePage| {
            (page.places, page.next.map(|next| next.to_string()))
        })
    }

    /// All trips of a space, by id.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn trips(&self, space: &str) -> Result<Vec<Trip>, ApiError> {
        self.pages(&path(space, "/trips")?, |page: TripPage| {
            (page.trips, page.next.map(|next| next.to_string()))
        })
    }

    /// A trip with its legs.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn trip(&self, space: &str, trip: u64) -> Result<TripDetail, ApiError> {
        self.get(&path(space, &format!("/trips/{trip}"))?)
    }

    /// All landmarks of a space, by label.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn landmarks(&self, space: &str) -> Result<Vec<Landmark>, ApiError> {
        self.pages(&path(space, "/landmarks")?, |page: LandmarkPage| {
            (page.landmarks, page.next)
        })
    }

    /// What a place remembers of what was felt and seen there.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn place_percepts(&self, space: &str, place: u64) -> Result<PlacePercepts, ApiError> {
        self.get(&path(space, &format!("/places/{place}/percepts"))?)
    }

    /// The channels of percepts of a space, and what was learned of their views.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn channels(&self, space: &str) -> Result<Vec<Channel>, ApiError> {
        let list: ChannelList = self.get(&path(space, "/channels")?)?;
        Ok(list.channels)
    }

    /// All objects of a space, by name.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn objects(&self, space: &str) -> Result<Vec<ObjectSummary>, ApiError> {
        self.pages(&path(space, "/objects")?, |page: ObjectPage| {
            (page.objects, page.next)
        })
    }

    /// An object with its places.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn object(&self, space: &str, name: &str) -> Result<ObjectDetail, ApiError> {
        self.get(&path(space, &format!("/objects/{}", escaped(name)))?)
    }

    /// Teaches an object at once, in place of what was known of it; returns when that is durable.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn teach_object(
        &self,
        space: &str,
        name: &str,
        lesson: &ObjectLesson,
    ) -> Result<ObjectSummary, ApiError> {
        let path = path(space, &format!("/objects/{}", escaped(name)))?;
        self.send(&Method::PUT, &path, &json(lesson))
    }

    /// Forgets an object.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn forget_object(&self, space: &str, name: &str) -> Result<(), ApiError> {
        let path = path(space, &format!("/objects/{}", escaped(name)))?;
        done(self.run(&Method::DELETE, &path, None)?)
    }

    /// Which object a sequence of contacts is of, and in which pose.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn identify(&self, space: &str, query: &IdentifyQuery) -> Result<Identification, ApiError> {
        let path = path(space, "/objects/identify")?;
        self.send(&Method::POST, &path, &json(query))
    }

    /// What an agent's episode with an object says so far, and what the latest one said that has
    /// ended.
    ///
    /// # Errors
    /// See [`ApiError`].
    pub fn agent_object(&self, space: &str, agent: &str) -> Result<AgentObject, ApiError> {
        self.get(&agent_path(space, agent, "/object")?)
    }

    fn pages<P: DeserializeOwned, I>(
        &self,
        path: &str,
        open: impl Fn(P) -> (Vec<I>, Option<String>),
    ) -> Result<Vec<I>, ApiError> {
        let first = format!("{path}?limit={PAGE_ITEMS_MAX}");
        let (mut items, mut after) = open(self.get(&first)?);
        while let Some(last) = after {
            let (more, next) = open(self.get(&format!("{first}&after={}", escaped(&last)))?);
            // A page that does not lead on would be asked for without end.
            after = next.filter(|next| *next != last && !more.is_empty());
            items.extend(more);
        }
        Ok(items)
    }

    fn get<T: DeserializeOwned>(&self, path: &str) -> Result<T, ApiError> {
        answer(path, self.run(&Method::GET, path, None)?)
    }

    fn send<T: DeserializeOwned>(
        &self,
        method: &Method,
        path: &str,
        content: &Content,
    ) -> Result<T, ApiError> {
        answer(path, self.run(method, path, Some(content))?)
    }
}

#[cfg(test)]
mod tests;
