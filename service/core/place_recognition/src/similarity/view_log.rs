//! The log of views: all that agents of the map saw along their ways.

use nalgebra::Isometry3;

use crate::keyframes::SampleKey;
use crate::tuning::log as tuning;
use state::{CorruptState, Counted, PagedVec, State, StateReader, StateWriter, state_of_struct};

/// A view of the log.
#[derive(Clone, Debug)]
pub(crate) struct LoggedView {
    /// Number of the channel.
    pub(crate) channel: u8,
    pub(crate) sample: SampleKey,
    /// Its number among the agent's views of the channel; neighbours differ by the log's stride.
    pub(crate) ordinal: u32,
    /// The number of its stretch among those between which the agent was put elsewhere.
    pub(crate) stretch: u32,
    /// Pose by motion alone since the session began.
    pub(crate) in_odom: Isometry3<f64>,
    /// The descriptor, or its random projection where it has many numbers.
    pub(crate) vector: Box<[f32]>,
}

state_of_struct!(LoggedView {
    channel,
    sample,
    ordinal,
    stretch,
    in_odom,
    vector as Counted<u16>,
});

/// The views of all agents of the map, evenly thinned where they are many. A clone shares all
/// pages.
#[derive(Clone, Debug)]
pub struct ViewLog {
    pub(crate) views: PagedVec<LoggedView, 16>,
    /// One view in so many is kept.
    pub(crate) stride: u32,
    /// Views that were added since they were last matched.
    pub(crate) n_new: u32,
}

impl Default for ViewLog {
    fn default() -> Self {
        Self {
            views: PagedVec::default(),
            stride: 1,
            n_new: 0,
        }
    }
}

impl ViewLog {
    /// Adds a view, if its ordinal is one of those that are kept.
    pub(crate) fn add(&mut self, view: LoggedView, revision: u64) {
        if !view.ordinal.is_multiple_of(self.stride) {
            return;
        }
        self.views.push(view, revision);
        self.n_new = self.n_new.saturating_add(1);
        if self.views.len() > tuning::VIEWS_MAX {
            self.thin(revision);
        }
    }

    /// Drops every second view of each way, or, of the first views of many sessions, every second
    /// one of all.
    fn thin(&mut self, revision: u64) {
        let last = self.views.iter().map(|view| view.ordinal).max();
        if last.is_some_and(|last| self.stride <= last) {
            self.stride = self.stride.saturating_mul(2);
            let stride = self.stride;
            self.retain(revision, |view| view.ordinal.is_multiple_of(stride));
        }
        if self.views.len() > tuning::VIEWS_MAX {
            let mut number = 0_u32;
            self.retain(revision, |_| {
                number += 1;
                number.is_multiple_of(2)
            });
        }
    }

    /// Forgets what an agent saw in a session, from a sample on.
    pub(crate) fn forget_since(&mut self, since: SampleKey, revision: u64) {
        let is_gone = |view: &LoggedView| {
            let own = view.sample;
            (own.agent, own.session) == (since.agent, since.session) && own.seq >= since.seq
        };
        if self.views.iter().any(is_gone) {
            self.retain(revision, |view| !is_gone(view));
        }
    }

    fn retain(&mut self, revision: u64, mut is_kept: impl FnMut(&LoggedView) -> bool) {
        let mut next = 0;
        for number in 0..self.views.len() {
            let view = self.views.get(number).filter(|view| is_kept(view)).cloned();
            let Some(view) = view else {
                continue;
            };
            if next != number
                && let Some(slot) = self.views.get_mut(next, revision)
            {
                *slot = view;
            }
            next += 1;
        }
        while self.views.len() > next {
            self.views.pop(revision);
        }
    }

    /// Whether so many views are new that they are to be matched with the earlier ones.
    pub fn is_due(&self) -> bool {
        let n_old = self.views.len().saturating_sub(self.n_new as usize);
        self.views.len() >= tuning::VIEWS_MIN
            && self.n_new as usize >= tuning::NEW_MIN.max(n_old / tuning::PER_NEW)
    }

    /// Whether, with the new views, it has become longer by two fifths, or by a power of that,
    /// since they were last matched.
    pub fn is_much_longer(&self) -> bool {
        let half_octaves = |n: usize| {
            let n = n.saturating_mul(self.stride as usize);
            n.saturating_mul(n).checked_ilog2()
        };
        let n_old = self.views.len().saturating_sub(self.n_new as usize);
        half_octaves(self.views.len()) != half_octaves(n_old)
    }

    /// All views count as matched.
    pub fn matched(&mut self) {
        self.n_new = 0;
    }

    /// The samples of the views of a channel.
    pub fn samples_of(&self, channel: u8) -> impl Iterator<Item = SampleKey> + '_ {
        let own = { self.views.iter() }.filter(move |view| view.channel == channel);
        own.map(|view| view.sample)
    }

    /// Whether there is nothing in it.
    pub fn is_empty(&self) -> bool {
        self.views.len() == 0
    }

    /// The channels that it has views of.
    pub(crate) fn channels(&self) -> Vec<u8> {
        let mut channels: Vec<u8> = self.views.iter().map(|view| view.channel).collect();
        channels.sort_unstable();
        channels.dedup();
        channels
    }

    /// Writes what is in no page.
    pub fn write_head(&self, out: &mut StateWriter) {
        (self.stride, self.n_new).write(out);
    }

    /// Reads what [`write_head`](Self::write_head) wrote.
    pub(crate) fn read_head(&mut self, input: &mut StateReader<'_>) -> Result<(), CorruptState> {
        (self.stride, self.n_new) = State::read(input)?;
        Ok(())
    }

    /// Writes the digests of its pages.
    pub fn write_digests(&self, out: &mut StateWriter) {
        (self.stride, self.n_new).write(out);
        self.views.write_digests(out);
    }

    /// Whether its views are of so many agents, and those of a channel of one length.
    pub(crate) fn is_sound(&self, agents: usize, length: impl Fn(u8) -> Option<usize>) -> bool {
        let is_sound = |view: &LoggedView| {
            let length = length(view.channel).map(|length| length.min(tuning::NUMBERS_MAX));
            (view.sample.agent as usize) < agents
                && length == Some(view.vector.len())
                && view.vector.iter().all(|number| number.is_finite())
                && view.in_odom.to_homogeneous().iter().all(|x| x.is_finite())
        };
        self.stride > 0 && self.views.iter().all(is_sound)
    }

    /// Bytes of memory that it takes.
    pub(crate) fn bytes(&self) -> usize {
        let numbers: usize = self.views.iter().map(|view| view.vector.len()).sum();
        self.views.bytes() + 4 * numbers
    }
}

/// A descriptor as it is logged: with many numbers, its projection by random signs, which keeps
/// inner products (Weinberger et al. 2009, "Feature hashing for large scale multitask learning").
pub(crate) fn logged(vector: &[f32]) -> Box<[f32]> {
    if vector.len() <= tuning::NUMBERS_MAX {
        return vector.into();
    }
    let mut projected = vec![0.0; tuning::NUMBERS_MAX];
    for (number, value) in (0_u64..).zip(vector) {
        // The finaliser of SplitMix64.
        let mut hash = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
        hash = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        hash = (hash ^ (hash >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        hash ^= hash >> 31;
        let sum = &mut projected[(hash >> 1) as usize % tuning::NUMBERS_MAX];
        *sum += if hash & 1 == 0 { *value } else { -*value };
    }
    projected.into()
}
