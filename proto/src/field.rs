//! The field for which a body cannot be read.

use std::fmt::Display;

use serde::de::{Deserialize, Deserializer};
use serde_path_to_error::Path;

use crate::wording::{is_bare_name, plain};

/// What is wrong at a field, with the field's path before it where there is one, as in
/// `samples[3].body.level.value: expected a number, not the text "x"`.
pub fn at_field(path: &Path, error: &impl Display) -> String {
    let error = error.to_string();
    if path.iter().next().is_none() {
        return plain(&error);
    }
    let path = path.to_string();
    if !is_bare_name(&error) {
        return format!("{path}: {}", plain(&error));
    }
    // The last part of the path is the name.
    let (field, name) = path.rsplit_once('.').unwrap_or(("", &path));
    let colon = if field.is_empty() { "" } else { ": " };
    format!("{field}{colon}expected {{\"{name}\": …}}, not \"{name}\" alone")
}

/// The path of the field for which a message cannot be read. Reads the message a second time, so
/// that those that can be read pay nothing for it.
pub(crate) fn refused<'de, T, D>(deserializer: D) -> Option<Path>
where
    T: Deserialize<'de>,
    D: Deserializer<'de>,
{
    let error = serde_path_to_error::deserialize::<D, T>(deserializer).err()?;
    Some(error.path().clone())
}
