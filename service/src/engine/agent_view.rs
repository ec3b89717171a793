//! The view of an agent: what others may know of it without asking the writer.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use arc_swap::ArcSwapOption;
use cogmap_proto::limits::WATERMARK_REJECTIONS_MAX;
use cogmap_proto::{
    AgentDetail, AgentSummary, EndedEpisode, Estimate, Evidence, Rejection, SeqRange, StampedPose,
    Watermark,
};
use cognitive_map::{AgentId, CognitiveMap};
use serde::Serialize;

use super::counters::Standing;
use super::due::{Due, Messages};
use super::trajectory::Recorder;
use crate::encode;

/// What is known of an agent outside its space's writer. Readers never hold the writer up: the
/// readout is swapped whole, and the locks guard a few words each.
#[derive(Debug)]
pub struct AgentView {
    id: AgentId,
    name: String,
    term: u64,
    readout: ArcSwapOption<Readout>,
    /// When the latest message of it came; none since the start of the service.
    heard: Mutex<Option<Instant>>,
    marks: Mutex<Marks>,
    recorder: Mutex<Recorder>,
    ended_episode: ArcSwapOption<EndedEpisode>,
    due: Due,
}

/// An agent after a group of its samples.
#[derive(Debug)]
pub(crate) struct Readout {
    pub(crate) estimate: Estimate,
    pub(crate) odometry: StampedPose,
    pub(crate) evidence: Evidence,
    pub(crate) travelled_m: f64,
    pub(crate) forgotten_matches: u64,
    pub(crate) session_ended: bool,
    /// Contacts of the episode with an object that is under way.
    pub(crate) contacts: Option<u64>,
    /// Its part of the agent's JSON, once someone has asked for it.
    json: OnceLock<Vec<u8>>,
}

/// How far an agent's samples are behind.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lag {
    /// How many wait for earlier ones.
    pub(super) waiting: u64,
    /// How many are applied and not durable yet.
    pub(super) not_durable: u64,
}

/// The first fields of an [`AgentDetail`], which change with the readout only.
#[derive(Serialize)]
struct DetailHead<'a> {
    name: &'a str,
    estimate: Option<&'a Estimate>,
    odometry: Option<&'a StampedPose>,
    evidence: Evidence,
}

/// The other fields.
#[derive(Serialize)]
struct DetailTail {
    watermark: Watermark,
    lag_samples: u64,
    travelled_m: f64,
    forgotten_matches: u64,
    session_ended: bool,
    heard_ago_s: Option<f64>,
}

/// How far an agent's samples have come.
#[derive(Clone, Debug, Default)]
pub(crate) struct Marks {
    session: u64,
    durable: u64,
    applied: u64,
    waiting: u64,
    gap: Option<SeqRange>,
    rejected: VecDeque<Rejection>,
}

impl AgentView {
    /// A view for an agent whose samples below `next` are durable, by the owner of a term.
    pub(crate) fn new(
        id: AgentId,
        name: &str,
        term: u64,
        (session, next): (u64, u64),
        recorder: Recorder,
    ) -> Self {
        let marks = Marks {
            session,
            durable: next,
            applied: next,
            ..Marks::default()
        };
        Self {
            id,
            name: name.to_owned(),
            term,
            readout: ArcSwapOption::empty(),
            heard: Mutex::default(),
            marks: Mutex::new(marks),
            recorder: Mutex::new(recorder),
            ended_episode: ArcSwapOption::empty(),
            due: Due::default(),
        }
    }

    /// The agent's number.
    pub fn id(&self) -> AgentId {
        self.id
    }

    /// The agent's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its latest estimate.
    pub fn estimate(&self) -> Option<Estimate> {
        self.readout
            .load()
            .as_ref()
            .map(|readout| readout.estimate.clone())
    }

