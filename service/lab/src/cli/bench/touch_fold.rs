//! `cogmap-lab bench touch --fold`: touches as samples of an agent's episode.

use std::time::Instant;

use cogmap::cli::{output, quantile};
use cogmap_lab::objects::{EDGE_M, ExplorationNoise, Explorer, VoxelObject};
use cognitive_map::{
    AgentId, CognitiveMap, IndexingJob, InvalidSample, Label, Lesson, Level, ObjectMark, Record,
    Sample, SampleBody, Settings, Spacing, Touch, TouchLevel, TouchNoise,
};
use nalgebra::{Point3, Vector3};
use object_recognition::{Orientation, Verdict};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::Serialize;

/// Faces of an object, at least; each is a place.
const PLACES: usize = 1000;
/// Objects of the same kind that nobody teaches.
const STRANGERS: u32 = 8;
/// Episodes: walks and touches anywhere, on taught objects and on strangers, in turn.
const EPISODES: u32 = 24;
/// Touches of each.
const TOUCHES: usize = 30;
/// Runs of the same episode, of which the least time counts, so that other programs on the machine
/// disturb it little.
const RUNS: usize = 3;
/// Ranges of touches that are told apart, by the first and the last of each.
const RANGES: [(usize, usize); 4] = [(1, 1), (2, 5), (6, TOUCHES), (1, TOUCHES)];
const SEED: u64 = 1;
/// Standard deviation of a contact's position per axis \[m\].
const POSITION_SD_M: f64 = 0.05 * EDGE_M;
/// Standard deviation of a level, which goes from 0 to 1.
const LEVEL_SD: f64 = 0.1;
const CHANNEL: &str = "touch";
const INTERVAL_NS: i64 = 100_000_000;
const HAND: AgentId = AgentId(0);
/// First random streams of lessons and of episodes; those below are the objects'.
const TEACHING: u64 = 1 << 52;
const EXPLORING: u64 = 1 << 53;

#[derive(Debug, Serialize)]
struct Report {
    rows: Vec<Row>,
}

/// Time to apply the record of a touch, the episode's answer included.
#[derive(Debug, Serialize)]
struct Row {
    objects: u32,
    places: usize,
    first_touch: usize,
    last_touch: usize,
    ms_p50: f64,
    ms_p99: f64,
    ms_max: f64,
    /// Median of the yardstick: the distance from the contact to every place of all objects.
    scan_ms_p50: f64,
    #[serde(flatten)]
    answers: Answers,
}

/// What episodes say after their last touch.
#[derive(Clone, Copy, Debug, Default, Serialize)]
struct Answers {
    /// Episodes on taught objects.
    taught: u32,
    /// Those of them in which the object is recognised.
    recognised: u32,
    /// Episodes on strangers.
    strangers: u32,
    /// Those of them in which the object is unknown.
    unknown: u32,
}

/// What happens in an episode.
struct Exploration {
    /// Number of the object, if it was taught.
    taught: Option<usize>,
    touches: Vec<Level>,
}

/// Objects that a map was taught, and strangers.
struct Taught {
    objects: Vec<VoxelObject>,
    strangers: Vec<VoxelObject>,
    map: CognitiveMap,
    /// All places of the map \[m\], for the yardstick.
    places: Vec<[f32; 3]>,
}

pub(super) fn run(objects: &[u32], orientation: &Orientation, json: bool) -> anyhow::Result<()> {
    let mut rows = Vec::new();
    for &count in objects {
        output::progress(&format!("teaching {count} objects"));
        let taught = Taught::new(count)?;
        let known = taught.map.object_count();
        anyhow::ensure!(
            known == taught.objects.len(),
            "the map has {known} objects after {count} were taught"
        );
        rows.extend(taught.rows(count, orientation)?);
    }
    if json {
        return output::json(&Report { rows });
    }
    output::line("objects    places  touches   p50 [ms]   p99 [ms]   max [ms]   all places [ms]")?;
    for row in &rows {
        output::line(&format!(
            "{:>7} {:>9} {:>8} {:>10.3} {:>10.3} {:>10.3} {:>17.3}",
            row.objects,
            row.places,
            format!("{}-{}", row.first_touch, row.last_touch),
            row.ms_p50,
            row.ms_p99,
            row.ms_max,
            row.scan_ms_p50
        ))?;
        if row.last_touch == TOUCHES && row.first_touch == 1 {
            let Answers {
                taught,
                recognised,
                strangers,
                unknown,
            } = row.answers;
            output::line(&format!(
                "        recognised in {recognised} of {taught} episodes, unknown in {unknown} of \
                 {strangers} with strangers"
            ))?;
        }
    }
    Ok(())
}

