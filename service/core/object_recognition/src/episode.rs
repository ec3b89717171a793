//! An episode: contacts come in, hypotheses gain and lose.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_1_PI, FRAC_PI_6, PI, TAU};

use nalgebra::{Isometry3, Matrix6, Translation3};

use super::asking::{NextTouch, RIVALS_MAX, Rival, next_touch};
use super::contact::{Contact, Reached};
use super::library::{ObjectId, ObjectLibrary};
use super::orientation::Orientation;
use super::poses::{Hypothesis as PoseHypothesis, Poses};
use super::posterior::{PoseEstimate, Posterior, entropy_nats};
use super::relief::Relief;
use super::shifts::{Shift, Shifts, log_sum};
use super::surface::Surface;
use geometry::{PoseCovariance, se3};

/// Contacts of an episode that are kept.
const CONTACTS_MAX: usize = 128;
/// A step reaches to twice the median step.
const REACH_PER_STEP: f64 = 2.0;
/// Prior probability that it is none of the objects.
const UNKNOWN_PRIOR: f64 = 0.1;
/// Per contact, how far below what a right map does the best of the wrong ones explains something that was
/// never learned, in deviations in depth and in both angles each.
const STRANGE_SD: f64 = 1.2;
/// Share of the mass that live hypotheses hold together.
const LIVE: f64 = 0.99;
/// Other poses that an answer names.
const OTHERS_MAX: usize = 24;

/// The state of one episode of recognition.
///
/// All work is bounded per touch: by the number of places of the library, and by budgets of hypotheses and of
/// poses tried.
#[derive(Clone, Debug)]
pub struct Recognition {
    contacts: Vec<Contact>,
    count: usize,
    /// Lengths of the steps between contacts that were found, in order of length.
    steps_m: Vec<f64>,
    /// Contacts that were drawn from the whole map, but for the first.
    drawn: usize,
    /// Contacts that were asked for.
    aimed: usize,
    hypotheses: Hypotheses,
}

#[derive(Clone, Debug)]
enum Hypotheses {
    Shifts(Shifts),
    Poses(Poses),
}

/// One hypothesis, whichever kind it is.
struct Mass {
    map_from_episode: Isometry3<f64>,
    covariance: Matrix6<f64>,
    /// Log of its mass.
    log: f64,
}

impl Recognition {
    /// An episode that begins.
    pub fn new(orientation: &Orientation) -> Self {
        let hypotheses = match orientation.rotations() {
            Some(rotations) => Hypotheses::Shifts(Shifts::new(rotations)),
            None => Hypotheses::Poses(Poses::default()),
        };
        Self {
            contacts: Vec::new(),
            count: 0,
            steps_m: Vec::new(),
            drawn: 0,
            aimed: 0,
            hypotheses,
        }
    }

    /// Takes in one contact.
    pub fn touch(&mut self, library: &ObjectLibrary, contact: Contact) {
        match (self.contacts.last(), contact.reached) {
            (_, Reached::Aimed) => self.aimed += 1,
            (None, _) => {}
            (Some(_), Reached::Drawn) => self.drawn += 1,
            (Some(last), Reached::Found) => {
                let step_m = (contact.position_m - last.position_m).norm();
                let at = self.steps_m.partition_point(|other| *other < step_m);
                self.steps_m.insert(at, step_m);
            }
        }
        self.count += 1;
        let (steps, reach_m) = (self.steps_m.len(), self.reach_m());
        let spread = (self.count - self.aimed) as f64;
        match &mut self.hypotheses {
            Hypotheses::Shifts(shifts) => shifts.touch(library, &self.contacts, &contact),
            Hypotheses::Poses(poses) => {
                let size_log = |surface: &Surface, relief: &Relief| {
                    found_log(surface, steps, reach_m) - spread * relief.area_m2.ln()
                };
                poses.touch(library, &contact, CONTACTS_MAX, &size_log);
            }
        }
        if self.contacts.len() >= CONTACTS_MAX {
            self.contacts.remove(0);
        }
        self.contacts.push(contact);
    }

