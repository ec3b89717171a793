//! Hypotheses where the rotation is one of a few: a sum of Gaussians over translations.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::contact::{Contact, Reached};
use super::library::{ObjectId, ObjectLibrary};
use super::surface::{Surface, Wide};

/// Most hypotheses kept in the long run. Early on, when little tells them apart, more are: as many as were
/// born, and half as many with each touch.
const KEPT_MAX: usize = 4096;
/// Most births: places taken for the one that was touched first.
const BIRTHS_MAX: usize = 65_536;
/// A hypothesis this far below the best holds nothing worth its keep: e⁻²⁰.
const BELOW: f64 = 20.0;
/// Share of contacts that the map does not explain.
const OUTLIERS: f64 = 0.02;
/// A hypothesis parts where several places could be the one touched, each with this share of the
/// contact's likelihood at least.
const PART_SHARE: f64 = 0.005;
/// Most parts.
const PARTS_MAX: usize = 16;
/// Least share of the weight that places of other objects must have before they say what is beside them.
const WEIGHT_MIN: f64 = 1e-9;
/// Squared distance, in variances, beyond which a place is not the one that was touched: e⁻²⁵.
const DISTANCE_MAX: f64 = 50.0;

/// One hypothesis: a Gaussian over the translation, its mass being e^`evidence`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shift {
    pub(super) object: ObjectId,
    pub(super) rotation: u16,
    /// The episode's origin in the map \[m\].
    pub(super) translation: Vector3<f64>,
    /// Variance of the translation along each axis \[m²\]: all that adds to it is alike along all axes.
    pub(super) variance_m2: f64,
    /// Log-likelihood of the contacts so far, without the share of the map within a step.
    pub(super) evidence: f64,
}

/// A touch while it is taken in.
struct Touched<'a> {
    contact: &'a Contact,
    /// What path integration has drifted since the touch before, per axis \[m²\].
    drift_m2: f64,
    wide: &'a [Wide],
    /// Density of outliers, per m³.
    elsewhere: f64,
    felt: FeltLogs,
    /// Density, displacement and variance of the places that answer one hypothesis.
    answers: Vec<(f64, Vector3<f64>, f64)>,
    parts: Vec<Shift>,
}

/// What the percepts of a touch say of each place, worked out when it is first asked for.
#[derive(Default)]
struct FeltLogs(BTreeMap<ObjectId, Vec<f64>>);

impl FeltLogs {
    /// Log-likelihoods at the places of an object; NaN where nobody has asked.
    fn of(&mut self, object: ObjectId, places: usize) -> &mut [f64] {
        self.0
            .entry(object)
            .or_insert_with(|| vec![f64::NAN; places])
    }
}

/// All hypotheses.
#[derive(Clone, Debug)]
pub(super) struct Shifts {
    pub(super) rotations: Vec<UnitQuaternion<f64>>,
    pub(super) all: Vec<Shift>,
    /// Log-likelihood of the contacts so far, but for those asked for, with something whose surface is
    /// like those of the library, but for the one that it would be taken for; without the share of it
    /// within a step.
    pub(super) strangers: BTreeMap<ObjectId, f64>,
}

impl Shifts {
    pub(super) fn new(rotations: Vec<UnitQuaternion<f64>>) -> Self {
        Self {
            rotations,
            all: Vec::new(),
            strangers: BTreeMap::new(),
        }
    }

    /// One more contact; `before` are those kept of before.
    pub(super) fn touch(&mut self, library: &ObjectLibrary, before: &[Contact], contact: &Contact) {
        if before.is_empty() {
            self.all = self.births(library, contact, BIRTHS_MAX);
        } else {
            let grown = before.last().map_or(0.0, |last| last.drift_sd_m.powi(2));
            let drift = (contact.drift_sd_m.powi(2) - grown).max(0.0);
            if contact.reached != Reached::Aimed {
                let apart = |other: &&Contact| (contact.position_m - other.position_m).norm();
                let nearest = before.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
                if let Some(nearest) = nearest {
                    for (object, log) in self.stranger_logs(library, nearest, contact, drift) {
                        *self.strangers.entry(object).or_default() += log;
                    }
                }
            }
            let all = std::mem::take(&mut self.all);
            let mut touched = Touched {
                contact,
                drift_m2: drift,
                wide: library.wide(),
                elsewhere: library.elsewhere(),
                felt: FeltLogs::default(),
                answers: Vec::new(),
                parts: Vec::with_capacity(2 * all.len()),
            };
            for shift in all {
                if let Some(surface) = library.surface(shift.object) {
                    self.explain(surface, shift, &mut touched);
                }
            }
            self.all = touched.parts;
            self.drop_faint();
            self.merge();
        }
        self.prune(KEPT_MAX.max(BIRTHS_MAX >> before.len().min(31)));
    }

