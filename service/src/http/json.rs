//! JSON bodies, read as their schemas say rather than as serde would.
//!
//! To JSON Schema `1.0` is an integer, and some languages write integers so; to serde it is not.
//! And serde takes an array for an object, which no schema here does.

use cogmap_proto::{Codec, DecodeError, SampleBatch};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::problem::{Kind, Problem};
use super::refusal;

/// Largest number up to which every integer has a float of its own.
const FLOAT_INTEGER_MAX: f64 = 9_007_199_254_740_992.0;

/// A JSON text as a message. What cannot be read is refused by the name of its field.
pub(crate) fn message<T: DeserializeOwned + Serialize>(bytes: &[u8]) -> Result<T, Problem> {
    let malformed = |detail: String| Problem::new(Kind::MalformedBody, detail);
    let mut given = value(bytes).map_err(malformed)?;
    make_whole_numbers_integers(&mut given);
    let message: T = serde_path_to_error::deserialize(&given)
        .map_err(|error| malformed(refusal::of::<T>(&given, &error)))?;
    let written = serde_json::to_value(&message).map_err(|error| malformed(error.to_string()))?;
    if let Some(mut path) = array_for_object(&given, &written) {
        path.reverse();
        let field = if path.is_empty() {
            "the body".to_owned()
        } else {
            path.join(".")
        };
        return Err(malformed(format!(
            "{field}: expected an object, not a list"
        )));
    }
    Ok(message)
}

/// A text as JSON.
fn value(bytes: &[u8]) -> Result<Value, String> {
    if bytes.trim_ascii().is_empty() {
        return Err("the body is empty".to_owned());
    }
    serde_json::from_slice(bytes).map_err(|error| format!("the body is no JSON: {error}"))
}

/// Where an array stands in `given` for an object, innermost part first: serde takes one for the
/// fields in their order, and an empty one for no fields at all, which nobody means.
fn array_for_object(given: &Value, written: &Value) -> Option<Vec<String>> {
    let within = |part: String, given, written| {
        let mut path = array_for_object(given, written)?;
        path.push(part);
        Some(path)
    };
    match (given, written) {
        (Value::Array(_), Value::Object(_)) => Some(Vec::new()),
        (Value::Array(given), Value::Array(written)) => (0..)
            .zip(given.iter().zip(written))
            .find_map(|(at, (given, written))| within(at.to_string(), given, written)),
        (Value::Object(given), Value::Object(written)) => given
            .iter()
            .find_map(|(key, given)| within(key.clone(), given, written.get(key)?)),
        _ => None,
    }
}

/// A batch of samples. What serde can read directly takes no detour.
pub(crate) fn batch(bytes: &[u8]) -> Result<SampleBatch, DecodeError> {
    let malformed = |detail: String| DecodeError::Malformed {
        codec: Codec::Json.name(),
        detail,
    };
    let array = bytes.trim_ascii_start().first() == Some(&b'[');
    if array {
        return Err(malformed("a batch is an object, not an array".to_owned()));
    }
    let direct = Codec::Json.decode_batch(bytes);
    if !matches!(direct, Err(DecodeError::Malformed { .. })) {
        return direct;
    }
    let mut value = value(bytes).map_err(malformed)?;
    make_whole_numbers_integers(&mut value);
    let Err(error) = serde_path_to_error::deserialize::<_, SampleBatch>(&value) else {
        // A bound that it breaks is told as of any other batch.
        return Codec::Json.decode_batch(value.to_string().as_bytes());
    };
    Err(malformed(refusal::of::<SampleBatch>(&value, &error)))
}

fn make_whole_numbers_integers(value: &mut Value) {
    match value {
        Value::Number(number) => {
            let float = number.as_f64().filter(|_| number.is_f64());
            if let Some(float) = float
                && float.fract() == 0.0
                && float.abs() <= FLOAT_INTEGER_MAX
            {
                #[expect(clippy::cast_possible_truncation, reason = "whole and within 2⁵³")]
                let integer = float as i64;
                *value = integer.into();
            }
        }
        Value::Array(items) => items.iter_mut().for_each(make_whole_numbers_integers),
        Value::Object(object) => object.values_mut().for_each(make_whole_numbers_integers),
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

#[cfg(test)]
mod tests {
    use cogmap_proto::{RecallQuery, SpaceSettings};

    use super::*;

    #[test]
    fn whole_floats_are_integers_and_others_are_not() {
        let read = |text: &str| message::<RecallQuery>(text.as_bytes());
        let query = read("{\"since_ns\": -3.0, \"position_m\": [1.0, 2, 0.5]}").expect("legal");
        assert_eq!(
            (query.since_ns, query.position_m),
            (Some(-3), Some([1.0, 2.0, 0.5]))
        );
        assert!(read("{\"since_ns\": 0.5}").is_err());
        assert!(read("{\"since_ns\": 1e300}").is_err());
        let text = b"{\"session\": 1.0, \"first_seq\": 2.0, \"samples\": [{\"stamp_ns\": 3.0, \
            \"body\": {\"marker\": {\"label\": \"a\"}}}]}";
        let batch = batch(text).expect("legal");
        assert_eq!(
            (batch.session, batch.first_seq, batch.samples[0].stamp_ns),
            (1, 2, 3)
        );
    }

    #[test]
    fn arrays_are_not_objects_at_any_depth() {
        let read = |text: &str| message::<SpaceSettings>(text.as_bytes());
        assert!(read("{\"odometry_noise\": {}}").is_ok());
        assert!(read("[]").is_err());
        assert!(read("{\"odometry_noise\": []}").is_err());
        assert!(batch(b" [1, 0, [{\"stamp_ns\": 0, \"body\": {\"marker\": [\"a\"]}}]]").is_err());
    }
}
