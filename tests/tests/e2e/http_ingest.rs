//! Samples over HTTP alone: the answer is the acknowledgement.

use cogmap_proto::{Codec, IngestAnswer, Sample, SampleBatch};
use cogmap_tests::{Answer, Drive, Server, batch, seed};
use serde_json::json;

use crate::feeding::{Outcome, assert_exactly_once, post_all};

const AGENT: &str = "ada";
const PATH: &str = "/v1/spaces/default/agents/ada/samples";

fn post(server: &Server, codec: Codec, batch: &SampleBatch) -> Answer {
    let body = codec.encode(batch);
    server.http().post(PATH, codec.encoding(), &body)
}

fn durable(answer: &Answer) -> IngestAnswer {
    serde_json::from_value(answer.json(200)).unwrap()
}

fn drive(seed: u64, count: usize) -> Vec<Sample> {
    Drive::new(seed).take(count).collect()
}

#[test]
fn all_three_codecs_bring_the_same_samples_and_the_answer_means_durable() {
    let samples = drive(seed(20), 900);
    let mut server = Server::start(&[]);
    let codecs = [Codec::Postcard, Codec::Cbor, Codec::Json];
    let mut next = 0;
    for (codec, samples) in codecs.into_iter().zip(samples.chunks(300)) {
        let answer = durable(&post(&server, codec, &batch(7, next, samples.to_vec())));
        next += samples.len() as u64;
        let mark = answer.watermark;
        assert_eq!((mark.session, mark.durable, mark.applied), (7, next, next));
        assert_eq!(
            (mark.gap, mark.rejected, answer.duplicates),
            (None, vec![], 0)
        );
        // Durable means: even a kill at this moment takes nothing back.
        let before = Outcome::read(&server.api(), AGENT);
        server.kill();
        server.run();
        assert!(Outcome::read(&server.api(), AGENT) == before);
        assert_exactly_once(&server, AGENT, 7, usize::try_from(next).unwrap());
    }
}

#[test]
fn samples_beyond_a_gap_are_refused_with_the_number_that_is_next() {
    let server = Server::start(&[]);
    let samples = drive(seed(21), 60);
    // A new agent begins at zero, and so does a new session.
    for session in [7, 8] {
        let gap = post(
            &server,
            Codec::Json,
            &batch(session, 5, samples[5..].to_vec()),
        );
        let problem = gap.problem(409, "sequence-gap");
        assert_eq!(
            (&problem["session"], &problem["expected_seq"]),
            (&json!(session), &json!(0))
        );
        durable(&post(
            &server,
            Codec::Cbor,
            &batch(session, 0, samples[..20].to_vec()),
        ));
        let gap = post(
            &server,
            Codec::Cbor,
            &batch(session, 21, samples[21..].to_vec()),
        );
        let problem = gap.problem(409, "sequence-gap");
        assert_eq!(
            (&problem["session"], &problem["expected_seq"]),
            (&json!(session), &json!(20))
        );
    }
    let stale = post(
        &server,
        Codec::Postcard,
        &batch(7, 20, samples[20..].to_vec()),
    );
    let problem = stale.problem(409, "stale-session");
    assert_eq!(problem["session"], 8);
    let mark = server.api().agent("default", AGENT).unwrap().watermark;
    assert_eq!((mark.session, mark.durable, mark.gap), (8, 20, None));
}

#[test]
fn what_was_there_before_is_counted_and_otherwise_ignored() {
    let server = Server::start(&[]);
    let samples = drive(seed(22), 60);
    let send = |from: usize, to: usize| {
        let batch = batch(7, from as u64, samples[from..to].to_vec());
        durable(&post(&server, Codec::Postcard, &batch))
    };
    assert_eq!(send(0, 40).duplicates, 0);
    assert_eq!(send(0, 40).duplicates, 40);
    let overlap = send(30, 60);
    assert_eq!((overlap.duplicates, overlap.watermark.durable), (10, 60));
    assert_exactly_once(&server, AGENT, 7, 60);
    let calm = Server::start(&[]);
    post_all(&calm, AGENT, 7, &samples);
    assert!(Outcome::read(&calm.api(), AGENT) == Outcome::read(&server.api(), AGENT));
}

#[test]
fn what_cannot_be_read_is_a_problem_that_says_why() {
    let server = Server::start(&["engine.agents_max=1"]);
    let http = server.http();
    let good = batch(7, 0, drive(seed(23), 5));
    durable(&post(&server, Codec::Json, &good));
    let json = Codec::Json.encoding();
    for body in [
        "",
        "{",
        "[]",
        "null",
        "{\"session\": 7}",
        "{\"session\": -1, \"first_seq\": 0}",
    ] {
        http.post(PATH, json, body.as_bytes())
            .problem(400, "malformed-body");
    }
    let nan = "{\"session\":7,\"first_seq\":5,\"samples\":[{\"stamp_ns\":0,\"body\":\
        {\"level\":{\"channel\":\"a\",\"value\":NaN}}}]}";
    http.post(PATH, json, nan.as_bytes())
        .problem(400, "malformed-body");
    let cut = &Codec::Cbor.encode(&good)[..40];
    http.post(PATH, Codec::Cbor.encoding(), cut)
        .problem(400, "malformed-body");
    let v9 = "application/vnd.cogmap.postcard;v9";
    http.post(PATH, v9, b"")
        .problem(415, "unsupported-media-type");
    http.post(PATH, "text/plain", b"")
        .problem(415, "unsupported-media-type");
    let long = vec![b' '; (1 << 20) + 1];
    http.post(PATH, json, &long).problem(413, "body-too-long");
    let body = Codec::Json.encode(&good);
    let elsewhere = "/v1/spaces/nowhere/agents/ada/samples";
    http.post(elsewhere, json, &body)
        .problem(404, "unknown-space");
    let misnamed = "/v1/spaces/default/agents/.ada/samples";
    http.post(misnamed, json, &body)
        .problem(400, "invalid-path");
    let second = "/v1/spaces/default/agents/bea/samples";
    http.post(second, json, &body)
        .problem(409, "too-many-agents");
    // After all that it still takes what makes sense.
    let answer = durable(&post(&server, Codec::Json, &good));
    assert_eq!((answer.duplicates, answer.watermark.durable), (5, 5));
}
