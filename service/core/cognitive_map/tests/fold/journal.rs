//! A robot that writes readable journals.

use cognitive_map::{
    AgentId, CognitiveMap, Descriptor, Event, EventKind, Label, Level, Marker, Motion, PoseNoise,
    Record, Relation, RelativePosition, Sample, SampleBody, Settings, SettingsValues, Sighting,
    SkipReason, StartPose, Target,
};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

pub(crate) fn label(text: &str) -> Label {
    Label::new(text).unwrap()
}

pub(crate) fn settings(change: impl FnOnce(&mut SettingsValues)) -> Settings {
    let mut values = SettingsValues::default();
    change(&mut values);
    Settings::new(values).unwrap()
}

/// Applies records and collects the events.
pub(crate) fn run(map: &mut CognitiveMap, records: &[Record]) -> Vec<Event> {
    let mut events = Vec::new();
    for record in records {
        map.apply(record, &mut events);
    }
    events
}

pub(crate) fn xyzw(rotation_vector: [f64; 3]) -> [f64; 4] {
    UnitQuaternion::from_scaled_axis(Vector3::from(rotation_vector))
        .coords
        .into()
}

pub(crate) fn motion(translation_m: [f64; 3], rotation_vector: [f64; 3]) -> SampleBody {
    let rotation = xyzw(rotation_vector);
    SampleBody::Motion(Motion::from_increment(translation_m, rotation, None).unwrap())
}

pub(crate) fn start_pose(translation_m: [f64; 3], rotation_vector: [f64; 3]) -> SampleBody {
    let rotation = xyzw(rotation_vector);
    SampleBody::StartPose(StartPose::new(translation_m, rotation, PoseNoise::none()).unwrap())
}

pub(crate) fn sighting(text: &str, translation_m: [f64; 3], sd_m: f64) -> SampleBody {
    let relation = Relation::Position(RelativePosition::new(translation_m, [sd_m; 3]).unwrap());
    SampleBody::Sighting(Sighting {
        target: Target::Landmark(label(text)),
        relation,
    })
}

pub(crate) fn marker(text: &str, ends_trip: bool) -> SampleBody {
    SampleBody::Marker(Marker {
        label: label(text),
        ends_trip,
    })
}

pub(crate) fn level(channel: &str, value: f64, offset_m: [f64; 3]) -> SampleBody {
    SampleBody::Level(Level::new(label(channel), value, offset_m, None).unwrap())
}

pub(crate) fn descriptor(channel: &str, vector: &[f32]) -> SampleBody {
    SampleBody::Descriptor(Descriptor::new(label(channel), vector).unwrap())
}

/// An agent that writes its samples straight into a map, ten a second.
pub(crate) struct Robot {
    pub(crate) id: AgentId,
    pub(crate) session: u64,
    pub(crate) seq: u64,
    pub(crate) stamp_ns: i64,
}

impl Robot {
    /// Enrols in the map.
    pub(crate) fn enrol(map: &mut CognitiveMap) -> Self {
        let id = AgentId(u32::try_from(map.agent_count()).unwrap());
        let name = label(&format!("robot-{}", id.0));
        map.apply(&Record::Enrol { agent: id, name }, &mut Vec::new());
        Self {
            id,
            session: 1,
            seq: 0,
            stamp_ns: 0,
        }
    }

    /// The next sample.
    pub(crate) fn sample(&mut self, map: &mut CognitiveMap, body: SampleBody) -> Vec<EventKind> {
        self.stamp_ns += 100_000_000;
        let sample = Sample {
            stamp_ns: self.stamp_ns,
            body,
        };
        let (agent, session, seq) = (self.id, self.session, self.seq);
        self.seq += 1;
        self.record(
            map,
            &Record::Sample {
                agent,
                session,
                seq,
                sample,
            },
        )
    }

    /// Moves in its body frame.
    pub(crate) fn go(
        &mut self,
        map: &mut CognitiveMap,
        translation_m: [f64; 3],
        rotation_vector: [f64; 3],
    ) -> Vec<EventKind> {
        self.sample(map, motion(translation_m, rotation_vector))
    }

    /// Goes straight ahead in equal steps.
    pub(crate) fn ahead(
        &mut self,
        map: &mut CognitiveMap,
        step_m: f64,
        n: usize,
    ) -> Vec<EventKind> {
        (0..n)
            .flat_map(|_| self.go(map, [step_m, 0.0, 0.0], [0.0; 3]))
            .collect()
    }

    /// Skips its next samples.
    pub(crate) fn skip(
        &mut self,
        map: &mut CognitiveMap,
        n: u64,
        reason: SkipReason,
    ) -> Vec<EventKind> {
        let (agent, session, from) = (self.id, self.session, self.seq);
        self.seq += n;
        self.record(
            map,
            &Record::Skip {
                agent,
                session,
                from,
                to: self.seq,
                reason,
            },
        )
    }

    fn record(&self, map: &mut CognitiveMap, record: &Record) -> Vec<EventKind> {
        let mut events = run(map, std::slice::from_ref(record));
        // Loops correct all agents of the map.
        let is_loop = |event: &Event| matches!(event.kind, EventKind::LoopsClosed(_));
        events.retain(|event| event.agent == self.id || !is_loop(event));
        assert!(events.iter().all(|event| event.agent == self.id));
        // Grid cells are entered all the time; the tests on events are about memory.
        let kinds = events.into_iter().map(|event| event.kind);
        kinds
            .filter(|kind| {
                let is_frequent = matches!(kind, EventKind::CellEntered { .. });
                !is_frequent && !matches!(kind, EventKind::EpisodeEnded { .. })
            })
            .collect()
    }

    pub(crate) fn pose(&self, map: &CognitiveMap) -> Isometry3<f64> {
        *map.agent(self.id).unwrap().pose()
    }

    pub(crate) fn position(&self, map: &CognitiveMap) -> Point3<f64> {
        self.pose(map).translation.vector.into()
    }
}
