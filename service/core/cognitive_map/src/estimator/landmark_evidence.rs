//! What speaks for a landmark's position, and what against it.
//!
//! A landmark that was moved, or was placed by a sighting of something else, must be forgotten. But
//! where a label is read wrongly now and then, sightings of other things under a landmark's name
//! are refused one after the other, too, as long as nobody looks at the landmark itself. What
//! differs is where the refused sightings see it: those of a moved landmark agree, those of other
//! things do not. So they vote, as in the majority vote of Boyer & Moore (1991): a sighting that
//! sees the landmark where the votes have it adds one, another one takes one away, and one that
//! fits the landmark's own position takes all.
//!
//! A landmark is *unconfirmed* until a sighting has fitted since it was placed. What placed it may
//! have been a sighting of something else as likely as another one is: two votes outweigh it, if
//! the other sightings of the agent that casts the last one fit, and a sighting that is refused
//! does not make its observer search around, until that one is doubted for long.

use nalgebra::{Matrix3, Point3};

use super::tuning::VOTE_GATE;

/// Where refused sightings see a landmark.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rival {
    /// Position in the frame, by the most certain of the sightings that agree.
    pub(super) position: Point3<f64>,
    pub(super) covariance: Matrix3<f64>,
    /// Sightings that agree, less those that do not.
    pub(super) votes: u32,
}

impl Rival {
    /// Whether another sighting sees it at about the same position.
    fn agrees(&self, other: &Self) -> bool {
        let apart = other.position - self.position;
        let inverse = (self.covariance + other.covariance).try_inverse();
        inverse.is_some_and(|inverse| apart.dot(&(inverse * apart)) <= VOTE_GATE * VOTE_GATE)
    }

    /// Whichever of the two knows the position better, so that a vague one brings none together
    /// that do not agree.
    fn or_sharper(self, other: Self) -> Self {
        if other.covariance.trace() < self.covariance.trace() {
            other
        } else {
            self
        }
    }
}

/// What speaks for a landmark's position, and what against it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct LandmarkEvidence {
    /// Whether a sighting has fitted since it was placed.
    pub(super) is_confirmed: bool,
    /// Distances refused one after the other.
    pub(super) refused_ranges: u32,
    /// Another position, for which sightings vote that were refused since one fitted.
    pub(super) rival: Option<Rival>,
}

impl LandmarkEvidence {
    /// A sighting fitted.
    pub(super) fn accept(&mut self) {
        *self = Self {
            is_confirmed: true,
            ..Self::default()
        };
    }

    /// A sighting was refused that sees the landmark somewhere else. Answers whether that is where
    /// the votes have it.
    pub(super) fn refuse(&mut self, seen: Rival) -> bool {
        let agrees = self.rival.is_some_and(|rival| rival.agrees(&seen));
        self.rival = Some(match self.rival {
            Some(rival) if agrees => Rival {
                votes: rival.votes.saturating_add(1),
                ..rival.or_sharper(seen)
            },
            Some(rival) if rival.votes > 0 => Rival {
                votes: rival.votes - 1,
                ..rival
            },
            _ => Rival { votes: 1, ..seen },
        });
        agrees
    }

    /// Sightings that see it at one other position, less those that do not.
    pub(super) fn votes(&self) -> u32 {
        self.rival.as_ref().map_or(0, |rival| rival.votes)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;
    use proptest::prelude::*;

    use super::*;

    fn rival(x: f64) -> Rival {
        Rival {
            position: Point3::new(x, 0.0, 0.0),
            covariance: Matrix3::identity() * 0.01,
            votes: 0,
        }
    }

    proptest! {
        /// Whoever comes first: of what most see, the votes are at least as many as it has more
        /// than all others together.
        #[test]
        fn the_majority_has_the_votes(order in prop::collection::vec(0..4_usize, 1..60)) {
            let mut evidence = LandmarkEvidence::default();
            let same = order.iter().filter(|&&place| place == 0).count();
            let others = order.len() - same;
            for place in order {
                evidence.refuse(rival(10.0 * place as f64));
            }
            let held = evidence.rival.unwrap();
            if same > others {
                prop_assert!(held.agrees(&rival(0.0)));
                prop_assert!(held.votes as usize >= same - others);
            }
            evidence.accept();
            prop_assert!(evidence.rival.is_none() && evidence.votes() == 0);
        }
    }

    #[test]
    fn a_vague_sighting_does_not_bring_together_what_does_not_agree() {
        let vague = Rival {
            covariance: Matrix3::identity() * 4.0,
            ..rival(1.0)
        };
        let mut evidence = LandmarkEvidence::default();
        assert!(!evidence.refuse(rival(0.0)) && evidence.refuse(vague));
        assert!(!evidence.refuse(rival(2.0)));
        assert_eq!(evidence.votes(), 1);
    }

    #[test]
    fn agreement_is_measured_in_deviations() {
        let near = Vector3::new(0.5, 0.0, 0.0);
        let shifted = Rival {
            position: rival(0.0).position + near,
            ..rival(0.0)
        };
        assert!(rival(0.0).agrees(&shifted) && shifted.agrees(&rival(0.0)));
        assert!(!rival(0.0).agrees(&rival(0.7)) && !rival(0.0).agrees(&rival(-0.7)));
        let nowhere = Rival {
            position: Point3::new(f64::NAN, 0.0, 0.0),
            ..rival(0.0)
        };
        assert!(!nowhere.agrees(&nowhere));
    }
}
