//! `cogmap-lab bench ingest`.

use std::num::NonZero;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use anyhow::Context;
use clap::Args;
use cogmap_proto::{Name, SpaceSettings};
use serde::Serialize;
use zenoh::Session;

use super::load::raw_key;
use cogmap::cli::duration::seconds;
use cogmap::cli::{free_port, output};
use cogmap::config::Config;
use cogmap::engine::{AgentView, Space};
use cogmap::metrics;
use cogmap::service::Service;

/// Longest wait for the publisher to begin.
const TIMEOUT: Duration = Duration::from_secs(20);

#[derive(Debug, Args)]
pub(in crate::cli) struct IngestArgs {
    /// Samples of a message.
    #[arg(long, value_delimiter = ',', default_values_t = [1, 8, 64])]
    pub(super) samples_per_message: Vec<usize>,
    /// Length of each measurement, such as 5s; a number alone is in seconds.
    #[arg(long, default_value = "5s", value_name = "DURATION", value_parser = seconds)]
    pub(super) seconds: f64,
    /// Directory for the store; a temporary one, removed at the end, when absent.
    #[arg(long, value_name = "DIR")]
    pub(super) data_dir: Option<std::path::PathBuf>,
    /// Compare ingest while as many live streams of the space are open with ingest while none is,
    /// in turn, instead of with the raw rate.
    #[arg(long, value_name = "STREAMS")]
    pub(super) live: Option<NonZero<u16>>,
    /// Print one JSON object.
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    samples_per_message: usize,
    durable_samples_per_s: f64,
    raw_messages_per_s: f64,
    raw_samples_per_s: f64,
    /// Durable rate over raw rate.
    ratio: f64,
}

pub(super) fn run(args: &IngestArgs) -> anyhow::Result<()> {
    let bench = Bench::start(args.data_dir.clone())?;
    let mut rows = Vec::new();
    for &samples_per_message in &args.samples_per_message {
        output::progress(&format!("{samples_per_message} samples a message"));
        let raw_messages_per_s = bench.raw(samples_per_message, args.seconds)?;
        let durable_samples_per_s = bench.durable(samples_per_message, args.seconds)?;
        let raw_samples_per_s = raw_messages_per_s * samples_per_message as f64;
        rows.push(Row {
            samples_per_message,
            durable_samples_per_s,
            raw_messages_per_s,
            raw_samples_per_s,
            ratio: durable_samples_per_s / raw_samples_per_s,
        });
    }
    bench.stop();
    if args.json {
        return output::json(&Report { rows });
    }
    output::line("samples/message   durable samples/s   raw samples/s   ratio")?;
    for row in rows {
        output::line(&format!(
            "{:>15} {:>19.0} {:>15.0} {:>7.2}",
            row.samples_per_message, row.durable_samples_per_s, row.raw_samples_per_s, row.ratio
        ))?;
    }
    Ok(())
}

/// A service under load.
pub(in crate::cli) struct Bench {
    runtime: tokio::runtime::Runtime,
    service: Service,
    session: Session,
    endpoint: String,
    directory: std::path::PathBuf,
    temporary: bool,
}

impl Bench {
    pub(in crate::cli) fn start(directory: Option<std::path::PathBuf>) -> anyhow::Result<Self> {
        let temporary = directory.is_none();
        let directory = directory.unwrap_or_else(|| {
            std::env::temp_dir().join(format!("cogmap-bench-{}", std::process::id()))
        });
        let endpoint = format!("tcp/127.0.0.1:{}", free_port()?);
        let mut config = Config::default();
        config.http.listen = ([127, 0, 0, 1], 0).into();
        config.zenoh.listen = vec![endpoint.clone()];
        config.store.directory.clone_from(&directory);
        let prometheus = metrics::install()?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .enable_all()
            .build()?;
        let service = runtime.block_on(Service::start(&config, prometheus))?;
        let session = service
            .session()
            .context("the service has a zenoh session")?
            .clone();
        Ok(Self {
            runtime,
            service,
            session,
            endpoint,
            directory,
            temporary,
        })
    }

