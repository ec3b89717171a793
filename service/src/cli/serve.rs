//! `cogmap serve`.

use tokio::signal::unix::{SignalKind, signal};

use super::{ConfigArgs, output};
use crate::metrics;
use crate::service::Service;

pub(super) fn run(args: &ConfigArgs) -> anyhow::Result<()> {
    let config = args.load()?;
    output::start_log(&config.log);
    let prometheus = metrics::install()?;
    tokio::runtime::Builder::new_multi_thread()
        .enable_all()
        .build()?
        .block_on(async {
            let service = Service::start(&config, prometheus).await?;
            tracing::info!(
                http = %format_args!("http://{}", service.address()),
                zenoh = ?config.zenoh.endpoints(),
                store = %config.store.place(),
                "serving"
            );
            interrupted().await?;
            tracing::info!("stopping");
            service.stop().await;
            Ok(())
        })
}

/// Returns when the process is asked to end.
pub(super) async fn interrupted() -> std::io::Result<()> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    tokio::select! {
        _ = terminate.recv() => {}
        _ = interrupt.recv() => {}
    }
    Ok(())
}
