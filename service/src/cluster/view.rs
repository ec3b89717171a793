//! What a node sees of the others, and what follows for each shard. It does nothing, waits for
//! nothing and reads no clock.
//!
//! Nodes are seen in two ways: by a token on Zenoh, which goes when the link does, and by beats in
//! the storage. Only both together make a *live* node. One with beats and no token is *apart*: its
//! shards are its own, and whichever side of such a cut has fewer nodes gives its shards up. One
//! without beats has *lapsed*, and its shards are free.
//!
//! Anybody on Zenoh can declare a token, and only nodes write to the storage. So a token of a node
//! says nothing without beats, where a node is reached is in its beats, and the token of an owner
//! is believed until the storage must have told of it.

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, Instant};

use super::placement;
use super::standing::NodeState;
use crate::store::{NodeId, NodeRecord, OwnerRecord, Seen, ShardNumber, Shards};

/// Beats after which a node without a token has lapsed, and what only a token says is forgotten.
const BEATS_MISSED: u32 = 3;
/// Most tokens of each kind that are remembered. Source: more than there are shards at most.
const TOKENS_MAX: usize = 4096;

/// Times after which things are believed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Patience {
    /// Time between the beats of a node.
    pub(super) beat: Duration,
    /// How long a node does without contact to the storage.
    pub(super) lease: Duration,
    /// How long the live nodes must have been the same before shards move.
    pub(super) settled: Duration,
}

/// What a node sees.
#[derive(Debug)]
pub(super) struct View {
    me: NodeId,
    patience: Patience,
    /// Nodes that have a token.
    linked: BTreeSet<NodeId>,
    /// The beats of other nodes.
    beats: BTreeMap<NodeId, Beat>,
    /// Owners by the storage, and by tokens, each with when it was first heard of.
    recorded: BTreeMap<ShardNumber, OwnerRecord>,
    announced: BTreeMap<OwnerRecord, Instant>,
    /// When this node last had contact to the storage.
    contact: Option<Instant>,
    /// The live nodes, and since when they are the same.
    live: Lasting,
    /// The nodes that are apart.
    apart: Lasting,
    shards: Shards,
    /// While this node yields, shards without an owner that is there, each with since when.
    unowned: BTreeMap<ShardNumber, Instant>,
    /// Shards that this node left to a larger side, which has not come for them.
    reclaimed: BTreeSet<ShardNumber>,
}

/// Nodes, and since when they are the same.
#[derive(Debug, Default)]
struct Lasting {
    nodes: BTreeSet<NodeId>,
    since: Option<Instant>,
}

#[derive(Debug)]
struct Beat {
    /// Where the node is reached over HTTP.
    address: String,
    mark: String,
    changed: Instant,
}

impl View {
    pub(super) fn new(me: NodeId, shards: Shards, patience: Patience) -> Self {
        Self {
            me,
            patience,
            linked: BTreeSet::new(),
            beats: BTreeMap::new(),
            recorded: BTreeMap::new(),
            announced: BTreeMap::new(),
            contact: None,
            live: Lasting::default(),
            apart: Lasting::default(),
            shards,
            unowned: BTreeMap::new(),
            reclaimed: BTreeSet::new(),
        }
    }

    /// A node's token came or went.
    pub(super) fn link(&mut self, node: NodeId, there: bool) {
        if !there {
            self.linked.remove(&node);
        } else if node != self.me
            && (self.beats.contains_key(&node) || self.linked.len() < TOKENS_MAX)
        {
            self.linked.insert(node);
        }
    }

    /// The token of a shard's owner came or went.
    pub(super) fn announce(&mut self, owner: OwnerRecord, there: bool, now: Instant) {
        if !there {
            self.announced.remove(&owner);
        } else if self.announced.len() < TOKENS_MAX {
            self.announced.entry(owner).or_insert(now);
        }
    }

