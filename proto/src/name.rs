//! Names that may stand in a key expression and in a URL.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::limits::NAME_BYTES_MAX;

/// A name of a space, an agent or a channel: 1 to 64 of `A-Z a-z 0-9 _ . -`, the first a letter or
/// a digit. Such a name is one chunk of a Zenoh key expression and of a URL path without escaping.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Name(String);

/// Why a text is not a [`Name`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NameError {
    /// It is empty or longer than [`NAME_BYTES_MAX`]; how long \[bytes\].
    #[error("a name has 1 to {NAME_BYTES_MAX} bytes, not {0}")]
    Length(usize),
    /// It has a character that is not allowed there.
    #[error("a name is made of A-Z a-z 0-9 _ . - and starts with a letter or digit, not {0:?}")]
    Character(char),
}

impl Name {
    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// Whether `text` is a name.
    ///
    /// # Errors
    /// Says which rule the text breaks.
    pub fn check(text: &str) -> Result<(), NameError> {
        if text.is_empty() || text.len() > NAME_BYTES_MAX {
            return Err(NameError::Length(text.len()));
        }
        for (at, c) in text.char_indices() {
            let allowed = c.is_ascii_alphanumeric() || (at > 0 && matches!(c, '_' | '.' | '-'));
            if !allowed {
                return Err(NameError::Character(c));
            }
        }
        Ok(())
    }
}

impl FromStr for Name {
    type Err = NameError;

    fn from_str(text: &str) -> Result<Self, NameError> {
        Self::check(text)?;
        Ok(Self(text.to_owned()))
    }
}

impl TryFrom<String> for Name {
    type Error = NameError;

    fn try_from(text: String) -> Result<Self, NameError> {
        Self::check(&text)?;
        Ok(Self(text))
    }
}

impl From<Name> for String {
    fn from(name: Name) -> Self {
        name.0
    }
}

impl AsRef<str> for Name {
    fn as_ref(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}
