//! `cogmap demo`: the service, with a simulated team that uses it as real robots would.

mod agents;
mod drive;
mod host;
mod progress;
mod story;
mod summary;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use cogmap_client::Api;
use cogmap_proto::{Name, SpaceSettings};

use self::drive::Drive;
use self::summary::Summary;
use super::duration::seconds;
use super::{ConfigArgs, output, serve};

#[derive(Debug, Args)]
pub(super) struct DemoArgs {
    #[command(flatten)]
    config: ConfigArgs,
    /// How long the robots fly, such as 20s or 1m30s; a number alone is in seconds. What does not
    /// fit into it does not happen.
    #[arg(long, default_value = "60s", value_name = "DURATION", value_parser = seconds)]
    duration: f64,
    /// How many times as fast as real ones the robots fly, send and sense.
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", value_parser = speed)]
    speed: f64,
    /// Number of robots, beside the arm.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100))]
    robots: u32,
    /// Seed of the room, the rounds and the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Send only the robots, to the service at this Zenoh endpoint; --http is then the base URL of
    /// its HTTP interface.
    #[arg(
        long,
        value_name = "ENDPOINT",
        requires = "http",
        conflicts_with_all = ["zenoh", "data_dir", "set"]
    )]
    connect: Option<String>,
    /// Bearer token of that service's HTTP interface.
    #[arg(
        long,
        env = "COGMAP_TOKEN",
        value_name = "TOKEN",
        hide_env_values = true
    )]
    token: Option<String>,
    /// Space of the robots.
    #[arg(long, default_value = "demo")]
    space: Name,
    /// Print one JSON object at the end.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &DemoArgs) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?;
    let summary = match (&args.connect, &args.config.http) {
        (Some(endpoint), Some(url)) => {
            let service = Doors {
                endpoint: endpoint.clone(),
                url: url.trim_end_matches('/').to_owned(),
                token: args.token.clone(),
            };
            runtime.block_on(visit(args, service))?
        }
        _ => host::run(args, &runtime)?,
    };
    if args.json {
        output::json(&summary)
    } else {
        summary.print()
    }
}

/// Where a service is reached.
struct Doors {
    /// Its Zenoh endpoint.
    endpoint: String,
    /// Base of its HTTP interface.
    url: String,
    /// Bearer token of that.
    token: Option<String>,
}

/// Drives the team against a service.
async fn visit(args: &DemoArgs, service: Doors) -> anyhow::Result<Summary> {
    let space = args.space.as_str().to_owned();
    let Doors {
        endpoint,
        url,
        token,
    } = service;
    output::progress(&format!("look at      {url}/?space={space}"));
    output::progress(&format!("HTTP API     {url}/docs"));
    output::progress(&format!(
        "try          curl {url}/v1/spaces/{space}/agents/robot1"
    ));
    output::progress(&format!("Zenoh        {endpoint}"));
    let stop = Stop::default();
    let interrupted = stop.clone();
    tokio::spawn(async move {
        // Without signals the demo simply ends when its time is over.
        if serve::interrupted().await.is_ok() {
            interrupted.store(true, Ordering::Relaxed);
        }
    });
    let api = Api::new(&url, token.as_deref());
    let (robots, seed, speed) = (args.robots, args.seed, args.speed);
    let duration_s = args.duration;
    tokio::task::spawn_blocking(move || {
        wait_until_ready(&api)?;
        if api.space(&space).is_err() {
            api.create_space(&space, &SpaceSettings::default())?;
        }
        let mut drive = Drive::connect(api, &endpoint, &space, (robots, seed, duration_s))?;
        drive.run(speed, &stop)?;
        drive.finish()
    })
    .await?
}

/// Set when the demo is to end early.
type Stop = Arc<AtomicBool>;

fn wait_until_ready(api: &Api) -> anyhow::Result<()> {
    // A store that was kept from an earlier demo takes a moment to load.
    for _ in 0..600 {
        if api.ready()? {
            return Ok(());
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    anyhow::bail!("the service is not ready after a minute")
}

/// Reads a factor of time.
fn speed(text: &str) -> Result<f64, String> {
    let speed = text.parse::<f64>().map_err(|error| error.to_string())?;
    if (0.1..=100.0).contains(&speed) {
        Ok(speed)
    } else {
        Err("a speed is 0.1 to 100".to_owned())
    }
}