    /// Contacts so far.
    pub fn contacts(&self) -> usize {
        self.count
    }

    /// What it says so far.
    pub fn posterior(&self, library: &ObjectLibrary) -> Posterior {
        let mut objects = self.object_logs(library);
        // A surface's errors are shared by the contacts near one another: those in a free pose, which is fitted to
        // them, are worth fewer independent ones.
        let best = objects.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let best = best.map(|&(object, _)| object);
        let worth = match (&self.hypotheses, best) {
            (Hypotheses::Poses(poses), Some(best)) => poses.worth(library, best),
            _ => 1.0,
        };
        let fit = self.fit(library, best);
        for (_, log) in &mut objects {
            *log *= worth;
        }
        let prior = (1.0 - UNKNOWN_PRIOR).ln() - (objects.len().max(1) as f64).ln();
        let mut none = UNKNOWN_PRIOR.ln();
        if self.is_empty() {
            // Too little was felt for any hypothesis: every object is as likely as any.
            for (_, log) in &mut objects {
                *log = prior;
            }
        } else {
            none += worth * self.none_log(library, best);
            let most = objects
                .iter()
                .map(|object| object.1)
                .fold(f64::NEG_INFINITY, f64::max);
            if matches!(self.hypotheses, Hypotheses::Poses(_)) {
                let strange = strange_log(fit, self.contacts.len());
                none = log_sum([none, UNKNOWN_PRIOR.ln() + most + prior + strange].into_iter());
            }
            let missed = self.missed();
            let unfound = none - UNKNOWN_PRIOR.ln() + missed.ln();
            for (_, log) in &mut objects {
                *log = prior + log_sum([*log + (1.0 - missed).ln(), unfound].into_iter());
            }
        }
        let total = log_sum(objects.iter().map(|object| object.1).chain([none]));
        for (_, log) in &mut objects {
            *log = (*log - total).exp();
        }
        let unknown = (none - total).exp();
        objects.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let pose = { objects.first() }.and_then(|(object, _)| self.pose(library, *object));
        Posterior {
            live_hypotheses: self.live_hypotheses(library),
            live_objects: objects.iter().filter(|object| object.1 > 0.01).count(),
            entropy_nats: entropy_nats(objects.iter().map(|object| object.1).chain([unknown])),
            objects,
            unknown,
            pose,
            contacts: self.count,
            fit,
        }
    }

    /// Probability that the right pose in a map that was learned is not among the hypotheses. Then the contacts are as
    /// much like that map as like something unknown.
    ///
    /// Shifts are looked for from every place of every map. Poses come from pairs of contacts that tell enough, and what
    /// one contact leaves out the next finds half of the time.
    fn missed(&self) -> f64 {
        match self.hypotheses {
            Hypotheses::Shifts(_) => 0.0,
            Hypotheses::Poses(_) => 0.5_f64.powf(self.count.saturating_sub(2) as f64),
        }
    }

    /// Whether there is no hypothesis yet.
    fn is_empty(&self) -> bool {
        match &self.hypotheses {
            Hypotheses::Shifts(shifts) => shifts.is_empty(),
            Hypotheses::Poses(poses) => poses.all.is_empty(),
        }
    }

    /// Log of each object's mass, in one measure.
    fn object_logs(&self, library: &ObjectLibrary) -> Vec<(ObjectId, f64)> {
        match &self.hypotheses {
            Hypotheses::Shifts(shifts) => {
                let logs = shifts.object_logs();
                let shares = self.shift_shares(library).into_iter();
                let log = |(object, share)| {
                    let own = logs.get(&object).copied();
                    (object, own.map_or(f64::NEG_INFINITY, |own| own + share))
                };
                shares.map(log).collect()
            }
            Hypotheses::Poses(_) => sums(library, &self.pose_logs(library)),
        }
    }

