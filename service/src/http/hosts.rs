//! Which hosts the service answers as.
//!
//! A page of a stranger in a browser of this network can have its own name resolve to the service's
//! address (DNS rebinding): it could then read and change everything, as if it came from here. Its
//! requests name the stranger's host. So do those that it sends to the service's true address, in
//! `Origin`, where it could not read the answer, but would change something.
//!
//! Addresses are always answered: what names one cannot have been rebound. With a token neither is
//! checked, because such a page does not have it.

use std::net::IpAddr;

use axum::extract::Request;
use axum::http::header::{HOST, ORIGIN};
use axum::http::uri::Authority;

use super::problem::{Kind, Problem};

/// Which names of hosts are answered, beside addresses and `localhost`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum HostRule {
    /// All.
    Any,
    /// These, in lower case.
    Named(Vec<String>),
}

impl HostRule {
    /// The rule for the names of the settings, `*` standing for any. Without names, a token lets
    /// any pass.
    pub fn new(names: &[String], has_token: bool) -> Self {
        let is_any = names.iter().any(|name| name == "*");
        if is_any || (has_token && names.is_empty()) {
            return Self::Any;
        }
        Self::Named(names.iter().map(|name| name.to_lowercase()).collect())
    }

    /// The rule with the host of an authority, such as `map.local:8080`, added.
    #[must_use]
    pub fn and_host_of(self, authority: &str) -> Self {
        match (self, authority.parse::<Authority>()) {
            (Self::Named(mut names), Ok(authority)) => {
                names.push(authority.host().to_lowercase());
                Self::Named(names)
            }
            (rule, _) => rule,
        }
    }

    /// Whether a request is for this service, and not sent by a page of another that is not among
    /// `origins`.
    pub(crate) fn check(&self, request: &Request, origins: &[String]) -> Result<(), Problem> {
        if *self == Self::Any {
            return Ok(());
        }
        let header = |name| request.headers().get(name);
        // No browser leaves the header out.
        let host = header(HOST).map(|value| value.to_str().unwrap_or_default());
        let host = host.or_else(|| request.uri().authority().map(Authority::as_str));
        if let Some(host) = host.filter(|host| !self.knows(host)) {
            let detail = format!(
                "the service is not known as {host:?}; if it is, add the name to the setting http.hosts"
            );
            return Err(Problem::new(Kind::UnknownHost, detail));
        }
        let origin = header(ORIGIN).map(|value| value.to_str().unwrap_or_default());
        if let Some(origin) = origin.filter(|_| !request.method().is_safe()) {
            let authority = origin.split_once("://").map(|(_, authority)| authority);
            let is_own = origins.iter().any(|known| known == origin)
                || authority.is_some_and(|authority| {
                    host.is_some_and(|host| host.eq_ignore_ascii_case(authority))
                        || self.names(authority)
                });
            if !is_own {
                let detail = format!(
                    "a page of {origin:?} may not change anything here; if it is this service's, \
                     add the name of its host to the setting http.hosts; if it may, the origin to \
                     http.cors_origins"
                );
                return Err(Problem::new(Kind::ForeignOrigin, detail));
            }
        }
        Ok(())
    }

    /// Whether an authority is an address, `localhost` or one of the names.
    fn knows(&self, authority: &str) -> bool {
        let Ok(authority) = authority.parse::<Authority>() else {
            return false;
        };
        let host = authority
            .host()
            .trim_start_matches('[')
            .trim_end_matches(']');
        host.parse::<IpAddr>().is_ok() || host.eq_ignore_ascii_case("localhost") || self.lists(host)
    }

    /// Whether an authority is one of the names.
    fn names(&self, authority: &str) -> bool {
        let authority = authority.parse::<Authority>();
        authority.is_ok_and(|authority| self.lists(authority.host()))
    }

    fn lists(&self, host: &str) -> bool {
        match self {
            Self::Any => true,
            Self::Named(names) => names.iter().any(|name| name.eq_ignore_ascii_case(host)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::Body;
    use axum::http::Method;

    fn check(rule: &HostRule, method: Method, headers: &[(&str, &str)]) -> Result<(), Kind> {
        let mut request = Request::builder().method(method).uri("/v1/spaces");
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let request = request.body(Body::empty()).expect("a request");
        rule.check(&request, &["https://pages.example".to_owned()])
            .map_err(|problem| problem.kind())
    }

    #[test]
    fn addresses_and_own_names_are_answered_and_others_are_not() {
        let rule = HostRule::new(&["Map.example.org".to_owned()], false);
        for host in [
            "127.0.0.1",
            "127.0.0.1:8080",
            "[::1]:8080",
            "10.1.2.3",
            "localhost:8080",
            "LOCALHOST",
            "map.example.org:80",
        ] {
            assert_eq!(
                check(&rule, Method::GET, &[("host", host)]),
                Ok(()),
                "{host}"
            );
        }
        for host in [
            "evil.example",
            "127.0.0.1.evil.example",
            "localhost.evil.example:8080",
            "",
            "a b",
        ] {
            let refused = Err(Kind::UnknownHost);
            assert_eq!(
                check(&rule, Method::GET, &[("host", host)]),
                refused,
                "{host}"
            );
        }
        assert_eq!(check(&rule, Method::GET, &[]), Ok(()));
    }

    #[test]
    fn pages_of_others_may_not_change_anything() {
        let rule = HostRule::new(&["map.example.org".to_owned()], false);
        let from = |method, origin| {
            let headers = [("host", "10.1.2.3:8080"), ("origin", origin)];
            check(&rule, method, &headers)
        };
        for origin in ["http://10.1.2.3:8080", "https://map.example.org"] {
            assert_eq!(from(Method::POST, origin), Ok(()), "{origin}");
        }
        for origin in ["http://evil.example", "http://10.1.2.3:9000", "null", ""] {
            let refused = Err(Kind::ForeignOrigin);
            assert_eq!(from(Method::DELETE, origin), refused, "{origin}");
            assert_eq!(from(Method::GET, origin), Ok(()), "{origin}");
        }
    }

    #[test]
    fn a_token_or_a_star_lets_any_name_pass_and_a_list_counts_beside_a_token() {
        let names = |names: &[&str]| {
            names
                .iter()
                .map(|&name| name.to_owned())
                .collect::<Vec<_>>()
        };
        assert_eq!(HostRule::new(&[], true), HostRule::Any);
        assert_eq!(HostRule::new(&names(&["*"]), false), HostRule::Any);
        let named = HostRule::Named(names(&["a"]));
        assert_eq!(HostRule::new(&names(&["A"]), true), named);
        assert_eq!(HostRule::new(&[], false), HostRule::Named(Vec::new()));
    }

    #[test]
    fn a_node_is_asked_by_the_name_in_its_address() {
        let rule = HostRule::new(&[], false).and_host_of("Node-a.example:8080");
        let ask = |host| check(&rule, Method::GET, &[("host", host)]);
        assert_eq!(ask("node-a.example:8080"), Ok(()));
        assert_eq!(ask("node-b.example:8080"), Err(Kind::UnknownHost));
        assert_eq!(HostRule::Any.and_host_of("node-a:80"), HostRule::Any);
        let none = HostRule::new(&[], false);
        assert_eq!(none.clone().and_host_of(""), none);
    }
}