    /// Notes how it is localised and how far its samples are behind.
    pub(crate) fn stand(&self, standing: &mut Standing) {
        let readout = self.readout.load();
        let status = readout.as_ref().map(|readout| readout.estimate.status);
        let lag = self.lag();
        standing.note(status, lag.not_durable, lag.waiting);
    }

    /// How long ago the latest message of it came \[s\]; `None` if none has since the start of the
    /// service.
    pub fn heard_ago_s(&self) -> Option<f64> {
        let heard = *self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        heard.map(|heard| heard.elapsed().as_secs_f64())
    }

    /// Notes when the latest message of it came.
    pub(crate) fn hear(&self, at: Instant) {
        *self.heard.lock().unwrap_or_else(PoisonError::into_inner) = Some(at);
    }

    /// What a list of agents says of it.
    pub fn summary(&self) -> AgentSummary {
        let readout = self.readout.load();
        AgentSummary {
            name: self.name.clone(),
            estimate: readout.as_ref().map(|readout| readout.estimate.clone()),
            session_ended: { readout.as_ref() }.is_some_and(|readout| readout.session_ended),
            heard_ago_s: self.heard_ago_s(),
        }
    }

    /// Its latest readout.
    pub(super) fn readout(&self) -> Option<Arc<Readout>> {
        self.readout.load_full()
    }

    /// How far its samples are behind.
    pub(super) fn lag(&self) -> Lag {
        let marks = self.marks();
        Lag {
            waiting: marks.waiting,
            not_durable: marks.applied.saturating_sub(marks.durable),
        }
    }

    /// Passes its latest estimate to `read`, if there is one.
    pub(crate) fn read_estimate<T>(&self, read: impl FnOnce(&Estimate) -> T) -> Option<T> {
        let readout = self.readout.load();
        readout.as_ref().map(|readout| read(&readout.estimate))
    }

    /// Its latest episode with an object that has ended.
    pub fn ended_episode(&self) -> Option<Arc<EndedEpisode>> {
        self.ended_episode.load_full()
    }

    /// Puts another ended episode on the view, or none.
    pub(crate) fn put_ended_episode(&self, episode: Option<Arc<EndedEpisode>>) {
        self.ended_episode.store(episode);
    }

    /// Makes messages due to be published. Says whether none was before.
    pub(crate) fn make_due(&self, messages: Messages) -> bool {
        self.due.add(messages)
    }

    /// Takes those of `messages` that are due.
    pub(crate) fn take_due(&self, messages: Messages) -> Messages {
        self.due.take(messages)
    }

    /// How far its samples have come.
    pub fn watermark(&self) -> Watermark {
        self.marks().watermark(self.term)
    }

    /// All that is known of it here.
    pub fn detail(&self) -> AgentDetail {
        let readout = self.readout.load();
        let DetailTail {
            watermark,
            lag_samples,
            travelled_m,
            forgotten_matches,
            session_ended,
            heard_ago_s,
        } = self.tail(readout.as_deref());
        AgentDetail {
            name: self.name.clone(),
            estimate: readout.as_ref().map(|readout| readout.estimate.clone()),
            odometry: readout.as_ref().map(|readout| readout.odometry),
            evidence: evidence(readout.as_deref()),
            watermark,
            lag_samples,
            travelled_m,
            forgotten_matches,
            session_ended,
            heard_ago_s,
        }
    }

    /// [`Self::detail`] as JSON. It is the question that is asked most, often many times between
    /// two readouts, so what changes with the readout only is written once for each.
    ///
    /// # Panics
    /// Never: an agent is plain data.
    pub fn detail_json(&self) -> Vec<u8> {
        let readout = self.readout.load();
        let tail = serde_json::to_vec(&self.tail(readout.as_deref())).expect("plain data encodes");
        let head = |readout: Option<&Readout>| {
            let head = DetailHead {
                name: &self.name,
                estimate: readout.map(|readout| &readout.estimate),
                odometry: readout.map(|readout| &readout.odometry),
                evidence: evidence(readout),
            };
            serde_json::to_vec(&head).expect("plain data encodes")
        };
        let unread;
        let head = if let Some(readout) = readout.as_deref() {
            readout.json.get_or_init(|| head(Some(readout)))
        } else {
            unread = head(None);
            &unread
        };
        // One object of the two: `{head` `,` `tail}`.
        [&head[..head.len() - 1], b",", &tail[1..]].concat()
    }

