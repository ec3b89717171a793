//! `cogmap-lab bench http`.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::Context;
use axum::Router;
use axum::http::header::CONTENT_TYPE;
use axum::routing::get;
use clap::Args;
use serde::Serialize;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

use super::ingest::{Bench, durable_of, rate};
use cogmap::cli::duration::seconds;
use cogmap::cli::output;
use cogmap::cli::quantile;
use cogmap::engine::Space;

#[derive(Debug, Args)]
pub(in crate::cli) struct HttpArgs {
    /// Connections that ask at the same time.
    #[arg(long, default_value_t = 16)]
    connections: usize,
    /// Length of each measurement, such as 5s; a number alone is in seconds.
    #[arg(long, default_value = "4s", value_name = "DURATION", value_parser = seconds)]
    seconds: f64,
    /// Messages a second that come in meanwhile, each of ten samples.
    #[arg(long, default_value_t = 1000.0)]
    ingest_messages_per_s: f64,
    /// Rounds of both handlers in turn.
    #[arg(long, default_value_t = 3)]
    rounds: usize,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Serialize)]
struct Report {
    answers_per_s: f64,
    us_p50: f64,
    us_p99: f64,
    bare_answers_per_s: f64,
    bare_us_p50: f64,
    bare_us_p99: f64,
    /// Ours over the bare handler's.
    ratio: f64,
    /// Durable samples a second while nobody asks, and while everybody does.
    ingest_samples_per_s_alone: f64,
    ingest_samples_per_s_under_load: f64,
    ingest_ratio: f64,
}

pub(super) fn run(args: &HttpArgs) -> anyhow::Result<()> {
    let bench = Bench::start(None)?;
    let name = "http";
    let space = bench.space(name)?;
    let rounds = args.rounds.max(1);
    let total_s = args.seconds * (4 * rounds + 4) as f64 + 10.0;
    let mut publisher = bench.load(&[
        ("--kind", "robot".into()),
        ("--space", name.into()),
        ("--agent", "robot".into()),
        ("--samples-per-message", "10".into()),
        ("--seconds", total_s.to_string()),
        ("--rate", args.ingest_messages_per_s.to_string()),
    ])?;
    let measured = measure(args, &bench, &space, rounds);
    // The publisher has no more to do; it was ours to start, so it is ours to end.
    let _ = publisher.kill();
    let _ = publisher.wait();
    bench.stop();
    let report = measured?;
    if args.json {
        return output::json(&report);
    }
    output::line("               answers/s     p50 [us]     p99 [us]")?;
    let row = |name: &str, rate: f64, p50: f64, p99: f64| {
        output::line(&format!("{name:<12} {rate:>11.0} {p50:>12.0} {p99:>12.0}"))
    };
    row("agent", report.answers_per_s, report.us_p50, report.us_p99)?;
    row(
        "bare axum",
        report.bare_answers_per_s,
        report.bare_us_p50,
        report.bare_us_p99,
    )?;
    output::line(&format!(
        "ratio {:.2}; ingest {:.0} samples/s alone, {:.0} under load, ratio {:.3}",
        report.ratio,
        report.ingest_samples_per_s_alone,
        report.ingest_samples_per_s_under_load,
        report.ingest_ratio
    ))?;
    Ok(())
}

fn measure(
    args: &HttpArgs,
    bench: &Bench,
    space: &Arc<Space>,
    rounds: usize,
) -> anyhow::Result<Report> {
    let durable = || Ok(durable_of(space));
    output::progress("ingest alone");
    let alone = rate(args.seconds, durable)?;
    let path = "/v1/spaces/http/agents/robot";
    let ours = bench.service().address();
    // The yardstick answers with as many bytes.
    let body = bench.runtime().block_on(ask_once(ours, path))?;
    let bare = bench.runtime().block_on(bare_handler(body))?;
    let (mut our_load, mut bare_load) = (Load::default(), Load::default());
    let mut under_load = Vec::new();
    for round in 0..rounds {
        output::progress(&format!("round {} of {rounds}", round + 1));
        let load = Running::start(bench, args.connections, ours, path);
        under_load.push(rate(args.seconds, durable)?);
        our_load.merge(load.stop(bench)?);
        let load = Running::start(bench, args.connections, bare, "/");
        std::thread::sleep(Duration::from_secs_f64(args.seconds * 0.8));
        bare_load.merge(load.stop(bench)?);
    }
    let under_load = under_load.iter().sum::<f64>() / under_load.len() as f64;
    Ok(Report {
        answers_per_s: our_load.rate(),
        us_p50: quantile(&mut our_load.us, 0.5),
        us_p99: quantile(&mut our_load.us, 0.99),
        bare_answers_per_s: bare_load.rate(),
        bare_us_p50: quantile(&mut bare_load.us, 0.5),
        bare_us_p99: quantile(&mut bare_load.us, 0.99),
        ratio: our_load.rate() / bare_load.rate(),
        ingest_samples_per_s_alone: alone,
        ingest_samples_per_s_under_load: under_load,
        ingest_ratio: under_load / alone,
    })
}

