//! Copies of the keyframe graph with fewer keyframes, which take less time to relax.

use std::collections::BTreeSet;

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
    /// steps, and with very many sightings these move to keyframes some steps apart. Keyframes and
    /// constraints keep their numbers.
    pub(super) fn coarse(graph: &KeyframeGraph) -> Self {
        let mut coarse = graph.clone();
        // Attachments move with the keyframes afterwards.
        coarse.attachments.slab = Slab::default();
        dissolve_within(&mut coarse, tuning::COARSE_STEP, &Kept::Sighted);
        drop_old_candidates(&mut coarse);
        let (step_m, longer) = (tuning::COARSE_STEP.0, tuning::THINNED_LONGER);
        thin(
            &mut coarse,
            step_m * longer,
            longer,
            tuning::COARSE_KEYFRAMES_MAX,
            &Kept::Sighted,
        );
        if coarse.n_keyframes() > tuning::COARSE_SIGHTED_MAX {
            let near_ties = Kept::NearTies(near_ties(&coarse));
            let (step_m, longer) = tuning::COARSE_SIGHTED_STEPS_M;
            thin(
                &mut coarse,
                step_m,
                longer,
                tuning::COARSE_SIGHTED_MAX,
                &near_ties,
            );
        }
        Self::of(coarse)
    }

    /// A copy without the keyframes between those that are a step \[m\] apart, if there are more
    /// than so many; with a longer step if there still are.
    pub(super) fn thinned(&self, step_m: f64, most: usize) -> Self {
        let mut thinned = self.graph().clone();
        thinned.attachments.slab = Slab::default();
        thin(
            &mut thinned,
            step_m,
            tuning::THINNED_LONGER,
            most,
            &Kept::Sighted,
        );
        Self::of(thinned)
    }
}

/// The keyframes that a copy keeps, besides those that stated poses tie to the map, and the first
/// and the last one of each stretch.
enum Kept {
    /// Those with sightings.
    Sighted,
    /// These.
    NearTies(BTreeSet<u32>),
}

/// Dissolves keyframes within a step \[m\] of others, and within longer ones, each by a factor,
/// while there are more than so many. Those that the copy keeps may be more.
fn thin(graph: &mut KeyframeGraph, mut step_m: f64, longer: f64, most: usize, kept: &Kept) {
    while graph.n_keyframes() > most {
        dissolve_within(graph, (step_m, f64::INFINITY), kept);
        if step_m >= tuning::THINNED_STEP_MAX_M {
            return;
        }
        step_m *= longer;
    }
}

/// Dissolves the keyframes within a motion \[m, rad\] of the next one that stays, on each way back.
fn dissolve_within(graph: &mut KeyframeGraph, within: (f64, f64), kept: &Kept) {
    for agent in (0..).take(graph.chains.tracks.len()) {
        let newest = graph.chains.track(agent).map_or(NONE, |track| track.newest);
        let mut way = Isometry3::identity();
        let mut number = newest;
        while let Some(keyframe) = graph.chains.keyframes.get(number) {
            let (motion, previous) = (keyframe.motion, keyframe.previous);
            // The chain is walked from its end, since removals change the neighbours.
            let stays = number == newest || must_stay(graph, number, kept);
            if stays || !is_within(&way, within.0, within.1) {
                way = motion;
            } else {
                graph.dissolve(number);
                way = motion * way;
            }
            number = previous;
        }
    }
}

/// Whether a keyframe must stay in a copy.
fn must_stay(graph: &KeyframeGraph, number: u32, kept: &Kept) -> bool {
    let keyframes = &graph.chains.keyframes;
    let Some(keyframe) = keyframes.get(number) else {
        return true;
    };
    let next = keyframes.get(keyframe.next);
    let goes_on = next.is_some_and(|next| !next.begins);
    let is_kept = match kept {
        Kept::Sighted => keyframe.sightings != NONE || keyframe.shown != NONE,
        Kept::NearTies(near) => near.contains(&number),
    };
    is_kept || keyframe.begins || !goes_on || is_tied(graph, number)
}

/// Whether a stated pose ties a keyframe to the map.
fn is_tied(graph: &KeyframeGraph, number: u32) -> bool {
    let Some(keyframe) = graph.chains.keyframes.get(number) else {
        return false;
    };
    let mut constraints = graph.constraints.of(number, keyframe);
    constraints.any(|constraint| !constraint.is_closure())
}

/// The keyframes around those that stated poses tie to the map.
///
/// How the whole map lies to its frame is known by what was seen near there alone: were that moved
/// to keyframes farther off, the map would turn a little with each relaxation, and agents, who are
/// not told, would find no place where they remember it.
fn near_ties(graph: &KeyframeGraph) -> BTreeSet<u32> {
    let tied = { graph.constraints.slab.iter() }.filter(|(_, one)| !one.is_closure());
    let tied: Vec<u32> = tied.map(|(_, one)| one.to).collect();
    // With very many ties each needs less.
    let most = tuning::COARSE_SIGHTED_MAX / (4 * tied.len().max(1));
    let count = tuning::KEPT_NEAR_TIES.min(most);
    let chains = &graph.chains;
    let mut near = BTreeSet::new();
    for &tied in &tied {
        near.extend(chains.back_from(tied).take(count).map(|(number, _)| number));
        near.extend(chains.on_from(tied).take(count).map(|(number, _)| number));
    }
    near
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

#[cfg(test)]
pub(super) mod tests;
