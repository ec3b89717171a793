//! All objects learned, and each recognised again and again.

use std::num::NonZeroUsize;

use object_recognition::{Contact, ModelSettings, ObjectLibrary, ObjectModel};

use super::data_set::{Touch, TouchSet};
use super::episode::{Episode, TouchNoise, episode_random};
use crate::eval::object::{Ending, GoesOn, Rotate, Trace, in_parallel, object_id};

/// The channel of levels.
const CHANNEL: u16 = 0;
/// Touches of one object nearer than this are of one place \[m\]: what a fingertip cannot tell
/// apart.
const SPACING_M: f64 = 1e-3;
/// Least standard deviations that a recogniser is told: touches are written with four decimals of a
/// millimetre, and levels are whole numbers.
const POSITION_SD_MIN_M: f64 = 1e-4;
const LEVEL_SD_MIN: f64 = 0.1;

/// How objects are touched again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchProtocol {
    /// Noise of the touches. What is learned has none.
    pub noise: TouchNoise,
    /// Which turns the objects may have made since they were learned.
    pub rotate: Rotate,
    /// Whether touches say that they were drawn from the whole object. If not they count as found,
    /// as an agent's do; who asks over HTTP may say it.
    pub is_reach_told: bool,
    /// Explorations of each object.
    pub trials: u32,
    /// Most touches of an exploration.
    pub touches_max: usize,
    /// An answer is given as soon as its probability is this high.
    pub sure: f64,
    /// Seed of the order of touches, of noise and of where the object is.
    pub seed: u64,
}

/// An option that makes no sense.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidTouchProtocol {
    /// Noise.
    #[error("noise must be a finite number and not negative")]
    Noise,
    /// The number of explorations or touches.
    #[error("explorations and touches must be at least 1")]
    Trials,
    /// The certainty.
    #[error("the probability of an answer must be above one half and below 1")]
    Sure,
}

/// One exploration and what the recogniser said.
#[derive(Clone, Debug)]
pub struct TouchTrial {
    /// The object's number in the set.
    pub object: usize,
    /// What was felt.
    pub episode: Episode,
    /// What the recogniser said after each touch.
    pub trace: Trace,
}

/// Everything that was done with a set.
#[derive(Clone, Debug)]
pub struct TouchExperiment {
    pub(super) protocol: TouchProtocol,
    pub(super) names: Vec<String>,
    pub(super) trials: Vec<TouchTrial>,
}

impl TouchProtocol {
    /// # Errors
    /// Names the first option that makes no sense.
    pub fn check(&self) -> Result<(), InvalidTouchProtocol> {
        let noises = [self.noise.position_sd_m, self.noise.level_sd];
        if !noises.iter().all(|noise| (0.0..=1e6).contains(noise)) {
            return Err(InvalidTouchProtocol::Noise);
        }
        if self.trials == 0 || self.touches_max == 0 {
            return Err(InvalidTouchProtocol::Trials);
        }
        if !(self.sure > 0.5 && self.sure < 1.0) {
            return Err(InvalidTouchProtocol::Sure);
        }
        Ok(())
    }
}

impl TouchExperiment {
    /// Learns all objects and recognises each so often, on so many threads; only times depend on
    /// their number. `explored` is called after each exploration, and `clock` tells seconds from
    /// any moment on. Explorations go on after the answer.
    ///
    /// # Errors
    /// The protocol makes no sense.
    pub fn run(
        set: &TouchSet,
        protocol: &TouchProtocol,
        threads: NonZeroUsize,
        explored: &(impl Fn(u64) + Sync),
        clock: &(impl Fn() -> f64 + Sync),
    ) -> Result<Self, InvalidTouchProtocol> {
        protocol.check()?;
        let library = library(set);
        let count = set.objects().len() * protocol.trials as usize;
        let trials = in_parallel(count, threads, &|trial| {
            let number = trial / protocol.trials as usize;
            let trial = explore(set, number, protocol, trial as u64, &library, clock);
            explored(1);
            trial
        });
        let names = set.objects().iter().map(|object| object.name.clone());
        Ok(Self {
            protocol: *protocol,
            names: names.collect(),
            trials,
        })
    }

    /// Explorations in order: all of the first object, then all of the second.
    pub fn trials(&self) -> &[TouchTrial] {
        &self.trials
    }

    /// Name of an object.
    pub fn name(&self, object: usize) -> &str {
        &self.names[object]
    }
}

/// The objects as they were touched, by their numbers in the set.
fn library(set: &TouchSet) -> ObjectLibrary {
    let mut library = ObjectLibrary::default();
    for (number, object) in set.objects().iter().enumerate() {
        let mut model = ObjectModel::new(ModelSettings {
            spacing_m: SPACING_M,
            ..ModelSettings::default()
        });
        for touch in &object.touches {
            model.learn(&contact(touch, POSITION_SD_MIN_M, LEVEL_SD_MIN));
        }
        library.put(object_id(number), model);
    }
    library
}

fn explore(
    set: &TouchSet,
    number: usize,
    protocol: &TouchProtocol,
    stream: u64,
    library: &ObjectLibrary,
    clock: &impl Fn() -> f64,
) -> TouchTrial {
    let mut random = episode_random(protocol.seed, stream);
    let turn = protocol.rotate.draw(&mut random);
    let object = &set.objects()[number];
    let TouchProtocol {
        noise, touches_max, ..
    } = protocol;
    let episode = Episode::draw(object, turn, noise, *touches_max, &mut random);
    let position_sd_m = noise.position_sd_m.max(POSITION_SD_MIN_M);
    let level_sd = noise.level_sd.max(LEVEL_SD_MIN);
    let touches = episode.touches.iter();
    let trace = Trace::follow(
        library,
        &protocol.rotate.orientation(),
        touches.map(|touch| {
            let contact = contact(touch, position_sd_m, level_sd);
            // In random order, from anywhere to anywhere.
            if protocol.is_reach_told {
                contact.drawn()
            } else {
                contact
            }
        }),
        Some(object_id(number)),
        Ending {
            sure: protocol.sure,
            goes_on: GoesOn::ToTheEnd,
        },
        clock,
    );
    TouchTrial {
        object: number,
        episode,
        trace,
    }
}

fn contact(touch: &Touch, position_sd_m: f64, level_sd: f64) -> Contact {
    Contact::at(touch.position_m, position_sd_m).with_level(CHANNEL, touch.level, level_sd)
}
