//! Whom the client believes who a service is.

use std::fs;
use std::io;
use std::path::Path;

use ureq::tls::{PemItem, RootCerts, parse_pem};

/// The certificates of a file.
pub(super) fn authorities(file: &Path) -> io::Result<RootCerts> {
    let text = fs::read(file)?;
    let mut found = Vec::new();
    for item in parse_pem(&text) {
        let item = item.map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))?;
        if let PemItem::Certificate(certificate) = item {
            found.push(certificate);
        }
    }
    if found.is_empty() {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "there is none"));
    }
    Ok(RootCerts::new_with_certs(&found))
}
