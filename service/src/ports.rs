//! Ports that somebody else listens on.

use std::io::ErrorKind;
use std::net::{TcpListener, ToSocketAddrs};

/// Whether somebody listens on an address already.
pub(crate) fn is_taken(address: impl ToSocketAddrs) -> bool {
    TcpListener::bind(address).is_err_and(|error| error.kind() == ErrorKind::AddrInUse)
}

/// The first of some Zenoh endpoints that somebody listens on already.
pub(crate) fn taken_endpoint(endpoints: &[String]) -> Option<&String> {
    endpoints
        .iter()
        .find(|endpoint| address(endpoint).is_some_and(is_taken))
}

/// The address of an endpoint such as `tcp/127.0.0.1:7447#iface=lo`.
fn address(endpoint: &str) -> Option<&str> {
    let (_, rest) = endpoint.split_once('/')?;
    rest.split(['?', '#']).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_endpoint_is_taken_while_somebody_listens_there() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("an address");
        let endpoints = [
            "tcp/127.0.0.1:0".to_owned(),
            format!("tcp/{address}#iface=lo"),
        ];
        assert_eq!(taken_endpoint(&endpoints), Some(&endpoints[1]));
        drop(listener);
        assert_eq!(taken_endpoint(&endpoints), None);
    }
}
