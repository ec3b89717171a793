//! Single settings from the environment and from flags.

use toml::{Table, Value};

use super::{Config, ConfigError};

/// What all names of settings in the environment begin with.
const PREFIX: &str = "COGMAP_";
/// What stands between the levels of a key in the environment.
const SEPARATOR: &str = "__";
/// The sections, to tell a misspelt setting from a variable that is none.
const SECTIONS: [&str; 6] = ["HTTP", "ZENOH", "STORE", "ENGINE", "SPACES", "LOG"];

/// A setting of one key.
///
/// In the environment, a name is a setting if it begins with `COGMAP_` and has `__` in it:
/// `COGMAP_ENGINE__AGENTS_MAX` is `engine.agents_max`. Other names are not settings
/// (`COGMAP_CONFIG` names the file), but one that begins with a section's name, like
/// `COGMAP_ENGINE_AGENTS_MAX`, is surely misspelt and refused. Names are read in lower case: spaces
/// with capitals, dots or hyphens in their names need the file.
///
/// A value is read as TOML where that fits the key (`1024`, `true`, `["tcp/a:7447"]`), otherwise as
/// text, so that texts need no quotes, and where the key takes a list of texts as its only item
/// (`tcp/a:7447`).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assignment {
    /// Where it comes from, for errors.
    source: String,
    /// The levels of the key.
    key: Vec<String>,
    value: String,
}

impl Assignment {
    /// The settings of an environment, in the order of their names.
    ///
    /// # Errors
    /// A name is misspelt.
    pub fn of_environment(
        environment: impl IntoIterator<Item = (String, String)>,
    ) -> Result<Vec<Self>, ConfigError> {
        let mut assignments = Vec::new();
        for (name, value) in environment {
            let Some(key) = name.strip_prefix(PREFIX) else {
                continue;
            };
            let source = format!("environment variable {name}");
            if key.contains(SEPARATOR) {
                let key = key
                    .split(SEPARATOR)
                    .map(str::to_ascii_lowercase)
                    .collect::<Vec<_>>();
                assignments.push(Self::new(source, key, value)?);
            } else if let Some(section) = section_of(key) {
                let rest = key[section.len()..].trim_start_matches('_');
                let detail = format!(
                    "two underscores stand between levels: {PREFIX}{section}{SEPARATOR}{rest}"
                );
                return Err(ConfigError::source(&source, &detail));
            }
        }
        assignments.sort_by(|a, b| a.source.cmp(&b.source));
        Ok(assignments)
    }

    /// The setting of a flag `key=value`.
    ///
    /// # Errors
    /// The text has no `=`, or the key is not one.
    pub fn of_flag(text: &str) -> Result<Self, ConfigError> {
        let source = format!("flag {text:?}");
        let Some((key, value)) = text.split_once('=') else {
            return Err(ConfigError::source(&source, &"must be key=value"));
        };
        let key = key.trim().split('.').map(str::to_owned).collect();
        Self::new(source, key, value.to_owned())
    }

    fn new(source: String, key: Vec<String>, value: String) -> Result<Self, ConfigError> {
        if key.len() < 2 || key.iter().any(String::is_empty) {
            let detail = "a key has a section and a name, like http.listen";
            return Err(ConfigError::source(&source, &detail));
        }
        Ok(Self { source, key, value })
    }

    /// The settings of `table` with this one put in.
    pub(super) fn apply(&self, table: &Table) -> Result<(Table, Config), ConfigError> {
        let text = Value::String(self.value.clone());
        let only_item = Value::Array(vec![text.clone()]);
        let candidates = [self.toml_value(), Some(text), Some(only_item)];
        let mut first_error = None;
        for value in candidates.into_iter().flatten() {
            let mut changed = table.clone();
            let outcome = put(&mut changed, &self.key, value)
                .and_then(|()| changed.clone().try_into().map_err(|e| e.to_string()));
            match outcome {
                Ok(config) => return Ok((changed, config)),
                Err(error) => first_error = first_error.or(Some(error)),
            }
        }
        let detail = first_error.expect("a text is always a candidate");
        Err(ConfigError::source(&self.source, &detail))
    }

    fn toml_value(&self) -> Option<Value> {
        let mut document: Table = toml::from_str(&format!("value = {}", self.value)).ok()?;
        // More than one key means that the value broke out of its line.
        (document.len() == 1).then(|| document.remove("value"))?
    }
}

fn section_of(name: &str) -> Option<&'static str> {
    SECTIONS.into_iter().find(|section| {
        name.strip_prefix(section)
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
    })
}

fn put(table: &mut Table, key: &[String], value: Value) -> Result<(), String> {
    let [first, rest @ ..] = key else {
        return Ok(());
    };
    if rest.is_empty() {
        table.insert(first.clone(), value);
        return Ok(());
    }
    let below = table
        .entry(first.clone())
        .or_insert_with(|| Value::Table(Table::new()));
    match below {
        Value::Table(below) => put(below, rest, value),
        _ => Err(format!("{first} is a value and has no keys below it")),
    }
}
