//! Arbitrary journals.

use cognitive_map::{
    AgentId, Ball, Blockage, BlockageId, Blocked, Errand, Goal, Instruction, InvalidSample, Lesson,
    Level, Motion, ObjectMark, PlaceId, PoseNoise, Range, RangeBearing, Record, Recruitment,
    Relation, RelativePose, RelativePosition, Retrace, Reverse, RouteCost, Sample, SampleBody,
    Settings, Sighting, SkipReason, Spacing, StartPose, Target, Touch, TouchNoise, TripId,
};
use nalgebra::{Point3, Vector3};
use object_recognition::Orientation;
use proptest::prelude::*;

use crate::journal::{descriptor, label, level, marker, settings, xyzw};

/// One entry of an arbitrary journal, before it is given its numbers.
#[derive(Clone, Debug)]
enum Entry {
    Sample {
        agent: u32,
        pause_ms: i64,
        body: SampleBody,
    },
    Skip {
        agent: u32,
        ahead: u64,
        len: u64,
        reason: SkipReason,
    },
    NextSession {
        agent: u32,
    },
    /// The next instruction.
    Instruct(Instruction),
    /// Whatever, in whatever order.
    Junk(Record),
}

/// Arbitrary journals of up to three agents: mostly orderly, with sessions, gaps and nonsense.
pub(crate) fn journals() -> impl Strategy<Value = Vec<Record>> {
    prop::collection::vec(entries(), 0..120).prop_map(|entries| {
        let mut records: Vec<_> = (0..2)
            .map(|id| Record::Enrol {
                agent: AgentId(id),
                name: label(&format!("agent-{id}")),
            })
            .collect();
        let mut next = [(1u64, 0u64, 0i64); 3];
        let mut instructions = 0;
        for entry in entries {
            match entry {
                Entry::Sample {
                    agent,
                    pause_ms,
                    body,
                } => {
                    let (session, seq, stamp_ns) = &mut next[agent as usize];
                    *stamp_ns += pause_ms * 1_000_000;
                    let sample = Sample {
                        stamp_ns: *stamp_ns,
                        body,
                    };
                    let (agent, session) = (AgentId(agent), *session);
                    records.push(Record::Sample {
                        agent,
                        session,
                        seq: *seq,
                        sample,
                    });
                    *seq += 1;
                }
                Entry::Skip {
                    agent,
                    ahead,
                    len,
                    reason,
                } => {
                    let (session, seq, _) = &mut next[agent as usize];
                    let (from, to) = (*seq + ahead, *seq + ahead + len);
                    let (agent, session) = (AgentId(agent), *session);
                    records.push(Record::Skip {
                        agent,
                        session,
                        from,
                        to,
                        reason,
                    });
                    *seq = to.max(*seq);
                }
                Entry::NextSession { agent } => {
                    let (session, seq, stamp_ns) = &mut next[agent as usize];
                    (*session, *seq, *stamp_ns) = (*session + 1, 0, 0);
                }
                Entry::Instruct(instruction) => {
                    let number = instructions;
                    instructions += 1;
                    records.push(Record::Instruct {
                        number,
                        instruction,
                    });
                }
                Entry::Junk(record) => records.push(record),
            }
        }
        records
    })
}

/// Settings of either kind of recruitment, with budgets that are hit and others that are not.
pub(crate) fn any_settings() -> impl Strategy<Value = Settings> {
    let recruitment = prop_oneof![
        Just(Recruitment::Novelty),
        (0.0..=1.0).prop_map(|probability| Recruitment::Bernoulli { probability }),
    ];
    let places_max = prop::sample::select(vec![2, 3, 8, 2048]);
    let legs_max = prop::sample::select(vec![1, 2, 9, 65_536]);
    let ways_max = prop::sample::select(vec![1, 2, 7, 65_536]);
    let half_life = prop::sample::select(vec![1, 20, 1_000_000]);
    (
        any::<u64>(),
        1usize..=6,
        recruitment,
        (places_max, legs_max, ways_max, half_life),
    )
        .prop_map(|(seed, grid_modules, recruitment, budget)| {
            settings(|values| {
                values.seed = seed;
                values.grid_modules = grid_modules;
                values.recruitment = recruitment;
                (
                    values.places_max,
                    values.legs_max,
                    values.ways_max,
                    values.strength_half_life_samples,
                ) = budget;
            })
        })
}

fn entries() -> impl Strategy<Value = Entry> {
    // The third agent is enrolled only if junk happens to enrol it.
    let agent = prop::sample::select(vec![0u32, 0, 0, 0, 1, 1, 2]);
    let pause_ms = prop_oneof![20 => Just(100i64), 1 => Just(3_000), 1 => Just(0), 1 => -50i64..0];
    prop_oneof![
        40 => (agent.clone(), pause_ms, bodies())
            .prop_map(|(agent, pause_ms, body)| Entry::Sample { agent, pause_ms, body }),
        2 => (agent.clone(), 0u64..3, 0u64..4, reasons())
            .prop_map(|(agent, ahead, len, reason)| Entry::Skip { agent, ahead, len, reason }),
        1 => agent.prop_map(|agent| Entry::NextSession { agent }),
        3 => junk().prop_map(Entry::Junk),
        3 => instructions().prop_map(Entry::Instruct),
    ]
}

