//! Which agents have seen a landmark.

use super::tuning::OBSERVERS_MAX;

/// The agents that have seen a landmark under the names that it has.
///
/// Two landmarks that one agent has seen and called by different names are two.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Observers {
    /// Their numbers, ascending.
    pub(super) agents: Vec<u32>,
    /// Whether there were more, or who they were is forgotten: then it may have been anybody.
    pub(super) are_more: bool,
}

impl Observers {
    /// Of a landmark of which it is not known who has seen it.
    pub(super) fn unknown() -> Self {
        Self {
            agents: Vec::new(),
            are_more: true,
        }
    }

    /// An agent has seen it, too.
    pub(crate) fn note(&mut self, agent: u32) {
        let Err(at) = self.agents.binary_search(&agent) else {
            return;
        };
        if self.agents.len() < OBSERVERS_MAX {
            self.agents.insert(at, agent);
        } else {
            self.are_more = true;
        }
    }

    /// It is also what others have seen.
    pub(crate) fn join(&mut self, others: &Self) {
        self.are_more |= others.are_more;
        for &agent in &others.agents {
            self.note(agent);
        }
    }

    /// An agent's number is another agent's from now on: who it was is forgotten.
    pub(super) fn forget(&mut self, agent: u32) {
        if let Ok(at) = self.agents.binary_search(&agent) {
            self.agents.remove(at);
            self.are_more = true;
        }
    }

    /// Whether an agent is known to have seen it.
    pub(super) fn contains(&self, agent: u32) -> bool {
        self.agents.binary_search(&agent).is_ok()
    }

    /// The one agent that has seen it, if there is one only.
    pub(super) fn only(&self) -> Option<u32> {
        match self.agents[..] {
            [agent] if !self.are_more => Some(agent),
            _ => None,
        }
    }

    /// Whether it is known who has seen it, and something holds of all of them.
    pub(crate) fn are_all(&self, holds: impl Fn(u32) -> bool) -> bool {
        let are_known = !self.are_more && !self.agents.is_empty();
        are_known && self.agents.iter().all(|&agent| holds(agent))
    }

    /// Whether nobody can have seen both.
    pub(super) fn is_apart_from(&self, others: &Self) -> bool {
        let are_known = !self.are_more && !others.are_more;
        are_known && self.agents.iter().all(|&agent| !others.contains(agent))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_has_seen_both_as_long_as_that_is_known() {
        let (mut one, mut other) = (Observers::default(), Observers::default());
        for agent in [7, 2, 7] {
            one.note(agent);
        }
        other.note(3);
        assert!(one.is_apart_from(&other) && other.is_apart_from(&one));
        assert!(one.contains(2) && !one.contains(3));
        other.note(2);
        assert!(!one.is_apart_from(&other));
        assert!(!Observers::unknown().is_apart_from(&Observers::default()));
        let mut many = Observers::default();
        (10..30).for_each(|agent| many.note(agent));
        assert!(!many.is_apart_from(&one), "the ninth may have been anybody");
    }
}
