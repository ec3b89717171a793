//! Matches of views: what the whole map says of which views are of one place, and they of it.

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::{Isometry3, Point3};
use place_recognition::{SampleKey, Similarity, ViewLog, ViewMatch};

use super::agent_track::AgentTrack;
use super::chains::Chains;
use super::graph::KeyframeGraph;
use super::keyframe::Keyframe;
use super::matching::{Matching, ViewMatches};
use super::problem::{Among, Calibrating, Problem};
use super::relaxation::RelaxationCopy;
use super::tuning;
use geometry::is_somewhere;
use pose_graph::{Calibration, RelaxationSettings};

/// A copy of the graph, relaxed by matches of views.
struct Matched {
    copy: RelaxationCopy,
    /// Log of how probable the views and the odometry are by it, up to a constant.
    log_probability: f64,
    /// How probable the best other map has to be.
    log_probability_needed: f64,
}

impl RelaxationCopy {
    /// Matches the views of a log anew, where the keyframes are now and where they would be by
    /// odometry with one veer or another, and takes over the map by which views and odometry are
    /// most probable. One without any match is among them: views that say nothing change nothing.
    /// Answers whether the matches have changed.
    ///
    /// Another map than that of odometry has to be more probable by the Bayesian information
    /// criterion of a fold: it has three degrees of freedom, and of many folds that are possible
    /// one is always the most probable.
    ///
    /// The best map may have its views matched once more, closely ([`Matching`]), as long as that
    /// loses less than half of what tells two maps apart.
    ///
    /// Where the noise of rotations is not stated, maps are matched with each that is tried, and
    /// the noise is taken by which all maps near the best one are most probable together (the
    /// evidence of the model: `MacKay` 1992): too much lets a map fold onto itself, too little
    /// keeps to odometry's. A map that has held is given up for odometry's only if that is so with
    /// each noise.
    ///
    /// Beyond the most keyframes of [`Matching`], maps are compared by some of them, evenly spaced.
    /// Those between move with the one before.
    pub(super) fn match_views(&mut self, log: &ViewLog, matching: &Matching) -> bool {
        let held = Arc::clone(&self.graph().matches);
        let channels = self.learned_channels(log, matching);
        let ranges = channels.iter().map(|channel| channel.learned().range_m);
        let before = Arc::clone(&self.graph().matches);
        if before.is_empty() && self.accepted().next().is_none() {
            self.set_turn_noise(1.0); // nothing is left that told another
        }
        let Some(range_m) = ranges.min_by(f64::total_cmp) else {
            return before != held;
        };
        let n_views: usize = { channels.iter() }
            .map(|channel| channel.samples().count())
            .sum();
        let another_map = 1.5 * (n_views as f64).ln();
        if matching.needs_news && before.is_empty() {
            let news: f64 = channels.iter().map(Similarity::news_nats).sum();
            if news < another_map {
                return before != held;
            }
        }
        let thinned = self.thinned(tuning::MATCHED_STEP * range_m, matching.keyframes_max);
        let maps = thinned.noises().into_iter().map(|noise| {
            let thinned = thinned.with_turn_noise(noise);
            thinned.best_map(matching, &channels, &before, another_map)
        });
        let keeps = |one: &Matched| before.is_empty() || one.n_matches() > 0;
        let more_evident = |one: Matched, other: Matched| {
            let is_more = if keeps(&one) == keeps(&other) {
                other.log_evidence(another_map) > one.log_evidence(another_map)
            } else {
                keeps(&other)
            };
            if is_more { other } else { one }
        };
        let Some(mut best) = maps.reduce(more_evident) else {
            return before != held;
        };
        if before.is_empty() && best.copy.graph().matches.is_empty() {
            return before != held;
        }
        let needed = best.log_probability_needed;
        let least = needed.max(best.log_probability - 0.5 * another_map);
        for _ in 0..matching.close_matchings {
            match best.matched_closely(&channels) {
                Some(closer) if closer.log_probability > least => best = closer,
                _ => break,
            }
        }
        self.adopt_thinned(&best.copy);
        self.graph().matches != held
    }

