//! What a decoder takes, what it refuses, and by what name.

use cogmap_proto::limits::{BATCH_SAMPLES_MAX, LOCALIZE_SAMPLES_MAX, MESSAGE_BYTES_MAX};
use cogmap_proto::{
    Codec, DecodeError, Descriptor, Estimate, Increment, Level, LocalizeQuery, Marker, RecallQuery,
    Relation, Sample, SampleBatch, SampleBody, SpaceSettings, StartPose, Velocity, Watermark,
    WatermarkQuery,
};

const CODECS: [Codec; 3] = [Codec::Postcard, Codec::Cbor, Codec::Json];

fn marker() -> Sample {
    let marker = Marker {
        label: "m".to_owned(),
        ends_trip: false,
    };
    Sample {
        stamp_ns: 0,
        body: SampleBody::Marker(marker),
    }
}

fn batch_of(first_seq: u64, count: usize) -> SampleBatch {
    SampleBatch {
        session: 1,
        first_seq,
        samples: vec![marker(); count],
    }
}

fn level(value: f64) -> SampleBatch {
    let level = Level {
        channel: "c".to_owned(),
        value,
        offset_m: [0.0; 3],
        normal: None,
    };
    let sample = Sample {
        stamp_ns: 0,
        body: SampleBody::Level(level),
    };
    SampleBatch {
        session: 1,
        first_seq: 0,
        samples: vec![sample],
    }
}

