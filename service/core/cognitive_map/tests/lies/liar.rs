//! Samples of robots that lie: each one valid, together absurd.

use cognitive_map::{
    AgentId, CognitiveMap, Descriptor, Event, Label, Level, Motion, ObjectMark, PoseNoise,
    RangeBearing, Record, Relation, RelativePose, RelativePosition, Sample, SampleBody, Sighting,
    Spacing, StartPose, Target, TouchNoise,
};
use nalgebra::{UnitQuaternion, Vector3};
use object_recognition::Orientation;

use random::Seeded;

/// How absurd the samples of a robot are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Temper {
    /// Labels of landmarks that it uses.
    pub(crate) labels: u32,
    /// Longest motion and farthest sighting \[m\].
    pub(crate) reach_m: f64,
    /// Decimal orders over which stated deviations are spread, down and up from a tenth.
    pub(crate) orders: f64,
    /// Whether it keeps to the plane.
    pub(crate) is_planar: bool,
    /// Whether it says more than motions and landmarks.
    pub(crate) is_versatile: bool,
}

/// A robot that lies.
pub(crate) struct Liar {
    pub(crate) id: AgentId,
    pub(crate) temper: Temper,
    session: u64,
    seq: u64,
    stamp_ns: i64,
}

pub(crate) fn label(text: &str) -> Label {
    Label::new(text).unwrap()
}

/// Name of a robot.
pub(crate) fn name_of(id: u32) -> Label {
    label(&format!("robot-{id}"))
}

impl Liar {
    /// Enrols in a map.
    pub(crate) fn enrol(map: &mut CognitiveMap, temper: Temper) -> Self {
        let id = AgentId(u32::try_from(map.agent_count()).unwrap());
        let name = name_of(id.0);
        map.apply(&Record::Enrol { agent: id, name }, &mut Vec::new());
        Self {
            id,
            temper,
            session: 1,
            seq: 0,
            stamp_ns: 0,
        }
    }

    /// Says a sample.
    pub(crate) fn say(&mut self, map: &mut CognitiveMap, body: SampleBody) -> Vec<Event> {
        let sample = Sample {
            stamp_ns: self.stamp_ns,
            body,
        };
        let record = Record::Sample {
            agent: self.id,
            session: self.session,
            seq: self.seq,
            sample,
        };
        self.seq += 1;
        let mut events = Vec::new();
        map.apply(&record, &mut events);
        events
    }

    /// A tenth of a second passes.
    pub(crate) fn wait(&mut self) {
        self.stamp_ns += 100_000_000;
    }

    /// Says anything.
    pub(crate) fn lie(&mut self, map: &mut CognitiveMap, random: &mut Seeded) -> Vec<Event> {
        self.wait();
        if self.temper.is_versatile && random.uniform() < 0.002 {
            self.session += 1;
            self.seq = 0;
        }
        let body = self.body(map, random);
        self.say(map, body)
    }

