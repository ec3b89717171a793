//! Hypotheses where the rotation is one of a few: a sum of Gaussians over translations.

use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

use super::contact::Contact;
use super::library::{ObjectId, ObjectLibrary};
use super::surface::Surface;

/// Most hypotheses kept after a touch.
const KEPT_MAX: usize = 4096;
/// Most births at a touch: places taken for the one that was touched.
const BIRTHS_MAX: usize = 65_536;
/// A hypothesis this far below the best holds nothing worth its keep: e⁻²⁵.
const BELOW: f64 = 25.0;
/// Share of contacts that the map does not explain.
const OUTLIERS: f64 = 0.02;
/// Places farther than this many standard deviations are not the one touched: e⁻¹².
const GATE_SD: f64 = 5.0;
/// A hypothesis parts in two where two places could be the one touched, each with this share.
const PART_SHARE: f64 = 0.05;
/// Most parts.
const PARTS_MAX: usize = 4;

/// One hypothesis: a Gaussian over the translation, its mass being e^`evidence`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shift {
    pub(super) object: ObjectId,
    pub(super) rotation: u16,
    /// The episode's origin in the map \[m\].
    pub(super) translation: Vector3<f64>,
    pub(super) covariance: Matrix3<f64>,
    /// Log-likelihood of the contacts so far, without the share of the map within a step.
    pub(super) evidence: f64,
}

/// All hypotheses.
#[derive(Clone, Debug)]
pub(super) struct Shifts {
    pub(super) rotations: Vec<UnitQuaternion<f64>>,
    pub(super) all: Vec<Shift>,
}

impl Shifts {
    pub(super) fn new(rotations: Vec<UnitQuaternion<f64>>) -> Self {
        Self {
            rotations,
            all: Vec::new(),
        }
    }

    /// One more contact; `before` are those kept of before.
    pub(super) fn touch(&mut self, library: &ObjectLibrary, before: &[Contact], contact: &Contact) {
        if before.is_empty() {
            self.all = self.births(library, contact, BIRTHS_MAX);
        } else {
            let grown = before.last().map_or(0.0, |last| last.drift_sd_m.powi(2));
            let drift = (contact.drift_sd_m.powi(2) - grown).max(0.0);
            let all = std::mem::take(&mut self.all);
            let mut parts = Vec::with_capacity(all.len());
            for shift in all {
                if let Some(surface) = library.surface(shift.object) {
                    self.explain(surface, library, shift, contact, drift, &mut parts);
                }
            }
            self.all = parts;
            self.merge();
        }
        self.prune();
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
                        covariance: Matrix3::from_diagonal_element(variance),
                        evidence: each + felt + normal,
                    });
                }
            }
        }
        births
    }

    /// What becomes of a hypothesis with one more contact: one or more parts.
    fn explain(
        &self,
        surface: &Surface,
        library: &ObjectLibrary,
        shift: Shift,
        contact: &Contact,
        drift: f64,
        parts: &mut Vec<Shift>,
    ) {
        let rotation = &self.rotations[usize::from(shift.rotation)];
        let prior = shift.covariance + Matrix3::from_diagonal_element(drift);
        let noise = contact.position_sd_m * contact.position_sd_m;
        let query = Point3::from(rotation * contact.position_m.coords + shift.translation);
        let share_log = (1.0 - OUTLIERS).ln() - (surface.patches.len() as f64).ln();
        let outlier = (OUTLIERS * library.elsewhere()).ln();
        // The best few places: log density, and the shift's change.
        let mut best: [(f64, Vector3<f64>, f64); PARTS_MAX] =
            [(f64::NEG_INFINITY, Vector3::zeros(), 0.0); PARTS_MAX];
        let mut total = outlier.exp();
        let widest = prior.diagonal().max() + noise + surface.variance_m2;
        for &place in surface.near(&query, GATE_SD * widest.sqrt()) {
            let patch = &surface.patches[place as usize];
            let apart = patch.position - query;
            let variance = noise + patch.variance_m2;
            let total_variance = prior + Matrix3::from_diagonal_element(variance);
            // Too far along any axis: the largest variance bounds the distance.
            if apart.norm_squared() > 25.0 * total_variance.trace() {
                continue;
            }
            let Some(inverse) = total_variance.try_inverse() else {
                continue;
            };
            let distance = apart.dot(&(inverse * apart));
            if distance > 50.0 {
                continue;
            }
            let log = share_log - 0.5 * distance + 0.5 * inverse.determinant().ln()
                - 2.756_815_599_614_018
                + patch.percept_log(contact, library.wide())
                + normal_log(rotation, contact, patch.normal.as_ref());
            total += log.exp();
            if log > best[PARTS_MAX - 1].0 {
                best[PARTS_MAX - 1] = (log, apart, variance);
                best.sort_by(|a, b| b.0.total_cmp(&a.0));
            }
        }
        if best[0].0 < outlier {
            // Most likely an outlier: the hypothesis stays where it is.
            parts.push(Shift {
                covariance: prior,
                evidence: shift.evidence + total.ln(),
                ..shift
            });
            return;
        }
        let taken = best
            .iter()
            .filter(|part| part.0.exp() >= PART_SHARE * total)
            .count()
            .max(1);
        let sum: f64 = best[..taken].iter().map(|part| part.0.exp()).sum();
        for (log, apart, variance) in &best[..taken] {
            let gain = prior
                * (prior + Matrix3::from_diagonal_element(*variance))
                    .try_inverse()
                    .unwrap_or_else(Matrix3::zeros);
            let covariance = prior - gain * prior;
            parts.push(Shift {
                translation: shift.translation + gain * apart,
                covariance: (covariance + covariance.transpose()) * 0.5,
                evidence: shift.evidence + total.ln() + log - sum.ln(),
                ..shift
            });
        }
    }

    /// Makes one of hypotheses that have become the same.
    fn merge(&mut self) {
        let key = |shift: &Shift| {
            // Within a fifth of a deviation or so of one another, whose sum is one Gaussian again.
            let cell = 0.4 * (shift.covariance.trace() / 3.0).sqrt().max(1e-12);
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
    fn prune(&mut self) {
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
            let keep = first || kept < KEPT_MAX && shift.evidence > best - BELOW;
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
