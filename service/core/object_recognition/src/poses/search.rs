//! Search for poses of one model: pairs of contacts are aligned with pairs of surfels like them.
//!
//! Of the poses that point pairs give (Drost et al. 2010, "Model globally, match locally") the best
//! by a coarse score on few contacts, then on more, are begun, and the best of these refined.

use nalgebra::Isometry3;

use crate::contact::Contact;
use crate::object_id::ObjectId;
use crate::poses::hypothesis::PoseHypothesis;
use crate::surfels::map::{PerceptContext, SurfelMap};
use crate::surfels::point_pairs::{PointPair, PointPairTable};
use crate::surfels::surfel::ContactNoise;
use crate::tuning::{
    BEGUN_MAX, COARSE_WIDEN, NEAR_EXTENT, NEAR_RAD, PAIR_MATCHES_MIN, PAIRS_CONSIDERED, PAIRS_MAX,
    REFINE_CONTACTS, REFINE_WIDEN, REFINED_MAX, SIEVE_CONTACTS, SIFTED_MAX, TRIED_MAX,
};

/// A search in one model.
#[derive(Debug)]
pub(crate) struct PoseSearch<'a> {
    pub(crate) object: ObjectId,
    pub(crate) surfel_map: &'a SurfelMap,
    pub(crate) context: PerceptContext<'a>,
    /// The contacts that are kept.
    pub(crate) contacts: &'a [Contact],
    /// All contacts so far.
    pub(crate) count: usize,
}

/// A pose with its score.
type Scored = (f64, Isometry3<f64>);

impl PoseSearch<'_> {
    /// Adds what it finds to the model's hypotheses, or puts it in place of the same pose.
    pub(crate) fn run(&self, own: &mut Vec<PoseHypothesis>) {
        let second = evenly(self.contacts.len(), SIEVE_CONTACTS[1], 0);
        let begun = self.begun(&self.sifted(&second), &second, own);
        let on = evenly(self.contacts.len(), REFINE_CONTACTS, 0);
        for (_, pose) in begun.into_iter().take(REFINED_MAX) {
            let extent_m = self.surfel_map.extent_m;
            if own.iter().any(|other| other.is_near(&pose, extent_m)) {
                continue;
            }
            let mut pose = pose;
            for widen in &REFINE_WIDEN[2..] {
                pose = self.step(&pose, &on, *widen).1;
            }
            let contacts = self.contacts.iter();
            let fit = self.surfel_map.fit_pose(&pose, contacts, 1.0, self.context);
            // For the contacts that are forgotten a new pose gets the mean of those kept.
            let per_kept = self.count as f64 / self.contacts.len() as f64;
            let found = PoseHypothesis {
                object: self.object,
                pose,
                score: fit.score * per_kept,
                information: fit.information,
            };
            match own.iter_mut().find(|other| other.is_same(&found)) {
                Some(other) if other.score < found.score => *other = found,
                Some(_) => {}
                None => own.push(found),
            }
        }
    }

    /// The best poses by the coarse score, best first.
    fn sifted(&self, second: &[usize]) -> Vec<Scored> {
        let noises: Vec<_> = { self.contacts.iter() }
            .map(|contact| ContactNoise::of(contact, COARSE_WIDEN))
            .collect();
        let score = |pose: &Isometry3<f64>, on: &[usize]| -> f64 {
            on.iter()
                .map(|&at| {
                    let contact = &self.contacts[at];
                    self.surfel_map.coarse_score(pose, contact, &noises[at])
                })
                .sum()
        };
        let first = evenly(self.contacts.len(), SIEVE_CONTACTS[0], self.count);
        let mut tried: Vec<Scored> = Vec::with_capacity(TRIED_MAX);
        for (pair, like) in self.pairs() {
            let room = TRIED_MAX - tried.len();
            let step = like.len().div_ceil((TRIED_MAX / 8).min(room).max(1)).max(1);
            for numbers in like.iter().step_by(step).take(room) {
                let surfels = PointPairTable::pair(&self.surfel_map.surfels, *numbers);
                if let Some(pose) = surfels.onto(&pair) {
                    tried.push((score(&pose, &first), pose));
                }
            }
            if tried.len() >= TRIED_MAX {
                break;
            }
        }
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        tried.truncate(SIFTED_MAX);
        for (own, pose) in &mut tried {
            *own = score(pose, second);
        }
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        tried
    }

    /// Poses after two Gauss-Newton steps on few contacts, best first, none near another.
    fn begun(&self, sifted: &[Scored], on: &[usize], own: &[PoseHypothesis]) -> Vec<Scored> {
        let extent_m = self.surfel_map.extent_m;
        let mut begun: Vec<Scored> = Vec::with_capacity(BEGUN_MAX);
        for (_, pose) in sifted {
            if begun.len() >= BEGUN_MAX {
                break;
            }
            if own.iter().any(|other| other.is_near(pose, extent_m)) {
                continue;
            }
            let is_near = |(_, other): &Scored| {
                other.rotation.angle_to(&pose.rotation) < NEAR_RAD
                    && (other.translation.vector - pose.translation.vector).norm()
                        < NEAR_EXTENT * extent_m
            };
            if begun.iter().any(is_near) {
                continue;
            }
            let (_, pose) = self.step(pose, on, REFINE_WIDEN[0]);
            begun.push(self.step(&pose, on, REFINE_WIDEN[1]));
        }
        begun.sort_by(|a, b| b.0.total_cmp(&a.0));
        begun
    }

    /// Score of a pose, and the pose one Gauss-Newton step on.
    fn step(&self, pose: &Isometry3<f64>, on: &[usize], widen: f64) -> Scored {
        let contacts = on.iter().map(|&at| &self.contacts[at]);
        let fit = self
            .surfel_map
            .fit_pose(pose, contacts, widen, self.context);
        (fit.score, fit.step(pose))
    }

    /// Pairs of contacts and the surfel pairs like them, rarest first.
    fn pairs(&self) -> Vec<(PointPair, &[[u16; 2]])> {
        let oriented: Vec<_> = { self.contacts.iter() }
            .filter_map(|contact| Some((contact.position_m, contact.normal?)))
            .collect();
        let count = oriented.len();
        let mut found = Vec::new();
        // The newest contact with those before it; these are few at first, so others follow.
        let with_newest = (1..count).map(|back| (count - 1, count - 1 - back));
        let others = (1..count).flat_map(|a| (0..a).map(move |b| (a, b)));
        let chosen: Vec<_> = with_newest
            .chain(others.filter(|(a, _)| *a + 1 < count))
            .collect();
        let step = chosen.len().div_ceil(PAIRS_CONSIDERED).max(1);
        for (a, b) in chosen.into_iter().step_by(step) {
            let pair = PointPair {
                points: [oriented[a].0, oriented[b].0],
                normals: [oriented[a].1.into_inner(), oriented[b].1.into_inner()],
            };
            let like = self.surfel_map.pairs.like(&pair);
            if like.len() >= PAIR_MATCHES_MIN {
                found.push((pair, like));
            }
        }
        found.sort_by_key(|(_, like)| like.len());
        found.truncate(PAIRS_MAX);
        found
    }
}

/// Up to `most` of the first `len` numbers, evenly, beginning at `from`.
fn evenly(len: usize, most: usize, from: usize) -> Vec<usize> {
    let count = most.min(len);
    (0..count).map(|k| (from + k * len / count) % len).collect()
}
