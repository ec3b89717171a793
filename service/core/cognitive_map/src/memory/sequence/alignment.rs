//! Where on the trips a sequence is: the forward algorithm of a hidden Markov model.
//!
//! ```text
//! state      a position of a trip, or "nobody travelled this"
//! start      π₀ nobody; else a position, in proportion to its trip's weight
//! step       to the next place of the trip with 1 − 2δ − ρ; none or two on with δ each; with ρ
//!            somewhere else as at the start
//! emission   evidence of the element for the place there; 1 for nobody
//! ```
//!
//! Only positions near an occurrence of the sequence's places are looked at. All others fit equally
//! badly and are one state more.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use super::evidence::Evidence;
use super::window::{After, Window};
use super::{NextPlace, SequenceCue, SequenceMatch, SequenceRecall};
use crate::memory::ids::{PlaceId, TripId};
use crate::memory::strength::Clock;
use crate::memory::trip::TripMap;

/// Probability that a place of the trip is not in the sequence, and that a place of the sequence is
/// not on the trip. A robot that passes at the rim of a field enters the place at times.
const SLIP: f64 = 0.002;
/// Probability that the sequence goes on elsewhere, as where its beginning is older than the trip.
const JUMP: f64 = 0.005;

/// By how many places the position goes on, with which probability.
const STEPS: [(usize, f64); 3] = [(0, SLIP), (1, 1.0 - 2.0 * SLIP - JUMP), (2, SLIP)];

/// Probabilities up to a common factor.
struct Forward<'a> {
    windows: &'a [Window],
    /// Of each position of each window, one after the other.
    positions: Vec<f64>,
    /// Of all positions elsewhere.
    elsewhere: f64,
    /// That nobody travelled this.
    nobody: f64,
    /// Probability of each position of a window at the start, and of all elsewhere.
    starts: Vec<f64>,
    start_elsewhere: f64,
    none_prior: f64,
}

/// What a sequence recalls of all trips; `None` when told to give up, which is asked about once for
/// each place that an element may be, and for each element.
pub(crate) fn align(
    cue: &SequenceCue,
    elements: &[Evidence],
    trips: &TripMap,
    now: Clock,
    gives_up: &mut dyn FnMut() -> bool,
) -> Option<SequenceRecall> {
    let windows = Window::of_all(elements, trips, now, gives_up)?;
    let n_positions = trips.legs() + trips.len();
    let mut forward = Forward::new(&windows, n_positions, cue.none_prior);
    for (rank, element) in elements.iter().enumerate() {
        if gives_up() {
            return None;
        }
        if rank > 0 {
            forward.step();
        }
        forward.weigh(element);
    }
    Some(forward.recalled(cue.limit))
}

impl<'a> Forward<'a> {
    /// Before the first element.
    fn new(windows: &'a [Window], n_positions: usize, none_prior: f64) -> Self {
        let share = (1.0 - none_prior) / n_positions.max(1) as f64;
        let starts = windows.iter().flat_map(|window| {
            let each = share * window.weight;
            std::iter::repeat_n(each, window.places.len())
        });
        let starts: Vec<_> = starts.collect();
        let start_elsewhere = (1.0 - none_prior - starts.iter().sum::<f64>()).max(0.0);
        Self {
            windows,
            positions: starts.clone(),
            elsewhere: start_elsewhere,
            nobody: none_prior,
            starts,
            start_elsewhere,
            none_prior,
        }
    }

