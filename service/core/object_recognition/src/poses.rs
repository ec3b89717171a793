//! Hypotheses where the rotation is free: poses that explain the contacts, several to a map.

use nalgebra::{Isometry3, Matrix6, Point3, Vector6};

use super::contact::{Contact, Reached};
use super::deviation;
use super::facet::Noise;
use super::library::{ObjectId, ObjectLibrary};
use super::pairs::{Pair, Pairs};
use super::relief::{Relief, Scene, local};
use super::strain::Strain;
use super::surface::Surface;
use geometry::se3;

/// Poses kept per map.
const KEPT_MAX: usize = 16;
/// Pairs of contacts looked up per map and touch, rarest first.
const PAIRS_MAX: usize = 16;
/// Fewest pairs of facets like a pair of contacts for it to be looked up.
const LIKE_MIN: usize = 4;
/// Poses tried per map and touch.
const TRIED_MAX: usize = 600;
/// Of the poses tried, those scored on more contacts.
const SIFTED_MAX: usize = 120;
/// Of those, the ones of which refining is begun.
const BEGUN_MAX: usize = 14;
/// Of those, the ones refined.
const REFINED_MAX: usize = 6;
/// Contacts of the first and second sieve.
const SIEVE: [usize; 2] = [4, 12];
/// Contacts by which a new pose is refined.
const REFINE_CONTACTS: usize = 20;
/// While a pose is rough, variances count this much more: three times the deviations.
const WIDE: f64 = 9.0;
/// Variances count so much more in each step of refining a new pose.
const STEPS: [f64; 5] = [9.0, 4.0, 2.0, 1.0, 1.0];
/// Until then every touch is followed by a search.
const EARLY: usize = 12;
/// Poses this far below the best are not refined at every touch \[nats\].
const LIVE: f64 = 12.0;
/// Maps this far below the best are searched at every eighth touch only \[nats\].
const FAR: f64 = 20.0;
/// Two poses are one when their distance, squared and in deviations, is below this.
const SAME: f64 = 6.0;
/// Variance of a log density that a contact's own noise makes: half a squared number of deviations, in depth
/// and both angles.
const NOISE_VARIANCE: f64 = 1.5;
/// Nearer than this no further pose is begun \[rad\].
const NEAR_RAD: f64 = 0.12;
/// And nearer than this part of the map's extent.
const NEAR_EXTENT: f64 = 0.05;

/// One hypothesis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hypothesis {
    pub(super) object: ObjectId,
    /// From the frame of the episode's first contact into the relief's.
    pub(super) pose: Isometry3<f64>,
    /// As [`super::relief::Explained::score`], over all contacts.
    pub(super) score: f64,
    pub(super) information: Matrix6<f64>,
}

impl Hypothesis {
    /// Log of the mass of poses about this one, m³: its peak's likelihood times its width.
    pub(super) fn evidence(&self) -> f64 {
        let log_det = self.information.cholesky().map_or(0.0, |cholesky| {
            2.0 * cholesky.l_dirty().diagonal().map(f64::ln).sum()
        });
        self.score - 0.5 * log_det + 3.0 * std::f64::consts::TAU.ln()
    }

    /// Whether another pose is so near that both would be refined to the same.
    fn near(&self, other: &Isometry3<f64>, extent_m: f64) -> bool {
        let apart = other.translation.vector - self.pose.translation.vector;
        self.pose.rotation.angle_to(&other.rotation) < NEAR_RAD
            && apart.norm() < NEAR_EXTENT * extent_m
    }

    /// Whether another hypothesis is the same, as far as the contacts tell.
    fn same(&self, other: &Self) -> bool {
        self.object == other.object && self.holds(&other.pose) && other.holds(&self.pose)
    }

    fn holds(&self, other: &Isometry3<f64>) -> bool {
        let (linear, angular) = se3::log(&(other * self.pose.inverse()));
        let twist = Vector6::new(
            linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
        );
        twist.dot(&(self.information * twist)) < SAME
    }
}

/// All hypotheses.
#[derive(Clone, Debug, Default)]
pub(super) struct Poses {
    origin: Option<Point3<f64>>,
    contacts: Vec<Contact>,
    count: usize,
    pub(super) all: Vec<Hypothesis>,
}

