//! Metrics: their names, their descriptions, and the recorder behind `/metrics`.

mod process;

pub use process::resident_bytes;

use std::path::PathBuf;
use std::time::Duration;

use metrics::{Unit, counter, describe_counter, describe_gauge, describe_histogram, gauge};
use metrics_exporter_prometheus::{BuildError, Matcher, PrometheusBuilder, PrometheusHandle};
use tokio::time::MissedTickBehavior;

/// Messages received; label `codec` (`postcard`, `cbor`, `json`).
pub const RECEIVED_MESSAGES: &str = "cogmap_received_messages_total";
/// Bytes of messages received; label `codec`.
pub const RECEIVED_BYTES: &str = "cogmap_received_bytes_total";
/// Messages dropped whole; label `reason` (`queue_full`, `agent_queue_full`, `unknown_space`,
/// `bad_key`, `too_many_agents`, `stale_session`, `session_in_future`, `space_closed`,
/// `store_failed`).
pub const DROPPED_MESSAGES: &str = "cogmap_dropped_messages_total";
/// Messages that could not be read; label `kind`.
pub const DECODE_ERRORS: &str = "cogmap_decode_errors_total";
/// Samples skipped for good; labels `space`, `reason` (the wire's `SkipReason`, so `lost` too).
pub const SKIPPED_SAMPLES: &str = "cogmap_skipped_samples_total";
/// Samples applied to a map; label `space`.
pub const APPLIED_SAMPLES: &str = "cogmap_applied_samples_total";
/// Samples received again; label `space`.
pub const DUPLICATE_SAMPLES: &str = "cogmap_duplicate_samples_total";
/// Samples that came before earlier ones and were put in order; label `space`.
pub const REORDERED_SAMPLES: &str = "cogmap_reordered_samples_total";
/// Samples dropped because too many waited for earlier ones; label `space`.
pub const BEYOND_WINDOW_SAMPLES: &str = "cogmap_beyond_window_samples_total";
/// Samples that waited for earlier ones when their session was taken over; label `space`.
pub const ABANDONED_SAMPLES: &str = "cogmap_abandoned_samples_total";
/// Samples made durable; label `space`.
pub const DURABLE_SAMPLES: &str = "cogmap_durable_samples_total";
/// Bytes appended to journals; label `space`.
pub const JOURNAL_BYTES: &str = "cogmap_journal_bytes_total";
/// Time that a sync of the store takes \[s\].
pub const COMMIT_SECONDS: &str = "cogmap_commit_seconds";
/// Spaces that are stopped because their journal is damaged; label `space`: 1, or 0 once repaired.
pub const SPACE_STOPPED: &str = "cogmap_space_stopped";
/// Blocks cut off the ends of journals, which a crash had caught before they were acknowledged;
/// label `space`.
pub const TORN_TAILS: &str = "cogmap_journal_torn_tails_total";
/// Journals of which it was not known how far they were acknowledged; label `space`.
pub const LOST_MARKS: &str = "cogmap_journal_lost_marks_total";
/// Times that checkpoints and trajectories were dropped, to be made again from the journals.
pub const DERIVED_REBUILDS: &str = "cogmap_derived_rebuilds_total";
/// Checkpoints and chunks of trajectories that could not be read or written.
pub const DERIVED_FAILURES: &str = "cogmap_derived_failures_total";
/// Agents of a space; label `space`.
pub const AGENTS: &str = "cogmap_agents";
/// Agents removed so that others could enrol; label `space`.
pub const AGENTS_MADE_ROOM: &str = "cogmap_agents_made_room_total";
/// Places of a space; label `space`.
pub const PLACES: &str = "cogmap_places";
/// Trips of a space; label `space`.
pub const TRIPS: &str = "cogmap_trips";
/// Places forgotten because there was no room for another one; label `space`.
pub const FORGOTTEN_PLACES: &str = "cogmap_forgotten_places_total";
/// Trips forgotten because there was no room for another leg; label `space`.
pub const FORGOTTEN_TRIPS: &str = "cogmap_forgotten_trips_total";
/// Landmarks of a space; label `space`.
pub const LANDMARKS: &str = "cogmap_landmarks";
/// How far levels were from what their places had learned, in standard deviations; label `space`.
pub const LEVEL_SURPRISE: &str = "cogmap_level_surprise_deviations";
/// How far descriptors were from what their places had learned, as one minus the cosine; label
/// `space`.
pub const DESCRIPTOR_SURPRISE: &str = "cogmap_descriptor_surprise";
/// Samples applied in one round of a writer; label `space`.
pub const ROUND_SAMPLES: &str = "cogmap_round_samples";
/// Messages that wait for a space's writer; label `space`.
pub const QUEUE_MESSAGES: &str = "cogmap_queue_messages";
/// Estimates published; label `space`.
pub const PUBLISHED_ESTIMATES: &str = "cogmap_published_estimates_total";
/// Events that were not published over Zenoh because too many waited.
pub const UNPUBLISHED_EVENTS: &str = "cogmap_unpublished_events_total";
/// HTTP requests answered; labels `route` (the pattern, not the path), `status`.
pub const HTTP_REQUESTS: &str = "cogmap_http_requests_total";
/// Time from a request's head to its answer's head \[s\]; label `route`.
pub const HTTP_REQUEST_SECONDS: &str = "cogmap_http_request_seconds";
/// HTTP connections that the service closed; label `reason` (`room` for one that came, `head` that
/// took too long, `idle`).
pub const HTTP_CLOSED_CONNECTIONS: &str = "cogmap_http_closed_connections_total";
/// Event streams open now.
pub const HTTP_STREAMS: &str = "cogmap_http_streams";
/// Nodes of the cluster that take part, this one among them.
pub const CLUSTER_NODES: &str = "cogmap_cluster_nodes";
/// Shards that are open here.
pub const SHARDS_OPEN: &str = "cogmap_shards_open";
/// Shards that this node has opened.
pub const SHARDS_OPENED: &str = "cogmap_shards_opened_total";
/// Shards that this node has closed; label `reason` (`moved`, `lost` to another node or by a
/// failure).
pub const SHARDS_CLOSED: &str = "cogmap_shards_closed_total";
/// Requests that were passed on to other nodes; label `result` (`answered`, `failed`).
pub const FORWARDED_REQUESTS: &str = "cogmap_forwarded_requests_total";
/// Agents of a space by how they are localised; labels `space`, `status` (`localized`, `uncertain`,
/// `lost`, or `new` before the first sample).
pub const AGENTS_BY_STATUS: &str = "cogmap_agents_by_status";
/// Samples of one agent that are applied and not yet durable, the most of all agents; label
/// `space`.
pub const NOT_DURABLE_MAX: &str = "cogmap_not_durable_samples_max";
/// Samples of one agent that wait for earlier ones, the most of all agents; label `space`.
pub const WAITING_MAX: &str = "cogmap_waiting_samples_max";
/// What the store takes on its disk \[bytes\]; label `part` (a directory in it, or `top`).
pub const STORE_BYTES: &str = "cogmap_store_bytes";
/// Memory of the process that is in use \[bytes\], under the name that Prometheus has for it.
pub const PROCESS_MEMORY: &str = "process_resident_memory_bytes";
/// Open file descriptors of the process, under the name that Prometheus has for it.
pub const PROCESS_FDS: &str = "process_open_fds";
/// Most file descriptors that the process may open, under the name that Prometheus has for it.
pub const PROCESS_FDS_MAX: &str = "process_max_fds";

