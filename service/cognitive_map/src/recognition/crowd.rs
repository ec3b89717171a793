//! Hypotheses that nobody has looked at yet: every place, taken for the one that was touched first.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::UnitQuaternion;

use super::contact::Contact;
use super::feeling::{Feeling, exp};
use super::library::{Known, ObjectId, ObjectLibrary};
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

/// One of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root {
    group: usize,
    root: usize,
    weight: f32,
}

/// Lists that are filled again and again.
#[derive(Default)]
struct Lists {
    gathered: [Vec<f32>; 3],
    cells: Vec<u32>,
    likelihoods: Vec<f32>,
    /// Of the nearest place: squared distance \[m²\], and likelihood of what was felt there.
    squares: Vec<f32>,
    felt: Vec<f32>,
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
            let each = stride as f64 / (surface.patches.len() * rotations.len()).max(1) as f64;
            let each = narrow(each);
            for (rotation, turn) in (0u16..).zip(rotations) {
                feeling.at(surface, turn).likelihoods(&mut likelihoods);
                let weights = likelihoods.iter().map(|felt| each * felt);
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

    /// Takes a touch in, and gives the weight of each that it makes worth a look, group after group: of those that are explained by
    /// a place. That of others is nothing.
    pub(super) fn sift(
        &mut self,
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        touch: &Taken<'_>,
    ) -> Vec<f32> {
        let roots = self.groups.iter().map(|group| group.weights.len());
        let mut worth = Vec::with_capacity(roots.sum());
        let Some(first) = &self.first else {
            return worth;
        };
        let mut lists = Lists::default();
        for group in &mut self.groups {
            if library.surface(group.object).is_none() {
                group.weights.clear();
            }
            let rotation = &rotations[usize::from(group.rotation)];
            group.sift(
                first,
                (rotation, self.stride),
                touch,
                &mut lists,
                &mut worth,
            );
            group.weigh(0.0);
        }
        // All were taken for hypotheses whose touch was an outlier.
        self.log += touch.outlier.ln();
        worth
    }

    /// The roots that hold most of those that are worth a look: so many at most, and not more than leave next to nothing,
    /// e^`rest_log`, to the others.
    pub(super) fn heaviest(&self, worth: &[f32], most: usize, rest_log: f64) -> Vec<Root> {
        let top = self.groups.iter().map(|group| group.most);
        let per_top = 1.0 / top.fold(0.0, f32::max);
        if !per_top.is_finite() || most == 0 {
            return Vec::new();
        }
        let mut ranks = Ranks::new();
        for weight in worth {
            ranks.add(weight * per_top);
        }
        let rest = (rest_log - self.log).exp() * f64::from(per_top);
        let count = ranks.holding((ranks.sum() - rest).max(0.0)).min(most);
        let (least, mut some) = ranks.least(count);
        let mut heaviest = Vec::with_capacity(count);
        let mut from = 0;
        for (number, group) in self.groups.iter().enumerate() {
            let own = &worth[from..from + group.weights.len()];
            from += own.len();
            for (root, weight) in own.iter().enumerate() {
                let rank = Ranks::of(weight * per_top);
                if rank >= least && *weight > 0.0 && (rank > least || some > 0) {
                    some -= usize::from(rank == least);
                    heaviest.push(Root {
                        group: number,
                        root,
                        weight: *weight,
                    });
                }
            }
        }
        heaviest
    }

    /// Takes one out, as it was after the first touch, with the map that it is in.
    pub(super) fn take(
        &mut self,
        root: &Root,
        rotations: &[UnitQuaternion<f64>],
        first: &Feeling<'_>,
    ) -> (Shift, &Known) {
        let stride = self.stride;
        let group = &mut self.groups[root.group];
        group.weights[root.root] = 0.0;
        let shift = group.shift(root.root, stride, rotations, first);
        (shift, &group.known)
    }

    /// The heaviest of each object, as they would be taken.
    pub(super) fn best_of(&self, object: ObjectId, most: usize) -> Vec<(Root, f64)> {
        let groups = { self.groups.iter().enumerate() }.filter(|(_, group)| group.object == object);
        let mut all: Vec<(Root, f64)> = Vec::new();
        for (number, group) in groups {
            for (root, weight) in group.weights.iter().enumerate() {
                if *weight <= 0.0 || all.len() >= most && f64::from(*weight) <= all[all.len() - 1].1
                {
                    continue;
                }
                let candidate = Root {
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
    pub(super) fn as_shift(&self, root: &Root, rotations: &[UnitQuaternion<f64>]) -> Option<Shift> {
        let first = Feeling::new(self.first.as_ref()?, &[]);
        let group = self.groups.get(root.group)?;
        let shift = group.shift(root.root, self.stride, rotations, &first);
        Some(Shift {
            evidence: f64::from(root.weight).ln() + self.log,
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

    /// Takes a touch in.
    fn sift(
        &mut self,
        first: &Contact,
        (rotation, stride): (&UnitQuaternion<f64>, usize),
        touch: &Taken<'_>,
        lists: &mut Lists,
        worth: &mut Vec<f32>,
    ) {
        let contact = touch.feeling.contact;
        let surface = &self.known.surface;
        let spots = &surface.spots;
        let drift = (contact.drift_sd_m.powi(2) - first.drift_sd_m.powi(2)).max(0.0);
        let noise = contact.position_sd_m.powi(2) + spots.variance_m2;
        let variance = first.variance_m2() + spots.variance_m2 + drift + noise;
        let nearest = spots.nearest(variance);
        let step = rotation * (contact.position_m - first.position_m);
        let step = [narrow(step.x), narrow(step.y), narrow(step.z)];
        if stride > 1 {
            for (list, all) in lists.gathered.iter_mut().zip(&spots.axes) {
                list.clear();
                list.extend(all.iter().step_by(stride));
            }
        }
        let [x, y, z] = if stride > 1 {
            &lists.gathered
        } else {
            &spots.axes
        };
        let roots = self.weights.len();
        let (x, y, z) = (&x[..roots], &y[..roots], &z[..roots]);
        nearest.cells([x, y, z], step, &mut lists.cells);
        touch
            .feeling
            .at(surface, rotation)
            .likelihoods(&mut lists.likelihoods);
        // Where no place is near, nothing was felt of any: without a branch, since that is as good as random.
        lists.likelihoods.push(0.0);
        let last = spots.all.len().saturating_sub(1);
        lists.squares.clear();
        lists.felt.clear();
        let points = x.iter().zip(y).zip(z).zip(&lists.cells);
        let places = points.map(|(((x, y), z), cell)| {
            let place = nearest.place(*cell).min(last + 1);
            let at = &spots.all[place.min(last)].at;
            let apart = [
                x + step[0] - at[0],
                y + step[1] - at[1],
                z + step[2] - at[2],
            ];
            let square = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
            (square, lists.likelihoods[place])
        });
        for (square, felt) in places {
            lists.squares.push(square);
            lists.felt.push(felt);
        }
        let per = narrow(-0.5 / variance);
        let area = TAU * variance;
        let peak = touch.share(surface.patches.len()) / (touch.outlier * area * area.sqrt());
        let peak = narrow(peak);
        let lists = lists.squares.iter().zip(&lists.felt);
        worth.extend(
            self.weights
                .iter_mut()
                .zip(lists)
                .map(|(weight, (square, felt))| {
                    let gain = peak * felt * exp(per * square);
                    let gain = if gain < GAIN_MAX { gain } else { GAIN_MAX };
                    *weight *= 1.0 + gain;
                    if gain > LOOK_LEAST { *weight } else { 0.0 }
                }),
        );
    }

    fn shift(
        &self,
        root: usize,
        stride: usize,
        rotations: &[UnitQuaternion<f64>],
        first: &Feeling<'_>,
    ) -> Shift {
        let surface = &self.known.surface;
        let spot = root * stride;
        let patch = &surface.patches[surface.spots.patch(spot)];
        let rotation = &rotations[usize::from(self.rotation)];
        let contact = first.contact;
        let each = stride as f64 / (surface.patches.len() * rotations.len()) as f64;
        let felt = first
            .at(surface, rotation)
            .likelihood(spot, &surface.spots.all[spot]);
        Shift {
            object: self.object,
            rotation: self.rotation,
            translation: patch.position.coords - rotation * contact.position_m.coords,
            variance_m2: contact.variance_m2() + patch.variance_m2,
            evidence: (each * f64::from(felt)).ln(),
        }
    }
}
