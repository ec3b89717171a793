//! One message of every kind, with every variant, by the name of its golden files.
//!
//! The numbers are such that every codec and language holds them exactly: at most 15 digits in
//! JSON, and halves, quarters and so on in the `f32` vectors.

mod answers;
mod felt;
mod localize;
mod objects;
mod published;
mod routes;
mod samples;
mod sequences;

use std::fmt::Debug;

use cogmap_proto::SampleBatch;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// What a test does with each message.
pub(crate) trait Visit {
    /// Any message.
    fn message<T: Serialize + DeserializeOwned + PartialEq + Debug>(
        &mut self,
        name: &str,
        message: &T,
    );

    /// A batch of samples, which has a decoder of its own.
    fn batch(&mut self, name: &str, batch: &SampleBatch) {
        self.message(name, batch);
    }
}

/// Shows every message to `visit`.
pub(crate) fn each(visit: &mut impl Visit) {
    samples::each(visit);
    published::each(visit);
    answers::each(visit);
    objects::each(visit);
    localize::each(visit);
    routes::each(visit);
    sequences::each(visit);
    felt::each(visit);
}