/// How often histograms are tended and the store is measured.
const UPKEEP_INTERVAL: Duration = Duration::from_secs(5);

/// Bounds of the histograms of times \[s\]: from a motion step to a stalled disk.
const SECONDS: [f64; 16] = [
    1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1, 0.2, 0.5, 1.0, 3.0, 10.0,
];
/// Bounds of the histograms of sample counts.
const COUNTS: [f64; 8] = [1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0, 16384.0];

/// Bounds of the histogram of deviations.
const DEVIATIONS: [f64; 10] = [0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 10.0, 30.0];
/// Bounds of the histogram of one minus the cosine.
const DISTANCES: [f64; 9] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.3, 0.5, 0.75, 1.0];

/// Installs the recorder of the process and describes the metrics. What was counted before is lost,
/// so this comes first.
///
/// # Errors
/// The process has a recorder already.
pub fn install() -> Result<PrometheusHandle, BuildError> {
    let handle = builder()?.install_recorder()?;
    describe();
    at_zero();
    Ok(handle)
}

/// Lets series without labels begin at zero: Prometheus sees no increase in one that appears with
/// its first fault. Those with labels begin where their labels are known.
fn at_zero() {
    for counter in [DERIVED_FAILURES, DERIVED_REBUILDS] {
        let _at_zero = counter!(counter);
    }
    let _at_zero = gauge!(HTTP_STREAMS);
}

