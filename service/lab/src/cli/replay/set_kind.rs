//! How a set of recordings is measured, told by what it holds.

use std::collections::BTreeSet;

use cogmap_lab::csv::{Log, RowBody, TableSet};

/// A set of more agents than this, all with views, is one of many sessions at one site.
const SESSIONS_MIN: usize = 50;

/// How a set is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SetKind {
    /// Each agent is told where it starts, in a space of its own: what is its motion worth when it
    /// is corrected by what it senses?
    Told,
    /// Many sessions at one site: most are told where they start, the others wake up unknown.
    Sessions,
    /// Several agents on one route, whose motion tells no more than how far they went: one is
    /// remembered, the others are recognised by their views.
    Route,
}

impl SetKind {
    /// Of the agents whose truth is known, without some channels.
    ///
    /// Agents are on one route where no motion turns or goes aside and all have views of a channel
    /// in common. Frames of a film are such a set, and views without any motion.
    pub(super) fn of(set: &TableSet, without: &BTreeSet<String>) -> Self {
        let known = set.agents.values().filter(|log| log.truth.is_some());
        let known: Vec<&Log> = known.collect();
        let seen: Vec<BTreeSet<&str>> = { known.iter() }
            .map(|log| channels_of(log, without))
            .collect();
        let in_common = { seen.iter().cloned() }.reduce(|one, other| &one & &other);
        let has_common = in_common.is_some_and(|channels| !channels.is_empty());
        if known.len() > 1 && has_common && known.iter().all(|log| is_straight(log)) {
            return Self::Route;
        }
        let n_seeing = seen.iter().filter(|channels| !channels.is_empty()).count();
        if n_seeing > SESSIONS_MIN {
            Self::Sessions
        } else {
            Self::Told
        }
    }
}

/// The channels of an agent's views.
fn channels_of<'a>(log: &'a Log, without: &BTreeSet<String>) -> BTreeSet<&'a str> {
    let channels = log.rows.iter().filter_map(|row| match &row.body {
        RowBody::Descriptor(channel, _) => Some(channel.as_str()),
        _ => None,
    });
    channels
        .filter(|channel| !without.contains(*channel))
        .collect()
}

/// Whether an agent's motions lead straight on, if there are any.
fn is_straight(log: &Log) -> bool {
    log.rows.iter().all(|row| match &row.body {
        RowBody::Increment(motion, _) => {
            motion.rotation.angle() == 0.0 && motion.translation.y == 0.0
        }
        RowBody::Velocity([linear, angular], _) => angular.z == 0.0 && linear.y == 0.0,
        _ => true,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    fn kind(agents: usize, motion: &str, without: &[&str]) -> SetKind {
        let (mut samples, mut truth) = (
            "t_s,agent,kind\n".to_owned(),
            "t_s,agent,x,y,z,yaw\n".to_owned(),
        );
        for agent in 0..agents {
            writeln!(
                samples,
                "0,a{agent},descriptor,camera,0\n1,a{agent},{motion}"
            )
            .unwrap();
            writeln!(truth, "0,a{agent},0,0,0,,\n1,a{agent},1,0,0,,").unwrap();
        }
        let without = without.iter().map(|&name| name.to_owned()).collect();
        SetKind::of(&TableSet::read(&samples, &truth).unwrap(), &without)
    }

    #[test]
    fn sets_are_told_by_their_motions_and_views() {
        let turning = "velocity,1,0,0.1,1";
        assert_eq!(kind(3, turning, &[]), SetKind::Told);
        assert_eq!(kind(51, turning, &[]), SetKind::Sessions);
        assert_eq!(kind(51, turning, &["camera"]), SetKind::Told);
        for straight in [
            "increment,10,0,0,0,0.2,0,0.001",
            "velocity,1,0,0,1",
            "level,light,3",
        ] {
            assert_eq!(kind(3, straight, &[]), SetKind::Route);
            assert_eq!(kind(1, straight, &[]), SetKind::Told);
            assert_eq!(kind(3, straight, &["camera"]), SetKind::Told);
        }
        assert_eq!(
            kind(3, "increment,10,0.1,0,0,0.2,0,0.001", &[]),
            SetKind::Told
        );
    }
}
