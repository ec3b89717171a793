//! `cogmap-lab replay real`.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use cogmap::cli::output;
use cogmap_lab::csv::{Choice, TableSet};

use super::measured::{Measured, Measuring};
use super::real_report::RealReport;
use super::set_kind::SetKind;
use super::setting::Setting;
use crate::cli::eval::Host;

/// A directory with this file is a set.
const SAMPLES: &str = "samples.csv";

#[derive(Debug, Args)]
pub(in crate::cli) struct RealArgs {
    /// Directory whose subdirectories are sets, each as `replay csv` reads it, or one such set.
    directory: PathBuf,
    /// Leave out these channels.
    #[arg(long, value_name = "CHANNEL,CHANNEL", value_delimiter = ',')]
    no: Vec<String>,
    /// Send motions without the noise that the sets state, as a robot that knows nothing of its
    /// odometry.
    #[arg(long)]
    unstated_noise: bool,
    /// Seed of the order of sessions, where a set has many.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The agent whose route is remembered, where agents were on one route and this is one of them;
    /// elsewhere it is the first by name.
    #[arg(long, value_name = "AGENT")]
    taught: Option<String>,
    /// A setting of the spaces that is not the default, its value as JSON. As often as there are
    /// some.
    #[arg(long, value_name = "NAME=VALUE", value_parser = Setting::read)]
    setting: Vec<Setting>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &RealArgs) -> anyhow::Result<()> {
    let measuring = Measuring {
        choice: Choice {
            without: args.no.iter().cloned().collect(),
            unstated_noise: args.unstated_noise,
        },
        seed: args.seed,
        taught: args.taught.clone(),
        setting: args.setting.clone(),
    };
    let (mut measured, mut unread) = (BTreeMap::new(), BTreeMap::new());
    let mut host = None;
    let sets = sets(&args.directory)?;
    for (number, (name, directory)) in sets.into_iter().enumerate() {
        output::progress(&name);
        let space = format!("route-{number}");
        match measure(&measuring, &directory, &mut host, &space) {
            Ok(of_set) => drop(measured.insert(name, of_set)),
            Err(error) => drop(unread.insert(name, format!("{error:#}"))),
        }
    }
    drop(host);
    let is_any = !measured.is_empty();
    let report = RealReport::new(measured, unread);
    if args.json {
        output::json(&report)?;
    } else if is_any {
        report.print()?;
    }
    match report.complaint() {
        Some(complaint) => Err(anyhow::anyhow!(complaint).context("sets were not measured")),
        None => Ok(()),
    }
}

/// Measures one set. The service of the first that needs one serves all of them.
fn measure(
    measuring: &Measuring,
    directory: &Path,
    host: &mut Option<Host>,
    space: &str,
) -> anyhow::Result<Measured> {
    let set = TableSet::load(directory)?;
    match SetKind::of(&set, &measuring.choice.without) {
        SetKind::Route => {
            let host = match host {
                Some(host) => host,
                None => host.insert(Host::start()?),
            };
            measuring.ask(&set, &host.api(), space)
        }
        kind => measuring.replay(&set, kind),
    }
}

/// The sets of a directory, by their names: itself, or else its subdirectories that are some.
fn sets(directory: &Path) -> anyhow::Result<BTreeMap<String, PathBuf>> {
    let shown = || format!("read {}", directory.display());
    let name = |path: &Path| {
        path.file_name()
            .map(OsStr::to_string_lossy)
            .map(String::from)
    };
    if directory.join(SAMPLES).exists() {
        let whole = directory.canonicalize().with_context(shown)?;
        let name = name(&whole).unwrap_or_else(|| whole.display().to_string());
        return Ok(BTreeMap::from([(name, directory.to_owned())]));
    }
    let mut sets = BTreeMap::new();
    for entry in fs::read_dir(directory).with_context(shown)? {
        let path = entry.with_context(shown)?.path();
        if let Some(name) = name(&path).filter(|_| path.join(SAMPLES).exists()) {
            sets.insert(name, path);
        }
    }
    anyhow::ensure!(
        !sets.is_empty(),
        "{} holds no set: neither it nor a subdirectory has a file {SAMPLES}",
        directory.display()
    );
    Ok(sets)
}