    /// Goes on by one element.
    fn step(&mut self) {
        let mut moved = vec![0.0; self.positions.len()];
        let mut jumps = JUMP * (self.nobody + self.elsewhere);
        let mut elsewhere = (1.0 - JUMP) * self.elsewhere;
        let mut first = 0;
        for window in self.windows {
            let end = first + window.places.len();
            let goes_on = matches!(window.after, After::Place(_));
            for at in first..end {
                let here = self.positions[at];
                jumps += JUMP * here;
                for (places, probability) in STEPS {
                    match moved[..end].get_mut(at + places) {
                        Some(to) => *to += probability * here,
                        // It leaves the window, or the trip.
                        None if goes_on => elsewhere += probability * here,
                        None => jumps += probability * here,
                    }
                }
            }
            // Others come from before the window.
            let before =
                self.elsewhere * self.starts[first] / self.start_elsewhere.max(self.starts[first]);
            for (places, probability) in STEPS {
                for to in 0..places.min(window.first as usize).min(end - first) {
                    moved[first + to] += probability * before;
                    elsewhere -= probability * before;
                }
            }
            first = end;
        }
        for (at, start) in moved.iter_mut().zip(&self.starts) {
            *at += jumps * start;
        }
        self.positions = moved;
        self.elsewhere = elsewhere.max(0.0) + jumps * self.start_elsewhere;
        self.nobody = (1.0 - JUMP) * self.nobody + jumps * self.none_prior;
    }

    /// Takes the evidence of an element into account.
    fn weigh(&mut self, element: &Evidence) {
        let places = self.windows.iter().flat_map(|window| &window.places);
        for (at, place) in self.positions.iter_mut().zip(places) {
            *at *= element.of(*place);
        }
        self.elsewhere *= element.floor();
        // Long sequences would leave the range of numbers.
        let sum = self.positions.iter().sum::<f64>() + self.elsewhere + self.nobody;
        if sum > 0.0 && sum.is_finite() {
            self.positions.iter_mut().for_each(|at| *at /= sum);
            self.elsewhere /= sum;
            self.nobody /= sum;
        }
    }

    /// What comes next, and on which trips.
    fn recalled(&self, limit: usize) -> SequenceRecall {
        let mut next: BTreeMap<PlaceId, f64> = BTreeMap::new();
        let mut trips: BTreeMap<TripId, (f64, f64, u32)> = BTreeMap::new();
        let mut none = self.nobody + self.elsewhere;
        let mut probabilities = self.positions.iter();
        for window in self.windows {
            for (index, probability) in (0..window.places.len()).zip(probabilities.by_ref()) {
                if !window.is_near(index) {
                    none += probability;
                    continue;
                }
                match window.after(index) {
                    After::Place(place) => *next.entry(place).or_default() += probability,
                    After::End => none += probability,
                    // What is not known is neither this nor that.
                    After::Unknown => continue,
                }
                let leg = window
                    .first
                    .saturating_add(u32::try_from(index).unwrap_or(u32::MAX));
                let of_trip = trips.entry(window.trip).or_insert((0.0, -1.0, 0));
                of_trip.0 += probability;
                if *probability > of_trip.1 {
                    (of_trip.1, of_trip.2) = (*probability, leg);
                }
            }
        }
        let sum = next.values().sum::<f64>() + none;
        // Nothing that is known fits at all.
        let (share, none) = if sum > 0.0 {
            (1.0 / sum, none / sum)
        } else {
            (0.0, 1.0)
        };
        let mut next: Vec<_> = { next.into_iter() }
            .map(|(place, mass)| NextPlace {
                place,
                probability: mass * share,
            })
            .collect();
        next.sort_by(|a, b| likelier(a.probability, b.probability));
        // The sum of none would be the negative zero.
        let further = next.iter().skip(limit);
        let others = further.fold(0.0, |sum, other| sum + other.probability);
        next.truncate(limit);
        let mut trips: Vec<_> = { trips.into_iter() }
            .map(|(trip, (mass, _, leg))| SequenceMatch {
                trip,
                probability: mass * share,
                leg,
            })
            .collect();
        trips.sort_by(|a, b| likelier(a.probability, b.probability));
        trips.truncate(limit);
        SequenceRecall {
            next,
            others,
            none,
            trips,
        }
    }
}

/// The larger probability first.
fn likelier(a: f64, b: f64) -> Ordering {
    b.total_cmp(&a)
}