impl Poses {
    /// Where the frame of the hypotheses' poses lies in the episode's.
    pub(super) fn origin(&self) -> Point3<f64> {
        self.origin.unwrap_or_else(Point3::origin)
    }

    /// One more contact; of those before, `kept` are remembered. `size_log` is what the contacts' number says of a
    /// map of its size: what a score lacks of a log density.
    pub(super) fn touch(
        &mut self,
        library: &ObjectLibrary,
        contact: &Contact,
        kept: usize,
        size_log: &dyn Fn(&Surface, &Relief) -> f64,
    ) {
        let origin = *self.origin.get_or_insert(contact.position_m);
        if self.contacts.len() >= kept {
            self.contacts.remove(0);
        }
        let contact = local(contact, &origin);
        self.count += 1;
        for hypothesis in &mut self.all {
            if let Some((surface, relief)) = found(library, hypothesis.object) {
                hypothesis.score += relief.log(&hypothesis.pose, &contact, scene(library, surface));
            }
        }
        self.all
            .retain(|hypothesis| found(library, hypothesis.object).is_some());
        self.contacts.push(contact);
        if self.contacts.len() < 3 {
            return;
        }
        let tops: Vec<(f64, f64)> = library
            .surfaces()
            .map(|(object, surface)| {
                let own = self.all.iter().filter(|h| h.object == object);
                let most = own.map(|h| h.score).fold(f64::NEG_INFINITY, f64::max);
                let size_log = surface
                    .relief
                    .as_ref()
                    .map(|relief| size_log(surface, relief));
                (most + size_log.unwrap_or(0.0), size_log.unwrap_or(0.0))
            })
            .collect();
        let best = tops
            .iter()
            .map(|top| top.0)
            .fold(f64::NEG_INFINITY, f64::max);
        let rivals = tops.iter().filter(|top| top.0 > best - LIVE).count() > 1;
        let busy = rivals || self.count <= EARLY || self.count.is_multiple_of(4);
        let mut all = std::mem::take(&mut self.all);
        for (at, (object, surface)) in library.surfaces().enumerate() {
            let Some(relief) = &surface.relief else {
                continue;
            };
            let (mut own, others): (Vec<_>, Vec<_>) = all
                .into_iter()
                .partition(|hypothesis| hypothesis.object == object);
            all = others;
            let map = Map {
                object,
                relief,
                scene: scene(library, surface),
            };
            for (rank, hypothesis) in own.iter_mut().enumerate() {
                let turn = rank < 3 || (self.count + rank).is_multiple_of(4);
                if turn && hypothesis.score + tops[at].1 > best - LIVE {
                    self.refine(&map, hypothesis, &[1.0]);
                }
            }
            let near = busy && tops[at].0 > best - FAR;
            if own.is_empty() || near || (self.count + at).is_multiple_of(8) {
                self.search(&map, &mut own);
            }
            all.extend(kept_of(own));
        }
        self.all = all;
    }

    /// Moves a hypothesis nearer to all contacts, and scores it anew.
    fn refine(&self, map: &Map<'_>, hypothesis: &mut Hypothesis, steps: &[f64]) {
        let forgotten = self.count - self.contacts.len();
        let before = if forgotten > 0 {
            // What the forgotten contacts have said stays said.
            hypothesis.score - self.explain(map, &hypothesis.pose, 1.0).score
        } else {
            0.0
        };
        let mut pose = hypothesis.pose;
        for widen in steps {
            pose = self.explain(map, &pose, *widen).step(&pose);
        }
        let explained = self.explain(map, &pose, 1.0);
        if explained.score + before >= hypothesis.score - 0.5 || steps.len() > 1 {
            hypothesis.pose = pose;
            hypothesis.score = explained.score + before;
            hypothesis.information = explained.information;
        }
    }

    fn explain(
        &self,
        map: &Map<'_>,
        pose: &Isometry3<f64>,
        widen: f64,
    ) -> super::relief::Explained {
        let contacts = self.contacts.iter();
        map.relief.explain(pose, contacts, widen, map.scene)
    }

