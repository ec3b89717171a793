//! Events: their ids, pages, and streams that are taken up again.

use super::*;
use crate::engine::EVENTS_KEPT;

const EVENTS: &str = "/v1/spaces/lab/events";

impl Rig {
    /// One page of events.
    async fn page(&self, query: &str) -> Value {
        let path = format!("{EVENTS}?format=json&{query}");
        self.get(&path).await.good()
    }

    /// The first `count` lines of a stream that carry something, each as name and value.
    async fn stream(&self, query: &str, last_event_id: Option<&str>, count: usize) -> Vec<String> {
        use futures_util::StreamExt;
        let mut request = Request::get(format!("{EVENTS}?{query}"));
        if let Some(id) = last_event_id {
            request = request.header("last-event-id", id);
        }
        let request = request.body(Body::empty()).expect("a request");
        let response = self.router.clone().oneshot(request).await;
        let response = response.expect("infallible");
        assert_eq!(response.status(), 200);
        let mut body = response.into_body().into_data_stream();
        let mut text = String::new();
        while text.lines().filter(|line| !line.is_empty()).count() < count {
            let chunk = tokio::time::timeout(Duration::from_secs(20), body.next()).await;
            let chunk = chunk.unwrap_or_else(|_| panic!("no more after:\n{text}"));
            let chunk = chunk.expect("the stream goes on").expect("readable");
            text.push_str(std::str::from_utf8(&chunk).expect("a text"));
        }
        let lines = text.lines().filter(|line| !line.is_empty());
        lines.take(count).map(str::to_owned).collect()
    }
}

fn ids(page: &Value) -> Vec<String> {
    let events = page["events"].as_array().expect("a list").iter();
    events
        .map(|event| event["id"].as_str().expect("an id").to_owned())
        .collect()
}

#[tokio::test]
async fn pages_join_to_all_events_in_the_order_of_their_ids() {
    let rig = rig();
    let empty = rig.page("").await;
    assert_eq!(
        (&empty["events"], &empty["next"]),
        (&serde_json::json!([]), &Value::Null)
    );
    for agent in ["rover", "other"] {
        rig.samples(agent, &steps(1, 0, 60)).await.good();
    }
    let all = rig.page("limit=1000").await;
    let all_ids = ids(&all);
    assert!(all_ids.len() > 8, "{all}");
    let first = &all["events"][0];
    assert_eq!(
        first["id"], "1-0",
        "the first record enrols an agent: {first}"
    );
    assert_eq!(
        first["event"]["kind"],
        serde_json::json!({ "agent_enrolled": {} })
    );
    for event in all["events"].as_array().expect("a list") {
        let id = event["id"].as_str().expect("an id");
        let (revision, _) = id.split_once('-').expect("a revision and an index");
        assert_eq!(
            event["event"]["map_revision"].to_string(),
            revision,
            "{event}"
        );
    }
    let (mut joined, mut after) = (Vec::new(), "0-0".to_owned());
    loop {
        let page = rig.page(&format!("limit=3&after={after}")).await;
        assert_eq!(page["missed"], Value::Null, "{page}");
        let page_ids = ids(&page);
        if page_ids.is_empty() {
            assert_eq!(page["next"], after, "it can be asked again");
            break;
        }
        assert!(page_ids.len() <= 3);
        after = page["next"].as_str().expect("an id").to_owned();
        joined.extend(page_ids);
    }
    assert_eq!(joined, all_ids);
    let of_other = rig.page("agent=other&limit=1000").await;
    let others = of_other["events"].as_array().expect("a list");
    assert!(!others.is_empty() && others.len() < all_ids.len());
    assert!(
        others
            .iter()
            .all(|event| event["event"]["agent"] == "other")
    );
}

