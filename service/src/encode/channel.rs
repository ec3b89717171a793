//! Channels of percepts.

use cogmap_proto as wire;
use cognitive_map::{Channel, ChannelKind, CognitiveMap, LearnedChannel, ViewChannel};

/// The channels of a map as the wire has them.
pub fn channels(map: &CognitiveMap) -> wire::ChannelList {
    let views: Vec<ViewChannel<'_>> = map.view_channels().collect();
    wire::ChannelList {
        channels: { map.channels() }
            .map(|(_, one)| channel(one, &views))
            .collect(),
    }
}

fn channel(channel: &Channel, views: &[ViewChannel<'_>]) -> wire::Channel {
    let name = channel.label().as_str();
    let ChannelKind::Descriptor { dimension } = channel.kind() else {
        return wire::Channel {
            name: name.to_owned(),
            kind: wire::ChannelKind::Level,
            dimension: None,
            views: None,
            learned: None,
        };
    };
    let seen = { views.iter() }.find(|seen| (seen.name, seen.dimension) == (name, dimension));
    wire::Channel {
        name: name.to_owned(),
        kind: wire::ChannelKind::Descriptor,
        dimension: Some(dimension.into()),
        views: Some(seen.map_or(0, |seen| seen.views as u64)),
        learned: seen.and_then(|seen| seen.learned.as_ref()).map(learned),
    }
}

fn learned(learned: &LearnedChannel) -> wire::LearnedChannel {
    wire::LearnedChannel {
        views: learned.views.into(),
        range_m: learned.range_m,
        information_nats: learned.information_nats,
        independence: learned.independence,
    }
}
