//! `cogmap check-config`.

use anyhow::Context;

use super::{ConfigArgs, output};
use crate::engine::core_settings;

pub(super) fn run(args: &ConfigArgs) -> anyhow::Result<()> {
    let config = args.load()?;
    for (name, settings) in &config.spaces {
        core_settings(settings).with_context(|| format!("spaces.{name}"))?;
    }
    Ok(output::line(config.to_toml().trim_end())?)
}