/// Moves what histograms have recorded into their buckets from time to time. A scrape does that
/// too; where nobody scrapes, the records would pile up. Measures the store's `directory`, too, if
/// it has one.
pub async fn upkeep(handle: PrometheusHandle, directory: Option<PathBuf>) {
    let mut ticks = tokio::time::interval(UPKEEP_INTERVAL);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        handle.run_upkeep();
        let Some(directory) = directory.clone() else {
            continue;
        };
        // A panic there is in the log, and the next look may do better.
        let _ = tokio::task::spawn_blocking(move || process::record_store(&directory)).await;
    }
}

/// The metrics in Prometheus's text format, with what the process takes now.
pub fn render(handle: &PrometheusHandle) -> String {
    process::record();
    handle.render()
}

/// Sum of a counter over all its labels.
pub fn total(handle: &PrometheusHandle, counter: &str) -> u64 {
    let text = handle.render();
    text.lines()
        .filter(|line| !line.starts_with('#'))
        .filter(|line| line.split(['{', ' ']).next() == Some(counter))
        .filter_map(|line| line.rsplit(' ').next()?.parse::<u64>().ok())
        .sum()
}

fn builder() -> Result<PrometheusBuilder, BuildError> {
    PrometheusBuilder::new()
        .set_buckets_for_metric(Matcher::Suffix("_seconds".to_owned()), &SECONDS)?
        .set_buckets_for_metric(Matcher::Full(LEVEL_SURPRISE.to_owned()), &DEVIATIONS)?
        .set_buckets_for_metric(Matcher::Full(DESCRIPTOR_SURPRISE.to_owned()), &DISTANCES)?
        .set_buckets_for_metric(Matcher::Full(ROUND_SAMPLES.to_owned()), &COUNTS)
}

/// Tells the recorder what the metrics mean.
fn describe() {
    describe_damage();
    describe_samples();
    describe_memory();
    describe_http();
    describe_cluster();
    describe_states();
}

/// Tells the recorder what the metrics of samples on their way to the maps and back mean.
fn describe_samples() {
    describe_counter!(
        RECEIVED_MESSAGES,
        Unit::Count,
        "Messages received, by codec"
    );
    describe_counter!(RECEIVED_BYTES, Unit::Bytes, "Bytes received, by codec");
    describe_counter!(
        DROPPED_MESSAGES,
        Unit::Count,
        "Messages dropped whole, by reason"
    );
    describe_counter!(
        DECODE_ERRORS,
        Unit::Count,
        "Messages that could not be read, by kind"
    );
    describe_counter!(
        SKIPPED_SAMPLES,
        Unit::Count,
        "Samples skipped for good, by reason"
    );
    describe_counter!(APPLIED_SAMPLES, Unit::Count, "Samples applied to a map");
    describe_counter!(DUPLICATE_SAMPLES, Unit::Count, "Samples received again");
    describe_counter!(REORDERED_SAMPLES, Unit::Count, "Samples put in order");
    describe_counter!(
        BEYOND_WINDOW_SAMPLES,
        Unit::Count,
        "Samples too far ahead to wait"
    );
    describe_counter!(
        ABANDONED_SAMPLES,
        Unit::Count,
        "Samples of a session taken over"
    );
    describe_counter!(DURABLE_SAMPLES, Unit::Count, "Samples made durable");
    describe_counter!(JOURNAL_BYTES, Unit::Bytes, "Bytes appended to journals");
    describe_histogram!(COMMIT_SECONDS, Unit::Seconds, "Time of a sync of the store");
    describe_histogram!(ROUND_SAMPLES, Unit::Count, "Samples applied in one round");
    describe_gauge!(
        QUEUE_MESSAGES,
        Unit::Count,
        "Messages that wait for a space's writer"
    );
    describe_counter!(PUBLISHED_ESTIMATES, Unit::Count, "Estimates published");
    describe_counter!(
        UNPUBLISHED_EVENTS,
        Unit::Count,
        "Events not published over Zenoh: too many waited"
    );
}

