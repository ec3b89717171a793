//! Learning and trials.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::time::Duration;

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};
use object_recognition::{
    Contact, ModelSettings, ObjectId, ObjectLibrary, ObjectModel, Orientation, Posterior,
    Recognition, Verdict,
};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rand_distr::StandardNormal;

use super::cloud::Cloud;
use super::probe::{Exploration, Probe};
use super::report::{OneObject, Report, Rotation, Stop, quantile};
use super::symmetry;

/// Contacts before the recogniser is asked where to touch.
const BEFORE_ASKING: usize = 3;
/// Farthest start of an episode's frame from the object, per axis \[m\].
const OFFSET_M: f64 = 1.0;

/// What is evaluated.
#[derive(Clone, Debug)]
pub struct PointsSettings {
    /// How contacts of a trial come about.
    pub exploration: Exploration,
    /// Whether contacts say how they were come by. If not they count as found, as an agent's do;
    /// who asks over HTTP may say it.
    pub is_reach_told: bool,
    /// Contacts by which each object is learned.
    pub learned: usize,
    /// Standard deviation of a contact's position, per axis \[m\].
    pub noise_m: f64,
    /// Standard deviation of a contact's normal, per axis \[rad\].
    pub noise_rad: f64,
    /// Trials per object.
    pub trials: usize,
    /// Objects left out at a time, until each was left out once; 0 for no such trials.
    pub leave_out: usize,
    /// Contacts after which is looked, in order; the last ends a trial.
    pub looks: Vec<usize>,
    /// Seed.
    pub seed: u64,
}

impl Default for PointsSettings {
    fn default() -> Self {
        Self {
            exploration: Exploration::Independent,
            is_reach_told: false,
            learned: 1000,
            noise_m: 0.002,
            noise_rad: 2.0 * PI / 180.0,
            trials: 10,
            leave_out: 0,
            looks: vec![3, 5, 10, 20, 30, 60],
            seed: 1,
        }
    }
}

/// One trial.
struct Trial {
    truth: usize,
    /// At each look: most probable object, whether unknown is more probable, fit, rotation error.
    looks: Vec<Look>,
    stop: Option<(usize, Verdict)>,
    /// Of each contact with its answer.
    times_ms: Vec<f64>,
}

struct Look {
    first: Option<ObjectId>,
    unknown: bool,
    fit: f64,
    live: usize,
    rotation_rad: Option<f64>,
}

/// Learns all clouds and runs the trials, on as many threads as the machine has. `clock` tells the
/// time since any instant; `progress` is told how many trials of how many are done.
pub fn run(
    clouds: &[Cloud],
    settings: &PointsSettings,
    clock: &(dyn Fn() -> Duration + Sync),
    progress: &mut dyn FnMut(usize, usize),
) -> Report {
    let mut library = ObjectLibrary::default();
    let mut held = Vec::new();
    for (number, cloud) in (0u32..).zip(clouds) {
        let mut rng = generator(settings.seed, number, 0);
        let mut order: Vec<usize> = (0..cloud.points.len()).collect();
        order.shuffle(&mut rng);
        let learned = settings.learned.min(order.len() / 2);
        let mut model = ObjectModel::new(ModelSettings::default());
        for &at in &order[..learned] {
            model.learn(&felt(cloud, at, &Isometry3::identity(), settings, &mut rng));
        }
        library.put(ObjectId(number), model);
        order.drain(..learned);
        held.push(order);
    }
    let places = library
        .iter()
        .map(|(_, model)| model.places().len())
        .sum::<usize>();
    let scene = Scene {
        clouds,
        held: &held,
        settings,
        clock,
    };
    let group = settings.leave_out;
    let count = clouds.len() * settings.trials;
    let total = count * if group > 0 { 2 } else { 1 };
    let mut known = all(count, &mut |done| progress(done, total), &|number| {
        scene.one(&library, number % clouds.len(), number / clouds.len())
    });
    let mut left_out = Vec::new();
    if group > 0 {
        let others: Vec<_> = (0..clouds.len())
            .step_by(group)
            .map(|first| {
                let mut others = library.clone();
                for object in first..(first + group).min(clouds.len()) {
                    others.remove(ObjectId(number_of(object)));
                }
                others
            })
            .collect();
        left_out = all(
            count,
            &mut |done| progress(count + done, total),
            &|number| {
                let truth = number % clouds.len();
                scene.one(&others[truth / group], truth, number / clouds.len())
            },
        );
    }
    let mut times: Vec<f64> = known
        .iter_mut()
        .flat_map(|trial| std::mem::take(&mut trial.times_ms))
        .collect();
    let mut report = summary(clouds, settings, &known, &left_out, &mut times);
    report.places_mean = places as f64 / clouds.len() as f64;
    report
}

