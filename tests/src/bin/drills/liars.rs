//! Robots that lie: whatever valid samples say, numbers stay numbers.
//!
//! Thousands of runs go through the fold alone, where covariances and memories are looked at: they
//! are the property tests of the core. Hundreds go through the service, where no answer holds
//! `null` for a number.
//!
//! `COGMAP_DRILL_FOLDS` is the number of runs through the fold, 5000 when absent, and
//! `COGMAP_DRILL_LIARS` that of runs through the service, 200 when absent; `COGMAP_TEST_SEED`
//! repeats a failure of the latter. The core's tests say how theirs is repeated.

use std::process::Command;

use cogmap_proto::{
    Increment, Level, MotionNoise, Relation, Sample, SampleBody, Sighting, StartPose, Target,
};
use cogmap_tests::{Http, Server, batch, seed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};

/// Robots of a run, batches of each, and samples of a batch.
const ROBOTS: usize = 3;
const BATCHES: u64 = 3;
const BATCH: u64 = 40;

/// The drill.
pub(crate) fn liars() -> Value {
    let folds = count("COGMAP_DRILL_FOLDS", 5000);
    fold(folds);
    let runs = count("COGMAP_DRILL_LIARS", 200);
    let server = Server::start(&[]);
    let http = server.http();
    let first = seed(1);
    let (mut lost, mut answers) = (0, 0);
    for number in 0..runs {
        let run = Run::new(first.wrapping_add(number));
        let space = format!("/v1/spaces/run-{number}");
        assert!(http.put_json(&space, &json!({})).status < 300);
        run.lie(&http, &space);
        let (n_lost, n_answers) = check(&http, &space);
        (lost, answers) = (lost + n_lost, answers + n_answers);
        let gone = http.try_request(&ureq::http::Method::DELETE, &space, None);
        assert!(gone.is_ok_and(|gone| gone.status < 300));
        if number % 20 == 19 {
            eprintln!("liars: {} of {runs} runs", number + 1);
        }
    }
    json!({
        "folds": folds,
        "runs": runs,
        "robots_lost": lost,
        "answers_checked": answers,
    })
}

/// A number of the environment.
fn count(name: &str, absent: u64) -> u64 {
    let text = std::env::var(name).ok();
    text.and_then(|text| text.parse().ok()).unwrap_or(absent)
}

/// Runs the core's own tests of robots that lie.
fn fold(runs: u64) {
    // Set by the cargo that runs the drills.
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let status = Command::new(cargo)
        .args(["test", "--quiet", "--release"])
        .args(["--package", "cognitive_map", "--test", "lies"])
        .env("PROPTEST_CASES", runs.to_string())
        // Standard output is the report's.
        .stdout(std::io::stderr())
        .status();
    assert!(
        status.is_ok_and(|status| status.success()),
        "robots lied to the fold"
    );
}

/// A run: how absurd its robots are.
struct Run {
    random: ChaCha8Rng,
    reach_m: f64,
    orders: f64,
    labels: u32,
}

impl Run {
    fn new(seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        Self {
            reach_m: 10_f64.powf(random.random_range(-1.0..8.0)),
            orders: random.random_range(0.0..9.0),
            labels: random.random_range(1..10),
            random,
        }
    }

    /// Lets all robots say what they have to say.
    fn lie(mut self, http: &Http, space: &str) {
        for at in 0..BATCHES {
            for robot in 0..ROBOTS {
                let samples = (0..BATCH).map(|k| self.sample(at * BATCH + k)).collect();
                let batch = batch(1, at * BATCH, samples);
                let body = serde_json::to_value(&batch).expect("a batch is JSON");
                let path = format!("{space}/agents/robot-{robot}/samples");
                let answer = http.post_json(&path, &body);
                assert_eq!(answer.status, 200, "{answer:?}");
            }
        }
    }

