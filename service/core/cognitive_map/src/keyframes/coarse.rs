//! Copies of the keyframe graph with fewer keyframes, which take less time to relax.

use nalgebra::Isometry3;

use super::constraint::Constraint;
use super::graph::KeyframeGraph;
use super::relaxation::RelaxationCopy;
use super::tuning;
use geometry::is_within;
use state::{NONE, Slab};

impl RelaxationCopy {
    /// The coarse graph, which is relaxed while samples come in: one keyframe a step, and those
    /// with sightings, at the begin of a stretch, and the latest ones; in a large map with longer
    /// steps. Keyframes and constraints keep their numbers.
    pub(super) fn coarse(graph: &KeyframeGraph) -> Self {
        let mut coarse = graph.clone();
        // Attachments move with the keyframes afterwards.
        coarse.attachments.slab = Slab::default();
        dissolve_within(&mut coarse, tuning::COARSE_STEP);
        drop_old_candidates(&mut coarse);
        let longer_m = 2.0 * tuning::COARSE_STEP.0;
        thin(&mut coarse, longer_m, tuning::COARSE_KEYFRAMES_MAX);
        Self::of(coarse)
    }

    /// A copy without the keyframes between those that are a step \[m\] apart, if there are more
    /// than so many; with a longer step if there still are.
    pub(super) fn thinned(&self, step_m: f64, most: usize) -> Self {
        let mut thinned = self.graph().clone();
        thinned.attachments.slab = Slab::default();
        thin(&mut thinned, step_m, most);
        Self::of(thinned)
    }
}

/// Dissolves keyframes within a step \[m\] of others, and within twice that, and so on, while there
/// are more than so many. Those that a coarse copy keeps may be more.
fn thin(graph: &mut KeyframeGraph, mut step_m: f64, most: usize) {
    while graph.n_keyframes() > most {
        dissolve_within(graph, (step_m, f64::INFINITY));
        if step_m >= tuning::THINNED_STEP_MAX_M {
            return;
        }
        step_m *= 2.0;
    }
}

/// Dissolves the keyframes within a motion \[m, rad\] of the next one that stays, on each way back.
fn dissolve_within(graph: &mut KeyframeGraph, within: (f64, f64)) {
    for agent in (0..).take(graph.chains.tracks.len()) {
        let newest = graph.chains.track(agent).map_or(NONE, |track| track.newest);
        let mut way = Isometry3::identity();
        let mut number = newest;
        while let Some(keyframe) = graph.chains.keyframes.get(number) {
            let (motion, previous) = (keyframe.motion, keyframe.previous);
            // The chain is walked from its end, since removals change the neighbours.
            if number == newest || must_stay(graph, number) || !is_within(&way, within.0, within.1)
            {
                way = motion;
            } else {
                graph.dissolve(number);
                way = motion * way;
            }
            number = previous;
        }
    }
}

/// Whether a keyframe must stay in the coarse graph.
fn must_stay(graph: &KeyframeGraph, number: u32) -> bool {
    let keyframes = &graph.chains.keyframes;
    let Some(keyframe) = keyframes.get(number) else {
        return true;
    };
    let next = keyframes.get(keyframe.next);
    let goes_on = next.is_some_and(|next| !next.begins);
    if keyframe.begins || !goes_on || keyframe.sightings != NONE || keyframe.shown != NONE {
        return true;
    }
    let mut constraints = graph.constraints.of(number, keyframe);
    constraints.any(|constraint| !constraint.is_closure())
}

/// Removes candidates but the latest ones.
fn drop_old_candidates(graph: &mut KeyframeGraph) {
    let stamped = |(number, constraint): (u32, &Constraint)| {
        let from = graph.chains.keyframes.get(constraint.from)?;
        constraint.is_candidate().then_some((from.stamp_ns, number))
    };
    let mut pending: Vec<(i64, u32)> = { graph.constraints.slab.iter() }
        .filter_map(stamped)
        .collect();
    pending.sort_unstable();
    let n_old = pending.len().saturating_sub(tuning::COARSE_PENDING_MAX);
    for &(_, number) in &pending[..n_old] {
        graph.remove_constraint(number);
    }
}
