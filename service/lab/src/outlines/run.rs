//! Objects taught and touched again, through the fold.

use std::f64::consts::PI;
use std::num::NonZeroUsize;

use cognitive_map::{
    AgentId, CognitiveMap, EventKind, InvalidSample, Label, Lesson, Level, Motion, ObjectMark,
    PoseNoise, Record, Sample, SampleBody, Settings, Spacing, Touch, TouchLevel, TouchNoise,
};
use nalgebra::{Quaternion, UnitQuaternion};
use object_recognition::{ObjectId, Orientation, Verdict};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::eval::object::in_parallel;

use super::explore::{gaussian, half_covered, lesson, walk};
use super::protocol::{OutlineProtocol, Teaching, Turn};
use super::report::{Answers, Report, Row};
use super::solid::{Felt, Solid};

/// The channel of levels.
const CHANNEL: &str = "touch";
/// Time between samples \[ns\].
const INTERVAL_NS: i64 = 100_000_000;
/// The agent that touches.
const HAND: AgentId = AgentId(0);
/// First random stream of explorations: those below are the objects'.
const EXPLORING: u64 = 1 << 40;

/// Teaches and touches again all sets of each protocol, so many protocols side by side. `explored`
/// is called after each exploration.
///
/// # Errors
/// A number is beyond what a sample may say.
pub fn run(
    protocols: &[OutlineProtocol],
    threads: NonZeroUsize,
    explored: &(impl Fn() + Sync),
) -> Result<Report, InvalidSample> {
    let row = |number: usize| run_row(&protocols[number], explored);
    let rows = in_parallel(protocols.len(), threads, &row).into_iter();
    Ok(Report {
        rows: rows.collect::<Result<_, _>>()?,
    })
}

fn run_row(protocol: &OutlineProtocol, explored: &impl Fn()) -> Result<Row, InvalidSample> {
    let mut row = Row {
        family: protocol.family,
        levels: protocol.levels,
        teaching: protocol.teaching,
        turn: protocol.turn,
        taught: protocol.taught,
        explorations: protocol.sets * protocol.objects,
        half_touches: 0.0,
        half: Answers::default(),
        looks: protocol
            .looks
            .iter()
            .map(|n| (*n, Answers::default()))
            .collect(),
        ever_unknown: 0,
        made_up: 0,
        strangers: Answers::default(),
        strangers_end: Answers::default(),
        strangers_learned: 0,
    };
    for set in 0..protocol.sets {
        let mut random = ChaCha8Rng::seed_from_u64(protocol.seed);
        random.set_stream(set as u64);
        let mut draw = || protocol.family.draw(protocol.levels, &mut random);
        let taught: Vec<Solid> = (0..protocol.objects).map(|_| draw()).collect();
        let strangers: Vec<Solid> = (0..protocol.objects).map(|_| draw()).collect();
        let map = teach(protocol, &taught, &mut random)?;
        for (number, solid) in taught.iter().chain(&strangers).enumerate() {
            let truth = taught.get(number).and_then(|_| u32::try_from(number).ok());
            let mut random = ChaCha8Rng::seed_from_u64(protocol.seed);
            random.set_stream(EXPLORING + (1000 * set + number) as u64);
            let trial = touch_again(protocol, &map, solid, truth.map(ObjectId), &mut random)?;
            row.add(truth.is_some(), &trial);
            explored();
        }
    }
    row.half_touches /= row.explorations.max(1) as f64;
    Ok(row)
}

/// What came of one exploration.
struct Trial {
    half_touches: usize,
    half: Answers,
    looks: Vec<Answers>,
    was_unknown: bool,
    learned: usize,
}

impl Row {
    fn add(&mut self, is_taught: bool, trial: &Trial) {
        if is_taught {
            self.half_touches += trial.half_touches as f64;
            self.half.add(&trial.half);
            for ((_, sum), own) in self.looks.iter_mut().zip(&trial.looks) {
                sum.add(own);
            }
            self.ever_unknown += usize::from(trial.was_unknown);
            self.made_up += trial.learned;
        } else {
            self.strangers.add(&trial.half);
            self.strangers_end
                .add(&trial.looks.last().copied().unwrap_or_default());
            self.strangers_learned += trial.learned;
        }
    }
}

