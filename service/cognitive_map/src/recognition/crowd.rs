//! Hypotheses that nobody has looked at yet: every place, taken for the one that was touched first.

use std::sync::Arc;

use nalgebra::UnitQuaternion;

use super::contact::Contact;
use super::feeling::{Facing, Feeling, exp};
use super::library::{Known, ObjectId, ObjectLibrary};
use super::nearest::NONE;
use super::ranks::Ranks;
use super::shifts::{Shift, Taken};
use super::spots::narrow;

/// Most roots; of larger libraries every second place stands for two, or every third for three.
const ROOTS_MAX: usize = 1 << 22;
/// Weights are brought back to one when the heaviest is so far from it.
const HEAVY: f32 = 1_048_576.0;
/// Most that a touch makes of a weight, so that numbers stay finite.
const GAIN_MAX: f32 = 1e30;
/// A place is worth a look only where it is at least so likely against an outlier: what is less likely leaves the hypothesis
/// where it is.
const LOOK_LEAST: f32 = 0.5;

/// The places of a map in one rotation, each taken for the one that was touched first.
#[derive(Clone, Debug)]
struct Group {
    object: ObjectId,
    rotation: u16,
    /// The map as it was then.
    known: Arc<Known>,
    /// Mass of each, times e^−`log` of the crowd; nothing for those that have been looked at or hold nothing.
    weights: Vec<f32>,
    sum: f64,
    most: f32,
}

/// All of them, as far as they hold something and have not been looked at.
///
/// What a touch says of them is estimated: the place that is nearest to where it would be is the one touched, or none. Where none is near,
/// that is exact.
#[derive(Clone, Debug, Default)]
pub(super) struct Crowd {
    groups: Vec<Group>,
    /// Places that one root stands for.
    stride: usize,
    first: Option<Contact>,
    log: f64,
}

/// One that is worth a look.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    group: u32,
    root: u32,
    weight: f32,
}

/// Lists that are filled again and again.
#[derive(Default)]
struct Lists {
    gathered: [Vec<f32>; 3],
    cells: Vec<u32>,
    likelihoods: Vec<f32>,
    near: Vec<(u32, u32)>,
    squares: Vec<f32>,
}

impl Crowd {
    /// After the first touch.
    pub(super) fn new(
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        contact: &Contact,
    ) -> Self {
        let places: usize = { library.all() }
            .map(|(_, known)| known.surface.patches.len())
            .sum();
        let stride = (places * rotations.len()).div_ceil(ROOTS_MAX).max(1);
        let mut crowd = Self {
            groups: Vec::new(),
            stride,
            first: Some(contact.clone()),
            log: 0.0,
        };
        let feeling = Feeling::new(contact, library.wide());
        let mut likelihoods = Vec::new();
        for (object, known) in library.all() {
            let surface = &known.surface;
            feeling.likelihoods(&surface.spots, &surface.patches, &mut likelihoods);
            let each = stride as f64 / (surface.patches.len() * rotations.len()).max(1) as f64;
            let each = narrow(each);
            for (rotation, turn) in (0u16..).zip(rotations) {
                let facing = feeling.facing(turn);
                let normal = |normal: &[f32; 3]| {
                    facing.map_or(1.0, |facing: Facing| facing.likelihood(normal))
                };
                let all = likelihoods.iter().zip(&surface.spots.normals);
                let weights = all.map(|(felt, own)| each * felt * normal(own));
                let mut group = Group {
                    object,
                    rotation,
                    known: Arc::clone(known),
                    weights: weights.step_by(stride).collect(),
                    sum: 0.0,
                    most: 0.0,
                };
                group.weigh(0.0);
                crowd.groups.push(group);
            }
        }
        crowd.settle();
        crowd
    }

    /// Whether none is left.
    pub(super) fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// Log of the mass of the heaviest.
    pub(super) fn best_log(&self) -> f64 {
        let most = self.groups.iter().map(|group| group.most);
        f64::from(most.fold(0.0, f32::max)).ln() + self.log
    }

    /// Log of the mass of each group, with its object.
    pub(super) fn masses(&self) -> impl Iterator<Item = (ObjectId, f64)> {
        self.groups
            .iter()
            .map(|group| (group.object, group.sum.ln() + self.log))
    }

    /// Counts all masses, each times e^`log` of its object.
    pub(super) fn count(&self, ranks: &mut Ranks, log: impl Fn(ObjectId) -> Option<f64>) {
        for group in &self.groups {
            let Some(log) = log(group.object) else {
                continue;
            };
            let scale = narrow((self.log + log).exp());
            for weight in &group.weights {
                ranks.add(scale * weight);
            }
        }
    }

