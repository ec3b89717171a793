//! The past with few anchors: what is relaxed while samples come in.

use nalgebra::Isometry3;

use super::graph::KeyframeGraph;
use super::tie::Standing;
use geometry::is_within;
use state::{NONE, Slab};

/// Motion between the anchors of the coarse past \[m, rad\]. Over so short a way the noise of odometry is less than what
/// matches state, and what hangs on the anchors in between goes to a neighbour with it.
const STEP: (f64, f64) = (1.0, 0.5);

/// Matches that wait and are looked at again: the latest ones. Earlier ones have been looked at many times; once the whole
/// past is refined they are again.
const WAITING_MAX: usize = 512;

impl KeyframeGraph {
    /// A copy with an anchor a step only, and where something was seen, where an agent began anew, and where it is now.
    /// Anchors and ties keep their numbers.
    pub(super) fn coarse(&self) -> Self {
        let mut coarse = self.clone();
        // What is moored goes with the anchors afterwards.
        coarse.moorings = Slab::default();
        for agent in 0..self.lives.len() {
            let newest = self.lives.get(agent).map_or(NONE, |life| life.newest);
            let mut way = Isometry3::identity();
            let mut number = newest;
            while let Some(anchor) = coarse.anchors.get(number) {
                let (motion, previous) = (anchor.motion, anchor.previous);
                // Which neighbours an anchor has decides where the way goes on; the chain is walked from its end.
                if number == newest || coarse.is_key(number) || !is_within(&way, STEP.0, STEP.1) {
                    way = motion;
                } else {
                    coarse.dissolve(number);
                    way = motion * way;
                }
                number = previous;
            }
        }
        coarse.leave_out();
        coarse
    }

    /// Leaves out matches that wait, but for the latest ones.
    fn leave_out(&mut self) {
        let mut waiting: Vec<(i64, u32)> = self
            .ties
            .iter()
            .filter(|(_, tie)| matches!(tie.standing, Standing::Pending | Standing::Refuted))
            .filter_map(|(number, tie)| Some((self.anchors.get(tie.from)?.stamp_ns, number)))
            .collect();
        waiting.sort_unstable();
        let n_old = waiting.len().saturating_sub(WAITING_MAX);
        for &(_, number) in &waiting[..n_old] {
            self.untie(number);
        }
    }

    /// Whether an anchor has to stay in a coarse past.
    fn is_key(&self, number: u32) -> bool {
        let Some(anchor) = self.anchors.get(number) else {
            return true;
        };
        let goes_on = self
            .anchors
            .get(anchor.next)
            .is_some_and(|next| !next.begins);
        if anchor.begins || !goes_on || anchor.sightings != NONE || anchor.shown != NONE {
            return true;
        }
        let mut at = anchor.ties;
        while let Some(tie) = self.ties.get(at) {
            if matches!(tie.standing, Standing::Origin | Standing::Stated) {
                return true;
            }
            at = self.next_tie(at, number);
        }
        false
    }

    /// Takes over where the anchors of a relaxed coarse copy are, and which matches it believes. What is between two of
    /// its anchors moves with the earlier one.
    pub(super) fn take_over(&mut self, coarse: &Self) {
        let revision = self.revision;
        for number in 0..self.ties.numbers() {
            let standing = coarse.ties.get(number).map(|tie| tie.standing);
            if let (Some(standing), Some(tie)) = (standing, self.ties.get(number))
                && standing != tie.standing
                && let Some(tie) = self.ties.get_mut(number, revision)
            {
                tie.standing = standing;
            }
        }
        self.cast_off();
        for agent in 0..self.lives.len() {
            let Some(life) = self.lives.get(agent) else {
                continue;
            };
            if !life.is_in_map {
                continue;
            }
            // The latest anchors of the coarse past that have been met on the way back, and how they have moved.
            let mut behind: Vec<u32> = Vec::new();
            let mut number = life.newest;
            while let Some(anchor) = self.anchors.get(number) {
                let previous = anchor.previous;
                behind.push(number);
                if let (Some(key), Some(was)) = (coarse.anchors.get(number), self.in_map(number)) {
                    let moved = key.pose * was.inverse();
                    for number in behind.drain(..) {
                        self.move_anchor(number, &moved);
                    }
                }
                number = previous;
            }
            let newest = self.lives.get(agent).map_or(NONE, |life| life.newest);
            let pose = self.anchors.get(newest).map(|anchor| anchor.pose);
            if let (Some(pose), Some(life)) = (pose, self.lives.get_mut(agent, revision)) {
                life.pose = pose * life.since.motion();
            }
        }
    }

    fn move_anchor(&mut self, number: u32, moved: &Isometry3<f64>) {
        let was = self.in_map(number);
        if let (Some(was), Some(anchor)) = (was, self.anchors.get_mut(number, self.revision)) {
            anchor.pose = moved * was;
            anchor.pose.rotation.renormalize_fast();
            anchor.is_in_map = true;
        }
    }
}