/// Tells the recorder what the metrics of what the maps hold mean.
fn describe_memory() {
    describe_gauge!(AGENTS, Unit::Count, "Agents of a space");
    describe_counter!(
        AGENTS_MADE_ROOM,
        Unit::Count,
        "Agents removed so that others could enrol"
    );
    describe_gauge!(PLACES, Unit::Count, "Places of a space");
    describe_gauge!(TRIPS, Unit::Count, "Trips of a space");
    describe_counter!(
        FORGOTTEN_PLACES,
        Unit::Count,
        "Places forgotten to make room for others"
    );
    describe_counter!(
        FORGOTTEN_TRIPS,
        Unit::Count,
        "Trips forgotten to make room for legs of others"
    );
    describe_gauge!(LANDMARKS, Unit::Count, "Landmarks of a space");
    describe_histogram!(
        LEVEL_SURPRISE,
        Unit::Count,
        "Distance of levels from what was expected, in standard deviations"
    );
    describe_histogram!(
        DESCRIPTOR_SURPRISE,
        Unit::Count,
        "Distance of descriptors from what was expected, as one minus the cosine"
    );
}

/// Tells the recorder what the metrics of HTTP mean.
fn describe_http() {
    describe_counter!(
        HTTP_REQUESTS,
        Unit::Count,
        "HTTP requests, by route and status"
    );
    describe_histogram!(
        HTTP_REQUEST_SECONDS,
        Unit::Seconds,
        "Time to the head of an answer"
    );
    describe_counter!(
        HTTP_CLOSED_CONNECTIONS,
        Unit::Count,
        "HTTP connections that the service closed, by reason"
    );
    describe_gauge!(HTTP_STREAMS, Unit::Count, "Event streams open now");
}

/// Tells the recorder what the metrics of the cluster mean.
fn describe_cluster() {
    describe_gauge!(CLUSTER_NODES, Unit::Count, "Nodes that take part");
    describe_gauge!(SHARDS_OPEN, Unit::Count, "Shards that are open here");
    describe_counter!(SHARDS_OPENED, Unit::Count, "Shards opened");
    describe_counter!(SHARDS_CLOSED, Unit::Count, "Shards closed, by reason");
    describe_counter!(
        FORWARDED_REQUESTS,
        Unit::Count,
        "Requests passed on to other nodes"
    );
}

/// Tells the recorder what the metrics of the agents' and the process's state mean.
fn describe_states() {
    describe_gauge!(
        AGENTS_BY_STATUS,
        Unit::Count,
        "Agents of a space, by how they are localised"
    );
    describe_gauge!(
        NOT_DURABLE_MAX,
        Unit::Count,
        "Largest number of samples of one agent applied and not yet durable"
    );
    describe_gauge!(
        WAITING_MAX,
        Unit::Count,
        "Largest number of samples of one agent that wait for earlier ones"
    );
    describe_gauge!(
        STORE_BYTES,
        Unit::Bytes,
        "Disk that the store takes, by directory"
    );
    describe_gauge!(
        PROCESS_MEMORY,
        Unit::Bytes,
        "Resident memory of the process"
    );
    describe_gauge!(PROCESS_FDS, Unit::Count, "Open file descriptors");
    describe_gauge!(
        PROCESS_FDS_MAX,
        Unit::Count,
        "Most file descriptors that may be open"
    );
}