    /// What the mass of each object's shifts is multiplied by; logs.
    fn shift_shares(&self, library: &ObjectLibrary) -> BTreeMap<ObjectId, f64> {
        let reach_m = self.reach_m();
        let shares = library.surfaces().map(|(object, surface)| {
            let asked = self.aimed as f64 * surface.area_m2.ln();
            (
                object,
                asked + found_log(surface, self.steps_m.len(), reach_m),
            )
        });
        shares.collect()
    }

    /// Log of the mass of each pose, in one measure.
    fn pose_logs(&self, library: &ObjectLibrary) -> Vec<(ObjectId, f64)> {
        let Hypotheses::Poses(poses) = &self.hypotheses else {
            return Vec::new();
        };
        let logs = poses.all.iter().filter_map(|hypothesis| {
            let log = self.pose_log(library, hypothesis)?;
            Some((hypothesis.object, log))
        });
        logs.collect()
    }

    /// How many hypotheses hold `LIVE` of the mass of all.
    fn live_hypotheses(&self, library: &ObjectLibrary) -> usize {
        if let Hypotheses::Shifts(shifts) = &self.hypotheses {
            let shares = self.shift_shares(library);
            return shifts.holding(LIVE, |object| shares.get(&object).copied());
        }
        let mut logs = self.pose_logs(library);
        logs.sort_unstable_by(|a, b| b.1.total_cmp(&a.1));
        let all = log_sum(logs.iter().map(|(_, log)| *log));
        let mut sum = 0.0;
        let live = logs.iter().position(|(_, log)| {
            sum += (log - all).exp();
            sum >= LIVE
        });
        live.map_or(logs.len(), |at| at + 1)
    }

    fn pose_log(&self, library: &ObjectLibrary, hypothesis: &PoseHypothesis) -> Option<f64> {
        let surface = library.surface(hypothesis.object)?;
        let relief = surface.relief.as_ref()?;
        let count = (self.count - self.aimed) as f64;
        Some(
            hypothesis.evidence() - (8.0 * PI * PI).ln()
                + found_log(surface, self.steps_m.len(), self.reach_m())
                - count * relief.area_m2.ln(),
        )
    }

    /// The heaviest hypotheses of an object with their masses in one measure, heaviest first, so many at most.
    fn masses(&self, library: &ObjectLibrary, object: ObjectId, most: usize) -> Vec<Mass> {
        let Some(surface) = library.surface(object) else {
            return Vec::new();
        };
        match &self.hypotheses {
            Hypotheses::Shifts(shifts) => {
                let mass = |shift: Shift| {
                    let mut covariance = Matrix6::zeros();
                    let mut corner = covariance.fixed_view_mut::<3, 3>(0, 0);
                    corner.fill_diagonal(shift.variance_m2);
                    Mass {
                        map_from_episode: shift.pose(&shifts.rotations),
                        covariance,
                        log: shift.evidence,
                    }
                };
                { shifts.heaviest(object, most).into_iter() }
                    .map(mass)
                    .collect()
            }
            Hypotheses::Poses(poses) => {
                let own = poses.all.iter().filter(|pose| pose.object == object);
                let masses = own.filter_map(|hypothesis| {
                    let relief = surface.relief.as_ref()?;
                    let origin = Translation3::from(-poses.origin().coords);
                    let middle = Translation3::from(relief.middle);
                    let lever = se3::adjoint(&middle.into());
                    Some(Mass {
                        map_from_episode: middle * hypothesis.pose * origin,
                        covariance: lever
                            * hypothesis.information.try_inverse()?
                            * lever.transpose(),
                        log: self.pose_log(library, hypothesis)?,
                    })
                });
                let mut masses: Vec<_> = masses.collect();
                masses.sort_by(|a, b| b.log.total_cmp(&a.log));
                masses.truncate(most);
                masses
            }
        }
    }

