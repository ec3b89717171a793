//! The roots of one map in one rotation.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::UnitQuaternion;
use pulp::Arch;

use super::contact::Contact;
use super::feeling::{Feeling, Local, exp};
use super::library::{Known, ObjectId};
use super::nearest::Nearest;
use super::shifts::{Shift, Taken, share};
use super::spots::{Spots, narrow};

/// Most that a touch makes of a weight, so that numbers stay finite.
const GAIN_MAX: f32 = 1e30;
/// When fewer of the roots than one in so many hold something, the others are left out of the list.
const SPARSE: usize = 2;

/// The places of a map in one rotation, each taken for the one that was touched first.
#[derive(Clone, Debug)]
pub(super) struct Group {
    pub(super) object: ObjectId,
    pub(super) rotation: u16,
    /// The map as it was then.
    known: Arc<Known>,
    /// Prior probability of each, without that of the map.
    each: f64,
    /// Mass of each, on the scale of the crowd; nothing for those that have been looked at or hold nothing.
    pub(super) weights: Vec<f32>,
    /// Which places they are, if not all.
    some: Option<Vec<u32>>,
    pub(super) sum: f64,
    pub(super) most: f32,
    /// How many hold something.
    live: usize,
}

/// Of weights: eight sums side by side, the greatest of each, and how many of each are something.
#[derive(Clone, Copy, Default)]
struct Sums {
    all: [f32; 8],
    most: [f32; 8],
    live: [u32; 8],
}

/// Lists that are filled again and again.
#[derive(Debug, Default)]
pub(super) struct Lists {
    /// Positions of some places of a map.
    axes: [Vec<f32>; 3],
    /// Cells, and then the places that are nearest there.
    cells: Vec<u32>,
    /// Likelihood of what was felt at each place of the map, and at none.
    likelihoods: Vec<f32>,
    /// The map that they are of, if they are the same in all rotations of it.
    likely_at: Option<ObjectId>,
    /// Of the nearest place: squared distance \[m²\], and likelihood of what was felt there.
    squares: Vec<f32>,
    felt: Vec<f32>,
}

impl Lists {
    /// Finds the place nearest to each of some places, or of all, that are moved by a step \[m\].
    fn find(&mut self, spots: &Spots, some: Option<&[u32]>, nearest: &Nearest, step: [f32; 3]) {
        let count = some.map_or(spots.all.len(), <[u32]>::len);
        self.cells.resize(count, 0);
        self.squares.resize(count, 0.0);
        if let Some(some) = some {
            for (list, axis) in self.axes.iter_mut().zip(&spots.axes) {
                list.resize(count, 0.0);
                for (at, spot) in list.iter_mut().zip(some) {
                    *at = axis[*spot as usize];
                }
            }
        }
        let [x, y, z] = if some.is_some() {
            &self.axes
        } else {
            &spots.axes
        };
        nearest.cells([x, y, z], step, &mut self.cells);
        // The cells are far apart in memory: nothing else is done while they come.
        nearest.places(&mut self.cells);
        let last = spots.all.len() - 1;
        let [to_x, to_y, to_z] = spots.axes.each_ref().map(|axis| &axis[..=last]);
        let points = x.iter().zip(y).zip(z).zip(&self.cells);
        for ((((x, y), z), place), square) in points.zip(&mut self.squares) {
            let place = (*place as usize).min(last);
            let apart = [
                x + step[0] - to_x[place],
                y + step[1] - to_y[place],
                z + step[2] - to_z[place],
            ];
            *square = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
        }
    }

    /// Works out how likely what was felt is at the places that were found.
    fn feel(&mut self, spots: &Spots, object: ObjectId, local: &Local<'_>) {
        let places = spots.all.len();
        self.felt.resize(self.cells.len(), 0.0);
        let felt = self.felt.iter_mut().zip(&self.cells);
        if self.cells.len() * local.sparse() < places {
            for (felt, place) in felt {
                let place = *place as usize;
                let spot = spots.all.get(place);
                *felt = spot.map_or(0.0, |spot| local.likelihood(place, spot));
            }
            return;
        }
        if self.likely_at != Some(object) || !local.is_unturned() {
            local.likelihoods(&mut self.likelihoods);
            // Where no place is near, nothing was felt of any: without a branch, since that is as good as random.
            self.likelihoods.push(0.0);
            self.likely_at = Some(object);
        }
        let likelihoods = &self.likelihoods[..=places];
        for (felt, place) in felt {
            *felt = likelihoods[(*place as usize).min(places)];
        }
    }
}

impl Group {
    /// After the first touch, by which each place is so likely; of several side by side, `stride`, one stands for all.
    pub(super) fn new(
        (object, rotation): (ObjectId, u16),
        known: Arc<Known>,
        each: f64,
        stride: usize,
        likelihoods: &[f32],
    ) -> Self {
        let scale = narrow(each);
        let mut group = Self {
            object,
            rotation,
            known,
            each,
            weights: likelihoods.iter().map(|felt| scale * felt).collect(),
            some: None,
            sum: 0.0,
            most: 0.0,
            live: 0,
        };
        if stride > 1 {
            group.keep(|spot, _| spot.is_multiple_of(stride));
        }
        group.drop_below(0.0);
        group
    }

    /// Its map.
    pub(super) fn known(&self) -> &Known {
        &self.known
    }

