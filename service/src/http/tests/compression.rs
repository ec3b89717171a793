//! Compression: long texts, for those who take them so.

use super::*;

impl Rig {
    async fn taking(&self, path: &str, encodings: &str) -> Answer {
        let request = Request::get(path).header("accept-encoding", encodings);
        let request = request.body(Body::empty()).expect("a request");
        self.ask(request).await
    }
}

#[tokio::test]
async fn long_answers_are_short_on_the_way_and_the_same_at_the_end() {
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 600)).await.good();
    for path in [
        "/v1/spaces/lab/places?limit=1000",
        "/v1/spaces/lab/export",
        "/v1/spaces/lab/export?format=ply",
        "/openapi.json",
    ] {
        let plain = rig.get(path).await;
        assert_eq!(plain.header("content-encoding"), "", "{path}");
        let packed = rig.taking(path, "gzip, deflate, br").await;
        assert_eq!(packed.header("content-encoding"), "gzip", "{path}");
        assert!(packed.header("vary").contains("accept-encoding"), "{path}");
        assert!(packed.body.len() * 2 < plain.body.len(), "{path}");
        let mut unpacked = Vec::new();
        let mut unpacker = flate2::read::GzDecoder::new(&*packed.body);
        io::Read::read_to_end(&mut unpacker, &mut unpacked).expect("gzip");
        assert_eq!(unpacked, plain.body, "{path}");
    }
}

#[tokio::test]
async fn short_answers_and_numbers_in_binary_are_sent_as_they_are() {
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 600)).await.good();
    for path in [
        "/v1",
        "/healthz",
        "/v1/spaces/lab",
        "/v1/spaces/lab/agents/rover",
        "/v1/spaces/lab/export?format=ply&encoding=binary",
    ] {
        let answer = rig.taking(path, "gzip").await;
        assert_eq!(answer.status, 200);
        assert_eq!(answer.header("content-encoding"), "", "{path}");
    }
}

#[tokio::test]
async fn streams_are_not_held_back_by_compression() {
    use futures_util::StreamExt;
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 60)).await.good();
    for path in ["/v1/spaces/lab/events?after=0-0", "/v1/spaces/lab/live"] {
        let request = Request::get(path).header("accept-encoding", "gzip");
        let request = request.body(Body::empty()).expect("a request");
        let response = rig.router.clone().oneshot(request).await;
        let response = response.expect("infallible");
        assert!(
            !response.headers().contains_key("content-encoding"),
            "{path}"
        );
        let mut body = response.into_body().into_data_stream();
        let first = tokio::time::timeout(Duration::from_secs(20), body.next()).await;
        let first = first.expect("at once").expect("one").expect("readable");
        assert!(
            first.starts_with(b"id: ") || first.starts_with(b"event: "),
            "{path}"
        );
    }
}