/// The trials of these numbers, in order. Each is by itself, so it does not matter which thread
/// runs it.
fn all(
    count: usize,
    progress: &mut dyn FnMut(usize),
    trial: &(dyn Fn(usize) -> Trial + Sync),
) -> Vec<Trial> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let (send, receive) = mpsc::channel();
    let mut trials: Vec<(usize, Trial)> = Vec::with_capacity(count);
    std::thread::scope(|scope| {
        for _ in 0..threads.min(count) {
            let (send, next) = (send.clone(), &next);
            scope.spawn(move || {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    if number >= count || send.send((number, trial(number))).is_err() {
                        break;
                    }
                }
            });
        }
        drop(send);
        for done in receive {
            trials.push(done);
            progress(trials.len());
        }
    });
    trials.sort_by_key(|(number, _)| *number);
    trials.into_iter().map(|(_, trial)| trial).collect()
}

/// What trials are made of.
struct Scene<'a> {
    clouds: &'a [Cloud],
    /// Points of each that were not learned.
    held: &'a [Vec<usize>],
    settings: &'a PointsSettings,
    clock: &'a (dyn Fn() -> Duration + Sync),
}

impl Scene<'_> {
    /// One trial with an object.
    fn one(&self, library: &ObjectLibrary, truth: usize, trial: usize) -> Trial {
        let cloud = &self.clouds[truth];
        let number = number_of(truth);
        let mut rng = generator(self.settings.seed, number, trial as u64 + 1);
        let rotation = {
            let mut normal = || rng.sample::<f64, _>(StandardNormal);
            UnitQuaternion::new_normalize(Quaternion::new(normal(), normal(), normal(), normal()))
        };
        let mut offset = || rng.random_range(-OFFSET_M..OFFSET_M);
        let translation = Translation3::new(offset(), offset(), offset());
        let object_from_episode = Isometry3::from_parts(translation, rotation);
        let episode_from_object = object_from_episode.inverse();
        let mut probe = Probe::new(cloud, &self.held[truth]);
        let mut recognition = Recognition::new(&Orientation::Free);
        let mut outcome = Trial {
            truth,
            looks: Vec::new(),
            stop: None,
            times_ms: Vec::new(),
        };
        let last = self.settings.looks.last().copied().unwrap_or(0);
        for count in 1..=last {
            let next = (self.settings.exploration == Exploration::Policy && count > BEFORE_ASKING)
                .then(|| recognition.next_touch(library))
                .flatten();
            let at = match (&next, self.settings.exploration) {
                (Some(next), _) => probe.asked(next, &object_from_episode),
                (None, Exploration::Walk) => probe.step(&mut rng),
                _ => probe.anywhere(&mut rng),
            };
            let mut contact = felt(cloud, at, &episode_from_object, self.settings, &mut rng);
            if self.settings.is_reach_told {
                contact = match (&next, self.settings.exploration) {
                    (Some(_), _) => contact.aimed(),
                    (None, Exploration::Walk) => contact,
                    (None, _) => contact.drawn(),
                };
            }
            let before = (self.clock)();
            recognition.touch(library, contact);
            let posterior = recognition.posterior(library);
            outcome
                .times_ms
                .push((self.clock)().saturating_sub(before).as_secs_f64() * 1e3);
            if outcome.stop.is_none() && posterior.verdict() != Verdict::Undecided {
                outcome.stop = Some((count, posterior.verdict()));
            }
            if self.settings.looks.contains(&count) {
                outcome.looks.push(look(
                    &posterior,
                    cloud,
                    number,
                    &object_from_episode,
                    self.settings,
                ));
            }
        }
        outcome
    }
}

