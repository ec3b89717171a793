//! Causal trajectories of a space's agents: rows in the store, and the latest in the agent's view.

use std::sync::Arc;

use ::trajectory::StampedPose;
use cognitive_map::AgentId;

use super::Space;
use crate::engine::agent_view::AgentView;
use crate::engine::trajectory::{Around, TrajectoryPage, chunk_rows};
use crate::engine::unavailable::TrajectoryError;
use crate::store::{DerivedError, SpaceNumber, Store};

/// Chunks read from the store at once.
const CHUNKS_AT_ONCE: usize = 64;

impl Space {
    /// Up to `limit` poses of an agent's causal trajectory with `from_ns <= stamp < to_ns`; of its
    /// current session when none is named. A session may be one of a removed agent of that name.
    ///
    /// # Errors
    /// There is no such agent, or the store cannot be read.
    pub async fn trajectory(
        &self,
        agent: &str,
        session: Option<u64>,
        from_ns: Option<i64>,
        to_ns: Option<i64>,
        limit: usize,
    ) -> Result<TrajectoryPage, TrajectoryError> {
        let (session, parts) = self.parts(agent, session)?;
        let shared = Arc::clone(self.shared());
        let work = move || {
            let window = Window {
                session,
                from_ns,
                to_ns,
                limit,
            };
            read(&*shared.store, shared.number, &parts, &window)
        };
        tokio::task::spawn_blocking(work)
            .await
            .map_err(|_| TrajectoryError::Interrupted)?
    }

    /// The poses of an agent's causal trajectory on both sides of a stamp, of its current session
    /// when none is named; the same one twice where there is one at the stamp.
    ///
    /// # Errors
    /// There is no such agent, the session does not reach there, or the store cannot be read.
    pub async fn poses_around(
        &self,
        agent: &str,
        session: Option<u64>,
        stamp_ns: i64,
    ) -> Result<Around, TrajectoryError> {
        let (session, parts) = self.parts(agent, session)?;
        let shared = Arc::clone(self.shared());
        let work = move || around(&*shared.store, shared.number, &parts, session, stamp_ns);
        tokio::task::spawn_blocking(work)
            .await
            .map_err(|_| TrajectoryError::Interrupted)?
    }

    /// The session that is asked for, and where an agent of that name may have rows of it.
    fn parts(
        &self,
        agent: &str,
        session: Option<u64>,
    ) -> Result<(u64, Vec<Part>), TrajectoryError> {
        let view = self.agent(agent);
        let present = view.as_deref().map(Part::of_view);
        let former = self.shared().former(agent);
        let session = match (&present, session) {
            (Some(present), session) => session.unwrap_or(present.session),
            (None, Some(session)) if !former.is_empty() => session,
            (None, _) => return Err(self.no_agent(agent)),
        };
        // The latest agent of that name that had such a session.
        let former = former.into_iter().rev();
        let parts = { present.into_iter() }.chain(former.map(Part::of_former));
        Ok((session, parts.collect()))
    }

    /// Why there is no agent of a name.
    pub(super) fn no_agent(&self, name: &str) -> TrajectoryError {
        if self.has_removed(name) {
            TrajectoryError::RemovedAgent
        } else {
            TrajectoryError::UnknownAgent
        }
    }
}

/// Where an agent's rows are: in the store, and the latest of them at its view.
#[derive(Debug)]
struct Part {
    agent: u32,
    /// Session of the rows at the view.
    session: u64,
    fresh: Vec<StampedPose>,
}

/// Which rows are asked for.
#[derive(Clone, Copy, Debug)]
struct Window {
    session: u64,
    from_ns: Option<i64>,
    to_ns: Option<i64>,
    limit: usize,
}

impl Part {
    /// Of an agent of the space. The rows at the view are to be taken first and those in the store
    /// afterwards: a chunk that moves from one to the other in between is then found twice and
    /// never missed.
    fn of_view(view: &AgentView) -> Self {
        let recorder = view.recorder();
        Self {
            agent: view.id().0,
            session: recorder.session(),
            fresh: recorder.rows().to_vec(),
        }
    }

    /// Of a removed agent: all its rows are in the store.
    fn of_former(agent: AgentId) -> Self {
        Self {
            agent: agent.0,
            session: 0,
            fresh: Vec::new(),
        }
    }