    /// Takes a touch in, and writes the weights of those that it makes worth a look: where there is a place near.
    pub(super) fn sift(
        &mut self,
        first: &Contact,
        rotation: &UnitQuaternion<f64>,
        touch: &Taken<'_>,
        lists: &mut Lists,
        worth: &mut [f32],
    ) {
        let contact = touch.feeling.contact;
        let surface = &self.known.surface;
        let spots = &surface.spots;
        let drift = (contact.drift_sd_m.powi(2) - first.drift_sd_m.powi(2)).max(0.0);
        let noise = contact.position_sd_m.powi(2) + spots.variance_m2;
        let variance = first.variance_m2() + spots.variance_m2 + drift + noise;
        let step = rotation * (contact.position_m - first.position_m);
        let step = [narrow(step.x), narrow(step.y), narrow(step.z)];
        if self.weights.is_empty() {
            return;
        }
        lists.find(spots, self.some.as_deref(), spots.nearest(variance), step);
        lists.feel(spots, self.object, &touch.feeling.at(surface, rotation));
        let per = narrow(-0.5 / variance);
        let area = TAU * variance;
        let peak = share(surface.patches.len()) / (touch.outlier * area * area.sqrt());
        let peak = narrow(peak);
        let (weights, Lists { squares, felt, .. }) = (&mut self.weights, lists);
        Arch::new().dispatch(
            #[inline(always)]
            || {
                let places = squares.iter().zip(felt);
                for ((weight, worth), (square, felt)) in weights.iter_mut().zip(worth).zip(places) {
                    let gain = peak * *felt * exp(per * square);
                    let gain = if gain < GAIN_MAX { gain } else { GAIN_MAX };
                    *weight *= 1.0 + gain;
                    *worth = if *felt > 0.0 { *weight } else { 0.0 };
                }
            },
        );
        self.weigh(0.0);
    }

    /// What a place would be as a hypothesis of its own, after the first touch.
    pub(super) fn shift(
        &self,
        root: usize,
        rotation: &UnitQuaternion<f64>,
        first: &Feeling<'_>,
    ) -> Shift {
        let surface = &self.known.surface;
        let spot = { self.some.as_ref() }.map_or(root, |some| some[root] as usize);
        let patch = &surface.patches[surface.spots.patch(spot)];
        let contact = first.contact;
        let local = first.at(surface, rotation);
        let felt = local.likelihood(spot, &surface.spots.all[spot]);
        Shift {
            object: self.object,
            rotation: self.rotation,
            translation: patch.position.coords - rotation * contact.position_m.coords,
            variance_m2: contact.variance_m2() + patch.variance_m2,
            evidence: (self.each * f64::from(felt)).ln(),
        }
    }

    /// Drops those that are below `least`.
    pub(super) fn drop_below(&mut self, least: f32) {
        self.weigh(least);
        if SPARSE * self.live < self.weights.len() {
            self.keep(|_, weight| weight > 0.0);
        }
    }

    /// Divides all weights.
    pub(super) fn divide(&mut self, by: f32) {
        for weight in &mut self.weights {
            *weight /= by;
        }
        self.weigh(0.0);
    }

    /// Drops all.
    pub(super) fn forget(&mut self) {
        self.weights.fill(0.0);
        self.weigh(0.0);
    }

    /// Sums up those that are not below `least`, and makes nothing of the others.
    fn weigh(&mut self, least: f32) {
        let (weights, rest) = self.weights.as_chunks_mut::<8>();
        let mut sums = Arch::new().dispatch(
            #[inline(always)]
            || {
                let mut sums = Sums::default();
                for weights in weights {
                    sums.add(weights, least);
                }
                sums
            },
        );
        sums.add(rest, least);
        self.sum = sums.all.iter().copied().map(f64::from).sum();
        self.most = sums.most.iter().copied().fold(0.0, f32::max);
        self.live = sums.live.iter().sum::<u32>() as usize;
    }

    /// Leaves only some places in the lists, by their number and weight.
    fn keep(&mut self, is_kept: impl Fn(usize, f32) -> bool) {
        let own = self.some.take();
        let mut kept = vec![0; self.weights.len()];
        let mut count = 0;
        for root in 0..self.weights.len() {
            let spot = own.as_ref().map_or(root, |own| own[root] as usize);
            let weight = self.weights[root];
            // Without a branch, since which are kept is as good as random.
            self.weights[count] = weight;
            kept[count] = u32::try_from(spot).expect("a model has few places");
            count += usize::from(is_kept(spot, weight));
        }
        kept.truncate(count);
        kept.shrink_to_fit();
        self.weights.truncate(count);
        self.some = Some(kept);
    }
}

impl Sums {
    /// Adds eight weights at most, of which those below `least` become nothing.
    #[expect(
        clippy::inline_always,
        reason = "only what is inlined into a dispatched closure is compiled for the vectors that it chose"
    )]
    #[inline(always)]
    fn add(&mut self, weights: &mut [f32], least: f32) {
        let sums = { self.all.iter_mut() }
            .zip(&mut self.most)
            .zip(&mut self.live);
        for (weight, ((sum, most), live)) in weights.iter_mut().zip(sums) {
            *weight = if *weight < least { 0.0 } else { *weight };
            *sum += *weight;
            *most = if *weight > *most { *weight } else { *most };
            *live += u32::from(*weight > 0.0);
        }
    }
}
