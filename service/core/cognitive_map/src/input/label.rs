//! Labels: names of landmarks, channels, agents, objects and markers.

use super::InvalidSample;
use state::{CorruptState, State, StateReader, StateWriter};

/// Longest label \[bytes\].
const LABEL_BYTES_MAX: usize = 128;

/// A label of a landmark, a channel or a marker: 1 to 128 bytes without control characters.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Label(Box<str>);

impl Label {
    /// # Errors
    /// The text is empty, too long or has control characters.
    pub fn new(text: &str) -> Result<Self, InvalidSample> {
        if text.is_empty() || text.len() > LABEL_BYTES_MAX || text.chars().any(char::is_control) {
            return Err(InvalidSample::InvalidLabel);
        }
        Ok(Self(text.into()))
    }

    /// The text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl State for Label {
    fn write(&self, out: &mut StateWriter) {
        // Labels are at most 128 bytes long.
        u8::try_from(self.as_str().len())
            .expect("a label's length fits a byte")
            .write(out);
        out.extend(self.as_str().as_bytes());
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let len = u8::read(input)?;
        let text = std::str::from_utf8(input.take(len.into())?);
        text.ok()
            .and_then(|text| Self::new(text).ok())
            .ok_or(CorruptState::Invalid)
    }
}
