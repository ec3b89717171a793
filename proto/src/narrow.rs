//! Numbers that a message keeps as `f32`.

use serde::{Deserialize, Deserializer};

/// Reads numbers of any size. One beyond `f32` becomes infinite, as everywhere a float is narrowed;
/// the service then refuses the sample that holds it by name, and not the batch around it.
pub(crate) fn vector<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f32>, D::Error> {
    let numbers = Vec::<Narrow>::deserialize(deserializer)?;
    Ok(numbers.into_iter().map(|Narrow(number)| number).collect())
}

struct Narrow(f32);

impl<'de> Deserialize<'de> for Narrow {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if !deserializer.is_human_readable() {
            return f32::deserialize(deserializer).map(Self);
        }
        // Asked for an f32, a text format may call a larger number malformed.
        #[expect(
            clippy::cast_possible_truncation,
            reason = "beyond f32 it becomes infinite"
        )]
        f64::deserialize(deserializer).map(|number| Self(number as f32))
    }
}

#[cfg(test)]
mod tests {
    use crate::{Codec, Descriptor};

    #[test]
    fn a_number_beyond_f32_becomes_infinite() {
        let json = br#"{"channel":"eye","vector":[1e39,-1e39,0.5,3]}"#;
        let read: Descriptor = Codec::Json.decode(json).expect("a descriptor");
        assert_eq!(read.vector, [f32::INFINITY, f32::NEG_INFINITY, 0.5, 3.0]);
    }

    #[test]
    fn every_codec_gives_the_number_back() {
        let vector = vec![f32::MIN_POSITIVE, 0.1, -3.25e-7, f32::MAX, -0.0];
        let sent = Descriptor {
            channel: "eye".to_owned(),
            vector,
        };
        for codec in [Codec::Postcard, Codec::Cbor, Codec::Json] {
            let read: Descriptor = codec.decode(&codec.encode(&sent)).expect("a descriptor");
            let bits = |of: &Descriptor| of.vector.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&read), bits(&sent), "{codec:?}");
        }
    }
}
