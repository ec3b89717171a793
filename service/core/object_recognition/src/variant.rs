//! Variants of an object: its places alone, and the body through them.

use std::collections::BTreeMap;

use crate::numeric::log_sum;
use crate::object_id::ObjectId;
use crate::tuning::{BODY_PRIOR_MIN, TOUCHED_AGAIN_MIN};

/// What lies between the places of an object, where more than one may be true.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Variant {
    /// What the places tell of one another; nothing, if they tell too little. Every object has it.
    Places,
    /// The surface of a body through all of them, which was touched at random.
    Body,
}

/// A variant of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct VariantId {
    pub(crate) object: ObjectId,
    pub(crate) variant: Variant,
}

impl VariantId {
    /// Those that an object may have.
    pub(crate) fn both(object: ObjectId) -> [Self; 2] {
        [Variant::Places, Variant::Body].map(|variant| Self { object, variant })
    }
}

/// Logs of the prior probabilities that objects are touched at random points of their bodies; none
/// of those that hardly are. Given is by how much likelier the places of each are if they were
/// chosen, as a log ratio \[nats\].
///
/// All objects of a library were touched at chosen points, or all at random ones, or each in its
/// own way, the three of which are as probable: who teaches several objects mostly does so in one
/// way.
pub(crate) fn body_priors(
    chosen_logs: impl Iterator<Item = (ObjectId, f64)> + Clone,
) -> BTreeMap<ObjectId, f64> {
    let either = |log: f64| log_sum([log, 0.0].into_iter());
    let logs = chosen_logs.clone().map(|(_, log)| log);
    let each_log: f64 = logs
        .clone()
        .map(|log| either(log) - std::f64::consts::LN_2)
        .sum();
    let chosen_log = logs.sum();
    let all_log = log_sum([chosen_log, each_log, 0.0].into_iter());
    let prior = |(object, log)| {
        let own = log_sum([0.0, each_log - either(log)].into_iter()) - all_log;
        (object, own.min((1.0 - TOUCHED_AGAIN_MIN).ln()))
    };
    let priors = chosen_logs.map(prior);
    priors.filter(|own| own.1 > BODY_PRIOR_MIN.ln()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The probabilities that objects with these log ratios were touched at random.
    fn probabilities(chosen_logs: &[f64]) -> Vec<f64> {
        let numbered = (0..).map(ObjectId).zip(chosen_logs.iter().copied());
        let priors = body_priors(numbered.clone());
        let of = |(object, _)| priors.get(&object).map_or(0.0, |log| log.exp());
        numbered.map(of).collect()
    }

    #[test]
    fn an_object_alone_has_the_odds_of_its_own_places() {
        assert!(probabilities(&[]).is_empty());
        for log in [-4.0, -1.0_f64, 0.0, 2.0] {
            let [own] = probabilities(&[log])[..] else {
                panic!("one object")
            };
            assert!(
                (own - 1.0 / (1.0 + log.exp())).abs() < 1e-12,
                "{log}: {own}"
            );
        }
        // What was chosen for certain has no body.
        assert_eq!(probabilities(&[40.0]), [0.0]);
        assert_eq!(probabilities(&[40_000.0, 30.0]), [0.0; 2]);
    }

    #[test]
    fn objects_tell_of_one_another_how_they_were_touched() {
        let alone = probabilities(&[0.5])[0];
        let random = probabilities(&[0.5, -1.5, -1.5, -1.5, -1.5]);
        assert!(random[0] > alone + 0.3, "{random:?}");
        let chosen = probabilities(&[0.5, 10.0, 10.0, 10.0, 10.0, 10.0, 10.0]);
        assert!(chosen[0] < 0.1 * alone, "{chosen:?}");
        // Where some were chosen for certain and some hardly, each has its own odds.
        let mixed = probabilities(&[0.5, 30.0, 30.0, -30.0, -30.0]);
        assert!((mixed[0] - alone).abs() < 1e-6, "{mixed:?}");
    }
}
