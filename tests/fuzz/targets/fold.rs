//! Arbitrary samples of several robots, as messages in postcard, folded into a map.
//!
//! Before each message stand its robot (u8) and its length (u16). Whatever robots say, the map's
//! numbers stay finite, and the same samples give the same map.

#![no_main]

use cogmap::decode::{self, core_settings};

use cogmap_proto::{Codec, SpaceSettings};
use cognitive_map::{AgentId, CognitiveMap, Label, Record};
use libfuzzer_sys::fuzz_target;

/// Robots, and samples of one run: as many as take little time.
const ROBOTS: u32 = 4;
const SAMPLES_MAX: u64 = 512;

fuzz_target!(|data: &[u8]| {
    let map = fold(data);
    for (agent, known) in map.agents() {
        assert!(
            known.pose().translation.vector.iter().all(|x| x.is_finite()),
            "a pose is no number"
        );
        let covariance = map.covariance(agent).expect("an agent has a covariance");
        let matrix = covariance.matrix();
        assert!(matrix.iter().all(|x| x.is_finite()));
        assert!((0..6).all(|k| matrix[(k, k)] >= 0.0), "a variance is negative");
    }
    assert_eq!(fold(data).digest(), map.digest());
});

fn fold(mut data: &[u8]) -> CognitiveMap {
    let settings = core_settings(&SpaceSettings::default()).expect("the defaults are valid");
    let (mut map, mut events) = (CognitiveMap::new(settings), Vec::new());
    for agent in 0..ROBOTS {
        let name = Label::new(&format!("robot{agent}")).expect("a valid name");
        let agent = AgentId(agent);
        map.apply(&Record::Enrol { agent, name }, &mut events);
    }
    let mut next = [0; ROBOTS as usize];
    while let Some((&[robot, low, high], rest)) = data.split_first_chunk::<3>() {
        let robot = u32::from(robot) % ROBOTS;
        let length = usize::from(u16::from_le_bytes([low, high])).min(rest.len());
        let (message, rest) = rest.split_at(length);
        data = rest;
        let Ok(batch) = Codec::Postcard.decode_batch(message) else {
            continue;
        };
        for sample in &batch.samples {
            let Ok(sample) = decode::sample(sample) else {
                continue;
            };
            let seq = &mut next[robot as usize];
            if *seq == SAMPLES_MAX {
                return map;
            }
            let (agent, session) = (AgentId(robot), 1);
            let record = Record::Sample { agent, session, seq: *seq, sample };
            *seq += 1;
            map.apply(&record, &mut events);
            events.clear();
        }
    }
    map
}
