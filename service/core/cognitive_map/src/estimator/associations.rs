//! Names that turned out to be those of one landmark.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::tuning::{ASSOCIATIONS_MAX, REFUSED_TO_DISSOCIATE};
use super::verdict::Verdict;
use crate::input::Label;

/// The landmark that a name is associated with.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Association {
    /// The landmark's name.
    pub(super) name: Label,
    /// Sightings under the other name refused one after the other.
    pub(super) refused: u32,
}

/// The names that are associated with others. A clone shares them.
#[derive(Clone, Debug, Default)]
pub(super) struct Associations {
    pub(super) names: Arc<BTreeMap<Label, Association>>,
}

impl Associations {
    /// The landmark's name, of a name that may be associated with another.
    pub(super) fn name_of<'a>(&'a self, label: &'a Label) -> &'a Label {
        self.names
            .get(label)
            .map_or(label, |association| &association.name)
    }

    /// The names that others are associated with, in order.
    pub(super) fn names_of_others(&self) -> Vec<&Label> {
        let mut names: Vec<&Label> = self
            .names
            .values()
            .map(|association| &association.name)
            .collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// Whether there is room for more.
    pub(super) fn has_room(&self, n: usize) -> bool {
        self.names.len() + n <= ASSOCIATIONS_MAX
    }

    /// Associates a name with another one, and with that the names associated with it.
    pub(super) fn insert(&mut self, label: &Label, name: &Label) {
        let names = Arc::make_mut(&mut self.names);
        for association in names
            .values_mut()
            .filter(|association| association.name == *label)
        {
            association.name = name.clone();
        }
        let association = Association {
            name: name.clone(),
            refused: 0,
        };
        names.insert(label.clone(), association);
        names.remove(name);
    }

    /// A landmark was seen under a name. One that contradicts the landmark it is associated with is
    /// its own again.
    ///
    /// `observer_refused` counts the observer's sightings refused one after the other: of an agent
    /// that contradicts everything, the name is not to blame.
    pub(super) fn weigh(&mut self, label: &Label, verdict: Verdict, observer_refused: u32) {
        let Some(association) = self.names.get(label) else {
            return;
        };
        let refused = match verdict {
            Verdict::Refused => association.refused + 1,
            _ => 0,
        };
        if refused == association.refused {
            return; // as most often: nothing is copied
        }
        let names = Arc::make_mut(&mut self.names);
        if refused >= REFUSED_TO_DISSOCIATE && observer_refused < REFUSED_TO_DISSOCIATE / 2 {
            names.remove(label);
        } else if let Some(association) = names.get_mut(label) {
            association.refused = refused;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn label(text: &str) -> Label {
        Label::new(text).unwrap()
    }

    #[test]
    fn a_name_of_a_name_is_that_of_the_landmark() {
        let mut associations = Associations::default();
        associations.insert(&label("c"), &label("b"));
        associations.insert(&label("b"), &label("a"));
        for name in ["a", "b", "c"] {
            assert_eq!(associations.name_of(&label(name)), &label("a"));
        }
        assert_eq!(associations.name_of(&label("d")), &label("d"));
    }

    #[test]
    fn a_name_parts_from_what_it_contradicts_unless_the_observer_is_to_blame() {
        let mut associations = Associations::default();
        let (name, association) = (label("a"), label("b"));
        associations.insert(&association, &name);
        for _ in 0..20 {
            associations.weigh(&association, Verdict::Refused, 7);
        }
        assert_eq!(associations.name_of(&association), &name);
        let accepted = Verdict::Accepted {
            nis: 1.0,
            components: 2,
        };
        associations.weigh(&association, accepted, 0);
        for _ in 0..5 {
            associations.weigh(&association, Verdict::Refused, 1);
        }
        assert_eq!(associations.name_of(&association), &name);
        associations.weigh(&association, Verdict::Refused, 1);
        assert_eq!(associations.name_of(&association), &association);
    }
}