    /// Log-density of a contact with something that was never learned: the mean over places of the library, each taken for
    /// the one touched by `other`, weighed by how well it explains what was felt there. By the object that it would be
    /// taken for, whose own places do not count: what is felt nowhere else would otherwise be as like something
    /// unknown as it is like that one.
    ///
    /// It is what a hypothesis that knows nothing else would expect, so that evidence for a map begins
    /// where the map explains more than a surface of its kind. Space filled evenly would be no rival: a step along
    /// any surface ends on most others, and neighbouring places feel alike on most.
    fn stranger_logs(
        &self,
        library: &ObjectLibrary,
        other: &Contact,
        contact: &Contact,
        drift: f64,
    ) -> BTreeMap<ObjectId, f64> {
        let step = contact.position_m - other.position_m;
        let noise = contact.position_sd_m * contact.position_sd_m + drift;
        let wide = library.wide();
        let mut sums: BTreeMap<ObjectId, [f64; 4]> = BTreeMap::new();
        let mut turns = self.rotations.iter().cycle();
        for &(object, place) in library.samples() {
            let (Some(surface), Some(rotation)) = (library.surface(object), turns.next()) else {
                continue;
            };
            let here = &surface.patches[place as usize];
            let normal = normal_log(rotation, other, here.normal.as_ref());
            let weight = (here.percept_log(other, wide) + normal).exp();
            let query = here.position + rotation * step;
            let mut density = 0.0;
            for &near in surface.near(&query, noise) {
                let patch = &surface.patches[near as usize];
                let variance = noise + patch.variance_m2;
                let squared = (patch.position - query).norm_squared() / variance;
                if squared < DISTANCE_MAX {
                    let normal = normal_log(rotation, contact, patch.normal.as_ref());
                    let felt = patch.percept_log(contact, wide);
                    density += (normal + felt - 0.5 * squared).exp() / (TAU * variance).powf(1.5);
                }
            }
            let density = density / surface.patches.len() as f64;
            let [sum, weights, plain, count] = sums.entry(object).or_default();
            *sum += weight * density;
            *weights += weight;
            *plain += density;
            *count += 1.0;
        }
        let all = { sums.values() }.fold([0.0; 4], |all, own| {
            std::array::from_fn(|k| all[k] + own[k])
        });
        // Of places of no other object, how a surface goes on is all that is known.
        let [_, _, plain, count] = all;
        let elsewhere = OUTLIERS * library.elsewhere();
        { sums.into_iter() }
            .map(|(object, [sum, weights, ..])| {
                let (sum, weights) = (all[0] - sum, all[1] - weights);
                let typical = if weights > WEIGHT_MIN * all[1] {
                    sum / weights
                } else {
                    plain / count
                };
                (
                    object,
                    ((1.0 - OUTLIERS) * typical.max(0.0) + elsewhere).ln(),
                )
            })
            .collect()
    }

    /// Every place taken for the one that was touched.
    fn births(&self, library: &ObjectLibrary, contact: &Contact, most: usize) -> Vec<Shift> {
        let places: usize = library
            .surfaces()
            .map(|(_, surface)| surface.patches.len())
            .sum();
        let step = (places * self.rotations.len()).div_ceil(most).max(1);
        let rotations_log = (self.rotations.len() as f64).ln();
        let mut births = Vec::new();
        let mut at = 0usize;
        for (object, surface) in library.surfaces() {
            let each = -(surface.patches.len() as f64).ln() - rotations_log + (step as f64).ln();
            let felt: Vec<_> = surface
                .patches
                .iter()
                .map(|patch| patch.percept_log(contact, library.wide()))
                .collect();
            for (number, rotation) in (0u16..).zip(&self.rotations) {
                let turned = rotation * contact.position_m.coords;
                for (patch, felt) in surface.patches.iter().zip(&felt) {
                    at += 1;
                    if !at.is_multiple_of(step) {
                        continue;
                    }
                    let variance = contact.variance_m2() + patch.variance_m2;
                    let normal = normal_log(rotation, contact, patch.normal.as_ref());
                    births.push(Shift {
                        object,
                        rotation: number,
                        translation: patch.position.coords - turned,
                        variance_m2: variance,
                        evidence: each + felt + normal,
                    });
                }
            }
        }
        births
    }

