//! Hypotheses where the rotation is one of a few: a sum of Gaussians over translations.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::contact::{Contact, Reached};
use super::crowd::Crowd;
use super::feeling::{Feeling, Local};
use super::library::{ObjectId, ObjectLibrary};
use super::nearby::{Answer, Nearby};
use super::ranks::Ranks;
use super::spots::narrow;
use super::strangers::Strangers;
use super::surface::Surface;

/// Most hypotheses kept of those that were looked at.
const KEPT_MAX: usize = 4096;
/// Most contacts explained at a touch by first places that are looked at, each by all contacts so far.
const LOOKS_MAX: usize = 1280;
/// The fewer, the more first places there are at which a rough look is taken: so many of these cost as much as all of those.
const ROUGH_MAX: usize = 150_000;
/// Contacts explained at least.
const LOOKS_MIN: usize = 256;
/// First places wait until all that matter can be looked at, but not longer than so many contacts: meanwhile
/// estimates tell them apart nearly as well, and what is looked at has to be kept.
const WAITING_CONTACTS: usize = 12;
/// Share of all mass that those who wait may hold when the others are looked at, and that of those which need not be looked
/// at at all.
const WAITING: f64 = 1e-3;
const UNLOOKED: f64 = 1e-6;
/// After so many contacts the places that nobody has looked at are given up.
const CROWD_CONTACTS: usize = 32;
/// A hypothesis this far below the best holds nothing worth its keep: e⁻²⁰.
const BELOW: f64 = 20.0;
/// Share of contacts that the map does not explain.
pub(super) const OUTLIERS: f64 = 0.02;
/// A hypothesis parts where several places could be the one touched, each with this share of the
/// contact's likelihood at least.
const PART_SHARE: f64 = 0.005;
/// Most parts.
const PARTS_MAX: usize = 16;

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
#[derive(Debug)]
pub(super) struct Taken<'a> {
    pub(super) feeling: Feeling<'a>,
    /// What path integration has drifted since the touch before, per axis \[m²\].
    drift_m2: f64,
    /// Density of a touch that is an outlier, with the share of those, per m³.
    pub(super) outlier: f64,
}

/// All hypotheses.
#[derive(Clone, Debug)]
pub(super) struct Shifts {
    pub(super) rotations: Vec<UnitQuaternion<f64>>,
    /// Those that have been looked at, by object.
    all: Vec<Shift>,
    /// The others.
    crowd: Crowd,
    /// Log-likelihood of the contacts so far, but for those asked for, with something whose surface is
    /// like those of the library, but for the one that it would be taken for; without the share of it
    /// within a step.
    pub(super) strangers: Strangers,
}

impl Shifts {
    pub(super) fn new(rotations: Vec<UnitQuaternion<f64>>) -> Self {
        Self {
            rotations,
            all: Vec::new(),
            crowd: Crowd::default(),
            strangers: Strangers::default(),
        }
    }

    /// Whether there is none.
    pub(super) fn is_empty(&self) -> bool {
        self.all.is_empty() && self.crowd.is_empty()
    }

    /// One more contact; `before` are those kept of before.
    pub(super) fn touch(&mut self, library: &ObjectLibrary, before: &[Contact], contact: &Contact) {
        let Some(last) = before.last() else {
            self.crowd = Crowd::new(library, &self.rotations, contact);
            return;
        };
        let touch = Taken::new(library, last, contact);
        if contact.reached != Reached::Aimed {
            let apart = |other: &&Contact| (contact.position_m - other.position_m).norm();
            let nearest = before.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
            if let Some(nearest) = nearest {
                let pair = (nearest, contact);
                let (rotations, drift_m2) = (&self.rotations, touch.drift_m2);
                self.strangers.touch(library, rotations, pair, drift_m2);
            }
        }
        let mut looker = Looker::default();
        let mut parts = Vec::with_capacity(2 * self.all.len());
        let all = std::mem::take(&mut self.all);
        for own in all.chunk_by(|a, b| a.object == b.object) {
            if let Some(surface) = library.surface(own[0].object) {
                for own in own.chunk_by(|a, b| a.rotation == b.rotation) {
                    let rotation = &self.rotations[usize::from(own[0].rotation)];
                    let local = touch.feeling.at(surface, rotation);
                    for shift in own {
                        let lists = (&mut looker.nearby, &mut looker.answers);
                        self.explain(surface, shift, (&touch, &local), lists, &mut parts);
                    }
                }
            }
        }
        if !self.crowd.is_empty() {
            self.look(library, before, &touch, (&mut looker, &mut parts));
        }
        self.all = parts;
        self.merge();
        self.prune();
    }