    /// Takes a touch in, and says which of them it makes worth a look: those that are explained by a place.
    pub(super) fn sift(
        &mut self,
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        touch: &Taken<'_>,
    ) -> Vec<Candidate> {
        let mut candidates = Vec::new();
        let Some(first) = &self.first else {
            return candidates;
        };
        let contact = touch.feeling.contact;
        let mut lists = Lists::default();
        let mut filled = None;
        for (number, group) in (0u32..).zip(&mut self.groups) {
            if library.surface(group.object).is_none() {
                group.weights.clear();
                continue;
            }
            let surface = &group.known.surface;
            let spots = &surface.spots;
            if filled != Some(group.object) {
                touch
                    .feeling
                    .likelihoods(spots, &surface.patches, &mut lists.likelihoods);
                filled = Some(group.object);
            }
            let rotation = &rotations[usize::from(group.rotation)];
            // Drift was nothing, and is what the contact says, or was something and has grown.
            let drift = (contact.drift_sd_m.powi(2) - first.drift_sd_m.powi(2)).max(0.0);
            let noise = contact.position_sd_m.powi(2) + spots.variance_m2;
            let variance = first.variance_m2() + spots.variance_m2 + drift + noise;
            let nearest = spots.nearest(variance);
            let step = rotation * (contact.position_m - first.position_m);
            let step = [narrow(step.x), narrow(step.y), narrow(step.z)];
            let axes = if self.stride == 1 {
                [&spots.x[..], &spots.y[..], &spots.z[..]]
            } else {
                for (list, all) in lists
                    .gathered
                    .iter_mut()
                    .zip([&spots.x, &spots.y, &spots.z])
                {
                    list.clear();
                    list.extend(all.iter().step_by(self.stride));
                }
                let [x, y, z] = &lists.gathered;
                [&x[..], &y[..], &z[..]]
            };
            nearest.cells(axes, step, &mut lists.cells);
            // Whether a place is near is as good as random: no branch.
            lists.near.clear();
            lists.near.resize(group.weights.len(), (0, 0));
            let mut near = 0;
            for ((root, weight), cell) in (0u32..).zip(&group.weights).zip(&lists.cells) {
                let place = nearest.place(*cell);
                lists.near[near] = (root, place);
                near += usize::from((place != NONE) & (*weight > 0.0));
            }
            lists.near.truncate(near);
            let (x, y, z) = (&spots.x, &spots.y, &spots.z);
            lists.squares.clear();
            lists.squares.extend(lists.near.iter().map(|(root, place)| {
                let (root, place) = (*root as usize, *place as usize);
                let apart = [
                    axes[0][root] + step[0] - x[place],
                    axes[1][root] + step[1] - y[place],
                    axes[2][root] + step[2] - z[place],
                ];
                apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2]
            }));
            let per = narrow(-0.5 / variance);
            for square in &mut lists.squares {
                *square = exp(per * *square);
            }
            let share = touch.share(surface.patches.len());
            let peak = narrow(share / (touch.outlier * gauss_volume(variance)));
            let facing = touch.feeling.facing(rotation);
            for ((root, place), fall) in lists.near.iter().zip(&lists.squares) {
                let place = *place as usize;
                let normal = facing.map_or(1.0, |own| own.likelihood(&spots.normals[place]));
                let gain = peak * fall * lists.likelihoods[place] * normal;
                let weight = &mut group.weights[*root as usize];
                *weight *= 1.0 + gain.min(GAIN_MAX);
                if gain > LOOK_LEAST {
                    candidates.push(Candidate {
                        group: number,
                        root: *root,
                        weight: *weight,
                    });
                }
            }
            group.weigh(0.0);
        }
        // All were taken for hypotheses whose touch was an outlier.
        self.log += touch.outlier.ln();
        candidates
    }

    /// The candidates that hold most: so many at most, and not more than leave next to nothing of this mass to the others.
    pub(super) fn heaviest(
        &self,
        candidates: Vec<Candidate>,
        most: usize,
        rest_log: f64,
    ) -> Vec<Candidate> {
        let top = self
            .groups
            .iter()
            .map(|group| group.most)
            .fold(0.0, f32::max);
        if top <= 0.0 || most == 0 {
            return Vec::new();
        }
        let mut ranks = Ranks::new();
        for candidate in &candidates {
            ranks.add(candidate.weight / top);
        }
        let rest = (rest_log - self.log).exp() / f64::from(top);
        let count = ranks.holding((ranks.sum() - rest).max(0.0)).min(most);
        let (least, mut some) = ranks.least(count);
        let mut heaviest = candidates;
        heaviest.retain(|candidate| {
            let rank = Ranks::of(candidate.weight / top);
            let is_one = rank == least && some > 0;
            some -= usize::from(is_one);
            rank > least || is_one
        });
        heaviest
    }

    /// Takes one out, as it was after the first touch, with the map that it is in.
    pub(super) fn take(
        &mut self,
        candidate: &Candidate,
        rotations: &[UnitQuaternion<f64>],
        first: &Feeling<'_>,
    ) -> (Shift, &Known) {
        let stride = self.stride;
        let group = &mut self.groups[candidate.group as usize];
        group.weights[candidate.root as usize] = 0.0;
        let shift = group.shift(candidate.root as usize, stride, rotations, first);
        (shift, &group.known)
    }

    /// The heaviest of each object, as they would be taken.
    pub(super) fn best_of(&self, object: ObjectId, most: usize) -> Vec<(Candidate, f64)> {
        let groups = (0u32..)
            .zip(&self.groups)
            .filter(|(_, group)| group.object == object);
        let mut all: Vec<(Candidate, f64)> = Vec::new();
        for (number, group) in groups {
            for (root, weight) in (0u32..).zip(&group.weights) {
                if *weight <= 0.0 || all.len() >= most && f64::from(*weight) <= all[all.len() - 1].1
                {
                    continue;
                }
                let candidate = Candidate {
                    group: number,
                    root,
                    weight: *weight,
                };
                let at = all.partition_point(|other| other.1 >= f64::from(*weight));
                all.insert(at, (candidate, f64::from(*weight)));
                all.truncate(most);
            }
        }
        for (_, mass) in &mut all {
            *mass = mass.ln() + self.log;
        }
        all
    }

    /// What one would be as a hypothesis of its own, with its mass so far.
    pub(super) fn as_shift(
        &self,
        candidate: &Candidate,
        rotations: &[UnitQuaternion<f64>],
    ) -> Option<Shift> {
        let first = Feeling::new(self.first.as_ref()?, &[]);
        let group = self.groups.get(candidate.group as usize)?;
        let shift = group.shift(candidate.root as usize, self.stride, rotations, &first);
        Some(Shift {
            evidence: f64::from(candidate.weight).ln() + self.log,
            ..shift
        })
    }

    /// Objects none of whose places holds so much.
    pub(super) fn fading(&self, least_log: f64) -> Vec<ObjectId> {
        let least = narrow((least_log - self.log).exp());
        let own = self.groups.chunk_by(|a, b| a.object == b.object);
        let fading = own.filter(|own| own.iter().all(|group| group.most < least));
        fading.map(|own| own[0].object).collect()
    }

    /// Drops those whose mass is below e^`least_log`.
    pub(super) fn drop_below(&mut self, least_log: f64) {
        let least = narrow((least_log - self.log).exp());
        for group in &mut self.groups {
            group.weigh(least);
        }
        self.settle();
    }

    /// Brings weights back to about one, and forgets groups of which nothing is left.
    fn settle(&mut self) {
        self.groups.retain(|group| group.most > 0.0);
        let most = self
            .groups
            .iter()
            .map(|group| group.most)
            .fold(0.0, f32::max);
        if most > 0.0 && !(1.0 / HEAVY..=HEAVY).contains(&most) {
            self.log += f64::from(most).ln();
            for group in &mut self.groups {
                for weight in &mut group.weights {
                    *weight /= most;
                }
                group.weigh(0.0);
            }
        }
    }
}