    /// Log of the mass of all hypotheses of an object, in the measure of [`masses`](Self::masses).
    fn mass_log(&self, library: &ObjectLibrary, object: ObjectId) -> f64 {
        match &self.hypotheses {
            Hypotheses::Shifts(shifts) => {
                let log = shifts.object_logs().get(&object).copied();
                log.unwrap_or(f64::NEG_INFINITY)
            }
            Hypotheses::Poses(_) => {
                let logs = self.pose_logs(library);
                let own: Vec<f64> = { logs.iter() }
                    .filter(|(other, _)| *other == object)
                    .map(|(_, log)| *log)
                    .collect();
                log_sum(own.into_iter())
            }
        }
    }

    /// The most likely pose in one object, and those beside it.
    fn pose(&self, library: &ObjectLibrary, object: ObjectId) -> Option<PoseEstimate> {
        let masses = self.masses(library, object, OTHERS_MAX + 1);
        let all = self.mass_log(library, object);
        let (best, others) = masses.split_first()?;
        let share = |log: f64| (log - all).exp();
        let others = { others.iter() }
            .map(|mass| (mass.map_from_episode, share(mass.log)))
            .filter(|(_, share)| *share > 0.01);
        // From an error on the left of the pose to one on its right.
        let back = se3::adjoint(&best.map_from_episode.inverse());
        let covariance = back * best.covariance * back.transpose();
        Some(PoseEstimate {
            object,
            map_from_episode: best.map_from_episode,
            covariance: PoseCovariance::from_matrix(&((covariance + covariance.transpose()) * 0.5)),
            share: share(best.log),
            others: others.collect(),
        })
    }

    /// How well the best hypothesis of an object explains the contacts.
    fn fit(&self, library: &ObjectLibrary, object: Option<ObjectId>) -> f64 {
        let Hypotheses::Poses(poses) = &self.hypotheses else {
            return 0.0;
        };
        let own = poses.all.iter().filter(|h| Some(h.object) == object);
        let best = own.max_by(|a, b| a.score.total_cmp(&b.score));
        best.and_then(|best| poses.fit(library, best))
            .unwrap_or(0.0)
    }

    /// How far from a contact the next one was looked for \[m\].
    fn reach_m(&self) -> Option<f64> {
        let steps = self.steps_m.len();
        (steps > 0).then(|| REACH_PER_STEP * self.steps_m[steps / 2])
    }

    /// Log-likelihood of the contacts under something that was never learned, in the measure of the hypotheses. `best` is the
    /// object that it would be taken for.
    fn none_log(&self, library: &ObjectLibrary, best: Option<ObjectId>) -> f64 {
        let extent_m = library.extent_m().max(1e-6);
        let asked = -(self.aimed as f64) * extent_m.ln();
        let steps = self.steps_m.len() as f64;
        match &self.hypotheses {
            Hypotheses::Shifts(shifts) => {
                let shares = self.reach_m().map_or(0.0, |reach_m| {
                    let logs = library
                        .surfaces()
                        .map(|(_, s)| s.share(reach_m).max(1e-9).ln());
                    logs.sum::<f64>() / library.len().max(1) as f64
                });
                let stranger = best.and_then(|best| shifts.strangers.log(best));
                stranger.unwrap_or(0.0) - steps * shares + asked
            }
            // Of something of which only the size is known: anywhere within a step of the contact before, and any normal.
            Hypotheses::Poses(_) => {
                let ball = |radius_m: f64| (8.0 * FRAC_PI_6 * radius_m.powi(3)).ln();
                let found = self.reach_m().map_or(0.0, |reach_m| {
                    steps * ball(reach_m.min(0.5 * extent_m).max(1e-6))
                });
                let drawn = self.drawn as f64 * ball(0.5 * extent_m);
                -found - drawn - self.count as f64 * (4.0 * PI).ln() + asked
            }
        }
    }

