//! Arbitrary bytes against every decoder that a stranger can reach.
//!
//! The first byte chooses the codec, the rest is read as a batch of samples and as the body of
//! every query and request. Nothing may panic, and whatever can be read can be written and read
//! again, with the same meaning.

#![no_main]

use cogmap_proto::{Codec, RecallQuery, SampleBatch, SpaceSettings, WatermarkQuery};
use libfuzzer_sys::fuzz_target;
use serde::Serialize;
use serde::de::DeserializeOwned;

const CODECS: [Codec; 3] = [Codec::Postcard, Codec::Cbor, Codec::Json];

fuzz_target!(|data: &[u8]| {
    let Some((&choice, bytes)) = data.split_first() else {
        return;
    };
    let codec = CODECS[usize::from(choice) % CODECS.len()];
    if let Ok(batch) = codec.decode_batch(bytes) {
        let whole = codec
            .decode::<SampleBatch>(bytes)
            .expect("a batch is a message too");
        assert_eq!(
            codec.encode(&whole),
            codec.encode(&batch),
            "the two decoders differ"
        );
    }
    check::<SampleBatch>(codec, bytes);
    check::<RecallQuery>(codec, bytes);
    check::<WatermarkQuery>(codec, bytes);
    check::<SpaceSettings>(codec, bytes);
});

/// Reads `bytes`, then writes and reads what they mean in every codec that keeps it exactly.
fn check<T: Serialize + DeserializeOwned>(codec: Codec, bytes: &[u8]) {
    let Ok(message) = codec.decode::<T>(bytes) else {
        return;
    };
    // Bytes stand for the meaning, because NaN is not equal to itself. JSON has no NaN and keeps
    // 15 digits, so only its own messages go through it, and they need not come out the same.
    for exact in [Codec::Postcard, Codec::Cbor] {
        let written = exact.encode(&message);
        // What is short in postcard or CBOR may be beyond the longest message in the other.
        if let Ok(again) = exact.decode::<T>(&written) {
            assert_eq!(
                exact.encode(&again),
                written,
                "the meaning changed in {exact:?}"
            );
        } else {
            assert!(
                written.len() > cogmap_proto::limits::MESSAGE_BYTES_MAX,
                "unreadable"
            );
        }
    }
    if codec == Codec::Json {
        let written = codec.encode(&message);
        let again = codec.decode::<T>(&written);
        assert!(
            again.is_ok() || written.len() > cogmap_proto::limits::MESSAGE_BYTES_MAX,
            "JSON does not read what it wrote"
        );
    }
}
