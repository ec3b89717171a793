//! Arbitrary messages, from a strategy for their floats.

use cogmap_proto::{
    Descriptor, Estimate, Event, EventKind, Increment, Level, Marker, MotionNoise, ObjectMark,
    Orientation, PerceptCue, PerceptKind, RecallQuery, Rejection, Relation, Sample, SampleBatch,
    SampleBody, SeqRange, Sighting, SkipReason, StartPose, Status, Target, TouchNoise, TripEnd,
    Velocity, Watermark,
};
use proptest::array::{uniform3, uniform4, uniform21};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;

type Floats = BoxedStrategy<f64>;

/// Floats of at most 15 decimal digits, which JSON holds exactly.
pub(crate) fn short_floats() -> Floats {
    (-999_999_999_999_999_i64..1_000_000_000_000_000, 0..12)
        .prop_map(|(digits, places)| digits as f64 / 10_f64.powi(places))
        .boxed()
}

/// Floats of any bits: NaN, infinities and subnormal numbers among them.
pub(crate) fn any_floats() -> Floats {
    any::<u64>().prop_map(f64::from_bits).boxed()
}

pub(crate) fn batches(floats: &Floats) -> impl Strategy<Value = SampleBatch> + use<> {
    let sample = (any::<i64>(), bodies(floats));
    let samples = vec(
        sample.prop_map(|(stamp_ns, body)| Sample { stamp_ns, body }),
        1..6,
    );
    (any::<u64>(), 0..u64::MAX - 6, samples).prop_map(|(session, first_seq, samples)| SampleBatch {
        session,
        first_seq,
        samples,
    })
}

#[expect(clippy::too_many_lines, reason = "a list: a strategy for each kind")]
fn bodies(floats: &Floats) -> impl Strategy<Value = SampleBody> + use<> {
    let three = || uniform3(floats.clone());
    let four = || uniform4(floats.clone());
    prop_oneof![
        (three(), four(), option::of(noises(floats))).prop_map(
            |(translation_m, rotation_xyzw, noise)| {
                SampleBody::Increment(Increment {
                    translation_m,
                    rotation_xyzw,
                    noise,
                })
            }
        ),
        (three(), three(), floats.clone(), option::of(noises(floats))).prop_map(
            |(linear_m_s, angular_rad_s, duration_s, noise)| {
                SampleBody::Velocity(Velocity {
                    linear_m_s,
                    angular_rad_s,
                    duration_s,
                    noise,
                })
            }
        ),
        (
            any::<String>(),
            floats.clone(),
            three(),
            option::of(three())
        )
            .prop_map(|(channel, value, offset_m, normal)| {
                SampleBody::Level(Level {
                    channel,
                    value,
                    offset_m,
                    normal,
                })
            }),
        (any::<String>(), vec(-1000_i16..1000, 0..40)).prop_map(|(channel, vector)| {
            let vector = vector.into_iter().map(|x| f32::from(x) / 16.0).collect();
            SampleBody::Descriptor(Descriptor { channel, vector })
        }),
        (targets(), relations(floats))
            .prop_map(|(target, relation)| { SampleBody::Sighting(Sighting { target, relation }) }),
        (three(), four(), option::of(noises(floats))).prop_map(
            |(translation_m, rotation_xyzw, noise)| {
                SampleBody::StartPose(StartPose {
                    translation_m,
                    rotation_xyzw,
                    noise,
                })
            }
        ),
        (any::<String>(), any::<bool>())
            .prop_map(|(label, ends_trip)| SampleBody::Marker(Marker { label, ends_trip })),
        Just(SampleBody::SessionEnd {}),
        option::of(any::<String>()).prop_map(|name| {
            SampleBody::Object(ObjectMark::Learn {
                name,
                spacing_m: 0.5,
                orientation: Orientation::Cube {},
                noise: TouchNoise::default(),
            })
        }),
    ]
}

fn noises(floats: &Floats) -> impl Strategy<Value = MotionNoise> + use<> {
    (uniform3(floats.clone()), uniform3(floats.clone())).prop_map(
        |(translation_sd_m, rotation_sd_rad)| MotionNoise {
            translation_sd_m,
            rotation_sd_rad,
        },
    )
}

fn targets() -> impl Strategy<Value = Target> {
    prop_oneof![
        any::<String>().prop_map(Target::Landmark),
        any::<String>().prop_map(Target::Agent),
        any::<u64>().prop_map(Target::OwnSample),
    ]
}

fn relations(floats: &Floats) -> impl Strategy<Value = Relation> + use<> {
    let three = || uniform3(floats.clone());
    let one = || floats.clone();
    prop_oneof![
        (three(), three()).prop_map(|(translation_m, sd_m)| Relation::Position {
            translation_m,
            sd_m
        }),
        (one(), one(), one(), one(), one()).prop_map(
            |(range_m, azimuth_rad, elevation_rad, range_sd_m, bearing_sd_rad)| {
                Relation::RangeBearing {
                    range_m,
                    azimuth_rad,
                    elevation_rad,
                    range_sd_m,
                    bearing_sd_rad,
                }
            }
        ),
        (three(), uniform4(floats.clone()), noises(floats)).prop_map(
            |(translation_m, rotation_xyzw, noise)| {
                Relation::Pose {
                    translation_m,
                    rotation_xyzw,
                    noise,
                }
            }
        ),
        (one(), one(), three()).prop_map(|(range_m, range_sd_m, offset_m)| Relation::Range {
            range_m,
            range_sd_m,
            offset_m,
        }),
    ]
}