    /// The touch that would tell most between the hypotheses that are live, if there are several; `None` where any
    /// touch will do, as after one that was asked for and before as many that were not.
    pub fn next_touch(&self, library: &ObjectLibrary) -> Option<NextTouch> {
        // Where maps differ most is also where one of them errs most. Contacts that come from anywhere keep both what
        // is asked and what is believed honest, so that no more than every other is asked for.
        if 2 * self.aimed >= self.count {
            return None;
        }
        let mut objects = self.object_logs(library);
        objects.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let all = log_sum(objects.iter().map(|object| object.1));
        let mut rivals = Vec::new();
        for (object, sum) in objects.into_iter().take(RIVALS_MAX) {
            let masses = self.masses(library, object, RIVALS_MAX);
            let own = self.mass_log(library, object);
            rivals.extend(masses.iter().map(|mass| Rival {
                object,
                map_from_episode: mass.map_from_episode,
                weight: (mass.log - own + sum - all).exp(),
            }));
        }
        next_touch(library, rivals, &self.contacts)
    }
}

/// Log of how much more likely this fit is of something that was never learned than of what was, after so many
/// contacts.
///
/// The fit of what was learned is a standard normal number g. That of anything else is g − x, where x is
/// a length in three dimensions (depth and two angles) of scale S = `STRANGE_SD` √contacts, Maxwell
/// distributed. With t = −fit S/√(1 + S²) the ratio of both densities is
/// √(2/π) ((t² + 1) √(2π) Φ(t) exp(t²/2) + t) (1 + S²)^(−3/2).
fn strange_log(fit: f64, contacts: usize) -> f64 {
    let scale2 = 1.0 + STRANGE_SD * STRANGE_SD * contacts as f64;
    // A fit above what is expected is no better a sign than the expected one.
    let t = -fit.min(0.0) * (1.0 - 1.0 / scale2).sqrt();
    // Φ(t) by Zelen and Severo's approximation (Abramowitz and Stegun 26.2.17), good to 1e-7.
    let k = 1.0 / (1.0 + 0.231_641_9 * t);
    let tail = k
        * (0.319_381_53
            + k * (-0.356_563_782
                + k * (1.781_477_937 + k * (-1.821_255_978 + k * 1.330_274_429))));
    let half = 0.5 * t * t;
    let fall = (-half).exp();
    // The factor exp(t²/2) stays a logarithm, since a bad fit is far below.
    let rest = (t * t + 1.0) * (TAU.sqrt() - tail * fall) + t * fall;
    half + ((2.0 * FRAC_1_PI).sqrt() * rest).ln() - 1.5 * scale2.ln()
}

/// Of contacts that were found within reach of the one before, the density is per part of the map within
/// reach.
fn found_log(surface: &Surface, steps: usize, reach_m: Option<f64>) -> f64 {
    let share = reach_m.map_or(0.0, |reach_m| surface.share(reach_m).max(1e-9).ln());
    -(steps as f64) * share
}

/// Log of each object's mass.
fn sums(library: &ObjectLibrary, logs: &[(ObjectId, f64)]) -> Vec<(ObjectId, f64)> {
    let mut sums: BTreeMap<ObjectId, (f64, f64)> = library
        .surfaces()
        .map(|(object, _)| (object, (f64::NEG_INFINITY, 0.0)))
        .collect();
    for (object, log) in logs {
        if let Some((most, _)) = sums.get_mut(object) {
            *most = most.max(*log);
        }
    }
    for (object, log) in logs {
        if let Some((most, sum)) = sums.get_mut(object) {
            *sum += (log - *most).exp();
        }
    }
    let sum = |(object, (most, sum)): (ObjectId, (f64, f64))| {
        let is_empty = most == f64::NEG_INFINITY;
        (object, if is_empty { most } else { most + sum.ln() })
    };
    sums.into_iter().map(sum).collect()
}