fn instructions() -> impl Strategy<Value = Instruction> {
    let place = || (0u32..8).prop_map(PlaceId);
    let trip = || (0u32..4).prop_map(TripId);
    let agent = || (0u32..3).prop_map(AgentId);
    let at = || prop::array::uniform3(-1.0..1.0f64).prop_map(Point3::from);
    let blocked = prop_oneof![
        place().prop_map(Blocked::Place),
        prop::array::uniform2(place()).prop_map(Blocked::Way),
        (at(), 0.0..0.5f64).prop_map(|(at, radius_m)| Blocked::Ball(Ball { at, radius_m })),
    ];
    let until_ns = prop::option::of(0..10_000_000_000_i64);
    let block = (0u64..4, blocked, until_ns).prop_map(|(id, blocked, until_ns)| {
        Instruction::Block(Blockage {
            id: BlockageId(id),
            blocked,
            until_ns,
        })
    });
    let goal = prop_oneof![
        place().prop_map(Goal::Place),
        at().prop_map(Goal::Position),
        (trip(), any::<bool>())
            .prop_map(|(trip, backward)| Goal::Retrace(Retrace { trip, backward })),
    ];
    let follow = (agent(), goal).prop_map(|(agent, goal)| {
        let errand = Errand {
            goal,
            cost: RouteCost::Length,
            reverse: Reverse::Allowed,
            avoid_places: vec![PlaceId(7)],
            avoid_regions: Vec::new(),
        };
        Instruction::Follow(agent, errand)
    });
    prop_oneof![
        3 => block,
        1 => (0u64..4).prop_map(|id| Instruction::Unblock(BlockageId(id))),
        6 => follow,
        1 => agent().prop_map(Instruction::StopFollowing),
        2 => trip().prop_map(Instruction::Pin),
        1 => trip().prop_map(Instruction::Unpin),
    ]
}

fn reasons() -> impl Strategy<Value = SkipReason> {
    prop::sample::select(vec![
        SkipReason::Lost,
        SkipReason::TimeBackwards,
        SkipReason::Invalid(InvalidSample::NumberOutOfRange),
    ])
}

fn junk() -> impl Strategy<Value = Record> {
    let number = || prop_oneof![0u64..5, Just(u64::MAX), Just(u64::MAX - 1)];
    let agent = || prop_oneof![0u32..4, Just(u32::MAX)].prop_map(AgentId);
    // A huge number would leave nothing to come after it, so those go to agents that do little
    // else.
    prop_oneof![
        2 => agent().prop_map(|agent| Record::Enrol { agent, name: label("late") }),
        2 => (agent(), 0u64..3, 0u64..200, 0i64..9, bodies())
            .prop_map(|(agent, session, seq, stamp_ns, body)| {
                Record::Sample { agent, session, seq, sample: Sample { stamp_ns, body } }
            }),
        1 => (2u32..4, number(), number(), bodies()).prop_map(|(agent, session, seq, body)| {
            let sample = Sample { stamp_ns: i64::MIN, body };
            Record::Sample { agent: AgentId(agent), session, seq, sample }
        }),
        1 => (0u64..4, "[a-c]", prop::array::uniform3(-1.0..1.0f64)).prop_map(|(number, name, at)| {
            let touch = Touch::new(at, TouchNoise::new(0.002, 0.03, 0.1).unwrap()).unwrap();
            let lesson = Lesson::new(Spacing::default(), vec![touch]);
            Record::TeachObject { number, name: label(&name), lesson }
        }),
        1 => (0u64..4, "[a-c]")
            .prop_map(|(number, name)| Record::ForgetObject { number, name: label(&name) }),
        1 => (2u32..4, number(), number(), number(), reasons())
            .prop_map(|(agent, session, from, to, reason)| {
                Record::Skip { agent: AgentId(agent), session, from, to, reason }
            }),
    ]
}

