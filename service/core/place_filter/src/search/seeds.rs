//! Poses at which a refinement begins.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use state::state_of_struct;

use super::Seeker;
use crate::field::Field;
use crate::kernel::Kernel;
use crate::tuning::search as tuning;
use crate::window::{Felt, Node};

/// A place that remembers levels as they were sensed at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Anchor {
    pub(super) log_odds: f64,
    pub(super) place: u32,
    /// Which of the nodes at which places are looked for.
    pub(super) node: u8,
}

state_of_struct!(Anchor {
    log_odds,
    place,
    node
});

/// A pose of the frame of motion with its log odds \[nats\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seed {
    pub(super) log_odds: f64,
    pub(super) pose: Isometry3<f64>,
}

state_of_struct!(Seed { log_odds, pose });

/// The nodes at which places are looked for: the latest, and some all along the way before it,
/// since there may be no place about one of them.
pub(super) fn corners<'a>(used: &[&'a Node], length_m: f64) -> Vec<&'a Node> {
    let mut corners: Vec<&Node> = Vec::with_capacity(tuning::CORNERS);
    let (Some(first), Some(latest)) = (used.first(), used.last()) else {
        return corners;
    };
    let spread_m = (latest.way_m - first.way_m) / (tuning::CORNERS - 1) as f64;
    // Ways are sums of steps: what is apart by rounding is apart.
    let apart_m = spread_m.max(tuning::CORNERS_APART * length_m) * (1.0 - 1e-9);
    for &node in used.iter().rev() {
        let is_apart = |other: &&Node| other.way_m - node.way_m >= apart_m;
        if corners.len() < tuning::CORNERS && corners.last().is_none_or(is_apart) {
            corners.push(node);
        }
    }
    corners
}

/// Looks at the next places for those that best explain the levels of some nodes; answers the place
/// to go on with, if there are more.
pub(super) fn scan(
    anchors: &mut Vec<Anchor>,
    first: u32,
    corners: &[&Node],
    length_m: f64,
    field: &dyn Field,
) -> Option<u32> {
    let beside = (tuning::BESIDE * length_m).powi(2);
    // No anchor that would not be kept.
    let mut least = [1.0; tuning::CORNERS];
    for (number, least) in (0u8..).zip(&mut least) {
        let own = anchors.iter().filter(|anchor| anchor.node == number);
        if let Some(last) = own.skip(tuning::ANCHORS - 1).last() {
            *least = last.log_odds.exp();
        }
    }
    let channels = channels(corners, beside, field);
    let asked: Vec<Vec<Asked<'_>>> = { corners.iter() }
        .map(|node| Asked::all(node, &channels))
        .collect();
    let mut values: Vec<Option<f64>> = Vec::with_capacity(channels.len());
    let mut last = None;
    let mut count = 0;
    for place in field.places_from(first).take(tuning::SCANNED as usize) {
        (last, count) = (Some(place), count + 1);
        values.clear();
        let level = |(channel, _): &(u8, Alike)| field.level(place, *channel);
        values.extend(channels.iter().map(level));
        for ((node, asked), least) in (0u8..).zip(&asked).zip(least) {
            let mut odds = 1.0;
            for asked in asked {
                odds *= values[asked.channel].map_or(1.0, |value| asked.odds(value));
                // Most places are out of the question by one or two of their levels.
                if odds * asked.rest <= least {
                    odds = 0.0;
                    break;
                }
            }
            if odds > least {
                anchors.push(Anchor {
                    log_odds: odds.ln(),
                    place,
                    node,
                });
            }
        }
    }
    let by_node = |anchor: &Anchor| anchor.node;
    anchors.sort_by(|a, b| {
        let by_odds = b.log_odds.total_cmp(&a.log_odds);
        let by_node = by_node(a).cmp(&by_node(b));
        by_node.then(by_odds).then(a.place.cmp(&b.place))
    });
    let mut kept = [0; tuning::CORNERS];
    anchors.retain(|anchor| {
        let kept = kept.get_mut(usize::from(anchor.node));
        kept.is_some_and(|kept| {
            *kept += 1;
            *kept <= tuning::ANCHORS
        })
    });
    last.filter(|_| count == tuning::SCANNED)?.checked_add(1)
}

/// Adds the poses that put a node beside its anchor, with each of some headings.
pub(super) fn turn(
    anchor: &Anchor,
    used: &[&Node],
    seeker: &Seeker<'_>,
    field: &dyn Field,
    length_m: f64,
    seeds: &mut Vec<Seed>,
) {
    let corners = corners(used, length_m);
    let Some(&node) = corners.get(usize::from(anchor.node)) else {
        return;
    };
    let Some(first) = node.felt.first() else {
        return;
    };
    let of_channel = |felt: &Felt| field.support(anchor.place, felt.channel);
    let Some(at) = node.felt.iter().find_map(of_channel) else {
        return;
    };
    let checks = checks(node, used, length_m);
    for upright in seeker.upright {
        for turn in 0..tuning::HEADINGS {
            let angle = TAU * f64::from(turn) / f64::from(tuning::HEADINGS);
            let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
            let rotation = heading * upright;
            let shift = at.at.coords - rotation * first.at.coords;
            let pose = Isometry3::from_parts(Translation3::from(shift), rotation);
            let checked = check(&pose, &checks, field);
            seeds.extend(checked.map(|odds| Seed {
                log_odds: anchor.log_odds + odds,
                pose,
            }));
        }
    }
}

