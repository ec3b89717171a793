//! What an agent has seen since it does not know where it is.

use nalgebra::Isometry3;

use crate::keyframes::revisit::{
    ALIKE_MAX, Likeness, Revisits, View, read_all, read_vector, write_all, write_vector,
};
use state::PagedVec;
use state::{CorruptState, State, StateReader, StateWriter};

/// Looks that are kept, and the way over which they lie: beyond some metres odometry adds errors of its own \[m\].
const LOOKS_MAX: usize = 48;
const WAY_M_MAX: f64 = 5.0;
/// Numbers in them: a quarter of a MiB.
const NUMBERS_MAX: usize = 1 << 16;

/// What was seen at a moment, and which remembered views it is like.
#[derive(Clone, Debug)]
pub(super) struct Look {
    /// Where the agent was by motion alone.
    pub(super) in_odom: Isometry3<f64>,
    /// The way there since the search began \[m\].
    pub(super) travelled_m: f64,
    /// Number of the channel.
    pub(super) channel: u8,
    /// A unit vector.
    pub(super) vector: Box<[f32]>,
    /// The remembered views that it is like, the most alike first.
    pub(super) alike: Vec<Likeness>,
}

/// A search under way.
#[derive(Clone, Debug)]
pub(in crate::keyframes) struct Search {
    pub(super) agent: u32,
    /// The sample of the agent's session from which on it does not know where it is.
    pub(super) since_seq: u64,
    pub(super) session: u32,
    /// Views, and times that views were thinned, up to which the looks have been compared with them.
    pub(super) compared: u64,
    pub(super) thinnings: u64,
    /// The way after which it was found \[m\]; it goes on until the heading is sure, too.
    pub(super) found_m: Option<f64>,
    /// Looks since the poses were sought.
    pub(super) fresh: u32,
    pub(super) looks: Vec<Look>,
}

/// The searches, at most one of an agent.
pub(in crate::keyframes) type Searches = PagedVec<Search, 1>;

impl Search {
    pub(super) fn new(agent: u32, session: u32, seq: u64) -> Self {
        Self {
            agent,
            since_seq: seq,
            session,
            compared: 0,
            thinnings: 0,
            found_m: None,
            fresh: 0,
            looks: Vec::new(),
        }
    }

    /// Adds a look. When there is no room the oldest goes, or of a short way the one that lies nearest to its neighbours.
    pub(super) fn look(
        &mut self,
        in_odom: Isometry3<f64>,
        channel: u8,
        vector: &[f32],
        alike: Vec<Likeness>,
    ) {
        let travelled_m = self.looks.last().map_or(0.0, |last| {
            last.travelled_m + (in_odom.translation.vector - last.in_odom.translation.vector).norm()
        });
        self.looks.push(Look {
            in_odom,
            travelled_m,
            channel,
            vector: vector.into(),
            alike,
        });
        let mut numbers: usize = self.looks.iter().map(|look| look.vector.len()).sum();
        while self.looks.len() > LOOKS_MAX || numbers > NUMBERS_MAX.max(vector.len()) {
            numbers -= self.looks.remove(self.dispensable()).vector.len();
        }
        self.fresh += 1;
    }

    /// The look that says least beside the others.
    fn dispensable(&self) -> usize {
        let way_m = |from: &Look, to: &Look| to.travelled_m - from.travelled_m;
        if let [first, .., last] = &self.looks[..]
            && way_m(first, last) > WAY_M_MAX
        {
            return 0;
        }
        let gaps = self.looks.windows(3).map(|at| way_m(&at[0], &at[2]));
        let least = gaps.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        least.map_or(0, |(before, _)| before + 1)
    }

    /// Whether the agent has gone so far since it was found, whether it knew again where it was or not \[m\].
    pub(super) fn is_over(&self, on_m: f64) -> bool {
        let way_m = self.looks.last().map(|look| look.travelled_m);
        let since = way_m.zip(self.found_m);
        since.is_some_and(|(way_m, found_m)| way_m - found_m >= on_m)
    }

    /// Its looks have been compared with nothing that is remembered now, and poses are to be sought with the next one.
    pub(super) fn await_comparison(&mut self, revisits: &Revisits) {
        (self.compared, self.thinnings) = (0, revisits.thinnings);
        self.fresh = u32::try_from(self.looks.len()).unwrap_or(u32::MAX);
    }

    /// Compares the looks with what others have seen since they were made.
    pub(super) fn catch_up(&mut self, revisits: &Revisits) {
        let views = revisits.views.len() as u64;
        let from = if self.thinnings == revisits.thinnings {
            self.compared
        } else {
            views
        };
        (self.compared, self.thinnings) = (views, revisits.thinnings);
        let from = usize::try_from(from).unwrap_or(usize::MAX);
        if from >= revisits.views.len() {
            return;
        }
        let (agent, session, since_seq) = (self.agent, self.session, self.since_seq);
        for look in &mut self.looks {
            let is_own = |view: &View| view.is_of(agent, session, since_seq);
            let fresh = revisits.likes(look.channel, &look.vector, from, is_own);
            look.alike.extend(fresh);
            look.alike
                .sort_by(|a, b| a.distance.mean_m.total_cmp(&b.distance.mean_m));
            look.alike.truncate(ALIKE_MAX);
        }
    }

    /// Whether the agent itself saw that, since it does not know where it is.
    pub(super) fn is_own(&self, view: &View) -> bool {
        view.is_of(self.agent, self.session, self.since_seq)
    }

    /// Whether it may have come from a checkpoint that this program wrote.
    pub(in crate::keyframes) fn is_sound(
        &self,
        agents: usize,
        is_channel: impl Fn(u8, usize) -> bool,
    ) -> bool {
        (self.agent as usize) < agents
            && self.looks.len() <= LOOKS_MAX
            && self
                .looks
                .iter()
                .all(|look| is_channel(look.channel, look.vector.len()))
    }
}

impl State for Look {
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
        write_all(&self.looks, out);
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
            looks: read_all(input)?,
        })
    }
}
