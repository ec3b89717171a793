//! Why a JSON value is not the message that it should be, for somebody who sends it.
//!
//! serde says too little in two cases: of a list in place of an object it blames an item of the
//! list, and of a value in place of a choice it does not name the choices. So another value is
//! tried in its place, and what is said of that one tells what belongs there.

use std::fmt::Write as _;

use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use serde_path_to_error::{Error, Path, Segment};

/// What serde says of a value in place of a choice.
const NO_CHOICE: &str = ", expected string or map";

/// What is wrong with `given`, which is no `T` for this reason.
pub(super) fn of<T: DeserializeOwned>(given: &Value, error: &Error<serde_json::Error>) -> String {
    list_for_object::<T>(given, error.path())
        .or_else(|| other_than_choice::<T>(given, error))
        .unwrap_or_else(|| cogmap_proto::at_field(error.path(), error.inner()))
}

/// Of a list where an object should be.
fn list_for_object<T: DeserializeOwned>(given: &Value, path: &Path) -> Option<String> {
    let parts: Vec<_> = path.iter().collect();
    for (depth, part) in parts.iter().enumerate() {
        if !matches!(part, Segment::Seq { .. }) {
            continue;
        }
        let list = &parts[..depth];
        let field = text_of(list);
        let missing = match tried::<T>(given, list, json!({}))? {
            Ok(()) => String::new(),
            Err(error) if text_of(&parts_of(&error)) != field => String::new(),
            Err(error) => {
                let said = error.inner().to_string();
                let Some(missing) = said.strip_prefix("missing field ") else {
                    continue; // It is a list.
                };
                format!(" with {missing}")
            }
        };
        return Some(at(
            &field,
            &format!("expected an object{missing}, not a list"),
        ));
    }
    None
}

/// Of a value where one of several choices should be.
fn other_than_choice<T: DeserializeOwned>(
    given: &Value,
    error: &Error<serde_json::Error>,
) -> Option<String> {
    let said = error.inner().to_string();
    if !said.ends_with(NO_CHOICE) {
        return None;
    }
    let parts = parts_of(error);
    let unknown = tried::<T>(given, &parts, json!({"?": null}))?.err()?;
    let said = unknown.inner().to_string();
    let choices = said.split_once(", expected ")?.1;
    let first = choices.split('`').nth(1)?;
    let bare = tried::<T>(given, &parts, json!(first))?;
    let needs_content = bare.is_err_and(|error| error.path().iter().count() > parts.len());
    let expected = if needs_content {
        format!("expected an object with {choices}, such as {{\"{first}\": …}}")
    } else {
        format!("expected {choices}")
    };
    Some(at(&text_of(&parts), &expected))
}

fn at(field: &str, what: &str) -> String {
    let field = if field.is_empty() { "the body" } else { field };
    format!("{field}: {what}")
}

/// What is said of the message with another value in one place.
fn tried<T: DeserializeOwned>(
    given: &Value,
    parts: &[&Segment],
    other: Value,
) -> Option<Result<(), Error<serde_json::Error>>> {
    let mut changed = given.clone();
    *value_at(&mut changed, parts)? = other;
    Some(serde_path_to_error::deserialize::<_, T>(&changed).map(drop))
}

fn value_at<'a>(value: &'a mut Value, parts: &[&Segment]) -> Option<&'a mut Value> {
    parts.iter().try_fold(value, |value, part| match part {
        Segment::Seq { index } => value.get_mut(*index),
        Segment::Map { key } => value.get_mut(key),
        Segment::Enum { variant } => value.get_mut(variant),
        Segment::Unknown => None,
    })
}

fn parts_of(error: &Error<serde_json::Error>) -> Vec<&Segment> {
    error.path().iter().collect()
}

/// Parts of a path as text.
fn text_of(parts: &[&Segment]) -> String {
    let mut text = String::new();
    for part in parts {
        let dot = if text.is_empty() || matches!(part, Segment::Seq { .. }) {
            ""
        } else {
            "."
        };
        write!(text, "{dot}{part}").expect("a text takes all that is written");
    }
    text
}

#[cfg(test)]
mod tests {
    use cogmap_proto::{PredictQuery, RouteQuery, SampleBatch};

    use super::*;

    fn refused<T: DeserializeOwned>(given: &Value) -> String {
        let error = serde_path_to_error::deserialize::<_, T>(given).map(drop);
        of::<T>(given, &error.expect_err("no such message"))
    }

    #[test]
    fn what_belongs_in_place_of_another_value_is_told() {
        let route = |to| refused::<RouteQuery>(&json!({"from": {"place": 1}, "to": to}));
        assert_eq!(
            route(json!("home")),
            "to: expected {\"home\": …}, not \"home\" alone"
        );
        let told = route(json!(3));
        assert!(
            told.starts_with("to: expected an object with one of `place`, "),
            "{told}"
        );
        assert!(told.ends_with("such as {\"place\": …}"), "{told}");
        let cost = json!({"from": {"place": 1}, "to": {"place": 2}, "cost": 5});
        assert_eq!(
            refused::<RouteQuery>(&cost),
            "cost: expected one of `length`, `time`, `uncertainty`, `recency`"
        );
        assert_eq!(
            refused::<PredictQuery>(&json!({"motion": {"increment": [1, 0, 0]}})),
            "motion.increment: expected an object with `translation_m`, not a list"
        );
        let body = json!({"increment": {"translation_m": [1, 0], "rotation_xyzw": [0, 0, 0, 1]}});
        let sample = json!({"stamp_ns": 0, "body": body});
        assert_eq!(
            refused::<SampleBatch>(&json!({"session": 1, "first_seq": 0, "samples": [sample]})),
            "samples[0].body.increment.translation_m: expected a list of 3 numbers, \
            not 2 of them"
        );
    }
}