impl Answers {
    fn add(&mut self, other: &Self) {
        self.right += other.right;
        self.first += other.first;
        self.wrong += other.wrong;
        self.unknown += other.unknown;
        self.unknown_first += other.unknown_first;
    }
}

/// A map that was taught these objects at once.
fn teach(
    protocol: &OutlineProtocol,
    solids: &[Solid],
    random: &mut ChaCha8Rng,
) -> Result<CognitiveMap, InvalidSample> {
    let mut map = CognitiveMap::new(Settings::default());
    let mut events = Vec::new();
    let name = Label::new("hand")?;
    map.apply(&Record::Enrol { agent: HAND, name }, &mut events);
    for (solid, number) in solids.iter().zip(0..) {
        let record = Record::TeachObject {
            number,
            name: Label::new(&format!("solid-{number}"))?,
            lesson: lesson_of(protocol, solid, random)?,
        };
        map.apply(&record, &mut events);
    }
    Ok(map)
}

/// A lesson of a solid that is drawn from the protocol's family.
///
/// # Errors
/// A number of the protocol is none that a sample may have.
pub fn drawn_lesson(
    protocol: &OutlineProtocol,
    random: &mut ChaCha8Rng,
) -> Result<Lesson, InvalidSample> {
    let solid = protocol.family.draw(protocol.levels, random);
    lesson_of(protocol, &solid, random)
}

/// The contacts by which a solid is taught.
fn lesson_of(
    protocol: &OutlineProtocol,
    solid: &Solid,
    random: &mut ChaCha8Rng,
) -> Result<Lesson, InvalidSample> {
    let noise = noise(protocol)?;
    let way = match protocol.teaching {
        Teaching::Everywhere => lesson(solid, protocol.taught, random),
        Teaching::Run => walk(solid, protocol.taught, protocol.step_m, random),
    };
    let touches = way.into_iter().map(|felt| {
        let felt = noisy(protocol, &felt, random);
        let level = TouchLevel::new(Label::new(CHANNEL)?, felt.level, protocol.level_sd)?;
        let touch = Touch::new(felt.position_m.into(), noise)?.with_levels(vec![level]);
        if protocol.normals {
            touch.with_normal(felt.normal.into_inner().into())
        } else {
            Ok(touch)
        }
    });
    let touches = touches.collect::<Result<_, _>>()?;
    Ok(Lesson::new(Spacing::default(), touches))
}

/// How an object has turned, and what the recogniser is told of it.
fn turned(turn: Turn, random: &mut ChaCha8Rng) -> (UnitQuaternion<f64>, Orientation) {
    match turn {
        Turn::None => (UnitQuaternion::identity(), Orientation::Known),
        Turn::Any => {
            let of: [f64; 4] = std::array::from_fn(|_| random.sample(StandardNormal));
            let turn = UnitQuaternion::new_normalize(Quaternion::from(of));
            (turn, Orientation::Free)
        }
        Turn::Yaw => {
            let yaw_rad = random.random_range(-PI..PI);
            let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, yaw_rad);
            (turn, Orientation::Yaw)
        }
    }
}

