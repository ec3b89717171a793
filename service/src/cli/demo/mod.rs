//! `cogmap demo`: the service, with a simulated team that uses it as real robots would.

mod progress;
mod summary;
mod team;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use cogmap_client::Api;
use cogmap_proto::{Name, SpaceSettings};

use self::progress::Progress;
use self::summary::Summary;
use self::team::DemoTeam;
use super::duration::seconds;
use super::{free_port, output, serve};
use crate::config::Config;
use crate::metrics;
use crate::service::Service;

/// Ports that the demo takes if nobody else has them, as they are easiest to remember.
const HTTP_PORT: u16 = 8080;
const ZENOH_PORT: u16 = 7447;

#[derive(Debug, Args)]
pub(super) struct DemoArgs {
    /// How long the robots drive, such as 20s or 1m30s; a number alone is in seconds.
    #[arg(long, default_value = "60s", value_name = "DURATION", value_parser = seconds)]
    duration: f64,
    /// Number of robots.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=100))]
    robots: u32,
    /// Seed of the world, the walks and the noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Directory of the store, kept afterwards; a temporary one, removed, when absent.
    #[arg(long, value_name = "DIR", conflicts_with = "connect")]
    data_dir: Option<PathBuf>,
    /// Send only the robots, to the service at this Zenoh endpoint.
    #[arg(long, value_name = "ENDPOINT", requires = "http")]
    connect: Option<String>,
    /// Base of that service's HTTP interface.
    #[arg(long, value_name = "URL", requires = "connect")]
    http: Option<String>,
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
    let summary = match (&args.connect, &args.http) {
        (Some(endpoint), Some(url)) => runtime.block_on(visit(args, endpoint, url))?,
        _ => host(args, &runtime)?,
    };
    if args.json {
        output::json(&summary)
    } else {
        summary.print()
    }
}

/// Runs a service of its own for the robots.
fn host(args: &DemoArgs, runtime: &tokio::runtime::Runtime) -> anyhow::Result<Summary> {
    let directory = args.data_dir.clone().unwrap_or_else(|| {
        std::env::temp_dir().join(format!("cogmap-demo-{}", std::process::id()))
    });
    let mut config = Config::default();
    config.store.directory.clone_from(&directory);
    config.http.listen = ([127, 0, 0, 1], port(HTTP_PORT)?).into();
    let endpoint = format!("tcp/127.0.0.1:{}", port(ZENOH_PORT)?);
    config.zenoh.listen = vec![endpoint.clone()];
    config.spaces = [(args.space.clone(), SpaceSettings::default())].into();
    "warn".clone_into(&mut config.log.filter);
    output::start_log(&config.log);
    let prometheus = metrics::install()?;
    let summary = runtime.block_on(async {
        let service = Service::start(&config, prometheus.clone()).await?;
        let url = format!("http://{}", service.address());
        let summary = visit(args, &endpoint, &url).await;
        service.stop().await;
        summary
    });
    if args.data_dir.is_none() {
        // Left-overs in the temporary directory are no failure of the demo.
        let _ = std::fs::remove_dir_all(&directory);
    }
    let mut summary = summary?;
    summary.duplicates = Some(metrics::total(&prometheus, metrics::DUPLICATE_SAMPLES));
    Ok(summary)
}

/// Drives the robots against the service.
async fn visit(args: &DemoArgs, endpoint: &str, url: &str) -> anyhow::Result<Summary> {
    let (space, robots) = (args.space.as_str().to_owned(), args.robots);
    output::progress(&format!(
        "{robots} robots in the obstacle world, over {endpoint}"
    ));
    output::progress(&format!("start page   {url}/"));
    output::progress(&format!("HTTP API     {url}/docs"));
    output::progress(&format!(
        "try          curl {url}/v1/spaces/{space}/agents/robot1"
    ));
    let stop = Stop::default();
    let interrupted = stop.clone();
    tokio::spawn(async move {
        // Without signals the demo simply ends when its time is over.
        if serve::interrupted().await.is_ok() {
            interrupted.store(true, Ordering::Relaxed);
        }
    });
    let (api, endpoint) = (Api::new(url, args.token.as_deref()), endpoint.to_owned());
    let (seed, duration) = (args.seed, Duration::from_secs_f64(args.duration));
    tokio::task::spawn_blocking(move || {
        wait_until_ready(&api)?;
        if api.space(&space).is_err() {
            api.create_space(&space, &SpaceSettings::default())?;
        }
        let mut team = DemoTeam::connect(&endpoint, &space, robots, seed)?;
        let progress = Progress::new(robots, duration);
        team.drive(duration, &stop, &api, &progress)?;
        progress.finish();
        team.finish(&api)
    })
    .await?
}

/// Set when the demo is to end early.
type Stop = Arc<AtomicBool>;

/// The port if it is free, another free one otherwise.
fn port(wanted: u16) -> std::io::Result<u16> {
    match std::net::TcpListener::bind(("127.0.0.1", wanted)) {
        Ok(_) => Ok(wanted),
        Err(_) => free_port(),
    }
}

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