    /// The channels of a log that say where a robot is, learned anew. What has turned out to say so
    /// little no longer holds the map.
    fn learned_channels<'a>(
        &mut self,
        log: &'a ViewLog,
        matching: &Matching,
    ) -> Vec<Similarity<'a>> {
        let channels = Similarity::of_channels(log, matching.views_max);
        let before = Arc::clone(&self.graph().learned);
        let learned = |channel: &Similarity<'_>| channel.learned().after(&before);
        self.set_learned(channels.iter().map(learned).collect());
        let is_fine = |channel: &Similarity<'_>| !learned(channel).is_coarse;
        let (channels, coarse): (Vec<_>, Vec<_>) = channels.into_iter().partition(is_fine);
        let coarse = coarse.iter().map(|channel| channel.learned().channel);
        let coarse: BTreeSet<SampleKey> = coarse.flat_map(|one| log.samples_of(one)).collect();
        let is_of_fine = |matched: &&ViewMatch| !coarse.contains(&matched.now);
        let fine = self.graph().matches.iter().filter(is_of_fine).copied();
        self.set_matches(fine.collect());
        let view_maps = channels.iter().map(|channel| channel.view_map().clone());
        self.set_view_maps(view_maps.collect());
        channels
    }

    /// The noises of rotations with which the map is matched, as factors of what is assumed: more
    /// than one where an agent's noise is stated by nobody, and not learned from closures.
    fn noises(&self) -> Vec<Option<f64>> {
        let is_open = self
            .graph()
            .chains
            .tracks
            .iter()
            .any(|one| !one.states_noise);
        if is_open && self.accepted().next().is_none() {
            let tried = tuning::MATCHED_TURN_NOISES.iter();
            tried.copied().map(Some).collect()
        } else {
            vec![None]
        }
    }

    /// A copy with another noise of the rotations whose noise is not stated.
    fn with_turn_noise(&self, noise: Option<f64>) -> Self {
        let mut copy = self.clone();
        if let Some(noise) = noise {
            copy.set_turn_noise(noise);
        }
        copy
    }

    /// The map by which views and odometry are most probable: that of odometry, that of the matches
    /// before, or one that is found from a start and more probable by `another_map` nats. That of
    /// the matches before gives way to one with more of them ([`Matching::prefers_more`]): views
    /// that came since are in no match before.
    fn best_map(
        &self,
        matching: &Matching,
        channels: &[Similarity<'_>],
        before: &ViewMatches,
        another_map: f64,
    ) -> Matched {
        let mut best = self.unmatched(channels);
        let needed = best.log_probability + another_map;
        if !before.is_empty() {
            let as_before = self.with_matches(Arc::clone(before), &[1.0], channels);
            if as_before.log_probability > best.log_probability {
                best = as_before;
            }
        }
        let mut holds = best.n_matches() > 0;
        for start in self.starts(matching, channels, 2.0 * another_map) {
            let other = start.gated(channels);
            let has_more = holds && other.n_matches() > best.n_matches();
            let admitted = if has_more && matching.prefers_more {
                0.5 * another_map
            } else {
                0.0
            };
            if other.log_probability > needed.max(best.log_probability - admitted) {
                (best, holds) = (other, false);
            }
        }
        best.log_probability_needed = needed;
        best
    }

    /// The map of odometry, and of what closures say.
    ///
    /// Without closures it is where dead reckoning leads. A relaxation from a map that views have
    /// bent would have to unbend it first, and stops on the way.
    fn unmatched(&self, channels: &[Similarity<'_>]) -> Matched {
        let start = if self.accepted().next().is_none() {
            self.dead_reckoned(0.0)
        } else {
            self.clone()
        };
        start.with_matches(Arc::default(), &[1.0], channels)
    }

    /// Copies relaxed by matches that were found wherever their keyframes are, from where they are
    /// now and where they would be by odometry with each veer: those that are different maps, and
    /// as probable as the best up to `margin_nats`.
    fn starts(
        &self,
        matching: &Matching,
        channels: &[Similarity<'_>],
        margin_nats: f64,
    ) -> Vec<Matched> {
        let ranges = channels.iter().map(|channel| channel.learned().range_m);
        let step_m = tuning::MATCHED_STEP * ranges.fold(f64::INFINITY, f64::min);
        let all: ViewMatches = channels.iter().flat_map(Similarity::matches).collect();
        let by_odometry = { matching.veers.iter() }.map(|&veer| self.dead_reckoned(veer));
        let mut starts: Vec<Matched> = Vec::new();
        for start in std::iter::once(self.clone()).chain(by_odometry) {
            let start = start.with_matches(Arc::clone(&all), matching.widths, channels);
            let is_same = |other: &Matched| other.is_within(&start, step_m);
            if !starts.iter().any(is_same) {
                starts.push(start);
            }
        }
        let most = { starts.iter() }.map(|start| start.log_probability);
        let most = most.fold(f64::NEG_INFINITY, f64::max);
        starts.retain(|start| start.log_probability >= most - margin_nats);
        starts
    }

    /// A copy relaxed by these matches, with kernels that become narrower and never less deep: a
    /// kernel that begins deep lets all matches together draw the map to a point.
    fn with_matches(
        &self,
        matches: ViewMatches,
        widths: &[f64],
        channels: &[Similarity<'_>],
    ) -> Matched {
        let mut copy = self.clone();
        copy.set_matches(matches);
        let mut problem = Problem::new(copy.graph(), Among::Accepted, Calibrating::Free);
        for &width in widths {
            problem.widen_matches(copy.graph(), width);
            problem.map.relax(&RelaxationSettings {
                steps_max: tuning::MATCHED_STEPS_MAX,
                tolerance: tuning::MATCHED_TOLERANCE,
                ..RelaxationSettings::default()
            });
        }
        copy.move_keyframes(&problem);
        problem.switch_off_matches();
        let graph = copy.graph();
        let evidence: f64 = { channels.iter() }
            .map(|channel| channel.evidence(&positions(graph, channel)))
            .sum();
        Matched {
            copy,
            log_probability: evidence - 0.5 * problem.map.chi_squared(),
            log_probability_needed: f64::NEG_INFINITY,
        }
    }

    /// A copy whose agents went by odometry alone, with a veer of so many of its standard
    /// deviations.
    fn dead_reckoned(&self, veer: f64) -> Self {
        let mut copy = self.clone();
        let calibration = Calibration {
            veer_rad_m: veer * tuning::VEER_SD_RAD_M,
            ..Calibration::default()
        };
        for agent in (0..).take(self.graph().chains.tracks.len()) {
            for (number, pose) in dead_reckoned(&self.graph().chains, agent, &calibration) {
                copy.put(number, &pose);
            }
        }
        copy
    }
}

impl Matched {
    fn n_matches(&self) -> usize {
        self.copy.graph().matches.len()
    }

    /// How probable all maps near it are together: that of the best by its noise, times how much of
    /// what was possible before is as probable. Another map than that of odometry is so much less
    /// probable beforehand.
    fn log_evidence(&self, another_map: f64) -> f64 {
        let is_other = !self.copy.graph().matches.is_empty();
        let before = if is_other { another_map } else { 0.0 };
        self.log_probability + self.copy.log_volume_matched() - before
    }

    /// The same, relaxed twice by matches that are near to one another by it.
    fn gated(self, channels: &[Similarity<'_>]) -> Self {
        let mut matched = self;
        for _ in 0..tuning::GATED_MATCHINGS {
            let graph = matched.copy.graph();
            let near = |channel: &Similarity<'_>| channel.matches_near(&positions(graph, channel));
            let near: Vec<ViewMatch> = channels.iter().flat_map(near).collect();
            if near.is_empty() {
                break;
            }
            let copy = matched.copy;
            matched = copy.with_matches(near.into(), tuning::GATED_WIDTHS, channels);
        }
        matched
    }

    /// Whether no keyframe is farther from where another copy has it.
    fn is_within(&self, other: &Self, distance_m: f64) -> bool {
        let others = &other.copy.graph().chains.keyframes;
        let keyframes = self.copy.graph().chains.keyframes.iter();
        keyframes.into_iter().all(|(number, keyframe)| {
            let apart = |other: &Keyframe| {
                (keyframe.pose.translation.vector - other.pose.translation.vector).norm()
            };
            others
                .get(number)
                .is_some_and(|other| apart(other) <= distance_m)
        })
    }

    /// The same, relaxed by matches that are close to one another by it; `None` if it has none.
    fn matched_closely(&self, channels: &[Similarity<'_>]) -> Option<Self> {
        let graph = self.copy.graph();
        if graph.matches.is_empty() {
            return None;
        }
        let close = |channel: &Similarity<'_>| channel.matches_close(&positions(graph, channel));
        let close: Vec<ViewMatch> = channels.iter().flat_map(close).collect();
        (!close.is_empty()).then(|| {
            self.copy
                .with_matches(close.into(), tuning::CLOSE_WIDTHS, channels)
        })
    }
}

/// Where the keyframes of an agent of the map are by its odometry, from the begins of its
/// stretches on.
fn dead_reckoned(
    chains: &Chains,
    agent: u32,
    calibration: &Calibration,
) -> Vec<(u32, Isometry3<f64>)> {
    let mut poses: Vec<(u32, Isometry3<f64>)> = Vec::new();
    if !chains.track(agent).is_some_and(AgentTrack::is_in_map) {
        return poses;
    }
    let mut number = chains.first(agent);
    while let Some(keyframe) = chains.keyframes.get(number) {
        let there = chains.in_map(number).unwrap_or(keyframe.pose);
        let reading = keyframe.calibrated.reading(&keyframe.motion);
        let length = keyframe.calibrated.calibration.in_graph().length;
        let motion = reading.motion(&Calibration {
            length,
            ..*calibration
        });
        let pose = match poses.last() {
            Some((_, previous)) if !keyframe.begins => previous * motion,
            _ => there,
        };
        poses.push((number, pose));
        number = keyframe.next;
    }
    poses
}

/// Where the views of a channel were seen, as a graph has it.
fn positions(graph: &KeyframeGraph, channel: &Similarity<'_>) -> Vec<Option<Point3<f64>>> {
    let position = |sample: SampleKey| {
        let pose = graph.chains.pose_of(&graph.chains.at_sample(sample)?)?;
        is_somewhere(&pose.translation.vector).then(|| pose.translation.vector.into())
    };
    channel.samples().map(position).collect()
}
