//! Channels that a question names.

use cogmap_proto::{Name, NameError};
use cognitive_map::{ChannelKind, CognitiveMap, PerceptCue};

/// Most channels that an error names.
const NAMED_MAX: usize = 8;

/// Why a channel cannot be asked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidChannel {
    /// The name is none.
    #[error("{0:?}: {1}")]
    Name(String, NameError),
    /// No place remembers anything of it.
    #[error("no place remembers anything of a channel {channel:?}; {known}")]
    Unknown {
        /// The channel.
        channel: String,
        /// The channels that there are.
        known: String,
    },
    /// The channel carries percepts of another kind.
    #[error("the channel {channel:?} carries {carries}")]
    OtherKind {
        /// The channel.
        channel: String,
        /// What it carries.
        carries: String,
    },
}

/// Checks a channel that a question names.
///
/// # Errors
/// The name is none, or no place remembers anything of the channel.
pub(crate) fn check_channel(map: &CognitiveMap, name: &str) -> Result<(), InvalidChannel> {
    let mut channels = map.channels();
    if channels.any(|(_, known)| known.label().as_str() == name) {
        return Ok(());
    }
    Name::check(name).map_err(|error| InvalidChannel::Name(name.to_owned(), error))?;
    let mut known: Vec<_> = map
        .channels()
        .map(|(_, known)| known.label().as_str())
        .collect();
    known.dedup();
    let known = match known.len() {
        0 => "there is no channel yet".to_owned(),
        1..=NAMED_MAX => format!("there are {}", known.join(", ")),
        more => format!("there are {more} others"),
    };
    Err(InvalidChannel::Unknown {
        channel: name.to_owned(),
        known,
    })
}

/// Checks the channel of a percept that places are recalled by.
///
/// # Errors
/// As [`check_channel`], or the channel carries percepts of another kind.
pub(crate) fn check_cue(map: &CognitiveMap, cue: &PerceptCue) -> Result<(), InvalidChannel> {
    let (label, kind) = match cue {
        PerceptCue::Level { channel, .. } => (channel, ChannelKind::Level),
        PerceptCue::Descriptor(descriptor) => {
            let dimension = u16::try_from(descriptor.vector().len())
                .expect("a descriptor has 4096 numbers at most");
            (descriptor.channel(), ChannelKind::Descriptor { dimension })
        }
    };
    check_channel(map, label.as_str())?;
    let kinds: Vec<_> = map
        .channels()
        .filter(|(_, known)| known.label() == label)
        .map(|(_, known)| known.kind())
        .collect();
    if kinds.contains(&kind) {
        return Ok(());
    }
    let carries: Vec<_> = kinds.into_iter().map(carried).collect();
    Err(InvalidChannel::OtherKind {
        channel: label.as_str().to_owned(),
        carries: carries.join(" and "),
    })
}

fn carried(kind: ChannelKind) -> String {
    match kind {
        ChannelKind::Level => "levels".to_owned(),
        ChannelKind::Descriptor { dimension } => format!("descriptors of {dimension} numbers"),
    }
}
