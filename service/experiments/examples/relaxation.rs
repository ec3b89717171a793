//! Relaxes maps and measures it: pose graphs (`*.g2o`) as a whole and node by node, and sets with place matches (a
//! directory in the TUC format) with more and more false ones.
//!
//! ```sh
//! cargo run --release -p cogmap-experiments --example relaxation -- data/g2o/*.g2o data/lecture_hall
//! ```
//!
//! Of a graph whose optimum stands beside it (`NAME.opt_xyz.txt`: id, x, y and z in columns) the error of the newest
//! node as it arrived is given too, after a rigid alignment.

#![allow(clippy::print_stdout, reason = "an example talks to the terminal")]

use std::error::Error;
use std::path::Path;
use std::time::Instant;

use cogmap_experiments::g2o::{Feed, PoseGraph};
use cogmap_experiments::metrics::{Alignment, Pairs, Span, Trajectory, ate_rmse_m};
use cogmap_experiments::tuc::{Match, MatchNoise, MatchedMap, Tuc};
use cognitive_map::experience::{
    ExperienceMap, Graduation, IncrementalRelaxation, IncrementalSettings, Kernel,
    RelaxationSettings, Scale, Start,
};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Places further apart than this are different places \[m\].
const SAME_PLACE_M: f64 = 2.0;

/// Shorter gaps between the moments of a match say nothing that odometry does not \[ns\].
const GAP_NS: i64 = 10_000_000_000;

fn main() -> Result<(), Box<dyn Error>> {
    for argument in std::env::args_os().skip(1) {
        let path = Path::new(&argument);
        if path.is_dir() {
            for false_share in [None, Some(0.8)] {
                matched(path, false_share)?;
            }
        } else {
            whole(path)?;
            node_by_node(path)?;
        }
    }
    Ok(())
}

/// The best of three relaxations from rotations.
fn whole(path: &Path) -> Result<(), Box<dyn Error>> {
    let (map, _) = PoseGraph::load(path)?.experience_map();
    let settings = RelaxationSettings {
        start: Start::RotationFirst,
        ..RelaxationSettings::default()
    };
    for _ in 0..3 {
        let mut map = map.clone();
        let begin = Instant::now();
        let report = map.relax(&settings);
        println!(
            "{}: whole: chi2/2 {:.4} after {} steps, {:.1} ms",
            path.display(),
            0.5 * report.chi_squared,
            report.n_steps,
            begin.elapsed().as_secs_f64() * 1e3,
        );
    }
    Ok(())
}

fn node_by_node(path: &Path) -> Result<(), Box<dyn Error>> {
    let graph = PoseGraph::load(path)?;
    let mut map = ExperienceMap::new();
    let mut live = IncrementalRelaxation::new(IncrementalSettings::default());
    let mut feed = Feed::new(&graph, Kernel::Gaussian);
    let (mut causal, mut times_ms) = (Vec::new(), Vec::new());
    loop {
        let begin = Instant::now();
        let Some(node) = feed.step(&mut map) else {
            break;
        };
        live.update(&mut map);
        causal.push(map.pose(node).translation.vector);
        times_ms.push(begin.elapsed().as_secs_f64() * 1e3);
    }
    let last: Vec<_> = feed
        .nodes()
        .values()
        .map(|&node| map.pose(node).translation.vector)
        .collect();
    let alignment = if graph.is_planar() {
        Alignment::Planar
    } else {
        Alignment::Spatial
    };
    let error = |estimate: Vec<Vector3<f64>>| -> Result<String, Box<dyn Error>> {
        Ok(match optimum(path)? {
            Some(optimum) => {
                let summary = Pairs::by_index(estimate, optimum)?.errors(alignment)?;
                format!("{:.4}", summary.rmse_m)
            }
            None => "unknown".to_owned(),
        })
    };
    let mean_ms = times_ms.iter().sum::<f64>() / times_ms.len() as f64;
    times_ms.sort_by(f64::total_cmp);
    println!(
        "{}: node by node: newest off by {}, all at the end by {}, chi2/2 {:.4}, ms an update: mean {mean_ms:.2}, \
         p99 {:.1}, max {:.1}",
        path.display(),
        error(causal)?,
        error(last)?,
        0.5 * map.chi_squared(),
        times_ms[times_ms.len() * 99 / 100],
        times_ms[times_ms.len() - 1],
    );
    Ok(())
}

/// Positions in the file beside a graph's, if there is one.
fn optimum(path: &Path) -> Result<Option<Vec<Vector3<f64>>>, Box<dyn Error>> {
    let path = path.with_extension("opt_xyz.txt");
    if !path.exists() {
        return Ok(None);
    }
    let mut positions = Vec::new();
    for line in std::fs::read_to_string(path)?
        .lines()
        .filter(|line| !line.starts_with('#'))
    {
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        let numbers = numbers?;
        let coordinate = |k: usize| numbers.get(k).copied().unwrap_or(0.0);
        positions.push(Vector3::new(coordinate(1), coordinate(2), coordinate(3)));
    }
    Ok(Some(positions))
}

/// With the set's own matches, or with false ones added until they make up a share.
fn matched(path: &Path, false_share: Option<f64>) -> Result<(), Box<dyn Error>> {
    let set = Tuc::load(path)?;
    let is_true = |candidate: &Match| {
        let (a, b) = (
            set.truth().at(candidate.later_ns),
            set.truth().at(candidate.earlier_ns),
        );
        a.zip(b).is_some_and(|(a, b)| (a - b).norm() < SAME_PLACE_M)
    };
    let mut matches: Vec<Match> = set.matches().to_vec();
    matches.retain(|candidate| candidate.later_ns - candidate.earlier_ns > GAP_NS);
    let n_true = matches
        .iter()
        .filter(|candidate| is_true(candidate))
        .count();
    if let Some(share) = false_share {
        let moments: Vec<i64> = matches
            .iter()
            .flat_map(|m| [m.later_ns, m.earlier_ns])
            .collect();
        let mut random = ChaCha8Rng::seed_from_u64(1);
        while ((matches.len() - n_true) as f64) < share * matches.len() as f64 {
            let mut any = || moments[random.random_range(0..moments.len())];
            let (a, b) = (any(), any());
            let candidate = Match {
                later_ns: a.max(b),
                earlier_ns: a.min(b),
                score: 0.5,
            };
            if candidate.later_ns - candidate.earlier_ns > GAP_NS && !is_true(&candidate) {
                matches.push(candidate);
            }
        }
    }
    let noise = MatchNoise {
        position_sd_m: 0.5,
        heading_sd_rad: 0.2,
        kernel: Kernel::GemanMcClure(Scale::new(3.0)?),
    };
    let settings = RelaxationSettings {
        graduation: Graduation::FromWide,
        ..RelaxationSettings::default()
    };
    let begin = Instant::now();
    let mut map = MatchedMap::new(&set, &matches, &noise);
    let estimate = Trajectory::from_poses(&map.relaxed(&settings))?;
    let seconds = begin.elapsed().as_secs_f64();
    let span = Span::common([estimate.span(), set.truth().span()]).ok_or("no common span")?;
    println!(
        "{}: {} matches, {:.1} % false: aligned {:.3} m, {seconds:.2} s",
        path.display(),
        matches.len(),
        100.0 * (1.0 - n_true as f64 / matches.len() as f64),
        ate_rmse_m(&estimate, set.truth(), span, Alignment::Planar)?,
    );
    Ok(())
}
