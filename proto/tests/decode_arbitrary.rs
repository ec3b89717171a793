//! Decoders against arbitrary bytes and arbitrary messages: what was written is read, what was cut
//! or damaged is refused, and nothing panics.

mod arbitrary;
mod messages;

use std::fmt::Debug;

use cogmap_proto::{
    AgentAt, AgentDetail, AgentObject, AgentPage, BlockageList, BlockageRequest, Codec,
    DecodeError, Estimate, Event, FeltAnswer, FeltQuery, FollowRequest, FollowedRoute, GridState,
    Identification, IdentifyQuery, IngestAnswer, LandmarkPage, Localization, LocalizeQuery, Name,
    ObjectDetail, ObjectLesson, ObjectPage, PlacePage, PredictAnswer, PredictQuery, Problem,
    RecallAnswer, RecallQuery, RouteAnswer, RouteQuery, SampleBatch, SequenceAnswer, SequenceQuery,
    SpaceList, SpaceSettings, Trajectory, TripDetail, TripPage, Watermark, WatermarkQuery,
};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use serde::Serialize;
use serde::de::DeserializeOwned;

use arbitrary::{any_floats, batches, estimates, events, recall_queries, short_floats, watermarks};
use messages::Visit;

const CODECS: [Codec; 3] = [Codec::Postcard, Codec::Cbor, Codec::Json];

/// Reads `bytes` as every message there is, in every codec.
fn decode_as_everything(bytes: &[u8]) {
    decode_as::<AgentDetail>(bytes);
    decode_as::<AgentObject>(bytes);
    decode_as::<AgentPage>(bytes);
    decode_as::<BlockageList>(bytes);
    decode_as::<BlockageRequest>(bytes);
    decode_as::<Estimate>(bytes);
    decode_as::<Event>(bytes);
    decode_as::<FollowRequest>(bytes);
    decode_as::<FollowedRoute>(bytes);
    decode_as::<GridState>(bytes);
    decode_as::<Identification>(bytes);
    decode_as::<IdentifyQuery>(bytes);
    decode_as::<IngestAnswer>(bytes);
    decode_as::<LandmarkPage>(bytes);
    decode_as::<Localization>(bytes);
    decode_as::<LocalizeQuery>(bytes);
    decode_as::<Name>(bytes);
    decode_as::<ObjectDetail>(bytes);
    decode_as::<ObjectLesson>(bytes);
    decode_as::<ObjectPage>(bytes);
    decode_as::<PlacePage>(bytes);
    decode_as::<PredictAnswer>(bytes);
    decode_as::<PredictQuery>(bytes);
    decode_as::<Problem>(bytes);
    decode_as::<RecallAnswer>(bytes);
    decode_as::<RecallQuery>(bytes);
    decode_as::<RouteAnswer>(bytes);
    decode_as::<RouteQuery>(bytes);
    decode_as::<FeltAnswer>(bytes);
    decode_as::<FeltQuery>(bytes);
    decode_as::<SequenceAnswer>(bytes);
    decode_as::<AgentAt>(bytes);
    decode_as::<SequenceQuery>(bytes);
    decode_as::<SampleBatch>(bytes);
    decode_as::<SpaceList>(bytes);
    decode_as::<SpaceSettings>(bytes);
    decode_as::<Trajectory>(bytes);
    decode_as::<TripDetail>(bytes);
    decode_as::<TripPage>(bytes);
    decode_as::<Watermark>(bytes);
    decode_as::<WatermarkQuery>(bytes);
    for codec in CODECS {
        let whole = codec.decode::<SampleBatch>(bytes);
        let bounded = codec.decode_batch(bytes);
        let (whole, bounded) = match (whole, bounded) {
            (Ok(whole), bounded) => (whole.check().map(|()| codec.encode(&whole)), bounded),
            (Err(_), Ok(batch)) => panic!("{batch:?} is no batch to the general decoder"),
            (Err(_), Err(_)) => continue,
        };
        assert_eq!(bounded.map(|batch| codec.encode(&batch)), whole);
    }
}

/// Whatever can be read can be written and read again, and is then the same.
fn decode_as<T: Serialize + DeserializeOwned>(bytes: &[u8]) {
    for codec in CODECS {
        if let Ok(message) = codec.decode::<T>(bytes) {
            let written = codec.encode(&message);
            let again: T = codec
                .decode(&written)
                .expect("what was written can be read");
            // The last digits of a long JSON number may change each time.
            if codec != Codec::Json {
                assert_eq!(codec.encode(&again), written);
            }
        }
    }
}

/// Every golden message in every codec.
#[derive(Default)]
struct Collected(Vec<Vec<u8>>);

impl Visit for Collected {
    fn message<T: Serialize + DeserializeOwned + PartialEq + Debug>(
        &mut self,
        _: &str,
        message: &T,
    ) {
        self.0.extend(CODECS.map(|codec| codec.encode(message)));
    }
}

fn written_messages() -> Vec<Vec<u8>> {
    let mut collected = Collected::default();
    messages::each(&mut collected);
    collected.0
}