    /// Whether it has rows of a session.
    fn had(
        &self,
        session: u64,
        store: &dyn Store,
        space: SpaceNumber,
    ) -> Result<bool, DerivedError> {
        if self.session == session && !self.fresh.is_empty() {
            return Ok(true);
        }
        Ok(!store
            .chunks(space, self.agent, session, i64::MIN, 1)?
            .is_empty())
    }
}

/// The rows on both sides of a stamp, of the first of the parts that had such a session.
fn around(
    store: &dyn Store,
    space: SpaceNumber,
    parts: &[Part],
    session: u64,
    stamp_ns: i64,
) -> Result<Around, TrajectoryError> {
    let mut of_session = None;
    for part in parts {
        if of_session.is_none() && part.had(session, store, space)? {
            of_session = Some(part);
        }
    }
    let Some(part) = of_session else {
        return Err(TrajectoryError::OutOfRange(None));
    };
    let rows_from = |from_ns: i64, n: usize| -> Result<Vec<StampedPose>, TrajectoryError> {
        let mut rows = Vec::new();
        for (_, bytes) in store.chunks(space, part.agent, session, from_ns, n)? {
            let chunk = chunk_rows(&bytes).map_err(|error| DerivedError(error.to_string()))?;
            rows.extend(chunk);
        }
        if part.session == session {
            let latest_ns = rows.last().map(|row| row.stamp_ns);
            let fresh = part.fresh.iter();
            rows.extend(fresh.filter(|row| latest_ns.is_none_or(|latest| row.stamp_ns > latest)));
        }
        Ok(rows)
    };
    // The last chunk that begins before the stamp and the one after it, and what is in none yet.
    let near = rows_from(stamp_ns, 2)?;
    if let Some(found) = Around::of(&near, session, None, stamp_ns) {
        return Ok(found);
    }
    let (begin, end) = (rows_from(i64::MIN, 1)?, rows_from(i64::MAX, 1)?);
    let range = begin.first().zip(end.last());
    let range = range.map(|(first, last)| (first.stamp_ns, last.stamp_ns));
    Err(TrajectoryError::OutOfRange(range))
}

/// Rows of a session with `from_ns <= stamp < to_ns`, at most `limit` of them: of the first of the
/// parts that had such a session.
fn read(
    store: &dyn Store,
    space: SpaceNumber,
    parts: &[Part],
    window: &Window,
) -> Result<TrajectoryPage, TrajectoryError> {
    let mut poses = Vec::new();
    for (at, part) in parts.iter().enumerate() {
        let is_last = at + 1 == parts.len();
        if is_last || part.had(window.session, store, space)? {
            poses = rows(store, space, part, window)?;
            break;
        }
    }
    let next_from_ns = poses.get(window.limit).map(|row| row.stamp_ns);
    poses.truncate(window.limit);
    Ok(TrajectoryPage {
        session: window.session,
        revision: None,
        poses,
        next_from_ns,
    })
}

/// The rows of one part, and one beyond the limit if there is.
fn rows(
    store: &dyn Store,
    space: SpaceNumber,
    part: &Part,
    window: &Window,
) -> Result<Vec<StampedPose>, TrajectoryError> {
    let from_ns = window.from_ns.unwrap_or(i64::MIN);
    let to_ns = window.to_ns.unwrap_or(i64::MAX);
    let mut poses: Vec<StampedPose> = Vec::new();
    let mut next_from_ns = from_ns;
    'chunks: loop {
        let chunks = store.chunks(
            space,
            part.agent,
            window.session,
            next_from_ns,
            CHUNKS_AT_ONCE,
        )?;
        let last = chunks.len() < CHUNKS_AT_ONCE;
        for (_, bytes) in chunks {
            let rows = chunk_rows(&bytes).map_err(|error| DerivedError(error.to_string()))?;
            poses.extend(rows.into_iter().filter(|row| row.stamp_ns >= next_from_ns));
            let Some(latest) = poses.last() else { continue };
            if poses.len() > window.limit || latest.stamp_ns >= to_ns {
                break 'chunks;
            }
            next_from_ns = latest.stamp_ns.saturating_add(1);
        }
        if last {
            if window.session == part.session {
                let fresh = part.fresh.iter();
                poses.extend(fresh.filter(|row| row.stamp_ns >= next_from_ns));
            }
            break;
        }
    }
    poses.retain(|row| row.stamp_ns < to_ns);
    Ok(poses)
}