fn bodies() -> impl Strategy<Value = SampleBody> {
    let turn = || prop::array::uniform3(-0.5..0.5f64);
    let noise = || {
        prop::option::of((0.0..0.1f64, 0.0..0.1f64))
            .prop_map(|noise| noise.map(|(t, r)| PoseNoise::new([t; 3], [r; 3]).unwrap()))
    };
    let increment = (prop::array::uniform3(-0.3..0.3f64), turn(), noise())
        .prop_map(|(t, r, noise)| Motion::from_increment(t, xyzw(r), noise).unwrap());
    let still = Just(Motion::from_increment([0.0; 3], xyzw([0.0; 3]), None).unwrap());
    let far = prop::array::uniform3(-1e8..1e8f64)
        .prop_map(|t| Motion::from_increment(t, xyzw([0.0; 3]), None).unwrap());
    let velocity = (prop::array::uniform3(-1.0..1.0f64), turn(), 0.0..0.5f64)
        .prop_map(|(v, w, s)| Motion::from_velocity(v, w, s, None).unwrap());
    let value = prop_oneof![9 => any::<i16>().prop_map(f64::from), 1 => -f64::MAX..f64::MAX];
    let offset = prop_oneof![Just([0.0; 3]), prop::array::uniform3(-1.0..1.0f64)];
    let level = ("(touch|light)", value, offset)
        .prop_map(|(channel, value, offset)| level(&channel, value, offset));
    // What a surface feels like, at whatever distance and with whatever normal.
    let near = prop::array::uniform3(-0.1..0.1f64);
    let touched = (near, prop::array::uniform3(-1.0..1.0f64)).prop_map(|(offset, normal)| {
        let normal = Vector3::from(normal)
            .try_normalize(1e-3)
            .unwrap_or_else(Vector3::x);
        let felt = Level::new(label("touch"), 1.0, offset, Some(normal.into()));
        SampleBody::Level(felt.unwrap())
    });
    // Two sorts of camera, and one that shares its channel's label with levels.
    let vector = prop::collection::vec(-1.0..1.0f32, 8..10);
    let descriptor = ("(camera|light)", vector).prop_map(|(channel, mut vector)| {
        vector[0] += 2.0; // never the zero vector
        descriptor(&channel, &vector)
    });
    let start =
        (prop::array::uniform3(-2.0..2.0f64), turn(), 0.0..1.0f64).prop_map(|(t, r, sd)| {
            StartPose::new(t, xyzw(r), PoseNoise::new([sd; 3], [sd; 3]).unwrap()).unwrap()
        });
    let marker = any::<bool>().prop_map(|ends| marker("door", ends));
    prop_oneof![
        20 => increment.prop_map(SampleBody::Motion),
        5 => velocity.prop_map(SampleBody::Motion),
        2 => still.prop_map(SampleBody::Motion),
        1 => far.prop_map(SampleBody::Motion),
        5 => level,
        5 => touched,
        5 => descriptor,
        4 => sightings().prop_map(SampleBody::Sighting),
        1 => start.prop_map(SampleBody::StartPose),
        1 => marker,
        2 => object_marks().prop_map(SampleBody::Object),
    ]
}

fn object_marks() -> impl Strategy<Value = ObjectMark> {
    let noise = || TouchNoise::new(0.002, 0.03, 0.1).unwrap();
    let orientation = prop::sample::select(vec![
        Orientation::Known,
        Orientation::cube(),
        Orientation::Free,
        Orientation::Yaw,
    ]);
    let name = prop::option::of("[a-c]");
    prop_oneof![
        2 => (name, orientation.clone()).prop_map(move |(name, orientation)| ObjectMark::Learn {
            name: name.map(|name| label(&name)),
            spacing: Spacing::new(0.1).unwrap(),
            orientation,
            noise: noise(),
        }),
        2 => (orientation, any::<bool>()).prop_map(move |(orientation, learns)| {
            let noise = noise();
            ObjectMark::Identify { orientation, noise, learns }
        }),
        1 => Just(ObjectMark::End),
    ]
}

fn sightings() -> impl Strategy<Value = Sighting> {
    let target = prop_oneof![
        6 => "[a-e]".prop_map(|text| Target::Landmark(label(&text))),
        1 => Just(Target::Agent(label("agent-1"))),
        1 => (0u64..9).prop_map(Target::OwnSample),
    ];
    let sd = || prop_oneof![Just(0.0), 0.0..1.0f64];
    let at = || prop::array::uniform3(-5.0..5.0f64);
    let relation = prop_oneof![
        (at(), sd()).prop_map(|(at, sd)| {
            Relation::Position(RelativePosition::new(at, [sd; 3]).unwrap())
        }),
        (0.0..9.0f64, at(), sd()).prop_map(|(range, [azimuth, elevation, _], sd)| {
            let seen = RangeBearing::new(range, azimuth, elevation, sd, sd);
            Relation::RangeBearing(seen.unwrap())
        }),
        (at(), at(), sd()).prop_map(|(at, turn, sd)| {
            let noise = PoseNoise::new([sd; 3], [sd; 3]).unwrap();
            Relation::Pose(RelativePose::new(at, xyzw(turn), noise).unwrap())
        }),
        (0.0..9.0f64, at(), sd()).prop_map(|(range, antenna, sd)| {
            Relation::Range(Range::new(range, sd, antenna).unwrap())
        }),
    ];
    (target, relation).prop_map(|(target, relation)| Sighting { target, relation })
}