/// An axum handler that answers with fixed bytes.
async fn bare_handler(body: Vec<u8>) -> anyhow::Result<SocketAddr> {
    let listener = TcpListener::bind("127.0.0.1:0").await?;
    let address = listener.local_addr()?;
    let body = bytes::Bytes::from(body);
    let answer = move || async move { ([(CONTENT_TYPE, "application/json")], body) };
    let router: Router = Router::new().route("/", get(answer));
    tokio::spawn(async move { axum::serve(listener, router).await });
    Ok(address)
}

/// Times of answers.
#[derive(Debug, Default)]
struct Load {
    us: Vec<f64>,
    seconds: f64,
}

impl Load {
    fn merge(&mut self, other: Self) {
        self.us.extend(other.us);
        self.seconds += other.seconds;
    }

    fn rate(&self) -> f64 {
        self.us.len() as f64 / self.seconds
    }
}

/// Connections that ask without a pause.
struct Running {
    stop: Arc<AtomicBool>,
    start: Instant,
    tasks: Vec<tokio::task::JoinHandle<anyhow::Result<Vec<f64>>>>,
}

impl Running {
    fn start(bench: &Bench, connections: usize, to: SocketAddr, path: &'static str) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let tasks = (0..connections)
            .map(|_| bench.runtime().spawn(ask(Arc::clone(&stop), to, path)))
            .collect();
        Self {
            stop,
            start: Instant::now(),
            tasks,
        }
    }

    fn stop(self, bench: &Bench) -> anyhow::Result<Load> {
        self.stop.store(true, Ordering::Relaxed);
        let mut load = Load {
            us: Vec::new(),
            seconds: self.start.elapsed().as_secs_f64(),
        };
        for task in self.tasks {
            load.us.extend(bench.runtime().block_on(task)??);
        }
        Ok(load)
    }
}

/// Asks on one connection until told to stop; returns the time of each answer \[µs\].
async fn ask(
    stop: Arc<AtomicBool>,
    to: SocketAddr,
    path: &'static str,
) -> anyhow::Result<Vec<f64>> {
    let mut connection = Connection::open(to).await?;
    let mut times = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        let start = Instant::now();
        connection.get(path).await?;
        times.push(start.elapsed().as_secs_f64() * 1e6);
    }
    Ok(times)
}

async fn ask_once(to: SocketAddr, path: &str) -> anyhow::Result<Vec<u8>> {
    let mut connection = Connection::open(to).await?;
    Ok(connection.get(path).await?.to_vec())
}

/// A kept-alive connection that speaks just enough HTTP/1.1, so that the client costs little.
struct Connection {
    stream: TcpStream,
    buffer: Vec<u8>,
}

impl Connection {
    async fn open(to: SocketAddr) -> anyhow::Result<Self> {
        let stream = TcpStream::connect(to).await?;
        stream.set_nodelay(true)?;
        Ok(Self {
            stream,
            buffer: vec![0; 64 << 10],
        })
    }

    /// Body of the answer to a GET.
    async fn get(&mut self, path: &str) -> anyhow::Result<&[u8]> {
        let request = format!("GET {path} HTTP/1.1\r\nhost: localhost\r\n\r\n");
        self.stream.write_all(request.as_bytes()).await?;
        let mut read = 0;
        loop {
            let count = self.stream.read(&mut self.buffer[read..]).await?;
            anyhow::ensure!(count > 0, "the connection was closed");
            read += count;
            if let Some((body, length)) = head(&self.buffer[..read])?
                && read >= body + length
            {
                return Ok(&self.buffer[body..body + length]);
            }
        }
    }
}

/// Where the body begins and how long it is, once the head is complete.
fn head(answer: &[u8]) -> anyhow::Result<Option<(usize, usize)>> {
    let Some(end) = answer.windows(4).position(|four| four == b"\r\n\r\n") else {
        return Ok(None);
    };
    let head = std::str::from_utf8(&answer[..end])?;
    anyhow::ensure!(
        head.starts_with("HTTP/1.1 200"),
        "answer {:?}",
        head.lines().next()
    );
    let length = head
        .lines()
        .filter_map(|line| line.split_once(':'))
        .find(|(name, _)| name.eq_ignore_ascii_case("content-length"))
        .context("the answer has no content-length")?;
    Ok(Some((end + 4, length.1.trim().parse()?)))
}
