//! Names of agents, channels and objects.

use cogmap_proto::Name;
use cognitive_map::{InvalidSample, Label};

/// Checks the name of a channel or an agent.
pub(super) fn check_name(name: &str) -> Result<(), InvalidSample> {
    Name::check(name).map_err(|_| InvalidSample::InvalidLabel)
}

/// Reads the name of an object. `identify` is reserved: it would collide with the route.
///
/// # Errors
/// It is reserved, or not a label.
pub(super) fn object_name(name: &str) -> Result<Label, InvalidSample> {
    if name == "identify" {
        return Err(InvalidSample::InvalidLabel);
    }
    Label::new(name)
}
