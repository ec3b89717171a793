//! A fake service: takes batches in order, makes them durable at once, and can be told to fail.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use cogmap_client::proto::{
    Codec, Estimate, POSTCARD_V1, Rejection, Sample, SampleBatch, SeqRange, SkipReason, Status,
    Verb, Watermark, WatermarkQuery, durable_key, estimate_key, query_key, samples_key,
};
use zenoh::pubsub::Subscriber;
use zenoh::query::Queryable;
use zenoh::{Config, Session, Wait};

/// What the fake service does wrong.
#[derive(Clone, Copy)]
pub(crate) struct Faults {
    /// Whether the batch of this number, counted from 0, is ignored.
    pub(crate) ignored_batch: fn(u64) -> bool,
    /// A sample refused for good.
    pub(crate) refused_seq: Option<u64>,
}

impl Default for Faults {
    fn default() -> Self {
        Self {
            ignored_batch: |_| false,
            refused_seq: None,
        }
    }
}

/// One agent's samples in the fake service.
pub(crate) struct Service {
    book: Arc<Mutex<Book>>,
    _samples: Subscriber<()>,
    _watermarks: Queryable<()>,
    _router: Session,
}

struct Book {
    faults: Faults,
    batches: u64,
    session: u64,
    journal: Vec<Sample>,
    early: BTreeMap<u64, Sample>,
}

/// A router on a loopback endpoint, without multicast.
pub(crate) fn router(endpoint: &str) -> Session {
    let mut config = Config::default();
    let listen = format!("[\"{endpoint}\"]");
    for (key, value) in [
        ("mode", "\"router\""),
        ("listen/endpoints", &listen),
        ("connect/endpoints", "[]"),
        ("scouting/multicast/enabled", "false"),
    ] {
        config.insert_json5(key, value).unwrap();
    }
    zenoh::open(config).wait().unwrap()
}

/// Answers each question for the watermark.
fn answer_watermarks(router: &Session, space: &str, book: Arc<Mutex<Book>>) -> Queryable<()> {
    router
        .declare_queryable(query_key(space, Verb::Watermark.as_str()))
        .callback(move |query| {
            let payload = query.payload().unwrap().to_bytes();
            let codec = Codec::of_encoding(&query.encoding().unwrap().to_string()).unwrap();
            codec.decode::<WatermarkQuery>(&payload).unwrap();
            let watermark = book.lock().unwrap().watermark();
            query
                .reply(query.key_expr(), codec.encode(&watermark))
                .encoding(codec.encoding())
                .wait()
                .unwrap();
        })
        .wait()
        .unwrap()
}

impl Service {
    pub(crate) fn start(endpoint: &str, space: &str, agent: &str, faults: Faults) -> Self {
        Self::on(router(endpoint), space, agent, faults)
    }

    pub(crate) fn on(router: Session, space: &str, agent: &str, faults: Faults) -> Self {
        let book = Arc::new(Mutex::new(Book {
            faults,
            batches: 0,
            session: 0,
            journal: Vec::new(),
            early: BTreeMap::new(),
        }));
        let watermarks = answer_watermarks(&router, space, Arc::clone(&book));
        let taken = Arc::clone(&book);
        let publisher = router.clone();
        let (space, agent) = (space.to_owned(), agent.to_owned());
        let samples = router
            .declare_subscriber(samples_key(&space, &agent))
            .callback(move |message| {
                let codec = Codec::of_encoding(&message.encoding().to_string()).unwrap();
                let batch = codec.decode_batch(&message.payload().to_bytes()).unwrap();
                let mut book = taken.lock().unwrap();
                if !book.takes(batch) {
                    return;
                }
                let watermark = book.watermark();
                let estimate = book.estimate(&space, &agent);
                drop(book);
                let put = |key: String, bytes: Vec<u8>| {
                    publisher
                        .put(key, bytes)
                        .encoding(POSTCARD_V1)
                        .wait()
                        .unwrap();
                };
                if let Some(estimate) = estimate {
                    put(
                        estimate_key(&space, &agent),
                        Codec::Postcard.encode(&estimate),
                    );
                }
                put(
                    durable_key(&space, &agent),
                    Codec::Postcard.encode(&watermark),
                );
            })
            .wait()
            .unwrap();
        Self {
            book,
            _samples: samples,
            _watermarks: watermarks,
            _router: router,
        }
    }

    /// The samples of the current session, in order.
    pub(crate) fn journal(&self) -> Vec<Sample> {
        self.book.lock().unwrap().journal.clone()
    }
}

impl Book {
    /// Takes a batch unless it is to be ignored; says whether it did.
    fn takes(&mut self, batch: SampleBatch) -> bool {
        let number = self.batches;
        self.batches += 1;
        if (self.faults.ignored_batch)(number) {
            return false;
        }
        if batch.session > self.session {
            self.session = batch.session;
            self.journal.clear();
            self.early.clear();
        }
        if batch.session == self.session {
            self.early.extend((batch.first_seq..).zip(batch.samples));
        }
        let mut next = self.journal.len() as u64;
        while let Some(sample) = self.early.remove(&next) {
            self.journal.push(sample);
            next += 1;
        }
        self.early = self.early.split_off(&next);
        true
    }

    fn watermark(&self) -> Watermark {
        let durable = self.journal.len() as u64;
        let refused = self.faults.refused_seq.filter(|seq| *seq < durable);
        Watermark {
            session: self.session,
            durable,
            applied: durable,
            gap: self
                .early
                .keys()
                .next()
                .map(|&to| SeqRange { from: durable, to }),
            rejected: refused
                .map(|from| Rejection {
                    range: SeqRange { from, to: from + 1 },
                    reason: SkipReason::NumberOutOfRange,
                })
                .into_iter()
                .collect(),
            term: 0,
        }
    }

    /// The estimate after the latest sample that was not refused.
    fn estimate(&self, space: &str, agent: &str) -> Option<Estimate> {
        let (seq, sample) = (0_u64..)
            .zip(&self.journal)
            .filter(|(seq, _)| Some(*seq) != self.faults.refused_seq)
            .last()?;
        Some(Estimate {
            space: space.to_owned(),
            agent: agent.to_owned(),
            session: self.session,
            seq,
            stamp_ns: sample.stamp_ns,
            frame: "map".to_owned(),
            map_revision: self.journal.len() as u64,
            status: Status::Localized,
            translation_m: [0.0; 3],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            covariance: [0.0; 21],
            place: None,
            confidence: 0.0,
            term: 0,
        })
    }
}