fn look(
    posterior: &Posterior,
    cloud: &Cloud,
    truth: u32,
    object_from_episode: &Isometry3<f64>,
    settings: &PointsSettings,
) -> Look {
    let first = posterior.objects.first().map(|first| first.0);
    let pose = posterior
        .pose
        .as_ref()
        .filter(|pose| pose.object == ObjectId(truth));
    Look {
        first,
        unknown: posterior
            .objects
            .first()
            .is_none_or(|first| posterior.unknown > first.1),
        fit: posterior.fit,
        live: posterior.live_hypotheses,
        rotation_rad: pose.filter(|_| first == Some(ObjectId(truth))).map(|pose| {
            let tolerance_m = settings.noise_m;
            symmetry::error_rad(
                cloud,
                &pose.map_from_episode,
                object_from_episode,
                tolerance_m,
            )
        }),
    }
}

fn summary(
    clouds: &[Cloud],
    settings: &PointsSettings,
    known: &[Trial],
    left_out: &[Trial],
    times: &mut [f64],
) -> Report {
    let mut report = Report {
        objects: clouds.len(),
        trials: known.len(),
        left_out_trials: left_out.len(),
        places_mean: 0.0,
        top1_after: BTreeMap::new(),
        false_unknown_after: BTreeMap::new(),
        rotation_deg: BTreeMap::new(),
        unknown_caught: BTreeMap::new(),
        unknown_answered: BTreeMap::new(),
        stop: stop(settings, known),
        decision_ms_p50: quantile(times, 0.5),
        decision_ms_p99: quantile(times, 0.99),
        live_hypotheses: BTreeMap::new(),
        by_object: BTreeMap::new(),
        confusions: BTreeMap::new(),
    };
    for (at, &count) in settings.looks.iter().enumerate() {
        note_look(&mut report, (at, count), known, left_out);
    }
    report.by_object = by_object(clouds, known);
    report.confusions = confusions(clouds, known);
    report
}

/// Number of an object in the library.
fn id(truth: usize) -> Option<ObjectId> {
    u32::try_from(truth).ok().map(ObjectId)
}

/// The share of trials that are so.
fn share(trials: &[Trial], is: &dyn Fn(&Trial) -> bool) -> f64 {
    trials.iter().filter(|trial| is(trial)).count() as f64 / trials.len().max(1) as f64
}

/// What came of stopping at the first answer.
fn stop(settings: &PointsSettings, known: &[Trial]) -> Stop {
    let most = settings.looks.last().copied().unwrap_or(0);
    let contacts = known
        .iter()
        .map(|trial| trial.stop.map_or(most, |stop| stop.0) as f64);
    Stop {
        accuracy: share(known, &|trial| {
            let Some((_, Verdict::Object(object))) = trial.stop else {
                return false;
            };
            Some(object) == id(trial.truth)
        }),
        contacts_mean: contacts.sum::<f64>() / known.len().max(1) as f64,
        undecided: share(known, &|trial| trial.stop.is_none()),
    }
}

