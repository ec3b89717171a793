//! Codes to recall places by, as good or as bad as asked for.

use cognitive_map::{CognitiveMap, PlaceId, RecallCue};
use grid::{PartialCode, Phase};
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// What is wrong with a code.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Damage {
    /// Standard deviation of the code's position from the place's, along each axis \[m\].
    pub jitter_m: f64,
    /// Standard deviation of Gaussian noise on each phase component \[turns\].
    pub phase_noise_turns: f64,
    /// The modules that are missing.
    pub erased: Vec<usize>,
}

/// Draws places at random, and makes a damaged code of each.
#[derive(Clone, Debug)]
pub struct CueSource(ChaCha8Rng);

/// A cue, and the position that its code was made at before it was damaged.
#[derive(Clone, Debug)]
pub struct DrawnCue {
    /// Asks for the one best place by code alone.
    pub cue: RecallCue,
    /// The true position, the shift from the place included.
    pub position: Point3<f64>,
}

impl CueSource {
    /// Sources of one seed and different streams are independent of each other, and of the places.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        // Stream 0 has strewn the places.
        random.set_stream(stream + 1);
        Self(random)
    }

    /// A cue for one of the map's places. `None` when there is none, or all modules are erased.
    pub fn draw(&mut self, map: &CognitiveMap, damage: &Damage) -> Option<DrawnCue> {
        let places = u32::try_from(map.place_count()).ok()?;
        if places == 0 {
            return None;
        }
        let place = map.place(PlaceId(self.0.random_range(0..places)))?;
        let position = place.position() + self.normal() * damage.jitter_m;
        let code = map.modules().code_at(&position);
        let phases = code.phases().iter().enumerate().map(|(module, phase)| {
            // Drawn for erased modules too, so that erasing changes nothing else.
            let noise = self.normal() * damage.phase_noise_turns;
            let known = !damage.erased.contains(&module);
            known.then(|| Phase::wrap(phase.turns() + noise))
        });
        let code = PartialCode::new(map.modules(), phases.collect()).ok()?;
        let cue = RecallCue {
            position: None,
            code: Some(code),
            percept: None,
            radius_m: None,
            founder: None,
            since_ns: None,
            until_ns: None,
            limit: 1,
        };
        Some(DrawnCue { cue, position })
    }

    fn normal(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.0.sample(StandardNormal))
    }
}