    /// Births: poses that lay a pair of contacts upon a pair of facets like it.
    fn search(&self, map: &Map<'_>, own: &mut Vec<Hypothesis>) {
        let noises: Vec<_> = self.contacts.iter().map(|c| Noise::of(c, WIDE)).collect();
        let first = spread(self.contacts.len(), SIEVE[0], self.count);
        let second = spread(self.contacts.len(), SIEVE[1], 0);
        let rough = |pose: &Isometry3<f64>, on: &[usize]| -> f64 {
            on.iter()
                .map(|&at| map.relief.rough(pose, &self.contacts[at], &noises[at]))
                .sum()
        };
        let mut tried: Vec<(f64, Isometry3<f64>)> = Vec::with_capacity(TRIED_MAX);
        for (pair, like) in self.pairs(&map.relief.pairs) {
            let room = TRIED_MAX - tried.len();
            let step = like.len().div_ceil((TRIED_MAX / 8).min(room).max(1)).max(1);
            for numbers in like.iter().step_by(step).take(room) {
                if let Some(pose) = Pairs::pair(&map.relief.facets, *numbers).onto(&pair) {
                    tried.push((rough(&pose, &first), pose));
                }
            }
            if tried.len() >= TRIED_MAX {
                break;
            }
        }
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        tried.truncate(SIFTED_MAX);
        for (score, pose) in &mut tried {
            *score = rough(pose, &second);
        }
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        // First steps of several, on few contacts; then the rest of the way with those that came nearest.
        let mut begun: Vec<(f64, Isometry3<f64>)> = Vec::with_capacity(BEGUN_MAX);
        let step = |pose: &Isometry3<f64>, on: &[usize], widen: f64| {
            let contacts = on.iter().map(|&at| &self.contacts[at]);
            let explained = map.relief.explain(pose, contacts, widen, map.scene);
            (explained.score, explained.step(pose))
        };
        for (_, pose) in &tried {
            if begun.len() >= BEGUN_MAX {
                break;
            }
            if own
                .iter()
                .any(|other| other.near(pose, map.relief.extent_m))
            {
                continue;
            }
            let alike = |begun: &(f64, Isometry3<f64>)| {
                begun.1.rotation.angle_to(&pose.rotation) < NEAR_RAD
                    && (begun.1.translation.vector - pose.translation.vector).norm()
                        < NEAR_EXTENT * map.relief.extent_m
            };
            if begun.iter().any(alike) {
                continue;
            }
            let (_, mut pose) = step(pose, &second, STEPS[0]);
            let score;
            (score, pose) = step(&pose, &second, STEPS[1]);
            begun.push((score, pose));
        }
        begun.sort_by(|a, b| b.0.total_cmp(&a.0));
        let on = spread(self.contacts.len(), REFINE_CONTACTS, 0);
        for (_, pose) in begun.into_iter().take(REFINED_MAX) {
            if own
                .iter()
                .any(|other| other.near(&pose, map.relief.extent_m))
            {
                continue;
            }
            let mut pose = pose;
            for widen in &STEPS[2..] {
                pose = step(&pose, &on, *widen).1;
            }
            let explained = self.explain(map, &pose, 1.0);
            // A birth was not there for the contacts that are forgotten: it is given the mean of those kept.
            let unseen = self.count as f64 / self.contacts.len() as f64;
            let born = Hypothesis {
                object: map.object,
                pose,
                score: explained.score * unseen,
                information: explained.information,
            };
            match own.iter_mut().find(|other| other.same(&born)) {
                Some(other) if other.score < born.score => *other = born,
                Some(_) => {}
                None => own.push(born),
            }
        }
    }

