//! `cogmap-lab bench ingest --live`: ingest while live streams are open, beside ingest without.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use anyhow::Context;
use serde::Serialize;
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader};
use tokio::net::TcpStream;
use tokio::task::JoinHandle;

use super::ingest::{Bench, IngestArgs, durable_of};
use cogmap::cli::output;
use cogmap::engine::Space;

/// Pairs of a measurement with streams and one without, under one publisher. The order changes from
/// pair to pair, so that a drift of the machine's speed cancels.
const PAIRS: usize = 8;
/// Longest wait for samples and ticks to come.
const TIMEOUT: Duration = Duration::from_secs(20);

#[derive(Debug, Serialize)]
struct Report {
    rows: Vec<Row>,
}

#[derive(Debug, Serialize)]
struct Row {
    samples_per_message: usize,
    live_streams: u16,
    durable_samples_per_s: f64,
    live_durable_samples_per_s: f64,
    /// Durable rate with streams over that without: median of the pairs.
    ratio: f64,
    /// Ticks that all streams got together.
    ticks_per_s: f64,
}

/// Readers of live streams.
struct Readers {
    tasks: Vec<JoinHandle<()>>,
    ticks: Arc<AtomicU64>,
}

pub(super) fn run(args: &IngestArgs, live_streams: u16) -> anyhow::Result<()> {
    let bench = Bench::start(args.data_dir.clone())?;
    let rows = { args.samples_per_message.iter() }
        .map(|&samples| measure(&bench, samples, live_streams, args.seconds))
        .collect::<anyhow::Result<Vec<_>>>();
    bench.stop();
    let rows = rows?;
    if args.json {
        return output::json(&Report { rows });
    }
    output::line("samples/message   durable samples/s   with streams   ratio   ticks/s")?;
    for row in rows {
        output::line(&format!(
            "{:>15} {:>19.0} {:>14.0} {:>7.3} {:>9.0}",
            row.samples_per_message,
            row.durable_samples_per_s,
            row.live_durable_samples_per_s,
            row.ratio,
            row.ticks_per_s
        ))?;
    }
    Ok(())
}

fn measure(
    bench: &Bench,
    samples_per_message: usize,
    live_streams: u16,
    seconds: f64,
) -> anyhow::Result<Row> {
    output::progress(&format!("{samples_per_message} samples a message"));
    let name = format!("live{samples_per_message}");
    let space = bench.space(&name)?;
    let window = Duration::from_secs_f64(seconds / PAIRS as f64);
    let total_s = 4.0 * seconds + 2.0 * TIMEOUT.as_secs_f64();
    let mut publisher = bench.load(&[
        ("--kind", "robot".into()),
        ("--space", name.clone()),
        ("--agent", "robot".into()),
        ("--samples-per-message", samples_per_message.to_string()),
        ("--seconds", total_s.to_string()),
    ])?;
    let pairs = pairs(bench, &space, live_streams, window);
    // The publisher has no more to do; it was ours to start, so it is ours to end.
    let _ = publisher.kill();
    let _ = publisher.wait();
    let pairs = pairs?;
    let mean = |of: fn(&Pair) -> f64| pairs.iter().map(of).sum::<f64>() / pairs.len() as f64;
    let mut ratios: Vec<_> = pairs.iter().map(|pair| pair.watched / pair.alone).collect();
    ratios.sort_by(f64::total_cmp);
    Ok(Row {
        samples_per_message,
        live_streams,
        durable_samples_per_s: mean(|pair| pair.alone),
        live_durable_samples_per_s: mean(|pair| pair.watched),
        ratio: f64::midpoint(ratios[PAIRS / 2 - 1], ratios[PAIRS / 2]),
        ticks_per_s: mean(|pair| pair.ticks),
    })
}

/// Durable samples a second without and with streams, and ticks a second.
struct Pair {
    alone: f64,
    watched: f64,
    ticks: f64,
}

fn pairs(
    bench: &Bench,
    space: &Space,
    live_streams: u16,
    window: Duration,
) -> anyhow::Result<Vec<Pair>> {
    wait_until("no samples arrive", || durable_of(space) > 0)?;
    std::thread::sleep(window);
    let alone = || rate_over(window, || durable_of(space));
    let watched = || {
        let readers = Readers::open(bench, space.name(), live_streams)?;
        let (before, start) = (readers.ticks.load(Ordering::Relaxed), Instant::now());
        let rate = rate_over(window, || durable_of(space));
        let ticks = readers.ticks.load(Ordering::Relaxed) - before;
        anyhow::Ok((rate, ticks as f64 / start.elapsed().as_secs_f64()))
    };
    (0..PAIRS)
        .map(|pair| {
            let (alone, (watched, ticks)) = if pair % 2 == 0 {
                (alone(), watched()?)
            } else {
                let watched = watched()?;
                (alone(), watched)
            };
            Ok(Pair {
                alone,
                watched,
                ticks,
            })
        })
        .collect()
}

/// Rate of a count over a time.
fn rate_over(window: Duration, count: impl Fn() -> u64) -> f64 {
    let (first, start) = (count(), Instant::now());
    std::thread::sleep(window);
    (count() - first) as f64 / start.elapsed().as_secs_f64()
}

fn wait_until(otherwise: &str, condition: impl Fn() -> bool) -> anyhow::Result<()> {
    let deadline = Instant::now() + TIMEOUT;
    while !condition() {
        anyhow::ensure!(Instant::now() < deadline, "{otherwise}");
        std::thread::sleep(Duration::from_millis(1));
    }
    Ok(())
}

impl Readers {
    /// Opens streams at their default rate, and waits until ticks come.
    fn open(bench: &Bench, space: &str, live_streams: u16) -> anyhow::Result<Self> {
        let ticks = Arc::new(AtomicU64::new(0));
        let address = bench.service().address();
        let tasks = (0..live_streams)
            .map(|_| {
                let (space, ticks) = (space.to_owned(), Arc::clone(&ticks));
                bench.runtime().spawn(async move {
                    // Whoever waits for ticks notices that there are none.
                    let _ = read(address, &space, &ticks).await;
                })
            })
            .collect();
        let readers = Self { tasks, ticks };
        let first_ticks = u64::from(live_streams);
        wait_until("no ticks come", || {
            readers.ticks.load(Ordering::Relaxed) >= first_ticks
        })?;
        Ok(readers)
    }
}

impl Drop for Readers {
    fn drop(&mut self) {
        self.tasks.iter().for_each(JoinHandle::abort);
    }
}

/// Reads a live stream and counts its ticks.
async fn read(address: SocketAddr, space: &str, ticks: &AtomicU64) -> anyhow::Result<()> {
    let mut stream = TcpStream::connect(address).await?;
    let request = format!("GET /v1/spaces/{space}/live HTTP/1.1\r\nhost: localhost\r\n\r\n");
    stream.write_all(request.as_bytes()).await?;
    let mut lines = BufReader::new(stream).lines();
    while let Some(line) = lines.next_line().await.context("the stream breaks")? {
        if line == "event: tick" {
            ticks.fetch_add(1, Ordering::Relaxed);
        }
    }
    Ok(())
}
