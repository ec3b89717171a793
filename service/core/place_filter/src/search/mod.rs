//! Search of an agent that is not known about: poses that explain what it senses, and whether one
//! of them does so beyond doubt.

mod evidence;
mod refinement;
mod seeds;

use geometry::{PoseCovariance, clear_out_of_plane};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use state::state_of_struct;

use crate::field::Field;
use crate::tuning::search as tuning;
use crate::window::{Node, Window};
use refinement::{Refined, refine};
use seeds::seeds;

/// What is known of an agent that searches.
#[derive(Clone, Copy, Debug)]
pub struct Seeker<'a> {
    /// The body now, by motion alone.
    pub in_odom: Isometry3<f64>,
    /// Rotations that may turn the frame of motion upright.
    pub upright: &'a [UnitQuaternion<f64>],
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

/// A search under way.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Search {
    /// Nodes since poses were seeded last.
    fresh: u32,
    /// Poses of the frame of motion in the map that explained best what was sensed.
    kept: Vec<Isometry3<f64>>,
}

state_of_struct!(Search { fresh, kept });

impl Search {
    /// Whether there is nothing to forget.
    pub(crate) fn is_empty(&self) -> bool {
        self.kept.is_empty() && self.fresh == 0
    }

    /// Goes on with a node; answers the pose once it is sure.
    pub(crate) fn seek(
        &mut self,
        window: &Window,
        seeker: &Seeker<'_>,
        field: &dyn Field,
    ) -> Option<Found> {
        let nodes = window.complete();
        if nodes.len() < tuning::NODES_MIN {
            return None;
        }
        let used = spaced(nodes);
        let lengths = used.last()?.felt.iter();
        let lengths = lengths.filter_map(|felt| field.kernel(felt.channel));
        let length_m = lengths.map(|kernel| kernel.length_m).reduce(f64::min)?;
        let kept = std::mem::take(&mut self.kept);
        let again = |pose| refine(pose, &used, seeker, field, 2);
        let mut refined: Vec<Refined> = kept.iter().filter_map(again).collect();
        self.fresh += 1;
        if self.fresh >= tuning::FRESH {
            self.fresh = 0;
            let poses = seeds(&used, seeker, length_m, field);
            let first = |pose| refine(pose, &used, seeker, field, tuning::ROUNDS);
            refined.extend(poses.iter().filter_map(first));
        }
        refined.sort_by(|a, b| b.log_odds.total_cmp(&a.log_odds));
        let mut distinct: Vec<Refined> = Vec::new();
        for each in refined {
            let is_same = |other: &Refined| same(&other.body, &each.body, length_m);
            if distinct.len() < tuning::KEPT && !distinct.iter().any(is_same) {
                distinct.push(each);
            }
        }
        self.kept = distinct
            .iter()
            .map(|each| each.body * seeker.in_odom.inverse())
            .collect();
        let best = distinct.first()?;
        let next = distinct.get(1).map_or(0.0, |next| next.log_odds.max(0.0));
        let mut covariance = best.covariance * best.misfit.max(tuning::MISFIT_MIN);
        if seeker.is_planar {
            clear_out_of_plane(&mut covariance);
        }
        let covariance = PoseCovariance::from_matrix(&covariance);
        let turn = covariance.matrix().diagonal().fixed_rows::<3>(3).max();
        let is_sure = best.log_odds - next >= tuning::SURE
            && best.step <= tuning::SETTLED
            && best.misfit <= tuning::MISFIT_MAX
            && covariance.position_sd_m() <= seeker.sd_max_m
            && turn.max(0.0).sqrt() <= tuning::HEADING_SD_MAX_RAD;
        let is_alone = || {
            let others = shifted(best, seeker, length_m);
            let others = others.map(|pose| refine(&pose, &used, seeker, field, 1));
            others.flatten().all(|other| {
                same(&other.body, &best.body, length_m)
                    || best.log_odds - other.log_odds >= tuning::SURE
            })
        };
        (is_sure && is_alone()).then_some(Found {
            pose: best.body,
            covariance,
        })
    }
}

/// Poses of the frame of motion that a field might have that is the same along a line, or all
/// around: the pose shifted along the axes of its error, and turned.
fn shifted<'a>(
    best: &'a Refined,
    seeker: &'a Seeker<'_>,
    length_m: f64,
) -> impl Iterator<Item = Isometry3<f64>> + 'a {
    let errors = best.covariance.fixed_view::<3, 3>(0, 0).into_owned();
    let axes = errors.symmetric_eigen().eigenvectors;
    let shifts = (0..3).flat_map(move |axis| {
        let along = axes.column(axis).into_owned() * length_m;
        tuning::SHIFTS
            .map(|shift| Isometry3::translation(shift * along.x, shift * along.y, shift * along.z))
    });
    let turns = tuning::TURNS_RAD.map(|turn_rad| Isometry3::rotation(Vector3::z() * turn_rad));
    let to_odom = seeker.in_odom.inverse();
    shifts.chain(turns).map(move |by| best.body * by * to_odom)
}

/// Some nodes of a way, at equal distances, the latest among them.
fn spaced(nodes: &[Node]) -> Vec<&Node> {
    let count = nodes.len().min(tuning::NODES);
    let last = nodes.len() - 1;
    (0..count)
        .map(|k| &nodes[last - (count - 1 - k) * last / (count - 1).max(1)])
        .collect()
}

/// Whether two poses are one.
fn same(a: &Isometry3<f64>, b: &Isometry3<f64>, length_m: f64) -> bool {
    let apart: Vector3<f64> = a.translation.vector - b.translation.vector;
    apart.norm() <= tuning::SAME.0 * length_m && a.rotation.angle_to(&b.rotation) <= tuning::SAME.1
}
