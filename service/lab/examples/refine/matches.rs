//! A data set with place matches: they correct the live pose, as far as they agree.

use std::path::Path;
use std::time::Instant;

use cogmap_lab::tuc::{Match, Tuc};
use cognitive_map::estimator::Calibrated;
use cognitive_map::keyframes::{KeyframeGraph, KeyframeSettings, Moment};
use cognitive_map::{PoseNoise, Relation, RelativePose};
use nalgebra::Isometry3;
use pose_graph::Link;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trajectory::{Alignment, Span, StampedPose, Trajectory, ate_rmse_m};

/// Deviations of a match: that it is the same place, and looked at the same way \[m, rad\].
const MATCH_SD: (f64, f64) = (0.5, 0.2);
/// Places further apart than this are different places \[m\].
const SAME_PLACE_M: f64 = 2.0;
/// Shorter gaps between the moments of a match say nothing that odometry does not \[ns\].
const GAP_NS: i64 = 10_000_000_000;

/// Prints the errors; answers whether the set could be read.
pub(crate) fn run(directory: &str, false_percent: u32, g2o: Option<&str>) -> bool {
    let Ok(set) = Tuc::load(Path::new(directory)) else {
        return false;
    };
    let (mut matches, n_false) = matches_of(&set, f64::from(false_percent) / 100.0);
    matches.sort_by_key(|found| (found.later_ns, found.earlier_ns));
    let Some(relation) = same_place() else {
        return false;
    };
    let mut graph = KeyframeGraph::new(KeyframeSettings::default());
    let Ways {
        causal,
        odometry,
        relaxations_s,
    } = walk(&mut graph, &set, &matches, &relation);
    let begin = Instant::now();
    let refined = graph.refine();
    let seconds = begin.elapsed().as_secs_f64();
    let rows = refined.agents[0].poses.iter();
    let poses: Vec<StampedPose> = rows
        .map(|row| StampedPose {
            stamp_ns: row.stamp_ns,
            pose: row.pose,
        })
        .collect();
    let [odometry_m, causal_m, refined_m] =
        [&odometry, &causal, &poses].map(|poses| error_m(&set, poses).unwrap_or(f64::NAN));
    let relaxed_s: f64 = relaxations_s.iter().sum();
    println!(
        "{} matches, {n_false} false; {} believed; aligned: odometry {odometry_m:.3} m, causal {causal_m:.3} m, refined {refined_m:.3} m",
        matches.len(),
        graph.n_closures_accepted(),
    );
    println!(
        "{} keyframes; {} relaxations in {relaxed_s:.2} s, the longest {:.0} ms; refined in {seconds:.2} s",
        graph.n_keyframes(),
        relaxations_s.len(),
        relaxations_s.iter().copied().fold(0.0, f64::max) * 1e3,
    );
    g2o.is_none_or(|file| std::fs::write(file, text(&graph)).is_ok())
}

/// What a match says: the same place and heading, about.
fn same_place() -> Option<Relation> {
    let noise = PoseNoise::new([MATCH_SD.0, MATCH_SD.0, 0.0], [0.0, 0.0, MATCH_SD.1]);
    let relation = RelativePose::new([0.0; 3], [0.0, 0.0, 0.0, 1.0], noise.ok()?);
    relation.ok().map(Relation::Pose)
}

/// Error of a trajectory after alignment \[m\].
fn error_m(set: &Tuc, poses: &[StampedPose]) -> Option<f64> {
    let estimate = Trajectory::from_poses(poses).ok()?;
    let span = Span::common([estimate.span(), set.truth().span()])?;
    ate_rmse_m(&estimate, set.truth(), span, Alignment::Planar).ok()
}

/// The ways of a robot, with and without what the matches correct.
#[derive(Default)]
struct Ways {
    causal: Vec<StampedPose>,
    odometry: Vec<StampedPose>,
    relaxations_s: Vec<f64>,
}

