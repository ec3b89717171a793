//! Arguments of every replay.

use std::path::PathBuf;

use clap::Args;
use cogmap_proto::limits::BATCH_SAMPLES_MAX;

use super::setting::Setting;

/// Most samples of a batch, unless another number is asked for.
const BATCH: u16 = 64;

/// Where samples go, and what is written and printed.
#[derive(Debug, Args)]
pub(super) struct ReplayArgs {
    /// Write `ROBOT.causal.tum` and `ROBOT.refined.tum` for each robot into this directory.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Draw each robot's paths, seen from above, as `ROBOT.paths.svg` beside them.
    #[arg(long, requires = "out")]
    pub(super) plot: bool,
    /// Send the samples through Zenoh to the service at this endpoint, and read the result over
    /// HTTP, instead of straight into the core.
    #[arg(long, value_name = "ENDPOINT", requires = "http")]
    pub(super) connect: Option<String>,
    /// Base of the service's HTTP interface.
    #[arg(long, value_name = "URL")]
    pub(super) http: Option<String>,
    /// Bearer token of the service's HTTP interface.
    #[arg(
        long,
        env = "COGMAP_TOKEN",
        value_name = "TOKEN",
        hide_env_values = true
    )]
    pub(super) token: Option<String>,
    /// Space that is created for the replay; it must not exist. The name of the format when
    /// absent.
    #[arg(long, value_name = "NAME")]
    pub(super) space: Option<String>,
    /// Most samples of a batch. Changes nothing but the number of messages.
    #[arg(long, default_value_t = BATCH, value_parser = clap::value_parser!(u16).range(1..=4096))]
    batch: u16,
    /// A setting of the space that is not the default, its value as JSON, e.g. `length_error_sd=0`.
    /// As often as there are some.
    #[arg(long, value_name = "NAME=VALUE", value_parser = Setting::read)]
    pub(super) setting: Vec<Setting>,
    /// Print one JSON object.
    #[arg(long)]
    pub(super) json: bool,
}

impl ReplayArgs {
    /// Straight into the core, with these settings; nothing is written.
    pub(super) fn in_core(setting: &[Setting]) -> Self {
        Self {
            out: None,
            plot: false,
            connect: None,
            http: None,
            token: None,
            space: None,
            batch: BATCH,
            setting: setting.to_vec(),
            json: false,
        }
    }

    /// Most samples of a batch.
    pub(super) fn batch(&self) -> usize {
        usize::from(self.batch).min(BATCH_SAMPLES_MAX)
    }

    /// The space, of this name where none is asked for.
    pub(super) fn space(&self, otherwise: &str) -> String {
        self.space.clone().unwrap_or_else(|| otherwise.to_owned())
    }
}

/// A share below one, of what is added or changed.
pub(super) fn share(text: &str) -> Result<f64, String> {
    let share: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (0.0..=0.99).contains(&share) {
        Ok(share)
    } else {
        Err("not from 0 to 0.99".to_owned())
    }
}