    pub(in crate::cli) fn runtime(&self) -> &tokio::runtime::Runtime {
        &self.runtime
    }

    pub(in crate::cli) fn service(&self) -> &Service {
        &self.service
    }

    /// A space of its own for each measurement.
    pub(in crate::cli) fn space(&self, name: &str) -> anyhow::Result<Arc<Space>> {
        let name: Name = name.parse()?;
        Ok(self
            .service
            .engine()
            .create_space(&name, &SpaceSettings::default())?
            .0)
    }

    /// Starts the publisher.
    pub(super) fn load(&self, arguments: &[(&str, String)]) -> anyhow::Result<Child> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["bench", "load", "--connect", &self.endpoint]);
        for (key, value) in arguments {
            command.args([key, value.as_str()]);
        }
        command
            .stdin(Stdio::null())
            .spawn()
            .context("start the publisher")
    }

    /// Messages a second that a subscriber gets who only counts; it subscribes as the service does.
    fn raw(&self, samples_per_message: usize, seconds: f64) -> anyhow::Result<f64> {
        let received = Arc::new(AtomicU64::new(0));
        let count = Arc::clone(&received);
        let space = format!("raw{samples_per_message}");
        let key = raw_key("*", "*");
        let subscriber = self.session.declare_subscriber(key).callback(move |_| {
            count.fetch_add(1, Ordering::Relaxed);
        });
        let subscriber = self
            .runtime
            .block_on(async { subscriber.await })
            .map_err(anyhow::Error::from_boxed)?;
        let mut child = self.load(&[
            ("--kind", "raw".into()),
            ("--space", space),
            ("--agent", "robot".into()),
            ("--samples-per-message", samples_per_message.to_string()),
            ("--seconds", seconds.to_string()),
        ])?;
        let rate = rate(seconds, || Ok(received.load(Ordering::Relaxed)));
        let status = child.wait()?;
        anyhow::ensure!(status.success(), "the publisher failed");
        drop(subscriber);
        rate
    }

    /// Samples a second that become durable.
    fn durable(&self, samples_per_message: usize, seconds: f64) -> anyhow::Result<f64> {
        let name = format!("durable{samples_per_message}");
        let space = self.space(&name)?;
        let mut child = self.load(&[
            ("--kind", "robot".into()),
            ("--space", name),
            ("--agent", "robot".into()),
            ("--samples-per-message", samples_per_message.to_string()),
            ("--seconds", seconds.to_string()),
        ])?;
        let rate = rate(seconds, || Ok(durable_of(&space)));
        let status = child.wait()?;
        anyhow::ensure!(status.success(), "the publisher failed");
        rate
    }

    pub(in crate::cli) fn stop(self) {
        self.runtime.block_on(self.service.stop());
        if self.temporary {
            // Left-overs in the temporary directory are no failure of the measurement.
            let _ = std::fs::remove_dir_all(&self.directory);
        }
    }
}

/// Durable samples of the robot.
pub(super) fn durable_of(space: &Space) -> u64 {
    space
        .agent("robot")
        .map_or(0, |view: Arc<AgentView>| view.watermark().durable)
}

/// Rate of a count over the middle of a measurement: from when it moves, without the first tenth.
pub(super) fn rate(seconds: f64, count: impl Fn() -> anyhow::Result<u64>) -> anyhow::Result<f64> {
    let deadline = Instant::now() + TIMEOUT;
    while count()? == 0 {
        anyhow::ensure!(Instant::now() < deadline, "nothing arrives");
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(Duration::from_secs_f64(seconds * 0.1));
    let (first, start) = (count()?, Instant::now());
    std::thread::sleep(Duration::from_secs_f64(seconds * 0.7));
    Ok((count()? - first) as f64 / start.elapsed().as_secs_f64())
}
