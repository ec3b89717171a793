//! Point clouds in binary: all places, and what changed since a revision.

use std::collections::BTreeMap;

use super::*;

/// A place of a cloud: position \[m\], strength, visits and stamps \[s\].
type Vertex = ([f32; 3], f32, u32, f64, f64);

/// A cloud, as a program that reads the format has it.
#[derive(Debug)]
struct Cloud {
    revision: u64,
    since_revision: u64,
    places: BTreeMap<u64, Vertex>,
    forgotten: Vec<u64>,
}

impl Rig {
    async fn cloud(&self, space: &str, query: &str) -> Cloud {
        let path = format!("/v1/spaces/{space}/export?format=ply&encoding=binary{query}");
        let answer = self.get(&path).await;
        assert_eq!(answer.status, 200, "{answer:?}");
        assert_eq!(answer.header("content-type"), "application/octet-stream");
        assert_eq!(
            answer.header("content-length"),
            answer.body.len().to_string()
        );
        read(&answer.body, space)
    }
}

fn read(bytes: &[u8], space: &str) -> Cloud {
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|found| found == end);
    let (head, mut rest) = bytes.split_at(at.expect("a header") + end.len());
    let head = std::str::from_utf8(head).expect("a text");
    let lines: Vec<&str> = head.lines().collect();
    let number = |prefix: &str| -> Option<u64> {
        let rest = lines.iter().find_map(|line| line.strip_prefix(prefix))?;
        Some(rest.parse().expect("a number"))
    };
    assert_eq!(lines[..2], ["ply", "format binary_little_endian 1.0"]);
    assert_eq!(
        lines[2],
        format!("comment places of the cogmap space {space}")
    );
    let properties = "uint id,float x,float y,float z,float strength,uint visits,double first_s,\
        double last_s";
    let described: Vec<&str> = { lines.iter() }
        .filter_map(|line| line.strip_prefix("property "))
        .take(8)
        .collect();
    assert_eq!(described.join(","), properties);
    let mut take = |count: usize| {
        let (taken, left) = rest.split_at(count);
        rest = left;
        taken
    };
    let word = |bytes: &[u8]| u32::from_le_bytes(bytes.try_into().expect("four bytes"));
    let mut places = BTreeMap::new();
    for _ in 0..number("element vertex ").expect("vertices") {
        let id = word(take(4));
        let mut single = || f32::from_le_bytes(take(4).try_into().expect("four bytes"));
        let (position, strength) = ([single(), single(), single()], single());
        let visits = word(take(4));
        let mut double = || f64::from_le_bytes(take(8).try_into().expect("eight bytes"));
        let place = (position, strength, visits, double(), double());
        assert!(places.insert(id.into(), place).is_none(), "each once");
    }
    let count = number("element forgotten ").unwrap_or(0);
    let forgotten = (0..count).map(|_| word(take(4)).into()).collect();
    assert!(rest.is_empty(), "nothing is left over");
    Cloud {
        revision: number("comment revision ").expect("a revision"),
        since_revision: number("comment since_revision ").expect("a revision"),
        places,
        forgotten,
    }
}

#[tokio::test]
async fn a_binary_cloud_has_all_places_as_they_are() {
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 600)).await.good();
    let cloud = rig.cloud("lab", "").await;
    let page = rig.get("/v1/spaces/lab/places?limit=1000").await.good();
    let places = page["places"].as_array().expect("places");
    assert!(places.len() > 100);
    assert_eq!(cloud.places.len(), places.len());
    assert_eq!((cloud.since_revision, cloud.forgotten.len()), (0, 0));
    assert!(cloud.revision >= 600);
    for place in places {
        let id = place["id"].as_u64().expect("a number");
        let (at, strength, visits, first_s, last_s) = cloud.places[&id];
        for (axis, found) in at.into_iter().enumerate() {
            let exact = place["translation_m"][axis].as_f64().expect("a number");
            assert!((f64::from(found) - exact).abs() < 1e-5, "{place}");
        }
        let exact = place["strength"].as_f64().expect("a number");
        assert!((f64::from(strength) - exact).abs() < 1e-6, "{place}");
        assert_eq!(place["visits"], visits);
        let stamp_s = |field: &str| place[field].as_f64().expect("a number") / 1e9;
        assert!((first_s - stamp_s("first_stamp_ns")).abs() < 1e-6);
        assert!((last_s - stamp_s("last_stamp_ns")).abs() < 1e-6);
    }
}

#[tokio::test]
async fn what_changed_since_a_revision_brings_an_older_cloud_up_to_date() {
    let rig = rig();
    let created = rig
        .send(
            Method::PUT,
            "/v1/spaces/small",
            "application/json",
            "{\"places_max\": 300, \"legs_max\": 40}",
        )
        .await;
    created.good();
    let path = "/v1/spaces/small/agents/rover/samples";
    let send = async |first: u64, count: u64| {
        let batch = Codec::Json.encode(&steps(1, first, count));
        rig.send(Method::POST, path, "application/json", batch)
            .await
            .good();
    };
    send(0, 1000).await;
    let mut known = rig.cloud("small", "").await;
    let still = rig
        .cloud("small", &format!("&since_revision={}", known.revision))
        .await;
    assert_eq!(still.since_revision, known.revision);
    assert!(still.places.is_empty() && still.forgotten.is_empty());
    for (first, count) in [(1000, 10), (1010, 300), (1310, 5)] {
        send(first, count).await;
        let changed = rig
            .cloud("small", &format!("&since_revision={}", known.revision))
            .await;
        assert_eq!(changed.since_revision, known.revision);
        if count <= 10 {
            assert!(changed.places.len() < 200, "a part: {changed:?}");
        }
        let mut updated = known.places.clone();
        updated.extend(&changed.places);
        changed.forgotten.iter().for_each(|id| {
            updated.remove(id);
        });
        known = rig.cloud("small", "").await;
        assert_eq!(changed.revision, known.revision);
        let visits = |places: &BTreeMap<u64, Vertex>| -> Vec<_> {
            let places = places.iter();
            places.map(|(id, at)| (*id, at.0, at.2, at.4)).collect()
        };
        assert_eq!(visits(&updated), visits(&known.places));
    }
}

#[tokio::test]
async fn all_places_come_where_it_is_not_known_what_changed() {
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
    let (engine, space) = start();
    let agent = "rover".parse().expect("a name");
    space.ingest(&agent, steps(1, 0, 80)).await.expect("taken");
    let map = space.snapshot().await.expect("loaded");
    let revision = map.revision();
    assert!(space.knows_changes_since(40, &map));
    assert!(
        !space.knows_changes_since(revision + 1, &map),
        "of another past"
    );
    engine.shutdown();
    drop((engine, space));
    let (engine, space) = start();
    let map = space.snapshot().await.expect("loaded");
    assert!(
        !space.knows_changes_since(40, &map),
        "before the checkpoint"
    );
    assert!(space.knows_changes_since(revision, &map));
    engine.shutdown();
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 80)).await.good();
    let other_past = rig.cloud("lab", "&since_revision=99999").await;
    let all = rig.cloud("lab", "").await;
    assert_eq!(other_past.since_revision, 0);
    assert_eq!(other_past.places, all.places);
}