/// Notes what was found at a look, given its place among the looks and its number of contacts.
fn note_look(
    report: &mut Report,
    (at, count): (usize, usize),
    known: &[Trial],
    left_out: &[Trial],
) {
    let right = |trial: &Trial| trial.looks[at].first == id(trial.truth);
    report.top1_after.insert(count, share(known, &right));
    report
        .false_unknown_after
        .insert(count, share(known, &|trial| trial.looks[at].unknown));
    let live = known
        .iter()
        .map(|trial| trial.looks[at].live as f64)
        .sum::<f64>();
    report
        .live_hypotheses
        .insert(count, live / known.len().max(1) as f64);
    let errors = known
        .iter()
        .filter_map(|trial| trial.looks[at].rotation_rad);
    let mut errors: Vec<_> = errors.map(f64::to_degrees).collect();
    if !errors.is_empty() {
        let rotation = Rotation {
            p50: quantile(&mut errors, 0.5),
            p90: quantile(&mut errors, 0.9),
        };
        report.rotation_deg.insert(count, rotation);
    }
    if !left_out.is_empty() {
        let mut fits: Vec<_> = known.iter().map(|trial| trial.looks[at].fit).collect();
        let threshold = quantile(&mut fits, 0.02);
        let caught = share(left_out, &|trial| trial.looks[at].fit < threshold);
        report.unknown_caught.insert(count, caught);
        report
            .unknown_answered
            .insert(count, share(left_out, &|trial| trial.looks[at].unknown));
    }
}

/// How often one object was taken for another in the end.
fn confusions(clouds: &[Cloud], known: &[Trial]) -> BTreeMap<String, usize> {
    let mut confusions = BTreeMap::new();
    for trial in known {
        let first = trial.looks.last().and_then(|look| look.first);
        if first != id(trial.truth) {
            let name = first
                .and_then(|first| clouds.get(first.0 as usize))
                .map_or("none", |c| &c.name);
            *confusions
                .entry(format!("{} as {name}", clouds[trial.truth].name))
                .or_default() += 1;
        }
    }
    confusions
}

/// What was found of each object after the last contact.
fn by_object(clouds: &[Cloud], known: &[Trial]) -> BTreeMap<String, OneObject> {
    let id = |truth: usize| u32::try_from(truth).ok().map(ObjectId);
    let mut all = BTreeMap::new();
    for (truth, cloud) in clouds.iter().enumerate() {
        let looks = || {
            known
                .iter()
                .filter(|t| t.truth == truth)
                .filter_map(|t| t.looks.last())
        };
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let mut errors: Vec<_> = looks()
            .filter_map(|look| look.rotation_rad)
            .map(f64::to_degrees)
            .collect();
        let one = OneObject {
            top1: mean(
                looks()
                    .map(|look| f64::from(u8::from(look.first == id(truth))))
                    .collect(),
            ),
            rotation_deg_p50: quantile(&mut errors, 0.5),
            fit_mean: mean(looks().map(|look| look.fit).collect()),
        };
        all.insert(cloud.name.clone(), one);
    }
    all
}

/// An object's number.
fn number_of(object: usize) -> u32 {
    u32::try_from(object).unwrap_or(u32::MAX)
}

/// A noisy contact with a point of a cloud.
fn felt(
    cloud: &Cloud,
    at: usize,
    frame_from_object: &Isometry3<f64>,
    settings: &PointsSettings,
    rng: &mut ChaCha12Rng,
) -> Contact {
    let (point, normal) = cloud.points[at];
    let mut noise = |sd: f64| {
        let mut normal = || sd * rng.sample::<f64, _>(StandardNormal);
        Vector3::new(normal(), normal(), normal())
    };
    let point = frame_from_object * Point3::from(point.coords + noise(settings.noise_m));
    let normal = frame_from_object
        * Unit::new_normalize(normal.into_inner() + normal.cross(&noise(settings.noise_rad)));
    Contact::at(point, settings.noise_m).with_normal(normal, settings.noise_rad)
}

fn generator(seed: u64, object: u32, trial: u64) -> ChaCha12Rng {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    // Each trial has a stream of its own, so that neither the number of trials nor of objects
    // changes it.
    rng.set_stream((u64::from(object) << 32) | trial);
    rng
}
