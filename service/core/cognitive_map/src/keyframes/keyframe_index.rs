//! An index of keyframes by sample, from which a search for an earlier sample begins.

use super::graph::KeyframeGraph;
use state::NONE;

/// Keyframes of an agent from one index entry to the next.
const SPACING: u32 = 64;

/// A keyframe with its sample when it was added. It may be gone since, and its number another
/// one's.
#[derive(Clone, Copy, Debug)]
struct IndexEntry {
    session: u32,
    seq: u64,
    keyframe: u32,
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

impl KeyframeGraph {
    /// An agent has a new keyframe.
    pub(super) fn index_keyframe(&mut self, agent: u32, number: u32) {
        let Some(keyframe) = self.keyframes.get(number) else {
            return;
        };
        let entry = IndexEntry {
            session: keyframe.session,
            seq: keyframe.seq,
            keyframe: number,
        };
        let agent_index = agent as usize;
        let agents = &mut self.index.of_agents;
        if agents.len() <= agent_index {
            agents.resize_with(agent_index + 1, AgentIndex::default);
        }
        let of_agent = &mut agents[agent_index];
        of_agent.since += 1;
        if of_agent.since < SPACING {
            return;
        }
        of_agent.since = 0;
        of_agent.entries.push(entry);
        // Sparsification invalidates entries: they are removed once they may be half of all.
        if of_agent.entries.len() > 2 * self.keyframes.len() / SPACING as usize + 64 {
            let mut entries = std::mem::take(&mut of_agent.entries);
            entries.retain(|entry| self.is_valid(agent, entry));
            self.index.of_agents[agent_index].entries = entries;
        }
    }

    /// Builds the index of chains that were read from a checkpoint.
    pub(super) fn rebuild_index(&mut self) {
        for agent in 0..self.tracks.len() {
            let newest = self.tracks.get(agent).map_or(NONE, |track| track.newest);
            let mut chain = Vec::new();
            let mut number = newest;
            while let Some(keyframe) = self.keyframes.get(number) {
                chain.push(number);
                number = keyframe.previous;
            }
            let agent = u32::try_from(agent).unwrap_or(NONE);
            for &number in chain.iter().rev() {
                self.index_keyframe(agent, number);
            }
        }
    }

    /// The earliest indexed keyframe of an agent after a sample; [`NONE`] if there is none.
    pub(super) fn first_indexed_after(&self, agent: u32, session: u32, seq: u64) -> u32 {
        let Some(of_agent) = self.index.of_agents.get(agent as usize) else {
            return NONE;
        };
        let entries = &of_agent.entries;
        let first = entries.partition_point(|entry| (entry.session, entry.seq) <= (session, seq));
        let valid = entries[first..]
            .iter()
            .find(|entry| self.is_valid(agent, entry));
        valid.map_or(NONE, |entry| entry.keyframe)
    }

    /// Whether the keyframe of an entry is still there.
    fn is_valid(&self, agent: u32, entry: &IndexEntry) -> bool {
        self.keyframes.get(entry.keyframe).is_some_and(|keyframe| {
            (keyframe.agent, keyframe.session, keyframe.seq) == (agent, entry.session, entry.seq)
        })
    }
}
