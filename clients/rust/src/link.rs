//! Opening a Zenoh session towards a router.

use std::thread;
use std::time::{Duration, Instant};

use zenoh::{Config, Session, Wait};

use crate::credentials::Credentials;
use crate::error::ClientError;
use crate::settings::deadline;

/// Longest time for one attempt at one endpoint: Zenoh's own default.
const OPEN_TIMEOUT_MAX: Duration = Duration::from_secs(10);
/// Pause between two attempts to connect.
const RETRY_PAUSE: Duration = Duration::from_millis(200);

/// Opens a Zenoh session in client mode, without multicast, to the first of `endpoints` that
/// answers. Waits up to `timeout` for a router that is not up yet. Once open, a lost connection is
/// made anew by Zenoh itself.
///
/// # Errors
/// There is no endpoint, one is malformed, or no router answers in time.
pub fn open_session<S: AsRef<str>>(
    endpoints: &[S],
    timeout: Duration,
) -> Result<Session, ClientError> {
    open_session_as(endpoints, &Credentials::default(), timeout)
}

/// As [`open_session`], showing credentials.
///
/// # Errors
/// As [`open_session`]; or the credentials cannot be used, or the router does not accept them.
pub fn open_session_as<S: AsRef<str>>(
    endpoints: &[S],
    credentials: &Credentials,
    timeout: Duration,
) -> Result<Session, ClientError> {
    let endpoints: Vec<String> = endpoints.iter().map(|e| e.as_ref().to_owned()).collect();
    if endpoints.is_empty() {
        return Err(ClientError::Settings("there is no endpoint to connect to"));
    }
    let config = credentials.config().map_err(ClientError::Credentials)?;
    let config = client_config(config, &endpoints, timeout)
        .map_err(|_| ClientError::Settings("an endpoint is like tcp/127.0.0.1:7447"))?;
    let deadline = deadline(timeout);
    loop {
        // Zenoh's own retry waits for every endpoint of the list, so one that is down would fail
        // the whole: each attempt here is a single pass over the list.
        match zenoh::open(config.clone()).wait() {
            Ok(session) => return Ok(session),
            Err(source) if Instant::now() + RETRY_PAUSE >= deadline => {
                return Err(ClientError::Connect {
                    endpoints,
                    timeout,
                    source,
                });
            }
            Err(_) => thread::sleep(RETRY_PAUSE),
        }
    }
}

fn client_config(
    mut config: Config,
    endpoints: &[String],
    timeout: Duration,
) -> zenoh::Result<Config> {
    let endpoints = serde_json::to_string(endpoints)?;
    // An address that swallows packets must not hold one attempt beyond the whole time.
    let open_timeout_ms = timeout.min(OPEN_TIMEOUT_MAX).as_millis().max(1).to_string();
    for (key, value) in [
        ("mode", "\"client\""),
        ("connect/endpoints", &endpoints),
        ("connect/timeout_ms", "0"),
        ("connect/exit_on_failure", "true"),
        // After a loss, look for the router at least every second.
        (
            "connect/retry",
            "{ period_init_ms: 100, period_max_ms: 1000, period_increase_factor: 2 }",
        ),
        ("transport/unicast/open_timeout", &open_timeout_ms),
        ("listen/endpoints", "[]"),
        ("scouting/multicast/enabled", "false"),
        ("scouting/gossip/enabled", "false"),
    ] {
        config.insert_json5(key, value)?;
    }
    Ok(config)
}
