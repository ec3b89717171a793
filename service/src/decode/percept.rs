//! Percepts: levels and descriptors.

use cogmap_proto as wire;
use cognitive_map::{Descriptor, InvalidSample, Label, PerceptCue};

/// Reads a percept that is a cue.
///
/// # Errors
/// Says why it makes no sense.
pub(super) fn percept(cue: &wire::PerceptCue) -> Result<PerceptCue, InvalidSample> {
    Ok(match cue {
        wire::PerceptCue::Level(level) => {
            let channel = Label::new(&level.channel)?;
            let value = level.value;
            if !value.is_finite() {
                return Err(InvalidSample::NumberOutOfRange);
            }
            PerceptCue::Level { channel, value }
        }
        wire::PerceptCue::Descriptor(body) => PerceptCue::Descriptor(descriptor(body)?),
    })
}

pub(super) fn descriptor(body: &wire::Descriptor) -> Result<Descriptor, InvalidSample> {
    Descriptor::new(Label::new(&body.channel)?, &body.vector)
}