/// Walks through the recording, with its matches.
fn walk(graph: &mut KeyframeGraph, set: &Tuc, matches: &[Match], relation: &Relation) -> Ways {
    let stamps: Vec<i64> = set.steps().iter().map(|step| step.stamp_ns).collect();
    let step_of = |stamp_ns: i64| {
        let after = stamps.partition_point(|&stamp| stamp < stamp_ns);
        after.min(stamps.len() - 1)
    };
    let agent = graph.enrol();
    graph.found(agent);
    let (mut pose, mut alone) = (Isometry3::identity(), Isometry3::identity());
    let mut ways = Ways::default();
    let mut next = matches.iter().peekable();
    for (index, step) in set.steps().iter().enumerate() {
        pose *= step.motion;
        alone *= step.motion;
        let moment = |pose| Moment {
            agent,
            seq: index as u64 + 1,
            stamp_ns: step.stamp_ns,
            pose,
        };
        let variance = step.noise_sd.component_mul(&step.noise_sd);
        graph.motion(
            &moment(pose),
            &step.motion,
            &variance,
            &Calibrated::default(),
        );
        while let Some(found) = next.next_if(|found| step_of(found.later_ns) <= index) {
            let earlier = step_of(found.earlier_ns) as u64 + 1;
            graph.closure(&moment(pose), earlier, relation);
        }
        if graph.is_due() {
            let begin = Instant::now();
            let corrections = graph.relax();
            ways.relaxations_s.push(begin.elapsed().as_secs_f64());
            if let Some(correction) = corrections.first() {
                pose = correction.pose;
            }
        }
        let at = |pose| StampedPose {
            stamp_ns: step.stamp_ns,
            pose,
        };
        ways.causal.push(at(pose));
        ways.odometry.push(at(alone));
    }
    ways
}

/// The set's matches over longer gaps, and false ones until they make up a share; how many are
/// false.
fn matches_of(set: &Tuc, share: f64) -> (Vec<Match>, usize) {
    let is_true = |found: &Match| {
        let (a, b) = (
            set.truth().at(found.later_ns),
            set.truth().at(found.earlier_ns),
        );
        a.zip(b).is_some_and(|(a, b)| (a - b).norm() < SAME_PLACE_M)
    };
    let mut matches: Vec<Match> = set.matches().to_vec();
    matches.retain(|found| found.later_ns - found.earlier_ns > GAP_NS);
    let n_true = matches.iter().filter(|found| is_true(found)).count();
    let moments: Vec<i64> = matches
        .iter()
        .flat_map(|found| [found.later_ns, found.earlier_ns])
        .collect();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    while ((matches.len() - n_true) as f64) < share * matches.len() as f64 {
        let mut any = || moments[random.random_range(0..moments.len())];
        let (a, b) = (any(), any());
        let found = Match {
            later_ns: a.max(b),
            earlier_ns: a.min(b),
            score: 0.5,
        };
        if found.later_ns - found.earlier_ns > GAP_NS && !is_true(&found) {
            matches.push(found);
        }
    }
    let n_false = matches.len() - n_true;
    (matches, n_false)
}

/// The graph in the plane, as g2o writes it.
fn text(graph: &KeyframeGraph) -> String {
    use std::fmt::Write as _;

    let map = graph.pose_graph();
    let planar = |pose: &Isometry3<f64>| {
        let (_, _, heading) = pose.rotation.euler_angles();
        format!("{} {} {heading}", pose.translation.x, pose.translation.y)
    };
    let mut text = String::new();
    for (id, pose) in map.poses() {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "VERTEX_SE2 {} {}", id.number(), planar(pose));
    }
    for link in map.links() {
        if let Link::Between {
            from,
            to,
            transform,
            information,
        } = link
        {
            let entry = |row, column| information.matrix()[(row, column)];
            let _ = writeln!(
                text,
                "EDGE_SE2 {} {} {} {} {} {} {} {} {}",
                from.number(),
                to.number(),
                planar(transform),
                entry(0, 0),
                entry(0, 1),
                entry(0, 5),
                entry(1, 1),
                entry(1, 5),
                entry(5, 5),
            );
        }
    }
    text
}
