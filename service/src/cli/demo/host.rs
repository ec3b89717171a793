//! A service of the demo's own: settings as `cogmap serve` takes them, over defaults of the demo.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use anyhow::Context;
use tokio::runtime::Runtime;

use super::summary::Summary;
use super::{DemoArgs, Doors, visit};
use crate::cli::{free_port, output};
use crate::config::{Config, ConfigError, ZenohMode};
use crate::metrics;
use crate::ports;
use crate::service::{Service, StartError};

/// Runs a service for the robots.
pub(super) fn run(args: &DemoArgs, runtime: &Runtime) -> anyhow::Result<Summary> {
    let temporary = std::env::temp_dir().join(format!("cogmap-demo-{}", std::process::id()));
    let mut config = settings(args, &temporary)?;
    output::start_log(&config.log);
    let prometheus = metrics::install()?;
    let summary = runtime.block_on(async {
        let (service, endpoint) = loop {
            let endpoint = endpoint(&config)?;
            let error = match Service::start(&config, prometheus.clone()).await {
                Ok(service) => break (service, endpoint),
                Err(error) => error,
            };
            // Another program may take a port after it was found free. Of a port that the user
            // named there is no other choice, whatever the demo chooses for the rest.
            let has_other_choice = match error {
                StartError::HttpTaken { .. } => |a: &Config, b: &Config| a.http != b.http,
                StartError::ZenohTaken { .. } => |a: &Config, b: &Config| a.zenoh != b.zenoh,
                _ => return Err(error.into()),
            };
            let again = settings(args, &temporary)?;
            if !has_other_choice(&again, &config) {
                return Err(error.into());
            }
            config = again;
        };
        let doors = Doors {
            endpoint,
            url: format!("http://{}", reachable(service.address())),
            token: config
                .http
                .token
                .as_ref()
                .map(|token| token.reveal().to_owned()),
        };
        let summary = visit(args, doors).await;
        service.stop().await;
        summary
    });
    if config.store.directory == temporary {
        // Left-overs in the temporary directory are no failure of the demo.
        let _ = std::fs::remove_dir_all(&temporary);
    }
    let mut summary = summary?;
    summary.duplicates = Some(metrics::total(&prometheus, metrics::DUPLICATE_SAMPLES));
    Ok(summary)
}

/// The settings. What the user says holds; what the user does not say is the demo's choice: a
/// temporary store, the space, few words in the log, and free ports in place of taken ones. A demo
/// is there to be looked at and nobody relies on its ports, so it says where it goes instead. The
/// service refuses a port that the user names and another program has.
fn settings(args: &DemoArgs, temporary: &Path) -> anyhow::Result<Config> {
    let mut choices = Choices {
        directory: temporary.to_owned(),
        space: args.space.as_str().to_owned(),
        http: None,
        zenoh: None,
    };
    let usual = args.config.load_over(choices.table())?;
    if ports::is_taken(usual.http.listen) {
        choices.http = Some(format!("127.0.0.1:{}", free_port()?));
    }
    let taken = ports::taken_endpoint(usual.zenoh.endpoints());
    if taken.is_some() {
        choices.zenoh = Some(format!("tcp/127.0.0.1:{}", free_port()?));
    }
    let config = args.config.load_over(choices.table())?;
    if config.http.listen != usual.http.listen {
        output::progress(&format!(
            "{} is taken by another program, so HTTP is at {}; --set http.listen=ADDRESS:PORT \
             chooses",
            usual.http.listen, config.http.listen
        ));
    }
    if let (Some(taken), [endpoint]) = (taken, config.zenoh.endpoints())
        && taken != endpoint
    {
        output::progress(&format!(
            "{taken} is taken by another program, so Zenoh is at {endpoint}; \
             --set zenoh.listen=ENDPOINT chooses, and if rmw_zenohd runs there, be its client: \
             cogmap demo --set zenoh.mode=client --set zenoh.connect={taken}"
        ));
    }
    Ok(config)
}

/// What the demo chooses where the user has said nothing.
struct Choices {
    directory: PathBuf,
    space: String,
    http: Option<String>,
    zenoh: Option<String>,
}

impl Choices {
    fn table(&self) -> toml::Table {
        let text = |text: &str| toml::Value::String(text.to_owned());
        let section =
            |key: &str, value| toml::Value::Table([(key.to_owned(), value)].into_iter().collect());
        let directory = self.directory.display().to_string();
        let space = toml::Value::Table(toml::Table::new());
        let mut sections = vec![
            ("store", section("directory", text(&directory))),
            ("spaces", section(&self.space, space)),
            ("log", section("filter", text("warn"))),
        ];
        let http = self.http.as_deref();
        sections.extend(http.map(|http| ("http", section("listen", text(http)))));
        let zenoh = self.zenoh.as_deref().map(|endpoint| {
            let endpoints = toml::Value::Array(vec![text(endpoint)]);
            ("zenoh", section("listen", endpoints))
        });
        sections.extend(zenoh);
        sections
            .into_iter()
            .map(|(name, section)| (name.to_owned(), section))
            .collect()
    }
}

/// Where the robots reach the service: the router of both if it is a client.
fn endpoint(config: &Config) -> anyhow::Result<String> {
    let zenoh = &config.zenoh;
    if !zenoh.enabled {
        let of_zenoh = ConfigError::Invalid {
            key: "zenoh.enabled",
            value: "false".to_owned(),
            rule: "true for the demo, whose robots speak Zenoh",
        };
        return Err(of_zenoh.into());
    }
    let endpoints = match zenoh.mode {
        ZenohMode::Client => &zenoh.connect,
        ZenohMode::Peer | ZenohMode::Router => &zenoh.listen,
    };
    let endpoint = endpoints.first().context(
        "the demo's robots need an endpoint: zenoh.listen, or in client mode zenoh.connect, is \
         empty",
    )?;
    Ok(endpoint.replace("/0.0.0.0:", "/127.0.0.1:"))
}

/// An address of this machine at which a listener is reached.
fn reachable(mut address: SocketAddr) -> SocketAddr {
    if address.ip().is_unspecified() {
        address.set_ip([127, 0, 0, 1].into());
    }
    address
}