    /// The storage was reached at `asked`, and holds this.
    pub(super) fn observe(&mut self, seen: Seen, asked: Instant, now: Instant) {
        // A node that has seen nothing for a while cannot tell who has said nothing.
        let looked = self.patience.beat * BEATS_MISSED;
        let was_blind = (self.contact).is_none_or(|at| now.saturating_duration_since(at) > looked);
        self.contact = Some(asked);
        let mut beats = BTreeMap::new();
        for record in seen.nodes {
            let NodeRecord {
                node,
                address,
                mark,
            } = record;
            if node == self.me {
                continue;
            }
            let changed = match self.beats.get(&node) {
                Some(beat) if beat.mark == mark && !was_blind => beat.changed,
                _ => now,
            };
            let beat = Beat {
                address,
                mark,
                changed,
            };
            beats.insert(node, beat);
        }
        self.beats = beats;
        self.recorded.clear();
        for owner in seen.owners {
            let known = self.recorded.get(&owner.shard);
            if known.is_none_or(|known| known.term < owner.term) {
                self.recorded.insert(owner.shard, owner);
            }
        }
    }

    /// Brings what follows from the time up to date. To be called before the questions below.
    pub(super) fn settle(&mut self, now: Instant) {
        let (mut live, mut apart) = (BTreeSet::new(), BTreeSet::new());
        for node in self.beats.keys() {
            match self.state(node, now) {
                NodeState::Live => _ = live.insert(node.clone()),
                NodeState::Apart => _ = apart.insert(node.clone()),
                NodeState::Lapsed => {}
            }
        }
        live.insert(self.me.clone());
        self.live.update(live, now);
        self.apart.update(apart, now);
        self.reclaim(now);
    }

    /// Of a team in three parts or more, each may see a larger side, which there is not: after two
    /// leases without an owner a shard is for the node that would have it without a cut.
    fn reclaim(&mut self, now: Instant) {
        if !self.yields(now) {
            self.unowned.clear();
            self.reclaimed.clear();
            return;
        }
        for shard in self.shards.all() {
            let recorded = self.recorded.get(&shard);
            if recorded.is_some_and(|owner| self.is_there(&owner.node, now)) {
                self.unowned.remove(&shard);
            } else {
                self.unowned.entry(shard).or_insert(now);
            }
        }
        let all: BTreeSet<_> = self.live.nodes.union(&self.apart.nodes).collect();
        let left = self.unowned.iter().filter(|(shard, since)| {
            now.saturating_duration_since(**since) >= 2 * self.patience.lease
                && placement::owner(**shard, all.iter().copied()) == Some(&self.me)
        });
        let left: Vec<_> = left.map(|(shard, _)| *shard).collect();
        self.reclaimed.extend(left);
    }

    /// When this node had contact to the storage last.
    pub(super) fn contact(&self) -> Option<Instant> {
        self.contact
    }

    /// Whether this node has had contact to the storage of late.
    pub(super) fn in_contact(&self, now: Instant) -> bool {
        self.contact
            .is_some_and(|at| now.saturating_duration_since(at) < self.patience.lease)
    }

    /// Whether another node takes part.
    pub(super) fn state(&self, node: &NodeId, now: Instant) -> NodeState {
        let linked = self.linked.contains(node);
        let patience = if linked {
            self.patience.lease
        } else {
            self.patience.beat * BEATS_MISSED
        };
        // A node that sees nothing itself cannot tell who says nothing.
        let looked = self.contact.map_or(now, |at| at.min(now));
        let beat = self.beats.get(node);
        let fresh =
            beat.is_some_and(|beat| looked.saturating_duration_since(beat.changed) < patience);
        match (fresh, linked) {
            (true, true) => NodeState::Live,
            (true, false) => NodeState::Apart,
            (false, _) => NodeState::Lapsed,
        }
    }

    /// The other nodes, with their addresses.
    pub(super) fn others(&self, now: Instant) -> Vec<(&NodeId, &str, NodeState)> {
        let nodes = self.beats.iter();
        nodes
            .map(|(node, beat)| (node, &*beat.address, self.state(node, now)))
            .collect()
    }

