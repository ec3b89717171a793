//! The window in which samples wait for earlier ones, shared by the agents of a space.

use super::*;

/// Markers of an agent, in messages that the queue takes as they come.
fn markers(engine: &Engine, agent: &str, seqs: std::ops::Range<u64>) {
    for first in seqs.clone().step_by(2048) {
        let batch = SampleBatch {
            session: SESSION,
            first_seq: first,
            samples: (first..seqs.end.min(first + 2048))
                .map(|_| Sample {
                    stamp_ns: 0,
                    body: SampleBody::Marker(Marker {
                        label: "x".into(),
                        ends_trip: false,
                    }),
                })
                .collect(),
        };
        let bytes = Codec::Postcard.encode(&batch);
        engine.offer(SPACE, agent, Codec::Postcard, &bytes);
    }
}

#[test]
fn a_small_disorder_is_healed_beside_agents_that_fill_the_window() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let settings = EngineSettings {
        gap_timeout: Duration::from_secs(3600),
        ..EngineSettings::default()
    };
    let engine = open(directory.path(), settings);
    // Their first sample never comes.
    let hostile = ["mallory", "oscar", "trudy"];
    for agent in hostile {
        markers(&engine, agent, 1..9000);
    }
    markers(&engine, AGENT, 0..10);
    markers(&engine, AGENT, 12..20);
    markers(&engine, AGENT, 10..12);
    wait_for(|| applied(&engine) == 20);
    let space = engine.space(SPACE).expect("the space is there");
    let waiting = hostile.map(|agent| {
        let view = space.agent(agent).expect("it is enrolled");
        assert!(view.watermark().gap.is_some(), "{agent} is not told");
        view.detail().lag_samples
    });
    // The first may reach 8192 ahead; each later one gets half of what is left.
    assert_eq!(waiting, [8191, 4096, 2048]);
    engine.shutdown();
}