pub(crate) fn estimates(floats: &Floats) -> impl Strategy<Value = Estimate> + use<> {
    let status = prop_oneof![
        Just(Status::Localized),
        Just(Status::Uncertain),
        Just(Status::Lost)
    ];
    (
        (
            any::<String>(),
            any::<String>(),
            any::<u64>(),
            any::<u64>(),
            any::<i64>(),
        ),
        (
            any::<String>(),
            any::<u64>(),
            status,
            uniform3(floats.clone()),
        ),
        (uniform4(floats.clone()), uniform21(floats.clone())),
        (option::of(any::<u64>()), floats.clone(), any::<u64>()),
    )
        .prop_map(|(who, what, pose, place)| Estimate {
            space: who.0,
            agent: who.1,
            session: who.2,
            seq: who.3,
            stamp_ns: who.4,
            frame: what.0,
            map_revision: what.1,
            status: what.2,
            translation_m: what.3,
            rotation_xyzw: pose.0,
            covariance: pose.1,
            place: place.0,
            confidence: place.1,
            term: place.2,
        })
}

pub(crate) fn watermarks() -> impl Strategy<Value = Watermark> {
    let range = || (any::<u64>(), any::<u64>()).prop_map(|(from, to)| SeqRange { from, to });
    let rejection = (range(), reasons()).prop_map(|(range, reason)| Rejection { range, reason });
    (
        any::<u64>(),
        any::<u64>(),
        any::<u64>(),
        option::of(range()),
        vec(rejection, 0..17),
        any::<u64>(),
    )
        .prop_map(
            |(session, durable, applied, gap, rejected, term)| Watermark {
                session,
                durable,
                applied,
                gap,
                rejected,
                term,
            },
        )
}

fn reasons() -> impl Strategy<Value = SkipReason> {
    prop_oneof![
        Just(SkipReason::NumberOutOfRange),
        Just(SkipReason::InvalidNormal),
        Just(SkipReason::Lost),
    ]
}

fn loops_closed(floats: &Floats) -> impl Strategy<Value = EventKind> + use<> {
    let (lengths, position) = ((floats.clone(), floats.clone()), uniform3(floats.clone()));
    (any::<u64>(), any::<u64>(), lengths, position).prop_map(
        |(closures, view_matches, (moved_m, turned_rad), translation_m)| EventKind::LoopsClosed {
            closures,
            view_matches,
            moved_m,
            turned_rad,
            translation_m,
        },
    )
}

pub(crate) fn events(floats: &Floats) -> impl Strategy<Value = Event> + use<> {
    let number = any::<u64>;
    let three = || uniform3(floats.clone());
    let kind =
        prop_oneof![
            Just(EventKind::AgentEnrolled {}),
            Just(EventKind::AgentRemoved {}),
            number().prop_map(|session| EventKind::SessionStarted { session }),
            (number(), three()).prop_map(|(place, translation_m)| EventKind::PlaceRecruited {
                place,
                translation_m
            }),
            (number(), floats.clone())
                .prop_map(|(place, confidence)| EventKind::PlaceEntered { place, confidence }),
            number().prop_map(|trip| EventKind::TripStarted { trip }),
            (number(), number()).prop_map(|(trip, legs)| EventKind::TripEnded {
                trip,
                legs,
                reason: TripEnd::Full
            }),
            (any::<String>(), three()).prop_map(|(landmark, translation_m)| {
                EventKind::LandmarkLearned {
                    landmark,
                    translation_m,
                }
            }),
            (number(), number(), reasons())
                .prop_map(|(from, to, reason)| EventKind::SamplesSkipped { from, to, reason }),
            any::<String>().prop_map(|label| EventKind::MarkerPassed { label }),
            (number(), three()).prop_map(|(place, translation_m)| EventKind::PlaceForgotten {
                place,
                translation_m
            }),
            (number(), number()).prop_map(|(trip, legs)| EventKind::TripForgotten { trip, legs }),
            three().prop_map(|translation_m| EventKind::AgentPlaced { translation_m }),
            loops_closed(floats),
            (number(), any::<String>(), number(), floats.clone()).prop_map(
                |(place, channel, percepts, surprise)| EventKind::PerceptSurprising {
                    place,
                    channel,
                    percept: PerceptKind::Descriptor,
                    percepts,
                    surprise
                }
            ),
        ];
    (
        any::<String>(),
        any::<String>(),
        number(),
        any::<i64>(),
        kind,
    )
        .prop_map(|(space, agent, map_revision, stamp_ns, kind)| Event {
            space,
            agent,
            map_revision,
            stamp_ns,
            kind,
        })
}

pub(crate) fn recall_queries(floats: &Floats) -> impl Strategy<Value = RecallQuery> + use<> {
    let three = || option::of(uniform3(floats.clone()));
    let percept = (any::<String>(), floats.clone()).prop_map(|(channel, value)| {
        PerceptCue::Level(Level {
            channel,
            value,
            offset_m: [0.0; 3],
            normal: None,
        })
    });
    (
        three(),
        option::of(vec(three(), 0..17)),
        option::of(floats.clone()),
        option::of(any::<String>()),
        option::of(any::<i64>()),
        option::of(any::<i64>()),
        option::of(any::<u32>()),
        option::of(percept),
    )
        .prop_map(
            |(position_m, code, radius_m, agent, since_ns, until_ns, limit, percept)| RecallQuery {
                position_m,
                code,
                radius_m,
                agent,
                since_ns,
                until_ns,
                limit,
                percept,
            },
        )
}
