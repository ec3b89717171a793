//! Refined trajectories: where agents were, given all that has been remembered since.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use cogmap_proto::{StampedPose, Trajectory};
use cognitive_map::{Agent, AgentId, CognitiveMap};
use tokio::sync::Mutex;

use super::space::{Space, TrajectoryError, Unavailable};
use super::trajectory::stamped;

/// How long the later pages of a trajectory are those of the relaxation that its first page came from.
const PAGES_LAST: Duration = Duration::from_secs(60);

/// A space's latest relaxation, and the place where those queue who want another one.
#[derive(Debug, Default)]
pub(super) struct Refinements(Arc<Mutex<Option<Arc<Refinement>>>>);

/// The trajectories of a relaxed map.
#[derive(Debug)]
struct Refinement {
    revision: u64,
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
        let rows = poses.iter().map(|row| stamped(row.stamp_ns, &row.pose));
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
    ) -> Result<Trajectory, TrajectoryError> {
        let desk = self.agent(agent).ok_or_else(|| self.no_agent(agent))?;
        let refinement = self.refinement(from_ns.is_some()).await?;
        let rows = refinement.agents.get(agent).map_or(&[][..], Vec::as_slice);
        let start = from_ns.map_or(0, |from| rows.partition_point(|row| row.stamp_ns < from));
        let end = to_ns.map_or(rows.len(), |to| {
            rows.partition_point(|row| row.stamp_ns < to)
        });
        let asked = &rows[start..end.max(start)];
        let poses = asked[..limit.min(asked.len())].to_vec();
        Ok(Trajectory {
            agent: agent.to_owned(),
            session: desk.watermark().session,
            frame: "map".to_owned(),
            kind: "refined".to_owned(),
            map_revision: Some(refinement.revision),
            poses,
            next_from_ns: asked.get(limit).map(|row| row.stamp_ns),
        })
    }

    /// What `of` makes of the map by relaxing it. Waits for its turn: the map is relaxed for one at a time.
    ///
    /// # Errors
    /// The space cannot be read.
    pub(crate) async fn relaxed<T: Send + 'static>(
        &self,
        of: impl FnOnce(&CognitiveMap) -> T + Send + 'static,
    ) -> Result<T, Unavailable> {
        let turn = Arc::clone(&self.refinements().0).lock_owned().await;
        let map = self.snapshot().await?;
        let relax = move || {
            let made = of(&map);
            drop(turn);
            made
        };
        let relaxed = tokio::task::spawn_blocking(relax).await;
        relaxed.map_err(|_| interrupted())
    }

    /// The relaxed map of now, or for a later page that of the first one.
    async fn refinement(&self, is_later_page: bool) -> Result<Arc<Refinement>, Unavailable> {
        let mut latest = Arc::clone(&self.refinements().0).lock_owned().await;
        let map = self.snapshot().await?;
        if let Some(latest) = &*latest
            && (latest.revision == map.revision()
                || (is_later_page && latest.made.elapsed() < PAGES_LAST))
        {
            return Ok(Arc::clone(latest));
        }
        // The turn goes with the work: who stops waiting for it does not let a second one begin beside it.
        let relax = move || {
            let relaxed = Arc::new(Refinement {
                revision: map.revision(),
                made: Instant::now(),
                agents: refined_trajectories(&map),
            });
            *latest = Some(Arc::clone(&relaxed));
            relaxed
        };
        let relaxed = tokio::task::spawn_blocking(relax).await;
        relaxed.map_err(|_| interrupted())
    }
}

fn interrupted() -> Unavailable {
    Unavailable::Failed("the relaxation of the map was interrupted".to_owned())
}
