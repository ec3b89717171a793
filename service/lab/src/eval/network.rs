//! A network of ways for benchmarks: a hall that is travelled along, across and at an angle.

use cognitive_map::{
    AgentId, CognitiveMap, InvalidSample, Label, Motion, PoseNoise, Record, Sample, SampleBody,
    Settings, SettingsValues, StartPose,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
/// Distance of neighbouring places before they are shifted \[m\]: beyond a field radius.
const SPACING_M: f64 = 0.4;
/// Largest shift of a place along each axis \[m\]: no two come within a field radius.
const SHIFT_M: f64 = 0.05;
/// Speed \[m/s\].
const SPEED_M_S: f64 = 0.5;

/// The map of a square hall in which a robot went along all rows, all columns, and at half a right
/// angle to them. It has at most as many places, and nearly three times as many ways.
///
/// # Errors
/// Never: positions are finite.
pub fn network(places: u32, seed: u64) -> Result<CognitiveMap, InvalidSample> {
    let edge = places.isqrt();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut shift = || (2.0 * random.random::<f64>() - 1.0) * SHIFT_M;
    let mut at = |column: u32, row: u32| {
        let along = |index: u32| f64::from(index) * SPACING_M;
        [along(column) + shift(), along(row) + shift(), 0.0]
    };
    let positions: Vec<Vec<_>> = (0..edge)
        .map(|row| (0..edge).map(|column| at(column, row)).collect())
        .collect();
    let position = |column: u32, row: u32| positions[row as usize][column as usize];
    let mut robot = Surveyor::new()?;
    for line in 0..edge {
        robot.go((0..edge).map(|step| position(step, line)))?;
    }
    for line in 0..edge {
        robot.go((0..edge).map(|step| position(line, step)))?;
    }
    for first in 0..edge {
        robot.go((0..edge - first).map(|step| position(first + step, step)))?;
    }
    for first in 1..edge {
        robot.go((0..edge - first).map(|step| position(step, first + step)))?;
    }
    Ok(robot.map)
}

/// A robot that goes from position to position, and its map.
struct Surveyor {
    map: CognitiveMap,
    seq: u64,
    stamp_s: f64,
}

impl Surveyor {
    fn new() -> Result<Self, InvalidSample> {
        let settings = Settings::new(SettingsValues {
            places_max: u32::MAX,
            legs_max: u32::MAX,
            ways_max: u32::MAX,
            // Its past is of no interest.
            keyframes_max: 64,
            ..SettingsValues::default()
        });
        let mut map = CognitiveMap::new(settings.expect("budgets may be as large"));
        let (agent, name) = (AgentId(0), Label::new("surveyor")?);
        map.apply(&Record::Enrol { agent, name }, &mut Vec::new());
        let (seq, stamp_s) = (0, 0.0);
        Ok(Self { map, seq, stamp_s })
    }

    /// Is put at the first position, and goes to all others in straight lines.
    fn go(&mut self, mut positions: impl Iterator<Item = [f64; 3]>) -> Result<(), InvalidSample> {
        let Some(mut at) = positions.next() else {
            return Ok(());
        };
        let put = StartPose::new(at, UPRIGHT, PoseNoise::none())?;
        self.sample(SampleBody::StartPose(put));
        let still = Motion::from_increment([0.0; 3], UPRIGHT, None)?;
        self.sample(SampleBody::Motion(still));
        for to in positions {
            let way = [to[0] - at[0], to[1] - at[1], 0.0];
            self.stamp_s += way[0].hypot(way[1]) / SPEED_M_S;
            let motion = Motion::from_increment(way, UPRIGHT, None)?;
            self.sample(SampleBody::Motion(motion));
            at = to;
        }
        Ok(())
    }

    fn sample(&mut self, body: SampleBody) {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "days fit into nanoseconds of 64 bits"
        )]
        let stamp_ns = (self.stamp_s * 1e9) as i64;
        let sample = Sample { stamp_ns, body };
        let record = Record::Sample {
            agent: AgentId(0),
            session: 1,
            seq: self.seq,
            sample,
        };
        self.seq += 1;
        self.map.apply(&record, &mut Vec::new());
    }
}
