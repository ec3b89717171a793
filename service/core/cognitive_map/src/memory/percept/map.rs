//! The percept memory of a space, channel by channel.

use std::sync::Arc;

use super::descriptor::{Block, DescriptorMemory, Seen};
use super::level::{LevelMemory, LevelTrace, Sensed, surprise};
use super::{Channel, ChannelId, ChannelKind, Expected, FeltPercept, PerceptCue, Remembered};
use crate::input::{Descriptor, LEVEL_MAX, Label};
use crate::memory::ids::PlaceId;
use place_filter::{HeadingModel, Kernel, Stretch, Trace};
use state::{CorruptState, PageItems, PagedVec, StateWriter};

/// Most channels of a space. What is sensed on further ones is counted and stays in the journal.
const CHANNELS_MAX: usize = 64;
/// Channels per page.
pub(crate) const CHANNEL_PAGE: usize = 8;
/// Most pages of a channel's memory: what the index of a checkpoint's page leaves room for. That is
/// a page for every 64 places that there can ever be, and at least 6·10⁷ places can remember
/// something of a channel of descriptors.
pub(crate) const CHANNEL_PAGES_MAX: u32 = 1 << 26;
/// Up to so many descriptors of a channel are all compared with a cue.
const SCAN_MAX: usize = 100_000;
/// Beyond that, so many for each place of the answer, and these at least.
const CANDIDATES_PER_ANSWER: usize = 64;
/// See [`CANDIDATES_PER_ANSWER`].
const CANDIDATES_MIN: usize = 2048;

/// What places remember of what was sensed and seen. A clone shares all pages.
#[derive(Clone, Debug, Default)]
pub(crate) struct PerceptMap {
    channels: PagedVec<Channel, CHANNEL_PAGE>,
    /// The memory of each channel.
    memories: Arc<Vec<Memory>>,
}

/// What places remember of a channel.
#[derive(Clone, Debug)]
enum Memory {
    Levels(LevelMemory),
    Descriptors(DescriptorMemory),
}

/// A percept against what was expected of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Compared {
    /// The channel.
    pub(crate) channel: ChannelId,
    /// Number of percepts that taught what to expect.
    pub(crate) percepts: u64,
    /// For a level the distance from the mean in deviations, for a descriptor one minus the cosine.
    pub(crate) surprise: f64,
}

impl PerceptMap {
    /// The channels.
    pub(crate) fn channels(&self) -> &PagedVec<Channel, CHANNEL_PAGE> {
        &self.channels
    }

    /// A level is sensed while a place answers: compares, then strengthens the association. Nothing
    /// to compare the first time.
    pub(crate) fn learn_level(
        &mut self,
        label: &Label,
        sensed: &Sensed,
        revision: u64,
    ) -> Option<Compared> {
        let Sensed {
            place,
            value,
            weight,
            ..
        } = *sensed;
        if value.abs() > LEVEL_MAX {
            return None;
        }
        let channel = self.open(label, ChannelKind::Level, revision)?;
        let index = usize::from(channel.0);
        let record = self.channels.get_mut(index, revision)?;
        let Some(Memory::Levels(memory)) = Arc::make_mut(&mut self.memories).get_mut(index) else {
            return None;
        };
        let compared = memory.get(place).map(|trace| Compared {
            channel,
            percepts: trace.levels.count(),
            surprise: surprise(&trace.levels, value, record.level_sd_floor()),
        });
        memory.strengthen(sensed, record.variogram.is_usual(value), revision);
        record.learn_level(value, weight);
        compared
    }

    /// The channel of levels of a label; `None` for a level that no place would remember.
    pub(crate) fn level_channel(&self, label: &Label, value: f64) -> Option<u8> {
        let is_sense = value.abs() <= LEVEL_MAX;
        let index = self.find(label, ChannelKind::Level).filter(|_| is_sense)?;
        u8::try_from(index).ok()
    }

    /// A channel learns how levels go together: one, and earlier ones with their distances \[m\].
    pub(crate) fn learn_variogram(
        &mut self,
        channel: u8,
        value: f64,
        earlier: impl Iterator<Item = (f64, f64)>,
        revision: u64,
    ) {
        if let Some(channel) = self.channels.get_mut(usize::from(channel), revision) {
            channel.variogram.learn(value, earlier);
        }
    }

