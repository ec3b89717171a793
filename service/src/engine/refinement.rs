//! Refined trajectories: where agents were, given all that has been remembered since.

use std::collections::BTreeMap;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use ::trajectory::StampedPose;
use cognitive_map::{Agent, AgentId, CognitiveMap};
use tokio::sync::Mutex;

use super::space::{Space, TrajectoryError, Unavailable};
use super::trajectory::TrajectoryPage;

/// How long the later pages of a trajectory are those of the relaxation that its first page came from.
const PAGES_LAST: Duration = Duration::from_secs(60);

/// A space's latest relaxations, and the places where those queue who want another one.
#[derive(Debug, Default)]
pub(super) struct Refinements {
    trajectories: Arc<Mutex<Option<Arc<Refinement>>>>,
    graph: Arc<Mutex<Option<Graph>>>,
}

/// A relaxed map as a text. Who holds it keeps it; the space does not.
#[derive(Debug)]
struct Graph {
    taken: Instant,
    text: Weak<String>,
}

/// A text that others hold too.
#[derive(Clone, Debug)]
pub struct SharedText(Arc<String>);

impl AsRef<[u8]> for SharedText {
    fn as_ref(&self) -> &[u8] {
        self.0.as_bytes()
    }
}

/// The trajectories of a relaxed map.
#[derive(Debug)]
struct Refinement {
    revision: u64,
    /// Before the map was taken that it is of.
    taken: Instant,
    made: Instant,
    agents: BTreeMap<String, Vec<StampedPose>>,
}

/// The refined trajectory of each agent of a map that has not been removed, by name; empty where it is not placed. Takes up to seconds.
pub fn refined_trajectories(map: &CognitiveMap) -> BTreeMap<String, Vec<StampedPose>> {
    let mut refined = map.refined().agents.into_iter();
    let of_agent = |(_, agent): (AgentId, &Agent)| {
        // Those of removed agents are among them.
        let poses = refined.next().filter(|refined| refined.is_in_map);
        let poses = poses.map(|refined| refined.poses).unwrap_or_default();
        let rows = poses.iter().map(|row| StampedPose {
            stamp_ns: row.stamp_ns,
            pose: row.pose,
        });
        let name = agent
            .is_enrolled()
            .then(|| agent.name().as_str().to_owned())?;
        Some((name, rows.collect()))
    };
    map.agents_ever().filter_map(of_agent).collect()
}

impl Space {
    /// Up to `limit` poses of an agent's refined trajectory with `from_ns <= stamp < to_ns`, of all
    /// sessions: its past by all that has been seen since. Between two of them it moved evenly.
    ///
    /// The whole map is relaxed for it, once for each revision that is asked for; a page that begins at
    /// `from_ns` may come from the relaxation of a minute ago, so that the pages fit together.
    ///
    /// # Errors
    /// There is no such agent, or the space cannot be read.
    pub async fn refined_trajectory(
        &self,
        agent: &str,
        from_ns: Option<i64>,
        to_ns: Option<i64>,
        limit: usize,
    ) -> Result<TrajectoryPage, TrajectoryError> {
        let view = self.agent(agent).ok_or_else(|| self.no_agent(agent))?;
        let refinement = self.refinement(from_ns.is_some()).await?;
        let rows = refinement.agents.get(agent).map_or(&[][..], Vec::as_slice);
        let start = from_ns.map_or(0, |from| rows.partition_point(|row| row.stamp_ns < from));
        let end = to_ns.map_or(rows.len(), |to| {
            rows.partition_point(|row| row.stamp_ns < to)
        });
        let asked = &rows[start..end.max(start)];
        let poses = asked[..limit.min(asked.len())].to_vec();
        Ok(TrajectoryPage {
            session: view.watermark().session,
            revision: Some(refinement.revision),
            poses,
            next_from_ns: asked.get(limit).map(|row| row.stamp_ns),
        })
    }

    /// What `write` makes of the map by relaxing it. The map is relaxed for one at a time, and all who
    /// have come by then get the same text.
    ///
    /// # Errors
    /// The space cannot be read.
    pub(crate) async fn graph(
        &self,
        write: impl FnOnce(&CognitiveMap) -> String + Send + 'static,
    ) -> Result<SharedText, Unavailable> {
        let asked = Instant::now();
        let mut latest = Arc::clone(&self.refinements().graph).lock_owned().await;
        if let Some(latest) = &*latest
            && latest.taken >= asked
            && let Some(text) = latest.text.upgrade()
        {
            return Ok(SharedText(text));
        }
        let turn = self.question_room().relaxation().await;
        let taken = Instant::now();
        let map = self.snapshot().await?;
        let relax = move || {
            let text = Arc::new(write(&map));
            let weak = Arc::downgrade(&text);
            *latest = Some(Graph { taken, text: weak });
            drop(turn);
            // Those who wait find it as long as this one lives.
            SharedText(text)
        };
        let relaxed = tokio::task::spawn_blocking(relax).await;
        relaxed.map_err(|_| Unavailable::Interrupted)
    }

    /// The relaxed map of now, or for a later page that of the first one. One that was made of the map
    /// after the question came is of now.
    async fn refinement(&self, is_later_page: bool) -> Result<Arc<Refinement>, Unavailable> {
        let asked = Instant::now();
        let mut latest = Arc::clone(&self.refinements().trajectories)
            .lock_owned()
            .await;
        if let Some(latest) = &*latest
            && (latest.taken >= asked || (is_later_page && latest.made.elapsed() < PAGES_LAST))
        {
            return Ok(Arc::clone(latest));
        }
        let taken = Instant::now();
        let map = self.snapshot().await?;
        if let Some(latest) = &*latest
            && latest.revision == map.revision()
        {
            return Ok(Arc::clone(latest));
        }
        let turn = self.question_room().relaxation().await;
        // The turn goes with the work: who stops waiting for it does not let a second one begin beside it.
        let relax = move || {
            let relaxed = Arc::new(Refinement {
                revision: map.revision(),
                taken,
                agents: refined_trajectories(&map),
                made: Instant::now(),
            });
            *latest = Some(Arc::clone(&relaxed));
            drop(turn);
            relaxed
        };
        let relaxed = tokio::task::spawn_blocking(relax).await;
        relaxed.map_err(|_| Unavailable::Interrupted)
    }
}
