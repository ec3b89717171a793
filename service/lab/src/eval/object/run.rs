//! Learning by exploration, and recognising by exploration.

use std::num::NonZeroUsize;

use nalgebra::{Point3, Unit, UnitQuaternion};
use object_recognition::{Contact, ModelSettings, ObjectId, ObjectLibrary, ObjectModel};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::parallel::in_parallel;
use super::protocol::{InvalidObjectProtocol, Normals, ObjectProtocol};
use super::trace::{Ending, GoesOn, Trace};
use crate::objects::{EDGE_M, ExplorationNoise, Explorer, Felt, VoxelObject};

/// Standard deviation of where a contact is felt, per axis \[m\]: it is at the middle of a face,
/// and the recogniser is not told so.
const CONTACT_SD_M: f64 = 0.05 * EDGE_M;
/// Standard deviation of a normal's direction \[rad\].
const NORMAL_SD_RAD: f64 = 0.02;
/// Least standard deviation of a level that the recogniser is told: rounding.
const LEVEL_SD_MIN: f64 = 1e-3;
/// The channel of levels.
const CHANNEL: u16 = 0;
/// Touches of a visit. Each begins at the same face, as a hand begins at the handle, so that the
/// drift of one visit is all there is.
const VISIT_TOUCHES: usize = 100;
/// Learning is over when so many visits one after the other found no place that was new: one that
/// is missing looks like another object when it is touched.
const NOTHING_NEW_VISITS: usize = 3;
/// One exploration of an object that was never learned comes on so many of learned ones.
const LEARNED_PER_STRANGER: u32 = 4;
/// First random stream of learning, and of recognising: those below are the objects'.
const LEARNING: u64 = 1 << 40;
const RECOGNISING: u64 = 1 << 41;

/// Everything that was done with objects.
#[derive(Clone, Debug)]
pub struct ObjectExperiment {
    pub(super) protocol: ObjectProtocol,
    /// Places learned, over all objects.
    pub(super) places: usize,
    /// Touches made while learning, over all objects.
    pub(super) learning_touches: usize,
    /// Explorations of learned objects.
    pub(super) learned: Vec<(ObjectId, Trace)>,
    /// Explorations of objects that were never learned.
    pub(super) strangers: Vec<Trace>,
}

impl ObjectExperiment {
    /// Learns and recognises, on so many threads; only times depend on their number. `explored` is
    /// called after each exploration with the number of them, and `clock` tells seconds from any
    /// moment on.
    ///
    /// # Errors
    /// The protocol makes no sense.
    pub fn run(
        protocol: &ObjectProtocol,
        threads: NonZeroUsize,
        explored: &(impl Fn(u64) + Sync),
        clock: &(impl Fn() -> f64 + Sync),
    ) -> Result<Self, InvalidObjectProtocol> {
        protocol.check()?;
        let objects = in_parallel(protocol.objects as usize, threads, &|number| {
            let object = VoxelObject::new(protocol.seed, number as u64);
            let (model, touches) = learn(protocol, &object, number as u64);
            explored(1);
            (object, model, touches)
        });
        let mut library = ObjectLibrary::default();
        let (mut places, mut learning_touches) = (0, 0);
        let mut solids = Vec::with_capacity(objects.len());
        for ((object, model, touches), number) in objects.into_iter().zip(0..) {
            places += model.places().len();
            learning_touches += touches;
            library.put(object_id(number), model);
            solids.push(object);
        }
        let strangers = protocol.trials.div_ceil(LEARNED_PER_STRANGER);
        let trials = (protocol.trials + strangers) as usize;
        let mut traces = in_parallel(trials, threads, &|trial| {
            let learned = trial < protocol.trials as usize;
            let number = trial % solids.len();
            let truth = learned.then(|| object_id(number));
            let trace = if learned {
                recognise(protocol, &library, &solids[number], truth, trial, clock)
            } else {
                // Beyond the learned ones.
                let stranger = VoxelObject::new(protocol.seed, (solids.len() + trial) as u64);
                recognise(protocol, &library, &stranger, truth, trial, clock)
            };
            explored(1);
            (truth, trace)
        });
        let strangers = traces.split_off(protocol.trials as usize);
        let of_learned = |(truth, trace): (Option<ObjectId>, Trace)| Some((truth?, trace));
        Ok(Self {
            protocol: *protocol,
            places,
            learning_touches,
            learned: traces.into_iter().filter_map(of_learned).collect(),
            strangers: strangers.into_iter().map(|(_, trace)| trace).collect(),
        })
    }

