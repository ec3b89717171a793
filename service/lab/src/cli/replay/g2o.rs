//! `cogmap-lab replay g2o`.

use std::path::PathBuf;
use std::time::Instant;

use anyhow::{Context, ensure};
use clap::Args;
use cogmap_lab::reference::Reference;
use cogmap_lab::{g2o, paths};
use nalgebra::{Isometry3, Vector3};
use pose_graph::g2o::G2oGraph;
use pose_graph::{RelaxationSettings, Start};
use serde::Serialize;
use trajectory::{Alignment, Pairs, StampedPose, write_tum};

use super::arguments::ReplayArgs;
use super::case::Case;
use super::known::of_stream;
use super::scoring::{Pairing, Scoring};
use super::team::{ROBOT, Team};
use cogmap::cli::output;

#[derive(Debug, Args)]
pub(in crate::cli) struct G2oArgs {
    /// The graph. Read are `VERTEX_SE2`, `VERTEX_XY`, `EDGE_SE2` and `EDGE_SE2_XY`, or in space
    /// `VERTEX_SE3:QUAT`, `VERTEX_TRACKXYZ`, `EDGE_SE3:QUAT`, `EDGE_SE3_TRACKXYZ` and
    /// `PARAMS_SE3OFFSET`; and FIX.
    file: PathBuf,
    /// Where the poses are known to lie: id, x, y and, in space, z in columns. `NAME.opt_xyz.txt`
    /// beside `NAME.g2o` when absent, if it is there. A reference that begins at the origin is in
    /// the frame of its first pose, any other in that of the graph.
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    /// Send the graph pose by pose as a robot would have: edges to the next id as motion, others as
    /// sightings of what the robot was.
    #[arg(long)]
    samples: bool,
    #[command(flatten)]
    replay: ReplayArgs,
}

/// Known positions of the poses, in the order of their ids; none without a reference.
type Known<'a> = Option<&'a [Option<Vector3<f64>>]>;

/// A graph at its optimum. Without a reference there is no error.
#[derive(Debug, Serialize)]
struct Optimum {
    digest: String,
    poses: usize,
    landmarks: usize,
    links: usize,
    /// Edges that are no motion.
    closures: usize,
    chi2_half: f64,
    refined_ate_rmse_m: Option<f64>,
    refined_aligned_ate_rmse_m: Option<f64>,
    /// Elapsed time of start and solution.
    batch_s: f64,
}

pub(super) fn run(args: &G2oArgs) -> anyhow::Result<()> {
    let shown = || args.file.display().to_string();
    let text = std::fs::read_to_string(&args.file).with_context(|| format!("read {}", shown()))?;
    let graph = G2oGraph::read(&text).with_context(shown)?;
    ensure!(!graph.poses().is_empty(), "{}: there is no pose", shown());
    let known = known(args, &graph)?;
    if args.samples {
        return replay(args, &graph, known.as_deref());
    }
    let what = "a graph enters the solver as a whole, and no space: see --samples";
    let asks_for_a_space = args.replay.connect.is_some() || !args.replay.setting.is_empty();
    ensure!(!asks_for_a_space, what);
    solve(args, &graph, known.as_deref())
}

/// Known positions of the poses, in the order of their ids.
fn known(args: &G2oArgs, graph: &G2oGraph) -> anyhow::Result<Option<Vec<Option<Vector3<f64>>>>> {
    let beside = args.file.with_extension("opt_xyz.txt");
    let beside = beside.exists().then_some(beside);
    let Some(file) = args.reference.clone().or(beside) else {
        return Ok(None);
    };
    let shown = || file.display().to_string();
    let text = std::fs::read_to_string(&file).with_context(|| format!("read {}", shown()))?;
    let reference = Reference::read(&text).with_context(shown)?;
    let known = reference.of(graph.poses().keys().copied());
    known.map(Some).with_context(shown)
}

/// Whether known positions are in the frame of the first pose.
fn begins_at_origin(known: &[Option<Vector3<f64>>]) -> bool {
    let first = known.first().copied().flatten();
    first.is_some_and(|first| first.norm() < 1e-9)
}

/// Sends the graph pose by pose.
fn replay(args: &G2oArgs, graph: &G2oGraph, known: Known<'_>) -> anyhow::Result<()> {
    let (start_pose, start) = if known.is_some_and(begins_at_origin) {
        ("the origin of the reference", Isometry3::identity())
    } else {
        let first = graph.poses().values().next().copied();
        ("the first pose of the set", first.unwrap_or_default())
    };
    let stream = g2o::stream(graph, &start)?;
    let truth = known.map(|known| of_stream(&stream, known)).transpose()?;
    let space = args.replay.space("g2o");
    let case = Case {
        start_pose,
        teams: vec![Team::alone(
            space,
            ROBOT,
            &stream,
            truth,
            args.replay.batch(),
        )],
        scoring: Scoring {
            pairing: Pairing::Own,
            alignment: alignment(graph),
            is_recorded: false,
        },
    };
    case.show(&args.replay)
}