/// An agent's episode with one object, in a frame of its own.
fn touch_again(
    protocol: &OutlineProtocol,
    map: &CognitiveMap,
    solid: &Solid,
    truth: Option<ObjectId>,
    random: &mut ChaCha8Rng,
) -> Result<Trial, InvalidSample> {
    let last = protocol.looks.last().copied().unwrap_or_default();
    let (turn, orientation) = turned(protocol.turn, random);
    let way = walk(solid, last, protocol.step_m, random);
    let half_touches = half_covered(solid, &way, protocol.step_m, random);
    let mut map = map.clone();
    let mut hand = Hand::default();
    let noise = noise(protocol)?;
    hand.sample(
        &mut map,
        SampleBody::Object(ObjectMark::Identify {
            orientation,
            noise,
            learns: true,
        }),
    );
    let mut trial = Trial {
        half_touches,
        half: Answers::default(),
        looks: Vec::new(),
        was_unknown: false,
        learned: 0,
    };
    let mut before = way
        .first()
        .map_or_else(Default::default, |felt| felt.position_m);
    for (count, felt) in (1..).zip(&way) {
        let step = turn * (felt.position_m - before);
        before = felt.position_m;
        let (upright, exact) = ([0.0, 0.0, 0.0, 1.0], PoseNoise::none());
        let motion = Motion::from_increment(step.into(), upright, Some(exact))?;
        hand.sample(&mut map, SampleBody::Motion(motion));
        let noisy = noisy(protocol, felt, random);
        let offset = turn * (noisy.position_m - felt.position_m);
        let normal = protocol
            .normals
            .then(|| (turn * noisy.normal.into_inner()).into());
        let level = Level::new(Label::new(CHANNEL)?, noisy.level, offset.into(), normal)?;
        let events = hand.sample(&mut map, SampleBody::Level(level));
        trial.was_unknown |= events
            .iter()
            .any(|kind| matches!(kind, EventKind::ObjectUnknown));
        let is_look = protocol.looks.contains(&count);
        if is_look || count == half_touches {
            let answers = answers(&map, truth);
            if count == half_touches {
                trial.half = answers;
            }
            if is_look {
                trial.looks.push(answers);
            }
        }
    }
    let events = hand.sample(&mut map, SampleBody::Object(ObjectMark::End));
    let learned = |kind: &&EventKind| matches!(kind, EventKind::ObjectLearned { .. });
    trial.learned = events.iter().filter(learned).count();
    Ok(trial)
}

fn answers(map: &CognitiveMap, truth: Option<ObjectId>) -> Answers {
    let Some((_, identified)) = map.episode(HAND) else {
        return Answers::default();
    };
    let posterior = identified.posterior;
    let verdict = posterior.verdict();
    let best = posterior.objects.first();
    let is_right = |id: ObjectId| Some(id) == truth;
    Answers {
        right: usize::from(matches!(verdict, Verdict::Object(id) if is_right(id))),
        wrong: usize::from(matches!(verdict, Verdict::Object(id) if !is_right(id))),
        unknown: usize::from(verdict == Verdict::Unknown),
        first: usize::from(best.is_some_and(|(id, own)| is_right(*id) && *own > posterior.unknown)),
        unknown_first: usize::from(best.is_none_or(|(_, own)| *own <= posterior.unknown)),
    }
}

/// The contact with its noise.
fn noisy(protocol: &OutlineProtocol, felt: &Felt, random: &mut ChaCha8Rng) -> Felt {
    let across = gaussian(random) * protocol.normal_sd_rad;
    let level: f64 = random.sample(StandardNormal);
    Felt {
        position_m: felt.position_m + gaussian(random) * protocol.position_sd_m,
        normal: UnitQuaternion::from_scaled_axis(across) * felt.normal,
        level: felt.level + level * protocol.level_sd,
    }
}

fn noise(protocol: &OutlineProtocol) -> Result<TouchNoise, InvalidSample> {
    TouchNoise::new(
        protocol.position_sd_m,
        protocol.normal_sd_rad,
        protocol.level_sd,
    )
}

/// What an agent sends.
#[derive(Default)]
struct Hand {
    seq: u64,
}

impl Hand {
    fn sample(&mut self, map: &mut CognitiveMap, body: SampleBody) -> Vec<EventKind> {
        let (agent, session, seq) = (HAND, 1, self.seq);
        self.seq += 1;
        let stamp_ns = INTERVAL_NS * i64::try_from(self.seq).unwrap_or(i64::MAX);
        let sample = Sample { stamp_ns, body };
        let mut events = Vec::new();
        map.apply(
            &Record::Sample {
                agent,
                session,
                seq,
                sample,
            },
            &mut events,
        );
        events.into_iter().map(|event| event.kind).collect()
    }
}