    /// What becomes of a hypothesis with one more contact: one or more parts, each with its place taken for
    /// the one that was touched.
    fn explain(&self, surface: &Surface, shift: Shift, touch: &mut Touched<'_>) {
        let rotation = &self.rotations[usize::from(shift.rotation)];
        let contact = touch.contact;
        let prior = shift.variance_m2 + touch.drift_m2;
        let noise = contact.position_sd_m * contact.position_sd_m;
        let query = Point3::from(rotation * contact.position_m.coords + shift.translation);
        let share_log = (1.0 - OUTLIERS).ln() - (surface.patches.len() as f64).ln();
        let outlier = OUTLIERS * touch.elsewhere;
        let felt = touch.felt.of(shift.object, surface.patches.len());
        let mut total = outlier;
        touch.answers.clear();
        for &place in surface.near(&query, prior + noise) {
            let patch = &surface.patches[place as usize];
            let apart = patch.position - query;
            let variance = noise + patch.variance_m2;
            let squared = apart.norm_squared() / (prior + variance);
            if squared > DISTANCE_MAX {
                continue;
            }
            let felt = &mut felt[place as usize];
            if felt.is_nan() {
                *felt = patch.percept_log(contact, touch.wide);
            }
            let log = share_log - 0.5 * squared - 1.5 * (TAU * (prior + variance)).ln()
                + *felt
                + normal_log(rotation, contact, patch.normal.as_ref());
            let density = log.exp();
            total += density;
            touch.answers.push((density, apart, variance));
        }
        let total_log = total.ln();
        let least = PART_SHARE * total;
        touch.answers.retain(|answer| answer.0 >= least);
        if touch.answers.len() > PARTS_MAX {
            touch.answers.sort_by(|a, b| b.0.total_cmp(&a.0));
            touch.answers.truncate(PARTS_MAX);
        }
        let best = touch.answers.iter().map(|answer| answer.0);
        if best.fold(0.0, f64::max) < outlier {
            // Most likely an outlier: the hypothesis stays where it is.
            touch.parts.push(Shift {
                variance_m2: prior,
                evidence: shift.evidence + total_log,
                ..shift
            });
            return;
        }
        let sum_log = touch
            .answers
            .iter()
            .map(|answer| answer.0)
            .sum::<f64>()
            .ln();
        for (density, apart, variance) in &touch.answers {
            let gain = prior / (prior + variance);
            touch.parts.push(Shift {
                translation: shift.translation + gain * apart,
                variance_m2: prior - gain * prior,
                evidence: shift.evidence + total_log + density.ln() - sum_log,
                ..shift
            });
        }
    }

    /// Drops what holds no evidence before it is sorted. The last hypothesis of an object waits for
    /// [`prune`](Self::prune).
    fn drop_faint(&mut self) {
        let mut best: BTreeMap<ObjectId, f64> = BTreeMap::new();
        for shift in &self.all {
            let best = best.entry(shift.object).or_insert(f64::NEG_INFINITY);
            *best = best.max(shift.evidence);
        }
        let most = best.values().copied().fold(f64::NEG_INFINITY, f64::max);
        self.all
            .retain(|shift| shift.evidence > most - BELOW || shift.evidence >= best[&shift.object]);
    }

    /// Makes one of hypotheses that have become the same.
    fn merge(&mut self) {
        let key = |shift: &Shift| {
            // Within a fifth of a deviation or so of one another, whose sum is one Gaussian again.
            let cell = 0.4 * shift.variance_m2.sqrt().max(1e-12);
            // Powers of two, so that hypotheses of about the same width have the same cells.
            let cell = cell.log2().floor().exp2();
            #[expect(clippy::cast_possible_truncation, reason = "saturates")]
            let at = shift.translation.map(|x| (x / cell).round() as i64);
            (shift.object, shift.rotation, at.x, at.y, at.z)
        };
        let mut keyed: Vec<_> = self.all.iter().map(|shift| (key(shift), *shift)).collect();
        keyed.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.evidence.total_cmp(&a.1.evidence)));
        self.all.clear();
        let mut last = None;
        for (key, shift) in keyed {
            match self.all.last_mut() {
                Some(kept) if last == Some(key) => {
                    let sum = log_sum([kept.evidence, shift.evidence].into_iter());
                    let share = (shift.evidence - sum).exp();
                    kept.translation += (shift.translation - kept.translation) * share;
                    kept.evidence = sum;
                }
                _ => self.all.push(shift),
            }
            last = Some(key);
        }
    }

    /// Drops what holds no evidence, and the least beyond the budget; each object keeps its best.
    fn prune(&mut self, most: usize) {
        self.all.sort_by(|a, b| {
            b.evidence
                .total_cmp(&a.evidence)
                .then(a.object.cmp(&b.object))
                .then(a.rotation.cmp(&b.rotation))
        });
        let Some(best) = self.all.first().map(|best| best.evidence) else {
            return;
        };
        let mut kept = 0;
        let mut seen = std::collections::BTreeSet::new();
        self.all.retain(|shift| {
            let first = seen.insert(shift.object);
            let keep = first || kept < most && shift.evidence > best - BELOW;
            kept += usize::from(keep);
            keep
        });
    }
}

impl Shift {
    /// Its mean pose.
    pub(super) fn pose(&self, rotations: &[UnitQuaternion<f64>]) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(self.translation),
            rotations[usize::from(self.rotation)],
        )
    }
}

/// Log-density of a contact's normal at a place, per steradian, less that of one anywhere.
fn normal_log(
    rotation: &UnitQuaternion<f64>,
    contact: &Contact,
    normal: Option<&nalgebra::Unit<Vector3<f64>>>,
) -> f64 {
    let (Some(felt), Some(own)) = (&contact.normal, normal) else {
        return 0.0;
    };
    // Between places a surface turns; a fifth of a radian is a good part of what voxels and hands
    // differ by, and the rest is an outlier's.
    let variance = contact.normal_sd_rad * contact.normal_sd_rad + 0.04;
    let apart = 2.0 * (1.0 - (rotation * felt.into_inner()).dot(own));
    (0.9 * 2.0 / variance * (-0.5 * apart / variance).exp() + 0.1).ln()
}

/// log Σ exp.
pub(super) fn log_sum(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + logs.map(|log| (log - most).exp()).sum::<f64>().ln()
}
