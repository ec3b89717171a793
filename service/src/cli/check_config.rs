//! `cogmap check-config`.

use anyhow::Context;

use super::{ConfigArgs, output};
use crate::decode::core_settings;

pub(super) fn run(args: &ConfigArgs) -> anyhow::Result<()> {
    let config = args.load()?;
    for (name, settings) in &config.spaces {
        core_settings(settings).with_context(|| format!("spaces.{name}"))?;
    }
    if config.http.is_open() {
        let address = config.http.listen;
        output::progress(&format!(
            "warning: anyone who reaches {address} can read and write: set http.token"
        ));
    }
    Ok(output::line(config.to_toml().trim_end())?)
}
