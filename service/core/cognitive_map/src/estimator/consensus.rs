//! On which pose of a body its sightings of known landmarks agree.
//!
//! Where many sightings are of something else, a run of refused ones says little against the pose.
//! A wrong pose shows in that what was seen agrees on another one. Since when it is wrong nobody
//! says: the n sightings from any of them on may be those that count.
//!
//! ```text
//! hypotheses      motions that take two sightings (in space three) to their landmarks
//! agreeing        sightings within three deviations of their landmarks after a motion; the motion
//!                 is fitted to them, and they are sought again
//! false alarms    H · P(at least k − 2 of n − 2 are near by chance); in space k − 3 of n − 3
//! H               sum over all twos (threes) of the probability that they lie as far apart as
//!                 their landmarks by chance; n times that, unless the n are those refused last
//! ```
//!
//! Three things that are moved together look as a robot does that is carried and sees but them. So
//! four must agree.
//!
//! What is no sighting of its landmark may lie anywhere within the distance at which it was seen:
//! it is near by chance with the part that three deviations take of that circle (in space: ball).
//! Deviations are those of sightings and landmarks. Those of the motion since are left out: with
//! more of them more would agree by chance, with too few of them fewer agree at all. (Fischler &
//! Bolles 1981; Moisan & Stival 2004.)

use geometry::align;
use nalgebra::{Isometry3, Point3, Vector3};

use super::recent_sightings::SeenPoint;
use super::registration::GATE;
use super::tuning::{
    CONSENSUS_LATEST, CONSENSUS_LOG10_FALSE_ALARMS_MAX, CONSENSUS_ROUNDS, CONSENSUS_SPAN_SD,
    RECENT_SIGHTINGS_MAX,
};
use chance::Chance;

mod chance;

/// On which pose of a body, other than its present one, its sightings agree.
#[derive(Clone, Debug)]
pub(super) struct Consensus {
    pub(super) pose: Isometry3<f64>,
    /// Those that do, the oldest first.
    pub(super) agreeing: Vec<SeenPoint>,
}

/// A known landmark.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownPoint {
    pub(super) position: Point3<f64>,
    /// Along an axis, beside other landmarks \[m²\].
    pub(super) variance: f64,
}

/// A sighting, where the present pose has it, and its landmark.
#[derive(Clone, Copy, Debug)]
struct Pair<'a> {
    sighting: &'a SeenPoint,
    there: Point3<f64>,
    seen: Point3<f64>,
    variance: f64,
}

/// Some of the pairs, a bit for each, the oldest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Subset(u32);

const _: () = assert!(RECENT_SIGHTINGS_MAX <= 32);

/// Pairs that agree on a motion.
#[derive(Clone, Copy, Debug)]
struct Agreement {
    agreeing: Subset,
    /// The first of the pairs among which they are so many.
    since: usize,
    /// Log₁₀ of the expected number of such agreements by chance.
    log10_false_alarms: f64,
}

/// The pose on which sightings agree, the oldest first and each of another landmark, by what is
/// known of the landmark of each, if anything is. None if about as many agree on the present one.
pub(super) fn consensus(
    seen: &[SeenPoint],
    landmarks: &[Option<KnownPoint>],
    pose: &Isometry3<f64>,
    is_planar: bool,
) -> Option<Consensus> {
    let pair =
        |(sighting, landmark): (_, &Option<_>)| Pair::new(sighting, (*landmark)?, pose, is_planar);
    let pairs: Vec<Pair<'_>> = seen.iter().zip(landmarks).filter_map(pair).collect();
    let here = agreeing(&Isometry3::identity(), &pairs, |_| 0.0);
    if here.count_from(0) + 1 >= pairs.len() {
        return None;
    }
    let best = Search::new(&pairs, here, is_planar).best()?;
    if best.log10_false_alarms > CONSENSUS_LOG10_FALSE_ALARMS_MAX {
        return None;
    }
    // What was seen before agrees by chance.
    let agreeing = best.agreeing.from(best.since);
    let motion = fitted(agreeing, &pairs, is_planar)?;
    let sightings = agreeing.of(&pairs).map(|pair| pair.sighting.clone());
    Some(Consensus {
        pose: motion * pose,
        agreeing: sightings.collect(),
    })
}