    /// Explorations in all, of learning too, for those who watch.
    pub fn explorations(protocol: &ObjectProtocol) -> u64 {
        let strangers = protocol.trials.div_ceil(LEARNED_PER_STRANGER);
        u64::from(protocol.objects) + u64::from(protocol.trials) + u64::from(strangers)
    }
}

/// How the library calls the object of a number.
pub(crate) fn object_id(number: usize) -> ObjectId {
    ObjectId(u32::try_from(number).expect("there are few objects"))
}

/// Explores an object in visits until nothing new is found.
fn learn(protocol: &ObjectProtocol, object: &VoxelObject, number: u64) -> (ObjectModel, usize) {
    let mut model = ObjectModel::new(ModelSettings {
        spacing_m: EDGE_M / 2.0,
        ..ModelSettings::default()
    });
    let mut random = ChaCha8Rng::seed_from_u64(protocol.seed);
    random.set_stream(LEARNING + number);
    let mut touches = 0;
    let mut nothing_new = 0;
    while touches < protocol.learning_touches && nothing_new < NOTHING_NEW_VISITS {
        let before = model.places().len();
        let mut explorer = Explorer::from(object, protocol.noise, 0, random);
        for _ in 0..VISIT_TOUCHES.min(protocol.learning_touches - touches) {
            let felt = explorer.feel();
            model.learn(&contact(protocol, &felt, &UnitQuaternion::identity()));
            explorer.advance();
            touches += 1;
        }
        random = explorer.into_random();
        let is_new = model.places().len() > before;
        nothing_new = if is_new { 0 } else { nothing_new + 1 };
    }
    (model, touches)
}

/// Explores an object from a random face on, turned if it may be.
fn recognise(
    protocol: &ObjectProtocol,
    library: &ObjectLibrary,
    object: &VoxelObject,
    truth: Option<ObjectId>,
    trial: usize,
    clock: &impl Fn() -> f64,
) -> Trace {
    let mut random = ChaCha8Rng::seed_from_u64(protocol.seed);
    random.set_stream(RECOGNISING + trial as u64);
    let turn = protocol.rotate.draw(&mut random);
    let mut explorer = Explorer::new(object, protocol.noise, random);
    let contacts = (0..protocol.touches_max).map(|touch| {
        if touch > 0 {
            explorer.advance();
        }
        contact(protocol, &explorer.feel(), &turn)
    });
    let ending = Ending {
        sure: protocol.sure,
        goes_on: GoesOn::Never,
    };
    let orientation = protocol.rotate.orientation();
    Trace::follow(library, &orientation, contacts, truth, ending, clock)
}

/// What the recogniser is told of a contact, in a frame that is turned against the object's.
fn contact(protocol: &ObjectProtocol, felt: &Felt, turn: &UnitQuaternion<f64>) -> Contact {
    let ExplorationNoise { value, .. } = protocol.noise;
    let contact = Contact::at(Point3::from(turn * felt.position_m), CONTACT_SD_M)
        .with_drift(felt.drift_sd_m)
        .with_level(CHANNEL, felt.level, value.max(LEVEL_SD_MIN));
    match protocol.normals {
        Normals::Untold => contact,
        Normals::Told => {
            contact.with_normal(Unit::new_normalize(turn * felt.normal), NORMAL_SD_RAD)
        }
    }
}
