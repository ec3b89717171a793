//! The way to other nodes: requests passed on over connections that are kept.

use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::extract::Request;
use axum::http::header::{AUTHORIZATION, CONNECTION, HOST, ORIGIN, TRANSFER_ENCODING, UPGRADE};
use axum::http::uri::{Authority, PathAndQuery, Scheme};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Response, Uri};
use http_body_util::{BodyExt, Limited};
use hyper_util::client::legacy::connect::HttpConnector;
use hyper_util::client::legacy::{Client, Error};
use hyper_util::rt::TokioExecutor;
use metrics::counter;

use crate::metrics::FORWARDED_REQUESTS;

/// The header of a request that a node has passed on: the node's name.
pub(crate) const FORWARDED: HeaderName = HeaderName::from_static("cogmap-forwarded");
/// Headers that are about one connection, or that the node has looked at already.
const OF_ONE_HOP: [HeaderName; 7] = [
    CONNECTION,
    HOST,
    // The node has checked that the page may ask; the owner has another name.
    ORIGIN,
    TRANSFER_ENCODING,
    UPGRADE,
    HeaderName::from_static("keep-alive"),
    HeaderName::from_static("te"),
];
/// Longest wait for a connection to another node.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(1);
/// Longest wait for what another node lists, and most of it.
const LIST_TIMEOUT: Duration = Duration::from_secs(2);
const LIST_BYTES_MAX: usize = 16 << 20;

/// The way to other nodes: connections that are kept.
#[derive(Debug)]
pub(crate) struct Forwarder(Client<HttpConnector, Body>);

impl Default for Forwarder {
    fn default() -> Self {
        let mut connector = HttpConnector::new();
        connector.set_connect_timeout(Some(CONNECT_TIMEOUT));
        connector.set_nodelay(true);
        Self(Client::builder(TokioExecutor::new()).build(connector))
    }
}

impl Forwarder {
    /// Passes a request on, and its answer back as it comes.
    pub(super) async fn forward(
        &self,
        request: Request,
        address: &str,
        node: &str,
    ) -> Result<Response<Body>, Error> {
        let (mut parts, body) = request.into_parts();
        parts.uri = uri_at(address, parts.uri.path_and_query().cloned());
        remove_of_one_hop(&mut parts.headers);
        if let Ok(node) = HeaderValue::from_str(node) {
            parts.headers.insert(FORWARDED, node);
        }
        parts.extensions.clear();
        let answered = self.0.request(Request::from_parts(parts, body)).await;
        let result = if answered.is_ok() {
            "answered"
        } else {
            "failed"
        };
        counter!(FORWARDED_REQUESTS, "result" => result).increment(1);
        let mut response = answered?.map(Body::new);
        remove_of_one_hop(response.headers_mut());
        Ok(response)
    }

    /// What another node answers under a path, if it does in time.
    pub(super) async fn list(
        &self,
        address: &str,
        path: &str,
        headers: &HeaderMap,
        node: &str,
    ) -> Option<Bytes> {
        let mut request = Request::new(Body::empty());
        *request.uri_mut() = Uri::try_from(path).ok()?;
        if let Some(token) = headers.get(AUTHORIZATION) {
            request.headers_mut().insert(AUTHORIZATION, token.clone());
        }
        let answer = async {
            let response = self.forward(request, address, node).await.ok()?;
            let body = Limited::new(response.into_body(), LIST_BYTES_MAX).collect();
            Some(body.await.ok()?.to_bytes())
        };
        tokio::time::timeout(LIST_TIMEOUT, answer).await.ok()?
    }
}

fn remove_of_one_hop(headers: &mut HeaderMap) {
    for name in &OF_ONE_HOP {
        headers.remove(name);
    }
}

/// A path at another node. What is no address is none that can be connected to.
fn uri_at(address: &str, path: Option<PathAndQuery>) -> Uri {
    let mut parts = axum::http::uri::Parts::default();
    parts.scheme = Some(Scheme::HTTP);
    parts.authority = address.parse::<Authority>().ok();
    parts.path_and_query = path.or_else(|| Some(PathAndQuery::from_static("/")));
    Uri::from_parts(parts).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_asked_for_at_the_owner() {
        let path = PathAndQuery::from_static("/v1/spaces/hall/places?limit=3");
        let uri = uri_at("10.0.0.5:8080", Some(path));
        assert_eq!(uri, "http://10.0.0.5:8080/v1/spaces/hall/places?limit=3");
    }
}
