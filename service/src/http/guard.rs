//! What stands before every handler: the token, the bounds, the clock and the count.

use std::any::Any;
use std::collections::BTreeMap;
use std::convert::Infallible;
use std::panic::AssertUnwindSafe;
use std::pin::Pin;
use std::sync::{Arc, OnceLock};
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use axum::body::Body;
use axum::extract::{MatchedPath, Request};
use axum::http::header::{AUTHORIZATION, CONTENT_TYPE};
use axum::http::{Response, StatusCode};
use axum::response::IntoResponse;
use futures_util::FutureExt;
use metrics::{Counter, Histogram, counter, histogram};
use subtle::ConstantTimeEq;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tower::{Layer, Service};

use super::held::holding;
use super::hosts::HostRule;
use super::problem::{Kind, Problem};
use super::settings::HttpSettings;
use super::token::Token;
use super::unread::lend;
use crate::metrics::{HTTP_REQUEST_SECONDS, HTTP_REQUESTS};

/// Paths that need no token and are answered however much is under way.
const OPEN_PATHS: [&str; 2] = ["/healthz", "/readyz"];
/// Paths of pages, which hold nothing of any space: a browser has to load them before it can be
/// given a token.
const PAGES: [&str; 3] = ["/", "/openapi.json", "/docs"];
/// Media type of event streams.
const EVENT_STREAM: &str = "text/event-stream";
/// Label of requests that no route matches.
const UNMATCHED: &str = "unmatched";
/// Statuses that have counters of their own.
const STATUSES: [u16; 23] = [
    200, 201, 204, 303, 304, 308, 400, 401, 403, 404, 405, 409, 410, 413, 415, 421, 422, 500, 502,
    503, 504, 507, 0,
];

/// What stands before every handler.
#[derive(Clone)]
pub(crate) struct Guard(Arc<Inner>);

/// A handler behind the guard.
#[derive(Clone)]
pub(crate) struct Guarded<S> {
    inner: S,
    guard: Guard,
}

struct Inner {
    token: Option<Token>,
    hosts: HostRule,
    origins: Vec<String>,
    timeout: Duration,
    requests: Arc<Semaphore>,
    routes: BTreeMap<String, RouteMeters>,
    unmatched: RouteMeters,
}

/// Meters of a route. Handles are taken once, so that counting allocates nothing.
struct RouteMeters {
    route: String,
    seconds: Histogram,
    by_status: [OnceLock<Counter>; STATUSES.len()],
}

impl Guard {
    pub(crate) fn new(settings: &HttpSettings, routes: impl Iterator<Item = String>) -> Self {
        Self(Arc::new(Inner {
            token: settings.token.clone(),
            hosts: settings.hosts.clone(),
            origins: settings.cors_origins.clone(),
            timeout: settings.request_timeout,
            requests: Arc::new(Semaphore::new(settings.requests_max)),
            routes: routes
                .map(|route| (route.clone(), RouteMeters::new(route)))
                .collect(),
            unmatched: RouteMeters::new(UNMATCHED.to_owned()),
        }))
    }

    /// Lets a request in, with a permit where it needs one, or says why not.
    fn admit(&self, request: &Request) -> Result<Option<OwnedSemaphorePermit>, Problem> {
        if OPEN_PATHS.contains(&request.uri().path()) {
            return Ok(None);
        }
        self.0.hosts.check(request, &self.0.origins)?;
        if !self.knows(request) && !is_page(request) {
            let detail = "the header Authorization must be: Bearer, a space, the token";
            return Err(Problem::new(Kind::Unauthorized, detail));
        }
        match Arc::clone(&self.0.requests).try_acquire_owned() {
            Ok(permit) => Ok(Some(permit)),
            Err(_) => Err(Problem::new(Kind::Busy, "too much is under way")),
        }
    }

    /// Waits for the answer of a handler, not for ever.
    async fn answer(
        &self,
        answer: impl Future<Output = Result<Response<Body>, Infallible>>,
    ) -> Response<Body> {
        let answer = AssertUnwindSafe(answer).catch_unwind();
        match tokio::time::timeout(self.0.timeout, answer).await {
            Ok(Ok(Ok(response))) => response,
            Ok(Err(panic)) => {
                tracing::error!(panic = words(&*panic), "a handler ended with a panic");
                Problem::new(Kind::Internal, "a fault of the service; its log says more")
                    .into_response()
            }
            Err(_) => {
                let detail = format!("no answer within {} s", self.0.timeout.as_secs_f64());
                Problem::new(Kind::Timeout, detail).into_response()
            }
        }
    }