impl Taught {
    fn new(count: u32) -> Result<Self, InvalidSample> {
        let object = |number: u32| VoxelObject::with_faces(SEED, number.into(), PLACES);
        let objects: Vec<VoxelObject> = (0..count).map(object).collect();
        let strangers = (count..count + STRANGERS).map(object).collect();
        let mut map = CognitiveMap::new(Settings::default());
        let mut events = Vec::new();
        let name = Label::new("hand")?;
        map.apply(&Record::Enrol { agent: HAND, name }, &mut events);
        for (number, object) in (0..count).zip(&objects) {
            let record = Record::TeachObject {
                number: number.into(),
                name: Label::new(&object_name(number as usize))?,
                lesson: lesson(object, number)?,
            };
            map.apply(&record, &mut events);
            events.clear();
        }
        let models = map.objects().flat_map(|(_, _, model)| model.places());
        let places = models.map(|place| narrow(&place.position_m)).collect();
        Ok(Self {
            objects,
            strangers,
            map,
            places,
        })
    }

    fn rows(&self, count: u32, orientation: &Orientation) -> Result<Vec<Row>, InvalidSample> {
        let mut times = vec![Vec::new(); TOUCHES];
        let mut scans = Vec::new();
        let mut answers = Answers::default();
        for episode in 0..EPISODES {
            output::progress(&format!("episode {} of {EPISODES}", episode + 1));
            let Exploration {
                taught,
                touches: samples,
            } = self.episode(episode)?;
            let mut least = [f64::INFINITY; TOUCHES];
            let mut least_scans = [f64::INFINITY; TOUCHES];
            for run in 0..RUNS {
                // A copy that shares no episode with another one.
                let mut map = self.map.clone();
                let mut hand = Hand::default();
                hand.send(&mut map, identify(orientation)?);
                for (sample, least) in samples.iter().zip(&mut least) {
                    let ms = hand.send(&mut map, SampleBody::Level(sample.clone()));
                    *least = least.min(ms);
                }
                for (sample, least) in samples.iter().zip(&mut least_scans) {
                    *least = least.min(self.scan_ms(sample));
                }
                if run == 0 {
                    answers.count(&map, taught);
                }
            }
            scans.extend(least_scans);
            for (times, least) in times.iter_mut().zip(least) {
                times.push(least);
            }
        }
        let scan_ms_p50 = quantile(&mut scans, 0.5);
        let rows = RANGES.map(|(first, last)| {
            let mut own = times[first - 1..last].concat();
            Row {
                objects: count,
                places: self.places.len(),
                first_touch: first,
                last_touch: last,
                ms_p50: quantile(&mut own, 0.5),
                ms_p99: quantile(&mut own, 0.99),
                ms_max: quantile(&mut own, 1.0),
                scan_ms_p50,
                answers,
            }
        });
        Ok(rows.into())
    }

