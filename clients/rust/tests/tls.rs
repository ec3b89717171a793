//! `Api` and a service behind TLS.
// Everything here is a test; clippy sees that only in test functions.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::sync::Arc;
use std::thread;

use cogmap_client::{Api, ApiError};
use rcgen::{BasicConstraints, CertificateParams, IsCa, Issuer, KeyPair};

/// Serves `answer` once over TLS, with a certificate of its own authority; hands back the address
/// and the authority's certificate.
fn serve_tls(answer: &'static str) -> (String, String) {
    let mut authority = CertificateParams::default();
    authority.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    let key = KeyPair::generate().unwrap();
    let ca = authority.self_signed(&key).unwrap().pem();
    let issuer = Issuer::new(authority, key);
    let key = KeyPair::generate().unwrap();
    let params = CertificateParams::new(["127.0.0.1".to_owned()]).unwrap();
    let certificate = params.signed_by(&key, &issuer).unwrap();
    let provider = Arc::new(rustls::crypto::ring::default_provider());
    let config = rustls::ServerConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .unwrap()
        .with_no_client_auth()
        .with_single_cert(
            vec![certificate.der().clone()],
            key.serialize_der().try_into().unwrap(),
        )
        .unwrap();
    let config = Arc::new(config);
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let base = format!("https://{}", listener.local_addr().unwrap());
    thread::spawn(move || {
        for stream in listener.incoming() {
            let session = rustls::ServerConnection::new(Arc::clone(&config)).unwrap();
            let mut stream = rustls::StreamOwned::new(session, stream.unwrap());
            let mut head = Vec::new();
            let mut byte = [0];
            // A client that does not trust the certificate says so and goes.
            while !head.ends_with(b"\r\n\r\n") && stream.read_exact(&mut byte).is_ok() {
                head.push(byte[0]);
            }
            let length = answer.len();
            let _ = write!(
                stream,
                "HTTP/1.1 200 x\r\nconnection: close\r\ncontent-length: {length}\r\n\r\n{answer}"
            );
            stream.conn.send_close_notify();
            let _ = stream.flush();
        }
    });
    (base, ca)
}

#[test]
fn a_service_behind_tls_is_known_by_its_authority() {
    let (base, ca) = serve_tls(r#"{"spaces": []}"#);
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("ca.pem");
    fs::write(&file, ca).unwrap();
    let api = Api::trusting(&base, None, &file).unwrap();
    assert!(api.spaces().unwrap().is_empty());
    // Nobody else has signed it.
    let stranger = Api::new(&base, None).spaces();
    assert!(
        matches!(stranger, Err(ApiError::Transport(_))),
        "{stranger:?}"
    );
}

#[test]
fn a_file_without_an_authority_is_refused_by_name() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("ca.pem");
    for content in [None, Some("no certificate\n")] {
        if let Some(content) = content {
            fs::write(&file, content).unwrap();
        }
        let error = Api::trusting("https://127.0.0.1:1", None, &file).unwrap_err();
        assert!(matches!(error, ApiError::Authority { .. }), "{error}");
        assert!(error.to_string().contains("ca.pem"), "{error}");
    }
}