    /// Pairs of contacts and the facet pairs like them, the most telling first.
    fn pairs<'a>(&self, pairs: &'a Pairs) -> Vec<(Pair, &'a [[u16; 2]])> {
        let oriented: Vec<_> = self
            .contacts
            .iter()
            .filter_map(|c| Some((c.position_m, c.normal?)))
            .collect();
        let count = oriented.len();
        let mut found = Vec::new();
        // The newest with those before; and, as these are few at first, others.
        let with_newest = (1..count).map(|back| (count - 1, count - 1 - back));
        let others = (1..count).flat_map(|a| (0..a).map(move |b| (a, b)));
        let chosen: Vec<_> = with_newest
            .chain(others.filter(|(a, _)| *a + 1 < count))
            .collect();
        let step = chosen.len().div_ceil(64).max(1);
        for (a, b) in chosen.into_iter().step_by(step) {
            let pair = Pair {
                points: [oriented[a].0, oriented[b].0],
                normals: [oriented[a].1.into_inner(), oriented[b].1.into_inner()],
            };
            let like = pairs.like(&pair);
            // Of a pair like few or none, the like ones lie in the next bin more often than not.
            if like.len() >= LIKE_MIN {
                found.push((pair, like));
            }
        }
        found.sort_by_key(|(_, like)| like.len());
        found.truncate(PAIRS_MAX);
        found
    }

    /// How far below what is right a hypothesis explains the contacts, in deviations: by their densities, by what a strained
    /// map would explain better, and by whether those that were drawn lie on all of the map.
    pub(super) fn fit(&self, library: &ObjectLibrary, hypothesis: &Hypothesis) -> Option<f64> {
        let (surface, relief) = found(library, hypothesis.object)?;
        let scene = scene(library, surface);
        let met: Vec<_> = { self.contacts.iter() }
            .map(|contact| relief.meet(&hypothesis.pose, contact, scene))
            .collect();
        let (mean, sd) = relief.expected();
        let sum: f64 = met.iter().map(|met| met.log).sum();
        let count = self.contacts.len() as f64;
        let densities = (sum - count * mean) / ((count * self.shared(relief)).sqrt() * sd);
        let mut strain = Strain::new(relief.extent_m, relief.spacing_m);
        for height in met.iter().filter_map(|met| met.height) {
            strain.add(&height);
        }
        let drawn = { self.contacts.iter().zip(&met) }
            .filter(|(contact, met)| contact.reached == Reached::Drawn && met.share > 0.5)
            .map(|(contact, _)| hypothesis.pose * contact.position_m);
        let evenness = relief.halves.evenness(drawn);
        let strain = strain.deviation(relief.facets.len(), self.together(relief));
        let all = [Some(densities), strain, evenness];
        Some(deviation::together(all.into_iter().flatten()))
    }

    /// What a contact's evidence in this map is worth, against one whose errors are independent of all
    /// others'.
    pub(super) fn worth(&self, library: &ObjectLibrary, object: ObjectId) -> f64 {
        found(library, object).map_or(1.0, |(_, relief)| 1.0 / self.shared(relief))
    }

    /// How much wider the sum of the contacts' log densities scatters, as a variance, than if none shared an
    /// error with another: what their own noise makes of a log density is each contact's, the rest is the
    /// map's.
    fn shared(&self, relief: &Relief) -> f64 {
        let (_, sd) = relief.expected();
        let map = (1.0 - NOISE_VARIANCE / (sd * sd)).max(0.0);
        1.0 + map * (self.together(relief) - 1.0)
    }

    /// How many contacts, on average, are with a contact where the map errs alike, itself among them:
    /// Σ ρ / n.
    fn together(&self, relief: &Relief) -> f64 {
        let pairs = self.contacts.iter().enumerate().map(|(at, one)| {
            let alike = self.contacts[..at]
                .iter()
                .map(|other| relief.alike(one, other));
            alike.sum::<f64>()
        });
        1.0 + 2.0 * pairs.sum::<f64>() / self.contacts.len().max(1) as f64
    }
}

struct Map<'a> {
    object: ObjectId,
    relief: &'a Relief,
    scene: Scene<'a>,
}

fn scene<'a>(library: &'a ObjectLibrary, surface: &'a Surface) -> Scene<'a> {
    Scene {
        patches: &surface.patches,
        wide: library.wide(),
        elsewhere: library.elsewhere(),
    }
}

fn found(library: &ObjectLibrary, object: ObjectId) -> Option<(&Surface, &Relief)> {
    let surface = library.surface(object)?;
    Some((surface, surface.relief.as_ref()?))
}

/// The best of one map, each once.
fn kept_of(mut own: Vec<Hypothesis>) -> Vec<Hypothesis> {
    own.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<Hypothesis> = Vec::with_capacity(KEPT_MAX);
    for hypothesis in own {
        if kept.len() < KEPT_MAX && kept.iter().all(|other| !other.same(&hypothesis)) {
            kept.push(hypothesis);
        }
    }
    kept
}

/// So many of the first `len` numbers, evenly, beginning at `from`.
fn spread(len: usize, most: usize, from: usize) -> Vec<usize> {
    let count = most.min(len);
    (0..count).map(|k| (from + k * len / count) % len).collect()
}
