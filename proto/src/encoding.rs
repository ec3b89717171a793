//! Names of the encodings, as Zenoh and HTTP carry them.

/// Encoding of version 1 postcard messages.
pub const POSTCARD_V1: &str = "application/vnd.cogmap.postcard;v1";
/// Encoding of CBOR messages.
pub const CBOR: &str = "application/cbor";
/// Encoding of JSON messages.
pub const JSON: &str = "application/json";
