//! Guidance: blockages, and the routes that agents follow.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::input::AgentId;
use crate::memory::blockage::{BLOCKAGES_MAX, Blockage, BlockageId};
use crate::memory::ids::TripId;
use crate::route::Following;
use state::{CorruptState, State, StateReader, StateWriter, state_of_struct};

/// What instructions have said that still holds, without pins, which trips keep.
#[derive(Clone, Debug, Default)]
pub(crate) struct Guidance {
    /// Instructions so far.
    pub(crate) instructions: u64,
    /// Number of the record that changed it last.
    changed: u64,
    /// By number.
    blockages: Vec<Blockage>,
    followed: BTreeMap<AgentId, Arc<Following>>,
}

/// Guidance as a checkpoint has it.
struct Stored {
    instructions: u64,
    changed: u64,
    blockages: Vec<Blockage>,
    followed: Vec<(AgentId, Following)>,
    pinned: Vec<TripId>,
}

state_of_struct!(Stored {
    instructions,
    changed,
    blockages,
    followed,
    pinned,
});

impl Guidance {
    /// Whether nobody has ever said anything.
    pub(crate) fn is_untouched(&self) -> bool {
        self.instructions == 0
    }

    /// Whether something changed after a revision.
    pub(crate) fn changed_since(&self, revision: u64) -> bool {
        self.changed > revision
    }

    /// Notes that the record of a revision changes it.
    pub(crate) fn touch(&mut self, revision: u64) {
        self.changed = revision;
    }

    /// The blockages, by number.
    pub(crate) fn blockages(&self) -> &[Blockage] {
        &self.blockages
    }

    /// Adds a blockage; `false` where there are as many as there may be, or it is there.
    pub(crate) fn block(&mut self, blockage: Blockage) -> bool {
        let place = self
            .blockages
            .binary_search_by_key(&blockage.id, |known| known.id);
        match place {
            Err(at) if self.blockages.len() < BLOCKAGES_MAX => {
                self.blockages.insert(at, blockage);
                true
            }
            _ => false,
        }
    }

    /// Ends the blockages of which `ends` is true.
    pub(crate) fn unblock(&mut self, ends: impl Fn(&Blockage) -> bool) {
        self.blockages.retain(|blockage| !ends(blockage));
    }

    /// Ends one blockage.
    pub(crate) fn unblock_one(&mut self, id: BlockageId) {
        self.unblock(|blockage| blockage.id == id);
    }

    /// Whether any agent follows a route.
    pub(crate) fn leads_nobody(&self) -> bool {
        self.followed.is_empty()
    }

    /// The route that an agent follows.
    pub(crate) fn followed(&self, agent: AgentId) -> Option<&Arc<Following>> {
        self.followed.get(&agent)
    }

    /// The routes that agents follow.
    pub(crate) fn all_followed(&self) -> impl Iterator<Item = (AgentId, &Following)> {
        self.followed
            .iter()
            .map(|(agent, following)| (*agent, &**following))
    }

    /// Lets an agent follow a route, or none.
    pub(crate) fn set_followed(&mut self, agent: AgentId, following: Option<Following>) {
        match following {
            Some(following) => self.followed.insert(agent, Arc::new(following)),
            None => self.followed.remove(&agent),
        };
    }

    /// The route that an agent follows, to be changed.
    pub(crate) fn followed_mut(&mut self, agent: AgentId) -> Option<&mut Following> {
        self.followed.get_mut(&agent).map(Arc::make_mut)
    }

    /// Writes it, with the pinned trips.
    pub(crate) fn write(&self, pinned: impl Iterator<Item = TripId>, out: &mut StateWriter) {
        let followed = self.all_followed();
        let stored = Stored {
            instructions: self.instructions,
            changed: self.changed,
            blockages: self.blockages.clone(),
            followed: followed.map(|(agent, of)| (agent, of.clone())).collect(),
            pinned: pinned.collect(),
        };
        stored.write(out);
    }

    /// Reads it, with the pinned trips.
    ///
    /// # Errors
    /// The bytes are none of guidance.
    pub(crate) fn read(bytes: &[u8]) -> Result<(Self, Vec<TripId>), CorruptState> {
        let mut input = StateReader::new(bytes);
        let stored = Stored::read(&mut input)?;
        input.end()?;
        let sorted = stored.blockages.is_sorted_by_key(|blockage| blockage.id);
        let sound = stored.followed.iter().all(|(_, of)| of.is_sound());
        if !sorted || !sound || stored.blockages.len() > BLOCKAGES_MAX {
            return Err(CorruptState::Invalid);
        }
        let followed = stored.followed.into_iter();
        let guidance = Self {
            instructions: stored.instructions,
            changed: stored.changed,
            blockages: stored.blockages,
            followed: followed.map(|(agent, of)| (agent, Arc::new(of))).collect(),
        };
        Ok((guidance, stored.pinned))
    }
}
