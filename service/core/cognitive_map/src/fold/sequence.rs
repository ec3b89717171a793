//! Sequences of places or percepts, and what comes next.

use super::CognitiveMap;
use crate::memory::percept::PerceptCue;
use crate::memory::place::PlaceId;
use crate::memory::recall::RecallCue;
use crate::memory::sequence::{self, Evidence, SequenceCue, SequenceElement, SequenceRecall};

/// Most places that a percept may be of.
const CANDIDATES_MAX: usize = 256;
/// A descriptor speaks e times less for a place whose cosine is so much lower than the best one's:
/// another place answers nearly as well when it is at most this much lower (see `Rivals`).
const COSINE_SCALE: f64 = 0.05;
/// What is e^-12 times less likely than the best is no candidate.
const FAINT: f64 = 6e-6;

impl CognitiveMap {
    /// Which trips a sequence of places or percepts looks like, and what comes next on them. A
    /// function of the map; its cost is that of the recall of its percepts, and about the number of
    /// times that trips lead through its places. `None` when `gives_up` says so.
    ///
    /// Each trip counts once, and less as its strength fades below one. Where it ended for good,
    /// nothing comes next; where it is under way, or went on as another trip, nothing is known.
    pub fn recall_sequence(
        &self,
        cue: &SequenceCue,
        gives_up: &mut dyn FnMut() -> bool,
    ) -> Option<SequenceRecall> {
        let n_places = self.places.len().max(2);
        let mut elements = Vec::with_capacity(cue.elements.len());
        for element in &cue.elements {
            if gives_up() {
                return None;
            }
            let candidates = match element {
                SequenceElement::Place(place) => vec![(*place, 1.0)],
                SequenceElement::Percept(percept) => self.candidates(percept),
            };
            elements.push(Evidence::new(candidates, cue.error_rate, n_places));
        }
        sequence::align(cue, &elements, &self.trips, self.clock(), gives_up)
    }

    /// The places where a percept may have been sensed, with their likelihoods up to a factor.
    fn candidates(&self, percept: &PerceptCue) -> Vec<(PlaceId, f64)> {
        let cue = RecallCue {
            position: None,
            code: None,
            percept: Some(percept.clone()),
            radius_m: None,
            founder: None,
            since_ns: None,
            until_ns: None,
            limit: CANDIDATES_MAX,
        };
        let recalled = self.recall(&cue).into_iter();
        let matches: Vec<_> = recalled
            .filter_map(|recalled| Some((recalled.place, recalled.percept_match?)))
            .collect();
        let best = matches.first().map_or(0.0, |(_, best)| *best);
        let likelihood = |fit: f64| match percept {
            PerceptCue::Level { .. } => fit,
            PerceptCue::Descriptor(_) => ((fit - best) / COSINE_SCALE).exp(),
        };
        let least = likelihood(best) * FAINT;
        let candidates = { matches.into_iter() }.map(|(place, fit)| (place, likelihood(fit)));
        candidates
            .filter(|(_, likelihood)| *likelihood > least)
            .collect()
    }
}
