//! What can go wrong between a caller and the service.

use std::io;
use std::path::PathBuf;

use cogmap_proto::{NameError, Problem};

/// Why a request got no answer.
#[derive(Debug, thiserror::Error)]
pub enum ApiError {
    /// A name of a space or agent cannot stand in a URL.
    #[error("{0}")]
    Name(#[from] NameError),
    /// The service said what is wrong.
    #[error("{}: {} ({})", .0.title, .0.detail, .0.status)]
    Problem(Problem),
    /// Something that is not the service answered: no problem document.
    #[error("status {status}: {body}")]
    Status {
        /// HTTP status.
        status: u16,
        /// Start of the answer.
        body: String,
    },
    /// The file of the authority's certificate cannot be used.
    #[error("certificates of {}: {source}", file.display())]
    Authority {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        source: io::Error,
    },
    /// The request did not get through.
    #[error("{0}")]
    Transport(#[source] Box<ureq::Error>),
    /// The answer is not what this version expects.
    #[error("answer of {path}: {source}")]
    Answer {
        /// What was asked.
        path: String,
        /// What is wrong with the answer.
        source: serde_json::Error,
    },
}

impl From<ureq::Error> for ApiError {
    fn from(error: ureq::Error) -> Self {
        Self::Transport(Box::new(error))
    }
}
