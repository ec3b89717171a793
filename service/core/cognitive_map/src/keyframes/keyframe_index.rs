//! An index of keyframes by sample, from which a search for an earlier sample begins.

use state::NONE;

use super::tuning;

/// A keyframe with its sample when it was added. It may be gone since, and its number another
/// one's.
#[derive(Clone, Copy, Debug)]
pub(super) struct IndexEntry {
    pub(super) session: u32,
    pub(super) seq: u64,
    pub(super) keyframe: u32,
}

/// For each agent every 64th of its keyframes, in the order of time. It follows from the chains, is
/// not part of a checkpoint, and changes no answer.
#[derive(Clone, Debug, Default)]
pub(super) struct KeyframeIndex {
    of_agents: Vec<AgentIndex>,
}

#[derive(Clone, Debug, Default)]
struct AgentIndex {
    /// Keyframes since the latest index entry.
    since: u32,
    entries: Vec<IndexEntry>,
}

impl KeyframeIndex {
    /// Adds a keyframe of an agent, one of so many; `is_valid` tells whether that of an entry is
    /// there.
    pub(super) fn add(
        &mut self,
        agent: u32,
        entry: IndexEntry,
        n_keyframes: usize,
        is_valid: impl Fn(&IndexEntry) -> bool,
    ) {
        let agent = agent as usize;
        if self.of_agents.len() <= agent {
            self.of_agents.resize_with(agent + 1, AgentIndex::default);
        }
        let index = &mut self.of_agents[agent];
        index.since += 1;
        if index.since < tuning::INDEX_SPACING {
            return;
        }
        index.since = 0;
        index.entries.push(entry);
        // Sparsification invalidates entries: they are removed once they may be half of all.
        if index.entries.len() > 2 * n_keyframes / tuning::INDEX_SPACING as usize + 64 {
            index.entries.retain(is_valid);
        }
    }

    /// The earliest indexed keyframe of an agent after a sample; [`NONE`] if there is none.
    pub(super) fn first_after(
        &self,
        agent: u32,
        session: u32,
        seq: u64,
        is_valid: impl Fn(&IndexEntry) -> bool,
    ) -> u32 {
        let Some(index) = self.of_agents.get(agent as usize) else {
            return NONE;
        };
        let is_before = |entry: &IndexEntry| (entry.session, entry.seq) <= (session, seq);
        let first = index.entries.partition_point(is_before);
        let valid = index.entries[first..].iter().find(|entry| is_valid(entry));
        valid.map_or(NONE, |entry| entry.keyframe)
    }
}
