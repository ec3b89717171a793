//! When a percept is so far from what was expected that it is said aloud.
//!
//! An event for every percept would be as many messages as there are percepts, and most of them
//! would say that all is as it was. The histograms hold all of them; events hold those beyond a
//! bound.

use cognitive_map::ChannelKind;

/// Percepts from which a place must have learned: a deviation from fewer says little.
const PERCEPTS_MIN: u64 = 3;
/// Deviations beyond which a level is surprising: one of 16,000 of a normal distribution is.
const LEVEL_DEVIATIONS: f64 = 4.0;
/// One minus the cosine beyond which a descriptor is surprising: 60° from what was seen there.
const DESCRIPTOR_DISTANCE: f64 = 0.5;

/// Whether a percept is surprising, where a place has learned from `percepts` others.
pub(super) fn is_surprising(kind: ChannelKind, percepts: u64, surprise: f64) -> bool {
    let bound = match kind {
        ChannelKind::Level => LEVEL_DEVIATIONS,
        ChannelKind::Descriptor { .. } => DESCRIPTOR_DISTANCE,
    };
    percepts >= PERCEPTS_MIN && surprise > bound
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn little_learned_is_no_surprise() {
        let eye = ChannelKind::Descriptor { dimension: 8 };
        for (kind, bound) in [(ChannelKind::Level, 4.0), (eye, 0.5)] {
            assert!(is_surprising(kind, 3, bound + 1e-9));
            assert!(!is_surprising(kind, 3, bound));
            assert!(!is_surprising(kind, 2, 1e9));
        }
    }
}