proptest! {
    #[test]
    fn arbitrary_bytes_never_panic(bytes in vec(any::<u8>(), 0..300)) {
        decode_as_everything(&bytes);
    }

    #[test]
    fn damaged_messages_never_panic(
        mut bytes in select(written_messages()),
        damage in vec((any::<Index>(), any::<u8>(), 0..3), 1..6),
    ) {
        for (at, byte, kind) in damage {
            let at = at.index(bytes.len());
            match kind {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                _ if bytes.len() > 1 => drop(bytes.remove(at)),
                _ => {}
            }
        }
        decode_as_everything(&bytes);
    }

    #[test]
    fn messages_come_back_as_they_were(
        batch in batches(&short_floats()),
        estimate in estimates(&short_floats()),
        watermark in watermarks(),
        event in events(&short_floats()),
        recall in recall_queries(&short_floats()),
    ) {
        for codec in CODECS {
            prop_assert_eq!(codec.decode_batch(&codec.encode(&batch)), Ok(batch.clone()));
            prop_assert_eq!(codec.decode(&codec.encode(&batch)), Ok(batch.clone()));
            prop_assert_eq!(codec.decode(&codec.encode(&estimate)), Ok(estimate.clone()));
            prop_assert_eq!(codec.decode(&codec.encode(&watermark)), Ok(watermark.clone()));
            prop_assert_eq!(codec.decode(&codec.encode(&event)), Ok(event.clone()));
            prop_assert_eq!(codec.decode(&codec.encode(&recall)), Ok(recall.clone()));
        }
    }

    /// NaN is not equal to itself, so postcard bytes stand for the message.
    #[test]
    fn binary_codecs_keep_every_float(batch in batches(&any_floats())) {
        let bits = |batch: &SampleBatch| Codec::Postcard.encode(batch);
        let postcard = Codec::Postcard.decode_batch(&bits(&batch)).unwrap();
        prop_assert_eq!(bits(&postcard), bits(&batch));
        let cbor = Codec::Cbor.encode(&batch);
        prop_assert_eq!(Codec::Cbor.encode(&Codec::Cbor.decode_batch(&cbor).unwrap()), cbor);
    }

    #[test]
    fn json_floats_keep_fifteen_digits(digits in -1.0_f64..1.0, exponent in -280..280) {
        let number = digits * 10_f64.powi(exponent);
        let read: f64 = Codec::Json.decode(&Codec::Json.encode(&number)).unwrap();
        prop_assert!((read - number).abs() <= 1e-15 * number.abs(), "{number:e} became {read:e}");
    }

    #[test]
    fn a_cut_batch_is_refused(batch in batches(&short_floats()), at in any::<Index>()) {
        for codec in CODECS {
            let bytes = codec.encode(&batch);
            let cut = codec.decode_batch(&bytes[..at.index(bytes.len())]);
            prop_assert!(matches!(cut, Err(DecodeError::Malformed { .. })), "{cut:?}");
        }
    }
}

/// Cuts every message at every byte, and puts every byte behind it.
struct CutAndExtended;

impl Visit for CutAndExtended {
    fn message<T: Serialize + DeserializeOwned + PartialEq + Debug>(
        &mut self,
        name: &str,
        message: &T,
    ) {
        for codec in CODECS {
            let mut bytes = codec.encode(message);
            for length in 0..bytes.len() {
                let cut = codec.decode::<T>(&bytes[..length]);
                assert!(cut.is_err(), "{length} bytes of {name} in {codec:?}");
            }
            for byte in 0..=u8::MAX {
                bytes.push(byte);
                let refused = codec.decode::<T>(&bytes).is_err();
                let space = codec == Codec::Json && matches!(byte, b' ' | b'\t' | b'\n' | b'\r');
                assert_eq!(refused, !space, "{byte} after {name} in {codec:?}");
                bytes.pop();
            }
        }
    }
}

#[test]
fn messages_that_are_cut_or_extended_are_refused() {
    messages::each(&mut CutAndExtended);
}

/// Short messages that declare more items or bytes than any machine could hold.
#[test]
fn a_declared_length_is_not_believed() {
    let postcard_len = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x01];
    // Session 0, first sequence number 0, and then that many samples.
    let samples = [&[0, 0], &postcard_len[..]].concat();
    // One sample: stamp 0, a descriptor on channel "", and then that many numbers.
    let numbers = [&[0, 0, 1, 0, 3, 0], &postcard_len[..]].concat();
    // One sample: stamp 0, a marker with a label that long.
    let label = [&[0, 0, 1, 0, 6], &postcard_len[..]].concat();
    for bytes in [samples, numbers, label] {
        let refused = Codec::Postcard.decode_batch(&bytes);
        assert!(
            matches!(refused, Err(DecodeError::Malformed { .. })),
            "{refused:?}"
        );
    }

    for length in [[0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff], [0x7f; 8], [0xff; 8]] {
        for major in [0x5b, 0x7b, 0x9b, 0xbb] {
            let item = [&[major], &length[..]].concat();
            decode_as_everything(&item);
            let samples = [b"\xa1\x67samples", &item[..]].concat();
            assert!(Codec::Cbor.decode_batch(&samples).is_err());
            let unknown = [b"\xa1\x67unknown", &item[..]].concat();
            assert!(Codec::Cbor.decode_batch(&unknown).is_err());
        }
    }
}