/// Sightings that fix a motion.
fn n_free(is_planar: bool) -> usize {
    if is_planar { 2 } else { 3 }
}

impl Subset {
    fn single(at: usize) -> Self {
        Self(1 << at)
    }

    fn and(self, at: usize) -> Self {
        Self(self.0 | 1 << at)
    }

    /// Those of them from one pair on.
    fn from(self, first: usize) -> Self {
        Self(self.0 >> first << first)
    }

    fn count_from(self, first: usize) -> usize {
        self.from(first).0.count_ones() as usize
    }

    fn of<'p, 'a>(self, pairs: &'p [Pair<'a>]) -> impl Iterator<Item = &'p Pair<'a>> {
        let numbered = pairs.iter().enumerate();
        numbered.filter_map(move |(at, pair)| (self.0 >> at & 1 == 1).then_some(pair))
    }
}

impl<'a> Pair<'a> {
    fn new(
        sighting: &'a SeenPoint,
        landmark: KnownPoint,
        pose: &Isometry3<f64>,
        is_planar: bool,
    ) -> Option<Self> {
        let variance = sighting.variance + landmark.variance;
        let [mut there, mut seen] = [landmark.position, pose * sighting.in_body];
        if is_planar {
            (there.z, seen.z) = (0.0, 0.0);
        }
        (variance > 0.0 && variance.is_finite()).then_some(Self {
            sighting,
            there,
            seen,
            variance,
        })
    }

    /// The part of what is within reach that is as near to the landmark as what agrees.
    fn by_chance(&self, is_planar: bool) -> f64 {
        let part = GATE * self.variance.sqrt() / self.sighting.distance_m;
        let dimensions = if is_planar { 2 } else { 3 };
        part.min(1.0).powi(dimensions)
    }

    /// The part of the distances that two points within reach may have that is as near to that of
    /// their landmarks as what agrees.
    fn apart_by_chance(&self, other: &Self) -> f64 {
        let reach_m = self.sighting.distance_m + other.sighting.distance_m;
        let part = 2.0 * GATE * (self.variance + other.variance).sqrt() / reach_m;
        part.min(1.0)
    }
}

/// Search for the agreement of pairs that is least by chance.
struct Search<'p, 'a> {
    pairs: &'p [Pair<'a>],
    is_planar: bool,
    /// Those that agree on the present pose.
    here: Subset,
    /// The latest sightings.
    latest: Subset,
    /// What is by chance from each of the pairs on.
    chances: Vec<Chance>,
    best: Option<Agreement>,
}

impl<'p, 'a> Search<'p, 'a> {
    fn new(pairs: &'p [Pair<'a>], here: Subset, is_planar: bool) -> Self {
        let from_latest = pairs.iter().rev();
        let n_refused = from_latest.take_while(|pair| pair.sighting.is_refused);
        let refused_since = pairs.len() - n_refused.count();
        let since = |first: usize| {
            let n_choices = if first == refused_since {
                1
            } else {
                pairs.len()
            };
            Chance::of(&pairs[first..], n_choices, is_planar)
        };
        Self {
            pairs,
            is_planar,
            here,
            latest: which(pairs, |pair| pair.sighting.age < CONSENSUS_LATEST),
            chances: (0..pairs.len()).map(since).collect(),
            best: None,
        }
    }

    fn best(mut self) -> Option<Agreement> {
        let pairs = self.pairs;
        for j in 0..pairs.len() {
            for i in 0..j {
                if !are_apart(&pairs[i], &pairs[j]) {
                    continue;
                }
                let two = Subset::single(i).and(j);
                if self.is_planar {
                    self.consider(two);
                    continue;
                }
                for k in 0..i {
                    let [a, b, c] = [i, j, k].map(|at| &pairs[at]);
                    if are_apart(a, c) && are_apart(b, c) && is_off_line(a, b, c) {
                        self.consider(two.and(k));
                    }
                }
            }
        }
        self.best
    }

    /// Tries the motion by some of the pairs.
    fn consider(&mut self, some: Subset) -> Option<()> {
        let motion = fitted(some, self.pairs, self.is_planar)?;
        let spread = Spread::of(some, self.pairs);
        let mut agree = agreeing(&motion, self.pairs, |point| spread.at(point));
        self.judge(agree)?;
        for _ in 0..CONSENSUS_ROUNDS {
            let motion = fitted(agree, self.pairs, self.is_planar)?;
            agree = agreeing(&motion, self.pairs, |_| 0.0);
        }
        self.best = Some(self.judge(agree)?);
        Some(())
    }

    /// What pairs that agree are worth, if that is more than what was found before. Too few of
    /// them are worth nothing, nor are old ones alone, nor one more than agree here.
    fn judge(&self, agreeing: Subset) -> Option<Agreement> {
        if agreeing.0 & self.latest.0 == 0 {
            return None;
        }
        let since = |first: usize| Agreement {
            agreeing,
            since: first,
            log10_false_alarms: self.chances[first].log10_false_alarms(agreeing.count_from(first)),
        };
        let less = |one: &Agreement, other: &Agreement| {
            one.log10_false_alarms.total_cmp(&other.log10_false_alarms)
        };
        let found = (0..self.pairs.len()).map(since).min_by(less)?;
        if self.here.count_from(found.since) + 1 >= agreeing.count_from(found.since) {
            return None;
        }
        let before = self.best.as_ref();
        let before = before.map_or(f64::INFINITY, |best| best.log10_false_alarms);
        (found.log10_false_alarms < before).then_some(found)
    }
}

