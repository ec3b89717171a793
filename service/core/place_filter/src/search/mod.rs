//! Search of an agent that is not known about: poses that explain what it senses, and whether one
//! of them does so beyond doubt.
//!
//! A search goes on by a part of bounded work with each record of the agent, in rounds. A round is
//! about the nodes that are complete when it begins:
//!
//! ```text
//! scan places ─► turn about the best ─► weigh poses ─► doubt the best ─► found
//! ```

mod channel_of_way;
mod points;
mod refinement;
mod seeds;

use geometry::{PoseCovariance, clear_out_of_plane};
use nalgebra::{Isometry3, Matrix6, UnitQuaternion, Vector3};
use state::{state_of_enum, state_of_struct};

use crate::field::Field;
use crate::tuning::search as tuning;
use crate::window::{Node, Window};
use refinement::{Refined, Way};
use seeds::{Anchor, Seed, corners, scan, turn};

/// What is known of an agent that searches.
#[derive(Clone, Copy, Debug)]
pub struct Seeker<'a> {
    /// The body now, by motion alone.
    pub in_odom: Isometry3<f64>,
    /// Rotations that may turn the frame of motion upright.
    pub upright: &'a [UnitQuaternion<f64>],
    /// Standard deviation of that about each axis \[rad\].
    pub upright_sd_rad: f64,
    /// Whether all of its motion was in the plane.
    pub is_planar: bool,
    /// Largest standard deviation of an answer's position \[m\].
    pub sd_max_m: f64,
}

/// The pose of an agent that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Pose of the body in the map.
    pub pose: Isometry3<f64>,
    /// Covariance of the error on its right.
    pub covariance: PoseCovariance,
}

/// What a round does next.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Stage {
    /// Waits for a further node.
    #[default]
    Rest,
    /// Looks for places that remember the latest levels, from one of them on.
    Scan(u32),
    /// Tries headings at each of them.
    Turn,
    /// Refines poses, and weighs them.
    Weigh,
    /// Asks whether other poses explain as much as the best.
    Doubt,
}

state_of_enum!(Stage {
    Rest = 0,
    Scan(next) = 1,
    Turn = 2,
    Weigh = 3,
    Doubt = 4
});

/// A search under way.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Search {
    stage: Stage,
    /// Rounds since places were looked for last.
    rounds: u32,
    /// Way to the latest node that counts \[m\].
    end_m: f64,
    /// Places at which headings are still to be tried.
    anchors: Vec<Anchor>,
    /// Poses that this has led to.
    seeds: Vec<Seed>,
    /// Poses that are still to be weighed.
    queue: Vec<Isometry3<f64>>,
    /// Poses that have been weighed in this round, the best first.
    weighed: Vec<Seed>,
}

state_of_struct!(Search {
    stage,
    rounds,
    end_m,
    anchors,
    seeds,
    queue,
    weighed
});

impl Search {
    /// Whether there is nothing to forget.
    pub(crate) fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Whether a round is under way.
    pub(crate) fn is_under_way(&self) -> bool {
        self.stage != Stage::Rest
    }

    /// Goes on by a part of bounded work; answers the pose once it is sure.
    pub(crate) fn seek(
        &mut self,
        window: &Window,
        seeker: &Seeker<'_>,
        field: &dyn Field,
    ) -> Option<Found> {
        let nodes = window.complete();
        if self.stage == Stage::Rest {
            let latest = nodes.last()?;
            if nodes.len() < tuning::NODES_MIN || latest.way_m <= self.end_m {
                return None;
            }
            self.begin(latest.way_m);
        }
        let end = nodes.partition_point(|node| node.way_m <= self.end_m);
        let used = spaced(&nodes[..end]);
        let length_m = used.last().and_then(|node| length_m(node, field));
        let Some(length_m) = length_m else {
            self.stage = Stage::Rest;
            return None;
        };
        let mut left = tuning::WORK;
        while left > 0 && self.stage != Stage::Rest {
            let (work, is_sure) = self.step(&used, seeker, length_m, field);
            left = left.saturating_sub(work);
            if let Some(best) = self.weighed.first().filter(|_| is_sure) {
                return found(&best.pose, &spaced(nodes), seeker, field).map(|(_, found)| found);
            }
        }
        None
    }