    /// An episode, with its touches in a frame that begins at the first one.
    fn episode(&self, episode: u32) -> Result<Exploration, InvalidSample> {
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        random.set_stream(EXPLORING + u64::from(episode));
        let (is_walk, is_taught) = (episode.is_multiple_of(2), episode % 4 < 2);
        let all = if is_taught {
            &self.objects
        } else {
            &self.strangers
        };
        let number = random.random_range(0..all.len());
        let object = &all[number];
        let mut touches = Vec::with_capacity(TOUCHES);
        if is_walk {
            let noise = ExplorationNoise {
                value: LEVEL_SD,
                motion: 0.0,
            };
            let mut explorer = Explorer::new(object, noise, random);
            for _ in 0..TOUCHES {
                let felt = explorer.feel();
                touches.push((felt.position_m, felt.level));
                explorer.advance();
            }
            random = explorer.into_random();
        } else {
            let mut face = || &object.faces()[random.random_range(0..object.faces().len())];
            let first_m = face().position_m;
            let mut felt = |_| {
                let face = face();
                (face.position_m - first_m, face.level)
            };
            touches.extend((0..TOUCHES).map(&mut felt));
            for (_, level) in &mut touches {
                *level += LEVEL_SD * random.sample::<f64, _>(StandardNormal);
            }
        }
        let noisy = touches.into_iter().map(|(position_m, level)| {
            let error = Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal));
            let offset_m = position_m + POSITION_SD_M * error;
            Level::new(Label::new(CHANNEL)?, level, offset_m.into(), None)
        });
        Ok(Exploration {
            taught: is_taught.then_some(number),
            touches: noisy.collect::<Result<_, _>>()?,
        })
    }

    /// Milliseconds for the distance from a contact to every place.
    fn scan_ms(&self, sample: &Level) -> f64 {
        let at = narrow(&Point3::from(*sample.offset_m()));
        let begin = Instant::now();
        let squares = self.places.iter().map(|place| {
            let apart: [f32; 3] = std::array::from_fn(|axis| place[axis] - at[axis]);
            apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2]
        });
        std::hint::black_box(squares.fold(f32::INFINITY, f32::min));
        begin.elapsed().as_secs_f64() * 1e3
    }
}

impl Answers {
    /// Counts what the hand's episode in `map` says, of a taught object or of a stranger.
    fn count(&mut self, map: &CognitiveMap, taught: Option<usize>) {
        let verdict = map.episode(HAND).map(|(_, own)| own.posterior.verdict());
        let Some(number) = taught else {
            self.strangers += 1;
            self.unknown += u32::from(verdict == Some(Verdict::Unknown));
            return;
        };
        self.taught += 1;
        let name = object_name(number);
        let is_recognised = map.objects().any(|(id, known, _)| {
            known.name().as_str() == name && verdict == Some(Verdict::Object(id))
        });
        self.recognised += u32::from(is_recognised);
    }
}

fn object_name(number: usize) -> String {
    format!("object-{number}")
}

/// A contact with each face of an object.
fn lesson(object: &VoxelObject, number: u32) -> Result<Lesson, InvalidSample> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    random.set_stream(TEACHING + u64::from(number));
    let touches = object.faces().iter().map(|face| {
        let error: f64 = random.sample(StandardNormal);
        let level = face.level + LEVEL_SD * error;
        let level = TouchLevel::new(Label::new(CHANNEL)?, level, LEVEL_SD)?;
        let touch = Touch::new(face.position_m.into(), noise()?)?;
        Ok(touch.with_levels(vec![level]))
    });
    let touches: Result<Vec<Touch>, InvalidSample> = touches.collect();
    Ok(Lesson::new(Spacing::default(), touches?))
}

fn noise() -> Result<TouchNoise, InvalidSample> {
    TouchNoise::new(POSITION_SD_M, 0.0, LEVEL_SD)
}

fn identify(orientation: &Orientation) -> Result<SampleBody, InvalidSample> {
    Ok(SampleBody::Object(ObjectMark::Identify {
        orientation: orientation.clone(),
        noise: noise()?,
        learns: false,
    }))
}

fn narrow(position_m: &Point3<f64>) -> [f32; 3] {
    position_m.cast::<f32>().into()
}

/// What an agent sends.
#[derive(Default)]
struct Hand {
    seq: u64,
}

impl Hand {
    /// Milliseconds that the sample took in the fold, without what a thread of a service computes
    /// beside its writer.
    fn send(&mut self, map: &mut CognitiveMap, body: SampleBody) -> f64 {
        let (agent, session, seq) = (HAND, 1, self.seq);
        self.seq += 1;
        let stamp_ns = INTERVAL_NS * i64::try_from(self.seq).unwrap_or(i64::MAX);
        let record = Record::Sample {
            agent,
            session,
            seq,
            sample: Sample { stamp_ns, body },
        };
        let mut events = Vec::new();
        map.indexing(None).inspect(IndexingJob::run);
        let begin = Instant::now();
        map.apply(&record, &mut events);
        begin.elapsed().as_secs_f64() * 1e3
    }
}