    /// Lets a touch tell which of the crowd are worth a look, and looks at the heaviest of these.
    fn look(
        &mut self,
        library: &ObjectLibrary,
        before: &[Contact],
        touch: &Taken<'_>,
        (looker, parts): (&mut Looker, &mut Vec<Shift>),
    ) {
        let mut crowd = std::mem::take(&mut self.crowd);
        let worth = crowd.sift(library, &self.rotations, touch);
        let all = crowd.masses().map(|(_, log)| log);
        let all = log_sum(
            all.chain(parts.iter().map(|part| part.evidence))
                .collect::<Vec<_>>()
                .into_iter(),
        );
        let rough = ROUGH_MAX.saturating_sub(worth.len());
        let looks = (LOOKS_MAX * rough / ROUGH_MAX).max(LOOKS_MIN) / before.len();
        let mut heaviest = Vec::new();
        let is_time = before.len() >= WAITING_CONTACTS;
        if is_time || crowd.holding(&worth, all + WAITING.ln()) <= looks {
            let wanted = crowd.holding(&worth, all + UNLOOKED.ln());
            heaviest = crowd.heaviest(&worth, wanted.min(looks));
        }
        let first = Feeling::new(&before[0], library.wide());
        let way: Vec<Taken<'_>> = before
            .windows(2)
            .map(|two| Taken::new(library, &two[0], &two[1]))
            .collect();
        let way: Vec<&Taken<'_>> = way.iter().chain([touch]).collect();
        for root in &heaviest {
            let (root, known) = crowd.take(root, &self.rotations, &first);
            looker.follow(self, &known.surface, root, &way, parts);
        }
        let best = parts.iter().map(|part| part.evidence);
        let best = best.fold(crowd.best_log(), f64::max);
        let is_over = before.len() >= CROWD_CONTACTS;
        let least = if is_over { f64::INFINITY } else { best - BELOW };
        // The last hypothesis of an object stays.
        let mut held: Vec<ObjectId> = parts.iter().map(|part| part.object).collect();
        held.sort_unstable();
        for object in crowd.fading(least) {
            if held.binary_search(&object).is_ok() {
                continue;
            }
            for root in crowd.best_of(object, 1) {
                let (root, known) = crowd.take(&root, &self.rotations, &first);
                looker.follow(self, &known.surface, root, &way, parts);
            }
        }
        crowd.drop_below(least);
        self.crowd = crowd;
    }

    /// What becomes of a hypothesis with one more contact: one or more parts, each with its place taken for
    /// the one that was touched. The lists are to be used.
    fn explain(
        &self,
        surface: &Surface,
        shift: &Shift,
        (touch, local): (&Taken<'_>, &Local<'_>),
        (nearby, answers): (&mut Nearby, &mut Vec<Answer>),
        parts: &mut Vec<Shift>,
    ) {
        let rotation = &self.rotations[usize::from(shift.rotation)];
        let contact = touch.feeling.contact;
        let prior = shift.variance_m2 + touch.drift_m2;
        let noise = contact.position_sd_m * contact.position_sd_m;
        let query = Point3::from(rotation * contact.position_m.coords + shift.translation);
        let densities = nearby.answers(&surface.spots, &query, (prior, noise), local, answers);
        let one = share(surface.patches.len()) / TAU.powf(1.5);
        let outlier = touch.outlier / one;
        let total = outlier + densities;
        let least = PART_SHARE * total;
        answers.retain(|answer| answer.density >= least);
        if answers.len() > PARTS_MAX {
            answers.sort_by(|a, b| b.density.total_cmp(&a.density));
            answers.truncate(PARTS_MAX);
        }
        let best = answers.iter().map(|answer| answer.density);
        let evidence = shift.evidence + (one * total).ln();
        if best.fold(0.0, f64::max) < outlier {
            // Most likely an outlier: the hypothesis stays where it is.
            parts.push(Shift {
                variance_m2: prior,
                evidence,
                ..*shift
            });
            return;
        }
        let sum = answers.iter().map(|answer| answer.density).sum::<f64>();
        for Answer {
            density,
            apart,
            variance,
        } in answers
        {
            let gain = prior / (prior + *variance);
            parts.push(Shift {
                translation: shift.translation + gain * *apart,
                variance_m2: prior - gain * prior,
                evidence: evidence + (*density / sum).ln(),
                ..*shift
            });
        }
    }

