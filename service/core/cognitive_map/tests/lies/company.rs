//! Honest robots in the company of liars.

use cognitive_map::{
    CognitiveMap, Motion, PoseNoise, RangeBearing, Relation, SampleBody, Settings, Sighting,
    StartPose, Status, Target,
};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use crate::liar::{Liar, Temper, label};
use crate::sound;
use random::Seeded;

const POSTS: u32 = 12;
const STEP_M: f64 = 0.3;
const RANGE_SD_M: f64 = 0.1;
const BEARING_SD_RAD: f64 = 0.02;

/// Liars know the posts' names, and are as sure of themselves as good sensors.
const LIAR: Temper = Temper {
    labels: POSTS,
    reach_m: 5.0,
    orders: 0.5,
    is_planar: true,
    is_versatile: true,
};

/// A robot that drives in circles and says what it sees.
struct Honest {
    voice: Liar,
    truth: Isometry3<f64>,
    /// Heading per step \[rad\].
    turn_rad: f64,
    errors_m: Vec<f64>,
}

fn planar(x: f64, y: f64, heading: f64) -> Isometry3<f64> {
    Isometry3::new(Vector3::new(x, y, 0.0), Vector3::z() * heading)
}

fn xyzw(rotation: &UnitQuaternion<f64>) -> [f64; 4] {
    rotation.coords.into()
}

impl Honest {
    fn start(map: &mut CognitiveMap, truth: Isometry3<f64>, turn_rad: f64) -> Self {
        let mut voice = Liar::enrol(map, LIAR);
        let noise = PoseNoise::new([0.02, 0.02, 0.0], [0.0, 0.0, 0.01]).unwrap();
        let shift = truth.translation.vector.into();
        let start = StartPose::new(shift, xyzw(&truth.rotation), noise).unwrap();
        voice.say(map, SampleBody::StartPose(start));
        Self {
            voice,
            truth,
            turn_rad,
            errors_m: Vec::new(),
        }
    }

    /// Drives a step, and sees a post.
    fn go(&mut self, map: &mut CognitiveMap, posts: &[Point3<f64>], random: &mut Seeded) {
        self.voice.wait();
        let step = planar(STEP_M, 0.0, self.turn_rad);
        self.truth *= step;
        let read = planar(
            STEP_M * 1.01 + 0.01 * random.normal(),
            0.005 * random.normal(),
            self.turn_rad + 0.01 * random.normal(),
        );
        let noise = PoseNoise::new([0.02, 0.01, 0.0], [0.0, 0.0, 0.015]).unwrap();
        let shift = read.translation.vector.into();
        let motion = Motion::from_increment(shift, xyzw(&read.rotation), Some(noise)).unwrap();
        self.voice.say(map, SampleBody::Motion(motion));
        for (number, post) in posts.iter().enumerate() {
            let seen = self.truth.inverse_transform_point(post);
            let range_m = seen.coords.norm();
            if range_m > 6.0 || random.uniform() < 0.6 {
                continue;
            }
            let seen = RangeBearing::new(
                (range_m + RANGE_SD_M * random.normal()).max(0.0),
                seen.y.atan2(seen.x) + BEARING_SD_RAD * random.normal(),
                0.0,
                RANGE_SD_M,
                BEARING_SD_RAD,
            );
            let sighting = Sighting {
                target: Target::Landmark(label(&format!("post-{number}"))),
                relation: Relation::RangeBearing(seen.unwrap()),
            };
            self.voice.say(map, SampleBody::Sighting(sighting));
        }
        let pose = map.agent(self.voice.id).unwrap().pose();
        let off = pose.translation.vector - self.truth.translation.vector;
        self.errors_m.push(off.norm());
    }

    fn rmse_m(&self) -> f64 {
        let squares: f64 = self.errors_m.iter().map(|error| error * error).sum();
        (squares / self.errors_m.len() as f64).sqrt()
    }
}

/// What came of two honest robots beside some liars.
#[derive(Debug)]
struct Outcome {
    /// The worse root mean square error of the two \[m\].
    worst_m: f64,
    /// Rounds after which each liar was localised.
    localized: Vec<Vec<usize>>,
}

/// Two honest robots beside some liars, who leave what the honest ones draw as it is.
fn company(seed: u64, n_liars: usize) -> Outcome {
    let (mut random, mut lies) = (Seeded(seed), Seeded(!seed));
    let mut map = CognitiveMap::new(Settings::default());
    let posts: Vec<_> = (0..POSTS)
        .map(|_| {
            let [x, y] = [(); 2].map(|()| 12.0 * random.uniform() - 6.0);
            Point3::new(x, y, 0.0)
        })
        .collect();
    let mut honest = [
        Honest::start(&mut map, planar(3.0, 0.0, 1.57), 0.1),
        Honest::start(&mut map, planar(-3.0, 0.0, 1.57), -0.1),
    ];
    let mut liars: Vec<_> = (0..n_liars).map(|_| Liar::enrol(&mut map, LIAR)).collect();
    let mut localized = vec![Vec::new(); n_liars];
    for round in 0..250 {
        for robot in &mut honest {
            robot.go(&mut map, &posts, &mut random);
        }
        for (liar, localized) in liars.iter_mut().zip(&mut localized) {
            for _ in 0..4 {
                liar.lie(&mut map, &mut lies);
            }
            if map.status(liar.id) == Some(Status::Localized) {
                localized.push(round);
            }
        }
        if round % 10 == 0 {
            sound::check(&map).unwrap();
        }
    }
    sound::check_memory(&map).unwrap();
    for robot in &honest {
        assert_eq!(map.status(robot.voice.id), Some(Status::Localized));
    }
    Outcome {
        worst_m: honest.iter().map(Honest::rmse_m).fold(0.0, f64::max),
        localized,
    }
}

/// Rounds within which each liar has been contradicted often enough.
const CONTRADICTED: usize = 30;

#[test]
fn honest_robots_stay_localised_beside_liars_who_do_not() {
    for seed in [1, 6] {
        let (alone, beside) = (company(seed, 0), company(seed, 2));
        assert!(alone.worst_m < 0.06, "{seed}: {alone:?}");
        assert!(
            beside.worst_m < alone.worst_m + 0.03,
            "{seed}: {beside:?} {alone:?}"
        );
        for rounds in &beside.localized {
            let late = rounds.iter().filter(|&&round| round >= CONTRADICTED);
            assert_eq!(late.count(), 0, "{seed}: {beside:?}");
        }
    }
}