    /// Makes the next step of a round; answers its work, and whether the best pose is sure by it.
    fn step(
        &mut self,
        used: &[&Node],
        seeker: &Seeker<'_>,
        length_m: f64,
        field: &dyn Field,
    ) -> (u32, bool) {
        match self.stage {
            Stage::Rest => (0, false),
            Stage::Scan(first) => {
                let corners = corners(used, length_m);
                let next = scan(&mut self.anchors, first, &corners, length_m, field);
                self.stage = next.map_or(Stage::Turn, Stage::Scan);
                (tuning::SCANNED, false)
            }
            Stage::Turn => {
                if let Some(anchor) = self.anchors.pop() {
                    turn(&anchor, used, seeker, field, length_m, &mut self.seeds);
                    distinct(&mut self.seeds, tuning::SEEDS, seeker, length_m);
                    return (tuning::TURN_WORK, false);
                }
                let seeds = self.seeds.drain(..).map(|seed| seed.pose);
                self.queue.extend(seeds);
                self.stage = Stage::Weigh;
                (0, false)
            }
            Stage::Weigh if self.queue.is_empty() => {
                distinct(&mut self.weighed, tuning::KEPT, seeker, length_m);
                self.judge(used, seeker, length_m, field);
                (tuning::WEIGH_WORK, false)
            }
            Stage::Weigh => {
                self.weigh(used, seeker, field, tuning::ROUNDS);
                (tuning::WEIGH_WORK, false)
            }
            Stage::Doubt => {
                self.weigh(used, seeker, field, 1);
                let is_sure = self.doubt(seeker, length_m);
                (tuning::WEIGH_WORK, is_sure)
            }
        }
    }

    /// Whether no other pose explains about as much as the best, once all have been weighed.
    fn doubt(&mut self, seeker: &Seeker<'_>, length_m: f64) -> bool {
        let Some(best) = self.weighed.first() else {
            self.stage = Stage::Rest;
            return false;
        };
        let is_rival = |other: &Seed| {
            best.log_odds - other.log_odds < tuning::SURE
                && !same(&other.pose, &best.pose, seeker, length_m)
        };
        if self.weighed.iter().any(is_rival) {
            self.queue.clear();
            self.stage = Stage::Rest;
            return false;
        }
        if self.queue.is_empty() {
            self.stage = Stage::Rest;
        }
        self.queue.is_empty()
    }

    /// Begins a round.
    fn begin(&mut self, end_m: f64) {
        self.end_m = end_m;
        self.rounds += 1;
        let best = self
            .weighed
            .first()
            .map_or(f64::NEG_INFINITY, |best| best.log_odds);
        self.stage = if best >= tuning::SURE && self.rounds < tuning::ROUNDS_PER_SCAN {
            Stage::Weigh
        } else {
            self.rounds = 0;
            Stage::Scan(0)
        };
        self.weighed.retain(|pose| pose.log_odds > tuning::HOPELESS);
        self.queue
            .extend(self.weighed.drain(..).map(|seed| seed.pose));
    }

    /// Weighs the next pose of the queue.
    fn weigh(&mut self, used: &[&Node], seeker: &Seeker<'_>, field: &dyn Field, rounds: usize) {
        let Some(pose) = self.queue.pop() else {
            return;
        };
        let way = Way::new(&pose, used, seeker, field, tuning::SUPPORTS);
        let refined = way.and_then(|way| way.refine(&pose, rounds));
        self.weighed.extend(refined.map(|refined| Seed {
            log_odds: refined.log_odds,
            pose: refined.pose,
        }));
    }

    /// Whether the best pose is worth being doubted; the round is over if not.
    fn judge(&mut self, used: &[&Node], seeker: &Seeker<'_>, length_m: f64, field: &dyn Field) {
        self.stage = Stage::Rest;
        let Some(best) = self.weighed.first() else {
            return;
        };
        let next = self
            .weighed
            .get(1)
            .map_or(0.0, |next| next.log_odds.max(0.0));
        if best.log_odds - next < tuning::SURE {
            return;
        }
        if let Some((covariance, _)) = found(&best.pose, used, seeker, field) {
            let others = shifted(&best.pose, &covariance, seeker, length_m);
            self.queue.extend(others);
            self.stage = Stage::Doubt;
        }
    }
}