    /// Makes one of hypotheses that have become the same, and puts them in order of object, rotation and place.
    fn merge(&mut self) {
        let mut keyed: Vec<_> = { self.all.iter() }
            .zip(0u32..)
            .map(|(shift, number)| (shift.key(), number))
            .collect();
        let evidence = |number: u32| self.all[number as usize].evidence;
        keyed.sort_unstable_by(|(a, one), (b, other)| {
            a.cmp(b)
                .then_with(|| evidence(*other).total_cmp(&evidence(*one)))
                .then(one.cmp(other))
        });
        let mut merged: Vec<Shift> = Vec::with_capacity(keyed.len());
        let mut last = None;
        for (key, number) in keyed {
            let shift = self.all[number as usize];
            match merged.last_mut() {
                Some(kept) if last == Some(key) => {
                    let sum = log_sum([kept.evidence, shift.evidence].into_iter());
                    let share = (shift.evidence - sum).exp();
                    kept.translation += (shift.translation - kept.translation) * share;
                    kept.evidence = sum;
                }
                _ => merged.push(shift),
            }
            last = Some(key);
        }
        self.all = merged;
    }

    /// Drops what holds no evidence, and the least beyond the budget; each object keeps its best.
    fn prune(&mut self) {
        let most = KEPT_MAX;
        let evidences = self.all.iter().map(|shift| shift.evidence);
        let best = evidences.clone().fold(self.crowd.best_log(), f64::max);
        let mut least = best - BELOW;
        let mut evidences: Vec<f64> = evidences.filter(|evidence| *evidence > least).collect();
        // How many of those that are exactly as heavy as the lightest have room.
        let mut room = usize::MAX;
        if evidences.len() > most {
            let (heavier, lightest, _) =
                evidences.select_nth_unstable_by(most - 1, |a, b| b.total_cmp(a));
            least = *lightest;
            room = most - heavier.iter().filter(|evidence| **evidence > least).count();
        }
        let mut kept = Vec::with_capacity(self.all.len().min(most));
        for own in self.all.chunk_by(|a, b| a.object == b.object) {
            let before = kept.len();
            for shift in own {
                let is_heavy = shift.evidence > least;
                let is_lightest = !is_heavy && shift.evidence >= least && room > 0;
                if is_heavy || is_lightest {
                    room -= usize::from(is_lightest);
                    kept.push(*shift);
                }
            }
            if kept.len() == before {
                kept.extend(own.iter().max_by(|a, b| a.evidence.total_cmp(&b.evidence)));
            }
        }
        self.all = kept;
    }

    /// Log of the mass of each object that has any.
    pub(super) fn object_logs(&self) -> BTreeMap<ObjectId, f64> {
        let own = self.all.chunk_by(|a, b| a.object == b.object).map(|own| {
            let logs = own.iter().map(|shift| shift.evidence);
            (own[0].object, log_sum(logs))
        });
        let mut sums: BTreeMap<ObjectId, f64> = BTreeMap::new();
        for (object, log) in own.chain(self.crowd.masses()) {
            let sum = sums.entry(object).or_insert(f64::NEG_INFINITY);
            *sum = log_sum([*sum, log].into_iter());
        }
        sums
    }