    fn sample(&mut self, seq: u64) -> Sample {
        let body = match self.random.random_range(0..20) {
            0..8 => SampleBody::Increment(Increment {
                translation_m: self.point(),
                rotation_xyzw: self.rotation(),
                noise: self.random.random_bool(0.3).then(|| self.noise()),
            }),
            8..13 => {
                let number = self.random.random_range(0..self.labels);
                self.sighting(Target::Landmark(format!("post-{number}")))
            }
            13..16 => {
                let number = self.random.random_range(0..ROBOTS);
                self.sighting(Target::Agent(format!("robot-{number}")))
            }
            16 => {
                let back = self.random.random_range(0..50);
                self.sighting(Target::OwnSample(seq.saturating_sub(back)))
            }
            17 => SampleBody::StartPose(StartPose {
                translation_m: self.point(),
                rotation_xyzw: self.rotation(),
                noise: Some(self.noise()),
            }),
            _ => SampleBody::Level(Level {
                channel: "touch".to_owned(),
                value: 10_f64.powf(self.random.random_range(-300.0..300.0)),
                offset_m: self.point(),
                normal: None,
            }),
        };
        let stamp_ns = 100_000_000 * i64::try_from(seq).expect("few samples");
        Sample { stamp_ns, body }
    }

    fn sighting(&mut self, target: Target) -> SampleBody {
        let relation = match self.random.random_range(0..3) {
            0 => Relation::Position {
                translation_m: self.point(),
                sd_m: self.sds(),
            },
            1 => Relation::Pose {
                translation_m: self.point(),
                rotation_xyzw: self.rotation(),
                noise: self.noise(),
            },
            _ => Relation::RangeBearing {
                range_m: self.random.random_range(0.0..self.reach_m),
                azimuth_rad: self.random.random_range(-3.0..3.0),
                elevation_rad: self.random.random_range(-1.5..1.5),
                range_sd_m: self.sds()[0],
                bearing_sd_rad: self.sds()[0],
            },
        };
        SampleBody::Sighting(Sighting { target, relation })
    }

    fn point(&mut self) -> [f64; 3] {
        let reach_m = self.reach_m / 2.0;
        [(); 3].map(|()| self.random.random_range(-reach_m..reach_m))
    }

    fn rotation(&mut self) -> [f64; 4] {
        let [x, y, z, w] = [(); 4].map(|()| self.random.random_range(-1.0..1.0_f64));
        let norm = (x * x + y * y + z * z + w * w).sqrt().max(1e-6);
        [x, y, z, w].map(|part| part / norm)
    }

    fn sds(&mut self) -> [f64; 3] {
        [(); 3].map(|()| {
            let order = self.random.random_range(-1.0..1.0) * self.orders;
            (0.1 * 10_f64.powf(order)).min(1e8)
        })
    }

    fn noise(&mut self) -> MotionNoise {
        MotionNoise {
            translation_sd_m: self.sds(),
            rotation_sd_rad: self.sds(),
        }
    }
}

/// Reads everything of a space; answers how many robots are lost, and how many answers there were.
fn check(http: &Http, space: &str) -> (u64, u64) {
    let mut lost = 0;
    let mut paths: Vec<String> = ["/agents", "/landmarks", "/places", "/trips", "/objects"]
        .map(|path| format!("{space}{path}"))
        .into();
    paths.push(format!("{space}/export?format=json"));
    paths.push(format!("{space}/export?format=g2o"));
    for robot in 0..ROBOTS {
        let agent = format!("{space}/agents/robot-{robot}");
        let detail = http.get(&agent).json(200);
        lost += u64::from(detail["estimate"]["status"] == "lost");
        paths.extend([
            format!("{agent}/grid"),
            format!("{agent}/trajectory"),
            format!("{agent}/trajectory?kind=refined"),
        ]);
        paths.push(agent);
    }
    for path in &paths {
        let answer = http.get(path);
        assert!(answer.status < 500, "{path}: {answer:?}");
        if answer.content_type.contains("json") {
            let body = serde_json::from_str(&answer.body).expect("an answer is JSON");
            assert!(!has_hole(&body), "{path}: {}", answer.body);
        }
        let is_word = |word: &str| matches!(word, "NaN" | "inf" | "-inf");
        assert!(!answer.body.split_whitespace().any(is_word), "{path}");
    }
    (lost, paths.len() as u64)
}

/// Whether a list holds `null`, or a field whose name tells of a number.
fn has_hole(body: &Value) -> bool {
    let is_number = |name: &str| {
        let units = [
            "_m",
            "_rad",
            "_s",
            "_m2",
            "covariance",
            "confidence",
            "strength",
            "nis",
        ];
        units.iter().any(|unit| name.ends_with(unit))
    };
    match body {
        Value::Array(items) => items.iter().any(|item| item.is_null() || has_hole(item)),
        Value::Object(fields) => fields
            .iter()
            .any(|(name, value)| (value.is_null() && is_number(name)) || has_hole(value)),
        _ => false,
    }
}