impl Group {
    /// Sums up those that are not below `least`, and drops the others.
    fn weigh(&mut self, least: f32) {
        // Eight sums side by side.
        let (mut sums, mut mosts) = ([0.0_f32; 8], [0.0_f32; 8]);
        for weights in self.weights.chunks_mut(8) {
            for ((weight, sum), most) in weights.iter_mut().zip(&mut sums).zip(&mut mosts) {
                *weight = if *weight < least { 0.0 } else { *weight };
                *sum += *weight;
                *most = if *weight > *most { *weight } else { *most };
            }
        }
        self.sum = sums.iter().copied().map(f64::from).sum();
        self.most = mosts.iter().copied().fold(0.0, f32::max);
    }

    fn shift(
        &self,
        root: usize,
        stride: usize,
        rotations: &[UnitQuaternion<f64>],
        first: &Feeling<'_>,
    ) -> Shift {
        let surface = &self.known.surface;
        let patch = &surface.patches[root * stride];
        let rotation = &rotations[usize::from(self.rotation)];
        let contact = first.contact;
        let each = stride as f64 / (surface.patches.len() * rotations.len()) as f64;
        let normal = super::feeling::normal_likelihood(rotation, contact, patch.normal.as_ref());
        Shift {
            object: self.object,
            rotation: self.rotation,
            translation: patch.position.coords - rotation * contact.position_m.coords,
            variance_m2: contact.variance_m2() + patch.variance_m2,
            evidence: (each * first.likelihood(patch) * normal).ln(),
        }
    }
}

/// Volume by which a Gaussian's peak is divided, of this variance per axis \[m³\].
pub(super) fn gauss_volume(variance: f64) -> f64 {
    let area = std::f64::consts::TAU * variance;
    area * area.sqrt()
}
