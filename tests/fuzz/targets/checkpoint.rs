//! Arbitrary bytes as a checkpoint: pages of a kind, an index and a length, one after the other.
//!
//! Nothing may panic, and nothing may be taken for a map that does not add up to its digest.

#![no_main]

use cognitive_map::{CheckpointPage, CognitiveMap, Settings};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(map) = CognitiveMap::restore(Settings::default(), pages(data)) {
        let again = CognitiveMap::restore(Settings::default(), map.checkpoint(0));
        assert_eq!(again.expect("it was just written").digest(), map.digest());
    }
});

/// Kind (u8), index (u32), length (u16), bytes; the last page may be cut short.
fn pages(mut data: &[u8]) -> Vec<CheckpointPage> {
    let mut pages = Vec::new();
    while let Some((&[kind, a, b, c, d, low, high], rest)) = data.split_first_chunk::<7>() {
        let length = usize::from(u16::from_le_bytes([low, high])).min(rest.len());
        let (bytes, rest) = rest.split_at(length);
        pages.push(CheckpointPage {
            kind,
            index: u32::from_le_bytes([a, b, c, d]),
            bytes: bytes.to_vec(),
        });
        data = rest;
    }
    pages
}
