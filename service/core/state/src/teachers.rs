//! Who teaches what all share, and whose word alone does not count.

use crate::state_of_struct;

/// Unusual values of one agent after which they count, if no other agent teaches anything else:
/// some twenty minutes at ten a second.
const UNCONTESTED: u64 = 10_000;

/// Who teaches something, and whose unusual values are doubted.
///
/// What one agent alone measures far off all that others do is its sensor's error, or in another
/// unit. It counts once a second agent confirms it, or nobody has contested it for long. Of an
/// agent that teaches alone everything counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Teachers {
    first: Option<u32>,
    are_several: bool,
    doubted: Option<u32>,
    /// Whether a second agent has had unusual values since anybody had a usual one.
    is_confirmed: bool,
    /// Unusual values of the doubted agent since a usual one of another.
    uncontested: u64,
}

state_of_struct!(Teachers {
    first,
    are_several,
    doubted,
    is_confirmed,
    uncontested
});

impl Teachers {
    /// Hears that an agent has a value, usual or not; whether it counts.
    pub fn hear(&mut self, agent: u32, is_usual: bool) -> bool {
        self.are_several |= *self.first.get_or_insert(agent) != agent;
        let is_doubted = self.doubted == Some(agent);
        if is_usual {
            if !is_doubted {
                self.doubted = None;
                self.uncontested = 0;
            }
            self.is_confirmed = false;
            return true;
        }
        if !self.are_several || self.is_confirmed {
            return true;
        }
        if is_doubted {
            self.uncontested = self.uncontested.saturating_add(1);
            return self.uncontested > UNCONTESTED;
        }
        self.uncontested = 0;
        self.is_confirmed = self.doubted.replace(agent).is_some();
        self.is_confirmed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_agents_word_against_others_does_not_count() {
        let mut teachers = Teachers::default();
        assert!(teachers.hear(7, true) && teachers.hear(7, false), "alone");
        assert!(teachers.hear(8, true));
        for _ in 0..3 * UNCONTESTED {
            assert!(!teachers.hear(7, false));
            assert!(teachers.hear(8, true));
        }
        // A second one confirms it, until anybody says otherwise.
        assert!(!teachers.hear(7, false));
        assert!(teachers.hear(8, false) && teachers.hear(7, false) && teachers.hear(8, false));
        assert!(teachers.hear(9, true) && !teachers.hear(8, false));
    }

    #[test]
    fn what_nobody_contests_counts_in_the_end() {
        let mut teachers = Teachers::default();
        assert!(teachers.hear(1, true) && !teachers.hear(2, false));
        let counted = (0..2 * UNCONTESTED).filter(|_| teachers.hear(2, false));
        assert_eq!(counted.count() as u64, UNCONTESTED);
    }
}
