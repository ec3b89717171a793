//! A service of its own for an experiment that asks as a user does.

use std::net::SocketAddr;
use std::path::PathBuf;

use cogmap::cli::free_port;
use cogmap::config::Config;
use cogmap::metrics;
use cogmap::service::Service;
use cogmap_client::Api;

/// A service on loopback. It ends when it is dropped, and its store with it.
pub(in crate::cli) struct Host {
    runtime: tokio::runtime::Runtime,
    /// `None` once it has ended.
    service: Option<Service>,
    address: SocketAddr,
    directory: PathBuf,
}

impl Host {
    /// Starts it.
    pub(in crate::cli) fn start() -> anyhow::Result<Self> {
        let name = format!("cogmap-eval-{}", std::process::id());
        let directory = std::env::temp_dir().join(name);
        let mut config = Config::default();
        config.http.listen = ([127, 0, 0, 1], 0).into();
        config.zenoh.listen = vec![format!("tcp/127.0.0.1:{}", free_port()?)];
        config.store.directory.clone_from(&directory);
        let prometheus = metrics::install()?;
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .enable_all()
            .build()?;
        let service = runtime.block_on(Service::start(&config, prometheus))?;
        Ok(Self {
            runtime,
            address: service.address(),
            service: Some(service),
            directory,
        })
    }

    /// A client of it.
    pub(in crate::cli) fn api(&self) -> Api {
        Api::new(&format!("http://{}", self.address), None)
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        if let Some(service) = self.service.take() {
            self.runtime.block_on(service.stop());
        }
        // What is left of it is in the directory for temporary files.
        let _ = std::fs::remove_dir_all(&self.directory);
    }
}