    fn body(&self, map: &CognitiveMap, random: &mut Seeded) -> SampleBody {
        let kind = random.uniform();
        if kind < 0.4 {
            return SampleBody::Motion(self.motion(random));
        }
        if !self.temper.is_versatile || kind < 0.7 {
            let number = index(random, self.temper.labels);
            let target = Target::Landmark(label(&format!("post-{number}")));
            return self.sighting(target, random);
        }
        if kind < 0.8 {
            let agents = u32::try_from(map.agent_count()).unwrap();
            let target = Target::Agent(name_of(index(random, agents)));
            return self.sighting(target, random);
        }
        if kind < 0.85 {
            let back = u64::from(index(random, 200));
            let target = Target::OwnSample(self.seq.saturating_sub(back));
            return self.sighting(target, random);
        }
        if kind < 0.87 {
            let (translation_m, rotation) = (self.point(random), self.rotation(random));
            let start = StartPose::new(translation_m, rotation, self.noise(random)).unwrap();
            return SampleBody::StartPose(start);
        }
        if kind < 0.88 {
            return SampleBody::Object(Self::mark(random));
        }
        if kind < 0.93 {
            let value = (random.uniform() - 0.5) * 10_f64.powf(300.0 * random.uniform());
            let level = Level::new(label("touch"), value, self.point(random), None).unwrap();
            return SampleBody::Level(level);
        }
        let scale = 10_f64.powf(20.0 * random.uniform() - 10.0);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a view needs no more digits"
        )]
        let view: Vec<f32> = (0..8)
            .map(|_| (scale * (random.uniform() - 0.5)) as f32)
            .collect();
        SampleBody::Descriptor(Descriptor::new(label("camera"), &view).unwrap())
    }

    fn mark(random: &mut Seeded) -> ObjectMark {
        let orientation = Orientation::Known;
        let noise = TouchNoise::new(0.002, 0.03, 0.1).unwrap();
        match index(random, 3) {
            0 => ObjectMark::Learn {
                name: Some(label("cup")),
                spacing: Spacing::default(),
                orientation,
                noise,
            },
            1 => ObjectMark::Identify {
                orientation,
                noise,
                learns: true,
            },
            _ => ObjectMark::End,
        }
    }

    fn motion(&self, random: &mut Seeded) -> Motion {
        let noise = (random.uniform() < 0.3).then(|| self.noise(random));
        Motion::from_increment(self.point(random), self.rotation(random), noise).unwrap()
    }

    fn sighting(&self, target: Target, random: &mut Seeded) -> SampleBody {
        let kind = random.uniform();
        let relation = if kind < 0.4 {
            Relation::RangeBearing(
                RangeBearing::new(
                    self.temper.reach_m * random.uniform(),
                    6.0 * random.uniform() - 3.0,
                    self.out_of_plane(3.0 * random.uniform() - 1.5),
                    self.sd(random),
                    self.sd(random),
                )
                .unwrap(),
            )
        } else if kind < 0.7 {
            let sd_m = [(); 3].map(|()| self.sd(random));
            Relation::Position(RelativePosition::new(self.point(random), sd_m).unwrap())
        } else {
            let (point, rotation) = (self.point(random), self.rotation(random));
            Relation::Pose(RelativePose::new(point, rotation, self.noise(random)).unwrap())
        };
        SampleBody::Sighting(Sighting { target, relation })
    }

    fn out_of_plane(&self, number: f64) -> f64 {
        if self.temper.is_planar { 0.0 } else { number }
    }

    fn point(&self, random: &mut Seeded) -> [f64; 3] {
        let reach_m = self.temper.reach_m / 3_f64.sqrt();
        let [x, y, z] = [(); 3].map(|()| reach_m * (2.0 * random.uniform() - 1.0));
        [x, y, self.out_of_plane(z)]
    }

    fn rotation(&self, random: &mut Seeded) -> [f64; 4] {
        let [x, y, z] = [(); 3].map(|()| 6.0 * random.uniform() - 3.0);
        let vector = Vector3::new(self.out_of_plane(x), self.out_of_plane(y), z);
        UnitQuaternion::from_scaled_axis(vector).coords.into()
    }

    fn noise(&self, random: &mut Seeded) -> PoseNoise {
        let translation_sd_m = [(); 3].map(|()| self.sd(random));
        PoseNoise::new(translation_sd_m, [(); 3].map(|()| self.sd(random))).unwrap()
    }

    /// A deviation, sometimes none at all.
    fn sd(&self, random: &mut Seeded) -> f64 {
        if random.uniform() < 0.05 {
            return 0.0;
        }
        let order = self.temper.orders * (2.0 * random.uniform() - 1.0);
        (0.1 * 10_f64.powf(order)).min(1e8)
    }
}

/// A number below `count`.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "it is below count"
)]
fn index(random: &mut Seeded, count: u32) -> u32 {
    (random.uniform() * f64::from(count)) as u32
}
