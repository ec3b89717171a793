//! Channels of percepts.

use cogmap_proto as wire;
use cognitive_map::{
    AgentId, Channel, ChannelKind, CognitiveMap, LearnedChannel, LearnedCompass, ViewChannel,
};

/// The channels of a map as the wire has them.
pub fn channels(map: &CognitiveMap) -> wire::ChannelList {
    let views: Vec<ViewChannel<'_>> = map.view_channels().collect();
    wire::ChannelList {
        channels: { map.channels() }
            .map(|(_, one)| channel(map, one, &views))
            .collect(),
    }
}

fn channel(map: &CognitiveMap, channel: &Channel, views: &[ViewChannel<'_>]) -> wire::Channel {
    let name = channel.label().as_str();
    let ChannelKind::Descriptor { dimension } = channel.kind() else {
        return wire::Channel {
            name: name.to_owned(),
            kind: wire::ChannelKind::Level,
            dimension: None,
            views: None,
            learned: None,
            compass: { channel.compass() }.map(|learned| compass(map, &learned)),
        };
    };
    let seen = { views.iter() }.find(|seen| (seen.name, seen.dimension) == (name, dimension));
    wire::Channel {
        name: name.to_owned(),
        kind: wire::ChannelKind::Descriptor,
        dimension: Some(dimension.into()),
        views: Some(seen.map_or(0, |seen| seen.views as u64)),
        learned: seen.and_then(|seen| seen.learned.as_ref()).map(learned),
        compass: None,
    }
}

fn learned(learned: &LearnedChannel) -> wire::LearnedChannel {
    wire::LearnedChannel {
        views: learned.views.into(),
        range_m: learned.range_m,
        information_nats: learned.information_nats,
        independence: learned.independence,
        turned: *learned.turned.parts(),
        coarse: learned.is_coarse,
    }
}

fn compass(map: &CognitiveMap, learned: &LearnedCompass) -> wire::Compass {
    let taught_alone = learned.agent.and_then(|agent| map.agent(AgentId(agent)));
    wire::Compass {
        rad_per_unit: learned.model.rad_per_unit(),
        offset_rad: learned.model.offset_rad(),
        lasting_sd_rad: learned.model.lasting_rad2().sqrt(),
        noise_sd_rad: learned.model.noise_rad2().sqrt(),
        agent: taught_alone.map(|agent| agent.name().as_str().to_owned()),
    }
}