/// Whether two sightings are of landmarks that lie as far apart as these were seen, and far enough
/// to say how the body is turned.
fn are_apart(a: &Pair<'_>, b: &Pair<'_>) -> bool {
    let (seen_m, there_m) = ((a.seen - b.seen).norm(), (a.there - b.there).norm());
    let sd_m = (a.variance + b.variance).sqrt();
    seen_m > CONSENSUS_SPAN_SD * sd_m && (seen_m - there_m).abs() <= GATE * sd_m
}

/// Whether a third one says how the body is turned about the line of two.
fn is_off_line(a: &Pair<'_>, b: &Pair<'_>, c: &Pair<'_>) -> bool {
    let (along, off) = (b.seen - a.seen, c.seen - a.seen);
    let height_m = along.cross(&off).norm() / along.norm();
    height_m > CONSENSUS_SPAN_SD * (a.variance + b.variance + c.variance).sqrt()
}

/// The motion by some of the pairs.
fn fitted(some: Subset, pairs: &[Pair<'_>], is_planar: bool) -> Option<Isometry3<f64>> {
    let points: Vec<_> = some.of(pairs).map(|pair| (pair.there, pair.seen)).collect();
    let weights: Vec<f64> = some.of(pairs).map(|pair| 1.0 / pair.variance).collect();
    align(&points, &weights, is_planar)
}

/// The pairs that lie upon one another after a motion, which is off by so much at a point \[m²\].
fn agreeing(
    motion: &Isometry3<f64>,
    pairs: &[Pair<'_>],
    spread: impl Fn(&Point3<f64>) -> f64,
) -> Subset {
    which(pairs, |pair| {
        let off = motion * pair.seen - pair.there;
        off.norm_squared() <= GATE * GATE * (pair.variance + spread(&pair.seen))
    })
}

fn which(pairs: &[Pair<'_>], is_one: impl Fn(&Pair<'_>) -> bool) -> Subset {
    let ones = pairs.iter().enumerate().filter(|(_, pair)| is_one(pair));
    ones.fold(Subset::default(), |some, (at, _)| some.and(at))
}

/// Variance that the error of a motion by few pairs adds at a point: that of their middle, and more
/// the farther out it is.
struct Spread {
    middle: Point3<f64>,
    radius_m: f64,
    variance: f64,
}

impl Spread {
    fn of(some: Subset, pairs: &[Pair<'_>]) -> Self {
        let n = some.count_from(0) as f64;
        let sum: Vector3<f64> = some.of(pairs).map(|pair| pair.seen.coords).sum();
        let middle = Point3::from(sum / n);
        let radii = some.of(pairs).map(|pair| (pair.seen - middle).norm());
        Self {
            radius_m: radii.sum::<f64>() / n,
            variance: some.of(pairs).map(|pair| pair.variance).sum::<f64>() / (n * n),
            middle,
        }
    }

    fn at(&self, point: &Point3<f64>) -> f64 {
        let lever = ((point - self.middle).norm() / self.radius_m).min(2.0);
        self.variance * (1.0 + lever * lever)
    }
}

#[cfg(test)]
mod tests;
