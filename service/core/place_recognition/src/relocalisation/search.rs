//! What an agent has seen since it does not know where it is.

use nalgebra::Isometry3;

use crate::keyframes::SampleKey;
use crate::sequences::{SIMILAR_MAX, ViewMemory};
use crate::views::{SimilarView, StoredView, read_all, read_vector, write_all, write_vector};
use state::PagedVec;
use state::{CorruptState, State, StateReader, StateWriter};

/// Looks that are kept, and the way over which they lie: beyond some metres odometry adds errors of its own \[m\].
const LOOKS_MAX: usize = 48;
const WAY_M_MAX: f64 = 5.0;
/// Numbers in them: a quarter of a MiB.
const NUMBERS_MAX: usize = 1 << 16;

/// What was seen at a moment, and which remembered views it is like.
#[derive(Clone, Debug)]
pub(crate) struct QueryView {
    /// Where the agent was by motion alone.
    pub(crate) in_odom: Isometry3<f64>,
    /// The way there since the search began \[m\].
    pub(crate) travelled_m: f64,
    /// Number of the channel.
    pub(crate) channel: u8,
    /// A unit vector.
    pub(crate) vector: Box<[f32]>,
    /// The remembered views that it is like, the most alike first.
    pub(crate) alike: Vec<SimilarView>,
}

/// A search under way.
#[derive(Clone, Debug)]
pub(crate) struct Search {
    pub(crate) agent: u32,
    /// The sample of the agent's session from which on it does not know where it is.
    pub(crate) since_seq: u64,
    pub(crate) session: u32,
    /// Views, and times that views were thinned, up to which the looks have been compared with them.
    pub(crate) compared: u64,
    pub(crate) thinnings: u64,
    /// The way after which it was found \[m\]; it goes on until the heading is sure, too.
    pub(crate) found_m: Option<f64>,
    /// Looks since the poses were sought.
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

    /// Adds a look. When there is no room the oldest goes, or of a short way the one that lies nearest to its neighbours.
    pub(crate) fn push(
        &mut self,
        in_odom: Isometry3<f64>,
        channel: u8,
        vector: &[f32],
        alike: Vec<SimilarView>,
    ) {
        let travelled_m = self.queries.last().map_or(0.0, |last| {
            last.travelled_m + (in_odom.translation.vector - last.in_odom.translation.vector).norm()
        });
        self.queries.push(QueryView {
            in_odom,
            travelled_m,
            channel,
            vector: vector.into(),
            alike,
        });
        let mut numbers: usize = self.queries.iter().map(|query| query.vector.len()).sum();
        while self.queries.len() > LOOKS_MAX || numbers > NUMBERS_MAX.max(vector.len()) {
            numbers -= self.queries.remove(self.dispensable()).vector.len();
        }
        self.fresh += 1;
    }

    /// The look that says least beside the others.
    fn dispensable(&self) -> usize {
        let way_m = |from: &QueryView, to: &QueryView| to.travelled_m - from.travelled_m;
        if let [first, .., last] = &self.queries[..]
            && way_m(first, last) > WAY_M_MAX
        {
            return 0;
        }
        let gaps = self.queries.windows(3).map(|at| way_m(&at[0], &at[2]));
        let least = gaps.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        least.map_or(0, |(before, _)| before + 1)
    }

    /// Whether the agent has gone so far since it was found, whether it knew again where it was or not \[m\].
    pub(crate) fn is_over(&self, on_m: f64) -> bool {
        let way_m = self.queries.last().map(|query| query.travelled_m);
        let since = way_m.zip(self.found_m);
        since.is_some_and(|(way_m, found_m)| way_m - found_m >= on_m)
    }

    /// Its looks have been compared with nothing that is remembered now, and poses are to be sought with the next one.
    pub(crate) fn await_comparison(&mut self, memory: &ViewMemory) {
        (self.compared, self.thinnings) = (0, memory.thinnings);
        self.fresh = u32::try_from(self.queries.len()).unwrap_or(u32::MAX);
    }

    /// Compares the looks with what others have seen since they were made.
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
            let fresh = memory.likes(query.channel, &query.vector, from, is_own);
            query.alike.extend(fresh);
            query
                .alike
                .sort_by(|a, b| a.distance.mean_m.total_cmp(&b.distance.mean_m));
            query.alike.truncate(SIMILAR_MAX);
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

    /// Whether the agent itself saw that, since it does not know where it is.
    pub(crate) fn is_own(&self, view: &StoredView) -> bool {
        view.is_since(self.since())
    }

    /// Whether it may have come from a checkpoint that this program wrote.
    pub(crate) fn is_sound(&self, agents: usize, is_channel: impl Fn(u8, usize) -> bool) -> bool {
        (self.agent as usize) < agents
            && self.queries.len() <= LOOKS_MAX
            && self
                .queries
                .iter()
                .all(|query| is_channel(query.channel, query.vector.len()))
    }
}

impl State for QueryView {
    fn write(&self, out: &mut StateWriter) {
        self.in_odom.write(out);
        self.travelled_m.write(out);
        self.channel.write(out);
        write_vector(&self.vector, out);
        write_all(&self.alike, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            in_odom: State::read(input)?,
            travelled_m: State::read(input)?,
            channel: State::read(input)?,
            vector: read_vector(input)?,
            alike: read_all(input)?,
        })
    }
}

impl State for Search {
    fn write(&self, out: &mut StateWriter) {
        self.agent.write(out);
        self.since_seq.write(out);
        self.session.write(out);
        self.compared.write(out);
        self.thinnings.write(out);
        self.found_m.write(out);
        self.fresh.write(out);
        write_all(&self.queries, out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self {
            agent: State::read(input)?,
            since_seq: State::read(input)?,
            session: State::read(input)?,
            compared: State::read(input)?,
            thinnings: State::read(input)?,
            found_m: State::read(input)?,
            fresh: State::read(input)?,
            queries: read_all(input)?,
        })
    }
}
