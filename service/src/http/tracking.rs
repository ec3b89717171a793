//! The routes of a connection, which note when a request begins and ends.

use std::convert::Infallible;
use std::future::Future;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use axum::Router;
use axum::body::Body;
use axum::extract::Request;
use axum::http::Response;
use axum::serve::IncomingStream;
use tower::Service;

use super::activity::Activity;
use super::held::holding;
use super::listener::BoundedListener;

/// Makes the service of each connection: the routes, with a note of each request.
#[derive(Clone, Debug)]
pub(crate) struct TrackedRoutes(pub(crate) Router);

/// The routes for one connection.
#[derive(Clone, Debug)]
pub(crate) struct TrackedConnection {
    router: Router,
    activity: Arc<Activity>,
}

impl Service<IncomingStream<'_, BoundedListener>> for TrackedRoutes {
    type Response = TrackedConnection;
    type Error = Infallible;
    type Future = std::future::Ready<Result<TrackedConnection, Infallible>>;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, stream: IncomingStream<'_, BoundedListener>) -> Self::Future {
        std::future::ready(Ok(TrackedConnection {
            router: self.0.clone(),
            activity: Arc::clone(stream.io().activity()),
        }))
    }
}

impl Service<Request> for TrackedConnection {
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response<Body>, Infallible>> + Send>>;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(())) // as the router always is
    }

    fn call(&mut self, request: Request) -> Self::Future {
        let under_way = self.activity.begin();
        let answer = self.router.call(request);
        Box::pin(async move {
            let response = answer.await?;
            Ok(response.map(|body| holding(body, under_way)))
        })
    }
}