    /// Whether a level is like those of its channel.
    pub(crate) fn is_usual(&self, channel: u8, value: f64) -> bool {
        let channel = self.channels.get(usize::from(channel));
        channel.is_none_or(|channel| channel.variogram.is_usual(value))
    }

    /// A channel learns that an agent sensed a usual level, or an unusual one.
    pub(crate) fn learn_of(
        &mut self,
        channel: u8,
        agent: u32,
        unusual: Option<f64>,
        revision: u64,
    ) {
        let Some(channel) = self.channels.get_mut(usize::from(channel), revision) else {
            return;
        };
        match unusual {
            None => channel.variogram.hear_usual(agent),
            Some(value) => channel.variogram.learn_unusual(value, agent),
        }
    }

    /// A channel learns whether its levels tell the heading.
    pub(crate) fn learn_heading(
        &mut self,
        channel: u8,
        (agent, stretch): (u32, &Stretch),
        revision: u64,
    ) {
        if let Some(channel) = self.channels.get_mut(usize::from(channel), revision) {
            channel.compass.learn(agent, stretch);
        }
    }

    /// How a channel tells the heading of an agent; `None` for one that does not.
    pub(crate) fn heading_model(&self, channel: u8, agent: u32) -> Option<&HeadingModel> {
        { self.channels.get(usize::from(channel))? }
            .compass
            .tells(agent)
    }

    /// What a channel tells about a position.
    pub(crate) fn kernel(&self, channel: u8) -> Option<&Kernel> {
        self.channels.get(usize::from(channel))?.kernel()
    }

    /// What a place remembers of a channel, for who finds out where it is.
    pub(crate) fn trace(&self, place: PlaceId, channel: u8) -> Option<&Trace> {
        match self.memories.get(usize::from(channel))? {
            Memory::Levels(memory) => Some(&memory.get(place)?.felt).filter(|felt| felt.is_known()),
            Memory::Descriptors(_) => None,
        }
    }

    /// A place that answers with confidence `weight` sees a descriptor: compares, then strengthens
    /// the association. Nothing to compare the first time.
    pub(crate) fn learn_descriptor(
        &mut self,
        descriptor: &Descriptor,
        (place, weight): (PlaceId, f64),
        stamp_ns: i64,
        revision: u64,
    ) -> Option<Compared> {
        let vector = descriptor.vector();
        let channel = self.open(descriptor.channel(), kind_of(descriptor), revision)?;
        let memories = Arc::make_mut(&mut self.memories);
        let Some(Memory::Descriptors(memory)) = memories.get_mut(usize::from(channel.0)) else {
            return None;
        };
        let compared = memory
            .compare(place, vector)
            .map(|(percepts, cosine)| Compared {
                channel,
                percepts,
                surprise: 1.0 - cosine,
            });
        let seen = Seen {
            place,
            weight,
            vector,
            stamp_ns,
        };
        memory.strengthen(&seen, CHANNEL_PAGES_MAX as usize, revision);
        compared
    }

    /// What a place remembers, channel by channel.
    pub(crate) fn of_place(&self, place: PlaceId) -> impl Iterator<Item = Remembered> {
        let memories = (0u8..).map(ChannelId).zip(self.memories.iter());
        memories.filter_map(move |(channel, memory)| memory.recall(channel, place))
    }

    /// What a place has felt, channel by channel.
    pub(crate) fn felt_at(&self, place: PlaceId) -> impl Iterator<Item = FeltPercept> {
        let memories = (0u8..).map(ChannelId).zip(self.memories.iter());
        memories.filter_map(move |(channel, memory)| memory.felt(channel, place))
    }

