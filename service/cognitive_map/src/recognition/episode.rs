//! An episode: contacts come in, hypotheses gain and lose.

use std::f64::consts::FRAC_PI_6;

use nalgebra::{Matrix6, Point3, Unit, Vector3};

use super::contact::{Contact, Reached};
use super::library::{ObjectId, ObjectLibrary};
use super::orientation::Orientation;
use super::posterior::{PoseEstimate, Posterior, entropy_nats};
use super::shifts::{Shifts, log_sum};
use crate::geometry::PoseCovariance;

/// Contacts of an episode that are kept.
const CONTACTS_MAX: usize = 128;
/// A step reaches to twice the median step.
const REACH_PER_STEP: f64 = 2.0;
/// Prior probability that it is none of the objects.
const UNKNOWN_PRIOR: f64 = 0.01;
/// Other poses that an answer names.
const OTHERS_MAX: usize = 24;

/// A touch that would tell much.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NextTouch {
    /// Where to touch \[m\], in the episode's frame.
    pub point_m: Point3<f64>,
    /// From which side: the way to move on the approach, in the episode's frame.
    pub approach: Option<Unit<Vector3<f64>>>,
    /// Information expected from it \[nats\], at most.
    pub gain_nats: f64,
}

/// The state of one episode of recognition.
///
/// All work is bounded per touch: by the number of places of the library at the first, by a budget of
/// hypotheses after.
#[derive(Clone, Debug)]
pub struct Recognition {
    contacts: Vec<Contact>,
    count: usize,
    /// Lengths of the steps between contacts that were found, in order of length.
    steps_m: Vec<f64>,
    /// Contacts, but the first, that were asked for.
    aimed: usize,
    shifts: Shifts,
}

impl Recognition {
    /// An episode that begins.
    pub fn new(orientation: &Orientation) -> Self {
        let rotations = orientation.rotations().unwrap_or_default();
        Self {
            contacts: Vec::new(),
            count: 0,
            steps_m: Vec::new(),
            aimed: 0,
            shifts: Shifts::new(rotations),
        }
    }

    /// Takes in one contact.
    pub fn touch(&mut self, library: &ObjectLibrary, contact: Contact) {
        if let Some(last) = self.contacts.last() {
            match contact.reached {
                Reached::Found => {
                    let step_m = (contact.position_m - last.position_m).norm();
                    let at = self.steps_m.partition_point(|other| *other < step_m);
                    self.steps_m.insert(at, step_m);
                }
                Reached::Aimed => self.aimed += 1,
            }
        }
        self.shifts.touch(library, &self.contacts, &contact);
        self.count += 1;
        if self.contacts.len() < CONTACTS_MAX {
            self.contacts.push(contact);
        } else {
            // The oldest but one goes: the first anchors the episode.
            self.contacts.remove(1);
            self.contacts.push(contact);
        }
    }

    /// Contacts so far.
    pub fn contacts(&self) -> usize {
        self.count
    }

    /// What it says so far.
    pub fn posterior(&self, library: &ObjectLibrary) -> Posterior {
        let steps = self.steps_m.len();
        // A step that was found starts from the one before: it is among what lies within reach.
        let reach_m = (steps > 0).then(|| REACH_PER_STEP * self.steps_m[steps / 2]);
        let share_log = |object: ObjectId| {
            let Some(surface) = library.surface(object) else {
                return 0.0;
            };
            let found = reach_m.map_or(0.0, |reach_m| surface.share(reach_m).max(1e-9).ln());
            // Of one that was asked for only the distance counts: per metre, not per place.
            self.aimed as f64 * surface.area_m2.ln() - steps as f64 * found
        };
        let mut objects: Vec<(ObjectId, f64)> = library
            .surfaces()
            .map(|(object, _)| {
                let own = self
                    .shifts
                    .all
                    .iter()
                    .filter(|shift| shift.object == object);
                let evidence = log_sum(own.map(|shift| shift.evidence));
                (object, evidence + share_log(object))
            })
            .collect();
        let none = self.none_log(library, reach_m);
        let prior = (1.0 - UNKNOWN_PRIOR).ln() - (objects.len().max(1) as f64).ln();
        for (_, evidence) in &mut objects {
            *evidence += prior;
        }
        let none = none + UNKNOWN_PRIOR.ln();
        let total = log_sum(objects.iter().map(|object| object.1).chain([none]));
        for (_, evidence) in &mut objects {
            *evidence = (*evidence - total).exp();
        }
        let unknown = (none - total).exp();
        objects.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let pose = objects.first().and_then(|(object, _)| self.pose(*object));
        let mut masses: Vec<f64> = self
            .shifts
            .all
            .iter()
            .map(|shift| shift.evidence + share_log(shift.object))
            .collect();
        masses.sort_by(|a, b| b.total_cmp(a));
        let all = log_sum(masses.iter().copied());
        let mut sum = 0.0;
        let live = masses.iter().position(|mass| {
            sum += (mass - all).exp();
            sum >= 0.99
        });
        Posterior {
            live_hypotheses: live.map_or(masses.len(), |at| at + 1),
            live_objects: objects.iter().filter(|object| object.1 > 0.01).count(),
            entropy_nats: entropy_nats(objects.iter().map(|object| object.1).chain([unknown])),
            objects,
            unknown,
            pose,
            contacts: self.count,
            fit: 0.0,
        }
    }

    /// Log-likelihood of the contacts under something of which only the size is known: anywhere within a
    /// step of the one before, and any percept.
    fn none_log(&self, library: &ObjectLibrary, reach_m: Option<f64>) -> f64 {
        let extent_m = library.extent_m().max(1e-6);
        let found = reach_m.map_or(0.0, |reach_m| {
            let radius_m = reach_m.clamp(1e-6, 0.5 * extent_m);
            self.steps_m.len() as f64 * (8.0 * FRAC_PI_6 * radius_m.powi(3)).ln()
        });
        -found - self.aimed as f64 * extent_m.ln()
    }

    fn pose(&self, object: ObjectId) -> Option<PoseEstimate> {
        let own = || {
            self.shifts
                .all
                .iter()
                .filter(|shift| shift.object == object)
        };
        let all = log_sum(own().map(|shift| shift.evidence));
        let best = own().max_by(|a, b| a.evidence.total_cmp(&b.evidence))?;
        let pose = best.pose(&self.shifts.rotations);
        // Alike along all axes, so that it does not matter along which.
        let mut covariance = Matrix6::zeros();
        for axis in 0..3 {
            covariance[(axis, axis)] = best.variance_m2;
        }
        let share = |evidence: f64| (evidence - all).exp();
        let mut others: Vec<_> = own()
            .filter(|shift| !std::ptr::eq(*shift, best))
            .map(|shift| (shift.pose(&self.shifts.rotations), share(shift.evidence)))
            .filter(|(_, share)| *share > 0.01)
            .collect();
        others.sort_by(|a, b| b.1.total_cmp(&a.1));
        others.truncate(OTHERS_MAX);
        Some(PoseEstimate {
            object,
            map_from_episode: pose,
            covariance: PoseCovariance::from_matrix(&covariance),
            share: share(best.evidence),
            others,
        })
    }

    /// The touch that would tell most between the hypotheses that are live, if there are several.
    pub fn next_touch(&self, _library: &ObjectLibrary) -> Option<NextTouch> {
        None
    }
}