    /// How many hold a share of the mass of all, where that of an object is multiplied by e^`log`.
    pub(super) fn holding(&self, share: f64, log: impl Fn(ObjectId) -> Option<f64>) -> usize {
        let logs = self.object_logs();
        let all = logs
            .iter()
            .filter_map(|(object, own)| Some(own + log(*object)?));
        let all = log_sum(all);
        let log = |object| Some(log(object)? - all);
        let mut ranks = Ranks::new(self.crowd.len());
        for own in self.all.chunk_by(|a, b| a.object == b.object) {
            if let Some(log) = log(own[0].object) {
                for shift in own {
                    ranks.add(narrow((shift.evidence + log).exp()));
                }
            }
        }
        self.crowd.count(&mut ranks, log);
        ranks.holding(share * ranks.sum())
    }

    /// The heaviest hypotheses of an object, so many at most, heaviest first.
    pub(super) fn heaviest(&self, object: ObjectId, most: usize) -> Vec<Shift> {
        let own = self.all.iter().filter(|shift| shift.object == object);
        let crowd = self.crowd.best_of(object, most);
        let crowd = crowd
            .iter()
            .filter_map(|root| self.crowd.as_shift(root, &self.rotations));
        let mut all: Vec<Shift> = own.copied().chain(crowd).collect();
        all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
        all.truncate(most);
        all
    }
}

/// Lists that are filled again and again.
#[derive(Default)]
struct Looker {
    nearby: Nearby,
    answers: Vec<Answer>,
    now: Vec<Shift>,
    next: Vec<Shift>,
}

impl Looker {
    /// Lets a first place explain all contacts so far.
    fn follow(
        &mut self,
        shifts: &Shifts,
        surface: &Surface,
        root: Shift,
        way: &[&Taken<'_>],
        parts: &mut Vec<Shift>,
    ) {
        self.now.clear();
        self.now.push(root);
        let rotation = &shifts.rotations[usize::from(root.rotation)];
        for touch in way {
            self.next.clear();
            let local = touch.feeling.at(surface, rotation);
            for shift in &self.now {
                let touch = (*touch, &local);
                let lists = (&mut self.nearby, &mut self.answers);
                shifts.explain(surface, shift, touch, lists, &mut self.next);
            }
            if self.next.len() > PARTS_MAX {
                self.next.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
                self.next.truncate(PARTS_MAX);
            }
            std::mem::swap(&mut self.now, &mut self.next);
        }
        parts.extend_from_slice(&self.now);
    }
}

impl<'a> Taken<'a> {
    fn new(library: &'a ObjectLibrary, last: &Contact, contact: &'a Contact) -> Self {
        Self {
            feeling: Feeling::new(contact, library.wide()),
            drift_m2: (contact.drift_sd_m.powi(2) - last.drift_sd_m.powi(2)).max(0.0),
            outlier: OUTLIERS * library.elsewhere(),
        }
    }
}

/// Share of touches that are of one of so many places.
pub(super) fn share(places: usize) -> f64 {
    (1.0 - OUTLIERS) / places as f64
}

impl Shift {
    /// Its mean pose.
    pub(super) fn pose(&self, rotations: &[UnitQuaternion<f64>]) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(self.translation),
            rotations[usize::from(self.rotation)],
        )
    }

    /// Object, rotation and cell of the translation: hypotheses of the same are one.
    fn key(&self) -> u128 {
        /// Bits of a cell's number along an axis; cells that differ by more are far beyond any map.
        const BITS: u32 = 26;
        // Within a fifth of a deviation or so of one another, whose sum is one Gaussian again. The cell is the power of
        // two below, which is the exponent's bits alone, so that hypotheses of about the same width have the same cells.
        const EXPONENT: u64 = 0x7FF0_0000_0000_0000;
        let cell = 0.4 * self.variance_m2.sqrt().max(1e-12);
        let per_cell = 1.0 / f64::from_bits(cell.to_bits() & EXPONENT);
        #[expect(clippy::cast_possible_truncation, reason = "saturates")]
        let at = self.translation.map(|x| (x * per_cell).round() as i64);
        let map = u128::from(self.object.0) << 16 | u128::from(self.rotation);
        at.iter().fold(map, |key, at| {
            key << BITS | u128::from(at.cast_unsigned() & ((1 << BITS) - 1))
        })
    }
}

/// log Σ exp.
pub(super) fn log_sum(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + logs.map(|log| (log - most).exp()).sum::<f64>().ln()
}
