//! The HTTP client against a server of canned answers.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use cogmap_proto::{
    Codec, LocalizeQuery, Marker, Problem, RecallQuery, Sample, SampleBatch, SampleBody,
    StampedPose, Status, Trajectory,
};

use super::{Api, ApiError};

mod retry;

/// One request as the server saw it.
struct Seen {
    /// Request line and headers, header names in lower case.
    head: Vec<String>,
    body: Vec<u8>,
}

/// Serves the answers in turn on a free port; hands back the base address and the requests.
fn serve(answers: Vec<(u16, String)>) -> (String, Receiver<Seen>) {
    let answers = answers.into_iter();
    serve_with(answers.map(|(status, body)| (status, "", body)).collect())
}

/// The same with header lines, each with its end.
fn serve_with(answers: Vec<(u16, &'static str, String)>) -> (String, Receiver<Seen>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let base = format!("http://{}/", listener.local_addr().unwrap());
    let (sender, seen) = channel();
    thread::spawn(move || {
        for (status, headers, answer) in answers {
            let (mut stream, _) = listener.accept().unwrap();
            let mut reader = BufReader::new(stream.try_clone().unwrap());
            let mut head = Vec::new();
            loop {
                let mut line = String::new();
                reader.read_line(&mut line).unwrap();
                match line.trim_end() {
                    "" => break,
                    line => head.push(line.to_owned()),
                }
            }
            let length = head
                .iter()
                .find_map(|line| line.strip_prefix("content-length: "));
            let mut body = vec![0; length.map_or(0, |length| length.parse().unwrap())];
            reader.read_exact(&mut body).unwrap();
            let length = answer.len();
            // A client may have what it asked for before the test looks at what it sent.
            sender.send(Seen { head, body }).unwrap();
            write!(
                stream,
                "HTTP/1.1 {status} x\r\n{headers}connection: close\r\n\
                 content-length: {length}\r\n\r\n{answer}"
            )
            .unwrap();
        }
    });
    (base, seen)
}

fn trajectory(stamps: &[i64], next_from_ns: Option<i64>) -> (u16, String) {
    let poses = stamps
        .iter()
        .map(|&stamp_ns| StampedPose {
            stamp_ns,
            translation_m: [0.0; 3],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        })
        .collect();
    let page = Trajectory {
        agent: "ada".to_owned(),
        session: 1,
        frame: "map".to_owned(),
        kind: "causal".to_owned(),
        map_revision: None,
        poses,
        next_from_ns,
    };
    (200, serde_json::to_string(&page).unwrap())
}

#[test]
fn a_trajectory_is_read_to_its_last_page() {
    let (base, seen) = serve(vec![
        trajectory(&[1, 2], Some(3)),
        trajectory(&[3, 4], Some(5)),
        trajectory(&[5], None),
    ]);
    let whole = Api::new(&base, None).trajectory("demo", "ada").unwrap();
    let stamps: Vec<_> = whole.poses.iter().map(|pose| pose.stamp_ns).collect();
    assert_eq!((stamps, whole.next_from_ns), (vec![1, 2, 3, 4, 5], None));
    let asked: Vec<_> = seen.iter().map(|seen| seen.head[0].clone()).collect();
    let path = "GET /v1/spaces/demo/agents/ada/trajectory?kind=causal&limit=1000";
    assert_eq!(
        asked,
        [
            format!("{path} HTTP/1.1"),
            format!("{path}&from_ns=3 HTTP/1.1"),
            format!("{path}&from_ns=5 HTTP/1.1"),
        ]
    );
}

#[test]
fn pages_follow_labels_with_any_characters() {
    let landmark = |id: &str| {
        format!(
            r#"{{"id":"{id}","translation_m":[0,0,0],"covariance":[0,0,0,0,0,0],
               "sightings":1,"first_stamp_ns":0,"last_stamp_ns":0}}"#
        )
    };
    let page = |id: &str, next: &str| {
        let landmark = landmark(id);
        (
            200,
            format!(r#"{{"frame":"map","landmarks":[{landmark}],"next":{next}}}"#),
        )
    };
    let (base, seen) = serve(vec![page("a&b ö", r#""a&b ö""#), page("z", "null")]);
    let landmarks = Api::new(&base, None).landmarks("demo").unwrap();
    let labels: Vec<_> = landmarks.iter().map(|landmark| &landmark.id).collect();
    assert_eq!(labels, ["a&b ö", "z"]);
    let asked: Vec<_> = seen.iter().map(|seen| seen.head[0].clone()).collect();
    assert_eq!(
        asked[1],
        "GET /v1/spaces/demo/landmarks?limit=1000&after=a%26b%20%C3%B6 HTTP/1.1"
    );
}

#[test]
fn samples_go_out_as_postcard_with_the_token() {
    let answer = r#"{"watermark":{"session":5,"durable":3,"applied":3,"gap":null,"rejected":[]},
                     "duplicates":0}"#;
    let (base, seen) = serve(vec![(200, answer.to_owned())]);
    let batch = SampleBatch {
        session: 5,
        first_seq: 2,
        samples: vec![Sample {
            stamp_ns: 9,
            body: SampleBody::Marker(Marker {
                label: "dock".to_owned(),
                ends_trip: true,
            }),
        }],
    };
    let answer = Api::new(&base, Some("secret"))
        .post_samples("demo", "ada", &batch)
        .unwrap();
    assert_eq!(answer.watermark.durable, 3);
    let seen = seen.recv().unwrap();
    assert_eq!(
        seen.head[0],
        "POST /v1/spaces/demo/agents/ada/samples HTTP/1.1"
    );
    assert!(
        seen.head
            .contains(&"authorization: Bearer secret".to_owned())
    );
    assert!(
        seen.head
            .contains(&format!("content-type: {}", Codec::Postcard.encoding()))
    );
    assert_eq!(Codec::Postcard.decode_batch(&seen.body), Ok(batch));
}

#[test]
fn samples_are_localised() {
    let answer = r#"{"space":"demo","frame":"map","map_revision":7,"status":"uncertain","pose":null,
        "found_after":null,"hypotheses":[{"pose":{"translation_m":[1,2,0],"rotation_xyzw":[0,0,0,1],
        "covariance":[1,0,0,0,0,0,1,0,0,0,0,1,0,0,0,1,0,0,1,0,1]},"probability":0.5,"looks":3}]}"#;
    let (base, seen) = serve(vec![(200, answer.to_owned())]);
    let query = LocalizeQuery {
        samples: vec![Sample {
            stamp_ns: 9,
            body: SampleBody::Marker(Marker {
                label: "dock".to_owned(),
                ends_trip: false,
            }),
        }],
    };
    let found = Api::new(&base, None).localize("demo", &query).unwrap();
    assert_eq!((found.status, found.pose), (Status::Uncertain, None));
    assert_eq!(found.hypotheses[0].looks, 3);
    let seen = seen.recv().unwrap();
    assert_eq!(seen.head[0], "POST /v1/spaces/demo/localize HTTP/1.1");
    assert_eq!(Codec::Json.decode(&seen.body), Ok(query));
}

#[test]
fn a_problem_is_told_as_the_service_put_it() {
    let problem = Problem {
        kind: "/problems/unknown-space".to_owned(),
        title: "Unknown space".to_owned(),
        status: 404,
        detail: "there is no space \"demo\"".to_owned(),
    };
    let (base, _seen) = serve(vec![
        (404, serde_json::to_string(&problem).unwrap()),
        (502, "<html>bad gateway</html>".to_owned()),
        (200, "{}".to_owned()),
    ]);
    let api = Api::new(&base, None);
    let error = api.recall("demo", &RecallQuery::default()).unwrap_err();
    assert!(matches!(&error, ApiError::Problem(told) if *told == problem));
    assert_eq!(
        error.to_string(),
        "Unknown space: there is no space \"demo\" (404)"
    );
    assert!(matches!(
        api.spaces(),
        Err(ApiError::Status { status: 502, body }) if body.contains("bad gateway")
    ));
    assert!(matches!(api.spaces(), Err(ApiError::Answer { .. })));
}

#[test]
fn readiness_is_yes_no_or_an_error() {
    let (base, _seen) = serve(vec![
        (200, "ready".to_owned()),
        (503, "recovering".to_owned()),
        (401, "who?".to_owned()),
    ]);
    let api = Api::new(&base, None);
    assert!(api.ready().unwrap());
    assert!(!api.ready().unwrap());
    assert!(matches!(
        api.ready(),
        Err(ApiError::Status { status: 401, .. })
    ));
}

#[test]
fn a_name_that_would_change_the_path_is_refused_before_asking() {
    let api = Api::new("http://127.0.0.1:1", None);
    for name in ["", "../admin", "a/b", "a?b"] {
        assert!(
            matches!(api.space(name), Err(ApiError::Name(_))),
            "{name:?}"
        );
        assert!(matches!(api.agent("demo", name), Err(ApiError::Name(_))));
    }
    assert!(matches!(api.space("demo"), Err(ApiError::Transport(_))));
}
