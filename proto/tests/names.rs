//! Names and keys: what is accepted comes back unchanged, and nothing else is accepted.

use cogmap_proto::{
    AgentKey, Codec, KeyError, Name, NameError, Verb, durable_key, estimate_key, events_key,
    query_key, samples_key,
};
use proptest::prelude::*;

const NAME: &str = "[A-Za-z0-9][A-Za-z0-9_.-]{0,63}";

fn parse(text: &str) -> Result<String, NameError> {
    text.parse::<Name>().map(|name| name.to_string())
}

proptest! {
    #[test]
    fn a_name_is_its_text(text in NAME) {
        let name: Name = text.parse().unwrap();
        prop_assert_eq!(name.as_str(), &text);
        prop_assert_eq!(name.to_string(), text.clone());
        prop_assert_eq!(String::from(name.clone()), text.clone());
        prop_assert_eq!(Name::try_from(text), Ok(name.clone()));
        for codec in [Codec::Postcard, Codec::Cbor, Codec::Json] {
            prop_assert_eq!(codec.decode(&codec.encode(&name)), Ok(name.clone()));
        }
    }

    /// The rule stated once more, over bytes.
    #[test]
    fn other_texts_are_not_names(text in prop_oneof![".{0,70}", "[A-Za-z_.*$/@-]{0,70}"]) {
        let inner = |b: &u8| b.is_ascii_alphanumeric() || b"_.-".contains(b);
        let bytes = text.as_bytes();
        let good = (1..=64).contains(&bytes.len())
            && bytes[0].is_ascii_alphanumeric()
            && bytes.iter().all(inner);
        prop_assert_eq!(text.parse::<Name>().is_ok(), good);
        prop_assert_eq!(Codec::Json.decode::<Name>(&Codec::Json.encode(&text)).is_ok(), good);
    }

    #[test]
    fn a_samples_key_holds_space_and_agent(space in NAME, agent in NAME) {
        let key: AgentKey = samples_key(&space, &agent).parse().unwrap();
        prop_assert_eq!(key.space.as_str(), space);
        prop_assert_eq!(key.agent.as_str(), agent);
    }

    #[test]
    fn a_key_that_parses_is_the_key_that_was_built(
        key in prop_oneof![".{0,40}", "cogmap/[a-z*$@]{0,3}/[a-z*$@]{0,3}/samples", "(cogmap|samples|[a-z/]){0,8}"]
    ) {
        if let Ok(parsed) = key.parse::<AgentKey>() {
            prop_assert_eq!(samples_key(parsed.space.as_str(), parsed.agent.as_str()), key);
        }
    }

    #[test]
    fn other_keys_are_not_samples_keys(space in NAME, agent in NAME) {
        let others = [
            estimate_key(&space, &agent),
            durable_key(&space, &agent),
            events_key(&space),
            query_key(&space, Verb::Recall.as_str()),
            query_key(&space, Verb::Watermark.as_str()),
            query_key(&space, Verb::Predict.as_str()),
        ];
        for key in others {
            prop_assert_eq!(key.parse::<AgentKey>(), Err(KeyError::Shape));
        }
    }
}

#[test]
fn names_are_bounded_in_bytes() {
    assert_eq!(parse(""), Err(NameError::Length(0)));
    assert_eq!(parse("a"), Ok("a".to_owned()));
    assert_eq!(parse(&"a".repeat(64)), Ok("a".repeat(64)));
    assert_eq!(parse(&"a".repeat(65)), Err(NameError::Length(65)));
    assert_eq!(parse(&"é".repeat(40)), Err(NameError::Length(80)));
}

#[test]
fn names_are_one_chunk_of_a_key() {
    for c in [
        '*', '$', '/', '@', '#', '?', ' ', '%', '\0', '\n', 'é', '名',
    ] {
        assert_eq!(parse(&c.to_string()), Err(NameError::Character(c)));
        assert_eq!(parse(&format!("a{c}b")), Err(NameError::Character(c)));
    }
    for c in ['_', '.', '-'] {
        assert_eq!(parse(&format!("{c}a")), Err(NameError::Character(c)));
        assert!(parse(&format!("a{c}")).is_ok());
    }
}

#[test]
fn keys_have_exactly_four_chunks() {
    let refused = |key: &str| key.parse::<AgentKey>().unwrap_err();
    for key in [
        "",
        "cogmap",
        "cogmap/lab/robot",
        "/cogmap/lab/robot/samples",
        "cogmap/lab/robot/samples/",
        "cogmap/lab/robot/samples/samples",
        "cogmap/lab/robot/Samples",
        "Cogmap/lab/robot/samples",
        "cogmap/**/samples",
    ] {
        assert_eq!(refused(key), KeyError::Shape, "{key}");
    }
    assert_eq!(
        refused("cogmap//robot/samples"),
        KeyError::Space(NameError::Length(0))
    );
    assert_eq!(
        refused("cogmap/lab//samples"),
        KeyError::Agent(NameError::Length(0))
    );
    assert_eq!(
        refused("cogmap/*/robot/samples"),
        KeyError::Space(NameError::Character('*'))
    );
    assert_eq!(
        refused("cogmap/lab/$*/samples"),
        KeyError::Agent(NameError::Character('$'))
    );
    assert_eq!(
        refused("cogmap/lab/@r/samples"),
        KeyError::Agent(NameError::Character('@'))
    );
}