#[tokio::test]
async fn a_stream_goes_on_after_the_event_that_its_reader_had_last() {
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 60)).await.good();
    let all = ids(&rig.page("limit=1000").await);
    let from_start = rig.stream("after=0-0", None, 6).await;
    assert_eq!(from_start[1], "event: message", "{from_start:?}");
    assert!(from_start[2].starts_with("data: {"), "{from_start:?}");
    let of = |lines: &[String]| -> Vec<String> {
        let ids = lines.iter().filter_map(|line| line.strip_prefix("id: "));
        ids.map(str::to_owned).collect()
    };
    let both = of(&from_start);
    assert_eq!(both, all[..2]);
    // The header comes from a reader that knows more than the address it began with.
    let resumed = rig.stream("after=0-0", Some(&all[1]), 3).await;
    assert_eq!(of(&resumed), all[2..3], "{resumed:?}");
    // What happens later follows.
    let last = all.last().expect("there are events").clone();
    let (lines, _) = tokio::join!(rig.stream("", Some(&last), 3), async {
        rig.samples("rover", &at(1, 60, end_of_trip())).await.good()
    });
    assert!(
        of(&lines)[0] > last || of(&lines)[0].len() > last.len(),
        "{lines:?}"
    );
    for wrong in ["7", "x-1", "1-", "-1-0", "+1-0"] {
        let wrong = wrong.replace('+', "%2B");
        rig.get(&format!("{EVENTS}?after={wrong}"))
            .await
            .problem(400, "invalid-parameter");
    }
    rig.get(&format!("{EVENTS}?limit=3"))
        .await
        .problem(422, "invalid-query");
}

#[tokio::test]
async fn whoever_falls_behind_is_told_how_many_events_it_missed() {
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 2)).await.good();
    let space = rig.engine.space("lab").expect("it is there");
    let mut slow = space.follow(None).expect("it has loaded");
    let marks = |first: u64| SampleBatch {
        session: 1,
        first_seq: first,
        samples: (first..first + 600)
            .map(|seq| at(1, seq, end_of_trip()).samples[0].clone())
            .collect(),
    };
    rig.samples("rover", &marks(2)).await.good();
    rig.samples("rover", &marks(602)).await.good();
    let followed = slow.take(10);
    let missed = followed.missed.expect("more happened than is kept");
    let kept = EVENTS_KEPT as u64;
    // The two batches end one trip and pass 1200 markers.
    let page = rig.page("limit=1000").await;
    assert!(
        missed
            .events
            .is_some_and(|missed| (1200 - kept..1210 - kept).contains(&missed))
    );
    assert_eq!(
        missed.next.map(|id| id.to_string()),
        Some(ids(&page)[0].clone())
    );
    assert_eq!(slow.take(10).missed, None, "told once");
    // Who comes back later than that is told so too; nobody counted for it.
    let lines = rig.stream("", Some("1-0"), 3).await;
    assert_eq!(lines[0], "event: missed", "{lines:?}");
    let data = lines[1].strip_prefix("data: ").expect("data");
    let told: Value = serde_json::from_str(data).expect("JSON");
    assert_eq!(
        (&told["events"], &told["next"]),
        (&Value::Null, &page["events"][0]["id"])
    );
    let page = rig.page("after=1-0&limit=1").await;
    assert_eq!(page["missed"], told);
    // An id that the space never had is of another past.
    let page = rig.page("after=99999-0&limit=1").await;
    assert!(page["missed"].is_object(), "{page}");
}

#[tokio::test]
async fn events_keep_their_ids_over_a_restart_and_in_a_replay() {
    let directory = tempfile::tempdir().expect("a temporary directory");
    let start = || {
        let store = LocalStore::open(directory.path()).expect("the store opens");
        let settings = EngineSettings::default();
        let engine = Engine::open(Arc::new(store), settings, Arc::new(Silent)).expect("opens");
        let name = "lab".parse().expect("a name");
        let created = engine.create_space(&name, &SpaceSettings::default());
        let (space, _) = created.expect("created");
        while space.recovering() {
            std::thread::sleep(Duration::from_millis(1));
        }
        (engine, space)
    };
    let all = |space: &crate::engine::Space| {
        let mut follower = space
            .follow(Some("0-0".parse().expect("an id")))
            .expect("loaded");
        let followed = follower.take(EVENTS_KEPT);
        assert_eq!(followed.missed, None);
        followed.events
    };
    let (engine, space) = start();
    let agent = "rover".parse().expect("a name");
    space.ingest(&agent, steps(1, 0, 80)).await.expect("taken");
    let before = all(&space);
    assert!(before.len() > 8);
    engine.shutdown();
    drop((engine, space));
    // The checkpoint has them.
    let (engine, space) = start();
    assert_eq!(all(&space), before);
    engine.shutdown();
    drop((engine, space));
    // Without it the journal tells the same.
    let store = LocalStore::open(directory.path()).expect("the store opens");
    let stored = &crate::store::Journal::spaces(&store).expect("readable")[0];
    crate::store::Derived::forget(&store, stored.number).expect("forgotten");
    drop(store);
    let (engine, space) = start();
    assert_eq!(all(&space), before);
    engine.shutdown();
}
