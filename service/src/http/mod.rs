//! The HTTP interface: questions, samples and administration, described by `OpenAPI`.
//!
//! Routes and their description are one: each handler carries both. Every error is a problem
//! document; `guard` stands before all handlers.

mod activity;
mod agent_at;
mod agents;
mod blockages;
mod channels;
mod cloud;
mod cluster;
mod compression;
mod cors;
mod dashboard;
mod docs;
mod elsewhere;
mod events;
mod examples;
mod export;
mod extract;
mod felt;
mod following;
mod forward;
mod forwarder;
mod guard;
mod health;
mod held;
mod hosts;
mod index;
mod json;
mod landmarks;
mod listener;
mod live;
mod localize;
mod long;
mod objects;
mod openapi;
mod page;
mod pins;
mod places;
mod predict;
mod problem;
mod recall;
mod refusal;
mod reply;
mod route;
mod samples;
mod sequence;
mod settings;
mod spaces;
mod state;
mod streams;
mod token;
mod tracking;
mod trajectory;
mod trips;
mod unread;

use std::future::{Future, IntoFuture};
use std::io;

use axum::Router;
use metrics_exporter_prometheus::PrometheusHandle;
use tokio::net::TcpListener;
use tokio::sync::watch;
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

pub use hosts::HostRule;
pub use problem::{Kind, Problem};
pub use settings::HttpSettings;
pub use state::Served;
pub use token::Token;

use guard::Guard;
use listener::BoundedListener;
use state::{Service, Shared};
use tracking::TrackedRoutes;

/// What the description says of the whole.
#[derive(OpenApi)]
#[openapi(
    info(title = "cogmap", description = "Shared spatial memory for robot teams. Units are SI, \
        angles radians, stamps nanoseconds of the sensor's clock, quaternions [x, y, z, w]; \
        positions are in the frame `map` of their space, where no other `frame` is named."),
    tags(
        (name = "spaces", description = "Spaces, their events and exports"),
        (name = "agents", description = "Where agents are, where they were, and their samples"),
        (name = "memory", description = "Places, percepts, trips, landmarks and objects"),
        (name = "service", description = "Health and metrics")),
    components(schemas(cogmap_proto::Problem)))]
struct Description;

fn described() -> OpenApiRouter<Service> {
    OpenApiRouter::with_openapi(Description::openapi())
        .routes(routes!(index::get))
        .routes(routes!(spaces::list))
        .routes(routes!(spaces::get, spaces::put, spaces::delete))
        .routes(routes!(agents::list))
        .routes(routes!(agents::grid))
        .routes(routes!(trajectory::get))
        .routes(routes!(agent_at::get))
        .routes(routes!(recall::post))
        .routes(routes!(localize::post))
        .routes(routes!(route::post))
        .routes(routes!(sequence::post))
        .routes(routes!(felt::post))
        .routes(routes!(blockages::list, blockages::post))
        .routes(routes!(blockages::delete))
        .routes(routes!(following::get, following::put, following::delete))
        .routes(routes!(following::list))
        .routes(routes!(predict::post))
        .routes(routes!(places::list))
        .routes(routes!(places::get))
        .routes(routes!(places::percepts))
        .routes(routes!(trips::list))
        .routes(routes!(trips::get))
        .routes(routes!(channels::list))
        .routes(routes!(pins::put, pins::delete))
        .routes(routes!(landmarks::list))
        .routes(routes!(landmarks::get))
        .routes(routes!(objects::list))
        .routes(routes!(objects::get, objects::put, objects::delete))
        .routes(routes!(objects::identify))
        .routes(routes!(objects::of_agent))
        .routes(routes!(events::get))
        .routes(routes!(export::get))
        .routes(routes!(health::metrics))
        .routes(routes!(cluster::get))
        .layer(compression::layer())
        // Short answers, of which the first is asked for most of all: nothing looks at them.
        .routes(routes!(agents::get, agents::delete))
        .routes(routes!(samples::post))
        .routes(routes!(live::get))
        .routes(routes!(health::healthz))
        .routes(routes!(health::readyz))
}

/// The description of the interface (`OpenAPI` 3.1, JSON). With `token`, it says that a bearer
/// token is asked for.
///
/// # Panics
/// Never: a description is plain data.
pub fn openapi(token: bool) -> serde_json::Value {
    let described = described().into_openapi();
    let plain = serde_json::to_value(described).expect("plain data encodes");
    openapi::complete(plain, token)
}

/// The whole interface as a service. Event streams end when `stopping` turns true.
pub fn router(
    served: impl Into<Served>,
    settings: &HttpSettings,
    prometheus: PrometheusHandle,
    stopping: watch::Receiver<bool>,
) -> Router {
    let (described, paths) = described().split_for_parts();
    let paths: Vec<String> = paths.paths.paths.into_keys().collect();
    let guard = Guard::new(settings, paths.iter().cloned());
    let pages = docs::routes(&openapi(settings.token.is_some()))
        .merge(dashboard::routes::<_, dashboard::Built>());
    let shared = Shared::new(served.into(), prometheus, settings, stopping, paths);
    let service = Service::new(shared);
    // A service by itself has nobody to pass requests on to, and pays nothing for it.
    let described = match &service.cluster {
        Some(_) => described.layer(forward::layer(&service)),
        None => described,
    };
    let router = described
        .merge(pages.layer(compression::layer()))
        .fallback(elsewhere::unknown_path)
        .method_not_allowed_fallback(elsewhere::other_method)
        .layer(guard)
        .with_state(service);
    if settings.cors_origins.is_empty() {
        return router;
    }
    router.layer(cors::layer(&settings.cors_origins))
}

/// Serves until `shutdown` comes, then finishes what is under way, within a bounded time.
///
/// # Errors
/// The listener fails.
pub async fn run(
    listener: TcpListener,
    served: Served,
    settings: HttpSettings,
    prometheus: PrometheusHandle,
    shutdown: impl Future<Output = ()> + Send + 'static,
) -> io::Result<()> {
    let (stop, stopping) = watch::channel(false);
    let router = router(served, &settings, prometheus, stopping.clone());
    let signal = async move {
        shutdown.await;
        stop.send_replace(true);
    };
    let listener = BoundedListener::new(listener, &settings);
    let served = axum::serve(listener, TrackedRoutes(router))
        .with_graceful_shutdown(signal)
        .into_future();
    let mut stopping = stopping;
    let overdue = async move {
        // The sender goes after it has sent, so an error means the same as a stop.
        let _ = stopping.wait_for(|stopping| *stopping).await;
        tokio::time::sleep(settings.shutdown_timeout).await;
    };
    tokio::select! {
        result = served => result,
        () = overdue => {
            tracing::warn!("requests were still under way when the time to finish them was over");
            Ok(())
        }
    }
}

#[cfg(test)]
mod tests;