/// Reads a batch of one sample from the JSON of its body, as JSON and as the same CBOR.
fn decode_body(body: &str) -> Result<SampleBody, DecodeError> {
    let json =
        format!(r#"{{"session":1,"first_seq":0,"samples":[{{"stamp_ns":0,"body":{body}}}]}}"#);
    let from_json = Codec::Json.decode_batch(json.as_bytes());
    let value: serde_json::Value = serde_json::from_str(&json).expect("the tests write JSON");
    let from_cbor = Codec::Cbor.decode_batch(&Codec::Cbor.encode(&value));
    match (from_json, from_cbor) {
        (Ok(json), Ok(cbor)) => {
            assert_eq!(json, cbor, "{body}");
            Ok(json.samples.into_iter().next().expect("one sample").body)
        }
        (Err(error), Err(_)) => Err(error),
        (json, cbor) => panic!("JSON: {json:?}, CBOR: {cbor:?}"),
    }
}

fn assert_malformed<T: std::fmt::Debug>(result: &Result<T, DecodeError>, what: &str) {
    assert!(
        matches!(result, Err(DecodeError::Malformed { .. })),
        "{what}: {result:?}"
    );
}

#[test]
fn an_encoding_names_its_codec() {
    for codec in CODECS {
        assert_eq!(Codec::of_encoding(codec.encoding()), Ok(codec));
    }
    assert_eq!(
        Codec::of_encoding("application/json; charset=utf-8"),
        Ok(Codec::Json)
    );
    assert_eq!(Codec::of_encoding("application/json;v1"), Ok(Codec::Json));
    assert_eq!(Codec::of_encoding("Application/CBOR"), Ok(Codec::Cbor));
}

#[test]
fn other_encodings_and_versions_are_refused_by_name() {
    for unknown in [
        "",
        "zenoh/bytes",
        "text/json",
        "application/cbor-seq",
        "postcard",
    ] {
        let refused = Err(DecodeError::UnknownEncoding(unknown.to_owned()));
        assert_eq!(Codec::of_encoding(unknown), refused);
    }
    for version in ["", ";", ";v0", ";v2", ";v10", ";v1;v2"] {
        let encoding = format!("application/vnd.cogmap.postcard{version}");
        let refused = Err(DecodeError::UnsupportedVersion(encoding.clone()));
        assert_eq!(Codec::of_encoding(&encoding), refused);
    }
}

#[test]
fn a_message_is_bounded_in_bytes() {
    let mut bytes = Codec::Json.encode(&batch_of(0, 1));
    bytes.resize(MESSAGE_BYTES_MAX, b' ');
    assert_eq!(Codec::Json.decode_batch(&bytes), Ok(batch_of(0, 1)));
    bytes.push(b' ');
    for codec in CODECS {
        let refused = DecodeError::TooLong(MESSAGE_BYTES_MAX + 1);
        assert_eq!(codec.decode_batch(&bytes), Err(refused.clone()));
        assert_eq!(codec.decode::<WatermarkQuery>(&bytes), Err(refused));
    }
}

#[test]
fn a_batch_is_bounded_in_samples() {
    for codec in CODECS {
        let decode = |count| codec.decode_batch(&codec.encode(&batch_of(0, count)));
        assert_eq!(decode(0), Err(DecodeError::EmptyBatch));
        assert_eq!(decode(1), Ok(batch_of(0, 1)));
        assert_eq!(
            decode(BATCH_SAMPLES_MAX),
            Ok(batch_of(0, BATCH_SAMPLES_MAX))
        );
        let beyond = BATCH_SAMPLES_MAX + 1;
        assert_eq!(decode(beyond), Err(DecodeError::TooManySamples(beyond)));
    }
    let many = Codec::Postcard.encode(&batch_of(0, 200_000));
    assert_eq!(
        Codec::Postcard.decode_batch(&many),
        Err(DecodeError::TooManySamples(200_000))
    );
}

#[test]
fn a_question_where_samples_were_taken_is_bounded_in_samples() {
    for codec in CODECS {
        let decode = |count| {
            let samples = vec![marker(); count];
            codec.decode::<LocalizeQuery>(&codec.encode(&LocalizeQuery { samples }))
        };
        let read = decode(LOCALIZE_SAMPLES_MAX).unwrap();
        assert_eq!(read.samples.len(), LOCALIZE_SAMPLES_MAX);
        // However many there are, one beyond the limit is kept to tell by.
        let read = decode(LOCALIZE_SAMPLES_MAX + 100).unwrap();
        assert_eq!(read.samples.len(), LOCALIZE_SAMPLES_MAX + 1);
    }
}

#[test]
fn sequence_numbers_do_not_overflow() {
    for codec in CODECS {
        let decode = |first_seq| codec.decode_batch(&codec.encode(&batch_of(first_seq, 2)));
        assert_eq!(decode(u64::MAX - 3), Ok(batch_of(u64::MAX - 3, 2)));
        assert_eq!(decode(u64::MAX - 2), Err(DecodeError::SequenceOverflow));
        assert_eq!(decode(u64::MAX - 1), Err(DecodeError::SequenceOverflow));
        assert_eq!(decode(u64::MAX), Err(DecodeError::SequenceOverflow));
    }
}

#[test]
fn the_largest_session_is_refused_because_none_could_follow() {
    for codec in CODECS {
        let decode = |session| {
            let batch = SampleBatch {
                session,
                ..batch_of(0, 1)
            };
            codec.decode_batch(&codec.encode(&batch)).map(drop)
        };
        assert_eq!(decode(u64::MAX), Err(DecodeError::LastSession));
        assert_eq!(decode(u64::MAX - 1), Ok(()));
    }
}

/// NaN and infinity are numbers to the codecs; the check of the samples names the one that has
/// them.
#[test]
fn binary_codecs_carry_numbers_that_are_none() {
    for codec in [Codec::Postcard, Codec::Cbor] {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let read = codec.decode_batch(&codec.encode(&level(value))).unwrap();
            let SampleBody::Level(read) = &read.samples[0].body else {
                panic!("{read:?}")
            };
            assert_eq!(read.value.is_nan(), value.is_nan());
            assert!(value.is_nan() || (read.value - value).is_nan());
        }
    }
    let json = Codec::Json.encode(&level(f64::NAN));
    assert!(
        String::from_utf8(json.clone())
            .unwrap()
            .contains(r#""value":null"#)
    );
    assert_malformed(&Codec::Json.decode_batch(&json), "NaN in JSON");
}

#[test]
fn null_is_not_a_number() {
    for body in [
        r#"{"level":{"channel":"c","value":null}}"#,
        r#"{"level":{"channel":"c","value":1.0,"offset_m":[0.0,null,0.0]}}"#,
        r#"{"level":{"channel":"c","value":1.0,"offset_m":null}}"#,
        r#"{"level":{"channel":"c","value":"1"}}"#,
        r#"{"level":{"channel":"c","value":true}}"#,
        r#"{"descriptor":{"channel":"c","vector":[1.0,null]}}"#,
    ] {
        assert_malformed(&decode_body(body), body);
    }
    assert_malformed(&Codec::Json.decode::<f64>(b"NaN"), "NaN");
    assert_malformed(&Codec::Json.decode::<f64>(b"1e400"), "1e400");
}

#[test]
fn whole_numbers_stand_for_floats() {
    let body = decode_body(r#"{"level":{"channel":"c","value":-3,"offset_m":[1,0,-2]}}"#);
    let level = Level {
        channel: "c".to_owned(),
        value: -3.0,
        offset_m: [1.0, 0.0, -2.0],
        normal: None,
    };
    assert_eq!(body, Ok(SampleBody::Level(level)));
    let fraction = r#"{"sighting":{"target":{"own_sample":1.5},"relation":{"position":{"translation_m":[1,0,0],"sd_m":[1,1,1]}}}}"#;
    assert_malformed(&decode_body(fraction), "a fraction for a sequence number");
}

/// Written by Python's cbor2 from integers, floats and a `float` that no `f32` holds.
#[test]
fn cbor_of_another_language_is_read() {
    let bytes = [
        &b"\xa3\x67session\x07\x69first_seq\x00\x67samples\x82"[..],
        b"\xa2\x68stamp_ns\x01\x64body\xa1\x68velocity\xa3\x6alinear_m_s\x83\x01\x00\x21",
        b"\x6dangular_rad_s\x83\x00\x00\xfb\x3f\xe0\0\0\0\0\0\0\x6aduration_s\x01",
        b"\xa2\x68stamp_ns\x02\x64body\xa1\x6adescriptor\xa2\x67channel\x61c\x66vector\x88",
        b"\x01\x00\x20\xfb\x3f\xe0\0\0\0\0\0\0\x00\x00\x00\xfb\x3f\xb9\x99\x99\x99\x99\x99\x9a",
    ]
    .concat();
    let batch = Codec::Cbor.decode_batch(&bytes).unwrap();
    let velocity = Velocity {
        linear_m_s: [1.0, 0.0, -2.0],
        angular_rad_s: [0.0, 0.0, 0.5],
        duration_s: 1.0,
        noise: None,
    };
    assert_eq!(batch.samples[0].body, SampleBody::Velocity(velocity));
    let vector = vec![1.0, 0.0, -1.0, 0.5, 0.0, 0.0, 0.0, 0.1];
    let descriptor = Descriptor {
        channel: "c".to_owned(),
        vector,
    };
    assert_eq!(batch.samples[1].body, SampleBody::Descriptor(descriptor));
}

/// As streaming encoders write: arrays, maps and texts without a length before them.
#[test]
fn cbor_of_undeclared_length_is_read() {
    let bytes = [
        &b"\xbf\x67session\x01\x69first_seq\x00\x67samples\x9f"[..],
        b"\xbf\x68stamp_ns\x00\x64body\xbf\x66marker\xbf\x65label\x7f\x61a\x61b\xff\xff\xff\xff",
        b"\xff\xff",
    ]
    .concat();
    let batch = Codec::Cbor.decode_batch(&bytes).unwrap();
    let marker = Marker {
        label: "ab".to_owned(),
        ends_trip: false,
    };
    assert_eq!(batch.samples[0].body, SampleBody::Marker(marker));
}

#[test]
fn arrays_have_exactly_their_items() {
    for offset_m in ["[]", "[1,2]", "[1,2,3,4]", r#"{"x":1,"y":2,"z":3}"#] {
        let body = format!(r#"{{"level":{{"channel":"c","value":1,"offset_m":{offset_m}}}}}"#);
        assert_malformed(&decode_body(&body), &body);
    }
}

#[test]
fn a_variant_is_one_entry_of_a_map() {
    for body in [
        r#""marker""#,
        r"{}",
        "null",
        r#"{"marker":"lap"}"#,
        r#"{"marker":{"label":"a"},"level":{"channel":"c","value":1}}"#,
        r#"{"marker":{"label":"a"},"marker":{"label":"a"}}"#,
        r#"{"unheard_of":{}}"#,
    ] {
        let json =
            format!(r#"{{"session":1,"first_seq":0,"samples":[{{"stamp_ns":0,"body":{body}}}]}}"#);
        assert_malformed(&Codec::Json.decode_batch(json.as_bytes()), body);
    }
    let sample = |body: &[u8]| {
        let head =
            b"\xa3\x67session\x01\x69first_seq\x00\x67samples\x81\xa2\x68stamp_ns\x00\x64body";
        Codec::Cbor.decode_batch(&[head, body].concat())
    };
    assert!(sample(b"\xa1\x66marker\xa1\x65label\x61a").is_ok());
    // The contents must not stand behind the map that they belong in.
    assert_malformed(
        &sample(b"\x66marker\xa1\x65label\x61a"),
        "a text and then its contents",
    );
    assert_malformed(
        &sample(b"\xa2\x66marker\xa1\x65label\x61a\x61b\x01"),
        "two entries",
    );
    assert_malformed(&sample(b"\xa0"), "no entry");
}

#[test]
fn unknown_fields_of_samples_are_ignored() {
    let json = br#"{"session":1,"note":{"a":[null,1.5,"x"]},"first_seq":0,"samples":[
        {"stamp_ns":0,"quality":[[[]]],"body":{"marker":{"colour":"red","label":"m"}}}]}"#;
    assert_eq!(Codec::Json.decode_batch(json), Ok(batch_of(0, 1)));
    let value: serde_json::Value = serde_json::from_slice(json).unwrap();
    assert_eq!(
        Codec::Cbor.decode_batch(&Codec::Cbor.encode(&value)),
        Ok(batch_of(0, 1))
    );
    // What JSON does not have: bytes, tags, undefined, maps with other keys, undeclared lengths.
    for unknown in [
        &b"\x43abc"[..],
        b"\xc0\x74\x32\x30\x32\x37-01-01T00:00:00Z",
        b"\xc2\x49\x01\0\0\0\0\0\0\0\0",
        b"\xf7",
        b"\xa2\x01\x02\x80\x03",
        b"\x9f\x01\x9f\xff\xff",
        b"\x5f\x41a\x41b\xff",
    ] {
        let bytes = [
            &b"\xa4\x67session\x01\x67unknown"[..],
            unknown,
            b"\x69first_seq\x00\x67samples\x81\xa2\x68stamp_ns\x00\x64body",
            b"\xa1\x66marker\xa1\x65label\x61m",
        ]
        .concat();
        assert_eq!(
            Codec::Cbor.decode_batch(&bytes),
            Ok(batch_of(0, 1)),
            "{unknown:?}"
        );
    }
}

#[test]
fn unknown_fields_of_queries_and_settings_are_refused() {
    assert_malformed(
        &Codec::Json.decode::<RecallQuery>(br#"{"radius":1}"#),
        "radius",
    );
    assert_malformed(
        &Codec::Json.decode::<SpaceSettings>(br#"{"grid_moduls":5}"#),
        "moduls",
    );
    let query = Codec::Json.decode::<WatermarkQuery>(br#"{"agent":"a","space":"b"}"#);
    assert_malformed(&query, "space");
}

#[test]
fn absent_fields_take_their_defaults() {
    assert_eq!(Codec::Json.decode(b"{}"), Ok(RecallQuery::default()));
    assert_eq!(Codec::Cbor.decode(b"\xa0"), Ok(RecallQuery::default()));
    assert_eq!(Codec::Json.decode(b"{}"), Ok(SpaceSettings::default()));
    assert_eq!(
        decode_body(r#"{"increment":{"translation_m":[1,2,3],"rotation_xyzw":[0,0,0,1]}}"#),
        Ok(SampleBody::Increment(Increment {
            translation_m: [1.0, 2.0, 3.0],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            noise: None,
        }))
    );
    assert_eq!(
        decode_body(r#"{"level":{"channel":"c","value":2}}"#),
        Ok(level(2.0).samples.remove(0).body)
    );
    assert_eq!(
        decode_body(r#"{"start_pose":{"translation_m":[1,2,3],"rotation_xyzw":[0,0,0,1]}}"#),
        Ok(SampleBody::StartPose(StartPose {
            translation_m: [1.0, 2.0, 3.0],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            noise: None,
        }))
    );
    assert_eq!(
        decode_body(r#"{"marker":{"label":"m"}}"#),
        Ok(marker().body)
    );
    let sighting = decode_body(
        r#"{"sighting":{"target":{"landmark":"l"},"relation":{"range_bearing":
            {"range_m":1,"azimuth_rad":0,"range_sd_m":0.1,"bearing_sd_rad":0.1}}}}"#,
    );
    let Ok(SampleBody::Sighting(sighting)) = sighting else {
        panic!("{sighting:?}")
    };
    let Relation::RangeBearing { elevation_rad, .. } = sighting.relation else {
        panic!("{sighting:?}")
    };
    assert_eq!(elevation_rad.to_bits(), 0);
}

#[test]
fn a_message_that_cannot_be_read_is_refused_by_the_name_of_the_field() {
    let detail = |body: &str| decode_body(body).unwrap_err().to_string();
    let refused = detail(r#"{"level":{"channel":"touch","value":"x"}}"#);
    assert!(
        refused.contains("samples[0].body.level.value: "),
        "{refused}"
    );
    let refused = detail(r#"{"increment":{"translation_m":[1,2],"rotation_xyzw":[0,0,0,1]}}"#);
    assert!(
        refused.contains("samples[0].body.increment.translation_m"),
        "{refused}"
    );
    for codec in [Codec::Cbor, Codec::Json] {
        let wrong = codec.encode(&serde_json::json!({"position_m": [0, 0, 0], "limit": "all"}));
        let refused = codec.decode::<RecallQuery>(&wrong).unwrap_err().to_string();
        assert!(
            refused.contains("limit: expected a whole number"),
            "{refused}"
        );
    }
}

#[test]
fn required_fields_are_required() {
    for body in [
        r#"{"level":{"channel":"c"}}"#,
        r#"{"velocity":{"linear_m_s":[0,0,0],"angular_rad_s":[0,0,0]}}"#,
        r#"{"marker":{"ends_trip":true}}"#,
    ] {
        assert_malformed(&decode_body(body), body);
    }
    assert_malformed(
        &Codec::Json.decode_batch(br#"{"session":1,"samples":[]}"#),
        "first_seq",
    );
}

/// A field that nobody knows may be nested; reading it must not end the stack.
#[test]
fn nesting_is_bounded() {
    let json = |depth: usize| {
        let (open, close) = ("[".repeat(depth), "]".repeat(depth));
        let text = format!(
            r#"{{"x":{open}{close},"session":1,"first_seq":0,"samples":[{{"stamp_ns":0,"body":{{"marker":{{"label":"m"}}}}}}]}}"#
        );
        Codec::Json.decode_batch(text.as_bytes())
    };
    // The JSON reader skips unknown fields without going down into them.
    assert_eq!(json(100), Ok(batch_of(0, 1)));
    assert_eq!(json(MESSAGE_BYTES_MAX / 3), Ok(batch_of(0, 1)));

    // Arrays and maps of one item, arrays of undeclared length, tags.
    for opening in [&b"\x81"[..], b"\xa1\x00", b"\x9f", b"\xc1"] {
        let cbor = |depth: usize| {
            let mut bytes = b"\xa4\x61x".to_vec();
            bytes.extend(opening.repeat(depth));
            bytes.push(0);
            if opening == b"\x9f" {
                bytes.extend(b"\xff".repeat(depth));
            }
            bytes.extend(b"\x67session\x01\x69first_seq\x00\x67samples\x81\xa2\x68stamp_ns\x00");
            bytes.extend(b"\x64body\xa1\x66marker\xa1\x65label\x61m");
            Codec::Cbor.decode_batch(&bytes)
        };
        assert_eq!(cbor(60), Ok(batch_of(0, 1)), "{opening:?}");
        assert_malformed(&cbor(200), "CBOR");
        assert_malformed(&cbor(MESSAGE_BYTES_MAX / 3), "CBOR");
    }
}

#[test]
fn an_estimate_and_a_watermark_without_a_term_are_of_term_0() {
    fn read<T: serde::de::DeserializeOwned>(json: &str) -> [T; 2] {
        let value: serde_json::Value = serde_json::from_str(json).expect("the tests write JSON");
        let cbor = Codec::Cbor.encode(&value);
        [
            Codec::Json.decode(json.as_bytes()).expect("a message"),
            Codec::Cbor.decode(&cbor).expect("a message"),
        ]
    }
    let watermark = r#"{"session":5,"durable":3,"applied":3,"gap":null,"rejected":[]}"#;
    let estimate = format!(
        r#"{{"space":"lab","agent":"ada","session":5,"seq":2,"stamp_ns":9,"frame":"map",
            "map_revision":4,"status":"localized","translation_m":[0,0,0],
            "rotation_xyzw":[0,0,0,1],"covariance":{:?},"place":null,"confidence":0}}"#,
        [0; 21]
    );
    assert_eq!(read::<Watermark>(watermark).map(|mark| mark.term), [0, 0]);
    assert_eq!(read::<Estimate>(&estimate).map(|one| one.term), [0, 0]);
}
