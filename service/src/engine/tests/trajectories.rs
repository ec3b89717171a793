//! Causal trajectories: which poses are kept.

use ::trajectory::StampedPose;

use super::*;
use crate::engine::trajectory::{Recorder, note_all};

const INTERVAL_NS: i64 = 5_000_000;

/// Folds motions of these durations \[ns\], and gives all rows with the newest pose. The recorder
/// is stored and read again after each.
fn rows_of(durations_ns: &[i64]) -> (Vec<StampedPose>, StampedPose) {
    let mut map = CognitiveMap::new(core_settings(&SpaceSettings::default()).expect("valid"));
    let (mut recorders, mut rows, mut events) = (Vec::new(), Vec::new(), Vec::new());
    let mut fold = |entry: Entry<'_>| {
        records_of(&entry, |record| {
            map.apply(&record, &mut events);
            let chunk = note_all(&mut recorders, &map, &record, INTERVAL_NS);
            rows.extend(chunk.into_iter().flat_map(|(_, chunk)| chunk.rows));
            let stored = Recorder::write_all(&recorders);
            (recorders, _) = Recorder::read_all(&stored).expect("what was written");
        });
    };
    fold(Entry::Enrol {
        agent: 0,
        name: AGENT.into(),
    });
    let mut stamp_ns = 0;
    for (seq, &duration_ns) in (0..).zip(durations_ns) {
        stamp_ns += duration_ns;
        let body = SampleBody::Velocity(Velocity {
            linear_m_s: [1.0, 0.0, 0.0],
            angular_rad_s: [0.0, 0.0, 0.1],
            duration_s: 0.001,
            noise: None,
        });
        fold(Entry::Samples {
            agent: 0,
            batch: SampleBatch {
                session: SESSION,
                first_seq: seq,
                samples: vec![Sample { stamp_ns, body }],
            },
        });
    }
    rows.extend_from_slice(recorders[0].rows());
    let newest = StampedPose {
        stamp_ns,
        pose: *map
            .agent(cognitive_map::AgentId(0))
            .expect("enrolled")
            .pose(),
    };
    (rows, newest)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// However fast a robot sends, its trajectory reaches to its newest pose and has no gap that
    /// its samples do not have.
    #[test]
    fn a_trajectory_ends_with_the_newest_pose(
        durations_ns in prop::collection::vec(1..12_000_000_i64, 1..700),
    ) {
        let (rows, newest) = rows_of(&durations_ns);
        prop_assert_eq!(rows.last(), Some(&newest));
        let (_, kept) = rows.split_last().expect("at least one");
        for two in kept.windows(2) {
            let apart_ns = two[1].stamp_ns - two[0].stamp_ns;
            prop_assert!((INTERVAL_NS..INTERVAL_NS + 12_000_000).contains(&apart_ns));
        }
    }
}
