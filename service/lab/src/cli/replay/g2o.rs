//! `cogmap-lab replay g2o`.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use cogmap_lab::g2o::{Reference, recording};
use pose_graph::g2o::G2oGraph;
use trajectory::Alignment;

use super::recorded::{self, Case, RecordedArgs, Truth};

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
    #[command(flatten)]
    recorded: RecordedArgs,
}

pub(super) fn run(args: &G2oArgs) -> anyhow::Result<()> {
    let named = |path: &Path| path.display().to_string();
    let text = std::fs::read_to_string(&args.file)
        .with_context(|| format!("read {}", args.file.display()))?;
    let graph = G2oGraph::read(&text).with_context(|| named(&args.file))?;
    let beside = args.file.with_extension("opt_xyz.txt");
    let reference = args
        .reference
        .clone()
        .or_else(|| beside.exists().then_some(beside));
    let truth = match &reference {
        None => Truth::Unknown,
        Some(path) => {
            let text = std::fs::read_to_string(path)
                .with_context(|| format!("read {}", path.display()))?;
            let reference = Reference::read(&text).with_context(|| named(path))?;
            Truth::OfPoses(reference.of_poses(&graph).with_context(|| named(path))?)
        }
    };
    let case = Case {
        title: args
            .file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned(),
        recording: &recording(&graph),
        truth,
        alignment: if graph.is_planar() {
            Alignment::Planar
        } else {
            Alignment::Spatial
        },
        has_time: false,
        false_share: None,
    };
    recorded::run(&case, &args.recorded)
}