    /// The shards that this node is to own; none while nodes come or go, which leaves
    /// everything as it is.
    pub(super) fn wanted(&self, now: Instant) -> Option<BTreeSet<ShardNumber>> {
        if !self.live.lasts(self.patience.settled, now) {
            return None;
        }
        if self.yields(now) {
            return Some(self.reclaimed.clone());
        }
        let live = &self.live.nodes;
        let mine =
            { self.shards.all() }.filter(|shard| placement::owner(*shard, live) == Some(&self.me));
        Some(mine.collect())
    }

    /// Whether this side of a cut leaves the shards to the other one: the side with fewer nodes,
    /// or of two equal ones that without the first node. A node that has just come is apart until
    /// its token is there.
    fn yields(&self, now: Instant) -> bool {
        let (live, apart) = (&self.live.nodes, &self.apart.nodes);
        let of_equals = apart.len() == live.len() && apart.first() < live.first();
        (apart.len() > live.len() || of_equals) && self.apart.lasts(self.patience.lease, now)
    }

    /// Whether a shard may be claimed: nobody owns it that may still be at work on it. What tokens
    /// say does not count here, since anybody on Zenoh can declare one.
    pub(super) fn is_free(&self, shard: ShardNumber, now: Instant) -> bool {
        let free = |OwnerRecord { node, .. }: &OwnerRecord| {
            *node == self.me || self.state(node, now) == NodeState::Lapsed
        };
        self.recorded.get(&shard).is_none_or(free)
    }

    /// What the storage says that this node owns.
    pub(super) fn recorded_of_me(&self) -> impl Iterator<Item = &OwnerRecord> {
        self.recorded.values().filter(|owner| owner.node == self.me)
    }

    /// The latest owner of a shard by the storage.
    pub(super) fn recorded(&self, shard: ShardNumber) -> Option<&OwnerRecord> {
        self.recorded.get(&shard)
    }

    /// The latest owner of a shard that is there, by the storage or by a token, which comes first.
    pub(super) fn owner(&self, shard: ShardNumber, now: Instant) -> Option<&OwnerRecord> {
        let told_by = self.patience.beat * BEATS_MISSED;
        let is_news = |heard: Instant| self.contact.is_none_or(|at| at < heard + told_by);
        let expected = placement::owner(shard, &self.live.nodes);
        let announced = { self.announced.iter() }
            .filter(|(owner, heard)| owner.shard == shard && is_news(**heard))
            .map(|(owner, _)| owner)
            .filter(|owner| Some(&owner.node) == expected);
        announced
            .chain(self.recorded.get(&shard))
            .filter(|owner| self.is_there(&owner.node, now))
            .max_by_key(|owner| owner.term)
    }

    fn is_there(&self, node: &NodeId, now: Instant) -> bool {
        *node == self.me || self.state(node, now) != NodeState::Lapsed
    }

    /// Records and beats that nobody needs any more: those of nodes that have lapsed long ago.
    pub(super) fn left_behind(&self, now: Instant) -> Vec<(NodeId, String)> {
        let long = self.patience.lease * 12;
        let gone = self.beats.iter().filter(|(node, beat)| {
            now.saturating_duration_since(beat.changed) > long && !self.linked.contains(node)
        });
        gone.map(|(node, beat)| (node.clone(), beat.address.clone()))
            .collect()
    }

    /// Where a node is reached.
    pub(super) fn address(&self, node: &NodeId) -> Option<&str> {
        self.beats.get(node).map(|beat| &*beat.address)
    }
}

impl Lasting {
    fn update(&mut self, nodes: BTreeSet<NodeId>, now: Instant) {
        if nodes != self.nodes || self.since.is_none() {
            self.nodes = nodes;
            self.since = Some(now);
        }
    }

    /// Whether the nodes have been the same for so long.
    fn lasts(&self, time: Duration, now: Instant) -> bool {
        self.since
            .is_some_and(|since| now.saturating_duration_since(since) >= time)
    }
}