    /// Whether the request carries the token, if one is asked for.
    fn knows(&self, request: &Request) -> bool {
        let Some(token) = &self.0.token else {
            return true;
        };
        let header = request
            .headers()
            .get(AUTHORIZATION)
            .map_or(&[][..], |value| value.as_bytes());
        // The scheme's name may be in any case (RFC 7235); the comparison of the secret takes the
        // same time wherever the first difference is.
        header
            .split_at_checked("Bearer ".len())
            .is_some_and(|(scheme, given)| {
                scheme.eq_ignore_ascii_case(b"Bearer ")
                    && bool::from(given.ct_eq(token.reveal().as_bytes()))
            })
    }

    fn meters(&self, route: Option<&MatchedPath>) -> &RouteMeters {
        let route = route.and_then(|route| self.0.routes.get(route.as_str()));
        route.unwrap_or(&self.0.unmatched)
    }
}

impl RouteMeters {
    fn new(route: String) -> Self {
        let seconds = histogram!(HTTP_REQUEST_SECONDS, "route" => route.clone());
        Self {
            route,
            seconds,
            by_status: Default::default(),
        }
    }

    fn note(&self, status: StatusCode, seconds: f64) {
        self.seconds.record(seconds);
        // The last status stands for all others.
        let known = STATUSES.iter().position(|known| *known == status.as_u16());
        let meter = &self.by_status[known.unwrap_or(STATUSES.len() - 1)];
        let counter = meter.get_or_init(|| {
            let status = if known.is_some() {
                status.as_str()
            } else {
                "other"
            }
            .to_owned();
            counter!(HTTP_REQUESTS, "route" => self.route.clone(), "status" => status)
        });
        counter.increment(1);
    }
}

impl<S> Layer<S> for Guard {
    type Service = Guarded<S>;

    fn layer(&self, inner: S) -> Guarded<S> {
        Guarded {
            inner,
            guard: self.clone(),
        }
    }
}

impl<S> Service<Request> for Guarded<S>
where
    S: Service<Request, Response = Response<Body>, Error = Infallible>,
    S::Future: Send + 'static,
{
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response<Body>, Infallible>> + Send>>;

    fn poll_ready(&mut self, context: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        self.inner.poll_ready(context)
    }

    fn call(&mut self, request: Request) -> Self::Future {
        let start = Instant::now();
        let traced = tracing::enabled!(tracing::Level::DEBUG)
            .then(|| (request.method().clone(), request.uri().path().to_owned()));
        let route = request.extensions().get::<MatchedPath>().cloned();
        let guard = self.guard.clone();
        let admitted = guard.admit(&request);
        let (request, rest) = lend(request);
        // The body of a refused request is given back here.
        let admitted = admitted.map(|permit| (permit, self.inner.call(request)));
        Box::pin(async move {
            let response = match admitted {
                Ok((permit, answer)) => with_permit(guard.answer(answer).await, permit),
                Err(refusal) => refusal.into_response(),
            };
            let seconds = start.elapsed().as_secs_f64();
            guard
                .meters(route.as_ref())
                .note(response.status(), seconds);
            if let Some((method, path)) = traced {
                let status = response.status().as_u16();
                tracing::debug!(%method, path, status, seconds, "answered");
            }
            Ok(rest.settle(response).await)
        })
    }
}

/// The answer, which counts as under way until it has been sent. An event stream, which never ends,
/// has a bound of its own.
fn with_permit(response: Response<Body>, permit: Option<OwnedSemaphorePermit>) -> Response<Body> {
    let streams = response.headers().get(CONTENT_TYPE);
    match permit {
        Some(permit) if streams.is_none_or(|kind| kind != EVENT_STREAM) => {
            response.map(|body| holding(body, permit))
        }
        _ => response,
    }
}

/// Whether a request is for one of the [`PAGES`], or for what one of them needs.
fn is_page(request: &Request) -> bool {
    let path = request.uri().path();
    PAGES.contains(&path) || path.starts_with("/docs/") || path.starts_with("/assets/")
}

fn words(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("no words")
}
