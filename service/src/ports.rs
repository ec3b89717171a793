//! Ports that somebody else listens on.

use std::io::ErrorKind;
use std::net::{IpAddr, TcpListener, ToSocketAddrs};

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

/// Whether others than this machine reach an endpoint.
pub(crate) fn is_reachable(endpoint: &str) -> bool {
    let Some((host, _)) = address(endpoint).and_then(|address| address.rsplit_once(':')) else {
        return true;
    };
    let host = host.trim_start_matches('[').trim_end_matches(']');
    let is_loopback = host
        .parse()
        .map_or(host == "localhost", |ip: IpAddr| ip.is_loopback());
    !is_loopback
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

    #[test]
    fn others_reach_what_is_not_on_the_loopback_interface() {
        for own in [
            "tcp/127.0.0.1:7447",
            "tls/[::1]:7447",
            "tcp/localhost:7447#iface=lo",
        ] {
            assert!(!is_reachable(own), "{own}");
        }
        for open in [
            "tcp/0.0.0.0:7447",
            "tcp/[::]:7447",
            "tls/map.example.org:7447",
        ] {
            assert!(is_reachable(open), "{open}");
        }
    }
}