/// Tells the recorder what the metrics of damage mean.
fn describe_damage() {
    describe_gauge!(
        SPACE_STOPPED,
        Unit::Count,
        "Whether a space is stopped because it is damaged"
    );
    describe_counter!(
        TORN_TAILS,
        Unit::Count,
        "Ends of journals cut off that were never acknowledged"
    );
    describe_counter!(
        LOST_MARKS,
        Unit::Count,
        "Journals of which it was not known how far they were acknowledged"
    );
    describe_counter!(
        DERIVED_REBUILDS,
        Unit::Count,
        "Times that derived state was dropped"
    );
    describe_counter!(
        DERIVED_FAILURES,
        Unit::Count,
        "Derived state that could not be read or written"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The metrics that this file names: constant and name.
    fn named() -> Vec<(&'static str, &'static str)> {
        let lines = include_str!("metrics.rs").lines();
        let constants = lines.filter_map(|line| line.strip_prefix("pub const "));
        constants
            .filter_map(|line| line.split_once(": &str = \""))
            .filter_map(|(constant, name)| Some((constant, name.strip_suffix("\";")?)))
            .collect()
    }

    #[test]
    fn every_metric_is_described_here_and_on_the_page_of_metrics() {
        let (source, page) = (
            include_str!("metrics.rs"),
            include_str!("../../docs/metrics.md"),
        );
        let named = named();
        assert!(named.len() > 30, "{named:?}");
        for (constant, name) in &named {
            let described = ["counter", "gauge", "histogram"].iter().any(|kind| {
                let one_line = format!("describe_{kind}!({constant},");
                let lines = format!("describe_{kind}!(\n        {constant},");
                source.contains(&one_line) || source.contains(&lines)
            });
            assert!(described, "{constant} has no help");
            assert!(
                page.contains(&format!("| `{name}` |")),
                "{name} is not there"
            );
        }
        let rows = page.lines().filter_map(|line| line.strip_prefix("| `"));
        for name in rows.filter_map(|row| row.split('`').next()) {
            let known = named.iter().any(|(_, known)| *known == name);
            assert!(known, "the page knows {name}, the code does not");
        }
    }

    #[test]
    fn a_scrape_says_what_the_process_takes() {
        let recorder = builder().expect("buckets are not empty").build_recorder();
        let handle = recorder.handle();
        let text = metrics::with_local_recorder(&recorder, || {
            process::record_store(std::path::Path::new(env!("CARGO_MANIFEST_DIR")));
            render(&handle)
        });
        let value = |name: &str| -> f64 {
            let line = text
                .lines()
                .find(|line| line.starts_with(&format!("{name} ")));
            let line = line.unwrap_or_else(|| panic!("{name} is not in:\n{text}"));
            line.rsplit(' ')
                .next()
                .and_then(|v| v.parse().ok())
                .expect("a number")
        };
        assert!((1e6..1e12).contains(&value(PROCESS_MEMORY)));
        assert!((3.0..value(PROCESS_FDS_MAX)).contains(&value(PROCESS_FDS)));
        assert!(value("cogmap_store_bytes{part=\"src\"}") > 1e5);
    }

    #[test]
    fn what_is_counted_appears_with_its_description_and_buckets() {
        let recorder = builder().expect("buckets are not empty").build_recorder();
        let handle = recorder.handle();
        metrics::with_local_recorder(&recorder, || {
            describe();
            metrics::counter!(APPLIED_SAMPLES, "space" => "lab").increment(3);
            metrics::histogram!(COMMIT_SECONDS).record(0.004);
            metrics::histogram!(ROUND_SAMPLES, "space" => "lab").record(20.0);
        });
        let text = handle.render();
        for line in [
            "# HELP cogmap_applied_samples_total Samples applied to a map",
            "cogmap_applied_samples_total{space=\"lab\"} 3",
            "cogmap_commit_seconds_bucket{le=\"0.005\"} 1",
            "cogmap_commit_seconds_bucket{le=\"0.002\"} 0",
            "cogmap_round_samples_bucket{space=\"lab\",le=\"64\"} 1",
        ] {
            assert!(text.contains(line), "{line} is not in:\n{text}");
        }
    }
}
