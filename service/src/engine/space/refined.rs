//! Refined trajectories of a space's agents, and what else needs its map relaxed.

use std::sync::Arc;
use std::time::{Duration, Instant};

use cognitive_map::CognitiveMap;

use super::Space;
use crate::engine::refinement::{Graph, Refinement, SharedText, refined_trajectories};
use crate::engine::trajectory::{Around, TrajectoryPage};
use crate::engine::unavailable::{TrajectoryError, Unavailable};

/// How long the later pages of a trajectory are those of the relaxation that its first page came
/// from.
const PAGES_LAST: Duration = Duration::from_secs(60);

impl Space {
    /// Up to `limit` poses of an agent's refined trajectory with `from_ns <= stamp < to_ns`, of all
    /// sessions: its past by all that has been seen since. Between two of them it moved evenly.
    ///
    /// The whole map is relaxed for it, once for each revision that is asked for; a page that
    /// begins at `from_ns` may come from the relaxation of a minute ago, so that the pages fit
    /// together.
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

    /// The poses of an agent's refined trajectory on both sides of a stamp; the same one twice
    /// where there is one at the stamp. The map is relaxed for it as for the first page of one.
    ///
    /// # Errors
    /// There is no such agent, its past does not reach there, or the space cannot be read.
    pub async fn refined_poses_around(
        &self,
        agent: &str,
        stamp_ns: i64,
    ) -> Result<Around, TrajectoryError> {
        let view = self.agent(agent).ok_or_else(|| self.no_agent(agent))?;
        let refinement = self.refinement(false).await?;
        let rows = refinement.agents.get(agent).map_or(&[][..], Vec::as_slice);
        let session = view.watermark().session;
        let found = Around::of(rows, session, Some(refinement.revision), stamp_ns);
        let range = rows.first().zip(rows.last());
        let range = range.map(|(first, last)| (first.stamp_ns, last.stamp_ns));
        found.ok_or(TrajectoryError::OutOfRange(range))
    }

    /// What `write` makes of the map by relaxing it. The map is relaxed for one at a time, and all
    /// who have come by then get the same text.
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

    /// The relaxed map of now, or for a later page that of the first one. One that was made of the
    /// map after the question came is of now.
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
        // The turn goes with the work: who stops waiting for it does not let a second one begin
        // beside it.
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