    /// The places that remember something of the cue's channel, and how well each fits the cue: for
    /// a level its likelihood, for a descriptor the cosine.
    ///
    /// Where only the best `few` matter and a channel has more than [`SCAN_MAX`] descriptors,
    /// places are left out whose sketches are far from the cue's: the answer is then one to count
    /// on, and no longer a certain one.
    pub(crate) fn matches(&self, cue: &PerceptCue, few: Option<usize>) -> Vec<(PlaceId, f64)> {
        let (label, kind) = match cue {
            PerceptCue::Level { channel, .. } => (channel, ChannelKind::Level),
            PerceptCue::Descriptor(descriptor) => (descriptor.channel(), kind_of(descriptor)),
        };
        let Some(index) = self.find(label, kind) else {
            return Vec::new();
        };
        match (cue, &self.memories[index], self.channels.get(index)) {
            (PerceptCue::Level { value, .. }, Memory::Levels(memory), Some(channel)) => memory
                .likelihoods(*value, channel.level_sd_floor())
                .collect(),
            (PerceptCue::Descriptor(descriptor), Memory::Descriptors(memory), _) => {
                let vector = descriptor.vector();
                match few {
                    Some(few) if memory.len() > SCAN_MAX => {
                        let count = few.saturating_mul(CANDIDATES_PER_ANSWER);
                        let count = count.max(CANDIDATES_MIN);
                        memory.cosines_of_nearest(vector, count).collect()
                    }
                    _ => {
                        let mut found = Vec::with_capacity(memory.len());
                        found.extend(memory.cosines(vector));
                        found
                    }
                }
            }
            _ => Vec::new(),
        }
    }

    /// Forgets what a place remembers. What its percepts taught of their channels stays.
    pub(crate) fn forget(&mut self, place: PlaceId, revision: u64) {
        let remembers = |memory: &Memory| match memory {
            Memory::Levels(memory) => memory.get(place).is_some(),
            Memory::Descriptors(memory) => memory.remembers(place),
        };
        if !self.memories.iter().any(remembers) {
            return; // before the memories are copied for nothing
        }
        for memory in Arc::make_mut(&mut self.memories) {
            match memory {
                Memory::Levels(memory) => memory.forget(place, revision),
                Memory::Descriptors(memory) => memory.forget(place, revision),
            }
        }
    }

    /// Whether all places that remember something are `known`.
    pub(crate) fn knows_only(&self, known: impl Fn(PlaceId) -> bool) -> bool {
        self.memories.iter().all(|memory| match memory {
            Memory::Levels(memory) => memory.places().all(&known),
            Memory::Descriptors(memory) => memory.traces().all(|trace| known(trace.place)),
        })
    }

    /// Bytes of memory that what places remember takes, reserved ones included.
    pub(crate) fn bytes(&self) -> usize {
        let memories = self.memories.iter().map(|memory| match memory {
            Memory::Levels(memory) => memory.traces().bytes(),
            Memory::Descriptors(memory) => memory.bytes(),
        });
        memories.sum::<usize>() + self.channels.bytes()
    }

    /// The pages of levels that changed after a revision: channel, page, what places remember.
    pub(crate) fn changed_levels(
        &self,
        since: u64,
    ) -> impl Iterator<Item = (usize, usize, PageItems<'_, LevelTrace>)> {
        let memories = self.memories.iter().enumerate();
        memories.flat_map(move |(channel, memory)| {
            let Memory::Levels(memory) = memory else {
                return None.into_iter().flatten();
            };
            let pages = memory.traces().changed_pages(since);
            Some(pages.map(move |(page, items)| (channel, page, items)))
                .into_iter()
                .flatten()
        })
    }

    /// The blocks of descriptors that changed after a revision: channel, page, the block.
    pub(crate) fn changed_descriptors(
        &self,
        since: u64,
    ) -> impl Iterator<Item = (usize, usize, &[Block])> {
        let memories = self.memories.iter().enumerate();
        memories.flat_map(move |(channel, memory)| {
            let Memory::Descriptors(memory) = memory else {
                return None.into_iter().flatten();
            };
            let pages = memory.blocks().changed_pages(since);
            Some(pages.map(move |(page, _, blocks)| (channel, page, blocks)))
                .into_iter()
                .flatten()
        })
    }

    /// Writes the digests of all pages.
    pub(crate) fn write_digests(&self, out: &mut StateWriter) {
        self.channels.write_digests(out);
        for memory in self.memories.iter() {
            match memory {
                Memory::Levels(memory) => memory.traces().write_digests(out),
                Memory::Descriptors(memory) => memory.blocks().write_digests(out),
            }
        }
    }

