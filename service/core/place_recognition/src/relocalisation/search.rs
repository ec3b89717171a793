//! A search: what an agent has seen since it does not know where it is.

use nalgebra::Isometry3;

use crate::keyframes::SampleKey;
use crate::sequences::ViewMemory;
use crate::tuning::{relocalise, search as tuning};
use crate::views::{SimilarView, StoredView};
use state::{Counted, PagedVec, state_of_struct};

/// A query: a view of an agent that does not know where it is, with the remembered views that are
/// similar.
#[derive(Clone, Debug)]
pub(crate) struct QueryView {
    /// Pose by motion alone.
    pub(crate) in_odom: Isometry3<f64>,
    /// Length of the way there since the search began \[m\].
    pub(crate) travelled_m: f64,
    /// Number of the channel.
    pub(crate) channel: u8,
    /// The descriptor, a unit vector.
    pub(crate) vector: Box<[f32]>,
    /// The remembered views that are similar, the most similar first.
    pub(crate) similar: Vec<SimilarView>,
}

impl QueryView {
    /// Whether a pose by motion alone is too near for another query.
    pub(crate) fn is_beside(&self, in_odom: &Isometry3<f64>) -> bool {
        let (length_m, angle_rad) = relocalise::MOVED;
        geometry::is_within(&self.in_odom.inv_mul(in_odom), length_m, angle_rad)
    }
}

/// A search under way.
#[derive(Clone, Debug)]
pub(crate) struct Search {
    pub(crate) agent: u32,
    /// The sample of the session from which on the agent does not know where it is.
    pub(crate) since_seq: u64,
    pub(crate) session: u32,
    /// Number of views and of thinnings up to which the queries have been compared.
    pub(crate) compared: u64,
    pub(crate) thinnings: u64,
    /// Length of the way after which the agent was found \[m\]. The search goes on until its
    /// heading is certain.
    pub(crate) found_m: Option<f64>,
    /// Queries since the last attempt.
    pub(crate) fresh: u32,
    pub(crate) queries: Vec<QueryView>,
}

/// The searches, at most one of an agent.
pub(crate) type Searches = PagedVec<Search, 1>;

impl Search {
    pub(crate) fn new(since: SampleKey) -> Self {
        Self {
            agent: since.agent,
            since_seq: since.seq,
            session: since.session,
            compared: 0,
            thinnings: 0,
            found_m: None,
            fresh: 0,
            queries: Vec::new(),
        }
    }

    /// Adds a query. When there is no room, the oldest is dropped if the way is long, else the one
    /// nearest to its neighbours.
    pub(crate) fn push(
        &mut self,
        in_odom: Isometry3<f64>,
        channel: u8,
        vector: &[f32],
        similar: Vec<SimilarView>,
    ) {
        let travelled_m = self.queries.last().map_or(0.0, |last| {
            last.travelled_m + (in_odom.translation.vector - last.in_odom.translation.vector).norm()
        });
        self.queries.push(QueryView {
            in_odom,
            travelled_m,
            channel,
            vector: vector.into(),
            similar,
        });
        let mut numbers: usize = self.queries.iter().map(|query| query.vector.len()).sum();
        while self.queries.len() > tuning::QUERIES_MAX
            || numbers > tuning::NUMBERS_MAX.max(vector.len())
        {
            numbers -= self.queries.remove(self.dispensable()).vector.len();
        }
        self.fresh += 1;
    }

    /// The number of the query with the least information beside the others.
    fn dispensable(&self) -> usize {
        let way_m = |from: &QueryView, to: &QueryView| to.travelled_m - from.travelled_m;
        if let [first, .., last] = &self.queries[..]
            && way_m(first, last) > tuning::WAY_M_MAX
        {
            return 0;
        }
        let gaps = self.queries.windows(3).map(|at| way_m(&at[0], &at[2]));
        let least = gaps.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        least.map_or(0, |(before, _)| before + 1)
    }

    /// Whether the agent has gone so far \[m\] since it was found.
    pub(crate) fn is_over(&self, on_m: f64) -> bool {
        let way_m = self.queries.last().map(|query| query.travelled_m);
        let since = way_m.zip(self.found_m);
        since.is_some_and(|(way_m, found_m)| way_m - found_m >= on_m)
    }

    /// Makes the next query start an attempt. The queries have been compared with nothing that is
    /// remembered now.
    pub(crate) fn await_comparison(&mut self, memory: &ViewMemory) {
        (self.compared, self.thinnings) = (0, memory.thinnings);
        self.fresh = u32::try_from(self.queries.len()).unwrap_or(u32::MAX);
    }

    /// Compares the queries with what has been remembered since they were made.
    pub(crate) fn catch_up(&mut self, memory: &ViewMemory) {
        let views = memory.stored.len() as u64;
        let from = if self.thinnings == memory.thinnings {
            self.compared
        } else {
            views
        };
        (self.compared, self.thinnings) = (views, memory.thinnings);
        let from = usize::try_from(from).unwrap_or(usize::MAX);
        if from >= memory.stored.len() {
            return;
        }
        let since = self.since();
        for query in &mut self.queries {
            let is_own = |view: &StoredView| view.is_since(since);
            let fresh = memory.similar_views(query.channel, &query.vector, from, is_own);
            query.similar.extend(fresh);
            query
                .similar
                .sort_by(|a, b| a.distance.mean_m.total_cmp(&b.distance.mean_m));
            query.similar.truncate(crate::tuning::memory::SIMILAR_MAX);
        }
    }

    /// The sample from which on the agent does not know where it is.
    pub(crate) fn since(&self) -> SampleKey {
        SampleKey {
            agent: self.agent,
            session: self.session,
            seq: self.since_seq,
        }
    }

    /// Whether the agent itself took a view during the search.
    pub(crate) fn is_own(&self, view: &StoredView) -> bool {
        view.is_since(self.since())
    }

    /// Whether the state is one that this program may have written to a checkpoint.
    pub(crate) fn is_sound(&self, agents: usize, is_channel: impl Fn(u8, usize) -> bool) -> bool {
        (self.agent as usize) < agents
            && self.queries.len() <= tuning::QUERIES_MAX
            && self
                .queries
                .iter()
                .all(|query| is_channel(query.channel, query.vector.len()))
    }
}

state_of_struct!(QueryView {
    in_odom,
    travelled_m,
    channel,
    vector as Counted<u16>,
    similar as Counted<u64>,
});

state_of_struct!(Search {
    agent,
    since_seq,
    session,
    compared,
    thinnings,
    found_m,
    fresh,
    queries as Counted<u64>,
});
