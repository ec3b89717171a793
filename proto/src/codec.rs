//! The three codecs, chosen by the Zenoh `Encoding` or the HTTP `Content-Type`.

use std::fmt::Display;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_path_to_error::Path;

use crate::bounded::BoundedBatch;
use crate::cbor;
use crate::encoding::{CBOR, JSON, POSTCARD_V1};
use crate::error::DecodeError;
use crate::field;
use crate::limits::MESSAGE_BYTES_MAX;
use crate::sample::SampleBatch;
use crate::wording::plain;

/// What all postcard encodings start with, whatever their version.
const POSTCARD: &str = "application/vnd.cogmap.postcard";

/// Room for a message of one sample, so that writing it allocates once.
const ENCODED_BYTES: usize = 256;

/// How a message is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Codec {
    /// postcard, version 1.
    Postcard,
    /// CBOR (RFC 8949).
    Cbor,
    /// JSON (RFC 8259).
    Json,
}

impl Codec {
    /// The codec of an encoding. Parameters after `;` are part of the postcard version and are
    /// ignored for CBOR and JSON (`application/json; charset=utf-8`).
    ///
    /// # Errors
    /// The encoding or its version is unknown.
    pub fn of_encoding(encoding: &str) -> Result<Self, DecodeError> {
        if encoding == POSTCARD_V1 {
            return Ok(Self::Postcard);
        }
        let essence = encoding.split(';').next().unwrap_or_default().trim();
        if essence.eq_ignore_ascii_case(CBOR) {
            Ok(Self::Cbor)
        } else if essence.eq_ignore_ascii_case(JSON) {
            Ok(Self::Json)
        } else if essence == POSTCARD {
            Err(DecodeError::UnsupportedVersion(encoding.to_owned()))
        } else {
            Err(DecodeError::UnknownEncoding(encoding.to_owned()))
        }
    }

    /// The encoding of messages in this codec.
    pub fn encoding(self) -> &'static str {
        match self {
            Self::Postcard => POSTCARD_V1,
            Self::Cbor => CBOR,
            Self::Json => JSON,
        }
    }

    /// Its name in messages and metrics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Postcard => "postcard",
            Self::Cbor => "cbor",
            Self::Json => "json",
        }
    }

    /// Writes a message.
    ///
    /// JSON has no NaN and no infinity: they become `null`, which no reader takes for a number.
    /// Nothing is refused here, because the messages that go out never hold them: the service
    /// rejects such numbers on arrival, and a client's own reach it in postcard and CBOR, where
    /// it names the sample that it rejects.
    ///
    /// # Panics
    /// Never for the messages of this crate: they are plain data, and memory is the only sink.
    pub fn encode<T: Serialize>(self, message: &T) -> Vec<u8> {
        match self {
            Self::Postcard => {
                let bytes = Vec::with_capacity(ENCODED_BYTES);
                postcard::to_extend(message, bytes).expect("plain data encodes")
            }
            Self::Cbor => {
                let mut bytes = Vec::new();
                ciborium::into_writer(message, &mut bytes).expect("plain data encodes");
                bytes
            }
            Self::Json => serde_json::to_vec(message).expect("plain data encodes"),
        }
    }

    /// Reads a message; bytes after it are an error.
    ///
    /// In CBOR and JSON a whole number may stand for a float (`1` for `1.0`). Floats come out of
    /// postcard and CBOR as they went in, NaN included; out of JSON, which has no NaN, too.
    ///
    /// # Errors
    /// The bytes are too long or not such a message.
    pub fn decode<T: DeserializeOwned>(self, bytes: &[u8]) -> Result<T, DecodeError> {
        if bytes.len() > MESSAGE_BYTES_MAX {
            return Err(DecodeError::TooLong(bytes.len()));
        }
        let malformed = |detail: String| DecodeError::Malformed {
            codec: self.name(),
            detail,
        };
        if bytes.is_empty() && self != Self::Postcard {
            return Err(malformed("there is no message".to_owned()));
        }
        match self {
            Self::Postcard => {
                let (message, rest) = postcard::take_from_bytes(bytes)
                    .map_err(|error| malformed(error.to_string()))?;
                if rest.is_empty() {
                    Ok(message)
                } else {
                    Err(malformed(format!("{} bytes after the message", rest.len())))
                }
            }
            Self::Cbor => cbor::from_slice(bytes)
                .map_err(|error| malformed(located(cbor::refused_field::<T>(bytes), &error))),
            Self::Json => serde_json::from_slice(bytes).map_err(|error| {
                let mut json = serde_json::Deserializer::from_slice(bytes);
                malformed(located(field::refused::<T, _>(&mut json), &error))
            }),
        }
    }

    /// Reads a batch of samples and checks its bounds. Whether each sample makes sense is checked
    /// later, sample by sample.
    ///
    /// # Errors
    /// As [`Codec::decode`], or the batch is beyond a bound.
    pub fn decode_batch(self, bytes: &[u8]) -> Result<SampleBatch, DecodeError> {
        self.decode::<BoundedBatch>(bytes)?.into_batch()
    }
}

/// What is wrong, at the field where it is.
fn located(path: Option<Path>, error: &impl Display) -> String {
    path.map_or_else(
        || plain(&error.to_string()),
        |path| field::at_field(&path, error),
    )
}