    fn tail(&self, readout: Option<&Readout>) -> DetailTail {
        let marks = self.marks();
        DetailTail {
            watermark: marks.watermark(self.term),
            lag_samples: marks.applied.saturating_sub(marks.durable) + marks.waiting,
            travelled_m: readout.map_or(0.0, |readout| readout.travelled_m),
            forgotten_matches: readout.map_or(0, |readout| readout.forgotten_matches),
            session_ended: readout.is_some_and(|readout| readout.session_ended),
            heard_ago_s: self.heard_ago_s(),
        }
    }

    /// Puts a new readout on the view.
    pub(crate) fn publish(&self, readout: Readout) {
        self.readout.store(Some(Arc::new(readout)));
    }

    // A panic while one of these locks is held cannot leave half a change behind.
    pub(crate) fn marks(&self) -> MutexGuard<'_, Marks> {
        self.marks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn recorder(&self) -> MutexGuard<'_, Recorder> {
        self.recorder.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A view of an agent that has done nothing.
#[cfg(test)]
pub(crate) fn view_of(name: &str) -> AgentView {
    AgentView::new(AgentId(0), name, 0, (0, 0), Recorder::default())
}

/// What became of an agent's sightings; of none before its first sample.
fn evidence(readout: Option<&Readout>) -> Evidence {
    readout.map_or_else(Evidence::default, |readout| readout.evidence)
}

impl Readout {
    /// What the owner of a term publishes of an agent; nothing before its first sample.
    pub(crate) fn of(space: &str, term: u64, map: &CognitiveMap, id: AgentId) -> Option<Self> {
        let agent = map.agent(id)?;
        Some(Self {
            estimate: encode::estimate(space, term, map, id)?,
            odometry: encode::odometry(agent)?,
            evidence: encode::evidence(agent),
            travelled_m: agent.travelled_m(),
            forgotten_matches: agent.forgotten_matches(),
            session_ended: agent.session_ended(),
            contacts: agent.episode_contacts(),
            json: OnceLock::new(),
        })
    }
}

impl Marks {
    /// Notes what has been applied; a new session starts the count anew.
    pub(crate) fn applied(
        &mut self,
        session: u64,
        applied: u64,
        waiting: u64,
        gap: Option<SeqRange>,
    ) {
        if session != self.session {
            *self = Self {
                session,
                ..Self::default()
            };
        }
        (self.applied, self.waiting, self.gap) = (applied, waiting, gap);
    }

    /// Notes a rejection, as one with the latest where it continues that; the oldest makes room.
    pub(crate) fn rejected(&mut self, session: u64, rejection: Rejection) {
        if session != self.session {
            *self = Self {
                session,
                ..Self::default()
            };
        }
        if let Some(latest) = self.rejected.back_mut()
            && latest.reason == rejection.reason
            && latest.range.to == rejection.range.from
        {
            latest.range.to = rejection.range.to;
            return;
        }
        if self.rejected.len() == WATERMARK_REJECTIONS_MAX {
            self.rejected.pop_front();
        }
        self.rejected.push_back(rejection);
    }

    /// Notes what is on disk.
    pub(crate) fn durable(&mut self, session: u64, durable: u64) {
        if session == self.session {
            self.durable = self.durable.max(durable);
        }
    }

    fn watermark(&self, term: u64) -> Watermark {
        Watermark {
            session: self.session,
            durable: self.durable,
            applied: self.applied,
            gap: self.gap,
            rejected: self.rejected.iter().cloned().collect(),
            term,
        }
    }
}
