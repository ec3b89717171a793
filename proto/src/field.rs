//! The field for which a body cannot be read.

use std::fmt::Display;

use serde::de::{Deserialize, Deserializer};
use serde_path_to_error::Path;

/// What is wrong at a field, with the field's path before it where there is one, as in
/// `samples[3].body.level.value: invalid type: string "x", expected f64`.
pub fn at_field(path: &Path, error: &impl Display) -> String {
    match path.iter().next() {
        Some(_) => format!("{path}: {error}"),
        None => error.to_string(),
    }
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