fn alignment(graph: &G2oGraph) -> Alignment {
    if graph.is_planar() {
        Alignment::Planar
    } else {
        Alignment::Spatial
    }
}

/// Relaxes the graph as a whole, from rotations first and with all edges at their word.
fn solve(args: &G2oArgs, graph: &G2oGraph, known: Known<'_>) -> anyhow::Result<()> {
    let (mut map, nodes, points) = graph.to_pose_graph();
    let begin = Instant::now();
    map.relax(&RelaxationSettings {
        start: Start::RotationFirst,
        ..RelaxationSettings::default()
    });
    let batch_s = begin.elapsed().as_secs_f64();
    let poses: Vec<Isometry3<f64>> = nodes.values().map(|&node| *map.pose(node)).collect();
    ensure!(
        poses
            .iter()
            .all(|pose| pose.translation.vector.iter().all(|x| x.is_finite())),
        "the map is not finite: lengths or information are too large"
    );
    let frame = match known {
        Some(known) if begins_at_origin(known) => poses[0].inverse(),
        _ => Isometry3::identity(),
    };
    let placed = poses.iter().map(|pose| (frame * pose).translation.vector);
    let placed: Vec<Vector3<f64>> = placed.collect();
    let landmarks = points
        .values()
        .map(|&point| (frame * map.point(point)).coords);
    let landmarks: Vec<Vector3<f64>> = landmarks.collect();
    let error_m = |alignment| {
        let pairs = placed.iter().zip(known?);
        let (estimate, truth) = pairs
            .filter_map(|(at, known)| Some((*at, (*known)?)))
            .unzip();
        let errors = Pairs::by_index(estimate, truth).ok()?.errors(alignment);
        Some(errors.ok()?.rmse_m)
    };
    let optimum = Optimum {
        digest: map.digest().to_string(),
        poses: poses.len(),
        landmarks: points.len(),
        links: map.n_links(),
        closures: graph
            .edges()
            .iter()
            .filter(|edge| !edge.is_odometry())
            .count(),
        chi2_half: 0.5 * map.chi_squared(),
        refined_ate_rmse_m: error_m(Alignment::None),
        refined_aligned_ate_rmse_m: error_m(alignment(graph)),
        batch_s,
    };
    write(args, graph, &poses, (&placed, &landmarks, known))?;
    if args.replay.json {
        output::json(&optimum)
    } else {
        optimum.print()
    }
}

/// Writes the poses, each with its id in seconds as stamp, and the figure if it is asked for.
fn write(
    args: &G2oArgs,
    graph: &G2oGraph,
    poses: &[Isometry3<f64>],
    (placed, landmarks, known): (&[Vector3<f64>], &[Vector3<f64>], Known<'_>),
) -> anyhow::Result<()> {
    let Some(directory) = &args.replay.out else {
        return Ok(());
    };
    std::fs::create_dir_all(directory)?;
    let rows = graph
        .poses()
        .keys()
        .zip(poses)
        .map(|(&id, &pose)| StampedPose {
            stamp_ns: i64::try_from(id.saturating_mul(1_000_000_000)).unwrap_or(i64::MAX),
            pose,
        });
    let rows: Vec<StampedPose> = rows.collect();
    std::fs::write(directory.join("refined.tum"), write_tum(&rows))?;
    if args.replay.plot {
        let path = |label: &str, positions_m: Vec<Vector3<f64>>| paths::Path {
            label: label.to_owned(),
            positions_m,
        };
        let refined = [path("refined", placed.to_vec())];
        let reference =
            known.map(|known| path("reference", known.iter().flatten().copied().collect()));
        let title = args.file.file_name().unwrap_or_default().to_string_lossy();
        let figure = paths::figure(
            &title,
            "seen from above",
            &refined,
            reference.as_ref(),
            landmarks,
        )?;
        std::fs::write(directory.join("paths.svg"), figure.svg)?;
    }
    Ok(())
}

impl Optimum {
    fn print(&self) -> anyhow::Result<()> {
        output::line(&format!(
            "{} poses, {} landmarks, {} links, {} of them closures",
            self.poses, self.landmarks, self.links, self.closures
        ))?;
        output::line(&format!(
            "chi2/2 {:.4} in {:.2} s",
            self.chi2_half, self.batch_s
        ))?;
        let errors = self.refined_ate_rmse_m.zip(self.refined_aligned_ate_rmse_m);
        if let Some((plain, aligned)) = errors {
            output::line(&format!(
                "RMSE of position: {plain:.4} m, aligned {aligned:.4} m"
            ))?;
        }
        output::line(&format!("digest {}", self.digest))?;
        Ok(())
    }
}