/// The answer that a pose of the frame of motion is, if it is known well enough and fits; with the
/// covariance in all components.
fn found(
    pose: &Isometry3<f64>,
    used: &[&Node],
    seeker: &Seeker<'_>,
    field: &dyn Field,
) -> Option<(Matrix6<f64>, Found)> {
    let way = Way::new(pose, used, seeker, field, tuning::SUPPORTS_OF_ANSWER)?;
    let refined: Refined = way.refine(pose, tuning::ROUNDS)?;
    let is_likely = refined.log_odds >= tuning::SURE && refined.misfit <= tuning::MISFIT_MAX;
    if refined.step > tuning::SETTLED || !is_likely {
        return None;
    }
    let mut covariance = way.covariance(&refined)? * refined.misfit.max(tuning::MISFIT_MIN);
    let all = covariance;
    if seeker.is_planar {
        clear_out_of_plane(&mut covariance);
    }
    let covariance = PoseCovariance::from_matrix(&covariance);
    let turn = covariance.matrix().diagonal().fixed_rows::<3>(3).max();
    let is_known = covariance.position_sd_m() <= seeker.sd_max_m
        && turn.max(0.0).sqrt() <= tuning::HEADING_SD_MAX_RAD;
    let found = Found {
        pose: refined.pose * seeker.in_odom,
        covariance,
    };
    is_known.then_some((all, found))
}

/// Sorts poses, the best first, and keeps so many that are not the same.
fn distinct(poses: &mut Vec<Seed>, most: usize, seeker: &Seeker<'_>, length_m: f64) {
    poses.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
    let mut kept: Vec<Seed> = Vec::with_capacity(most);
    for pose in poses.drain(..) {
        let is_same = |other: &Seed| same(&other.pose, &pose.pose, seeker, length_m);
        if kept.len() < most && !kept.iter().any(is_same) {
            kept.push(pose);
        }
    }
    *poses = kept;
}

/// Poses of the frame of motion that a field might have that is the same along a line, or all
/// around: the pose shifted along the axes of its error, and turned.
fn shifted<'a>(
    best: &Isometry3<f64>,
    covariance: &Matrix6<f64>,
    seeker: &'a Seeker<'_>,
    length_m: f64,
) -> impl Iterator<Item = Isometry3<f64>> + use<'a> {
    let errors = covariance.fixed_view::<3, 3>(0, 0).into_owned();
    let axes = errors.symmetric_eigen().eigenvectors;
    let shifts = (0..3).flat_map(move |axis| {
        let along = axes.column(axis).into_owned() * length_m;
        tuning::SHIFTS
            .map(|shift| Isometry3::translation(shift * along.x, shift * along.y, shift * along.z))
    });
    let turns = tuning::TURNS_RAD.map(|turn_rad| Isometry3::rotation(Vector3::z() * turn_rad));
    let (body, to_odom) = (best * seeker.in_odom, seeker.in_odom.inverse());
    shifts.chain(turns).map(move |by| body * by * to_odom)
}

/// Some nodes of a way, at equal distances, the latest among them.
fn spaced(nodes: &[Node]) -> Vec<&Node> {
    let count = nodes.len().min(tuning::NODES);
    let last = nodes.len().saturating_sub(1);
    (0..count)
        .map(|k| &nodes[last - (count - 1 - k) * last / (count - 1).max(1)])
        .collect()
}

/// Shortest correlation length of the channels of a node \[m\].
fn length_m(node: &Node, field: &dyn Field) -> Option<f64> {
    let kernels = node
        .felt
        .iter()
        .filter_map(|felt| field.kernel(felt.channel));
    kernels.map(|kernel| kernel.length_m).reduce(f64::min)
}

/// Whether two poses of the frame of motion are one.
fn same(a: &Isometry3<f64>, b: &Isometry3<f64>, seeker: &Seeker<'_>, length_m: f64) -> bool {
    let position = |pose: &Isometry3<f64>| pose * seeker.in_odom.translation.vector;
    let apart: Vector3<f64> = position(a) - position(b);
    apart.norm() <= tuning::SAME.0 * length_m && a.rotation.angle_to(&b.rotation) <= tuning::SAME.1
}