/// The nodes by which a seed is judged, with the squared distance by which it may be off there
/// \[m²\]. The farthest from the corner come first: they tell most about its heading, but for those
/// where a heading between two that are tried is nowhere near.
fn checks<'a>(corner: &Node, used: &[&'a Node], length_m: f64) -> Vec<(&'a Node, f64)> {
    let apart_m = |node: &Node| (corner.way_m - node.way_m).abs();
    let range_m = tuning::CHECK_REACH.map(|lengths| lengths * length_m);
    let near = used.iter().copied();
    let mut near: Vec<&Node> = near
        .filter(|node| (range_m[0]..=range_m[1]).contains(&apart_m(node)))
        .collect();
    near.sort_by(|a, b| apart_m(b).total_cmp(&apart_m(a)));
    let count = near.len().min(tuning::CHECKS);
    // Deviation of a heading from the nearest that is tried.
    let turn_sd_rad = TAU / f64::from(tuning::HEADINGS) / 12.0_f64.sqrt();
    let of = |node: &'a Node| {
        let beside_m = tuning::CHECK_BESIDE * tuning::BESIDE * length_m;
        (
            node,
            beside_m.powi(2) + (turn_sd_rad * apart_m(node)).powi(2),
        )
    };
    let chosen = (0..count).map(|k| near[k * near.len() / count]);
    chosen.map(of).collect()
}

/// The channels of some nodes, with how levels at a squared distance go together \[m²\].
fn channels(nodes: &[&Node], squared_m2: f64, field: &dyn Field) -> Vec<(u8, Alike)> {
    let mut channels: Vec<(u8, Alike)> = Vec::new();
    for felt in nodes.iter().flat_map(|node| &node.felt) {
        if let Some(kernel) = field.kernel(felt.channel)
            && channels.iter().all(|(channel, _)| *channel != felt.channel)
        {
            channels.push((felt.channel, Alike::new(kernel, squared_m2)));
        }
    }
    channels
}

/// How two levels of a channel go together at some distance.
struct Alike {
    kernel: Kernel,
    correlation: f64,
    /// Variance of one level by the other, and of one alone.
    variance: f64,
    anywhere: f64,
    /// Odds of a level that is as it is expected and as anywhere.
    odds: f64,
}

impl Alike {
    fn new(kernel: &Kernel, squared_m2: f64) -> Self {
        let correlation = kernel.covariance(squared_m2) / kernel.sill;
        let variance = kernel.sill * (1.0 - correlation * correlation) + 2.0 * kernel.nugget;
        let anywhere = kernel.sill + kernel.nugget;
        Self {
            kernel: *kernel,
            correlation,
            variance,
            anywhere,
            odds: (1.0 - tuning::WRONG_LEVEL) * (anywhere / variance).sqrt(),
        }
    }

    /// Odds of a level against anywhere, by the one that a place remembers.
    fn odds(&self, value: f64, remembered: f64) -> f64 {
        let kernel = &self.kernel;
        let off = value - kernel.mean - self.correlation * (remembered - kernel.mean);
        self.odds_of(value, off * off / self.variance)
    }

    /// The same of a level that is off from what is expected by a square, in its variance.
    fn odds_of(&self, value: f64, squared: f64) -> f64 {
        let far = value - self.kernel.mean;
        let there = far * far / self.anywhere;
        self.odds * (0.5 * (there - squared)).exp() + tuning::WRONG_LEVEL
    }
}

/// A level of a node, of which each place is asked.
struct Asked<'a> {
    /// Which of the channels.
    channel: usize,
    alike: &'a Alike,
    value: f64,
    /// Largest odds that the levels after this one may have together.
    rest: f64,
}

impl<'a> Asked<'a> {
    /// The levels of a node.
    fn all(node: &Node, channels: &'a [(u8, Alike)]) -> Vec<Self> {
        let asked = node.felt.iter().filter_map(|felt| {
            let channel = channels.iter().position(|own| own.0 == felt.channel)?;
            Some(Self {
                channel,
                alike: &channels[channel].1,
                value: felt.value,
                rest: 1.0,
            })
        });
        let mut all: Vec<Self> = asked.collect();
        let mut rest = 1.0;
        for asked in all.iter_mut().rev() {
            asked.rest = rest;
            rest *= asked.alike.odds_of(asked.value, 0.0).max(1.0);
        }
        all
    }

    /// Its odds by the level that a place remembers.
    fn odds(&self, remembered: f64) -> f64 {
        self.alike.odds(self.value, remembered)
    }
}

/// Log odds of a pose by a few nodes; `None` where they speak against it.
fn check(pose: &Isometry3<f64>, checks: &[(&Node, f64)], field: &dyn Field) -> Option<f64> {
    let mut odds = 1.0;
    for (node, off_m2) in checks {
        let Some(first) = node.felt.first() else {
            continue;
        };
        let at: Point3<f64> = pose * first.at;
        let Some(place) = field.nearest(&at) else {
            continue;
        };
        for felt in &node.felt {
            if let Some(support) = field.support(place, felt.channel)
                && let Some(kernel) = field.kernel(felt.channel)
            {
                let squared = (support.at - pose * felt.at).norm_squared() + off_m2;
                odds *= Alike::new(kernel, squared).odds(felt.value, support.value);
            }
        }
        if odds < tuning::AGAINST_SEED {
            return None;
        }
    }
    Some(odds.ln())
}
