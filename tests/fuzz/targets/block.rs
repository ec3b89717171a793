//! Arbitrary bytes as a block of the journal, and as a journal of blocks.
//!
//! Nothing may panic. What can be read is folded into a map as a start would, and the map stays one
//! whose numbers are finite and whose checkpoint can be read back.

#![no_main]

use cogmap::decode::{core_settings, records_of};
use cogmap::journal::entries;
use cogmap_proto::SpaceSettings;
use cognitive_map::CognitiveMap;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(entries) = entries(data) else {
        return;
    };
    let settings = core_settings(&SpaceSettings::default()).expect("the defaults are valid");
    let (mut map, mut events) = (CognitiveMap::new(settings.clone()), Vec::new());
    for entry in &entries {
        records_of(entry, |record| {
            map.apply(&record, &mut events);
            events.clear();
        });
    }
    for (agent, known) in map.agents() {
        assert!(
            known.pose().translation.vector.iter().all(|x| x.is_finite()),
            "a pose is no number"
        );
        if let Some(covariance) = map.covariance(agent) {
            assert!(covariance.matrix().iter().all(|x| x.is_finite()));
        }
    }
    let restored = CognitiveMap::restore(settings, map.checkpoint(0)).expect("it was just written");
    assert_eq!(restored.digest(), map.digest());
});
