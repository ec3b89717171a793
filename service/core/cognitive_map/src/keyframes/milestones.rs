//! Where to begin a search for an earlier sample.

use super::graph::KeyframeGraph;
use state::NONE;

/// Anchors of an agent from one milestone to the next.
const SPACING: u32 = 64;

/// An anchor that was there once, with the sample at which the agent came to it. Its number may have gone to another one.
#[derive(Clone, Copy, Debug)]
struct Milestone {
    session: u32,
    seq: u64,
    anchor: u32,
}

/// For each agent some of its anchors, in the order of time. They follow from the chains, and change no answer.
#[derive(Clone, Debug, Default)]
pub(super) struct Milestones {
    of_agents: Vec<Track>,
}

#[derive(Clone, Debug, Default)]
struct Track {
    /// Anchors since the latest milestone.
    since: u32,
    milestones: Vec<Milestone>,
}

impl KeyframeGraph {
    /// An agent has a new anchor.
    pub(super) fn pass_milestone(&mut self, agent: u32, number: u32) {
        let Some(anchor) = self.anchors.get(number) else {
            return;
        };
        let milestone = Milestone {
            session: anchor.session,
            seq: anchor.seq,
            anchor: number,
        };
        let index = agent as usize;
        let tracks = &mut self.milestones.of_agents;
        if tracks.len() <= index {
            tracks.resize_with(index + 1, Track::default);
        }
        let track = &mut tracks[index];
        track.since += 1;
        if track.since < SPACING {
            return;
        }
        track.since = 0;
        track.milestones.push(milestone);
        // Thinning takes milestones away; those that are left are sorted out once they may be half of them.
        if track.milestones.len() > 2 * self.anchors.len() / SPACING as usize + 64 {
            let mut milestones = std::mem::take(&mut track.milestones);
            milestones.retain(|milestone| self.stands(agent, milestone));
            self.milestones.of_agents[index].milestones = milestones;
        }
    }

    /// Finds the milestones of chains that were read from a checkpoint.
    pub(super) fn set_milestones(&mut self) {
        for agent in 0..self.lives.len() {
            let newest = self.lives.get(agent).map_or(NONE, |life| life.newest);
            let mut chain = Vec::new();
            let mut number = newest;
            while let Some(anchor) = self.anchors.get(number) {
                chain.push(number);
                number = anchor.previous;
            }
            let agent = u32::try_from(agent).unwrap_or(NONE);
            for &number in chain.iter().rev() {
                self.pass_milestone(agent, number);
            }
        }
    }

    /// The earliest anchor of a milestone that an agent came to after a sample; [`NONE`] if there is none.
    pub(super) fn milestone_after(&self, agent: u32, session: u32, seq: u64) -> u32 {
        let Some(track) = self.milestones.of_agents.get(agent as usize) else {
            return NONE;
        };
        let milestones = &track.milestones;
        let first = milestones
            .partition_point(|milestone| (milestone.session, milestone.seq) <= (session, seq));
        let standing = milestones[first..]
            .iter()
            .find(|milestone| self.stands(agent, milestone));
        standing.map_or(NONE, |milestone| milestone.anchor)
    }

    /// Whether the anchor of a milestone is still there.
    fn stands(&self, agent: u32, milestone: &Milestone) -> bool {
        self.anchors.get(milestone.anchor).is_some_and(|anchor| {
            (anchor.agent, anchor.session, anchor.seq) == (agent, milestone.session, milestone.seq)
        })
    }
}