    /// Appends a checkpoint's page of channels; two that are the same are refused.
    pub(crate) fn push_channels(
        &mut self,
        bytes: &[u8],
        revision: u64,
    ) -> Result<(), CorruptState> {
        let start = self.channels.len();
        self.channels.push_page(bytes, revision)?;
        if self.channels.len() > CHANNELS_MAX {
            return Err(CorruptState::Invalid);
        }
        for channel in self.channels.iter_from(start) {
            Arc::make_mut(&mut self.memories).push(Memory::new(channel.kind()));
        }
        for (index, channel) in self.channels.iter().enumerate() {
            if self.find(channel.label(), channel.kind()) != Some(index) {
                return Err(CorruptState::Invalid);
            }
        }
        Ok(())
    }

    /// Adds a checkpoint's page of what places remember of a channel.
    pub(crate) fn restore_memory(
        &mut self,
        channel: usize,
        page: usize,
        levels: bool,
        bytes: &[u8],
        revision: u64,
    ) -> Result<(), CorruptState> {
        match (Arc::make_mut(&mut self.memories).get_mut(channel), levels) {
            (Some(Memory::Levels(memory)), true) => memory.restore_page(page, bytes, revision),
            (Some(Memory::Descriptors(memory)), false) => memory.push_page(bytes, revision),
            _ => Err(CorruptState::Invalid),
        }
    }

    /// The channel of a label and a kind; a new one if there may be one more.
    fn open(&mut self, label: &Label, kind: ChannelKind, revision: u64) -> Option<ChannelId> {
        let index = self.find(label, kind).or_else(|| {
            let index = self.channels.len();
            (index < CHANNELS_MAX).then(|| {
                self.channels
                    .push(Channel::new(label.clone(), kind), revision);
                Arc::make_mut(&mut self.memories).push(Memory::new(kind));
                index
            })
        })?;
        u8::try_from(index).ok().map(ChannelId)
    }

    /// Index of the channel of a label and a kind.
    fn find(&self, label: &Label, kind: ChannelKind) -> Option<usize> {
        let is_it = |channel: &Channel| channel.kind() == kind && channel.label() == label;
        self.channels.iter().position(is_it)
    }
}

impl Memory {
    /// Nothing is remembered yet.
    fn new(kind: ChannelKind) -> Self {
        match kind {
            ChannelKind::Level => Self::Levels(LevelMemory::default()),
            ChannelKind::Descriptor { dimension } => {
                Self::Descriptors(DescriptorMemory::new(dimension))
            }
        }
    }

    /// What a place remembers.
    fn recall(&self, channel: ChannelId, place: PlaceId) -> Option<Remembered> {
        let (percepts, strength, expected) = match self {
            Self::Levels(memory) => {
                let levels = &memory.get(place)?.levels;
                let (mean, sd) = (levels.mean(), levels.sd());
                let expected = Expected::Level { mean, sd };
                (levels.count(), levels.weight(), expected)
            }
            Self::Descriptors(memory) => {
                let (trace, direction) = memory.get(place)?;
                let expected = Expected::Descriptor(direction);
                (trace.count, trace.weight, expected)
            }
        };
        Some(Remembered {
            place,
            channel,
            percepts,
            strength,
            expected,
        })
    }

    /// What a place has felt.
    fn felt(&self, channel: ChannelId, place: PlaceId) -> Option<FeltPercept> {
        let (percepts, strength, last_stamp_ns, level) = match self {
            Self::Levels(memory) => {
                let trace = memory.get(place)?;
                let levels = &trace.levels;
                let level = Some((levels.mean(), levels.sd()));
                (levels.count(), levels.weight(), trace.last_stamp_ns, level)
            }
            Self::Descriptors(memory) => {
                let trace = memory.trace(place)?;
                (trace.count, trace.weight, trace.last_stamp_ns, None)
            }
        };
        Some(FeltPercept {
            channel,
            percepts,
            strength,
            last_stamp_ns,
            level,
        })
    }
}

/// The kind of channel that a descriptor belongs to.
fn kind_of(descriptor: &Descriptor) -> ChannelKind {
    ChannelKind::Descriptor {
        dimension: u16::try_from(descriptor.vector().len())
            .expect("a descriptor has 4096 numbers at most"),
    }
}
